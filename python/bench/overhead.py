"""Measures the overhead of Python in EventCamera.process(): python/bench/overhead.py [PROGRAM]

Compares a loop over frames in Python with the same loop in C++ (PROGRAM, built from overhead.cpp), alternately, so that
both run under the same conditions. Prints the ratio of the medians for each sensor.
"""

import statistics
import subprocess
import sys
import time

import numpy as np

import esim

WIDTH, HEIGHT, FRAMES, ROUNDS = 346, 260, 100, 9


def frames():
    """A texture that moves by one pixel per frame, as in overhead.cpp."""
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    return [np.ascontiguousarray(0.5 + 0.4 * np.sin(0.1 * (x - k)) * np.sin(0.13 * y)) for k in range(FRAMES)]


def in_python(preset, images):
    camera = esim.EventCamera(WIDTH, HEIGHT, preset, threads=1)
    began = time.perf_counter()
    count = 0
    for k, image in enumerate(images):
        count += len(camera.process(image, 1e-3 * k))
    return (time.perf_counter() - began) / FRAMES, count


def in_cpp(preset, program):
    seconds, count = subprocess.run([program, preset], capture_output=True, text=True, check=True).stdout.split()
    return float(seconds), int(count)


def main():
    images = frames()
    for preset in ("ideal", "davis346@1", "davis346@2"):
        here, there = [], []
        for _ in range(ROUNDS):
            seconds, count = in_python(preset, images)
            here.append(seconds)
            seconds, count_there = in_cpp(preset, sys.argv[1])
            there.append(seconds)
            assert abs(count - count_there) <= 1e-3 * count, (count, count_there)
        ratio = statistics.median(h / t for h, t in zip(here, there))
        print(f"{preset}: {count / FRAMES:.0f} events a frame, C++ {1e3 * min(there):.3f} ms, Python {1e3 * min(here):.3f} ms, ratio {ratio:.3f}")


if __name__ == "__main__":
    main()
