"""Helpers of procedural textures."""
import numpy as np

from room_noise import encode_srgb, fbm


def texels(width, height):
    """u to the right and v downwards at the middles of texels."""
    return np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)


def coded(rgb):
    """Linear light as sRGB of 8 bits."""
    return np.round(255 * encode_srgb(rgb)).astype(np.uint8)


def around_turns(u, v, cycles, rows, octaves=3, seed=0):
    """Noise that repeats after one turn of u."""
    a, r = 2 * np.pi * u, cycles / (2 * np.pi)
    return fbm(r * np.cos(a) + 50, r * np.sin(a) + 50, v * rows, octaves, seed)
