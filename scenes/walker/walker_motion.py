"""How the figure walks: footprints along a path, the feet between them, and joints by inverse kinematics.

Frame of the world: metres, z up. Rotations of joints are relative to the rest pose (walker_body.py), in which all are the identity.
"""
import numpy as np

from make_trajectory import bspline
from rotations import about, frame, matrices, quaternions, transposed
from walker_body import ANKLE, ARM, HEEL, HIP, JOINTS, KNEE, NUMBER, RIGHT, TOE

DURATION, RATE = 5.0, 60
# The way through the room: from the sideboard past the door and the vase to the curtain, between the rug and the chest.
WAY = np.array([(2.08, -0.86), (1.65, -0.92), (1.05, -1.12), (0.30, -1.10), (-0.45, -0.80), (-1.10, -0.82), (-1.85, -1.10), (-2.25, -1.42)])
STEPS = 7.6               # in the complete time
STANCE = 0.62             # part of a cycle of two steps for which a foot stands
FLAT, LIFT = 0.11, 0.36   # parts of the cycle after which the sole is flat, and the heel leaves the ground
LANDING, PUSH, LEAVING = np.radians(18), np.radians(-42), np.radians(-52)  # angles of the foot: at contact, at the end of stance, the steepest
AHEAD = 0.285             # of the ankle, before the pelvis, when the foot lands, m
REACH = 0.996             # of the stretched leg
LEG = np.linalg.norm(KNEE - HIP), np.linalg.norm(ANKLE - KNEE)


class Path:
    """A curve on the floor, by arc length. It goes on straight beyond its ends."""

    def __init__(self):
        points = bspline(WAY, np.linspace(0, 1, 4001))
        self.s = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        self.points, self.length = points, self.s[-1]
        tangent = np.gradient(points, self.s, axis=0)
        self.headings = np.unwrap(np.arctan2(tangent[:, 1], tangent[:, 0]))

    def heading(self, s):
        return np.interp(s, self.s, self.headings)

    def at(self, s):
        inside = np.clip(s, 0, self.length)
        p = np.stack([np.interp(inside, self.s, self.points[:, k]) for k in (0, 1)], -1)
        h = self.heading(s)
        return p + (s - inside)[..., None] * np.stack([np.cos(h), np.sin(h)], -1)


PATH = Path()
SPEED = PATH.length / DURATION
CYCLE = 2 * DURATION / STEPS


def hermite(x, a, b, slope_a, slope_b):
    """Cubic from a to b, whose slopes are in units of x in [0, 1]."""
    return (a * (1 + 2 * x) * (1 - x) ** 2 + slope_a * x * (1 - x) ** 2
            + b * x ** 2 * (3 - 2 * x) - slope_b * x ** 2 * (1 - x))


def ease(x):
    x = np.clip(x, 0, 1)
    return x * x * (3 - 2 * x)


def landing(side, k):
    """The time at which the foot lands on its footprint k, s; footprints before the start and after the end exist, too."""
    return CYCLE * (k - 0.18 + (0.5 if side == "right" else 0.0))


def footprint(side, k):
    """Position and heading of the sole's frame, whose x axis points forward through the ankle's footprint."""
    s = SPEED * landing(side, k) + AHEAD
    sign = 1 if side == "left" else -1
    h = PATH.heading(s)
    out = np.array([-np.sin(h), np.cos(h)]) * 0.070 * sign
    return np.append(PATH.at(np.array(s)) + out, 0.0), h + sign * np.radians(6)


def standing(side, k, phase):
    """The ankle in the world and the angle of the foot at a phase of the cycle after landing, in [0, STANCE]."""
    ground, h = footprint(side, k)
    angle = LANDING * (1 - ease(phase / FLAT)) + PUSH * np.clip((phase - LIFT) / (STANCE - LIFT), 0, 1) ** 2
    pivot = (HEEL if angle > 0 else TOE) - ANKLE * [1, 1, 0]  # from the ankle's footprint, in the frame of the sole
    pivot = pivot * [1, 0, 1]
    arm = np.array([0, 0, ANKLE[2]]) - pivot
    return ground + about(2, h) @ (pivot + about(1, -angle) @ arm), angle, h


def swinging(side, k, x):
    """The same on the way from footprint k to the next, for x in [0, 1]."""
    e = 1e-3
    swing = 1 - STANCE
    (a, angle_a, h_a), (b, angle_b, h_b) = standing(side, k, STANCE), standing(side, k + 1, 0.0)
    before, after = standing(side, k, STANCE - e), standing(side, k + 1, e)
    ankle = hermite(x, a, b, (a - before[0]) / e * swing, (after[0] - b) / e * swing)
    ankle[2] += 0.08 * x * (1 - x) ** 2 + 0.035 * np.sin(np.pi * x) ** 2
    first = 0.14                     # the foot tilts on, then the toes come up
    if x < first:
        angle = hermite(x / first, angle_a, LEAVING, (angle_a - before[1]) / e * swing * first, 0)
    else:
        angle = hermite((x - first) / (1 - first), LEAVING, angle_b + np.radians(3), 0, np.radians(10)) \
            - np.radians(3) * ((x - first) / (1 - first)) ** 6
    return ankle, angle, h_a + (h_b - h_a) * ease(x)


def feet(side, times):
    """Ankles (times, 3), angles and headings of a foot, the angles of its toes, and its phases."""
    ankles, angles, headings, toes, phases = [], [], [], [], []
    for t in times:
        phase = (t - landing(side, 0)) / CYCLE
        k = int(np.floor(phase))
        phase -= k
        ankle, angle, h = standing(side, k, phase) if phase < STANCE else swinging(side, k, (phase - STANCE) / (1 - STANCE))
        bent = min(angle, 0.0) * (1.0 if phase < STANCE else 1 - ease((phase - STANCE) / 0.20))
        for values, value in zip((ankles, angles, headings, toes, phases), (ankle, angle, h, -bent, phase)):
            values.append(value)
    return [np.array(values) for values in (ankles, angles, headings, toes, phases)]


def smoothed(values, seconds):
    """A Gaussian mean along the times; the ends are repeated."""
    n = int(4 * seconds * RATE)
    kernel = np.exp(-0.5 * (np.arange(-n, n + 1) / (seconds * RATE)) ** 2)
    padded = np.concatenate([np.full(n, values[0]), values, np.full(n, values[-1])])
    return np.convolve(padded, kernel / kernel.sum(), "valid")


def leg(hips, ankles, forward, side):
    """Rotations of thigh and shin in the world that bring the ankle to its place, the knee to the front."""
    m = 1 if side == "left" else RIGHT
    to = ankles - hips
    d = np.minimum(np.linalg.norm(to, axis=1), sum(LEG) * 0.9999)
    along = to / np.linalg.norm(to, axis=1, keepdims=True)
    front = forward - (forward * along).sum(1, keepdims=True) * along
    front /= np.linalg.norm(front, axis=1, keepdims=True)
    x = (d ** 2 + LEG[0] ** 2 - LEG[1] ** 2) / (2 * d)
    y = np.sqrt(np.maximum(LEG[0] ** 2 - x ** 2, 0))
    knees = hips + x[:, None] * along + y[:, None] * front
    side_axis = np.cross(along, front)
    result = []
    for a, b, rest in ((hips, knees, KNEE - HIP), (knees, ankles, ANKLE - KNEE)):
        at_rest = frame(rest * m, np.array([0, -1.0, 0]))
        result.append(frame(b - a, side_axis) @ transposed(at_rest))
    return result


def walk(times):
    """Rotations in the world of each joint, {name: (times, 3, 3)}, and the positions of the pelvis (times, 3)."""
    s = SPEED * times
    turn = PATH.heading(s)
    soles = {side: feet(side, times) for side in ("left", "right")}
    w = 2 * np.pi * (times - landing("left", 0)) / CYCLE     # 0 where the left foot lands
    stance = np.sin(w - 0.35)                                # 1 in the middle of the left foot's stance
    yaw, list_, lean = np.radians(-5) * np.cos(w), np.radians(3.5) * np.sin(w - 0.25), np.radians(3.0)
    heading = about(2, turn)
    pelvis = heading @ about(2, yaw) @ about(0, list_) @ about(1, np.full(len(times), lean) * 0.5)
    middle = PATH.at(s) + 0.020 * stance[:, None] * np.stack([-np.sin(turn), np.cos(turn)], -1)
    middle += 0.012 * np.sin(2 * w + 0.6)[:, None] * np.stack([np.cos(turn), np.sin(turn)], -1)

    # The pelvis is as high as both legs allow.
    sockets = {side: pelvis @ ((HIP * (1 if side == "left" else RIGHT)) - JOINTS[0][2]) for side in soles}
    highest = np.full(len(times), np.inf)
    for side, (ankles, *_) in soles.items():
        flat = np.linalg.norm(middle + sockets[side][:, :2] - ankles[:, :2], axis=1)
        reach = np.sqrt((REACH * sum(LEG)) ** 2 - flat ** 2)
        highest = np.minimum(highest, ankles[:, 2] + reach - sockets[side][:, 2])
    height = smoothed(np.minimum(highest, np.quantile(highest, 0.55)), 0.055)
    height -= max(0.0, (height - highest).max())
    root = np.concatenate([middle, height[:, None]], 1)

    R = {"pelvis": pelvis}
    for side, (ankles, angles, headings, toes, _) in soles.items():
        forward = 0.5 * (about(2, headings)[..., 0] + pelvis[..., 0])
        R[f"{side} thigh"], R[f"{side} shin"] = leg(root + sockets[side], ankles, forward, side)
        R[f"{side} foot"] = about(2, headings) @ about(1, -angles)
        R[f"{side} toes"] = R[f"{side} foot"] @ about(1, -toes)

    # The trunk turns against the pelvis, and the head keeps still; passing the vase, it looks at it.
    look = np.radians(34) * np.exp(-((times - 1.55) / 0.55) ** 2)
    R["spine"] = heading @ about(2, 0.1 * yaw) @ about(0, 0.1 * list_) @ about(1, np.full(len(times), 0.8 * lean))
    R["chest"] = heading @ about(2, -0.9 * yaw + 0.15 * look) @ about(0, -0.3 * list_) @ about(1, lean + np.radians(1.0) * np.cos(2 * w))
    R["neck"] = heading @ about(2, -0.3 * yaw + 0.5 * look) @ about(1, np.full(len(times), 1.6 * lean))
    R["head"] = heading @ about(2, look) @ about(1, np.radians(2) + np.radians(0.8) * np.cos(2 * w + 0.8) + 0.20 * look)
    for side, sign in (("left", 1), ("right", -1)):
        swing = -sign * np.cos(w - 0.25)                     # 1 where the arm is in front
        flexion = np.radians(3) + np.radians(19) * swing
        R[f"{side} collarbone"] = R["chest"] @ about(2, sign * -0.05 * swing)
        inward = sign * (np.radians(8.5) - ARM) + 0 * times
        R[f"{side} upper arm"] = R[f"{side} collarbone"] @ about(1, -flexion) @ about(0, inward)
        bend = np.radians(10) + np.radians(11) * (swing + 1) / 2 * (1 + 0.3 * swing)
        R[f"{side} forearm"] = R[f"{side} upper arm"] @ about(2, sign * np.radians(14) + 0 * times) @ about(1, -bend)
        R[f"{side} hand"] = R[f"{side} forearm"] @ about(1, np.radians(4) * np.cos(w + 1.0)) @ about(0, np.full(len(times), sign * np.radians(-3)))
    return R, root


def local_rotations(R):
    """Quaternions of each joint relative to its parent, (times, 4) in the order of JOINTS."""
    names = [name for name, _, _ in JOINTS]
    return [quaternions(R[name] if parent is None else transposed(R[names[parent]]) @ R[name]) for name, parent, _ in JOINTS]


def poses(times, key_times, rotations, root):
    """Poses of all joints between keys, as glTF plays them: (joints, times, 3, 3) and (joints, times, 3)."""
    at = np.clip(np.searchsorted(key_times, times, "right") - 1, 0, len(key_times) - 2)
    f = ((times - key_times[at]) / (key_times[at + 1] - key_times[at]))[:, None]
    turned, placed = [], []
    for (_, parent, position), q in zip(JOINTS, rotations):
        cosine = np.clip((q[at] * q[at + 1]).sum(1, keepdims=True), -1, 1)
        angle = np.maximum(np.arccos(cosine), 1e-9)
        local = matrices((np.sin((1 - f) * angle) * q[at] + np.sin(f * angle) * q[at + 1]) / np.sin(angle))
        if parent is None:
            turned.append(local)
            placed.append(root[at] * (1 - f) + root[at + 1] * f)
        else:
            turned.append(turned[parent] @ local)
            placed.append(placed[parent] + turned[parent] @ (position - JOINTS[parent][2]))
    return np.array(turned), np.array(placed)


def sliding(key_times, rotations, root):
    """How far the parts of the soles that stand on the ground move there, m: the largest distance between two places of the heel
    while it stands, and of the toes; and how deep any part of them gets into the floor."""
    times = np.linspace(0, DURATION, 5001)
    R, p = poses(times, key_times, rotations, root)
    worst, depth = 0.0, 0.0
    for side, m in (("left", 1), ("right", RIGHT)):
        foot, toes = NUMBER[f"{side} foot"], NUMBER[f"{side} toes"]
        heel = p[foot] + R[foot] @ ((HEEL - ANKLE) * m)
        tips = [p[toes] + R[toes] @ ((TOE * [1, 1, 0] + [x, y, 0] - TOE) * m) for x, y in ((0, -0.03), (0, 0.03), (0.06, 0))]
        phase = (times - landing(side, 0)) / CYCLE
        k, phase = np.floor(phase), phase - np.floor(phase)
        for points, first, last in ((heel, 0, LIFT), *((tip, FLAT, STANCE) for tip in tips)):
            depth = max(depth, -points[:, 2].min())
            for step in np.unique(k):
                stands = points[(k == step) & (phase >= first) & (phase <= last)]
                if len(stands):
                    worst = max(worst, np.linalg.norm(np.ptp(stands, axis=0)))
    return worst, depth
