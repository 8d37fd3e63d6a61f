"""Procedural materials of the living room: books, art, objects, glowing things.

Importing this module registers the materials with room_textures.MATERIALS.
"""
import numpy as np

from room_noise import fbm, fbm3, hash01, mix, srgb, step, vnoise
from room_textures import material


# -------------------------------------------------------------------- books
@material
def spine(c):
    """Book spine or cover: bands, title letters as small bars."""
    seed, col = c.get("seed", 0), srgb(c.get("colour", "#7a2f2a"))
    r = [float(hash01(seed, k)) for k in range(8)]
    long_t = c.h >= c.w
    a, b = (c.v, c.u) if long_t else (c.u, c.v)
    rgb = col * (0.72 + 0.56 * fbm(c.S * 60, c.T * 60, 0, 3, seed))[..., None]
    ink = srgb("#e6d6a8") if np.mean(col) < 0.25 else srgb("#2a2522")
    if r[0] < 0.6:  # double bands at head and tail
        for p in (0.08, 0.12, 0.88, 0.92):
            rgb = mix(rgb, ink, 0.85 * (np.abs(a - p) < 0.010))
    if r[1] < 0.45:  # label
        lab = (np.abs(a - 0.68) < 0.13) & (np.abs(b - 0.5) < 0.42)
        rgb = mix(rgb, srgb("#1f2a36") if r[2] < 0.5 else srgb("#d8c9a2"),
                  0.95 * lab)
        if r[2] >= 0.5:
            ink = srgb("#3a2320")
    length = (c.h if long_t else c.w)
    cell = np.floor(a * length / 0.009)
    glyph = (hash01(cell, seed) > 0.25) & (np.mod(a * length / 0.009, 1) < 0.62)
    tall = 0.12 + 0.12 * hash01(cell, seed, 3)
    title = glyph & (np.abs(b - 0.5) < tall) & (np.abs(a - 0.55) < 0.12 + 0.14 * r[3])
    return mix(rgb, ink, 0.9 * title)


@material
def pages(c):
    lines = fbm(c.S * 900 if c.w < c.h else c.S * 6,
                c.T * 900 if c.h <= c.w else c.T * 6, 0, 2, 3)
    return srgb("#ddd0b0") * (0.6 + 0.6 * lines)[..., None]


@material
def print_page(c):
    """Open magazine page: text columns and a picture."""
    paper = srgb("#e5e0d4") * np.ones(c.u.shape + (1,))
    line = np.mod(c.T / 0.0105, 1) < 0.5
    word = hash01(np.floor(c.S / 0.013), np.floor(c.T / 0.0105), c.get("seed", 1)) > 0.2
    col = (np.abs(np.mod(c.u * 2, 1) - 0.5) < 0.41) & (np.abs(c.v - 0.5) < 0.44)
    pic = (c.v > 0.52) & (np.abs(c.u - 0.5) < 0.43) & (c.v < 0.93)
    rgb = mix(paper, srgb("#3b3936"), 0.75 * (line & word & col & ~pic))
    sea = mix(srgb("#2d5d7b"), srgb("#d9995f"), step(0.5, 0.9, c.v))
    sea = sea * (0.6 + 0.8 * fbm(c.S * 15, c.T * 60, 0, 3, 8))[..., None]
    return mix(rgb, sea, pic * 1.0)


# ---------------------------------------------------------------------- art
@material
def art(c):
    """Picture behind a cream mount; `kind` selects the motif."""
    mount = c.get("mount", 0.05)
    m = np.minimum(np.minimum(c.S, c.w - c.S), np.minimum(c.T, c.h - c.T))
    u = np.clip((c.S - mount) / (c.w - 2 * mount), 0, 1)
    v = np.clip((c.T - mount) / (c.h - 2 * mount), 0, 1)
    rgb = MOTIFS[c.get("kind", "hills")](u, v, c.w / c.h)
    paper = srgb("#e4dfd2") * (0.9 + 0.2 * fbm(c.S * 80, c.T * 80, 0, 2, 2))[..., None]
    edge = srgb("#8f8878")
    rgb = mix(paper, rgb, (m > mount) * 1.0)
    return mix(rgb, edge, 0.6 * (np.abs(m - mount) < 0.003))


def _hills(u, v, asp):
    sky = mix(srgb("#e9b872"), srgb("#6f9db5"), step(0.35, 1.0, v))
    sun = np.hypot((u - 0.68) * asp, v - 0.66)
    rgb = mix(sky, srgb("#f6e3b0"), 1 - step(0.085, 0.095, sun))
    tones = ("#8fa3a6", "#6b8587", "#47666b", "#2c474f", "#182b33")
    for k, tone in enumerate(tones):
        ridge = 0.60 - 0.115 * k + 0.30 * (fbm(u * (2.5 + k), 0.0, k * 9.1, 5, 3) - 0.5)
        rgb = mix(rgb, srgb(tone), 1 - step(ridge - 0.004, ridge + 0.004, v))
    return rgb * (0.85 + 0.3 * fbm(u * 60, v * 60, 0, 2, 1))[..., None]


def _blocks(u, v, asp):
    rgb = srgb("#d9cfb8") * np.ones(u.shape + (1,))
    cells = ((0, .34, .55, 1, "#b5392b"), (.34, .7, .72, 1, "#e0b13c"),
             (.7, 1, .4, 1, "#27496d"), (0, .34, 0, .28, "#27496d"),
             (.34, .7, .2, .45, "#1f1f22"), (.7, 1, 0, .18, "#d9803a"),
             (.08, .26, .62, .86, "#d9803a"), (.76, .94, .5, .74, "#9bb7b5"))
    for x0, x1, y0, y1, col in cells:
        rgb = mix(rgb, srgb(col), ((u > x0) & (u < x1) & (v > y0) & (v < y1)) * 1.0)
    for p in (0.34, 0.7):
        rgb = mix(rgb, srgb("#161616"), (np.abs(u - p) < 0.012) * 1.0)
    for p in (0.28, 0.55, 0.72):
        rgb = mix(rgb, srgb("#161616"), (np.abs(v - p) < 0.009) * 1.0)
    return rgb * (0.7 + 0.6 * fbm(u * 35, v * 8, 0, 4, 2))[..., None]


def _circles(u, v, asp):
    rgb = mix(srgb("#e5d9bd"), srgb("#c9ba97"), fbm(u * 4, v * 4, 0, 4, 5))
    cols = ("#c2462f", "#22384f", "#e2a93b", "#4f7f79", "#1c1b1c", "#d98f86")
    for k in range(26):
        cx, cy, r, w = (float(hash01(k, j, 17)) for j in range(4))
        rad = 0.03 + 0.20 * r ** 2
        d = np.hypot((u - cx) * asp, v - cy)
        ring = (d < rad) & ((d > rad * 0.72) | (w < 0.45))
        rgb = mix(rgb, srgb(cols[k % 6]), 0.9 * ring)
    for k in range(7):
        a, b, s = (float(hash01(k, j, 23)) for j in range(3))
        d = np.abs(v - b - (u - 0.5) * (a * 3 - 1.5)) / np.hypot(1, a * 3 - 1.5)
        rgb = mix(rgb, srgb("#1c1b1c"), 0.9 * (d < 0.004 + 0.004 * s))
    return rgb


def _sea(u, v, asp):
    """Black-and-white photograph of a pier."""
    sky = 0.55 + 0.35 * fbm(u * 3, v * 7, 0, 5, 4)
    sea = 0.12 + 0.3 * fbm(u * 14, v * 90, 0, 3, 6)
    g = np.where(v > 0.42, sky, sea)
    depth = np.clip((0.42 - v) / 0.42, 1e-3, 1)
    pier = (np.abs(u - 0.5) < 0.03 + 0.28 * depth) & (v < 0.42)
    board = np.mod(2.2 / (depth + 0.08), 1) < 0.8
    g = np.where(pier, np.where(board, 0.42 + 0.2 * vnoise(u * 40, v * 300), 0.06), g)
    for k in range(6):
        d = 0.06 + 0.9 * (k / 5) ** 2
        for side in (-1, 1):
            x = 0.5 + side * (0.03 + 0.28 * d)
            base = 0.42 - 0.42 * d
            post = (np.abs(u - x) < 0.004 + 0.014 * d) & (v > base) & (v < base + 0.03 + 0.22 * d)
            g = np.where(post, 0.03, g)
    return np.repeat((g * 0.8)[..., None], 3, -1)


def _leaf(u, v, asp):
    """Botanical print: a fern."""
    rgb = srgb("#e3dcc6") * (0.88 + 0.24 * fbm(u * 5, v * 5, 0, 4, 3))[..., None]
    x = (u - 0.5 - 0.06 * np.sin(v * 3)) * asp
    green = mix(srgb("#2f4a2c"), srgb("#5e7d45"), fbm(u * 20, v * 20, 0, 3, 2))
    stem = (np.abs(x) < 0.006) & (v > 0.08) & (v < 0.93)
    a = v + np.abs(x) * -0.55
    width = 0.36 * np.clip(1 - np.abs((v - 0.36) / 0.6) ** 2, 0, 1) * asp
    frond = (np.abs(np.mod(a / 0.052, 1) - 0.5) < 0.34 * (1 - np.abs(x) / (width + 1e-6))) \
        & (np.abs(x) < width) & (a > 0.1)
    return mix(rgb, green, np.clip(stem * 1.0 + frond, 0, 1))


def _flow(u, v, asp):
    w = fbm(u * 2.2 * asp, v * 2.2, 0, 3, 12)
    band = np.mod(w * 11, 1)
    idx = np.floor(w * 11)
    pal = np.array([srgb(k) for k in ("#1f3b4d", "#d9a441", "#c8553d", "#e8dcc0", "#588b8b")])
    rgb = pal[np.mod(idx, 5).astype(int)]
    return rgb * (0.65 + 0.35 * step(0.02, 0.10, np.minimum(band, 1 - band)))[..., None] \
        * (0.8 + 0.4 * fbm(u * 40, v * 40, 0, 2, 4))[..., None]


MOTIFS = {"hills": _hills, "blocks": _blocks, "circles": _circles,
          "sea": _sea, "leaf": _leaf, "flow": _flow}


# ------------------------------------------------------------------ objects
@material
def clock(c):
    x, y = c.L[..., 0] / c.prm["radius"], c.L[..., 1] / c.prm["radius"]
    r, a = np.hypot(x, y), np.arctan2(x, y) / (2 * np.pi)
    rgb = srgb("#e8e2d2") * (0.93 + 0.14 * fbm(x * 6, y * 6, 0, 3, 1))[..., None]
    tick = np.abs(np.mod(a * 12 + 0.5, 1) - 0.5) < 0.06 / np.maximum(r, 0.1)
    tick &= (r > 0.74) & (r < 0.9)
    fine = (np.abs(np.mod(a * 60 + 0.5, 1) - 0.5) < 0.1) & (r > 0.85) & (r < 0.9)
    rgb = mix(rgb, srgb("#222222"), (tick | fine) * 1.0)
    for ang, ln, th in ((50, 0.5, 0.035), (140, 0.72, 0.025)):
        s, k = np.sin(np.radians(ang)), np.cos(np.radians(ang))
        along, off = x * s + y * k, np.abs(x * k - y * s)
        rgb = mix(rgb, srgb("#1a1a1a"), ((along > -0.1) & (along < ln) & (off < th)) * 1.0)
    return rgb


@material
def ceramic(c):
    """Glazed pottery with painted bands."""
    base, band = srgb(c.get("colour", "#c8c2b4")), srgb(c.get("second", "#2f4d63"))
    rgb = base * (0.78 + 0.44 * fbm3(c.L, 28, 3, 4))[..., None]
    k = c.get("bands", 5)
    zig = np.abs(np.mod(c.u * 14, 1) - 0.5) * 0.35
    f = np.mod(c.v * k + zig, 1)
    return mix(rgb, band, 0.85 * (step(0.30, 0.36, f) - step(0.52, 0.58, f))) if k else rgb


@material
def metal(c):
    n = fbm(c.S * 6, c.T * 90, 0, 3, 2)
    return srgb(c.get("colour", "#3a3733")) * (0.7 + 0.6 * n)[..., None]


@material
def basket(c):
    k = 0.022
    row = np.floor(c.T / k)
    f = np.sin(np.pi * (c.S / (1.6 * k) + np.mod(row, 2))) ** 2 * np.sin(np.pi * c.T / k) ** 2
    return mix(srgb("#5a3d20"), srgb("#c69b62"), f ** 0.6) \
        * (0.8 + 0.4 * fbm(c.S * 50, c.T * 50, 0, 2, 1))[..., None]


@material
def fruit(c):
    n = fbm3(c.P, 70, 3, 2)
    rgb = mix(srgb(c.get("colour", "#d9822b")),
              srgb(c.get("second", "#b8551c")), fbm3(c.P, 22, 3, 1))
    return rgb * (0.75 + 0.5 * n)[..., None]


@material
def leaf(c):
    """Plant leaf: v runs from the stalk to the tip."""
    x = np.abs(c.u - 0.5) * 2
    vein = step(0.40, 0.47, np.abs(np.mod(c.v * 9 - x * 1.4, 1) - 0.5))
    rgb = mix(srgb("#35682f"), srgb("#78a84a"), fbm(c.S * 18, c.T * 18, c.get("seed", 0), 3, 2))
    rgb = mix(rgb, srgb("#9fbf72"), 0.45 * vein)
    return mix(rgb, srgb("#b7cf8c"), 1 - step(0.05, 0.10, x))


@material
def soil(c):
    return srgb("#3b2a1e") * (0.4 + 1.2 * fbm3(c.P, 60, 3, 1))[..., None]


# ------------------------------------------------------------ glowing things
@material
def shade(c):
    """Pleated lamp shade lit from inside."""
    pleat = 0.5 + 0.5 * np.cos(c.u * 2 * np.pi * 44)
    centre = np.exp(-((c.v - 0.45) / 0.42) ** 2)
    e = (0.30 + 0.55 * centre) * (0.80 + 0.2 * pleat)
    rim = (np.minimum(c.v, 1 - c.v) < 0.05)
    e = e * np.where(rim, 0.45, 1.0)
    warm = np.array([1.0, 0.74, 0.42])
    return srgb("#d8c9a8") * np.ones(c.u.shape + (1,)) * 0.6, e[..., None] * warm


@material
def bulb(c):
    one = np.ones(c.u.shape + (1,))
    return 0.8 * one * np.ones(3), one * np.array([1.0, 0.9, 0.68])


@material
def outdoor(c):
    """Out-of-focus garden behind the window: sky, clouds, trees, a house."""
    y, z = c.P[..., 1], c.P[..., 2]
    cloud = step(0.45, 0.72, fbm(y * 0.45, z * 0.9, 0, 4, 5))
    sky = mix(np.array([0.78, 0.90, 1.0]), np.array([0.36, 0.60, 0.98]), step(0.8, 5.0, z))
    rgb = mix(sky, np.array([1.0, 0.99, 0.97]), 0.85 * cloud)

    def layer(top, soft, col, rough, seed):
        edge = top + rough * (fbm(y * 1.3, 0.0, seed, 4, seed) - 0.5)
        tex = 0.6 + 0.8 * fbm(y * 4.5, z * 4.5, 0, 3, seed + 1)
        return col * tex[..., None], 1 - step(edge - soft, edge + soft, z)

    for top, soft, col, rough, seed in (
            (1.75, 0.10, (0.34, 0.45, 0.42), 0.9, 3),
            (1.40, 0.08, (0.20, 0.32, 0.12), 1.4, 9),
            (0.62, 0.10, (0.40, 0.52, 0.18), 0.1, 15)):
        tint, f = layer(top, soft, np.array(col), rough, seed)
        rgb = mix(rgb, tint, f)
    trunk = (1 - step(0.07, 0.14, np.abs(y - 0.55 - 0.06 * z))) * (z < 2.9)
    crown = step(0.50, 0.60, fbm(y * 1.6, z * 1.6, 3.0, 3, 8)
                 + 0.55 - 0.34 * np.hypot(y - 0.8, (z - 3.1) * 1.1))
    rgb = mix(rgb, np.array([0.13, 0.10, 0.07]), 0.9 * trunk)
    leaves = mix(np.array([0.14, 0.26, 0.07]), np.array([0.42, 0.55, 0.16]),
                 fbm(y * 6, z * 6, 0, 3, 4))
    rgb = mix(rgb, leaves, 0.9 * crown)
    return np.zeros_like(rgb), 1.2 * rgb
