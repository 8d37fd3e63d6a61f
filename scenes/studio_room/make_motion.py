"""Write camera.txt and ball.txt: two seconds of a camera in the hand, and of a ball that rolls over the carpet.

    python3 make_motion.py

Lines of `t x y z qx qy qz qw`: T_world_camera with the camera's axes right, down, forward, and T_world_ball.
"""
import math
import os

HERE = os.path.dirname(os.path.abspath(__file__))
DURATION, RATE = 2.0, 50
BALL_RADIUS, CARPET = 0.13, 0.015


def sway(t, *terms):
    return sum(size * math.sin(2 * math.pi * hertz * t + phase) for size, hertz, phase in terms)


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def unit(a):
    length = math.sqrt(sum(part * part for part in a))
    return [part / length for part in a]


def quaternion(columns):
    """x y z w of a rotation with these columns."""
    m = [[columns[j][i] for j in range(3)] for i in range(3)]
    squares = [1 + m[0][0] - m[1][1] - m[2][2], 1 - m[0][0] + m[1][1] - m[2][2], 1 - m[0][0] - m[1][1] + m[2][2],
               1 + m[0][0] + m[1][1] + m[2][2]]
    largest = max(range(4), key=lambda k: squares[k])
    table = {0: (squares[0], m[1][0] + m[0][1], m[0][2] + m[2][0], m[2][1] - m[1][2]),
             1: (m[1][0] + m[0][1], squares[1], m[2][1] + m[1][2], m[0][2] - m[2][0]),
             2: (m[0][2] + m[2][0], m[2][1] + m[1][2], squares[2], m[1][0] - m[0][1]),
             3: (m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1], squares[3])}[largest]
    return [part / (2 * math.sqrt(squares[largest])) for part in table]


def camera(t):
    place = [1.55 - 0.30 * t + sway(t, (0.012, 0.9, 0.3), (0.004, 2.1, 1.2)), -2.0 + 0.22 * t + sway(t, (0.01, 0.8, 2.0)),
             1.50 - 0.03 * t + sway(t, (0.012, 1.7, 0.9))]
    target = [-0.10 + 0.30 * t + sway(t, (0.02, 0.7, 1.4)), 1.10 + 0.10 * t, 0.98 + sway(t, (0.015, 1.1, 0.1))]
    forward = unit([b - a for a, b in zip(place, target)])
    right = unit(cross(forward, [0, 0, 1]))
    down = cross(forward, right)
    roll = math.radians(sway(t, (1.2, 0.6, 0.8), (0.25, 1.8, 2.5)))
    c, s = math.cos(roll), math.sin(roll)
    return place, quaternion([[c * x + s * y for x, y in zip(right, down)], [c * y - s * x for x, y in zip(right, down)], forward])


def ball(t):
    along, way = unit([-0.75, 0.45, 0]), 0.45 * t
    axis, half = cross([0, 0, 1], along), way / BALL_RADIUS / 2
    return [1.05 + along[0] * way, 0.10 + along[1] * way, BALL_RADIUS + CARPET], [math.sin(half) * part for part in axis] + [math.cos(half)]


for name, pose in (("camera", camera), ("ball", ball)):
    before = None
    with open(os.path.join(HERE, name + ".txt"), "w") as file:
        file.write("# timestamp tx ty tz qx qy qz qw\n")
        for k in range(int(DURATION * RATE) + 1):
            place, turn = pose(k / RATE)
            if before is not None and sum(a * b for a, b in zip(before, turn)) < 0:
                turn = [-part for part in turn]
            before = turn
            file.write(" ".join([f"{k / RATE:.6f}"] + [f"{part:.8f}" for part in place + turn]) + "\n")
