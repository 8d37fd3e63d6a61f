"""Runs DVS-Voltmeter (https://github.com/Lynn0306/DVS-Voltmeter) for `esim evaluate realism`:

    esim evaluate realism recordings --program 'Voltmeter=python3 bench/simulators/dvs_voltmeter.py DVS-Voltmeter {frames} {events}'

It gets the frames as linear intensity from 0 to 255. --model sets its six parameters k1 to k6. By default, they are those
that its src/config.py uses, of a DAVIS346; the file also has those of a DAVIS240. Needs numpy, OpenCV, torch and easydict.
"""

import argparse
import sys

import numpy as np
from clips import read_frames, write_events

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("source", help="folder of DVS-Voltmeter, which contains src/")
parser.add_argument("frames", help="folder with images.csv")
parser.add_argument("events", help="file to write")
parser.add_argument("--model", type=float, nargs=6, metavar="K", help="k1 to k6")
arguments = parser.parse_args()

sys.path.insert(0, arguments.source)
try:
    import torch
    from src.config import cfg
    from src.simulator import EventSim
except ImportError as error:
    raise SystemExit(f"DVS-Voltmeter cannot be imported from {arguments.source} ({error})") from error

if arguments.model:
    cfg.SENSOR.K = arguments.model
np.random.seed(0)
torch.manual_seed(0)
simulator = EventSim(cfg=cfg, output_folder="", video_name="")
events = []
for t, image in read_frames(arguments.frames):
    found = simulator.generate_events(255 * image, t // 1000)
    if found is not None:
        events += ((1e-6 * int(us), x, y, p) for us, x, y, p in found)
write_events(arguments.events, events)
