#!/usr/bin/env python3
"""Evaluates a network trained on simulated events on the optical flow of a real recording of pure rotation.

    evaluate_rotation.py RECORDING [--checkpoint FILE] [--out FOLDER]

RECORDING is a folder in the Event Camera Dataset's layout (`boxes_rotation`, unpacked): events.txt, imu.txt, calib.txt,
and images.txt, which gives the sensor's size. The truth comes from the gyroscope: `rotation_truth`. Without a
checkpoint, it reports the error of predicting no motion. See docs/methods/learning.md.
"""

import argparse
import csv
import itertools
import json
import pathlib
import sys

import numpy as np

import esim
from rotation_truth import Calibration, Gyroscope, parse_axes, sharpness

SHARP_RAD = 0.15  # events of a rotation by this angle at the start of a window test the axes of the IMU
SHARP_WINDOWS = 4  # the fastest for each axis


def end_point_errors(predicted, truth, fired):
    """|predicted - truth| of the pixels with events and known truth, px: (N,)."""
    known = fired & np.isfinite(truth).all(axis=0)
    return np.linalg.norm(predicted[:, known] - truth[:, known], axis=0)


class AxesCheck:
    """Tests whether events agree with the gyroscope's axes, from the fastest rotations about each axis."""

    def __init__(self, calibration, gyroscope):
        self.calibration, self.gyroscope = calibration, gyroscope
        self.fastest = [[] for _ in range(3)]  # of each axis: (rate, t0, events)

    def add(self, t0, t1, events):
        rate = self.gyroscope.at(t0)
        axis = np.abs(rate).argmax()
        end = min(t1, t0 + SHARP_RAD / max(np.linalg.norm(rate), 1e-3) * 1e9)
        events = events[events["t"] < end]
        if len(events) > 100:
            kept = [*self.fastest[axis], (abs(rate[axis]), t0, self.gyroscope.at((t0 + end) / 2), events)]
            self.fastest[axis] = sorted(kept, key=lambda entry: entry[:2])[-SHARP_WINDOWS:]

    def best(self):
        """Of all 48 permutations and signs of axes, the one that fits the events best, (3, 3), and the ratio of the
        sharpness of the image of events with it to that with the given axes."""
        windows = [window for axis in self.fastest for window in axis]
        if not windows:
            return np.eye(3), 1.0
        scores = {}
        for order in itertools.permutations(range(3)):
            for signs in itertools.product((1, -1), repeat=3):
                change = np.eye(3)[list(order)] * np.array(signs)[:, None]
                scores[tuple(change.ravel())] = np.mean(
                    [sharpness(events, self.calibration, change @ rate, t0) for _, t0, rate, events in windows])
        best = max(scores, key=scores.get)
        return np.reshape(best, (3, 3)), scores[best] / scores[tuple(np.eye(3).ravel())]


def evaluate(events_path, calibration, gyroscope, predict=None, *, window_s=0.04, start_s=None, duration_s=None, keep=0):
    """Errors of a prediction in consecutive windows.

    Parameters
    ----------
    predict : callable, optional
        Of an event tensor, float32 (4, height, width), `esim.event_tensor`'s: the optical flow from the window's start
        to its end, float (2, height, width) px. No motion without.
    start_s, duration_s : float, optional
        What is evaluated, in s of the recording's clock; all that the gyroscope covers without.
    keep : int
        How many windows to keep in full, spread over the time.

    Returns
    -------
    rows : list of dict
        Of each window with events: t0_s, events, pixels (with events), truth_px (mean length), epe_px, zero_epe_px (of no
        motion), outliers (share of errors above 3 px).
    kept : list of (tensor, predicted, truth)
    check : AxesCheck

    Raises esim.Error for damaged files, and where no window has events and rates.
    """
    window = round(window_s * 1e9)
    start = int(gyroscope.t[0]) if start_s is None else round(start_s * 1e9)
    end = int(gyroscope.t[-1]) if duration_s is None else min(int(gyroscope.t[-1]), start + round(duration_s * 1e9))
    count = (end - start) // window
    if start < gyroscope.t[0] or count < 1:
        raise esim.Error(f"no window of {window_s:g} s fits between the start and the gyroscope's last measurement "
                         f"at {gyroscope.t[-1] * 1e-9:.3f} s, or it starts before its first at {gyroscope.t[0] * 1e-9:.3f} s")
    shape = calibration.width, calibration.height
    check, rows, kept = AxesCheck(calibration, gyroscope), [], []
    every = max(1, count // max(keep, 1))
    reader = esim.EventsIterator(events_path, delta_t=esim.ns(window), start=esim.ns(start), width=shape[0], height=shape[1])
    for index, events in enumerate(itertools.islice(reader, count)):
        if not len(events):
            continue
        t0, t1 = start + index * window, start + (index + 1) * window
        tensor = esim.event_tensor(events, *shape, t0=esim.ns(t0), t1=esim.ns(t1))
        truth = calibration.optical_flow(gyroscope.rotation(t0, t1))
        predicted = np.zeros_like(truth) if predict is None else predict(tensor)
        fired = tensor[:2].sum(axis=0) > 0
        errors, zero = end_point_errors(predicted, truth, fired), end_point_errors(0 * truth, truth, fired)
        check.add(t0, t1, events)
        if not len(errors):
            continue
        rows.append({"t0_s": t0 * 1e-9, "events": len(events), "pixels": len(errors), "truth_px": zero.mean(),
                     "epe_px": errors.mean(), "zero_epe_px": zero.mean(), "outliers": (errors > 3).mean()})
        if len(kept) < keep and index % every == 0:
            kept.append((tensor, predicted, truth))
    if not rows:
        raise esim.Error(f"{events_path}: no events in the time that the gyroscope covers, from {start * 1e-9:.3f} s "
                         f"to {end * 1e-9:.3f} s; are the clocks the same?")
    return rows, kept, check


def summary_of(rows):
    """Means over all pixels with events, px."""
    pixels = [row["pixels"] for row in rows]
    mean = {key: float(np.average([row[key] for row in rows], weights=pixels))
            for key in ("truth_px", "epe_px", "zero_epe_px", "outliers")}
    return {"windows": len(rows), "events": sum(row["events"] for row in rows), "pixels": sum(pixels), **mean}


def sensor_size(folder, given):
    if given:
        return tuple(given)
    (camera,) = esim.Recording(folder).info["cameras"].values()
    if not camera["width"]:
        raise esim.Error(f"{folder}: the sensor's size is unknown, since there are no images; give --size WIDTH HEIGHT")
    return camera["width"], camera["height"]


def numbers_of(text, count):
    """`count` numbers from text with commas, for argparse."""
    values = [float(word) for word in text.split(",")]
    if len(values) != count:
        raise ValueError
    return values


def three_numbers(text):
    return numbers_of(text, 3)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recording", type=pathlib.Path)
    parser.add_argument("--checkpoint", type=pathlib.Path, help="checkpoint of a trained network (train.py)")
    parser.add_argument("--out", type=pathlib.Path, help="folder for windows.csv, summary.json and figure.png")
    parser.add_argument("--window-s", type=float, help="length of a window (default: from the checkpoint, or 0.04)")
    parser.add_argument("--start-s", type=float, help="start on the recording's clock (default: the first rate)")
    parser.add_argument("--duration-s", type=float, help="duration (default: until the last rate)")
    parser.add_argument("--size", type=int, nargs=2, metavar=("WIDTH", "HEIGHT"), help="size of the sensor (default: that of the images)")
    parser.add_argument("--imu-axes", default="x,y,z", metavar="AXES",
                        help="the camera's x, y and z in IMU axes, such as x,-y,-z, or a quaternion x,y,z,w of "
                             "R_camera_imu (default: x,y,z, as for the DAVIS240C of the Event Camera Dataset)")
    parser.add_argument("--imu-delay-s", type=float, default=0.0, help="delay of the IMU's time stamps (default: 0)")
    parser.add_argument("--max-gap-s", type=float, default=0.02, help="maximum time without a rate (default: 0.02)")
    bias = parser.add_mutually_exclusive_group()
    bias.add_argument("--bias", type=three_numbers, metavar="X,Y,Z", help="bias of the gyroscope, rad/s in its axes (default: 0)")
    bias.add_argument("--still", type=float, nargs=2, metavar=("START_S", "END_S"),
                      help="time in which the camera stood still, to estimate the bias")
    return parser.parse_args()


def main():
    options = arguments()
    predict, window_s = None, 0.04
    if options.checkpoint:
        from flownet import load_predictor  # needs PyTorch

        predict, settings = load_predictor(options.checkpoint)
        window_s = settings["simulation"]["duration"]
    folder, axes = options.recording, parse_axes(options.imu_axes)
    if not folder.is_dir():
        raise esim.Error(f"{folder} is not a folder; unpack the recording's zip")
    calibration = Calibration.read(folder / "calib.txt", *sensor_size(folder, options.size))
    gyroscope = Gyroscope.read(folder / "imu.txt", axes, options.max_gap_s, options.imu_delay_s)
    bias_C = np.zeros(3) if options.bias is None else axes @ options.bias
    if options.still:
        bias_C = gyroscope.bias_at_rest(*(round(t * 1e9) for t in options.still))
        print("bias, rad/s, in the camera's frame:", np.round(bias_C, 5).tolist())
    rows, kept, check = evaluate(folder, calibration, gyroscope.less(bias_C), predict, window_s=options.window_s or window_s,
                                 start_s=options.start_s, duration_s=options.duration_s, keep=4)

    summary = summary_of(rows)
    best, ratio = check.best()
    summary["sharper_with_other_axes"] = ratio
    if ratio > 1.02:
        print(f"The events fit other axes of the IMU {100 * (ratio - 1):.0f} % better; try --imu-axes {name_of(best @ axes)}",
              file=sys.stderr)
    print(json.dumps(summary, indent=2))
    if options.out:
        write(options.out, rows, summary, kept, options.checkpoint is not None)


def name_of(axes):
    """The text of the nearest axes for `--imu-axes`."""
    return ",".join(("-" if row[i] < 0 else "") + "xyz"[i] for row in axes for i in [np.abs(row).argmax()])


def write(out, rows, summary, kept, predicted):
    out.mkdir(parents=True, exist_ok=True)
    with open(out / "windows.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    (out / "summary.json").write_text(json.dumps(summary, indent=2) + "\n")
    if predicted:
        from figure import draw

        draw(kept, out / "figure.png")


if __name__ == "__main__":
    try:
        main()
    except esim.Error as problem:
        sys.exit(f"evaluate_rotation.py: {problem}")
