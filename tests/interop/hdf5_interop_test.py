"""HDF5 layouts of others, written and read by h5py as their programs do.

Run as: hdf5_interop_test.py PROGRAM

Needs h5py and NumPy; skips where they are missing.
"""

import pathlib
import subprocess
import sys
import tempfile
import unittest

PROGRAM = sys.argv[1]

try:
    import h5py
    import numpy as np
except ImportError as missing:
    print(f"skipped: {missing}; pip install -r tests/interop/requirements.txt")
    sys.exit(77)  # skipped, to CTest

random = np.random.default_rng(1)
COUNT = 100_000
T = np.sort(random.integers(0, 3_000_000, COUNT))
X, Y, P = random.integers(0, 640, COUNT), random.integers(0, 480, COUNT), random.integers(0, 2, COUNT)


def convert(*arguments):
    subprocess.run([PROGRAM, "convert", *map(str, arguments)], check=True, capture_output=True, text=True)


def write_v2e(path):
    """As v2e: a dataset that grows, in chunks of h5py's choice."""
    with h5py.File(path, "w") as f:
        events = f.create_dataset("events", shape=(0, 4), maxshape=(None, 4), dtype="uint32", compression="gzip")
        for first in range(0, COUNT, 30_000):
            rows = np.stack([T, X, Y, P], axis=1)[first:first + 30_000]
            events.resize(events.shape[0] + len(rows), axis=0)
            events[-len(rows):] = rows


class Hdf5(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="esim_interop_")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def assert_same(self, t, x, y, p):
        for found, expected in ((t, T), (x, X), (y, Y), (p, P)):
            np.testing.assert_array_equal(found[:], expected)

    def assert_read(self, path):
        """Read by esim, written as DSEC's."""
        out = self.folder / "dsec.h5"
        out.unlink(missing_ok=True)
        convert(path, out, "--compression", "gzip")
        with h5py.File(out) as f:
            self.assert_same(f["events/t"][:] + f["t_offset"][()], f["events/x"], f["events/y"], f["events/p"])

    def test_v2e(self):
        theirs, ours = self.folder / "theirs.h5", self.folder / "ours.h5"
        write_v2e(theirs)
        self.assert_read(theirs)
        convert(theirs, ours, "--format", "v2e")
        with h5py.File(ours) as f:
            self.assertEqual(f["events"].dtype, np.uint32)
            self.assertEqual(f["events"].compression, "gzip")
            self.assert_same(*f["events"][:].T)

    def test_m3ed(self):
        theirs, ours = self.folder / "theirs.h5", self.folder / "ours.h5"
        write_v2e(theirs)
        convert(theirs, ours, "--format", "m3ed", "--compression", "gzip")
        with h5py.File(ours) as f:
            left = f["prophesee/left"]
            self.assert_same(left["t"], left["x"], left["y"], left["p"])
            index = left["ms_map_idx"][:]
            np.testing.assert_array_equal(index, np.searchsorted(T, 1000 * np.arange(len(index))))
            self.assertEqual(len(index), T[-1] // 1000 + 1)
        self.assert_read(ours)

    def test_e2vid_and_e2calib(self):
        path = self.folder / "events.h5"
        with h5py.File(path, "w") as f:
            f["events/ts"], f["events/xs"], f["events/ys"] = T / 1e6, X.astype(np.int16), Y.astype(np.int16)
            f["events/ps"] = P.astype(bool).astype(np.int8)
        self.assert_read(path)
        with h5py.File(path, "w") as f:
            for name, column, kind in (("t", T, "i8"), ("x", X, "u2"), ("y", Y, "u2"), ("p", P, "u1")):
                f.create_dataset(name, data=column.astype(kind), chunks=(2**14,), compression="gzip")
        self.assert_read(path)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
