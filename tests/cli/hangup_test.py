"""A lost connection: SIGHUP, a terminal that is gone, a pipe without a reader. Everything ends in order, as with SIGTERM.

Run as: hangup_test.py ESIM_PROGRAM SCENES_FOLDER, with the standard library of Python alone.
"""

import os
import pathlib
import pty
import signal
import subprocess
import sys
import time
import unittest

from program import ESIM, ProgramTest, run
from studio_server import Server

SCENES = pathlib.Path(sys.argv[2]).absolute()
EVENTFUL = ["--set", "camera.width=64", "--set", "camera.height=48", "--set", "sampling={type: uniform, rate_hz: 1000}",
            "--set", "event_camera={contrast_threshold: 0.02, refractory_period_us: 0}", "--set", "truth.rate_hz=0"]
INTERRUPTED = 130


def stream(count):
    """Lines `t x y p`."""
    return "".join(f"{1e-5 * i:.6f} {i % 60} {i // 7 % 40} {i % 2}\n" for i in range(count))


class Hangup(ProgramTest):
    def endless(self, out):
        return ["simulate", SCENES / "poster.yaml", "--out", out, *EVENTFUL, "--set", "duration_s=5000"]

    def start(self, *arguments, **options):
        options = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True, **options}
        return subprocess.Popen([ESIM, *map(str, arguments)], **options)

    def wait_for(self, process, path, size=1):
        deadline = time.monotonic() + 60
        while not (path.exists() and path.stat().st_size >= size):
            self.assertIsNone(process.poll(), "ended early")
            self.assertLess(time.monotonic(), deadline, f"{path} does not grow")
            time.sleep(0.01)

    def hang_up(self, process, path, size=1):
        self.wait_for(process, path, size)
        process.send_signal(signal.SIGHUP)
        _, message = process.communicate(timeout=60)
        self.assertEqual(process.returncode, INTERRUPTED, message)
        self.assertNotIn("internal error", message)
        return message

    def assert_interrupted(self, out):
        result = run("info", out)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("interrupted", result.stdout)
        self.assertFalse(pathlib.Path(f"{out}.incomplete").exists())

    def test_simulate(self):
        self.hang_up(self.start(*self.endless(self.out)), self.folder / "out.incomplete" / "cam0" / "events.h5", 200_000)
        self.assert_interrupted(self.out)

    def test_video(self):
        images = self.folder / "images"
        images.mkdir()
        for i in range(8):
            rows = bytes((x * 7 + y * 5 + i * 40) % 256 for y in range(48) for x in range(64))
            (images / f"{i}.pgm").write_bytes(b"P5 64 48 255\n" + rows)
        (images / "images.csv").write_text("\n".join(f"{5_000_000 * i}, {i % 8}.pgm" for i in range(200_000)))
        self.hang_up(self.start("video", images, "--out", self.out), self.folder / "out.incomplete" / "cam0" / "events.h5", 100_000)
        self.assert_interrupted(self.out)

    def test_convert_and_play(self):
        events = self.folder / "events.txt"
        events.write_text(stream(2_000_000))
        copy, video = self.folder / "copy.h5", self.folder / "a.mp4"
        message = self.hang_up(self.start("convert", events, copy), self.folder / "copy.h5.incomplete", 50_000)
        self.assertIn("interrupted", message)
        self.assertIn("interrupted", run("info", copy).stdout)
        small = self.folder / "small.txt"
        small.write_text(stream(20_000))
        self.hang_up(self.start("play", small, "--out", video, "--slow-motion", "1000"), self.folder / "a.mp4.incomplete")
        self.assertIn(b"moov", video.read_bytes(), "a finished video")

    def test_dataset(self):
        self.hang_up(self.start("dataset", "affine", "--out", self.out, "--count", "4000", "--width", "48", "--height", "32", "--shard-size", "2"),
                     self.out / "shard-000001.json")
        self.assertEqual([p.name for p in self.out.iterdir() if p.name.endswith(".tmp")], [])

    def test_evaluate(self):
        process = self.start("evaluate", "sampling", SCENES / "poster.yaml", "--out", self.out, "--set", "duration_s=3")
        self.hang_up(process, self.folder / "out.incomplete" / "report.json")
        self.assertEqual([p.name for p in self.folder.iterdir()], [])

    def test_studio_ends_the_runs_that_it_has_begun(self):
        scenario = self.folder / "endless.yaml"
        scenario.write_text((SCENES / "poster.yaml").read_text().replace("poster/poster.jpg", str(SCENES / "poster" / "poster.jpg")).replace("duration_s: 3", "duration_s: 5000"))
        server = Server(self.folder, self.folder, "--root", SCENES)
        name = f"{self.folder.name}/endless.yaml"
        answer = server.request("POST", "/api/runs", {"path": name, "out": f"{self.folder.name}/out"})
        self.assertEqual(answer[0], 200, answer)
        self.wait_for(server.process, self.folder / "out.incomplete" / "cam0" / "events.h5", 100_000)
        status, log = server.stop(signal.SIGHUP)
        self.assertEqual(status, 0, log)
        self.assert_interrupted(self.out)

    def test_nohup_goes_on(self):
        process = self.start("simulate", SCENES / "poster.yaml", "--out", self.out, *EVENTFUL, "--set", "duration_s=3",
                             preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
        self.wait_for(process, self.folder / "out.incomplete" / "cam0" / "events.h5")
        process.send_signal(signal.SIGHUP)
        _, message = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 0, message)
        self.assertIn("complete", run("info", self.out).stdout)

    def test_a_terminal_that_is_gone(self):
        """Its progress bar cannot be drawn any more, and SIGHUP comes."""
        child, terminal = pty.fork()
        if child == 0:
            os.execv(ESIM, [ESIM, *map(str, self.endless(self.out))])
        events = self.folder / "out.incomplete" / "cam0" / "events.h5"
        deadline = time.monotonic() + 60
        os.set_blocking(terminal, False)
        while not (events.exists() and events.stat().st_size > 200_000):
            self.assertLess(time.monotonic(), deadline)
            try:
                os.read(terminal, 65536)
            except BlockingIOError:
                time.sleep(0.01)
        os.close(terminal)
        _, status = os.waitpid(child, 0)
        self.assertEqual(os.waitstatus_to_exitcode(status), INTERRUPTED)
        self.assert_interrupted(self.out)

    def test_output_without_a_reader(self):
        """Warnings and the summary go nowhere; the recording is whole."""
        reading, writing = os.pipe()
        process = self.start("simulate", SCENES / "poster.yaml", "--out", self.out, *EVENTFUL, "--set", "duration_s=0.3", stderr=writing)
        os.close(writing)
        os.close(reading)
        self.assertEqual(process.wait(60), 0)
        self.assertIn("complete", run("info", self.out).stdout)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
