#!/usr/bin/env python3
"""A quadrotor with an event camera flies through waypoints in scenes/room. From the top of the repository:

    PYTHONPATH=build/release/python python3 examples/agents/quadrotor.py --out out/quadrotor.png

The environment takes thrust and body rates (`action="thrust"`). A geometric controller (Lee, Leok and McClamroch, 2010) makes
them from position and velocity. Prints the tracking error and the number of events, and writes a picture: the events near each
waypoint. Needs gymnasium and Pillow.
"""

import argparse
import pathlib
import sys
import time

import numpy as np
from PIL import Image

import esim.gym

ROOM = pathlib.Path(__file__).resolve().parents[2] / "scenes" / "room.yaml"
WAYPOINTS = np.array([  # m; the room is 6 x 5 x 2.7 m, its origin is in the middle of the floor
    [2.0, -1.4, 1.2], [0.6, -1.2, 1.5], [-1.0, -1.4, 1.4], [-1.9, -0.5, 1.3],
    [-1.3, 0.5, 1.6], [0.0, 0.9, 1.6], [1.3, 0.4, 1.5], [1.6, -0.8, 1.3],
])  # fmt: skip
STEP_S = 0.01
MAX_ACCELERATION, MAX_RATE = 20.0, 8.0  # m/s^2; rad/s
GRAVITY = np.array([0, 0, -9.81])
POSITION_GAIN, VELOCITY_GAIN, ATTITUDE_GAIN = 8.0, 5.0, 12.0  # 1/s^2, 1/s, 1/s
AHEAD_S = 0.5  # the camera looks at where the quadrotor will be
COLUMNS = 4  # of the picture


class Path:
    """A cubic spline through points (N, 3) that begins and ends at rest."""

    def __init__(self, points, speed):
        duration = np.linalg.norm(np.diff(points, axis=0), axis=1) / speed
        duration[[0, -1]] *= 1.5
        self.points, self.times = points, np.concatenate([[0], np.cumsum(duration)])
        # The velocities at the points for which the acceleration is continuous.
        matrix, right, k = np.eye(len(points)), np.zeros_like(points), 1 / duration
        for i in range(1, len(points) - 1):
            matrix[i, i - 1 : i + 2] = k[i - 1], 2 * (k[i - 1] + k[i]), k[i]
            right[i] = 3 * (k[i - 1] ** 2 * (points[i] - points[i - 1]) + k[i] ** 2 * (points[i + 1] - points[i]))
        self.velocities = np.linalg.solve(matrix, right)

    def __call__(self, t):
        """Position, velocity and acceleration at time t, s."""
        t = np.clip(t, 0, self.times[-1])
        i = min(np.searchsorted(self.times, t, side="right") - 1, len(self.points) - 2)
        h = self.times[i + 1] - self.times[i]
        (p, q), (v, w), s = self.points[i : i + 2], self.velocities[i : i + 2] * h, (t - self.times[i]) / h
        a, b = 3 * (q - p) - 2 * v - w, 2 * (p - q) + v + w
        return p + s * (v + s * (a + s * b)), (v + s * (2 * a + 3 * s * b)) / h, (2 * a + 6 * s * b) / h**2


def attitude(up, heading):
    """The rotation (3, 3) from the body (x forwards, y left, z up) to the world, with z along `up` and x towards `heading`."""
    z = up / np.linalg.norm(up)
    y = np.cross(z, heading)
    y /= np.linalg.norm(y)
    return np.column_stack([np.cross(y, z), y, z])


def control(pose, velocity, goal, heading):
    """The action: thrust from 0 to 1, and body rates from -1 to 1. goal: position, velocity and acceleration."""
    R, (p, v, a) = pose[:3, :3], goal
    force = a + POSITION_GAIN * (p - pose[:3, 3]) + VELOCITY_GAIN * (v - velocity) - GRAVITY  # per mass, m/s^2
    difference = R.T @ attitude(force, heading)
    turn = 0.5 * np.array([difference[i, j] - difference[j, i] for i, j in ((2, 1), (0, 2), (1, 0))])
    return [force @ R[:, 2] / MAX_ACCELERATION, *(ATTITUDE_GAIN * turn / MAX_RATE)]


def fly(path, moments, threads):
    """Positions (N, 3) at the steps, their errors (N,), m, the number of events, and pictures of those before each moment, s."""
    heading = (path.points[1] - path.points[0]) * [1, 1, 0]
    start = np.eye(4)
    start[:3, :3], start[:3, 3] = attitude(np.array([0, 0, 1]), heading), path.points[0]
    overrides = {
        "duration_s": float(path.times[-1]),
        "camera": {"width": 240, "height": 180, "horizontal_fov_deg": 90, "T_body_camera": {"quaternion": [-0.5, 0.5, -0.5, 0.5]}},
    }
    env = esim.gym.EventEnv(
        ROOM, start, action="thrust", step_s=STEP_S, max_acceleration=MAX_ACCELERATION, max_angular_velocity=MAX_RATE,
        observation="pose", threads=threads, overrides=overrides,
    )  # fmt: skip
    _, info = env.reset(seed=1)
    positions, errors, count, recent, pictures, over, begin = [], [], 0, [], [], False, time.monotonic()
    while not over:
        t = len(positions) * STEP_S
        ahead = (path(t + AHEAD_S)[0] - path(t)[0]) * [1, 1, 0]
        heading = ahead if np.linalg.norm(ahead) > 0.1 else heading
        *_, over, info = env.step(control(info["pose"], info["velocity"], path(t), heading))
        positions.append(info["pose"][:3, 3])
        errors.append(np.linalg.norm(positions[-1] - path(t + STEP_S)[0]))
        count, recent = count + len(env.events), [*recent[-9:], env.events]
        if len(pictures) < len(moments) and t >= moments[len(pictures)]:
            pictures.append(esim.time_surface_picture(np.concatenate(recent), tau_s=0.02))
        if len(positions) % 100 == 0:
            left = (time.monotonic() - begin) * (path.times[-1] / (t + STEP_S) - 1)
            print(f"{t + STEP_S:5.1f} of {path.times[-1]:.1f} s, error {100 * errors[-1]:4.1f} cm; {left:.0f} s left", flush=True)
    env.close()
    return np.array(positions), np.array(errors), count, pictures


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", default="out/quadrotor.png", help="the picture to write (default: out/quadrotor.png)")
    parser.add_argument("--speed", type=float, default=1.0, help="m/s (default: 1)")
    parser.add_argument("--threads", type=int, default=0, help="0: every processor (default)")
    parser.add_argument("--force", action="store_true", help="replace the picture if it exists")
    args = parser.parse_args()
    if not args.speed > 0:
        parser.error("--speed must be positive")
    out = pathlib.Path(args.out)
    if out.exists() and not args.force:
        sys.exit(f"{out}: exists; use --force to replace it")
    path = Path(WAYPOINTS, args.speed)
    moments = [0.5 * path.times[1], *path.times[1:-1], path.times[-1] - 0.5]
    positions, errors, count, pictures = fly(path, moments, args.threads)
    misses = [np.linalg.norm(positions - point, axis=1).min() for point in WAYPOINTS[1:]]
    print(f"tracking error: {np.sqrt(np.mean(errors**2)):.3f} m RMS, {errors.max():.3f} m at most")
    print(f"waypoints: passed at {max(misses):.3f} m or less")
    print(f"events: {count} in {path.times[-1]:.1f} s")
    out.parent.mkdir(parents=True, exist_ok=True)
    pictures += [np.zeros_like(pictures[0])] * (-len(pictures) % COLUMNS)
    rows = [np.hstack(pictures[i : i + COLUMNS]) for i in range(0, len(pictures), COLUMNS)]
    Image.fromarray(np.vstack(rows)).save(out)
    print(f"wrote {out}")


if __name__ == "__main__":
    main()
