"""Draw the images of sprites.yaml: a wall, a wheel, a leaf and a lattice, PNG with alpha.

Run (the standard library is enough; some seconds):

    python3 make_sprites.py [folder]        (default: that of this script)

Shapes are drawn by their signed distance, so that edges and alpha are smooth over one pixel.  Colours mix in linear
light and are stored as sRGB.  Everything follows from coordinates: there is no randomness.
"""
import math
import os
import struct
import sys
import zlib


def encode(light):
    light = min(max(light, 0.0), 1.0)
    encoded = 12.92 * light if light <= 0.0031308 else 1.055 * light ** (1 / 2.4) - 0.055
    return round(255 * encoded)


def write_png(path, width, height, pixel):
    """`pixel(x, y)` is (red, green, blue, alpha), or (grey,), in linear light."""
    rows, channels = bytearray(), 0
    for y in range(height):
        rows.append(0)
        for x in range(width):
            value = pixel(x + 0.5, y + 0.5)
            channels = len(value)
            rows += bytes(encode(v) for v in value[:3])
            if channels == 4:
                rows.append(round(255 * min(max(value[3], 0.0), 1.0)))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, {1: 0, 3: 2, 4: 6}[channels], 0, 0, 0)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(rows), 9))
                   + chunk(b"IEND", b""))


def inside(distance):
    """Share of a pixel inside a shape whose edge is `distance` away, positive outside."""
    return min(max(0.5 - distance, 0.0), 1.0)


def mix(under, over, share):
    return tuple(u + share * (o - u) for u, o in zip(under, over))


def hashed(x, y):
    """A number on [0, 1) for each point of the integer grid."""
    n = (x * 374761393 + y * 668265263) & 0xFFFFFFFF
    n = ((n ^ (n >> 13)) * 1274126177) & 0xFFFFFFFF
    return (n ^ (n >> 16)) / 2 ** 32


def noise(x, y):
    """Smooth noise of unit scale."""
    i, j = math.floor(x), math.floor(y)
    fx, fy = x - i, y - j
    fx, fy = fx * fx * (3 - 2 * fx), fy * fy * (3 - 2 * fy)
    upper = hashed(i, j) + fx * (hashed(i + 1, j) - hashed(i, j))
    lower = hashed(i, j + 1) + fx * (hashed(i + 1, j + 1) - hashed(i, j + 1))
    return upper + fy * (lower - upper)


def wall(x, y):
    """Bricks, each of its own shade, in mortar; 48 x 20 pixels and 480 x 360 in all."""
    row = math.floor(y / 20)
    shifted = x + 24 * (row % 2)
    column = math.floor(shifted / 48) % 10
    to_edge = max(abs(shifted % 48 - 24) - 22.0, abs(y % 20 - 10) - 8.0)
    grain = 0.75 + 0.3 * noise(x / 3, y / 3) + 0.25 * noise(x / 17, y / 11)
    brick = (0.14 + 0.16 * hashed(column, row)) * grain
    mortar = 0.42 * (0.85 + 0.2 * noise(x / 2, y / 2))
    return (mortar + inside(to_edge) * (brick - mortar),)


def wheel(x, y):
    """A spoked wheel, 144 x 144."""
    x, y = x - 72, y - 72
    r, angle = math.hypot(x, y), math.atan2(y, x)
    spoke_angle = (angle + math.pi / 10) % (math.pi / 5) - math.pi / 10
    rim = abs(r - 61) - 8
    spoke = max(abs(r * math.sin(spoke_angle)) - 2.6, r - 58)
    hub = r - 15
    colour = (0.62, 0.60, 0.55)
    colour = mix(colour, (0.04, 0.04, 0.045), inside(abs(r - 65) - 4.5))
    colour = mix(colour, (0.55, 0.07, 0.04), inside(hub))
    colour = mix(colour, (0.8, 0.8, 0.75), inside(math.hypot(x - 6, y) - 3.5))
    return (*colour, max(inside(rim), inside(spoke), inside(hub)))


def leaf(x, y):
    """A leaf with veins, 112 x 64, the stalk to the left."""
    x, y = x - 12, y - 32
    half = 24 * math.sin(math.pi * min(max(x / 94, 0.0), 1.0)) ** 0.8
    vein = (x + 1.1 * abs(y)) % 11 - 5.5
    shade = 0.75 + 0.5 * noise(x / 6, y / 6)
    colour = (0.10 * shade, 0.30 * shade, 0.05 * shade)
    colour = mix(colour, (0.45, 0.62, 0.25), max(inside(abs(y) - 0.9), 0.7 * inside(abs(vein) - 0.4)))
    blade = inside(0.8 * (abs(y) - half)) if 0 < x < 94 else 0.0
    stalk = inside(max(abs(y - 0.02 * x * x) - 1.2, x - 4))
    return (*colour, max(blade, stalk))


def lattice(x, y):
    """Slats of tinted glass between dark bars, 96 x 96, half transparent."""
    bar = min(abs(x % 24 - 12), abs(y % 24 - 12)) - 2.2
    frame = 44 - max(abs(x - 48), abs(y - 48))
    solid = max(inside(bar), inside(frame))
    colour = mix((0.25, 0.42, 0.60), (0.05, 0.035, 0.025), solid)
    return (*colour, 0.35 + 0.65 * solid)


def main():
    folder = sys.argv[1] if len(sys.argv) > 1 else os.path.dirname(os.path.abspath(__file__))
    for name, width, height, pixel in (("wall", 480, 360, wall), ("wheel", 144, 144, wheel), ("leaf", 112, 64, leaf),
                                       ("lattice", 96, 96, lattice)):
        write_png(os.path.join(folder, name + ".png"), width, height, pixel)


if __name__ == "__main__":
    main()
