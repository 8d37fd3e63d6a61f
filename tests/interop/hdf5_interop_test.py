"""HDF5 layouts of other programs, written and read with h5py in the same way.

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
    """Writes like v2e: a growing dataset, with h5py's default chunks."""
    with h5py.File(path, "w") as f:
        events = f.create_dataset("events", shape=(0, 4), maxshape=(None, 4), dtype="uint32", compression="gzip")
        for first in range(0, COUNT, 30_000):
            rows = np.stack([T, X, Y, P], axis=1)[first:first + 30_000]
            events.resize(events.shape[0] + len(rows), axis=0)
            events[-len(rows):] = rows


class Windows:
    """Events between two times, found like in DSEC's own reader: by the milliseconds around the window."""

    def __init__(self, file):
        self.columns = {name: file[f"events/{name}"] for name in "txyp"}
        self.index = file["ms_to_idx"][:].astype(np.int64)
        self.offset = int(file["t_offset"][()])
        self.start_us, self.final_us = self.offset, self.offset + int(self.columns["t"][-1])

    def __call__(self, start_us, end_us):
        """The events of [start, end), or None if a millisecond is not in the index."""
        start, end = start_us - self.offset, end_us - self.offset
        first_ms, end_ms = start // 1000, -(-end // 1000)
        assert 0 <= first_ms < end_ms
        if end_ms >= len(self.index):
            return None
        rough = slice(self.index[first_ms], self.index[end_ms])
        t = self.columns["t"][rough].astype(np.int64)
        exact = slice(*np.searchsorted(t, [start, end]))
        return {"t": t[exact] + self.offset, **{name: self.columns[name][rough][exact] for name in "xyp"}}


class Hdf5(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="esim_interop_")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def assert_same(self, t, x, y, p):
        for found, expected in ((t, T), (x, X), (y, Y), (p, P)):
            np.testing.assert_array_equal(found[:], expected)

    def assert_read(self, path):
        """Reads with esim and writes DSEC's layout."""
        out = self.folder / "dsec.h5"
        out.unlink(missing_ok=True)
        convert(path, out, "--compression", "gzip")
        with h5py.File(out) as f:
            self.assert_same(f["events/t"][:] + f["t_offset"][()], f["events/x"], f["events/y"], f["events/p"])

    def assert_windows(self, path, t, end_us, start_us):
        with h5py.File(path) as f:
            windows = Windows(f)
            self.assertEqual(windows.start_us, start_us)
            self.assertEqual(windows.final_us, t[-1])
            last = t[-1] + 1
            asked = [(start_us, last), (start_us, end_us), (last - 1, last), (end_us - 1, end_us), (end_us - 999, end_us)]
            asked += [tuple(sorted(random.choice(np.arange(start_us, max(last, end_us) + 1), 2, replace=False))) for _ in range(200)]
            for first, end in asked:
                found, inside = windows(int(first), int(end)), (t >= first) & (t < end)
                self.assertIsNotNone(found, f"{first} {end} us")
                np.testing.assert_array_equal(found["t"], t[inside])
                for name, column in (("x", X), ("y", Y), ("p", P)):
                    np.testing.assert_array_equal(found[name], column[:len(t)][inside])

    def test_every_window_of_dsecs_reader(self):
        """A recording that starts before its first event and ends after its last one, converted."""
        for start_us in (0, 49_599_300_523):
            t = start_us + 310 + T[:-1]
            theirs = self.folder / f"{start_us}.h5"
            for end_us in (start_us + 3_001_000, start_us + 3_000_700):
                with h5py.File(theirs, "w") as f:
                    for name, column in (("t", (t - start_us).astype("u4")), ("x", X[:-1].astype("u2")),
                                         ("y", Y[:-1].astype("u2")), ("p", P[:-1].astype("u1"))):
                        f.create_dataset(f"events/{name}", data=column, chunks=(2**14,))
                    f["t_offset"] = start_us
                    f["ms_to_idx"] = np.searchsorted(t - start_us, 1000 * np.arange(-(-(end_us - start_us) // 1000) + 1)).astype("u8")
                self.assert_windows(theirs, t, end_us, start_us)
                ours, again = self.folder / "ours.h5", self.folder / "again.h5"
                convert(theirs, ours, "--compression", "gzip", "--force")
                convert(ours, again, "--compression", "gzip", "--force")
                for path in (ours, again):
                    self.assert_windows(path, t, end_us, start_us)
                    with h5py.File(theirs) as a, h5py.File(path) as b:
                        np.testing.assert_array_equal(a["ms_to_idx"][:], b["ms_to_idx"][:])
                        np.testing.assert_array_equal(a["events/t"][:], b["events/t"][:])
                self.assertEqual(ours.read_bytes(), again.read_bytes())

    def test_windows_of_a_file_whose_index_ends_with_its_events(self):
        theirs, ours = self.folder / "theirs.h5", self.folder / "ours.h5"
        with h5py.File(theirs, "w") as f:  # as DSEC's own files, without the millisecond after the last event
            for name, column in (("t", T.astype("u4")), ("x", X.astype("u2")), ("y", Y.astype("u2")), ("p", P.astype("u1"))):
                f[f"events/{name}"] = column
            f["t_offset"] = 5_000_000
            f["ms_to_idx"] = np.searchsorted(T, 1000 * np.arange(T[-1] // 1000 + 1)).astype("u8")
            self.assertIsNone(Windows(f)(5_000_000, 5_000_000 + int(T[-1]) + 1))
        convert(theirs, ours, "--compression", "gzip")
        self.assert_windows(ours, 5_000_000 + T, 5_000_000 + int(T[-1]) + 1, 5_000_000)

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
            self.assertEqual(len(index), T[-1] // 1000 + 2, "one more, for readers of the last millisecond")
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
