"""Runs IEBCS (https://github.com/neuromorphicsystems/IEBCS) for `esim evaluate realism`:

    esim evaluate realism recordings --program 'IEBCS=python3 bench/simulators/iebcs.py IEBCS/src {frames} {events}'

White is 1 klux. The parameters are those of its example for videos, without a measured noise distribution. --arbiter uses
its synchronous arbiter. Needs numpy, OpenCV and the packages that IEBCS needs.
"""

import argparse
import pathlib
import sys

import cv2
import numpy as np

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("source", help="folder src of IEBCS")
parser.add_argument("frames", type=pathlib.Path, help="folder with images.csv")
parser.add_argument("events", help="file to write")
parser.add_argument("--arbiter", action="store_true")
arguments = parser.parse_args()

sys.path.insert(0, arguments.source)
from arbiter import SynchronousArbiter  # noqa: E402
from dvs_sensor import DvsSensor  # noqa: E402

WHITE_LUX = 1000
np.random.seed(0)
frames = [line.split(",") for line in (arguments.frames / "images.csv").read_text().split()]
times_us = [int(t) // 1000 for t, _ in frames]


def image(k):
    return cv2.imread(str(arguments.frames / frames[k][1]), cv2.IMREAD_UNCHANGED) / 65535 * WHITE_LUX


sensor = DvsSensor("esim")
first = image(0)
sensor.initCamera(first.shape[1], first.shape[0], lat=100, jit=10, ref=100, tau=40, th_pos=0.4, th_neg=0.4, th_noise=0.01,
                  bgnp=0.1, bgnn=0.01)
sensor.init_image(first)
arbiter = SynchronousArbiter(0.1, 0, first.shape[0]) if arguments.arbiter else None
parts = []
for k in range(1, len(frames)):
    step_us = times_us[k] - times_us[k - 1]
    events = sensor.update(image(k), step_us)
    if arbiter is not None:
        events = arbiter.process(events, step_us)
    if events is not None:
        parts.append(np.stack([c.astype(np.int64) for c in (events.get_ts(), events.get_x(), events.get_y(), events.get_p())]))
all_events = np.concatenate(parts, axis=1)
all_events = all_events[:, np.argsort(all_events[0], kind="stable")]
with open(arguments.events, "w") as file:
    file.writelines(f"{t * 1e-6:.6f} {x} {y} {p}\n" for t, x, y, p in all_events.T.tolist())
