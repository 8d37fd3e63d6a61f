"""Measures the bursts that the exposure of frames causes in two real clips, and in simulated events of the same scenes:

    bench/sensors/frame_bursts.py RECORDINGS [EVENTS PERIOD_S EXPOSURE_S]

RECORDINGS holds davis240c_poster_rotation/ and davis240c_shapes_rotation/ (docs/methods/realism.md). EVENTS is a text file of
`esim video` on the frames of a clip; its frames are centred on multiples of PERIOD_S. A burst is the number of events of one
polarity within 150 us, minus the number expected from the millisecond before. Needs numpy.
"""

import pathlib
import sys

import numpy as np

EXPOSURE_S = 0.00602  # of the real frames; they end every 44.06 ms
ENDS_S = {"davis240c_poster_rotation": [0.01544], "davis240c_shapes_rotation": [0.00496, 0.04902, 0.09308]}


def burst(t, begin):
    there = np.count_nonzero((t >= begin - 2e-5) & (t < begin + 13e-5))
    return there - 0.15 * np.count_nonzero((t >= begin - 102e-5) & (t < begin - 2e-5))


def report(name, t, p, starts, ends):
    off = [burst(t[p <= 0], begin) for begin in starts if begin > 2e-3]
    on = [burst(t[p > 0], end) for end in ends]
    print(f"{name}: {np.mean(on):.0f} ON events at the end of an exposure ({len(on)}), {np.mean(off):.0f} OFF at its start ({len(off)})")


def load(path):
    events = np.loadtxt(path)
    return events[:, 0], events[:, 3]


folder = pathlib.Path(sys.argv[1])
for clip, ends in ENDS_S.items():
    t, p = load(folder / clip / "events.txt")
    report(clip, t - t[0], p, [end - EXPOSURE_S for end in ends], ends)
if len(sys.argv) > 2:
    t, p = load(sys.argv[2])
    period, exposure = float(sys.argv[3]), float(sys.argv[4])
    centres = [k * period for k in range(3, int(t[-1] / period))]
    report(sys.argv[2], t, p, [c - exposure / 2 for c in centres], [c + exposure / 2 for c in centres])
