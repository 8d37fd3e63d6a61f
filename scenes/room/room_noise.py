"""Noise and colour helpers for the procedural textures (NumPy only)."""
import numpy as np


def srgb(hex_colour):
    """'#rrggbb' to linear RGB."""
    h = hex_colour.lstrip("#")
    c = np.array([int(h[i:i + 2], 16) for i in (0, 2, 4)]) / 255.0
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def encode_srgb(x):
    x = np.clip(x, 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def mix(a, b, t):
    """Blend colours (3,) or (..., 3) with a scalar field t."""
    t = np.asarray(t)[..., None]
    return np.asarray(a) * (1 - t) + np.asarray(b) * t


def step(edge0, edge1, x):
    t = np.clip((x - edge0) / (edge1 - edge0), 0, 1)
    return t * t * (3 - 2 * t)


def hash01(*ints):
    """Integer lattice coordinates to uniform [0, 1)."""
    h = np.uint32(0x9E3779B9)
    with np.errstate(over="ignore"):
        for k, a in enumerate(ints):
            a = np.asarray(a).astype(np.int64).astype(np.uint32)
            h = (h ^ (a + np.uint32(0x85EBCA6B + 977 * k))) * np.uint32(0xC2B2AE35)
            h = h ^ (h >> np.uint32(15))
            h = h * np.uint32(0x27D4EB2F)
            h = h ^ (h >> np.uint32(13))
    return h.astype(np.float64) / 4294967296.0


def vnoise(x, y, z=0.0, seed=0):
    """Smooth value noise in [0, 1]."""
    x, y, z = np.broadcast_arrays(x, y, z)
    ix, iy, iz = (np.floor(a).astype(np.int64) for a in (x, y, z))
    fx, fy, fz = x - ix, y - iy, z - iz
    fx, fy, fz = (f * f * (3 - 2 * f) for f in (fx, fy, fz))
    out = 0.0
    for dz in (0, 1):
        wz = fz if dz else 1 - fz
        for dy in (0, 1):
            wy = fy if dy else 1 - fy
            a = hash01(ix, iy + dy, iz + dz, seed)
            b = hash01(ix + 1, iy + dy, iz + dz, seed)
            out = out + (a + (b - a) * fx) * wy * wz
    return out


def fbm(x, y, z=0.0, octaves=4, seed=0, gain=0.5):
    """Fractal sum of value noise, mean 0.5."""
    total, amp, norm = 0.0, 1.0, 0.0
    for k in range(octaves):
        f = 2.0 ** k
        total = total + amp * vnoise(x * f, y * f, np.asarray(z) * f, seed + 31 * k)
        norm += amp
        amp *= gain
    return total / norm


def fbm3(P, scale, octaves=4, seed=0):
    return fbm(P[..., 0] * scale, P[..., 1] * scale, P[..., 2] * scale,
               octaves, seed)
