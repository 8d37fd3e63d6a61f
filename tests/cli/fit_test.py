"""`esim fit` as its users meet it.

Run as: fit_test.py ESIM_PROGRAM SCENES_FOLDER, with the standard library of Python alone.
"""

import json
import pathlib
import sys
import unittest

from program import ProgramTest, run

SCENES = pathlib.Path(sys.argv[2]).absolute()


class Fit(ProgramTest):
    def record(self, name, *options):
        size = ("camera.width=96", "camera.height=72", "output.preview=false")
        settings = [part for option in (*size, *options) for part in ("--set", option)]
        result = run("simulate", SCENES / "poster.yaml", "--out", self.folder / name, "--quiet", *settings)
        self.assertEqual(result.returncode, 0, result.stderr)
        return self.folder / name

    def parameters(self, *arguments):
        result = run("fit", "--json", "--quiet", *arguments)
        self.assertEqual(result.returncode, 0, result.stderr)
        return {e["name"]: e for e in json.loads(result.stdout)["parameters"]}

    def test_a_known_sensor(self):
        moving = self.record("moving", "truth.rate_hz=200", "sampling.lambda=0.1")
        out = self.folder / "fitted"
        result = run("fit", "--moving", moving, "--out", out)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stdout, r"contrast_threshold_on +\| 0\.(29|30)\d* +\| 0\.\d+ to 0\.\d+ +\| events and images")
        self.assertIn("leak_rate_hz: not determined, because no recording in constant light", result.stdout)
        self.assertIn("# A fitted sensor", (out / "report.md").read_text())
        self.assertTrue((out / "distributions.png").read_bytes().startswith(b"\x89PNG"))

        # The file is a sensor for the other commands.
        sensor = (out / "sensor.yaml").read_text()
        self.assertIn("\n  preset: ideal\n  contrast_threshold_on: 0.", sensor)
        short = ["--pixels", "4", "--repeats", "2", "--background-s", "0.5", "--lux", "0.5", "--json", "--quiet"]
        (measured,) = json.loads(run("characterise", out / "sensor.yaml", *short).stdout)
        self.assertAlmostEqual(measured["levels"][0]["on"]["threshold"], 0.3, delta=0.03)

        result = run("fit", "--moving", moving, "--out", out)
        self.assertEqual(result.returncode, 2)
        self.assertIn("--force", result.stderr)

    def test_events_alone(self):
        moving = self.record("refractory", "event_camera.refractory_period_us=5000", "event_camera.shot_noise_hz=100",
                             "duration_s=1")
        found = self.parameters(moving, "--base", "dvs128@1")
        self.assertIn("no recording of a moving scene", found["contrast_threshold_on"]["reason"])
        self.assertIsNone(found["leak_rate_hz"]["value"])

    def test_pairs_of_events_with_one_time_stamp(self):
        pairs = self.folder / "pairs.txt"
        pairs.write_text("".join(f"{0.001 * (k // 2):.6f} {k // 2 % 10} 0 {k % 2}\n" for k in range(2000)))
        result = run("fit", pairs, "--width", "10", "--height", "10", "--out", self.folder / "pairs", "--quiet")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stdout, r"refractory_period_us +\| 0 us ")

    def lamp(self, name, periods=40, pixels=10):
        """A lamp of 50 Hz: three ON events of each pixel, then three OFF events."""
        path = self.folder / name
        with path.open("w") as file:
            for period in range(periods):
                for k, phase in enumerate((0, 0.01, 0.3, 0.5, 0.51, 0.8)):
                    for y in range(pixels):
                        for x in range(pixels):
                            file.write(f"{(period + phase) / 50:.6f} {x} {y} {int(k < 3)}\n")
        return path

    def test_known_light_that_determines_nothing(self):
        lamp, short = self.lamp("lamp.txt"), self.lamp("short.txt", periods=4)
        noise = self.folder / "noise.txt"  # in constant light
        noise.write_text("".join(f"{0.000731 * k:.6f} {k % 10} {k // 10 % 10} {k % 2}\n" for k in range(3000)))
        sensor = ("--width", "10", "--height", "10", "--base", "davis346")
        for recording, light, part in (
            (lamp, "50:0.5:20", "two frequencies"),
            (lamp, "50:0.5:?", "illuminance is unknown"),
            (lamp, "50:?:20", "modulation of the lamp is unknown"),
            (lamp, "33.3:0.5:20", "do not follow a lamp of 33.3 Hz"),
            (lamp, "100:0.5:20", "repeat 50 times per second, or less often, not 100 times"),
            (noise, "50:0.5:20", "do not follow a lamp of 50 Hz: constant light"),
            (short, "50:0.5:20", "short.txt (50 Hz at 20 lux): 1800 events in 3 periods; at least 500 in 10 are necessary: record longer"),
        ):
            found = self.parameters("--flicker", f"{recording}:{light}", *sensor)
            self.assertIn(part, found["circuit.photocurrent_fa_per_lux"]["reason"])
            self.assertIn(part, found["contrast_threshold_on"]["reason"])
            self.assertIn(part, found["circuit.source_follower_hz"]["reason"])
        # The same illuminance twice.
        again = self.lamp("again.txt")
        found = self.parameters("--static", f"{lamp}:5", "--static", f"{again}:5", *sensor)
        self.assertIn("at 1 different illuminance; 3 are necessary", found["circuit.dark_current_fa"]["reason"])
        found = self.parameters("--flicker", f"{lamp}:50:0.5:5", "--flicker", f"{again}:50:0.5:5", *sensor)
        self.assertIn("two frequencies", found["contrast_threshold_on"]["reason"])
        # A base without circuit.
        found = self.parameters("--flicker", f"{lamp}:50:0.5:20", "--width", "10", "--height", "10")
        self.assertIn("choose a preset with one, such as davis346", found["contrast_threshold_on"]["reason"])

    def test_known_light_that_is_refused(self):
        lamp = self.lamp("lamp.txt", periods=2)
        small = self.record("small", "duration_s=0.05", "camera.width=40")
        large = self.record("large", "duration_s=0.05")
        sensor = ("--width", "10", "--height", "10", "--base", "davis346")
        for arguments, *parts in (
            (("--flicker", lamp, *sensor), "RECORDING:HZ:MODULATION:LUX"),
            (("--flicker", f"{lamp}:?:0.5:20", *sensor), "frequency of the lamp must be known"),
            (("--flicker", f"{lamp}:fast:0.5:20", *sensor), "'fast' must be the frequency of the lamp in Hz"),
            (("--flicker", f"{lamp}:0:0.5:20", *sensor), "lamp.txt", "frequency of the lamp must be above 0, not 0 Hz"),
            (("--flicker", f"{lamp}:50:1.5:20", *sensor), "modulation of the lamp must be above 0 and below 1, not 1.5"),
            (("--flicker", f"{lamp}:50:0:20", *sensor), "modulation of the lamp must be above 0 and below 1, not 0"),
            (("--flicker", f"{lamp}:50:0.5:0", *sensor), "illuminance must be above 0, not 0 lux"),
            (("--flicker", f"{lamp}:50:0.5:-3", *sensor), "illuminance must be above 0, not -3 lux"),
            (("--static", f"{lamp}:-1", *sensor), "illuminance must be 0 or more, not -1 lux"),
            (("--static", f"{lamp}:bright", *sensor), "'bright' must be the illuminance"),
            (("--static", f"{lamp}:0", "--static", f"{lamp}:5", *sensor), "lamp.txt", "is given twice"),
            (("--flicker", f"{small}:50:0.5:9", "--static", large), "40 x 72", "96 x 72"),
            (("--flicker", f"{self.folder / 'none.txt'}:50:0.5:9", *sensor), "none.txt"),
        ):
            result = run("fit", "--quiet", *arguments)
            self.assertEqual(result.returncode, 2, result.stdout)
            self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
            for part in parts:
                self.assertIn(part, result.stderr)

    def test_bad_input(self):
        moving = self.record("one", "duration_s=0.05")
        small = self.record("small", "duration_s=0.05", "camera.width=40")
        text = self.folder / "events.txt"
        text.write_text("0.1 3 4 1\n0.2 3 4 0\n")
        for arguments, part in (
            ([], "recordings"),
            (["none.raw"], "none.raw"),
            ([moving, "--base", "davis"], "davis"),
            ([moving, "--static", small], "96 x 72"),
            ([text], "--width"),
        ):
            result = run("fit", *arguments)
            self.assertEqual(result.returncode, 2, result.stdout)
            self.assertIn(part, result.stderr)
            self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
        # A recording that is too short determines nothing, and says so.
        found = self.parameters(text, "--width", "10", "--height", "10")
        self.assertTrue(all(e["value"] is None for e in found.values()))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
