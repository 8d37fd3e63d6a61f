"""Generate eye.glb: an eye with iris and glossy cornea, which looks about and blinks.

Run:  python3 make_eye.py [output file]        (needs NumPy only)

World frame: metres, z up, origin at the centre of the eyeball, which looks along +x at rest. No downloaded asset.
"""
import os
import sys

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, "..", "meshing"), os.path.join(HERE, "..", "room")]
sys.dont_write_bytecode = True

from glb import Glb  # noqa: E402
from paint import around_turns, coded, texels  # noqa: E402
from room_noise import fbm, mix, srgb, step  # noqa: E402
from rotations import about, quaternions  # noqa: E402
from skin import ramp  # noqa: E402
from surface import Surface, strongest  # noqa: E402

DURATION, RATE = 5.0, 120          # keys per second: saccades are short
BALL, LID = 0.0120, 0.0131         # radii of the eyeball and of the lids, m
IRIS, CORNEA = np.radians(29.0), np.radians(33.0)
JOINTS = [("head", None, np.zeros(3)), ("eyeball", 0, np.zeros(3)), ("upper lid", 0, np.zeros(3)), ("lower lid", 0, np.zeros(3))]


def grid(points, uv, weights):
    """A surface of a grid of points (rows, columns, 3), whose normals point to the left of a walk along rows, then columns."""
    rows, columns = points.shape[:2]
    a = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    triangles = np.vstack([np.stack([a, a + 1, a + columns + 1], -1), np.stack([a, a + columns + 1, a + columns], -1)])
    flat = points.reshape(-1, 3)
    corners = flat[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    used = np.linalg.norm(normal, axis=1) > 1e-14
    normals = np.zeros_like(flat)
    for k in range(3):
        np.add.at(normals, triangles[used][:, k], normal[used])
    normals = normals.reshape(points.shape)
    if np.allclose(points[:, 0], points[:, -1]):  # closed along a row
        normals[:, 0] = normals[:, -1] = normals[:, 0] + normals[:, -1]
    normals[0] = normals[0].mean(0) if np.allclose(points[0], points[0, 0]) else normals[0]
    normals[-1] = normals[-1].mean(0) if np.allclose(points[-1], points[-1, 0]) else normals[-1]
    normals /= np.maximum(np.linalg.norm(normals, axis=2, keepdims=True), 1e-30)
    return Surface(flat, normals.reshape(-1, 3), triangles[used], uv.reshape(-1, 2), *strongest(weights.reshape(-1, len(JOINTS))))


def eyeball():
    """Rings about the axis of sight; the cornea bulges."""
    polar = np.radians(np.concatenate([np.linspace(0, 40, 29), np.linspace(44, 180, 28)]))
    turn = np.linspace(0, 2 * np.pi, 49)
    radius = BALL + 0.0010 * ramp(1, 0, polar / CORNEA) ** 1.2
    p, t = np.meshgrid(polar, turn, indexing="ij")
    r = radius[:, None]
    points = np.stack([r * np.cos(p), r * np.sin(p) * np.cos(t), r * np.sin(p) * np.sin(t)], -1)
    uv = np.stack([t / (2 * np.pi), p / np.pi], -1)
    weights = np.zeros((*p.shape, len(JOINTS)))
    weights[..., 1] = 1
    return grid(points, uv, weights)


# Of the opening, by the angle about its middle: half its width, and its heights above and below, as angles of the eyeball.
WIDTH, ABOVE, BELOW = np.radians(50), np.radians(23), np.radians(19)


def face():
    """Rings about the opening: the thickness of the lids, the lids on their sphere, and the face around."""
    phi = np.linspace(0, 2 * np.pi, 97)
    c, s = np.cos(phi), np.sin(phi)
    up = s > 0
    height = np.where(up, ABOVE, BELOW) * np.abs(s) ** 1.15 * np.sign(s)
    azimuth = WIDTH * np.sign(c) * np.abs(c) ** 0.92
    rows, weights = [], []
    outline = np.stack([0 * c - 0.001, 0.034 * c, 0.030 * s + 0.002], -1)

    def on_sphere(a, e, r):
        return r[..., None] * np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], -1)

    fold = np.where(up, np.radians(30), np.radians(24)) * np.abs(s) ** 0.6
    steps = [(0.0, BALL * 1.006), (0.0, LID - 0.0004), (0.03, LID)] + [(x, LID + 0.0004 * np.sin(np.pi * x)) for x in np.linspace(0.10, 1, 16)]
    for x, r in steps:
        e = height + np.sign(s) * fold * x
        a = azimuth * (1 + 0.22 * x)
        rows.append(on_sphere(a, e, np.full(len(phi), r)))
        weights.append(np.abs(s) ** 0.8 * ramp(1.0, 0.35, np.full(len(phi), x)))
    last = rows[-1]
    for x in np.linspace(0, 1, 25)[1:]:
        p = last + (outline - last) * x
        bulge = 0.0060 * np.exp(-((p[:, 2] - 0.0165) / 0.0055) ** 2) + 0.0016 * np.exp(-((p[:, 2] + 0.016) / 0.004) ** 2)
        crease = -0.0012 * np.exp(-((x - 0.04) / 0.04) ** 2) * np.abs(s)
        p[:, 0] = last[:, 0] + (0.0035 - last[:, 0]) * ramp(0, 0.7, x) - 0.006 * ramp(0.75, 1.0, x) + (bulge * ramp(0, 0.25, x) + crease) * ramp(1.0, 0.8, x)
        rows.append(p)
        weights.append(0 * s)
    points, lids = np.array(rows), np.array(weights)
    w = np.zeros((*lids.shape, len(JOINTS)))
    w[..., 2], w[..., 3] = lids * up, lids * ~up
    w[..., 0] = 1 - lids
    uv = np.stack([0.5 + points[..., 1] / 0.076, 0.5 - (points[..., 2] - 0.002) / 0.076], -1)
    return grid(points[:, ::-1], uv[:, ::-1], w[:, ::-1])


def eyeball_texture():
    u, v = texels(352, 352)
    polar = v * np.pi
    veins = np.abs(around_turns(u, v, 26, 9, 4, 3) - 0.5)
    rgb = mix(srgb("#e9e3dc"), srgb("#b4473e"), 0.55 * step(0.030, 0.0, veins) * step(0.5, 1.1, polar) + 0.25 * step(1.0, 1.6, polar))
    rays = around_turns(u, v * 0.15, 85, 3, 3, 5)
    iris = mix(srgb("#2f6d6a"), srgb("#9cc3a0"), np.clip(2.2 * (rays - 0.3), 0, 1))
    iris = mix(iris, srgb("#a8702f"), step(0.30, 0.19, polar + 0.10 * (rays - 0.5)))
    iris = mix(iris, srgb("#10292d"), step(0.44, 0.505, polar))
    rgb = mix(rgb, iris, step(IRIS + 0.012, IRIS - 0.012, polar))
    rgb = mix(rgb, srgb("#050404"), step(0.185, 0.165, polar))
    return coded(np.clip(rgb * (0.93 + 0.14 * around_turns(u, v, 60, 60, 2, 7))[..., None], 0, 1))


def face_texture():
    u, v = texels(352, 352)
    y, z = (u - 0.5) * 0.076, 0.002 - (v - 0.5) * 0.076
    rgb = mix(srgb("#d2a183"), srgb("#b6795f"), fbm(y * 160, z * 160, 0, 4, 2))
    inside = (y / 0.0106) ** 2 + (np.where(z > 0, z / 0.0057, z / 0.0048)) ** 2
    rgb = mix(rgb, srgb("#b0685a"), 0.6 * step(1.45, 0.9, inside))
    rgb = mix(rgb, srgb("#8d5a4c"), 0.35 * np.exp(-((z + 0.0105) / 0.002) ** 2) * step(0.02, 0.012, np.abs(y)))
    # the brow: hairs that lean outwards, and the line of the lashes
    hair = fbm(y * 700 + z * 500, z * 90 - y * 40, 0, 3, 4)
    brow = np.exp(-((z - 0.0195 - 14 * (y * y) * -1 - 0.001) / 0.0026) ** 4) * step(0.030, 0.024, np.abs(y + 0.001))
    rgb = mix(rgb, srgb("#2a1a12"), np.clip(brow * (0.55 + 1.1 * (hair - 0.4)), 0, 1))
    rgb = mix(rgb, srgb("#1d1210"), 0.85 * step(0.24, 0.10, np.abs(inside - 1.06)) * (0.55 + 0.45 * (z > 0)))
    pores = fbm(y * 1900, z * 1900, 0, 3, 6)
    return coded(np.clip(rgb * (0.80 + 0.40 * pores)[..., None], 0, 1))


# Saccades: time, and where the eye looks then, to its left and upwards, degrees. A saccade of d degrees takes 21 ms + 2.2 ms d
# (Bahill et al. 1975); in between, the eye drifts.
GAZE = ((0.0, 0, 0), (0.55, 18, 4), (1.10, -16, 6), (1.75, -20, -9), (2.30, 3, -5), (2.80, 4, 9), (3.30, 22, -2), (3.90, -8, 0), (4.45, 0, 0))
BLINKS = (1.42, 3.05, 4.40)        # when the lids begin to close


def smooth(x):
    x = np.clip(x, 0, 1)
    return x ** 3 * (10 - 15 * x + 6 * x * x)


def gaze(times):
    side, up = np.zeros_like(times), np.zeros_like(times)
    for (_, a, b), (t, c, d) in zip(GAZE[:-1], GAZE[1:]):
        f = smooth((times - t) / (0.021 + 0.0022 * np.hypot(c - a, d - b)))
        side, up = side + (c - a) * f, up + (d - b) * f
    side = side + 0.25 * np.sin(2 * np.pi * 0.9 * times) + 0.12 * np.sin(2 * np.pi * 2.3 * times + 1)
    up = up + 0.20 * np.sin(2 * np.pi * 1.1 * times + 2)
    return np.radians(side), np.radians(up)


def closed(times):
    """How far the lids are closed: closing takes 0.09 s, opening 0.17 s."""
    total = np.zeros_like(times)
    for t in BLINKS:
        total = np.maximum(total, np.minimum(smooth((times - t) / 0.09), 1 - smooth((times - t - 0.12) / 0.17)))
    return total


def main():
    path = sys.argv[1] if len(sys.argv) > 1 else os.path.join(HERE, "eye.glb")
    glb = Glb()
    ball, skin = eyeball(), face()
    print("%d triangles" % (len(ball.triangles) + len(skin.triangles)))
    surfaces = [(ball, glb.material("eyeball", eyeball_texture(), roughness=0.08)), (skin, glb.material("face", face_texture(), roughness=0.5))]
    joints = glb.skeleton(JOINTS)
    glb.node(name="Eye", mesh=glb.mesh("Eye", surfaces), skin=joints)
    times = np.arange(int(DURATION * RATE) + 1) / RATE
    side, up = gaze(times)
    shut = closed(times)
    upper = (1 - shut) * (-0.55 * up) + shut * np.radians(34)   # the lids follow the gaze upwards and downwards
    lower = (1 - shut) * (-0.30 * up) - shut * np.radians(11.5)
    rotations = [about(1, 0 * times), about(2, side) @ about(1, -up), about(1, upper), about(1, lower)]
    glb.animation("Look and blink", times, {k: quaternions(R) for k, R in enumerate(rotations)}, {})
    glb.write(path)
    print("%s: %d bytes" % (path, os.path.getsize(path)))


if __name__ == "__main__":
    main()
