"""Procedural materials of the living room: surfaces, fabrics and wood.

Every material is a function of a Ctx (coordinates of the texels of one patch)
that returns the linear albedo, or (albedo, emission) for things that glow.
"""
import numpy as np

from room_noise import fbm, fbm3, hash01, mix, srgb, step, vnoise

MATERIALS = {}


def material(f):
    MATERIALS[f.__name__] = f
    return f


class Ctx:
    """Texel coordinates of one patch: S, T metres, u, v in [0, 1], P world,
    L local (before placement), w, h patch size in metres, prm parameters."""

    def __init__(self, patch, ss, tt):
        self.u, self.v = np.meshgrid(ss, tt)
        self.w, self.h = patch.width, patch.height
        self.S, self.T = self.u * self.w, self.v * self.h
        self.P = patch.sample(ss, tt)
        self.L = patch.sample(ss, tt, patch.L)
        self.prm = patch.prm

    def get(self, key, default):
        return self.prm.get(key, default)


# -------------------------------------------------------------------- shell
@material
def planks(c):
    """Oak floor boards along x."""
    x, y = c.P[..., 0], c.P[..., 1]
    row = np.floor(y / 0.135)
    xs = x + hash01(row, 5) * 1.6
    col = np.floor(xs / 1.6)
    tone = hash01(row, col, 1)
    warp = fbm(xs * 0.9, y * 5, row * 7.3, 2, 3) * 0.5
    grain = fbm(xs * 1.6 + col * 11, (y + warp * 0.06) * 34, row * 3.7, 4, 7)
    rings = 0.5 + 0.5 * np.sin((y / 0.135 + warp * 2.2 + tone * 9) * 21)
    rgb = mix(srgb("#b98a5a"), srgb("#8a5a34"), 0.75 * tone)
    rgb = rgb * (0.62 + 0.62 * grain + 0.14 * rings)[..., None]
    fleck = step(0.68, 0.8, vnoise(xs * 9, y * 260, row, 9))
    rgb = rgb * (1 - 0.28 * fleck)[..., None]
    edge = np.minimum(_edge(y, 0.135), _edge(xs, 1.6))
    return rgb * (0.22 + 0.78 * step(0.0008, 0.0034, edge))[..., None]


def _edge(x, period):
    """Distance to the nearest multiple of period."""
    m = np.mod(x, period)
    return np.minimum(m, period - m)


def _plaster_tone(P, seed=0):
    coarse = fbm3(P, 1.1, 4, seed) - 0.5
    fine = fbm3(P, 26, 3, seed + 5) - 0.5
    trowel = fbm(P[..., 0] * 5 + P[..., 1] * 7, P[..., 2] * 14,
                 P[..., 1] * 3, 3, seed + 9) - 0.5
    grit = fbm3(P, 75, 2, seed + 13) - 0.5
    return 1 + 0.24 * coarse + 0.36 * fine + 0.28 * trowel + 0.34 * grit


@material
def plaster(c):
    return srgb(c.get("colour", "#d9d2c4")) * _plaster_tone(c.P)[..., None]


@material
def ceiling(c):
    return srgb("#e6e3dc") * (0.4 + 0.6 * _plaster_tone(c.P, 3))[..., None]


@material
def wallpaper(c):
    """Ogee lattice with a small blossom in every cell."""
    a, b = 0.30, 0.42
    x, z = c.P[..., 0] / a, c.P[..., 2] / b
    f = np.cos(2 * np.pi * x) + np.cos(2 * np.pi * z)
    line = np.abs(f) / (0.35 + np.abs(np.sin(2 * np.pi * x))
                        + np.abs(np.sin(2 * np.pi * z)))
    rgb = mix(srgb("#47686b"), srgb("#3c5a5f"), step(-0.2, 0.2, f))
    rgb = mix(rgb, srgb("#a9b59c"), 0.8 * (1 - step(0.05, 0.09, line)))
    for ox in (0.0, 0.5):  # blossoms sit at the maxima and minima of f
        dx = (np.mod(x + ox + 0.5, 1) - 0.5) * a
        dz = (np.mod(z + ox + 0.5, 1) - 0.5) * b
        r, t = np.hypot(dx, dz * 0.8), np.arctan2(dz, dx)
        petal = 0.040 * (0.6 + 0.4 * np.cos(6 * t))
        rgb = mix(rgb, srgb("#bda86f"), 1 - step(petal - 0.004, petal + 0.003, r))
        rgb = mix(rgb, srgb("#5a3f36"), 1 - step(0.009, 0.013, r))
    weave = fbm(c.P[..., 0] * 60, c.P[..., 2] * 22, 0, 3, 2)
    return rgb * (0.80 + 0.4 * weave)[..., None]


@material
def brick(c):
    """Running-bond brick wall in the y-z plane."""
    y, z = c.P[..., 1], c.P[..., 2]
    bw, bh = 0.235, 0.078
    wob = (fbm(y * 14, z * 14, 0, 2, 4) - 0.5) * 0.010
    row = np.floor(z / bh)
    yy = y + 0.5 * bw * np.mod(row, 2) + wob
    col = np.floor(yy / bw)
    d = np.minimum(_edge(yy, bw), _edge(z + wob * 0.6, bh))
    tone, hue = hash01(row, col, 2), hash01(row, col, 3)
    rgb = mix(srgb("#a4593f"), srgb("#7d3d2e"), tone)
    rgb = mix(rgb, srgb("#b98767"), 0.8 * step(0.72, 0.95, hue))
    rgb = mix(rgb, srgb("#54322b"), 0.7 * (1 - step(0.04, 0.14, hue)))
    grit = fbm(y * 45, z * 45, 0, 4, 6)
    rgb = rgb * (0.60 + 0.8 * grit)[..., None]
    mortar = srgb("#b5aa9b") * (0.7 + 0.6 * fbm(y * 60, z * 60, 0, 3, 8))[..., None]
    return mix(mortar, rgb, step(0.0045, 0.0085, d))


@material
def paint(c):
    """Painted wood or metal, nearly plain."""
    n = fbm3(c.P, 9, 3, c.get("seed", 0)) - 0.5
    streak = fbm(c.S * 4, c.T * 70, 0, 2, 4) - 0.5
    rgb = srgb(c.get("colour", "#e4e0d6")) * (1 + 0.14 * n + 0.10 * streak)[..., None]
    rim = np.minimum(np.minimum(c.S, c.w - c.S), np.minimum(c.T, c.h - c.T))
    return rgb * (0.90 + 0.10 * step(0, 0.012, rim))[..., None]


# --------------------------------------------------------------------- wood
@material
def wood(c):
    """Grain along the longer side of the patch."""
    a, b = (c.S, c.T) if c.w >= c.h else (c.T, c.S)
    seed = c.get("seed", 0) + int(1000 * (c.w + c.h))
    warp = fbm(a * 2.0, b * 6.0, 0.5, 3, seed)
    rings = 0.5 + 0.5 * np.sin((b * 26 + warp * 7.0) * 3.1)
    grain = fbm(a * 4, b * 130, 0, 3, seed + 1)
    rgb = mix(srgb(c.get("colour", "#7a4f2e")),
              srgb(c.get("dark", "#4b2d19")), 0.25 + 0.5 * rings * warp * 1.4)
    return rgb * (0.68 + 0.64 * grain)[..., None]


# ------------------------------------------------------------------ fabrics
@material
def fabric(c):
    """Coarse woven upholstery, optionally mottled."""
    s, t = c.S, c.T
    weave = np.sin(s * 2 * np.pi / 0.018) * np.sin(t * 2 * np.pi / 0.018)
    n = fbm3(c.L, 55, 3, 1) - 0.5
    big = fbm3(c.L, 5, 3, 2) - 0.5
    rgb = mix(srgb(c.get("colour", "#6f7a80")),
              srgb(c.get("second", "#8d979b")), 0.5 + 0.5 * weave)
    rgb = rgb * (1 + 0.55 * n + 0.22 * big)[..., None]
    if c.get("piping", False):  # darker seam around the patch
        rim = np.minimum(np.minimum(s, c.w - s), np.minimum(t, c.h - t))
        rgb = rgb * (0.55 + 0.45 * step(0.003, 0.009, rim))[..., None]
    return rgb


@material
def pattern_fabric(c):
    """Throw pillows and blankets: stripes, checks, zigzag or dots."""
    s, t, k = c.S, c.T, c.get("size", 0.06)
    kind = c.get("kind", "stripe")
    if kind == "stripe":
        m = np.mod(s / k, 1)
        f = step(0.48, 0.52, m) + 0.6 * (1 - step(0.10, 0.14, np.abs(m - 0.25)))
    elif kind == "check":
        f = 0.5 * (np.mod(s / k, 1) < 0.5) + 0.5 * (np.mod(t / k, 1) < 0.5)
        f = f - 0.5 * (np.minimum(_edge(s, k * 2), _edge(t, k * 2)) < 0.004)
    elif kind == "zigzag":
        tri = np.abs(np.mod(s / k, 1) - 0.5)
        f = step(0.42, 0.5, np.mod(t / (0.8 * k) + tri, 1))
    else:
        row = np.floor(t / k)
        dx = np.mod(s / k + 0.5 * np.mod(row, 2), 1) - 0.5
        f = 1 - step(0.24, 0.30, np.hypot(dx, np.mod(t / k, 1) - 0.5))
    rgb = mix(srgb(c.get("colour", "#c9b48a")), srgb(c.get("second", "#7b3b2c")),
              np.clip(f, 0, 1))
    return rgb * (0.66 + 0.68 * fbm(s * 70, t * 70, 0, 2, 3))[..., None]


@material
def curtain(c):
    """Linen with a vertical weave and a woven band pattern near the hem."""
    rgb = mix(srgb("#c79a4e"), srgb("#e0bd78"), fbm(c.S * 160, c.T * 7, 0, 3, 1))
    for t0, col in ((0.16, "#7b4a38"), (0.22, "#3f5a5e"), (0.25, "#7b4a38")):
        d = np.abs(c.T - t0 - 0.006 * np.abs(np.mod(c.S / 0.03, 1) - 0.5))
        rgb = mix(rgb, srgb(col), 0.85 * (1 - step(0.010, 0.014, d)))
    motif = step(0.5, 0.55, np.mod(c.S / 0.10 + 0.5 * np.mod(
        np.floor(c.T / 0.14), 2), 1)) * (_edge(c.T, 0.14) < 0.008)
    rgb = mix(rgb, srgb("#9a6a2c"), 0.6 * motif)
    rgb = rgb * (0.80 + 0.40 * fbm(c.S * 90, c.T * 90, 0, 2, 2))[..., None]
    return rgb, 0.13 * rgb  # a little daylight shines through


@material
def rug(c):
    """Persian-style rug: borders, lattice field, stepped medallion."""
    hx, hy, q = c.w / 2, c.h / 2, 0.011
    x = (np.floor((c.S - hx) / q) + 0.5) * q
    y = (np.floor((c.T - hy) / q) + 0.5) * q
    d = np.minimum(hx - np.abs(x), hy - np.abs(y))
    navy, red, cream = srgb("#24324a"), srgb("#8c2f26"), srgb("#d8c6a0")
    ochre, teal = srgb("#b98a3e"), srgb("#4b7370")

    def diamonds(px, py, k, aspect=1.0):
        ax = np.abs(np.mod(px / k, 1) - 0.5)
        ay = np.abs(np.mod(py / (k * aspect), 1) - 0.5)
        return ax + ay

    g = diamonds(x, y, 0.20, 0.9)
    rgb = mix(red, srgb("#742520"), (g > 0.5) * 1.0)
    rgb = mix(rgb, cream, (np.abs(g - 0.5) < 0.035) * 0.8)
    rgb = mix(rgb, teal, (g < 0.22) * 1.0)
    rgb = mix(rgb, ochre, (g < 0.11) * 1.0)
    rgb = mix(rgb, ochre, (g > 0.86) * 1.0)
    wave = 0.05 * np.abs(np.mod(np.arctan2(y, x) * 12 / np.pi, 1) - 0.5)
    m = np.abs(x) / 0.74 + np.abs(y) / 0.50 + wave
    for lim, col in ((1.0, cream), (0.95, navy), (0.72, ochre), (0.68, red),
                     (0.48, cream), (0.44, teal), (0.22, cream), (0.17, red)):
        rgb = mix(rgb, col, (m < lim) * 1.0)
    star = diamonds(x, y, 0.10)
    rgb = mix(rgb, ochre, ((m > 0.74) & (m < 0.93) & (star < 0.24)) * 1.0)
    b = diamonds(x + 0.06, y + 0.045, 0.12)
    border = mix(navy, ochre, (b < 0.36) * 1.0)
    border = mix(border, red, (b < 0.2) * 1.0)
    border = mix(border, teal, (b > 0.8) * 1.0)
    rgb = mix(rgb, border, (d < 0.26) * 1.0)
    for lo, hi, col in ((0.26, 0.29, cream), (0.05, 0.075, cream),
                        (0.0, 0.05, navy), (0.275, 0.285, red)):
        rgb = mix(rgb, col, ((d >= lo) & (d < hi)) * 1.0)
    pile = fbm(c.S * 120, c.T * 120, 0, 3, 5) - 0.5
    wear = fbm(c.S * 2, c.T * 2, 0, 3, 6) - 0.5
    return rgb * (1 + 0.75 * pile + 0.35 * wear)[..., None]


@material
def fringe(c):
    t = np.abs(np.mod(c.T / 0.014, 1) - 0.5)
    return mix(srgb("#5d4527"), srgb("#d9cba9"), step(0.12, 0.2, 0.45 - t)) \
        * (0.7 + 0.6 * fbm(c.S * 40, c.T * 120, 0, 2, 1))[..., None]


@material
def leather(c):
    n = fbm3(c.L, 40, 4, 1)
    crease = np.abs(fbm3(c.L, 30, 3, 4) - 0.5)
    worn = fbm3(c.L, 6, 3, 8)
    rgb = mix(srgb(c.get("colour", "#8a5230")), srgb("#b97a48"), 0.6 * step(0.5, 0.8, worn))
    rgb = mix(rgb, srgb("#4d2915"), 0.35 * (1 - step(0, 0.06, crease)))
    rgb = rgb * (0.62 + 0.76 * n)[..., None]
    rim = np.minimum(np.minimum(c.S, c.w - c.S), np.minimum(c.T, c.h - c.T))
    stitch = (np.abs(rim - 0.016) < 0.0025) * (np.mod((c.S + c.T) / 0.02, 1) < 0.6)
    return mix(rgb, srgb("#d3b184"), 0.55 * stitch)
