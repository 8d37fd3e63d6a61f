"""Compares pixels by their circuit with recordings of real sensors (docs/methods/circuit.md).

    bench/compare_sensor.py build/release/esim noise IEBCS/data
    bench/compare_sensor.py build/release/esim clip davis240c_poster_rotation
    bench/compare_sensor.py build/release/esim stamps recording.raw

noise: noise_{pos,neg}_{0.1lux,161lux}.npy of https://github.com/neuromorphicsystems/IEBCS: how many intervals of each
pixel lie below a rate, in 10 s of constant light. One set of parameters serves for both levels.
clip: a rotation of the Event Camera Dataset: events.txt (t x y p), flow.npy (px) and one image 000000000.png with the
camera's frame in its lower half. The frame moves with the flow; preset davis240c@2 makes the events.
stamps: the time stamps of any recording, at a resolution of 1 us (docs/methods/presets.md).

Needs numpy, SciPy and OpenCV.
"""

import argparse
import pathlib
import subprocess
import sys
import tempfile

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

NOISE = {
    "contrast_threshold": 0.1165, "threshold_ratio": 1.337, "threshold_mismatch": 0.0035, "refractory_period_us": 100,
    "leak_rate_hz": 0.04, "leak_mismatch_decades": 0.7, "hot_pixels": 0.02, "hot_pixel_rate_hz": 2,
}
NOISE_CIRCUIT = ("f_number: 0.5, transmission: 1, photocurrent_fa_per_lux: 77, dark_current_fa: 9.6, "
                 "photodiode_charge_e: 400, source_follower_hz: 206.7, threshold_mismatch_common: 0.07")
WIDTH, HEIGHT = 240, 180


def events_of(esim, images, times_ns, options, folder):
    for k, image in enumerate(images):
        cv2.imwrite(str(folder / f"{k:05d}.png"), np.clip(np.round(image * 65535), 0, 65535).astype(np.uint16))
    lines = [f"{int(t)},{k:05d}.png\n" for k, t in enumerate(times_ns)]
    (folder / "images.csv").write_text("".join(lines))
    sets = [argument for key, value in options.items() for argument in ("--set", f"{key}={value}")]
    subprocess.run([esim, "video", folder, "--out", folder / "events.txt", "-q", "--encoding", "linear", "--no-interpolation",
                    "--seed", "1", *sets], check=True)
    return np.loadtxt(folder / "events.txt").reshape(-1, 4).T


def distance(a, b):
    """The Kolmogorov-Smirnov distance of two samples."""
    at = np.unique(np.concatenate([a, b]))
    return np.abs(np.searchsorted(np.sort(a), at, side="right") / len(a)
                  - np.searchsorted(np.sort(b), at, side="right") / len(b)).max()


def compare_noise(esim, data):
    rates = np.array([m * 10.0**k for k in range(-3, 5) for m in range(1, 10)])
    for name, lux in (("0.1lux", 0.1), ("161lux", 161)):
        with tempfile.TemporaryDirectory() as folder:
            options = {**NOISE, "circuit": f"{{white_lux: {lux}, {NOISE_CIRCUIT}}}"}
            t, x, y, p = events_of(esim, [np.ones((50, 50))] * 3, [0, 5e9, 10e9], options, pathlib.Path(folder))
        pixel = (y * 50 + x).astype(int)
        for polarity, ours in (("pos", p > 0), ("neg", p <= 0)):
            real = np.load(data / f"noise_{polarity}_{name}.npy").reshape(2500, 72)
            counts = np.bincount(pixel[ours], minlength=2500)
            order = np.lexsort((t[ours], pixel[ours]))
            interval = np.diff(t[ours][order])[np.diff(pixel[ours][order]) == 0]
            below = np.array([(1 / interval < rate).mean() if len(interval) else 0 for rate in np.append(rates[1:], np.inf)])
            cumulative = real.sum(0)[:71] / max(1, real[:, 70].sum())
            print(f"{name} {polarity}: events {real[:, 70].sum():.0f} real, {counts.sum()} esim; pixels that fire "
                  f"{(real[:, 70] > 0).mean():.4f}, {(counts > 0).mean():.4f}; KS of counts {distance(real[:, 70], counts):.3f}, "
                  f"of intervals {np.abs(cumulative - below[:71]).max():.3f}")


def same_line(t, y, low, high, lines):
    """How often events `low` to `high` us later are of the same row or column, relative to chance."""
    same = pairs = 0
    for k in range(1, 1500):
        gap = t[k:] - t[:-k]
        near = (gap >= low) & (gap <= high)
        if not near.any() and gap.min() > high:
            break
        same += np.sum(y[k:][near] == y[:-k][near])
        pairs += near.sum()
    return same / max(1, pairs) * lines


def figures(t, x, y, p):
    order = np.lexsort((t, y * WIDTH + x))
    same = np.diff((y * WIDTH + x)[order]) == 0
    counts = np.bincount(t // 100)[:-1]
    return {
        "events": len(t), "same row, same us": same_line(t, y, 0, 0, HEIGHT), "same row, 1 to 5 us later": same_line(t, y, 1, 5, HEIGHT),
        "1 % interval (ms)": np.quantile(np.diff(t[order])[same], 0.01) / 1e3, "Fano factor (100 us)": counts.var() / counts.mean(),
        "ON": p.mean(), "next event of the same polarity": (p[order][1:] == p[order][:-1])[same].mean(),
    }


def compare_clip(esim, clip, before_s=0.03, step_s=2.5e-4):
    a = np.loadtxt(clip / "events.txt")
    real = [np.round((a[:, 0] - a[0, 0]) * 1e6).astype(np.int64), *a[:, 1:].T.astype(int)]
    duration_s = real[0][-1] * 1e-6
    flow = np.load(clip / "flow.npy")[0] / duration_s
    frame = cv2.imread(str(clip / "000000000.png"), 0).astype(float)[HEIGHT:2 * HEIGHT, :WIDTH] / 255
    frame = np.clip(gaussian_filter(frame, 0.4), 2 / 255, 1)
    rows, columns = np.mgrid[0:HEIGHT, 0:WIDTH].astype(float)
    times = np.arange(-before_s, duration_s + step_s, step_s)
    images = (map_coordinates(frame, [rows - flow[1] * (s - duration_s / 2), columns - flow[0] * (s - duration_s / 2)],
                              order=3, mode="nearest") for s in times)
    with tempfile.TemporaryDirectory() as folder:
        e = events_of(esim, images, np.round((times + before_s) * 1e9), {"preset": "davis240c@2"}, pathlib.Path(folder))
    e = e[:, (e[0] >= before_s) & (e[0] < before_s + duration_s)]
    ours = figures(np.floor((e[0] - before_s) * 1e6).astype(np.int64), *e[1:].astype(int))
    for name, value in figures(*real).items():
        print(f"{name}: {value:.3g} real, {ours[name]:.3g} esim")


def describe_stamps(esim, recording):
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([esim, "convert", recording, f"{folder}/events.npy", "-q"], check=True)
        events = np.load(f"{folder}/events.npy")
    t, x, y = events["t"].astype(np.int64), events["x"].astype(int), events["y"].astype(int)
    order = np.lexsort((t, y * (x.max() + 1) + x))
    pixel = (y * (x.max() + 1) + x)[order]
    interval = np.diff(t[order])[np.diff(pixel) == 0]
    print(f"{len(t)} events in {(t[-1] - t[0]) / 1e3:.3g} ms; 1 % interval {np.quantile(interval, 0.01):.3g} us; intervals below "
          + ", ".join(f"{us} us: {(interval < us).mean():.3f}" for us in (100, 20, 10)))
    for name, line in (("row", y), ("column", x)):
        print(f"same {name}, over chance: " + ", ".join(
            f"{low} to {high} us later {same_line(t, line, low, high, line.max() + 1):.3g}" for low, high in ((0, 0), (1, 5), (100, 105))))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("esim")
    parser.add_argument("what", choices=["noise", "clip", "stamps"])
    parser.add_argument("data", type=pathlib.Path)
    arguments = parser.parse_args()
    if arguments.what != "stamps" and not arguments.data.is_dir():
        sys.exit(f"{arguments.data} is not a folder; see --help")
    {"noise": compare_noise, "clip": compare_clip, "stamps": describe_stamps}[arguments.what](arguments.esim, arguments.data)


if __name__ == "__main__":
    main()
