"""Steps per second of esim.gym.EventVectorEnv, and of Gymnasium's AsyncVectorEnv with as many EventEnv:

    PYTHONPATH=build/release/python python3 bench/gym_bench.py [NUM_ENVS ...]     (default: 1 8 64; 64 processes of AsyncVectorEnv need about 13 GB)

64 x 64 pixels in scenes/room, control at 100 Hz, with depth and motion field in each step. Needs gymnasium.
"""

import resource
import sys
import time

import gymnasium
import numpy as np

import esim.gym

START = np.array([[0, 0, 1, -2.2], [-1, 0, 0, 0], [0, -1, 0, 1.2], [0, 0, 0, 1.0]])
SCENARIO = {
    "duration_s": 100,
    "renderer": {"type": "mesh", "scene": "scenes/room/room.obj", "samples_per_pixel": 1},
    "camera": {"width": 64, "height": 64},
    "event_camera": {"contrast_threshold": 0.25},
    "truth": {"rate_hz": 100, "motion_field": True},
    "sampling": {"type": "flow", "min_rate_hz": 100},
}
OPTIONS = {"step_s": 0.01, "interval_s": 0.01}
SECONDS = 5


def one():
    return esim.gym.EventEnv(SCENARIO, START, threads=1, **OPTIONS)


def measure(env, count):
    env.reset(seed=1)
    actions = np.random.default_rng(0).uniform(-0.4, 0.4, (count, 6)).astype(np.float32)
    for _ in range(3):
        env.step(actions)
    begin, steps = time.monotonic(), 0
    while time.monotonic() - begin < SECONDS:
        env.step(actions)
        steps += count
    rate = steps / (time.monotonic() - begin)
    env.close()
    return rate


if __name__ == "__main__":
    for count in map(int, sys.argv[1:] or ["1", "8", "64"]):
        ours = measure(esim.gym.EventVectorEnv(count, SCENARIO, START, **OPTIONS), count)
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
        text = f"{count:3} environments: {ours:.0f} steps/s, at most {memory:.0f} MB"
        others = measure(gymnasium.vector.AsyncVectorEnv([one] * count, context="spawn"), count)
        print(f"{text}; AsyncVectorEnv {others:.0f} steps/s, ratio {ours / others:.2f}")
