"""Events of simulated sparks, to compare with the recording evt2.raw of a Prophesee Gen3 (docs/methods/presets.md).

Bright spots fly apart from many places on a dark background. Their speeds and sizes are those of the sparks in the recording; how bright sparks
and background are is unknown, so that the brightness is an argument.

    PYTHONPATH=build/release/python python bench/sensors/sparks.py OUT.h5 --peak 3
"""

import argparse

import numpy as np

import esim

WIDTH, HEIGHT = 640, 480
STEP_S = 10e-6


def make_sparks(random, duration_s, per_s):
    """Per spark: start (s), life (s), x0, y0 (px), vx, vy (px/s), radius (px), peak (relative)."""
    sparks = []
    for _ in range(random.poisson(per_s * duration_s)):
        start = random.uniform(-0.005, duration_s)
        x, y = random.uniform(0, WIDTH), random.uniform(0.65 * HEIGHT, HEIGHT)
        for _ in range(random.integers(5, 15)):
            direction, speed = random.uniform(0, 2 * np.pi), random.uniform(5e3, 60e3)
            sparks.append(
                (
                    start,
                    random.uniform(1e-3, 6e-3),
                    x,
                    y,
                    speed * np.cos(direction),
                    speed * np.sin(direction),
                    random.uniform(0.7, 2.5),
                    random.lognormal(0, 1),
                )
            )
    return np.reshape(sparks, (-1, 8))


def frame(sparks, t, peak, background):
    """Irradiance at `t`: float32 (HEIGHT, WIDTH)."""
    image = np.full((HEIGHT, WIDTH), background, np.float32)
    for start, life, x0, y0, vx, vy, radius, brightness in sparks[
        (sparks[:, 0] <= t) & (t < sparks[:, 0] + sparks[:, 1])
    ]:
        age = t - start
        x, y = x0 + vx * age, y0 + vy * age
        reach = int(np.ceil(6 * radius))
        left, top = int(x) - reach, int(y) - reach
        columns = np.arange(max(left, 0), min(left + 2 * reach + 1, WIDTH))
        rows = np.arange(max(top, 0), min(top + 2 * reach + 1, HEIGHT))
        if columns.size == 0 or rows.size == 0:
            continue
        across = np.exp(-0.5 * ((columns - x) / radius) ** 2)
        down = np.exp(-0.5 * ((rows - y) / radius) ** 2)
        fade = 1 - (age / life) ** 2
        image[np.ix_(rows, columns)] += (peak * brightness * fade * np.outer(down, across)).astype(np.float32)
    return image


def main():
    parser = argparse.ArgumentParser(description="Events of simulated sparks")
    parser.add_argument("out", metavar="OUT", help="event file to write")
    parser.add_argument("--preset", default="gen3.1-vga", help="sensor (default: gen3.1-vga)")
    parser.add_argument("--peak", type=float, default=30, help="irradiance of a spark, white = 1 (default: 30)")
    parser.add_argument("--background", type=float, default=0.05, help="irradiance of the background (default: 0.05)")
    parser.add_argument("--bursts", type=float, default=60, help="bursts of sparks per second (default: 60)")
    parser.add_argument("--duration", type=float, default=0.1, help="s (default: 0.1)")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    sparks = make_sparks(np.random.default_rng(args.seed), args.duration, args.bursts)
    camera = esim.EventCamera(WIDTH, HEIGHT, args.preset, seed=args.seed)
    events = [
        camera.process(frame(sparks, k * STEP_S, args.peak, args.background), k * STEP_S)
        for k in range(round(args.duration / STEP_S))
    ]
    esim.save_events(args.out, esim.Events(np.concatenate(events), WIDTH, HEIGHT))


if __name__ == "__main__":
    main()
