"""Textures of the walking figure, and of what stands beside its way: functions that return (height, width, 3) in sRGB, 8 bits."""
import numpy as np

from paint import around_turns as around
from paint import coded, texels
from room_noise import mix, srgb, step


def knitted():
    """Broad bands with a row of diamonds, over the texture of knitting; v counts from the collar to the hem, or to the cuff."""
    u, v = texels(512, 512)
    red, cream, navy, ochre = srgb("#a8322a"), srgb("#e6dcc3"), srgb("#1d2b45"), srgb("#c98f2c")
    rgb = mix(navy, navy, 0 * u)
    band = np.mod(v * 7, 1)
    rgb = mix(rgb, cream, step(0.48, 0.50, band) - step(0.985, 1.0, band))
    rgb = mix(rgb, red, step(0.62, 0.64, band) - step(0.84, 0.86, band))
    diamond = np.abs(np.mod(u * 26, 1) - 0.5) + np.abs(band - 0.24) * 2.1
    rgb = mix(rgb, ochre, 1 - step(0.30, 0.36, diamond))
    rgb = mix(navy, rgb, step(0.148, 0.150, v))  # a yoke without a pattern
    rib = step(0.955, 0.96, v)
    rgb = mix(rgb, red * 0.55, rib)
    stitches = np.sin(2 * np.pi * u * 128) * np.sin(2 * np.pi * (v * 96 + 0.25 * np.abs(np.mod(u * 128, 1) - 0.5)))
    wear = around(u, v, 9, 8, 3, 2) - 0.5
    return coded(np.clip(rgb * (1 + 0.22 * stitches + 0.35 * wear)[..., None], 0, 1))


def denim():
    """Washed denim; u = 0 and 1/2 are the seams at the sides, v counts from the waist downwards."""
    u, v = texels(384, 768)
    twill = np.sin(2 * np.pi * (u * 96 + v * 120))
    fade = around(u, v, 5, 6, 4, 5)
    front = np.exp(-(np.minimum(np.abs(u - 0.25), np.abs(u - 0.75)) / 0.10) ** 2) * np.exp(-((v - 0.42) / 0.22) ** 2)
    rgb = mix(srgb("#24344f"), srgb("#6f8bab"), np.clip(0.15 + 0.55 * fade + 0.45 * front, 0, 1))
    seam = np.minimum(np.minimum(u, 1 - u), np.abs(u - 0.5))
    rgb = rgb * (1 - 0.5 * (1 - step(0.004, 0.010, seam)))[..., None]
    thread = (np.abs(seam - 0.016) < 0.0035) & (np.mod(v * 110, 1) < 0.6)
    rgb = mix(rgb, srgb("#c9873a"), 0.8 * thread)
    rgb = mix(rgb, srgb("#c9873a"), 0.7 * ((np.abs(v - 0.972) < 0.0025) & (np.mod(u * 60, 1) < 0.6)))
    grain = around(u, v, 60, 90, 2, 8) - 0.5
    return coded(np.clip(rgb * (1 + 0.16 * twill + 0.5 * grain)[..., None], 0, 1))


HEAD_LOW, HEAD_HIGH = 1.40, 1.78  # heights of the face's texture, m


def face():
    """Skin, eyes, brows and lips; u is the angle about the head, forwards in the middle, v the height."""
    u, v = texels(768, 768)
    y, z = (u - 0.5) * 2 * np.pi * 0.0935, HEAD_HIGH - v * (HEAD_HIGH - HEAD_LOW)
    a = np.abs(y)
    skin, rosy, dark = srgb("#d3a07c"), srgb("#c2745c"), srgb("#33221a")
    rgb = mix(skin, rosy, 0.55 * np.exp(-((a - 0.048) / 0.02) ** 2 - ((z - 1.612) / 0.022) ** 2))
    rgb = mix(rgb, rosy, 0.5 * np.exp(-(y / 0.014) ** 2 - ((z - 1.619) / 0.012) ** 2))
    rgb = mix(rgb, srgb("#8d6a58"), 0.45 * step(0.02, 0.0, z - 1.575 - 0.4 * np.maximum(a - 0.045, 0)) * step(1.50, 1.53, z) * step(0.125, 0.09, a))
    rgb = mix(rgb, srgb("#8f5a45"), 0.5 * np.exp(-((a - 0.031) / 0.018) ** 2 - ((z - 1.655) / 0.012) ** 2))
    # lips, with the dark line between them
    lip = step(0.0065, 0.0045, np.abs(z - 1.580) + 0.25 * np.maximum(a - 0.008, 0)) * step(0.027, 0.022, a)
    lip = np.maximum(lip, step(1.0, 0.8, (a / 0.026) ** 2 + ((z - 1.580) / 0.0105) ** 2))
    rgb = mix(rgb, srgb("#a4534a"), 0.8 * lip)
    rgb = mix(rgb, dark, 0.75 * step(1.0, 0.5, (a / 0.025) ** 2 + ((z - 1.5795) / 0.0016) ** 2))
    rgb = mix(rgb, dark, 0.75 * step(1.0, 0.5, ((a - 0.0085) / 0.0045) ** 2 + ((z - 1.6105) / 0.0025) ** 2))
    # eyes
    ex, ez = a - 0.0345, z - 1.648
    white = step(1.0, 0.75, (ex / 0.0150) ** 2 + (ez / (0.0054 * np.clip(1 - 0.25 * ex / 0.015, 0.5, 2))) ** 2)
    iris = step(0.0068, 0.0062, np.hypot(ex, ez))
    eye = mix(srgb("#e9e4dc"), srgb("#54708a"), iris)
    eye = mix(eye, srgb("#0c0a09"), np.maximum(step(0.0034, 0.0026, np.hypot(ex, ez)), 0.8 * (step(0.0054, 0.0062, np.hypot(ex, ez)) * iris)))
    eye = mix(eye, (1, 1, 1), step(0.0016, 0.0010, np.hypot(np.sign(y) * ex - 0.002, ez - 0.0022)))
    rgb = mix(rgb, eye, white)
    lid = np.abs((ex / 0.0155) ** 2 + (ez / 0.0060) ** 2 - 1)
    rgb = mix(rgb, dark, step(0.42, 0.15, lid) * (0.85 * (ez > 0) + 0.25))
    brow = step(0.0042, 0.0022, np.abs(z - 1.6695 + 0.9 * (a - 0.032) ** 2 / 0.03) * 1.0) * step(0.010, 0.016, a) * step(0.058, 0.050, a)
    rgb = mix(rgb, dark, 0.9 * brow)
    # below the hair
    rgb = mix(rgb, dark, 0.85 * step(1.712, 1.722, z + 0.0 * a))
    pores = around(u, v, 60, 60, 3, 4) - 0.5
    blotch = around(u, v, 7, 6, 3, 6) - 0.5
    return coded(np.clip(rgb * (1 + 0.16 * pores + 0.14 * blotch)[..., None], 0, 1))


def skin():
    u, v = texels(128, 128)
    rgb = mix(srgb("#cf9b78"), srgb("#b57a5d"), around(u, v, 8, 6, 3, 3))
    rgb = mix(rgb, srgb("#e2b99b"), 0.4 * step(0.80, 0.95, v))
    return coded(np.clip(rgb * (0.85 + 0.3 * around(u, v, 30, 30, 2, 9))[..., None], 0, 1))


def strands():
    u, v = texels(512, 128)
    lines = around(u, v, 190, 3, 2, 1)
    return coded(mix(srgb("#1c120c"), srgb("#6d4a2e"), np.clip(1.9 * (lines - 0.32) * (0.6 + 0.8 * around(u, v, 9, 5, 2, 2)), 0, 1)))


def sneaker():
    """v counts from the top to the sole, u around the foot."""
    u, v = texels(256, 128)
    rgb = mix(srgb("#8f1f24"), srgb("#5c1218"), around(u, v, 20, 8, 3, 1))
    rgb = mix(rgb, srgb("#e8e4da"), step(0.03, 0.02, np.abs(np.mod(u - 0.5 * (v - 0.5) + 0.5, 0.5) - 0.25)) * step(0.75, 0.7, v))
    rgb = mix(rgb, srgb("#ece8df"), step(0.77, 0.79, v))
    rgb = mix(rgb, srgb("#3a3a3c"), step(0.012, 0.008, np.abs(v - 0.86)))
    return coded(np.clip(rgb * (0.88 + 0.24 * around(u, v, 60, 40, 2, 2))[..., None], 0, 1))


def glaze():
    """A vase: bands and leaves on a glaze that runs from cream to blue."""
    u, v = texels(768, 384)
    rgb = mix(srgb("#d9d0b8"), srgb("#16506b"), step(0.10, 0.55, v + 0.10 * (around(u, v, 14, 2, 3, 3) - 0.5)))
    leaf_u, row = np.mod(u * 12 + 0.5 * np.floor((v - 0.34) / 0.20), 1) - 0.5, np.mod((v - 0.34) / 0.20, 1) - 0.5
    leaf = step(1.0, 0.86, np.abs(leaf_u) / (0.30 * np.cos(np.pi * np.clip(row, -0.5, 0.5)) + 1e-3)) * (v > 0.34) * (v < 0.74)
    rgb = mix(rgb, srgb("#d9d0b8"), leaf)
    rgb = mix(rgb, srgb("#16506b"), leaf * step(0.05, 0.03, np.abs(leaf_u)))
    for at in (0.29, 0.31, 0.77, 0.79, 0.93):
        rgb = mix(rgb, srgb("#b3472a"), step(0.007, 0.005, np.abs(v - at)))
    cells = around(u, v, 50, 40, 2, 5) - 0.5
    return coded(np.clip(rgb * (1 + 0.18 * cells)[..., None], 0, 1))


def stone():
    """Veined stone of the plinth."""
    u, v = texels(256, 256)
    veins = np.abs(around(u, v, 5, 4, 4, 11) - 0.5)
    rgb = mix(srgb("#d8d3c8"), srgb("#4a4640"), step(0.035, 0.0, veins))
    return coded(np.clip(rgb * (0.7 + 0.6 * around(u, v, 30, 24, 3, 12))[..., None], 0, 1))
