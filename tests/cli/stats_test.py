"""`esim stats` as its users meet it: exit codes, messages, and what is left on disk.

Run as: stats_test.py ESIM_PROGRAM SCENES_FOLDER, with the standard library of Python alone.
"""

import json
import pathlib
import random
import shutil
import struct
import sys
import unittest

from program import ProgramTest, run

SCENES = pathlib.Path(sys.argv[2]).absolute()


def stream(number=4000, duration_s=2.0, frame_rate_hz=None):
    """Lines t x y p at random, or at the ends of frames."""
    source = random.Random(1)
    times = sorted(source.uniform(0, duration_s) for _ in range(number))
    if frame_rate_hz:
        times = [(int(t * frame_rate_hz) + 1) / frame_rate_hz for t in times]
    return "".join(f"{t:.6f} {source.randrange(32)} {source.randrange(24)} {source.randrange(2)}\n" for t in times)


class Stats(ProgramTest):
    def write(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return path

    def test_a_recording(self):
        out = self.out
        self.assertEqual(run("simulate", SCENES / "poster.yaml", "--out", out, "--set", "camera.width=64", "--set", "camera.height=48",
                             "--set", "duration_s=0.3", "--set", "output.formats=[text]", "--set", "output.preview=false").returncode, 0)
        report = json.loads((out / "report.json").read_text())
        for path in (out, out / "cam0" / "events.h5", out / "cam0" / "events.txt"):
            result = run("stats", path, "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            found = json.loads(result.stdout)
            self.assertEqual(found["stream"]["events"], report["cameras"][0]["events"])
            self.assertEqual(found["stream"]["on"], report["cameras"][0]["events_on"])
            self.assertEqual((found["pixels"]["width"], found["pixels"]["height"]), (64, 48))
            self.assertNotEqual(found["time_stamps"]["banding"], "strong")
        self.assertEqual({p.name for p in self.folder.iterdir()}, {"out"})

    def test_bands(self):
        even, banded = self.write("even.txt", stream()), self.write("banded.txt", stream(frame_rate_hz=50))
        for option in (["--fps", "50"], ["--frame-period", "0.02"], []):
            self.assertIn("no banding", run("stats", even, *option).stdout)
            result = run("stats", banded, *option)
            self.assertIn("time stamps show banding", result.stdout)
            self.assertIn("(50 Hz)", result.stdout)
        both = run("stats", even, banded, "--fps", "50")
        self.assertEqual(both.returncode, 0, both.stderr)
        self.assertRegex(both.stdout, r"verdict +no banding.*banding at the frame times")
        self.assertEqual([f["time_stamps"]["banding"] for f in json.loads(run("stats", even, banded, "--fps", "50", "--json").stdout)],
                         ["none", "strong"])

    def test_figures(self):
        events = self.write("a.txt", stream())
        self.assertIn("--plot", run("stats", events).stderr)
        self.assertEqual(list(self.folder.glob("*.png")), [])
        for option, name in ((["--plot"], "a.stats.png"), (["--out", self.folder / "figure.png"], "figure.png")):
            figure = self.folder / name
            self.assertEqual(run("stats", events, *option).returncode, 0)
            head = figure.read_bytes()[:24]
            self.assertEqual(head[:8], b"\x89PNG\r\n\x1a\n")
            self.assertEqual(struct.unpack(">II", head[16:24])[0], 1920)
            figure.write_text("precious")
            self.assert_refused(run("stats", events, *option), name, "--force")
            self.assertEqual(figure.read_text(), "precious")
            self.assertEqual(run("stats", events, *option, "--force").returncode, 0)
            self.assertEqual(figure.read_bytes()[:24], head)
        self.assert_refused(run("stats", events, events, "--plot"), "one file")
        self.assert_refused(run("stats", events, "--out", self.folder / "none" / "a.png"), "cannot write")
        self.assert_refused(run("stats", events, "--out", self.folder), "--force")

    def test_bad_input(self):
        events = self.write("a.txt", stream())
        self.assert_refused(run("stats"), "file is required")
        self.assert_refused(run("stats", self.folder / "none"), "no such file")
        self.assert_refused(run("stats", self.folder), "no events.h5")
        self.assert_refused(run("stats", self.write("b.txt", "0.1 1 2 1\n0.2 1 2\n")), "b.txt, line 2")
        self.assert_refused(run("stats", self.write("c.txt", "0.2 1 2 1\n0.1 1 2 0\n")), "line 2", "before")
        self.assert_refused(run("stats", self.write("d.h5", "\x89HDF")), "d.h5")
        self.assert_refused(run("stats", self.write("e.txt", "0.2 65535 65535 1\n")), "too large")
        self.assert_refused(run("stats", events, "--width", "20", "--height", "20"), "outside the sensor of 20 x 20 px")
        self.assert_refused(run("stats", events, "--width", "20"), "--height")
        self.assert_refused(run("stats", events, "--fps", "0"), "--fps")
        self.assert_refused(run("stats", events, "--fps", "30", "--frame-period", "0.1"), "--f")
        for camera in ("left", "right"):
            (self.folder / "rig" / camera).mkdir(parents=True)
            shutil.copy(events, self.folder / "rig" / camera / "events.txt")
        self.assert_refused(run("stats", self.folder / "rig"), "left, right")
        self.assertEqual(run("stats", self.folder / "rig" / "left").returncode, 0)

    def test_help(self):
        self.assertIn("Examples", run("stats", "--help").stdout)
        self.assertIn("esim stats", run("--help").stdout)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
