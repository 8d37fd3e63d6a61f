"""Zip files of the Event Camera Dataset, written and read by Python's own libraries.

Run as: dataset_interop_test.py PROGRAM

Needs NumPy; skips where it is missing.
"""

import io
import pathlib
import struct
import subprocess
import sys
import tempfile
import unittest
import zipfile
import zlib

PROGRAM = sys.argv[1]

try:
    import numpy as np
except ImportError as missing:
    print(f"skipped: {missing}; pip install -r tests/interop/requirements.txt")
    sys.exit(77)  # skipped, to CTest

WIDTH, HEIGHT = 240, 180
CALIBRATION = "199.092366542 198.82882047 132.192071378 110.712660011 -0.368436311798 0.150947243557 -0.000296130534 -0.000759431726 0.0"


def png(image):
    """A grey PNG of 8 bits."""
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    head = struct.pack(">IIBBBBB", image.shape[1], image.shape[0], 8, 0, 0, 0, 0)
    rows = b"".join(b"\0" + row.tobytes() for row in image)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def files():
    """A recording in the style of the dataset: its number of decimals, its names."""
    random = np.random.default_rng(1)
    t = np.sort(random.uniform(0, 1, 20_000))
    events = "".join(f"{time:.9f} {random.integers(WIDTH)} {random.integers(HEIGHT)} {random.integers(2)}\n" for time in t)
    names = [f"images/frame_{i:08}.png" for i in range(5)]
    result = {"calib.txt": CALIBRATION + "\n", "events.txt": events,
              "groundtruth.txt": "".join(f"{0.005 * i:.6f} 0.1 -0.2 {i} 0 0 0 1\n" for i in range(200)),
              "images.txt": "".join(f"{0.1 + 0.04 * i:.6f} {name}\n" for i, name in enumerate(names)),
              "imu.txt": "".join(f"{0.001 * i:.9f} 0.1 9.8 -0.3 0.01 {i} 0.5\n" for i in range(1000))}
    for i, name in enumerate(names):
        result[name] = png(((np.arange(WIDTH * HEIGHT) + i) % 256).astype(np.uint8).reshape(HEIGHT, WIDTH))
    return result


def numbers(text):
    return np.loadtxt(io.StringIO(text if isinstance(text, str) else text.decode()))


class Dataset(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="esim_interop_")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def convert(self, *arguments):
        subprocess.run([PROGRAM, "convert", *map(str, arguments)], check=True, capture_output=True, text=True)

    def test_a_zip_like_those_of_the_data_set_comes_back_the_same(self):
        theirs, ours = self.folder / "theirs.zip", self.folder / "ours.zip"
        expected = files()
        for prefix in ("", "shapes_6dof/"):
            ours.unlink(missing_ok=True)
            with zipfile.ZipFile(theirs, "w", zipfile.ZIP_DEFLATED) as archive:
                for name, content in expected.items():
                    archive.writestr(prefix + name, content)
            self.convert(theirs, ours)
            with zipfile.ZipFile(ours) as archive:
                self.assertIsNone(archive.testzip())
                self.assertEqual(set(archive.namelist()), set(expected))
                for name in ("events.txt", "imu.txt", "groundtruth.txt", "calib.txt"):
                    np.testing.assert_array_equal(numbers(archive.read(name)), numbers(expected[name]), name)
                lines = [line.split() for line in archive.read("images.txt").decode().splitlines()]
                self.assertEqual([(float(t), name) for t, name in lines],
                                 [(float(t), name) for t, name in map(str.split, expected["images.txt"].splitlines())])
                head = archive.read(lines[0][1])[16:24]
                self.assertEqual(struct.unpack(">II", head), (WIDTH, HEIGHT))

    def test_an_unpacked_zip_is_a_dataset_too(self):
        folder, ours = self.folder / "unpacked", self.folder / "ours.zip"
        expected = files()
        for name, content in expected.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        self.convert(folder, ours)
        with zipfile.ZipFile(ours) as archive:
            np.testing.assert_array_equal(numbers(archive.read("events.txt")), numbers(expected["events.txt"]))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
