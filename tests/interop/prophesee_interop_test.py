"""Files of events, compared with the usual programs that read and write them.

Run as: prophesee_interop_test.py PATH_TO_ESIM, with the packages of requirements.txt (where one is missing, its tests are
skipped).
"""

import importlib
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

ESIM = os.path.abspath(sys.argv[1])
WIDTH, HEIGHT = 200, 180  # px; all formats hold them


def package(name):
    try:
        return importlib.import_module(name)
    except ImportError:
        raise unittest.SkipTest(f"{name} is not installed") from None


def convert(source, target, *arguments):
    result = subprocess.run([ESIM, "convert", str(source), str(target), "--force", *arguments], capture_output=True, text=True)
    if result.returncode != 0:
        raise AssertionError(result.stderr)


class InteropTest(unittest.TestCase):
    def setUp(self):
        self.np = package("numpy")
        folder = tempfile.TemporaryDirectory(prefix="esim_interop_")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def random_events(self, duration_s, count=20_000):
        """Columns t (us), x, y, p, by time: many at one time and in one row, which become vectors in EVT 3.0."""
        random = self.np.random.default_rng(1)
        t = self.np.sort(random.integers(0, round(duration_s * 1e6), count // 20)).repeat(20)
        y = random.integers(0, HEIGHT, count // 20).repeat(20)
        x = self.np.sort(random.integers(0, WIDTH, (count // 20, 20)), axis=1).ravel()
        p = random.integers(0, 2, count)
        return self.np.stack([t, x, y, p], axis=1)

    def write_text(self, events):
        path = self.folder / "events.txt"
        path.write_text("".join(f"{t // 1_000_000}.{t % 1_000_000:06d} {x} {y} {p}\n" for t, x, y, p in events.tolist()))
        return path

    def read_text(self, path):
        rows = [line.split() for line in path.read_text().splitlines()]
        return self.np.array([[round(float(t) * 1e6), int(x), int(y), int(p)] for t, x, y, p in rows])

    def write(self, events, name, *arguments):
        """By esim."""
        source, path = self.write_text(events), self.folder / name.replace("/", ".")
        convert(source, path, "--format", name.split("/")[0].split(".")[0], *arguments)
        return path

    def read(self, path, *arguments):
        """By esim."""
        target = self.folder / "read.txt"
        convert(path, target, *arguments)
        return self.read_text(target)

    def columns(self, array, *names):
        return self.np.stack([array[name].astype("i8") for name in names], axis=1)

    def assert_same(self, found, expected):
        self.np.testing.assert_array_equal(found, expected)


class Faery(InteropTest):
    def setUp(self):
        super().setUp()
        self.faery = package("faery")

    def read_by_faery(self, path):
        parts = list(self.faery.events_stream_from_file(path, dimensions_fallback=(WIDTH, HEIGHT)))
        return self.columns(self.np.concatenate(parts), "t", "x", "y", "on")

    def test_reads_what_esim_writes(self):
        events = self.random_events(duration_s=40)  # two wraps of EVT 3.0's clock
        for name in ("evt3.raw", "evt2.raw", "dat.dat"):
            with self.subTest(name):
                self.assert_same(self.read_by_faery(self.write(events, name)), events)

    def test_writes_what_esim_reads(self):
        events = self.random_events(duration_s=10)
        path = self.write(events, "dat.dat")
        for version, name in (("evt3", "by_faery_3.raw"), ("evt2", "by_faery_2.raw"), ("dat2", "by_faery.dat")):
            with self.subTest(version):
                stream = self.faery.events_stream_from_file(path)
                stream.to_file(self.folder / name, version=version, zero_t0=False)
                self.assert_same(self.read(self.folder / name), events)


class Expelliarmus(InteropTest):
    # Seconds. It loses the high bits of EVT 3.0's time when it writes, and when it reads its own files: here they are 0.
    DURATIONS = {"evt3.raw": 0.004, "evt2.raw": 10, "dat.dat": 10}

    def setUp(self):
        super().setUp()
        self.wizard = package("expelliarmus").Wizard

    def test_reads_what_esim_writes(self):
        for name, duration in self.DURATIONS.items():
            with self.subTest(name):
                events = self.random_events(duration)
                array = self.wizard(encoding=name.split(".")[0]).read(self.write(events, name))
                self.assert_same(self.columns(array, "t", "x", "y", "p"), events)

    def test_writes_what_esim_reads(self):
        for name, duration in self.DURATIONS.items():
            with self.subTest(name):
                events = self.random_events(duration)
                array = self.np.zeros(len(events), [("t", "<i8"), ("x", "<i2"), ("y", "<i2"), ("p", "u1")])
                for i, field in enumerate("txyp"):
                    array[field] = events[:, i]
                path = self.folder / ("by_expelliarmus_" + name)
                self.wizard(encoding=name.split(".")[0]).save(path, array)
                self.assert_same(self.read(path), events)


class Tonic(InteropTest):
    def test_reads_nmnist(self):
        read_mnist_file = package("tonic.io").read_mnist_file
        events = self.random_events(duration_s=8)
        dtype = self.np.dtype([("x", int), ("y", int), ("t", int), ("p", int)])
        array = read_mnist_file(str(self.write(events, "nmnist.bin")), dtype)
        self.assert_same(self.columns(array, "t", "x", "y", "p"), events)


    # It reads the layout of a DAVIS346, and all samples of frames as events.
    SIZE = ("--width", "346", "--height", "260")

    def read_aedat2(self, path):
        _, _, array = package("tonic.io").read_davis_346(str(path))
        return self.columns(array, "t", "x", "y", "p")

    def test_reads_aedat2(self):
        events = self.random_events(duration_s=4200)  # the clock has 32 bits, in us
        self.assert_same(self.read_aedat2(self.write(events, "aedat2.aedat", *self.SIZE)), events)

    def test_reads_aedat2_of_others_alike(self):
        """A file as from v2e: its header does not name the chip."""
        np, events = self.np, self.random_events(duration_s=4200)
        t, x, y, p = events.astype("u4").T
        address = (259 - y) << 22 | (345 - x) << 12 | p << 11
        path = self.folder / "others.aedat"
        path.write_bytes(b"#!AER-DAT2.0\r\n# Timestamps tick is 1 us\r\n" + np.stack([address, t], axis=1).astype(">u4").tobytes())
        self.assert_same(self.read(path, *self.SIZE), events)
        self.assert_same(self.read_aedat2(path), events)


class EventStream(InteropTest):
    SIZE = ("--width", str(WIDTH), "--height", str(HEIGHT))
    DURATION_S = 40

    def flipped(self, events):
        """The package event_stream counts rows from the bottom, faery from the top, in the same files."""
        return self.np.stack([events[:, 0], events[:, 1], HEIGHT - 1 - events[:, 2], events[:, 3]], axis=1)

    def test_event_stream_reads_what_esim_writes(self):
        decoder = package("event_stream").Decoder(self.write(self.random_events(self.DURATION_S), "es.es", *self.SIZE))
        self.assertEqual((decoder.type, decoder.width, decoder.height), ("dvs", WIDTH, HEIGHT))
        found = self.columns(self.np.concatenate(list(decoder)), "t", "x", "y", "on")
        self.assert_same(self.flipped(found), self.random_events(self.DURATION_S))

    def test_event_stream_writes_what_esim_reads(self):
        event_stream, events = package("event_stream"), self.random_events(self.DURATION_S)
        t, x, y, p = self.flipped(events).T
        for kind in ("dvs", "atis"):
            with self.subTest(kind):
                array = self.np.zeros(len(events), getattr(event_stream, kind + "_dtype"))
                array["t"], array["x"], array["y"], array["p"] = t, x, y, p
                if kind == "atis":
                    array["exposure"][1::3] = True
                path = self.folder / f"by_event_stream_{kind}.es"
                with event_stream.Encoder(path, kind, WIDTH, HEIGHT) as encoder:
                    encoder.write(array)
                changes = self.np.ones(len(events), bool) if kind == "dvs" else ~array["exposure"]
                self.assert_same(self.read(path), events[changes])

    def test_faery_reads_and_writes(self):
        faery, events = package("faery"), self.random_events(self.DURATION_S)
        path, back = self.write(events, "es.es", *self.SIZE), self.folder / "by_faery.es"
        stream = faery.events_stream_from_file(path)
        self.assertEqual(stream.dimensions(), (WIDTH, HEIGHT))
        self.assert_same(self.columns(self.np.concatenate(list(stream)), "t", "x", "y", "on"), events)
        faery.events_stream_from_file(path).to_file(back, zero_t0=False)
        self.assert_same(self.read(back), events)


class NumPy(InteropTest):
    def test_reads_npy_and_npz(self):
        events = self.random_events(duration_s=40)
        array = self.np.load(self.write(events, "npy.npy"))
        self.assertEqual(array.dtype.names, ("t", "x", "y", "p"))
        self.assert_same(self.columns(array, "t", "x", "y", "p"), events)
        with self.np.load(self.write(events, "npz.npz")) as arrays:
            self.assertEqual([arrays[name].dtype.str for name in "txyp"], ["<i8", "<u2", "<u2", "|u1"])
            self.assert_same(self.columns(arrays, "t", "x", "y", "p"), events)

    def test_writes_what_esim_reads(self):
        np, events = self.np, self.random_events(duration_s=40)
        t, x, y, p = events.T
        types = {
            "any order": [("x", "<i2"), ("y", "<i2"), ("p", "?"), ("timestamp", "<u4")],
            "big-endian, signs": [("t", ">i8"), ("x", ">u2"), ("y", ">u2"), ("polarity", "i1")],
            "floats, seconds": [("x", "<f4"), ("y", "<f4"), ("t", "<f8"), ("p", "<f4")],
            "timedeltas": [("t", "<m8[ns]"), ("x", "u1"), ("y", "u1"), ("p", "u1")],
            "aligned": np.dtype([("p", "u1"), ("t", "<i8"), ("x", "<u2"), ("y", "<u2")], align=True),
        }
        for name, dtype in types.items():
            array = np.zeros(len(events), dtype)
            time_name = next(field for field in array.dtype.names if field.startswith("t"))
            array[time_name] = {"f": t / 1e6, "m": t * 1000}.get(array.dtype[time_name].kind, t)
            array["x"], array["y"] = x, y
            array[next(field for field in array.dtype.names if field.startswith("p"))] = (
                2 * p - 1 if "signs" in name else p)
            for save in (np.save, np.savez, np.savez_compressed):
                with self.subTest(name, save=save.__name__):
                    path = self.folder / ("by_numpy.npy" if save is np.save else "by_numpy.npz")
                    save(path, array)
                    self.assert_same(self.read(path), events)

    def test_writes_arrays_that_esim_reads(self):
        t, x, y, p = self.random_events(duration_s=40).T
        for save in (self.np.savez, self.np.savez_compressed):
            with self.subTest(save.__name__):
                path = self.folder / "arrays.npz"
                save(path, x=x, y=y, ts=t, pol=p, width=WIDTH, height=HEIGHT, other=self.np.zeros((2, 3)))
                self.assert_same(self.read(path), self.np.stack([t, x, y, p], axis=1))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
