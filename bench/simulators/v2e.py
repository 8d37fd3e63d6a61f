"""Runs v2e (https://github.com/SensorsINI/v2e) for `esim evaluate realism`:

    esim evaluate realism recordings --program 'v2e=python3 bench/simulators/v2e.py --source v2e {frames} {events}'

Its emulator gets the frames as linear intensity from 0 to 255, without interpolation: their times are close enough. Needs
numpy, OpenCV, and v2e, or --source with a folder that contains v2ecore/ and the packages that v2ecore imports, such as
torch, h5py, numba, easygui (with Python's tkinter), screeninfo, engineering-notation and dv_processing.
"""

import argparse
import sys

import numpy as np
from clips import read_frames, write_events

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("frames", help="folder with images.csv")
parser.add_argument("events", help="file to write")
parser.add_argument("--source", help="folder of v2e, if it is not installed")
parser.add_argument("--model", choices=["noisy", "clean"], default="noisy", help="v2e's own sets of parameters (default: noisy)")
parser.add_argument("--device", default="cpu", help="of PyTorch (default: cpu)")
arguments = parser.parse_args()

if arguments.source:
    sys.path.insert(0, arguments.source)
try:
    from v2ecore.emulator import EventEmulator
except ImportError as error:
    raise SystemExit(f"v2e cannot be imported ({error}); install it with its packages, or name its folder with --source") from error

emulator = None
events = []
for t, image in read_frames(arguments.frames):
    if emulator is None:
        emulator = EventEmulator(seed=1, device=arguments.device, output_width=image.shape[1], output_height=image.shape[0])
        emulator.set_dvs_params(arguments.model)
    found = emulator.generate_events(255 * image, t * 1e-9)
    if found is not None:
        events += ((float(s), x, y, p > 0) for s, x, y, p in np.asarray(found)[:, :4])
write_events(arguments.events, events)
