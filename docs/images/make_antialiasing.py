#!/usr/bin/env python3
"""Makes antialiasing.png: the same part of the room with 1, 16 and 64 rays per pixel, every pixel enlarged.

Run from anywhere after scripts/build release; needs nothing but Python.
"""

import pathlib
import struct
import subprocess
import tempfile
import zlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
LEFT, TOP, WIDTH, HEIGHT, ENLARGED, GAP = 242, 45, 80, 60, 4, 8
RAYS = (1, 16, 64)


def render(rays, folder):
    """The first frame of the room's scenario, as rows of grey values."""
    out = pathlib.Path(folder) / str(rays)
    settings = {"renderer.engine": "raycast", "renderer.samples_per_pixel": rays, "start_s": 1.5, "duration_s": 0.01, "output.preview": "false"}
    arguments = [argument for key, value in settings.items() for argument in ("--set", f"{key}={value}")]
    subprocess.run([ROOT / "build/release/esim", "simulate", ROOT / "scenes/room.yaml", "--out", out, "--quiet", *arguments], check=True)
    return read_grey_png(out / "cam0" / "images" / "000000.png")


def read_grey_png(path):
    """Rows of an 8-bit grey PNG without interlacing."""
    data, offset, packed = path.read_bytes(), 8, b""
    while offset < len(data):
        length, kind = struct.unpack(">I4s", data[offset:offset + 8])
        body = data[offset + 8:offset + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", body[:10])
            assert (depth, colour) == (8, 0), "not an 8-bit grey image"
        packed += body if kind == b"IDAT" else b""
        offset += 12 + length
    raw, rows, above = zlib.decompress(packed), [], bytes(width)
    for y in range(height):
        kind, row = raw[y * (width + 1)], bytearray(raw[y * (width + 1) + 1:(y + 1) * (width + 1)])
        for x in range(width):
            left, up, corner = (row[x - 1], above[x], above[x - 1]) if x else (0, above[0], 0)
            guess = left + up - corner
            paeth = min((left, up, corner), key=lambda value: abs(guess - value))
            row[x] = (row[x] + (0, left, up, (left + up) // 2, paeth)[kind]) % 256
        rows.append(bytes(row))
        above = row
    return rows


def write_grey_png(path, rows):
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 0, 0, 0, 0)
    pixels = zlib.compress(b"".join(b"\0" + row for row in rows), 9)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", pixels) + chunk(b"IEND", b""))


def enlarged_part(rows):
    part = [row[LEFT:LEFT + WIDTH] for row in rows[TOP:TOP + HEIGHT]]
    return [bytes(value for value in row for _ in range(ENLARGED)) for row in part for _ in range(ENLARGED)]


with tempfile.TemporaryDirectory() as temporary:
    parts = [enlarged_part(render(rays, temporary)) for rays in RAYS]
write_grey_png(ROOT / "docs/images/antialiasing.png", [(b"\xff" * GAP).join(rows) for rows in zip(*parts)])
