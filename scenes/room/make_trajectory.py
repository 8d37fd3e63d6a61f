"""Generate trajectory.txt: a 5 s handheld-like camera flight through the room.

Run:  python3 make_trajectory.py [output file]        (needs NumPy only)

TUM format, T_world_camera, camera axes x right, y down, z forward, Hamilton
quaternion (x y z w).  Position and look-at point follow quintic B-splines
(four continuous derivatives), plus a small smooth hand sway.
"""
import math
import os
import sys

import numpy as np

DURATION, RATE = 5.0, 50

# control points: camera position and the point it looks at, in metres
POSITION = np.array([
    (2.05, -1.68, 1.50), (1.90, -1.60, 1.50), (1.10, -1.15, 1.40),
    (0.30, -0.45, 1.14), (-0.50, -0.25, 1.10), (-1.20, -0.35, 1.30),
    (-1.80, -0.72, 1.58), (-1.95, -0.85, 1.62)])
LOOK_AT = np.array([
    (-1.30, 1.40, 1.05), (-1.25, 1.45, 1.02), (-1.10, 1.60, 0.90),
    (-0.75, 1.80, 0.80), (0.30, 2.00, 0.78), (1.60, 1.80, 0.88),
    (2.50, 0.80, 1.02), (2.75, 0.30, 1.05)])

# sway: amplitude, frequency in Hz, phase (two terms per axis)
SWAY_POSITION = (((0.010, 0.9, 0.3), (0.004, 2.1, 1.2)),
                 ((0.009, 0.8, 2.0), (0.004, 1.9, 0.4)),
                 ((0.012, 1.7, 0.9), (0.003, 2.6, 2.2)))
SWAY_ANGLE_DEG = (((0.7, 0.9, 0.1), (0.25, 2.3, 1.0)),   # pitch
                  ((0.8, 0.7, 1.4), (0.25, 2.0, 0.2)),   # yaw
                  ((1.2, 0.6, 0.8), (0.25, 1.8, 2.5)))   # roll


def bspline(control, x, degree=5):
    """Uniform B-spline with clamped (repeated) ends, x in [0, 1]."""
    c = np.vstack([[control[0]] * 2, control, [control[-1]] * 2])
    span = len(c) - degree
    u = np.clip(x * span, 0, span)
    k = np.minimum(u.astype(int), span - 1)
    f = u - k
    out = np.zeros((len(x), c.shape[1]))
    for j in range(degree + 1):
        out += cardinal(degree, f + degree - j)[:, None] * c[k + j]
    return out


def cardinal(degree, x):
    """Cardinal B-spline of the given degree on [0, degree + 1]."""
    total = np.zeros_like(x)
    for i in range(degree + 2):
        total += ((-1) ** i * math.comb(degree + 1, i)
                  * np.maximum(x - i, 0) ** degree)
    return total / math.factorial(degree)


def sway(t, terms):
    return np.stack([sum(a * np.sin(2 * np.pi * f * t + p) for a, f, p in axis)
                     for axis in terms], -1)


def camera_axes(forward, roll):
    """Rotation matrix with columns right, down, forward."""
    z = forward / np.linalg.norm(forward)
    x = np.cross(z, (0.0, 0.0, 1.0))
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    c, s = math.cos(roll), math.sin(roll)
    return np.stack([c * x + s * y, c * y - s * x, z], axis=1)


def turn(R, pitch, yaw):
    """Small rotation in the camera frame: pitch about x, yaw about y."""
    cp, sp, cy, sy = math.cos(pitch), math.sin(pitch), math.cos(yaw), math.sin(yaw)
    Rx = np.array([[1, 0, 0], [0, cp, -sp], [0, sp, cp]])
    Ry = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    return R @ Ry @ Rx


def quaternion(R):
    """Hamilton quaternion x y z w of a rotation matrix."""
    K = np.array([
        [R[0, 0] - R[1, 1] - R[2, 2], 0, 0, 0],
        [R[1, 0] + R[0, 1], R[1, 1] - R[0, 0] - R[2, 2], 0, 0],
        [R[2, 0] + R[0, 2], R[2, 1] + R[1, 2], R[2, 2] - R[0, 0] - R[1, 1], 0],
        [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], np.trace(R)]])
    values, vectors = np.linalg.eigh(K / 3.0)
    return vectors[:, np.argmax(values)]


def trajectory():
    t = np.arange(int(DURATION * RATE) + 1) / RATE
    # varying pace: slow at both ends, a little slower half way
    x = t / DURATION
    x = x + 0.034 * np.sin(2 * np.pi * x) - 0.010 * np.sin(4 * np.pi * x)
    p = bspline(POSITION, x) + sway(t, SWAY_POSITION)
    target = bspline(LOOK_AT, x)
    ang = np.radians(sway(t, SWAY_ANGLE_DEG))
    quats = []
    for k in range(len(t)):
        R = turn(camera_axes(target[k] - p[k], ang[k, 2]), ang[k, 0], ang[k, 1])
        q = quaternion(R)
        if (quats and np.dot(q, quats[-1]) < 0) or (not quats and q[3] < 0):
            q = -q
        quats.append(q)
    return t, p, np.array(quats)


def report(t, p, q):
    speed = np.linalg.norm(np.diff(p, axis=0), axis=1) * RATE
    cosine = np.clip(np.abs((q[1:] * q[:-1]).sum(1)), 0, 1)
    rate = np.degrees(2 * np.arccos(cosine)) * RATE
    print("length %.2f m, speed %.2f to %.2f m/s, turning up to %.0f deg/s, "
          "height %.2f to %.2f m" % (speed.sum() / RATE, speed.min(),
                                     speed.max(), rate.max(),
                                     p[:, 2].min(), p[:, 2].max()))


def main():
    here = os.path.dirname(os.path.abspath(__file__))
    path = sys.argv[1] if len(sys.argv) > 1 else os.path.join(here, "trajectory.txt")
    t, p, q = trajectory()
    with open(path, "w") as f:
        f.write("# timestamp tx ty tz qx qy qz qw\n")
        for row in zip(t, p, q):
            f.write("%.6f %.6f %.6f %.6f %.8f %.8f %.8f %.8f\n"
                    % (row[0], *row[1], *row[2]))
    report(t, p, q)


if __name__ == "__main__":
    main()
