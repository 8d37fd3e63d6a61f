"""Generate hand.glb: a right hand that opens, makes a fist, points and waves.

Run:  python3 make_hand.py [output file]        (needs NumPy only)

World frame: metres, z up. The forearm comes from below, the palm faces +x, the thumb is towards +y. No downloaded asset.
"""
import os
import sys

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, "..", "meshing"), os.path.join(HERE, "..", "room")]
sys.dont_write_bytecode = True

from fields import below, cone, ellipsoid, intersection, sphere, union  # noqa: E402
from glb import Glb  # noqa: E402
from paint import around_turns, coded, texels  # noqa: E402
from room_noise import fbm, mix, srgb, step  # noqa: E402
from rotations import about, around, quaternions  # noqa: E402
from skin import chain, ramp, turns  # noqa: E402
from surface import of_field  # noqa: E402

DURATION, RATE = 5.0, 30
LEFT, WIDE = -0.075, 0.19  # least y, and width, of the texture's projection, m
WRIST, FOREARM = np.array([0, 0, 0.0]), np.array([0, 0, -0.12])
# Name: knuckle, direction, lengths of the three bones, radii at its ends
FINGERS = {
    "index": ((0.002, 0.031, 0.092), 6, (0.043, 0.026, 0.021), (0.0094, 0.0074)),
    "middle": ((0.0, 0.0095, 0.097), 1, (0.047, 0.030, 0.022), (0.0095, 0.0075)),
    "ring": ((0.0, -0.0120, 0.092), -5, (0.043, 0.028, 0.022), (0.0091, 0.0072)),
    "little": ((0.003, -0.0315, 0.082), -13, (0.034, 0.021, 0.019), (0.0080, 0.0064)),
}
THUMB = ((0.008, 0.022, 0.024), np.array([0.30, 0.70, 0.62]), (0.044, 0.032, 0.025), (0.0130, 0.0090))
THUMB_AXIS = np.cross(THUMB[1], (0.55, -0.75, 0.45))  # about which it bends to the palm


def bones():
    """Joints of the skeleton, and for each finger its points and radii."""
    joints = [("forearm", None, FOREARM), ("wrist", 0, WRIST)]
    fingers = {}
    for name, (start, spread, lengths, radii) in (*FINGERS.items(), ("thumb", THUMB)):
        direction = np.array([0.03, np.sin(np.radians(spread)), np.cos(np.radians(spread))]) if np.isscalar(spread) else spread
        direction = direction / np.linalg.norm(direction)
        points = [np.array(start) + direction * reach for reach in np.concatenate([[0], np.cumsum(lengths)])]
        for k in range(3):
            joints.append((f"{name} {k + 1}", 1 if k == 0 else len(joints) - 1, points[k]))
        fingers[name] = points, np.linspace(*radii, 4)
    return joints, fingers


JOINTS, POINTS = bones()
NUMBER = {name: k for k, (name, _, _) in enumerate(JOINTS)}


def finger(points, radii):
    return union(*(cone(points[k], points[k + 1], radii[k], radii[k + 1]) for k in range(3)), *(sphere(points[k], radii[k] * 1.05) for k in (1, 2)), k=0.003)


def flesh():
    palm = union(*(cone((0.001, 0.30 * points[0][1], 0.004), points[0] + [0.001, 0, -0.004], 0.016, 0.0118) for name, (points, _) in POINTS.items() if name != "thumb"), k=0.014)
    palm = union(palm, ellipsoid((0.007, 0.022, 0.036), (0.016, 0.018, 0.030)), ellipsoid((0.006, -0.020, 0.032), (0.013, 0.014, 0.030)), k=0.014)
    arm = union(cone((0, 0.006, -0.14), (0, 0.005, 0.0), 0.026, 0.0185), cone((0, -0.006, -0.14), (0, -0.005, 0.0), 0.026, 0.0185), k=0.02)
    hand = union(palm, arm, k=0.016)
    for points, radii in POINTS.values():
        hand = union(hand, finger(points, radii), k=0.006)
    return intersection(hand, below((0, 0, -0.11), (0, 0, -1)))


def sleeve():
    return intersection(union(cone((0, 0, -0.16), (0, 0, -0.062), 0.046, 0.037), k=0), below((0, 0, -0.050), (0, 0, 1)), below((0, 0, -0.135), (0, 0, -1)), k=0.008)


def weights(p):
    """Each point belongs to the fingers that are about as near as the nearest one, and to the bones along them."""
    distances = np.stack([finger(points, radii)(p) for points, radii in POINTS.values()], -1)
    share = np.exp(-(distances - distances.min(-1, keepdims=True)) / 0.002)
    share /= share.sum(-1, keepdims=True)
    total = np.zeros((len(p), len(JOINTS)))
    for k, (name, (points, _)) in enumerate(POINTS.items()):
        direction = (points[-1] - points[0]) / np.linalg.norm(points[-1] - points[0])
        along = (p - points[0]) @ direction
        reach = [0.0, *np.cumsum([np.linalg.norm(points[i + 1] - points[i]) for i in range(2)])]
        wide = 0.016 if name == "thumb" else 0.011
        total += share[:, k:k + 1] * chain(p, NUMBER, ("forearm", None), ("wrist", ramp(-0.016, 0.016, p[:, 2])),
                                           *((f"{name} {i + 1}", ramp(-wide if i == 0 else -0.007, wide if i == 0 else 0.007, along - reach[i])) for i in range(3)))
    return total


def charts(p):
    """The palm is seen from the front in the left half of the texture, the back in the right half."""
    at = np.stack([(p[:, 1] - LEFT) / WIDE * 0.5, np.clip((0.22 - p[:, 2]) / 0.34, 0.002, 0.998)], -1)
    back = at * [1, 1] + [0.5, 0]
    return [(p[:, 0] > -1, at, False), (p[:, 0] < 0.0, back, False)]


def sleeve_charts(p):
    return [(p[:, 2] < 9, np.stack([turns(p[:, 0], p[:, 1]), np.clip((-0.04 - p[:, 2]) / 0.1, 0, 1)], -1), True)]


def skin_texture():
    u, v = texels(384, 384)
    back = u > 0.5
    y, z = np.mod(u, 0.5) * 2 * WIDE + LEFT, 0.22 - v * 0.34
    rgb = mix(srgb("#d9a585"), srgb("#bd7f62"), fbm(y * 90, z * 90, back * 9.0, 4, 1))
    rgb = mix(rgb, srgb("#e4b59b"), 0.5 * ~back)
    for k, (points, radii) in enumerate(POINTS.values()):
        direction = points[-1] - points[0]
        direction, length = direction[1:] / np.linalg.norm(direction[1:]), np.linalg.norm(direction[1:])
        along = (y - points[0][1]) * direction[0] + (z - points[0][2]) * direction[1]
        across = (y - points[0][1]) * direction[1] - (z - points[0][2]) * direction[0]
        near = np.abs(across) < 1.15 * radii[0]
        nail = step(1.0, 0.85, (across / (0.62 * radii[-1])) ** 4 + ((along - length + 0.006) / 0.0062) ** 4)
        rgb = mix(rgb, srgb("#f0cbb8"), nail * back)
        rgb = mix(rgb, srgb("#a8705a"), back * (step(1.35, 1.1, (across / (0.62 * radii[-1])) ** 4 + ((along - length + 0.006) / 0.0062) ** 4) - nail))
        for crease in (0.0, *np.cumsum([np.linalg.norm(points[i + 1] - points[i]) for i in range(2)])):
            wobble = crease + 0.0004 * np.sin(across * 400 + k)
            line = np.minimum(np.abs(along - wobble), np.abs(along - wobble - 0.003 * back))
            rgb = mix(rgb, srgb("#935946"), 0.4 * near * step(0.0010, 0.0002, line))
    for a, b, c in ((0.078, -0.020, 0.035), (0.062, 0.004, 0.040), (0.040, 0.020, 0.025)):  # lines of the palm
        line = np.abs(z - a + 7 * (y - b) ** 2 - 0.2 * y)
        rgb = mix(rgb, srgb("#935946"), 0.4 * ~back * step(0.0014, 0.0004, line) * (np.abs(y - b) < c))
    pores = fbm(y * 900, z * 900, back * 5.0, 3, 4)
    return coded(np.clip(rgb * (0.78 + 0.44 * pores)[..., None], 0, 1))


def sleeve_texture():
    u, v = texels(256, 128)
    rgb = mix(srgb("#20364f"), srgb("#d9d2c0"), step(0.45, 0.55, np.abs(np.mod(u * 24, 1) - 0.5) * 2) * (v > 0.22))
    return coded(np.clip(rgb * (0.8 + 0.4 * around_turns(u, v, 50, 40, 2, 3))[..., None], 0, 1))


# Times of gestures, and how far each finger is bent then (0 to 1): index, middle, ring, little, thumb.
GESTURES = ((0.0, (0.05, 0.03, 0.05, 0.08, 0.0)), (0.5, (0.0, 0.0, 0.0, 0.0, 0.0)), (1.1, (1, 1, 1, 1, 1)), (1.6, (1, 1, 1, 1, 1)),
            (2.0, (0.03, 1, 1, 1, 0.95)), (2.7, (0.0, 1, 1, 1, 0.95)), (3.2, (0.06, 0.05, 0.06, 0.08, 0.05)), (5.0, (0.05, 0.03, 0.05, 0.08, 0.0)))


def bent(times, k):
    """Eased from gesture to gesture; the fingers follow one another a little."""
    t = times - 0.03 * k
    at = np.array([time for time, _ in GESTURES])
    values = np.array([pose[k] for _, pose in GESTURES])
    i = np.clip(np.searchsorted(at, t, "right") - 1, 0, len(at) - 2)
    return values[i] + (values[i + 1] - values[i]) * ramp(0, 1, (t - at[i]) / (at[i + 1] - at[i]))


def gestures(times):
    """Rotations of each joint relative to its parent."""
    wave = ramp(3.1, 3.4, times) * ramp(4.95, 4.6, times)
    R = {"forearm": about(0, 0.16 * wave * np.sin(2 * np.pi * 2 * (times - 3.1))) @ about(2, 0.10 * np.sin(1.3 * times)),
         "wrist": about(0, 0.30 * wave * np.sin(2 * np.pi * 2 * (times - 3.1) - 0.7)) @ about(1, 0.12 * np.sin(0.9 * times) - 0.2 * bent(times, 1))}
    for k, name in enumerate(FINGERS):
        b = bent(times, k)
        for i, angle in enumerate((86, 106, 66)):
            R[f"{name} {i + 1}"] = about(1, np.radians(angle) * b)
    b = bent(times, 4)
    for i, angle in enumerate((34, 38, 46)):
        R[f"thumb {i + 1}"] = around(THUMB_AXIS, np.radians(angle) * b)
    return R


def main():
    path = sys.argv[1] if len(sys.argv) > 1 else os.path.join(HERE, "hand.glb")
    glb = Glb()
    hand = of_field(flesh(), (-0.05, -0.075, -0.125), (0.06, 0.10, 0.215), 0.0041, charts, weights)
    cuff = of_field(sleeve(), (-0.06, -0.06, -0.15), (0.06, 0.06, -0.03), 0.008, sleeve_charts, lambda p: chain(p, NUMBER, ("forearm", None)))
    print("%d triangles" % (len(hand.triangles) + len(cuff.triangles)))
    surfaces = [(hand, glb.material("skin", skin_texture(), roughness=0.45)), (cuff, glb.material("sleeve", sleeve_texture(), roughness=0.9))]
    skin = glb.skeleton(JOINTS)
    glb.node(name="Hand", mesh=glb.mesh("Hand", surfaces), skin=skin)
    times = np.arange(int(DURATION * RATE) + 1) / RATE
    R = gestures(times)
    glb.animation("Gestures", times, {k: quaternions(R[name]) for k, (name, _, _) in enumerate(JOINTS)}, {})
    glb.write(path)
    print("%s: %d bytes" % (path, os.path.getsize(path)))


if __name__ == "__main__":
    main()
