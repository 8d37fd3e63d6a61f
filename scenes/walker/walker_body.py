"""The figure at rest: joints, implicit surfaces of its clothes and its body, skin weights. x forward, y to its left, z up; metres.

It stands with straight legs on z = 0, and its arms hang 22 degrees away from it.
"""
import numpy as np

from fields import below, box, cone, displaced, ellipsoid, grown, intersection, sphere, torus, union, without
from skin import chain, ramp

ARM = np.radians(22)                                 # from the vertical, in the rest pose
FOREARM = np.radians(12)                             # forward, likewise
SHOULDER = np.array([-0.012, 0.182, 1.405])
UPPER = np.array([0, np.sin(ARM), -np.cos(ARM)])     # directions of the left arm
LOWER = np.array([np.sin(FOREARM), np.sin(ARM) * np.cos(FOREARM), -np.cos(ARM) * np.cos(FOREARM)])
ELBOW = SHOULDER + 0.285 * UPPER
WRIST = ELBOW + 0.245 * LOWER
HIP, KNEE = np.array([0, 0.09, 0.915]), np.array([0.008, 0.092, 0.495])
ANKLE, TOE = np.array([-0.012, 0.09, 0.085]), np.array([0.115, 0.098, 0.026])
HEEL = np.array([-0.078, 0.09, 0.0])                 # the point of the sole that lands first
RIGHT = np.array([1, -1, 1])

JOINTS = [("pelvis", None, np.array([0, 0, 0.95])), ("spine", 0, np.array([-0.01, 0, 1.07])),
          ("chest", 1, np.array([-0.015, 0, 1.22])), ("neck", 2, np.array([-0.02, 0, 1.465])),
          ("head", 3, np.array([0.0, 0, 1.56]))]
for _side, _m in (("left", 1), ("right", RIGHT)):
    _n = len(JOINTS)
    JOINTS += [(f"{_side} collarbone", 2, np.array([-0.005, 0.03, 1.42]) * _m), (f"{_side} upper arm", _n, SHOULDER * _m),
               (f"{_side} forearm", _n + 1, ELBOW * _m), (f"{_side} hand", _n + 2, WRIST * _m),
               (f"{_side} thigh", 0, HIP * _m), (f"{_side} shin", _n + 4, KNEE * _m),
               (f"{_side} foot", _n + 5, ANKLE * _m), (f"{_side} toes", _n + 6, TOE * _m)]
NUMBER = {name: k for k, (name, _, _) in enumerate(JOINTS)}


def both(field):
    """A field for the left side, on both sides."""
    return lambda p: field(np.stack([p[..., 0], np.abs(p[..., 1]), p[..., 2]], -1))


# ----------------------------------------------------------------- clothes
TORSO = union(ellipsoid((-0.012, 0, 1.275), (0.112, 0.160, 0.185)), ellipsoid((0.012, 0, 1.07), (0.112, 0.146, 0.16)),
              ellipsoid((-0.018, 0, 0.945), (0.131, 0.178, 0.125)), k=0.10)
SHOULDERS = both(union(cone((-0.015, 0, 1.40), SHOULDER - [0, 0.022, 0.004], 0.070, 0.060),
                       cone((-0.025, 0.02, 1.49), (-0.015, 0.135, 1.425), 0.048, 0.050), k=0.05))
SLEEVE = both(union(cone(SHOULDER - 0.01 * UPPER, ELBOW, 0.061, 0.050), cone(ELBOW, WRIST, 0.050, 0.039), k=0.02))


def folds(p):
    """Creases of the sweater above its hem and at the elbows, in metres."""
    waist = np.exp(-((p[..., 2] - 1.02) / 0.055) ** 2) * np.sin(p[..., 2] * 105 + 2.2 * np.sin(5 * p[..., 1]) + 9 * p[..., 0])
    elbow = np.exp(-(((p - ELBOW * np.where(p[..., 1:2] < 0, RIGHT, 1)) ** 2).sum(-1)) / 0.055 ** 2)
    return 0.0035 * waist + 0.0035 * elbow * np.sin((p[..., 2] + 0.3 * p[..., 0]) * 150)


def sweater():
    cuff = both(cone(WRIST - 0.052 * LOWER, WRIST - 0.012 * LOWER, 0.040, 0.037))
    hem = intersection(grown(TORSO, 0.007), below((0, 0, 0.98), (0, 0, 1)), k=0.01)
    body = union(TORSO, SHOULDERS, SLEEVE, k=0.035)
    body = union(displaced(body, folds), cuff, hem, k=0.012)
    body = intersection(body, below((0, 0, 0.925), (0, 0, -1)), both(below(WRIST - 0.008 * LOWER, LOWER)), k=0.008)
    body = without(body, cone((-0.014, 0, 1.545), (0.0, 0, 1.62), 0.060), k=0.01)
    return union(body, torus((-0.016, 0, 1.487), (0.30, 0, 1), 0.062, 0.013), k=0.015)


def trousers():
    hips = union(ellipsoid((-0.014, 0, 0.955), (0.112, 0.162, 0.10)), both(sphere((-0.055, 0.072, 0.905), 0.082)), k=0.06)
    leg = union(cone(HIP + [0, 0.0, -0.03], KNEE, 0.086, 0.064), cone(KNEE, ANKLE + [0, 0, 0.0], 0.063, 0.052),
                sphere((-0.012, 0.092, 0.38), 0.062), k=0.03)
    legs = both(leg)
    body = union(hips, legs, k=0.03)
    body = displaced(body, lambda p: 0.003 * np.exp(-((p[..., 2] - 0.47) / 0.06) ** 2) * np.sin(p[..., 2] * 130 + 30 * p[..., 0]) \
        + 0.004 * np.exp(-((p[..., 2] - 0.12) / 0.05) ** 2) * np.sin(p[..., 2] * 140 + 24 * p[..., 0]))
    return intersection(body, below((0, 0, 0.055), (0, 0, -1)), below((0, 0, 1.01), (0, 0, 1)), k=0.008)


def shoes():
    foot = union(cone((-0.035, 0.09, 0.040), (0.06, 0.094, 0.040), 0.038, 0.041), cone((0.06, 0.094, 0.038), (0.15, 0.101, 0.026), 0.042, 0.030),
                 cone((0.13, 0.084, 0.028), (0.165, 0.092, 0.024), 0.030, 0.024), cone((-0.025, 0.09, 0.06), (-0.012, 0.09, 0.12), 0.037, 0.040), k=0.03)
    sole = union(box((0.0, 0.091, 0.011), (0.078, 0.036, 0.012), 0.010), box((0.105, 0.096, 0.011), (0.088, 0.044, 0.012), 0.010), k=0.02)
    top = below((-0.02, 0.09, 0.115), (-0.25, 0, 1))
    return both(intersection(union(foot, sole, k=0.012), below((0, 0, 0), (0, 0, -1)), top, k=0.004))


# -------------------------------------------------------------------- skin
EYE = np.array([0.0815, 0.0315, 1.648])


def head():
    skull = union(ellipsoid((-0.008, 0, 1.662), (0.099, 0.077, 0.096)), ellipsoid((0.028, 0, 1.612), (0.066, 0.057, 0.078)), k=0.05)
    jaw = both(cone((0.008, 0.044, 1.592), (0.062, 0.013, 1.553), 0.021, 0.021))
    cheek = both(sphere((0.062, 0.040, 1.618), 0.026))
    face = union(skull, jaw, cheek, k=0.03)
    brow = union(both(cone((0.088, 0.012, 1.668), (0.070, 0.046, 1.668), 0.010, 0.009)), k=0)
    face = union(face, brow, k=0.018)
    face = without(face, both(ellipsoid((0.108, 0.033, 1.648), (0.022, 0.020, 0.013))), k=0.014)
    face = union(face, both(sphere(EYE, 0.0125)), k=0.003)
    nose = union(cone((0.091, 0, 1.655), (0.110, 0, 1.621), 0.0065, 0.0095), both(sphere((0.101, 0.0095, 1.617), 0.0085)), k=0.010)
    face = union(face, nose, k=0.012)
    lips = union(ellipsoid((0.0905, 0, 1.5845), (0.012, 0.023, 0.0055)), ellipsoid((0.0885, 0, 1.5745), (0.012, 0.020, 0.0065)), k=0.002)
    face = union(face, lips, k=0.006)
    ear = both(without(ellipsoid((-0.010, 0.083, 1.637), (0.019, 0.011, 0.031)), ellipsoid((-0.006, 0.094, 1.640), (0.010, 0.007, 0.018)), k=0.005))
    neck = cone((-0.022, 0, 1.42), (-0.010, 0, 1.57), 0.055, 0.050)
    return union(union(face, neck, k=0.025), ear, k=0.010)


def hair():
    def tufts(p):
        return 0.0022 * np.sin(110 * np.arctan2(p[..., 1], p[..., 0] + 0.03) + 20 * p[..., 2]) * ramp(1.62, 1.72, p[..., 2])
    shell = union(ellipsoid((-0.014, 0, 1.672), (0.108, 0.089, 0.104)), ellipsoid((-0.05, 0, 1.63), (0.072, 0.078, 0.085)),
                  ellipsoid((0.045, 0.018, 1.738), (0.052, 0.058, 0.030)), k=0.03)
    face = below((0.060, 0, 1.700), (0.80, 0, -0.60))
    sides = both(union(below((0.012, 0.0, 1.60), (1, 0, -0.2)), below((0, 0, 1.648), (0, 0, -1)), below((-0.045, 0, 1.60), (1, 0, -0.3)), k=0))
    back = below((0, 0, 1.565), (0, 0, -1))
    ears = both(cone((-0.004, 0.07, 1.638), (-0.006, 0.12, 1.634), 0.030))
    cut = intersection(displaced(shell, tufts), face, back, k=0.012)
    return without(intersection(cut, sides, k=0.01), ears, k=0.008)


def hands():
    z = LOWER
    x = np.array([1.0, 0, 0]) - z[0] * z
    x /= np.linalg.norm(x)
    y = np.cross(z, x)                                # away from the body's middle is -y: towards the palm is +y
    if y[1] > 0:
        y = -y                                        # points to the body
    at = lambda a, b, c: WRIST + a * x + b * y + c * z
    parts = [cone(at(0, 0, -0.06), at(0, 0, 0.02), 0.027, 0.026), box(at(0.002, 0.004, 0.052), (0.040, 0.015, 0.047), 0.014, np.stack([x, y, z]))]
    palm = union(*parts, k=0.02)
    palm = union(palm, cone(at(0.024, 0.008, 0.02), at(0.036, 0.012, 0.05), 0.017, 0.014), k=0.02)
    fingers = []
    for across, length, curl in ((0.030, 0.070, 0.26), (0.0105, 0.078, 0.32), (-0.0095, 0.073, 0.38), (-0.028, 0.058, 0.46)):
        a = np.array([across, 0.004, 0.090])
        b = a + 0.52 * length * np.array([0.06 * across / 0.03, np.sin(curl), np.cos(curl)])
        c = b + 0.52 * length * np.array([0, np.sin(2.2 * curl), np.cos(2.2 * curl)])
        fingers.append(union(cone(at(*a), at(*b), 0.0095, 0.0085), cone(at(*b), at(*c), 0.0085, 0.0070), k=0.003))
    thumb = union(cone(at(0.034, 0.010, 0.045), at(0.050, 0.020, 0.075), 0.0115, 0.0100), cone(at(0.050, 0.020, 0.075), at(0.049, 0.028, 0.102), 0.0100, 0.0085), k=0.003)
    return both(union(palm, union(*fingers), thumb, k=0.008))


# ------------------------------------------------------------------ weights
def sided(points, one_side):
    """Weights of both sides, from a function of mirrored points and a side, for parts that are apart."""
    mirrored = points * np.array([1, 1, 1]) * np.where(points[:, 1:2] < 0, RIGHT, 1)
    left, right = one_side(mirrored, "left"), one_side(mirrored, "right")
    return np.where(points[:, 1:2] < 0, right, left)


def hips_and_legs(p):
    """The pelvis and the thighs; between the legs, both thighs meet."""
    y = np.abs(p[:, 1])
    leg = ramp(-0.075, 0.075, (0.895 - p[:, 2]) - 0.35 * (0.09 - y))
    left = ramp(-0.022, 0.022, p[:, 1])
    return leg * left, leg * (1 - left)


def trousers_weights(p):
    left, right = hips_and_legs(p)
    w = np.zeros((len(p), len(JOINTS)))
    w[:, NUMBER["pelvis"]] = 1 - left - right
    knee = ramp(-0.065, 0.065, 0.495 - p[:, 2])
    for name, part in (("left", left), ("right", right)):
        w[:, NUMBER[f"{name} thigh"]] = part * (1 - knee)
        w[:, NUMBER[f"{name} shin"]] = part * knee
    return w


def sweater_weights(p):
    left, right = hips_and_legs(p)
    above = ramp(-0.08, 0.08, p[:, 2] - 1.07)
    w = chain(p, NUMBER, ("pelvis", None), ("spine", above), ("chest", ramp(-0.09, 0.09, p[:, 2] - 1.22)))
    for name, part in (("left", left), ("right", right)):
        part = part * (1 - above)
        w *= (1 - part)[:, None]
        w[:, NUMBER[f"{name} thigh"]] += part
    body = union(TORSO, k=0)(p)
    q = p * np.where(p[:, 1:2] < 0, RIGHT, 1)
    arm = ramp(-0.035, 0.035, body - SLEEVE(p)) * ramp(-0.055, 0.045, (q - SHOULDER) @ np.array([0, 0.82, -0.57]))
    collarbone = ramp(0.05, 0.14, q[:, 1]) * ramp(1.27, 1.38, q[:, 2])
    fore = ramp(-0.05, 0.05, (q - ELBOW) @ ((UPPER + LOWER) / np.linalg.norm(UPPER + LOWER)))
    for name, here in (("left", p[:, 1] >= 0), ("right", p[:, 1] < 0)):
        for joint, fraction in ((f"{name} collarbone", collarbone), (f"{name} upper arm", arm), (f"{name} forearm", fore * arm)):
            fraction = np.where(here, fraction, 0)
            w *= (1 - fraction)[:, None]
            w[:, NUMBER[joint]] += fraction
    neck = ramp(0, 0.05, p[:, 2] - 1.475) * ramp(0.10, 0.07, np.abs(p[:, 1]))
    w *= (1 - 0.6 * neck)[:, None]
    w[:, NUMBER["neck"]] += 0.6 * neck
    return w


def head_weights(p):
    neck = ramp(-0.035, 0.035, p[:, 2] - 1.475)
    return chain(p, NUMBER, ("chest", None), ("neck", neck), ("head", ramp(-0.035, 0.03, p[:, 2] - 1.555 + 0.75 * np.maximum(p[:, 0] - 0.02, 0))))


def hair_weights(p):
    return chain(p, NUMBER, ("head", None))


def hands_weights(p):
    return sided(p, lambda q, side: chain(q, NUMBER, (f"{side} forearm", None), (f"{side} hand", ramp(-0.022, 0.022, (q - WRIST) @ LOWER))))


def shoes_weights(p):
    return sided(p, lambda q, side: chain(q, NUMBER, (f"{side} foot", None), (f"{side} toes", ramp(-0.04, 0.0, q[:, 0] - TOE[0]))))
