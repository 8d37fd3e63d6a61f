"""Optical flow and depth as images, read with the libraries of other programs.

Run as: images_interop_test.py PROGRAM SCENES

Needs the packages of requirements.txt, from PyPI; skips where they are missing.
"""

import pathlib
import subprocess
import sys
import tempfile
import unittest

PROGRAM, SCENES = sys.argv[1], pathlib.Path(sys.argv[2])

try:
    import cv2
    import h5py
    import hdf5plugin  # noqa: F401 (reads Blosc)
    import numpy as np
    import OpenEXR
except ImportError as missing:
    print(f"skipped: {missing}; pip install -r tests/interop/requirements.txt")
    sys.exit(77)  # skipped, to CTest


def run(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], check=True, capture_output=True, text=True)


def timestamps(folder):
    return [line.split() for line in (folder / "timestamps.txt").read_text().splitlines() if not line.startswith("#")]


class Images(unittest.TestCase):
    """A short recording in each format, compared with its truth.h5."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        root = pathlib.Path(cls.folder.name)
        cls.root = root
        run("simulate", SCENES / "poster.yaml", "--out", root / "recording", "--set", "duration_s=0.2", "--set",
            "truth.optical_flow=true", "--set", "output.preview=false")
        with h5py.File(root / "recording" / "cam0" / "truth.h5") as file:
            cls.t, cls.depth, cls.motion_field, cls.optical_flow = (
                file[name][:] for name in ("t", "depth", "motion_field", "optical_flow"))
        for name in ("flo", "kitti", "dsec-flow", "exr", "npy-truth"):
            run("convert", root / "recording", root / name, "--format", name)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_flo(self):
        lines = timestamps(self.root / "flo")
        self.assertEqual(len(lines), len(self.optical_flow))
        for k, (_index, start, end, name) in enumerate(lines):
            self.assertEqual(round(float(start) * 1e9), self.t[k])
            self.assertEqual(round(float(end) * 1e9), self.t[k + 1])
            flow = cv2.readOpticalFlow(str(self.root / "flo" / name))
            known = ~np.isnan(self.optical_flow[k, 0])
            np.testing.assert_array_equal(flow[..., 0][known], self.optical_flow[k, 0][known])
            np.testing.assert_array_equal(flow[..., 1][known], self.optical_flow[k, 1][known])
            self.assertTrue((np.abs(flow[~known]) > 1e9).all())

    def check_png_flow(self, path, expected, scale):
        image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        self.assertEqual((image.dtype, image.shape[2]), (np.uint16, 3))
        known = image[..., 0] == 1  # OpenCV stores blue first
        self.assertGreater(known.mean(), 0.5)
        for component, channel in ((0, 2), (1, 1)):
            flow = (image[..., channel].astype(float) - 2**15) / scale
            np.testing.assert_allclose(flow[known], expected[component][known], atol=0.5 / scale + 1e-6)

    def test_kitti(self):
        for k, (*_, name) in enumerate(timestamps(self.root / "kitti" / "flow")):
            self.check_png_flow(self.root / "kitti" / "flow" / name, self.optical_flow[k], 64)
        for k, (*_, name) in enumerate(timestamps(self.root / "kitti" / "depth")):
            depth = cv2.imread(str(self.root / "kitti" / "depth" / name), cv2.IMREAD_UNCHANGED)
            self.assertEqual(depth.dtype, np.uint16)
            seen = depth > 0
            self.assertGreater(seen.mean(), 0.5)
            np.testing.assert_allclose(depth[seen] / 256, self.depth[k][seen], atol=0.5 / 256 + 1e-6)

    def test_dsec_flow(self):
        spans = np.loadtxt(self.root / "dsec-flow" / "forward_timestamps.txt", delimiter=",", dtype=np.int64)
        np.testing.assert_array_equal(spans, np.stack([self.t[:-1], self.t[1:]], axis=1) // 1000)
        for k, path in enumerate(sorted((self.root / "dsec-flow" / "forward").iterdir())):
            self.check_png_flow(path, self.optical_flow[k], 128)

    def test_exr(self):
        lines = timestamps(self.root / "exr")
        self.assertEqual(len(lines), len(self.t))
        for k, (*_, name) in enumerate(lines):
            with OpenEXR.File(str(self.root / "exr" / name), separate_channels=True) as file:
                channels = file.channels()
                np.testing.assert_array_equal(channels["Z"].pixels, self.depth[k])
                np.testing.assert_array_equal(channels["V.x"].pixels, self.motion_field[k, 0])
                np.testing.assert_array_equal(channels["V.y"].pixels, self.motion_field[k, 1])

    def test_npy(self):
        def array(name):
            return np.load(self.root / "npy-truth" / f"{name}.npy", mmap_mode="r")

        np.testing.assert_array_equal(array("t"), self.t)
        np.testing.assert_array_equal(array("depth"), self.depth)
        np.testing.assert_array_equal(array("motion_field"), self.motion_field)
        np.testing.assert_array_equal(array("optical_flow"), self.optical_flow)
        self.assertEqual(array("optical_flow_valid").dtype, np.uint8)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
