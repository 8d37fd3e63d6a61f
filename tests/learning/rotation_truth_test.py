"""examples/flow's truth from gyroscopes, against closed forms, derivatives and what the simulator says itself.

Run as: rotation_truth_test.py FOLDER_OF_THE_EXAMPLE, by a Python that has NumPy and the package esim.
"""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest
import warnings

try:
    import numpy as np

    import esim
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)  # skipped, to CTest

EXAMPLE = pathlib.Path(sys.argv.pop(1)).resolve()
sys.path.insert(0, str(EXAMPLE))

from evaluate_rotation import AxesCheck, end_point_errors, evaluate, name_of, summary_of  # noqa: E402
from rotation_truth import Calibration, Gyroscope, parse_axes, rotation_of  # noqa: E402

LENS = {"fx": 50.0, "fy": 49.0, "cx": 32.5, "cy": 26.0}
DISTORTION = {"k1": -0.37, "k2": 0.15, "p1": -0.0003, "p2": -0.0008, "k3": 0.01}
CALIBRATION = Calibration(64, 48, **LENS, **DISTORTION)
QUARTER = "0.5,0.5,0.5,0.5"  # of a quaternion: x, y, z to y, z, x


def scenario(folder):
    """A camera that turns about all of its axes within a panorama of blobs; its IMU is mounted askew."""
    random = np.random.default_rng(3)
    coarse = random.integers(20, 235, (64, 128)).astype(np.uint8)
    (folder / "panorama.pgm").write_bytes(b"P5 512 256 255\n" + coarse.repeat(4, 0).repeat(4, 1).tobytes())
    quiet = {"noise_density": 0, "random_walk": 0}
    return {
        "duration_s": 0.4,
        "renderer": {"type": "panorama", "image": folder / "panorama.pgm"},
        "trajectory": {"type": "random", "rotation_amplitude_deg": [40, 40, 90], "knot_interval_s": 0.15},
        "camera": {"width": 64, "height": 48, **LENS, "distortion": {"type": "radial-tangential", **DISTORTION}},
        "event_camera": {"contrast_threshold": 0.2},
        "frame_camera": {"rate_hz": 25},
        "imu": {"rate_hz": 1000, "gyroscope": quiet, "accelerometer": quiet,
                "T_body_imu": {"position": [0.1, 0, 0], "quaternion": [0.5, 0.5, 0.5, 0.5]}},
        "truth": {"rate_hz": 25, "optical_flow": True, "images": False},
        "output": {"preview": False},
    }


class OfARecording(unittest.TestCase):
    """A simulated recording, written as those of the data set are."""

    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory(prefix="esim_learning_")
        cls.folder = pathlib.Path(cls.temporary.name)
        esim.simulate(esim.Scenario(scenario(cls.folder)), out=cls.folder / "recording", seed=2).run()
        cls.dataset = cls.folder / "dataset"
        with warnings.catch_warnings():  # what the layout does not hold
            warnings.simplefilter("ignore")
            esim.convert(cls.folder / "recording", cls.dataset, format="dataset-folder")
        cls.calibration = Calibration.read(cls.dataset / "calib.txt", 64, 48)
        cls.gyroscope = Gyroscope.read(cls.dataset / "imu.txt", parse_axes(QUARTER))
        cls.packets = list(esim.Recording(cls.folder / "recording", packet_s=1.0))

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def test_the_motion_field_is_the_simulators(self):
        (packet,) = self.packets
        self.assertGreaterEqual(len(packet.truth_t), 10)
        for t, flow in zip(packet.truth_t, packet.motion_field):
            field = self.calibration.motion_field(self.gyroscope.at(t))
            self.assertGreater(np.abs(flow).max(), 20)
            self.assertLess(np.abs(field - flow).max(), 0.002 * np.abs(flow).max())

    def test_the_optical_flow_is_the_simulators(self):
        (packet,) = self.packets
        self.assertGreaterEqual(len(packet.optical_flow_t), 9)
        for (t0, t1), optical_flow in zip(packet.optical_flow_t, packet.optical_flow):
            ours = self.calibration.optical_flow(self.gyroscope.rotation(t0, t1))
            known = np.isfinite(optical_flow).all(axis=0)
            self.assertGreater(known.mean(), 0.5)
            error = np.linalg.norm(ours - optical_flow, axis=0)[known]
            self.assertLess(error.max(), 0.003 * np.linalg.norm(optical_flow, axis=0)[known].max())

    def test_errors_are_those_of_the_prediction(self):
        def offset(tensor):
            self.assertEqual(tensor.shape, (4, 48, 64))
            windows.append(tensor)
            t0 = int(self.gyroscope.t[0]) + 40_000_000 * (len(windows) - 1)
            truth = self.calibration.optical_flow(self.gyroscope.rotation(t0, t0 + 40_000_000))
            return truth + np.array([3.0, 4.0])[:, None, None]

        windows = []
        rows, kept, _ = evaluate(self.dataset, self.calibration, self.gyroscope, offset, keep=2)
        summary = summary_of(rows)
        self.assertAlmostEqual(summary["epe_px"], 5.0, places=9)
        self.assertEqual(summary["outliers"], 1.0)
        self.assertEqual(len(kept), 2)
        self.assertEqual(summary["pixels"], sum((w[:2].sum(axis=0) > 0).sum() for w in windows))
        self.assertEqual(summary["events"], len(esim.load_events(self.dataset)) -
                         (esim.load_events(self.dataset)["t"] >= rows[-1]["t0_s"] * 1e9 + 40e6 - 1).sum())
        nothing, _, _ = evaluate(self.dataset, self.calibration, self.gyroscope)
        self.assertAlmostEqual(summary_of(nothing)["epe_px"], summary["truth_px"], places=9)

    def test_events_tell_wrong_axes(self):
        for wrong in ("x,y,z", "-y,z,x", QUARTER):
            axes = parse_axes(wrong)
            gyroscope = Gyroscope.read(self.dataset / "imu.txt", axes)
            _, _, check = evaluate(self.dataset, self.calibration, gyroscope)
            best, ratio = check.best()
            np.testing.assert_allclose(best @ axes, parse_axes(QUARTER), atol=1e-9)
            self.assertEqual(ratio > 1.02, wrong != QUARTER, f"{wrong}: {ratio}")
            self.assertEqual(name_of(best @ axes), name_of(parse_axes(QUARTER)))

    def test_the_program(self):
        def run(*more):
            return subprocess.run([sys.executable, EXAMPLE / "evaluate_rotation.py", *more], capture_output=True, text=True)

        good = run(self.dataset, "--imu-axes", QUARTER, "--out", self.folder / "result")
        self.assertEqual(good.returncode, 0, good.stderr)
        self.assertEqual(good.stderr, "")
        summary = json.loads(good.stdout)
        self.assertEqual(summary, json.loads((self.folder / "result/summary.json").read_text()))
        self.assertEqual(summary["windows"], len((self.folder / "result/windows.csv").read_text().splitlines()) - 1)
        self.assertIn("--imu-axes " + name_of(parse_axes(QUARTER)), run(self.dataset, "--imu-axes", "y,x,z").stderr)
        for arguments, message in (
                ([self.folder / "nothing"], "is not a folder"),
                ([self.folder / "recording"], "calib.txt: No such file"),
                ([self.dataset, "--imu-axes", "x,x,z"], "neither three axes"),
                ([self.dataset, "--start-s", "-1"], "starts before"),
                ([self.dataset, "--start-s", "9"], "no window"),
                ([self.dataset, "--still", "0", "0.3"], "does not stand still"),
                ([self.dataset, "--size", "640", "480"], "calibration of another size")):
            bad = run(*arguments)
            self.assertEqual(bad.returncode, 1)
            self.assertIn(message, bad.stderr)
            self.assertEqual(len(bad.stderr.strip().splitlines()), 1, bad.stderr)


class Maths(unittest.TestCase):
    def test_bearings_project_onto_their_pixels(self):
        x, y = CALIBRATION.bearings
        v, u = np.mgrid[:48, :64]
        np.testing.assert_allclose(CALIBRATION.project(np.stack([2 * x, 2 * y, 2 + 0 * x])), [u, v], atol=1e-9)
        self.assertTrue(np.isnan(CALIBRATION.project(np.array([0.1, 0.1, -1.0]))).all())

    def test_the_motion_field_is_the_derivative_of_the_optical_flow(self):
        omega = np.array([0.7, -0.4, 1.1])
        h = 1e-4
        numeric = (CALIBRATION.optical_flow(rotation_of(h * omega)) - CALIBRATION.optical_flow(rotation_of(-h * omega))) / (2 * h)
        np.testing.assert_allclose(CALIBRATION.motion_field(omega), numeric, atol=1e-4)

    def test_turning_about_the_optical_axis(self):
        """What stood at the angle a about the principal point stands at a - 90 degrees after a quarter turn."""
        straight = Calibration(64, 48, 50.0, 50.0, 31.0, 23.0)
        moved = straight.optical_flow(rotation_of([0, 0, np.pi / 2]))
        v, u = np.mgrid[:48, :64]
        np.testing.assert_allclose(moved, [(v - 23) - (u - 31), -(u - 31) - (v - 23)], atol=1e-9)

    def test_rotations(self):
        for seed in range(20):
            vector = np.random.default_rng(seed).normal(size=3) * 10.0 ** -(seed % 10)
            R = rotation_of(vector)
            np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
            np.testing.assert_allclose(R @ vector, vector, atol=1e-12)
            np.testing.assert_allclose(rotation_of(vector / 2) @ rotation_of(vector / 2), R, atol=1e-12)

    def test_a_rate_that_grows_about_one_axis(self):
        t = np.arange(0, 1_000_000_001, 10_000_000)
        rate = np.outer(t * 1e-9, [0.0, 2.0, 0.0])  # angle t²
        gyroscope = Gyroscope(t, rate)
        R = gyroscope.rotation(123_456_789, 800_000_000)
        np.testing.assert_allclose(R, rotation_of([0, 0.8**2 - 0.123456789**2, 0]), atol=1e-12)
        np.testing.assert_allclose(gyroscope.rotation(0, 5) @ gyroscope.rotation(5, 10**9), gyroscope.rotation(0, 10**9), atol=1e-12)
        with self.assertRaisesRegex(esim.Error, "measured from 0.000 s to 1.000 s"):
            gyroscope.rotation(0, 10**9 + 1)

    def test_the_bias_of_one_that_stands_still(self):
        t = np.arange(1000) * 1_000_000
        random = np.random.default_rng(1)
        bias = np.array([0.01, -0.02, 0.03])
        rate = bias + 0.005 * random.normal(size=(1000, 3))
        rate[500:] += np.linspace(0, 1, 500)[:, None]
        gyroscope = Gyroscope(t, rate)
        np.testing.assert_allclose(gyroscope.bias_at_rest(0, 499_000_000), bias, atol=4 * 0.005 / 500**0.5)
        np.testing.assert_array_equal(gyroscope.less(bias).rate, rate - bias)
        with self.assertRaisesRegex(esim.Error, "does not stand still between 0.4 s and 0.9 s"):
            gyroscope.bias_at_rest(400_000_000, 900_000_000)
        with self.assertRaisesRegex(esim.Error, "has 0 measurements"):
            gyroscope.bias_at_rest(2 * 10**9, 3 * 10**9)

    def test_axes(self):
        np.testing.assert_array_equal(parse_axes("x,-y,-z") @ [1, 2, 3], [1, -2, -3])
        np.testing.assert_array_equal(parse_axes("-y, x, z") @ [1, 2, 3], [-2, 1, 3])
        np.testing.assert_allclose(parse_axes(QUARTER) @ [1, 2, 3], [3, 1, 2], atol=1e-12)
        np.testing.assert_allclose(parse_axes("0,0,0,1"), np.eye(3), atol=1e-12)
        for bad in ("", "x,y", "x,y,y", "x,y,w", "1,0,0,1", "a,b,c,d"):
            with self.assertRaises(esim.Error):
                parse_axes(bad)

    def test_errors_are_taken_where_events_fired_and_the_truth_is_known(self):
        truth = np.zeros((2, 2, 3))
        truth[:, 0, 0] = np.nan
        fired = np.array([[True, True, False], [False, False, True]])
        predicted = np.arange(12.0).reshape(2, 2, 3)
        np.testing.assert_allclose(end_point_errors(predicted, truth, fired), np.hypot([1, 5], [7, 11]))


class BadInput(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory(prefix="esim_learning_")
        self.addCleanup(self.temporary.cleanup)
        self.path = pathlib.Path(self.temporary.name) / "file.txt"

    def refused(self, read, text, message):
        self.path.write_text(text)
        with self.assertRaisesRegex(esim.Error, message) as raised:
            read(self.path)
        self.assertIn(str(self.path), str(raised.exception))

    def test_imu(self):
        good = "".join(f"{i / 1000:.9f} 0 0 9.81 0.1 0.2 {i}\n" for i in range(100))
        self.path.write_text("# comment\n\n" + good)
        self.assertEqual(Gyroscope.read(self.path).rate.shape, (100, 3))
        self.assertEqual(Gyroscope.read(self.path, delay_s=0.002).t[5], 3_000_000)
        lines = good.splitlines(keepends=True)
        self.refused(Gyroscope.read, "", "is empty; expected")
        self.refused(Gyroscope.read, lines[0] + "0.001 0 0 9.81 0.1 0.2\n", r":2: 6 columns instead of 7: t ax ay az gx gy gz")
        self.refused(Gyroscope.read, lines[0] + "# \n0.001 0 0 9.81 0.1 0.2 abc\n", ":3: expected numbers")
        self.refused(Gyroscope.read, lines[0] + lines[1].replace("0.1", "nan"), ":2: not a finite number")
        self.refused(Gyroscope.read, lines[0] + lines[2] + lines[1], ":3: the time 0.001000000 s does not come after")
        self.refused(Gyroscope.read, lines[3] + lines[3], ":2: the time")
        self.refused(Gyroscope.read, "".join(lines[:10] + lines[40:]), ":11: no measurement for 0.031 s")
        self.refused(Gyroscope.read, "1e300 0 0 0 0 0 0\n", ":1: the time must be in seconds")
        self.assertEqual(len(Gyroscope.read(self.write("".join(lines[:10] + lines[40:])), max_gap_s=0.05).t), 70)
        with self.assertRaisesRegex(esim.Error, "No such file.*the evaluation needs it"):
            Gyroscope.read(self.path.parent / "none.txt")

    def write(self, text):
        self.path.write_text(text)
        return self.path

    def test_calibration(self):
        read = lambda path: Calibration.read(path, 240, 180)
        good = "199.09 198.83 132.19 110.71 -0.368 0.151 -0.0003 -0.0008 0"
        self.assertEqual(read(self.write(good)).p2, -0.0008)
        self.refused(read, "199.09 198.83 132.19 110.71 -0.368 0.151 -0.0003 -0.0008", ":1: 8 columns instead of 9")
        self.refused(read, good + "\n" + good, "2 lines of numbers instead of one")
        self.refused(read, "-1" + good, ":1: focal lengths must be above 0")
        self.refused(read, good.replace("132.19", "320.1"), ":1: cx = 320.1 px cannot belong to a sensor of 240 x 180 px")
        self.refused(read, good.replace("110.71", "20"), ":1: cy = 20 px .*another size")
        self.refused(read, good.replace("-0.368", "-1.5"), r":1: the distortion cannot be inverted at pixel \(0, 0\)")

    def test_no_common_time(self):
        events = np.zeros(3, esim.EVENT_DTYPE)
        events["t"], events["p"] = [5 * 10**9, 5 * 10**9 + 1, 6 * 10**9], 1
        path = self.path.parent / "events.txt"
        esim.save_events(path, events, 64, 48)
        gyroscope = Gyroscope(np.arange(100) * 1_000_000, np.ones((100, 3)))
        with self.assertRaisesRegex(esim.Error, "no events in the time that the gyroscope covers.*clocks"):
            evaluate(path, CALIBRATION, gyroscope)

    def test_events_outside_the_sensor(self):
        events = np.zeros(1, esim.EVENT_DTYPE)
        events["x"], events["p"] = 200, 1
        path = self.path.parent / "events.txt"
        esim.save_events(path, events, 240, 180)
        gyroscope = Gyroscope(np.arange(100) * 1_000_000, np.ones((100, 3)))
        with self.assertRaisesRegex(esim.Error, "events.txt.*sensor"):
            evaluate(path, CALIBRATION, gyroscope)


class Axes(unittest.TestCase):
    def test_without_events_the_axes_are_taken_as_they_are(self):
        best, ratio = AxesCheck(CALIBRATION, None).best()
        np.testing.assert_array_equal(best, np.eye(3))
        self.assertEqual(ratio, 1)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
