"""`esim characterise` as its users meet it.

Run as: characterise_test.py ESIM_PROGRAM SCENES_FOLDER, with the standard library of Python alone.
"""

import json
import pathlib
import sys
import unittest

from program import ProgramTest, run

SCENES = pathlib.Path(sys.argv[2]).absolute()
SHORT = ["--pixels", "4", "--repeats", "2", "--background-s", "0.5", "--width", "20", "--height", "20"]


class Characterise(ProgramTest):
    def test_a_preset(self):
        figure = self.folder / "sensor.png"
        result = run("characterise", "dvs128", "--lux", "1000,100", "--out", figure, *SHORT)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stdout, r"(?s)^dvs128\n +100 lux +1000 lux\n +threshold, ON \(change of the light\) +[\d.]+ % +[\d.]+ %\n")
        self.assertTrue(figure.read_bytes().startswith(b"\x89PNG"))
        result = run("characterise", "dvs128", "--out", figure)
        self.assertEqual(result.returncode, 2)
        self.assertIn("--force", result.stderr)

    def test_two_sensors(self):
        result = run("characterise", "dvs128", "davis346", "--lux", "1000", "--json", *SHORT)
        self.assertEqual(result.returncode, 0, result.stderr)
        first, second = json.loads(result.stdout)
        self.assertEqual((first["sensor"], second["sensor"]), ("dvs128", "davis346"))
        for sensor in (first, second):
            (level,) = sensor["levels"]
            self.assertEqual(level["lux"], 1000)
            self.assertEqual(len(level["on"]["contrasts"]), len(level["on"]["fractions"]))
            self.assertGreater(level["on"]["threshold"], 0.05)
            self.assertGreater(level["latency_s"], 1e-6)

    def test_a_scenario_and_options(self):
        at = ["--lux", "0.5", "--json", *SHORT]
        usual = json.loads(run("characterise", SCENES / "poster.yaml", *at).stdout)[0]["levels"][0]
        higher = json.loads(run("characterise", SCENES / "poster.yaml", "--set", "contrast_threshold_on=0.5", *at).stdout)[0]["levels"][0]
        self.assertAlmostEqual(higher["on"]["threshold"], 0.5, delta=0.05)
        self.assertLess(usual["on"]["threshold"], 0.45)

    def test_bad_input(self):
        for arguments, part in ((["davis"], "preset"), (["davis346", "--set", "contrast_threshold=-1"], "contrast_threshold"),
                                ([self.folder / "none.yaml"], "none.yaml"), (["davis346", "--lux", "0"], "--lux"),
                                (["davis346", "--set", "circuit.dark_current_fa=0"], "dark_current_fa")):
            result = run("characterise", *arguments)
            self.assertEqual(result.returncode, 2, result.stdout)
            self.assertIn(part, result.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
