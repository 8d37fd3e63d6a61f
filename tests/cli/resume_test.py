"""Simulations that are killed at any moment and resumed, against one without interruption.

Run as: resume_test.py ESIM_PROGRAM SCENES_FOLDER [KILLS DURATION_S], with the standard library of Python alone.
"""

import hashlib
import json
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import time
import unittest

from program import ESIM, ProgramTest, run

SCENES = pathlib.Path(sys.argv[2]).absolute()
KILLS = int(sys.argv[3]) if len(sys.argv) > 3 else 3
DURATION_S = float(sys.argv[4]) if len(sys.argv) > 4 else 2

OPTIONS = ["--set", "sampling={type: uniform, rate_hz: 200}", "--set", "imu={}", "--set", "camera.frame_camera={rate_hz: 30}",
           "--set", "truth={rate_hz: 20, optical_flow: true}", "--set", f"duration_s={DURATION_S}", "--set", "trajectory.time_scale=2", "--set", "output.formats=[evt3, text]",
           "--set", "output.samples=exact", "--set", "camera.width=96", "--set", "camera.height=72"]
SCENE = SCENES / "room.yaml"


def checksums(recording):
    files = [path for path in recording.rglob("*") if path.is_file() and path.name != "report.json" and not path.name.startswith("preview")]
    return {str(path.relative_to(recording)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


class Resumed(ProgramTest):
    def setUp(self):
        super().setUp()
        self.incomplete = pathlib.Path(f"{self.out}.incomplete")

    def test_killed_simulations_are_resumed_with_the_same_files(self):
        whole = self.folder / "whole"
        begin = time.monotonic()
        result = run("simulate", SCENE, "--out", whole, "--quiet", *OPTIONS)
        undisturbed_s = time.monotonic() - begin
        self.assertEqual(result.returncode, 0, result.stderr)
        expected = checksums(whole)
        self.assertIn("cam0/events.h5", expected)
        moments = random.Random(1)
        kills = resumed = repeated_s = all_s = 0
        while kills < KILLS:
            begin, before = time.monotonic(), kills
            process = subprocess.Popen([ESIM, "simulate", SCENE, "--out", self.out, "--quiet", *OPTIONS])
            while True:
                try:
                    self.assertEqual(process.wait(moments.uniform(0.1, 1.1) * undisturbed_s if kills < KILLS else None), 0)
                    break
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()
                    kills += 1
                if (self.incomplete / "checkpoint" / "state").exists():
                    resumed += 1
                    process = subprocess.Popen([ESIM, "simulate", "--resume", self.out, "--quiet"])
                else:
                    process = subprocess.Popen([ESIM, "simulate", SCENE, "--out", self.out, "--force", "--quiet", *OPTIONS])
            self.assertEqual(checksums(self.out), expected)
            if kills > before:
                used_s = time.monotonic() - begin
                useful_s = json.loads((self.out / "report.json").read_text())["wall_s"]
                repeated_s, all_s = repeated_s + (used_s - useful_s) / (kills - before), all_s + useful_s
            shutil.rmtree(self.out)
        if undisturbed_s > 4:
            self.assertGreater(resumed, 0)
        print(f"{kills} kills; repeated and read again after each: {100 * repeated_s / all_s:.1f} % of a simulation of "
              f"{undisturbed_s:.1f} s", file=sys.stderr)

    def test_interrupted_simulation_says_how_to_continue(self):
        process = subprocess.Popen([ESIM, "simulate", SCENE, "--out", self.out, *OPTIONS], stderr=subprocess.PIPE, text=True)
        while not (self.incomplete / "cam0" / "events.h5").exists():
            time.sleep(0.05)
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 130)
        self.assertIn(f"continue:  esim simulate --resume {self.out}", said)
        self.assertTrue((self.out / "checkpoint" / "state").exists())
        changed = run("simulate", SCENE, "--resume", self.out, *OPTIONS, "--set", "duration_s=5")
        self.assertEqual(changed.returncode, 2)
        self.assertIn('now "duration_s: 5"', changed.stderr)
        resumed = run("simulate", "--resume", self.out, "--threads", "1")
        self.assertEqual(resumed.returncode, 0, resumed.stderr)
        self.assertFalse((self.out / "checkpoint").exists())

    def test_what_cannot_be_resumed_is_named(self):
        self.assert_refused(run("simulate", "--resume", self.out), "there is neither", str(self.out))
        self.assert_refused(run("simulate"), "name a scenario")
        self.assert_refused(run("simulate", SCENE, "--resume", self.out, "--out", self.folder), "--out")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
