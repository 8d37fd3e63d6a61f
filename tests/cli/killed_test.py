"""What a simulation leaves behind that is killed at any moment, and what every command then says of it.

Run as: killed_test.py ESIM_PROGRAM SCENES_FOLDER [KILLS], with the standard library of Python alone.
"""

import json
import pathlib
import random
import subprocess
import sys
import time
import unittest

from program import ESIM, ProgramTest, run
from studio_server import Server

SCENES = pathlib.Path(sys.argv[2]).absolute()
KILLS = int(sys.argv[3]) if len(sys.argv) > 3 else 10
LATEST_S = 4.0

SIZE = ["--set", "camera.width=64", "--set", "camera.height=48"]
# All the files that a recording can have, and many events.
EVERYTHING = [*SIZE, "--set", "duration_s=5000", "--set", "sampling={type: uniform, rate_hz: 1000}", "--set", "imu={rate_hz: 1000}",
              "--set", "event_camera={contrast_threshold: 0.02, refractory_period_us: 0}", "--set", "camera.frame_camera={rate_hz: 30}",
              "--set", "truth={rate_hz: 20, event_points: true, optical_flow: true}",
              "--set", "output.formats=[text, evt3, npz, aedat4, rosbag, mcap]"]


def moments(count):
    """Seconds after the start: half of them in the first tenth, where little is there yet; the same in each run."""
    numbers = random.Random(1)
    early = [LATEST_S / 10 * (i + numbers.random()) / (count // 2) for i in range(count // 2)]
    return early + [LATEST_S * numbers.random() for _ in range(count - count // 2)]


class Killed(ProgramTest):
    def kill_after(self, seconds, name):
        out = self.folder / name
        start = time.monotonic()
        process = subprocess.Popen([ESIM, "simulate", SCENES / "poster.yaml", "--out", out, "--quiet", *EVERYTHING], stderr=subprocess.PIPE)
        time.sleep(max(0.0, start + seconds - time.monotonic()))
        process.kill()
        _, said = process.communicate(timeout=60)
        self.assertEqual((process.returncode, said), (-9, b""), "ended by itself")
        self.assertFalse(out.exists())
        return pathlib.Path(str(out) + ".incomplete")

    def in_order(self, *arguments):
        """Done, or one line that says what is wrong; which of them."""
        result = run(*arguments)
        lines = [line for line in result.stderr.splitlines() if line.startswith("esim: ")]
        self.assertIn(result.returncode, (0, 2), (arguments, result.stderr))
        self.assertEqual(len(lines), 1 if result.returncode == 2 else 0, (arguments, result.stderr))
        self.assertNotIn("internal error", result.stderr)
        if lines:
            self.assertIn(arguments[1].name, lines[0], "the line says where")
        return result

    def test_whatever_a_killed_simulation_leaves_is_answered_in_order(self):
        server = Server(self.folder, self.folder)
        self.addCleanup(server.stop)
        read = 0
        for i, seconds in enumerate(moments(KILLS)):
            with self.subTest(f"killed after {seconds:.4f} s"):
                left = self.kill_after(seconds, f"out{i}")
                if not left.exists():
                    continue
                read += self.look_at(left, server)
                again = run("simulate", SCENES / "poster.yaml", "--out", self.folder / f"out{i}", "--force", "--quiet", *SIZE,
                            "--set", "duration_s=0.02")
                self.assertEqual(again.returncode, 0, again.stderr)
                self.assertFalse(left.exists())
        self.assertGreaterEqual(read, KILLS // 4, "recordings that had events already")

    def look_at(self, left, server):
        """True where events could be read."""
        info = self.in_order("info", left)
        copy = self.folder / "copy.h5"
        converted = self.in_order("convert", left, copy, "--force")
        whole = self.in_order("convert", left, self.folder / "copy.bag", "--force")
        stats = self.in_order("stats", left, "--json")
        self.in_order("play", left, "--out", self.folder / "play.mp4", "--force", "--size", "256", "--fps", "5")
        status, _, answer = server.request("POST", "/api/recordings", {"path": f"{self.folder.name}/{left.name}"})
        self.assertIn(status, (200, 400, 404, 422), answer)
        self.assertNotIn(b"internal", answer)
        if converted.returncode != 0:
            self.assertEqual(stats.returncode, 2, "nothing for one, but something for the other")
            return False
        self.assertEqual(whole.returncode, 0, whole.stderr)
        self.assertIn("killed", info.stdout)
        self.assertEqual(status, 200, answer)
        events = self.in_order("stats", copy, "--json")
        counts = [json.loads(found.stdout)["stream"]["events"] for found in (stats, events)]
        self.assertEqual(json.loads(answer)["cameras"][0]["events"], counts[0])
        self.assertEqual(*counts)
        return counts[0] > 0


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
