"""Generate camera.txt: a camera in the hand of somebody who stands in the room and watches the figure of make_walker.py.

Run:  python3 make_camera.py [output file]        (needs NumPy only)

TUM format, T_world_camera, as ../room/make_trajectory.py writes it.
"""
import os
import sys

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, "..", "room")]
sys.dont_write_bytecode = True

from make_trajectory import DURATION, RATE, SWAY_ANGLE_DEG, SWAY_POSITION, bspline, camera_axes, quaternion, sway, turn  # noqa: E402

POSITION = np.array([(-0.42, 1.34, 1.50), (-0.40, 1.33, 1.50), (-0.30, 1.27, 1.49), (-0.20, 1.26, 1.47), (-0.18, 1.30, 1.48)])
LOOK_AT = np.array([(0.95, -1.1, 1.00), (0.85, -1.1, 1.00), (0.35, -1.1, 1.02), (-0.25, -1.1, 0.98), (-0.70, -1.1, 0.96), (-0.85, -1.1, 0.96)])


def main():
    path = sys.argv[1] if len(sys.argv) > 1 else os.path.join(HERE, "camera.txt")
    t = np.arange(int(DURATION * RATE) + 1) / RATE
    position = bspline(POSITION, t / DURATION) + sway(t, SWAY_POSITION)
    target = bspline(LOOK_AT, t / DURATION)
    angles = np.radians(sway(t, SWAY_ANGLE_DEG))
    q = np.array([quaternion(turn(camera_axes(b - a, roll), pitch, yaw)) for a, b, (pitch, yaw, roll) in zip(position, target, angles)])
    q[0] *= -1 if q[0, 3] < 0 else 1
    for k in range(1, len(q)):
        q[k] *= -1 if q[k] @ q[k - 1] < 0 else 1
    with open(path, "w") as file:
        file.write("# timestamp tx ty tz qx qy qz qw\n")
        for row in zip(t, position, q):
            file.write("%.6f %.6f %.6f %.6f %.8f %.8f %.8f %.8f\n" % (row[0], *row[1], *row[2]))


if __name__ == "__main__":
    main()
