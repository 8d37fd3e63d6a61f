"""`esim play` as its users meet it: exit codes, messages, and what is left on disk.

Run as: play_test.py ESIM_PROGRAM SCENES_FOLDER, with the standard library of Python alone.
"""

import pathlib
import random
import signal
import struct
import subprocess
import sys
import time
import unittest

from program import ESIM, ProgramTest, run

SCENES = pathlib.Path(sys.argv[2]).absolute()
SMALL = ["--size", "200"]


def stream(number=2000, duration_s=0.2):
    source = random.Random(1)
    times = sorted(source.uniform(0, duration_s) for _ in range(number))
    return "".join(f"{t:.6f} {source.randrange(32)} {source.randrange(24)} {source.randrange(2)}\n" for t in times)


def png_size(path):
    head = path.read_bytes()[:24]
    assert head[:8] == b"\x89PNG\r\n\x1a\n", path
    return struct.unpack(">II", head[16:24])


class Play(ProgramTest):
    def write(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return path

    def names(self):
        return {p.name for p in self.folder.iterdir()}

    def test_a_recording(self):
        out = self.out
        self.assertEqual(run("simulate", SCENES / "poster.yaml", "--out", out, "--set", "camera.width=64", "--set", "camera.height=48",
                             "--set", "duration_s=0.2", "--set", "output.preview=false").returncode, 0)
        result = run("play", out, "--slow-motion", "2", "--fps", "10", "--size", "300")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stderr, r"out\.play\.mp4: 5 frames, 0\.50 s at 1/2 of real time; [\d,]+ events")
        self.assertEqual(self.names(), {"out", "out.play.mp4"})
        self.assertEqual((self.folder / "out.play.mp4").read_bytes()[4:8], b"ftyp")
        self.assertEqual({p.name for p in out.iterdir()} & {"cam0.play.mp4"}, set())

    def test_every_kind_of_file(self):
        events = self.write("a.txt", stream())
        self.assertEqual(run("play", events, "--fps", "5", "--slow-motion", "5", *SMALL).returncode, 0)
        self.assertIn("a.play.mp4", self.names())
        gif = self.folder / "a.gif"
        self.assertEqual(run("play", events, "--out", gif, "--slow-motion", "1", *SMALL).returncode, 0)
        self.assertEqual(gif.read_bytes()[:6], b"GIF89a")
        sheet = self.folder / "sheet.png"
        self.assertEqual(run("play", events, "--out", sheet, "--view", "time-surface").returncode, 0)
        self.assertGreater(png_size(sheet)[0], 1800)
        still = self.folder / "still.png"
        for view in ("events", "time-surface", "space-time", "events,space-time", "all"):
            result = run("play", events, "--out", still, "--view", view, "--at", "0.1", "--light", "--size", "500", "--force")
            self.assertEqual(result.returncode, 0, result.stderr)
        self.assertLess(abs(png_size(still)[0] - 500), 4)
        self.assertEqual([name for name in self.names() if "incomplete" in name], [])

    def test_the_same_again(self):
        events = self.write("a.txt", stream())
        bytes_of = []
        for name in ("1.mp4", "2.mp4"):
            self.assertEqual(run("play", events, "--out", self.folder / name, "--fps", "5", "--slow-motion", "5", *SMALL).returncode, 0)
            bytes_of.append((self.folder / name).read_bytes())
        self.assertEqual(bytes_of[0], bytes_of[1])

    def test_nothing_is_lost(self):
        events = self.write("a.txt", stream())
        video = self.write("a.play.mp4", "precious")
        self.assert_refused(run("play", events), "a.play.mp4", "--force")
        self.assertEqual(video.read_text(), "precious")
        self.assertEqual(run("play", events, "--fps", "2", "--force", *SMALL).returncode, 0)
        self.assertEqual(video.read_bytes()[4:8], b"ftyp")

    def test_little_input(self):
        one = self.write("one.txt", "0.5 3 2 1\n")
        result = run("play", one, *SMALL)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("1 frames", result.stderr)
        self.assertEqual(run("play", one, "--out", self.folder / "one.png").returncode, 0)
        self.assert_refused(run("play", self.write("none.txt", "")), "none.txt", "no events")
        self.assert_refused(run("play", one, "--start", "3", "--out", self.folder / "b.mp4"), "no events")
        self.assertEqual([name for name in self.names() if name.startswith(("none.play", "b."))], [])

    def test_bad_input(self):
        events = self.write("a.txt", stream())
        self.assert_refused(run("play"), "in is required")
        self.assert_refused(run("play", self.folder / "missing"), "missing")
        self.assert_refused(run("play", self.folder), "no events.h5")
        self.assert_refused(run("play", events, "--out", self.folder / "a.avi"), ".mp4, .gif, .webp or .png")
        self.assert_refused(run("play", events, "--out", self.folder / "none" / "a.mp4"), "none")
        self.assert_refused(run("play", events, "--view", "cube"), "no view cube", "space-time")
        self.assert_refused(run("play", events, "--view", "vents"), "no view vents")
        self.assert_refused(run("play", events, "--view", "depth"), "nothing to show as depth")
        self.assert_refused(run("play", events, "--at", "0.1"), "--out FILE.png")
        self.assert_refused(run("play", events, "--at", "7", "--out", self.folder / "a.png"), "--at 7")
        self.assert_refused(run("play", events, "--out", self.folder / "a.png", "--view", "events,space-time"), "one view")
        self.assert_refused(run("play", events, "--out", self.folder / "a.gif", "--fps", "60"), "50")
        self.assert_refused(run("play", self.write("d.txt", "0 1 2 1\n1600000000 1 2 1\n")), "too long", "--duration")
        self.assert_refused(run("play", events, "--camera", "left"), "no camera left")
        self.assert_refused(run("play", events, "--width", "20", "--height", "20"), "outside the sensor")
        self.assert_refused(run("play", self.write("b.txt", "0.1 1 2 1\n0.2 1 2\n")), "b.txt, line 2")
        self.assertEqual(self.names(), {"a.txt", "b.txt", "d.txt"})

    def test_interrupted(self):
        events = self.write("a.txt", stream(20000, 2))
        video = self.folder / "a.mp4"
        process = subprocess.Popen([ESIM, "play", events, "--out", video, "--slow-motion", "1000"], stderr=subprocess.PIPE, text=True)
        working = self.folder / "a.mp4.incomplete"
        for _ in range(400):
            if working.exists() and working.stat().st_size > 0:
                break
            time.sleep(0.05)
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        message = process.communicate(timeout=60)[1]
        self.assertEqual(process.returncode, 130, message)
        self.assertIn("interrupted", message)
        self.assertIn(b"moov", video.read_bytes())
        self.assertFalse(working.exists())

    def test_help(self):
        self.assertIn("Examples", run("play", "--help").stdout)
        self.assertIn("esim play", run("--help").stdout)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
