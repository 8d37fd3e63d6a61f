"""Helpers of skin weights and of texture coordinates."""
import numpy as np


def ramp(low, high, x):
    """From 0 at low to 1 at high, smoothly; also if high < low."""
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def chain(points, numbers, *parts):
    """Weights (points, joints) of joints of which each takes its fraction of what those before have: parts are (joint's name, fraction
    of each point), and the first joint has all."""
    w = np.zeros((len(points), len(numbers)))
    w[:, numbers[parts[0][0]]] = 1
    for name, fraction in parts[1:]:
        w *= 1 - fraction[:, None]
        w[:, numbers[name]] += fraction
    return w


def turns(x, y):
    """The direction of (x, y) in turns, 0 to 1; 1/2 is towards +x."""
    return np.arctan2(y, x) / (2 * np.pi) + 0.5
