"""`esim video` as its users meet it: exit codes, messages, and what is left on disk.

Run as: video_test.py ESIM_PROGRAM, with the standard library of Python alone.
"""

import json
import math
import pathlib
import signal
import subprocess
import sys
import time
import unittest

from program import ESIM, ProgramTest, run

WIDTH, HEIGHT = 64, 48


def write_frame(path, shift, width=WIDTH):
    """A smooth pattern, moved to the right, as a grey image."""
    rows = bytearray()
    for y in range(HEIGHT):
        rows += bytes(int(127 + 60 * math.sin((x - shift) / 3) + 60 * math.sin(y / 4)) for x in range(width))
    path.write_bytes(b"P5 %d %d 255\n" % (width, HEIGHT) + bytes(rows))


class Video(ProgramTest):
    def setUp(self):
        super().setUp()
        self.images = self.folder / "images"
        self.images.mkdir()
        for i in range(6):
            write_frame(self.images / f"{i}.pgm", 2.5 * i)

    def video(self, *arguments, source=None, out=None):
        return run("video", source or self.images, "--out", out or self.out, *arguments)

    def test_a_recording_holds_what_the_manual_says(self):
        result = self.video("--fps", "50", "--seed", "7", "--set", "event_camera.contrast_threshold=0.2")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual({p.name for p in self.out.iterdir()}, {"cam0", "report.json", "video.yaml"})
        self.assertEqual({p.name for p in (self.out / "cam0").iterdir()}, {"events.h5", "preview.mp4", "preview.png"})
        report = json.loads((self.out / "report.json").read_text())
        self.assertEqual((report["status"], report["frames"], report["seed"]), ("complete", 6, 7))
        self.assertAlmostEqual(report["simulated_s"], 0.1)
        self.assertGreater(report["steps"], 5 * 5)
        self.assertIn("contrast_threshold: 0.2", (self.out / "video.yaml").read_text())
        self.assertIn(f"{WIDTH} x {HEIGHT}", run("info", self.out).stdout)
        self.assertFalse(any("\r" in line for line in result.stderr.splitlines()), "a progress bar off a terminal")

        before = (self.out / "report.json").read_text()
        self.assertIn("--force", self.video("--fps", "50").stderr)
        self.assertEqual((self.out / "report.json").read_text(), before)
        self.assertEqual(self.video("--fps", "50", "--force", "--quiet").stderr, "")

        # The preview is itself a video.
        result = self.video("--no-interpolation", source=self.out / "cam0" / "preview.mp4", out=self.folder / "again")
        self.assertEqual(result.returncode, 0, result.stderr)

    def test_says_that_events_bunch_at_the_frames(self):
        for i in range(30):
            write_frame(self.images / f"{i}.pgm", 2.5 * i)
        result = self.video("--fps", "50", "--no-interpolation")
        self.assertRegex(result.stderr, r"events bunch at the frames: .* \d+ % rms; without --no-interpolation")
        report = json.loads((self.out / "report.json").read_text())
        self.assertGreater(report["modulation_between_frames_rms"], 0.1)
        self.assertTrue(any("bunch" in notice for notice in report["notices"]))
        # `esim stats` says the same.
        stats = json.loads(run("stats", self.out, "--fps", "50", "--json").stdout)
        self.assertAlmostEqual(stats["time_stamps"]["modulation_rms"], report["modulation_between_frames_rms"], delta=0.05)
        self.assertNotIn("bunch", self.video("--fps", "50", "--set", "contrast_threshold=0.1", "--set", "low_pass_hz=50", "--force").stderr)
        self.video("--fps", "50", "--duration", "0.05", "--force")
        self.assertIsNone(json.loads((self.out / "report.json").read_text())["modulation_between_frames_rms"], "too short to tell")

    def test_one_file_of_events(self):
        for name in ("out.h5", "out.txt"):
            out = self.folder / name
            self.assertEqual(self.video("--fps", "50", out=out).returncode, 0)
            self.assertIn("ON", run("info", out).stdout)
            self.assertRegex(self.video("--fps", "50", out=out).stderr, "exists already: .*pass --force to replace it")
            self.assertEqual(self.video("--fps", "50", "--force", out=out).returncode, 0)
            self.assertFalse((self.folder / (name + ".incomplete")).exists())

    def test_the_same_bytes_with_any_number_of_threads(self):
        contents = []
        for threads in (1, 2, 5):
            out = self.folder / f"{threads}.h5"
            self.video("--fps", "50", "-j", threads, "--set", "threshold_noise=0.05", out=out)
            contents.append(out.read_bytes())
        self.assertEqual(contents[0], contents[1])
        self.assertEqual(contents[0], contents[2])

    def test_bad_input_leaves_nothing(self):
        self.assert_refused(self.video(), "frames per second (fps)")
        self.assert_refused(self.video(source=self.folder / "none.mp4"), "none.mp4", "no such file")
        self.assert_refused(self.video("--fps", "0"), "--fps", "above 0")
        self.assert_refused(self.video("--fps", "nan"), "--fps")
        self.assert_refused(self.video("--fps", "50", "--start", "9"), "the start, 9 s,")
        self.assert_refused(self.video("--fps", "50", "--encoding", "gamma"), "--encoding")
        self.assert_refused(self.video("--fps", "50", "--set", "contrast_treshold=1"), "did you mean contrast_threshold")
        self.assert_refused(self.video("--fps", "50", "--duration", "0.001"), "one frame")
        self.assert_refused(self.video("--fps", "50", out=self.folder / "none" / "out.h5"), "create it")
        (self.images / "images.csv").write_text("0, 0.pgm\n20000000, gone.pgm\n")
        self.assert_refused(self.video(), "gone.pgm", "missing")

    def test_a_bad_frame_keeps_what_came_before(self):
        write_frame(self.images / "4.pgm", 0, width=WIDTH - 1)
        for out in (self.out, self.folder / "out.h5"):
            result = self.video("--fps", "50", out=out)
            self.assertEqual(result.returncode, 2)
            self.assertIn("frame 4 (4.pgm): is 63 x 48 px", result.stderr)
            self.assertIn("the 4 frames before this error are kept", result.stderr)
            self.assertIn("interrupted", run("info", out).stdout)
        report = json.loads((self.out / "report.json").read_text())
        self.assertEqual(report["frames"], 4)
        self.assertIn("4.pgm", report["reason"])

    def test_motion_that_is_too_fast_is_a_warning(self):
        result = self.video("--fps", "50", "--max-steps", "2")
        self.assertEqual(result.returncode, 0)
        self.assertIn("warning: between 5 of 5 pairs of frames", result.stderr)
        self.assertIn("--max-steps", json.loads((self.out / "report.json").read_text())["notices"][0])

    def test_an_interrupt_finishes_the_files_and_marks_them_incomplete(self):
        lines = [f"{20_000_000 * i}, {i % 6}.pgm" for i in range(200_000)]
        (self.images / "images.csv").write_text("\n".join(lines))
        process = subprocess.Popen([ESIM, "video", self.images, "--out", self.out], stderr=subprocess.PIPE, text=True)
        events = pathlib.Path(str(self.out) + ".incomplete") / "cam0" / "events.h5"
        deadline = time.time() + 60
        while not (events.exists() and events.stat().st_size > 50_000):
            self.assertIsNone(process.poll(), "ended early")
            self.assertLess(time.time(), deadline, "wrote no events")
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        _, stderr = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 130, stderr)
        self.assertIn("interrupted", run("info", self.out).stdout)

    def test_help(self):
        text = run("video", "--help").stdout
        for part in ("Examples", "--slow-motion", "--max-steps", "--no-interpolation", "auto|srgb|linear"):
            self.assertIn(part, text)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
