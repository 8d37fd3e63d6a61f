"""Short clips of rotations with a constant rate, as windows with their optical flow: the excerpts of the Event Camera Dataset
of https://github.com/tub-rip/event_based_image_rec_inverse_problem, which `esim evaluate realism` reads, too.

A clip is a folder with events.txt (t x y p), motion.txt (angular rate in the camera's axes, rad/s), calib.txt and flow.npy
(1, 2, height, width), of which only the size is used: it was computed without the distortion of the lens.
"""

import pathlib
from dataclasses import dataclass

import numpy as np

import esim
from evaluate_rotation import evaluate
from rotation_truth import Calibration, Gyroscope, sharpest_rate


@dataclass(frozen=True)
class Clip:
    """`truths`: from names to `Gyroscope`: "motion.txt", and "sharpest", the rate that fits the events best."""

    name: str
    events: pathlib.Path
    calibration: Calibration
    start: int  # ns
    end: int
    truths: dict

    def rows(self, truth, predict, window_s, keep=0):
        """Errors in consecutive windows, and windows to draw: see `evaluate_rotation.evaluate`."""
        rows, kept, _ = evaluate(self.events, self.calibration, self.truths[truth], predict, window_s=window_s, keep=keep)
        return rows, kept

    def within(self, t0_s, window_s, part):
        """Whether a window overlaps the part FROM to TO (fractions of the duration) of the clip."""
        t0 = round(t0_s * 1e9) - self.start
        low, high = (fraction * (self.end - self.start) for fraction in part)
        return t0 < high and t0 + window_s * 1e9 > low


def read_clip(folder):
    """Raises esim.Error for what is missing or damaged."""
    folder = pathlib.Path(folder)
    try:
        height, width = np.load(folder / "flow.npy", mmap_mode="r").shape[-2:]
    except (OSError, ValueError) as problem:
        raise esim.Error(f"cannot read {folder / 'flow.npy'}, which tells the sensor's size: {problem}") from None
    calibration = Calibration.read(folder / "calib.txt", width, height)
    events = esim.load_events(folder / "events.txt", width=width, height=height)
    if len(events) < 2:
        raise esim.Error(f"{folder / 'events.txt'}: has {len(events)} events; a clip needs at least two")
    start, end = int(events["t"][0]), int(events["t"][-1])
    given = Gyroscope.constant(folder / "motion.txt", start, end)
    sharpest = sharpest_rate(events, calibration, given.rate[0], start)
    truths = {"motion.txt": given, "sharpest": Gyroscope(given.t, np.stack([sharpest, sharpest]))}
    return Clip(folder.name, folder / "events.txt", calibration, start, end, truths)


def read_clips(folder):
    """The clips in a folder, by name."""
    found = sorted(path.parent for path in pathlib.Path(folder).glob("*/motion.txt"))
    if not found:
        raise esim.Error(f"{folder} contains no clip, which is a folder with a motion.txt")
    return [read_clip(path) for path in found]
