"""`esim evaluate` as its users meet it.

Run as: evaluate_test.py ESIM_PROGRAM SCENES_FOLDER, with the standard library of Python alone.
"""

import csv
import json
import pathlib
import sys
import unittest

from program import ProgramTest, run

SCENES = pathlib.Path(sys.argv[2]).absolute()
SMALL = ["--set", "camera.width=96", "--set", "camera.height=72"]


class EvaluateSampling(ProgramTest):
    def evaluate(self, *arguments):
        return run("evaluate", "sampling", *arguments, "--out", self.out)

    def test_quick(self):
        result = self.evaluate(SCENES / "panorama.yaml", "--quick", *SMALL)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertNotIn("\x1b", result.stdout + result.stderr)
        report = json.loads((self.out / "report.json").read_text())
        self.assertEqual(report["status"], "complete")
        self.assertEqual([w["name"] for w in report["windows"]], ["slow", "fast", "all"])
        for scheme in report["schemes"]:
            self.assertIn(scheme["scheme"], result.stdout)
            for window in scheme["windows"]:
                self.assertEqual(len(window["rmse_of_pixels"]), report["pixels"])
                events = window["events"]
                self.assertEqual(events["matched"] + events["missing"], events["reference"])
        finer = {s["scheme"]: s["windows"][-1]["rmse_mean"] for s in report["schemes"]}
        self.assertLess(finer["uniform rate_hz=1000"], finer["uniform rate_hz=250"])
        rows = list(csv.DictReader((self.out / "summary.csv").read_text().splitlines()))
        self.assertEqual(len(rows), 3 * len(report["schemes"]))
        self.assertTrue((self.out / "samples.csv").stat().st_size > 0)
        for line in (self.out / "report.md").read_text().splitlines():
            if line.startswith("!["):
                picture = self.out / line[line.index("(") + 1:-1]
                self.assertEqual(picture.read_bytes()[:4], b"\x89PNG", picture)
        # The written scenario can be evaluated again.
        self.assertEqual(run("check", self.out / "scenario.yaml").returncode, 0)
        again = self.evaluate(SCENES / "panorama.yaml", "--quick")
        self.assertEqual(again.returncode, 2)
        self.assertIn("--force", again.stderr)

    def test_the_paper_s_scenario(self):
        image = SCENES / "panorama" / "panorama.jpg"
        result = self.evaluate("--panorama", image, "--quick", "--event-span", 0, "--scheme", "uniform rate_hz=200",
                               "--scheme", "{type: flow, lambda: 4}")
        self.assertEqual(result.returncode, 0, result.stderr)
        report = json.loads((self.out / "report.json").read_text())
        self.assertEqual([s["scheme"] for s in report["schemes"]], ["uniform rate_hz=200", "flow lambda=4"])
        self.assertNotIn("events", report["schemes"][0]["windows"][0])
        self.assertEqual(run("check", self.out / "scenario.yaml").returncode, 0)

    def test_refusals(self):
        scene = SCENES / "panorama.yaml"
        self.assert_refused(self.evaluate("nowhere.yaml"), "nowhere.yaml")
        self.assert_refused(self.evaluate("--panorama", "nowhere.jpg", "--quick"), "nowhere.jpg")
        self.assert_refused(self.evaluate(scene, "--scheme", "flwo lambda=1"), "did you mean flow?")
        self.assert_refused(self.evaluate(scene, "--pixels", "many"), "--pixels")
        self.assert_refused(self.evaluate(scene, "--quick", "--truth-rays", 64), "casts no rays")
        self.assert_refused(self.evaluate(scene, "--truth-rays", 17), "--truth-rays")
        self.assert_refused(self.evaluate("--panorama", "a.jpg", "--set", "seed=1"), "--set")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
