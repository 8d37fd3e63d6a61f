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
