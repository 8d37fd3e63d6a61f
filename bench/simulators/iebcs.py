"""Runs IEBCS (https://github.com/neuromorphicsystems/IEBCS) for `esim evaluate realism`:

    esim evaluate realism recordings --program 'IEBCS=python3 bench/simulators/iebcs.py IEBCS/src {frames} {events}'

White is 1 klux. The parameters are those of its example for videos, without a measured noise distribution. --arbiter uses
its synchronous arbiter. Needs numpy, OpenCV and the packages that IEBCS needs.
"""

import argparse
import sys

import numpy as np
from clips import read_frames, write_events

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("source", help="folder src of IEBCS")
parser.add_argument("frames", help="folder with images.csv")
parser.add_argument("events", help="file to write")
parser.add_argument("--arbiter", action="store_true")
arguments = parser.parse_args()

sys.path.insert(0, arguments.source)
from arbiter import SynchronousArbiter  # noqa: E402
from dvs_sensor import DvsSensor  # noqa: E402

WHITE_LUX = 1000
np.random.seed(0)
sensor = arbiter = before_us = None
events = []
for t, image in read_frames(arguments.frames):
    t_us, lux = t // 1000, image * WHITE_LUX
    if sensor is None:
        sensor = DvsSensor("esim")
        sensor.initCamera(lux.shape[1], lux.shape[0], lat=100, jit=10, ref=100, tau=40, th_pos=0.4, th_neg=0.4, th_noise=0.01,
                          bgnp=0.1, bgnn=0.01)
        sensor.init_image(lux)
        arbiter = SynchronousArbiter(0.1, 0, lux.shape[0]) if arguments.arbiter else None
    else:
        found = sensor.update(lux, t_us - before_us)
        if arbiter is not None:
            found = arbiter.process(found, t_us - before_us)
        if found is not None:
            columns = (found.get_ts(), found.get_x(), found.get_y(), found.get_p())
            events += ((1e-6 * int(us), x, y, p) for us, x, y, p in zip(*columns))
    before_us = t_us
write_events(arguments.events, events)
