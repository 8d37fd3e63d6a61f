"""Generate walker.glb: a person who walks through the room of scenes/room, past a vase on a plinth.

Run:  python3 make_walker.py [output file]        (needs NumPy only)

Procedural: the body and its clothes are implicit surfaces, meshed, textured and skinned here; the walk comes from footprints and
inverse kinematics. No downloaded asset. It prints how far the feet slide.
"""
import os
import sys

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(HERE, "..", "meshing"), os.path.join(HERE, "..", "room")]
sys.dont_write_bytecode = True

import walker_body as body  # noqa: E402
import walker_motion as motion  # noqa: E402
import walker_paint as paint  # noqa: E402
from glb import Glb  # noqa: E402
from skin import turns  # noqa: E402
from surface import of_field, turned  # noqa: E402

VASE = (0.30, -1.78)  # its place on the floor


def everywhere(p):
    return np.ones(len(p), bool)


def sweater_charts(p):
    q = p * np.where(p[:, 1:2] < 0, body.RIGHT, 1)
    arm = (body.TORSO(p) - body.SLEEVE(p) > 0.0) & ((q - body.SHOULDER) @ [0, 0.82, -0.57] > -0.01)
    along = (q - body.SHOULDER) @ body.UPPER
    axis = body.SHOULDER + along[:, None] * body.UPPER
    after = (q - body.ELBOW) @ body.LOWER
    axis = np.where(after[:, None] > 0, body.ELBOW + after[:, None] * body.LOWER, axis)
    r = q - axis
    sleeve = np.stack([turns(r[:, 0], r[:, 1]), np.clip((along + 0.06) / 0.58, 0.004, 0.996)], -1)
    torso = np.stack([turns(p[:, 0], p[:, 1]), np.clip((1.50 - p[:, 2]) / (1.50 - 0.92), 0.004, 0.996)], -1)
    return [(everywhere(p), torso, True), (arm, sleeve, True)]


def trousers_charts(p):
    v = np.clip((1.01 - p[:, 2]) / (1.01 - 0.05), 0, 0.999)
    around = np.stack([turns(p[:, 0], p[:, 1]), v], -1)
    x, y = p[:, 0], np.abs(p[:, 1]) - 0.092
    leg = np.stack([turns(y, x), v], -1)
    return [(everywhere(p), around, True), (p[:, 2] < 0.85, leg, True)]


def head_charts(p):
    v = (paint.HEAD_HIGH - p[:, 2]) / (paint.HEAD_HIGH - paint.HEAD_LOW)
    return [(everywhere(p), np.stack([turns(p[:, 0], p[:, 1]), np.clip(v, 0, 1)], -1), True)]


def hair_charts(p):
    q = p - [-0.02, 0.0, 1.66]
    v = np.arccos(np.clip(q[:, 2] / np.linalg.norm(q, axis=1), -1, 1)) / np.pi
    return [(everywhere(p), np.stack([turns(q[:, 0], q[:, 1]), v], -1), True)]


def hand_charts(p):
    q = p * np.where(p[:, 1:2] < 0, body.RIGHT, 1) - body.WRIST
    return [(everywhere(p), np.stack([turns(q[:, 0], q[:, 1]), np.clip(q @ body.LOWER / 0.2 + 0.2, 0, 0.999)], -1), True)]


def shoe_charts(p):
    q = p - [0.04, 0, 0]
    u = turns(q[:, 0], np.abs(q[:, 1]) - 0.09)
    return [(everywhere(p), np.stack([u, np.clip(1 - q[:, 2] / 0.12, 0.001, 0.999)], -1), True)]


def garments(glb):
    """The surfaces of the figure, with the indices of their materials."""
    parts = (
        ("sweater", body.sweater(), (-0.20, -0.46, 0.88), (0.20, 0.46, 1.53), (0.021, 0.021, 0.022), sweater_charts, body.sweater_weights, paint.knitted, 0.9),
        ("trousers", body.trousers(), (-0.17, -0.21, 0.04), (0.17, 0.21, 1.03), (0.018, 0.018, 0.029), trousers_charts, body.trousers_weights, paint.denim, 0.9),
        ("head", body.head(), (-0.12, -0.11, 1.42), (0.14, 0.11, 1.77), (0.0110, 0.0100, 0.0105), head_charts, body.head_weights, paint.face, 0.5),
        ("hair", body.hair(), (-0.14, -0.11, 1.54), (0.13, 0.11, 1.80), 0.0125, hair_charts, body.hair_weights, paint.strands, 0.45),
        ("hands", body.hands(), (-0.06, -0.48, 0.64), (0.20, 0.48, 0.99), 0.0094, hand_charts, body.hands_weights, paint.skin, 0.5),
        ("shoes", body.shoes(), (-0.10, -0.16, -0.02), (0.21, 0.16, 0.15), 0.0155, shoe_charts, body.shoes_weights, paint.sneaker, 0.6),
    )
    for name, field, low, high, cell, charts, weights, image, roughness in parts:
        surface = of_field(field, low, high, cell, charts, weights)
        print("%-9s %6d triangles" % (name, len(surface.triangles)))
        yield surface, glb.material(name, image(), roughness=roughness)


def vase():
    z, r = np.array([(0.0, 0.062), (0.012, 0.070), (0.10, 0.108), (0.20, 0.128), (0.28, 0.110), (0.35, 0.062), (0.40, 0.048), (0.43, 0.058), (0.445, 0.068)]).T
    fine = np.linspace(0, 0.445, 45)
    smooth = np.interp(fine, z, r)
    for _ in range(3):
        smooth[1:-1] = 0.25 * smooth[:-2] + 0.5 * smooth[1:-1] + 0.25 * smooth[2:]
    outside = np.stack([smooth, fine], -1)
    inside = np.stack([smooth - 0.006, fine], -1)[::-1][:25]
    foot = np.array([(0.0, 0.0), (smooth[0], 0.0)])
    profile = np.vstack([foot, outside, inside[:1], inside, [(0.0, inside[-1, 1])]])
    v = np.concatenate([[1, 1], 1 - fine / 0.445, [0], 0.02 * np.ones(len(inside)), [0.02]])
    return profile, np.clip(v, 0.002, 0.998)


def plinth(height=0.86, half=0.15):
    """Profile of a square pillar, as a surface of revolution with four sides."""
    r = half * np.sqrt(2)
    return np.array([(r + 0.02, 0.0), (r + 0.02, 0.06), (r + 0.02, 0.06), (r, 0.06), (r, 0.06), (r, height - 0.05), (r, height - 0.05), (r + 0.02, height - 0.05),
                     (r + 0.02, height - 0.05), (r + 0.02, height), (r + 0.02, height), (0.0, height)])


def main():
    path = sys.argv[1] if len(sys.argv) > 1 else os.path.join(HERE, "walker.glb")
    glb = Glb()
    surfaces = list(garments(glb))
    print("figure    %6d triangles" % sum(len(s.triangles) for s, _ in surfaces))
    skin = glb.skeleton(body.JOINTS)
    glb.node(name="Walker", mesh=glb.mesh("Walker", surfaces), skin=skin)

    profile, v = vase()
    glaze = glb.material("glaze", paint.glaze(), roughness=0.15)
    stone = glb.material("stone", paint.stone(), roughness=0.7)
    pillar = flat_sided(plinth(), 4)
    top = (*VASE, 0.86)
    glb.node(name="Vase", mesh=glb.mesh("Vase", [(turned(profile, 48, top, v), glaze), (pillar, stone)]))

    times = np.arange(int(motion.DURATION * motion.RATE) + 1) / motion.RATE
    R, root = motion.walk(times)
    rotations = motion.local_rotations(R)
    glb.animation("Walk", times, dict(enumerate(rotations)), {0: root})
    glb.write(path)
    slip, depth = motion.sliding(times, rotations, root)
    print("way %.2f m, %.2f m/s; feet slide by at most %.1f mm, and sink by %.1f mm" % (motion.PATH.length, motion.SPEED, 1000 * slip, 1000 * depth))
    print("%s: %d bytes" % (path, os.path.getsize(path)))


def flat_sided(profile, sides):
    """Like turned, with flat sides, the first of which faces along x."""
    s = turned(profile, sides)
    points = s.points @ turn_z(np.pi / sides).T + [*VASE, 0.0]
    corners = points[s.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    s.points, s.normals, s.uv = corners.reshape(-1, 3), np.repeat(normals, 3, 0), s.uv[s.triangles].reshape(-1, 2)
    s.triangles = np.arange(len(s.points)).reshape(-1, 3)
    return s


def turn_z(angle):
    return np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])


if __name__ == "__main__":
    main()
