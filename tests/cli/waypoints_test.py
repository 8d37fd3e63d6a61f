"""`esim waypoints` as its users meet it: in a terminal, and by --keys without one.

Run as: waypoints_test.py ESIM_PROGRAM SCENES_FOLDER, with the standard library of Python alone.
"""

import fcntl
import os
import pathlib
import pty
import re
import select
import signal
import struct
import subprocess
import sys
import termios
import time
import unittest

from program import ESIM, ProgramTest, run

SCENES = pathlib.Path(sys.argv[2]).absolute()
SMALL = ["--set", "camera.width=64", "--set", "camera.height=48"]


class Session:
    """The command in a pseudo-terminal."""

    def __init__(self, *arguments, rows=24, columns=80, environment=None):
        self.main, self.terminal = pty.openpty()
        fcntl.ioctl(self.terminal, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
        self.before = termios.tcgetattr(self.terminal)
        self.screen = b""
        self.process = subprocess.Popen([ESIM, "waypoints", *map(str, arguments)], stdin=self.terminal, stdout=self.terminal, stderr=subprocess.PIPE,
                                        env={**os.environ, "COLORTERM": "truecolor", **(environment or {})}, start_new_session=True)

    def wait_for(self, text, seconds=60):
        """Until the screen has shown `text`, a pattern, since the last call."""
        end = time.time() + seconds
        while not re.search(text, self.screen):
            assert time.time() < end, (text, self.screen[-500:])
            if select.select([self.main], [], [], 0.1)[0]:
                self.screen += os.read(self.main, 65536)
        seen, self.screen = self.screen, b""
        return seen

    def press(self, keys):
        os.write(self.main, keys)

    def end(self):
        """Exit status, what was printed after the terminal was restored, and standard error."""
        end = time.time() + 60
        while self.process.poll() is None:
            assert time.time() < end
            if select.select([self.main], [], [], 0.05)[0]:
                self.screen += os.read(self.main, 65536)
        while select.select([self.main], [], [], 0)[0]:
            self.screen += os.read(self.main, 65536)
        message = self.process.stderr.read().decode()
        self.process.stderr.close()
        restored = termios.tcgetattr(self.terminal) == self.before
        os.close(self.terminal)
        os.close(self.main)
        assert restored, "the terminal is not as before"
        assert b"\033[?1049l" in self.screen and b"\033[?25h" in self.screen
        return self.process.returncode, self.screen.split(b"\033[?1049l")[-1].decode(), message


class Waypoints(ProgramTest):
    def setUp(self):
        super().setUp()
        (self.folder / "scenes").symlink_to(SCENES)
        self.scenario = self.folder / "s.yaml"
        self.write_scenario("{type: plane, image: scenes/poster/poster.jpg, width_m: 1.2, pose: {position: [2, 0, 0], look_at: [3, 0, 0]}}",
                            "{position: [0, 0.1, 0]}")
        self.walk = self.folder / "walk.yaml"

    def write_scenario(self, renderer, pose):
        self.scenario.write_text(f"renderer: {renderer}\ntrajectory: {{type: static, pose: {pose}}}\n"
                                 "camera: {width: 64, height: 48}\nduration_s: 1\noutput: {preview: false}\n")

    def points(self):
        return self.walk.read_text().count("position:")

    def test_in_a_terminal(self):
        self.write_scenario("{type: mesh, scene: scenes/room/room.obj}", "{position: [1, -1, 1.4], look_at: [-1, 1, 1]}")
        session = Session(self.scenario, "--out", self.walk)
        first = session.wait_for(rb"1\.00 -1\.00 1\.40 m .* 0 waypoints")
        self.assertIn("\u2580".encode(), first)
        self.assertRegex(first, rb"\033\[38;2;\d+;\d+;\d+m")
        session.press(b" ")
        session.wait_for(rb"1 waypoint\b")
        self.assertEqual(self.points(), 1, "written at once")
        session.press(b"wwww\033[C\033[C ")
        session.wait_for(rb"2 waypoints")
        session.press(b"dddd\033[C ")
        session.wait_for(rb"3 waypoints")
        session.press(b"ww ")
        session.wait_for(rb"4 waypoints")
        session.press(b"u")
        session.wait_for(rb"3 waypoints")
        session.press(b"?")
        session.wait_for(rb"drop a waypoint")
        session.press(b"w")
        session.wait_for(rb"3 waypoints")
        session.press(b"p")
        session.wait_for(rb"walk\.1\.png")
        session.press(b"t")
        session.wait_for(rb"0\.\d of \d")
        session.press(b"w")
        session.wait_for(rb"the motion lasts")
        session.press(b"x")
        status, printed, message = session.end()
        self.assertEqual(status, 0, message)
        self.assertEqual(self.points(), 3)
        self.assertEqual((self.folder / "walk.1.png").read_bytes()[16:24], struct.pack(">II", 64, 48))
        self.assertIn("3 waypoints", message)

        # What it prints takes the place of the scenario's own lines.
        lines = printed.replace("\r", "").strip().splitlines()
        self.assertEqual(len(lines), 2, printed)
        self.assertIn("walk.yaml", lines[0])
        kept = [line for line in self.scenario.read_text().splitlines() if not line.startswith(("trajectory", "duration_s"))]
        self.scenario.write_text("\n".join(kept + lines) + "\n")
        result = run("simulate", self.scenario, "--out", self.out, "--set", "truth.rate_hz=0", "--set", "sampling={type: uniform, rate_hz: 50}")
        self.assertEqual(result.returncode, 0, result.stderr)
        poses = [list(map(float, line.split())) for line in (self.out / "poses.txt").read_text().splitlines() if line[0] != "#"]
        self.assertEqual(poses[0][1:4], [1, -1, 1.4])
        last = re.findall(r"position: \[(.*?)\]", self.walk.read_text())[-1].split(", ")
        for reached, wanted in zip(poses[-1][1:4], map(float, last)):
            self.assertAlmostEqual(reached, wanted, 3)

    def test_the_screen_follows_its_size_and_colours(self):
        session = Session(self.scenario, "--out", self.walk, environment={"COLORTERM": ""})
        first = session.wait_for(rb"0 waypoints")
        self.assertRegex(first, rb"\033\[38;5;\d+m")
        self.assertNotRegex(first, rb"\033\[38;2;")
        self.assertEqual(first.count("\u2580".encode()), 22 * 59, "as large as fits, in the camera's proportions")
        fcntl.ioctl(session.terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 12, 80, 0, 0))
        second = session.wait_for(rb"0 waypoints")
        self.assertEqual(second.count("\u2580".encode()), 10 * 27)
        session.press(b"\033")
        self.assertEqual(session.end()[0], 0)
        self.assertFalse(self.walk.exists(), "nothing dropped, nothing written")

    def test_the_terminal_is_restored_whatever_happens(self):
        for number, expected in ((signal.SIGINT, 130), (signal.SIGTERM, 130), (signal.SIGHUP, 130), (signal.SIGSEGV, -signal.SIGSEGV)):
            session = Session(self.scenario, "--out", self.walk, "--append")
            session.wait_for(rb"\d waypoint")
            session.press(b"w ")
            session.wait_for(rb"walk\.yaml")
            session.process.send_signal(number)
            self.assertEqual(session.end()[0], expected, number)
        self.assertEqual(self.points(), 4)
        session = Session(self.scenario, "--out", self.folder / "gone" / "walk.yaml")
        session.process.wait(60)  # refused before the terminal is touched
        self.assertEqual(session.process.returncode, 2)
        self.assertEqual(termios.tcgetattr(session.terminal), session.before)
        session.process.stderr.close()
        folder = self.folder / "later"
        folder.mkdir()
        session = Session(self.scenario, "--out", folder / "walk.yaml")
        session.wait_for(rb"0 waypoints")
        folder.rmdir()
        session.press(b" ")  # cannot be written
        status, _, message = session.end()
        self.assertEqual(status, 2)
        self.assertIn("cannot write", message)

    def test_by_keys(self):
        result = run("waypoints", self.scenario, "--out", self.walk, "--keys", " wwwwww <left><left>dddd p?tx www")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(self.points(), 3)
        self.assertRegex(result.stderr, r"the motion lasts \d")
        self.assertIn("drop a waypoint", result.stderr)
        self.assertRegex(result.stdout, r"\Atrajectory: {type: waypoints, file: walk.yaml}\nduration_s: \d+\.\d{3}\n\Z")
        self.assertTrue((self.folder / "walk.1.png").exists())
        # Continues from there; the image gets another name.
        self.assertEqual(run("waypoints", self.scenario, "--out", self.walk, "--append", "--keys", "w pu ").returncode, 0)
        self.assertEqual(self.points(), 4)
        self.assertTrue((self.folder / "walk.2.png").exists())
        self.assertEqual(run("waypoints", self.scenario, "--out", self.walk, "--force", "--keys", " x").returncode, 0)
        self.assertEqual(self.points(), 1)

    def test_a_body_that_is_not_the_camera(self):
        """What is written is the body's pose; the picture from there is the same."""
        mount = "camera.T_body_camera={position: [0.2, 0.1, 0], quaternion: [0.5, -0.5, 0.5, -0.5]}"
        self.assertEqual(run("waypoints", self.scenario, "--set", mount, "--out", self.walk, "--keys", "w p").returncode, 0)
        self.assertEqual(run("waypoints", self.scenario, "--set", mount, "--out", self.walk, "--append", "--keys", "wwwgp").returncode, 0)
        self.assertEqual((self.folder / "walk.1.png").read_bytes(), (self.folder / "walk.2.png").read_bytes())

    def test_other_inputs(self):
        scene = SCENES / "room" / "room.obj"
        self.assertEqual(run("waypoints", scene, "--out", self.walk, "--start", "0", "0", "1.5", "--keys", " w ").returncode, 0)
        self.assertIn("position: [0, 0, 1.5]", self.walk.read_text())
        self.scenario.write_text(self.scenario.read_text().replace("{type: static", "{type: waypoints, file: new.yaml} #"))
        new = self.folder / "new.yaml"
        self.assertEqual(run("waypoints", self.scenario, "--out", new, "--start", "0", "0", "0.1", "--keys", " w ").returncode, 0)
        result = run("check", self.scenario, "--set", "duration_s=0.1")
        self.assertEqual(result.returncode, 0, result.stderr)
        for name in ("poster", "panorama"):
            walk = self.folder / f"{name}.yaml"
            self.assertEqual(run("waypoints", SCENES / f"{name}.yaml", *SMALL, "--out", walk, "--keys", " w p").returncode, 0)

    def test_nothing_is_lost(self):
        self.walk.write_text("points:\n  - {position: [0, 0, 1], look_at: [1, 0, 1]}\n")
        self.assert_refused(run("waypoints", self.scenario, "--out", self.walk, "--keys", "x"), "walk.yaml", "--append", "--force")
        self.assertEqual(run("waypoints", self.scenario, "--out", self.walk, "--append", "--keys", "w x").returncode, 0)
        self.assertIn("look_at: [1, 0, 1]", self.walk.read_text())
        self.walk.write_text("points:\n  - {position: [0, 0, 1], look_at: [1, 0, 1], t: 1}\n")
        self.assert_refused(run("waypoints", self.scenario, "--out", self.walk, "--append", "--keys", "x"), "times")

    def test_bad_input(self):
        self.assert_refused(run("waypoints", self.scenario, "--out", self.walk, stdin=subprocess.DEVNULL), "terminal", "--keys")
        self.assert_refused(run("waypoints", self.scenario, "--out", self.walk, "--keys", "wz"), "'z' is not a key")
        self.assert_refused(run("waypoints", self.scenario, "--out", self.folder / "none" / "walk.yaml", "--keys", "x"), "does not exist")
        self.assert_refused(run("waypoints", self.folder / "none.yaml", "--out", self.walk, "--keys", "x"), "none.yaml")
        self.assert_refused(run("waypoints", self.folder / "none.glb", "--out", self.walk, "--keys", "x"), "none.glb")
        self.assert_refused(run("waypoints", SCENES / "sprites.yaml", "--out", self.walk, "--keys", "x"), "drawn on the sensor")
        self.assert_refused(run("waypoints", self.scenario, "--out", self.walk, "--keys", "t"), "at least two")
        self.assert_refused(run("waypoints", self.scenario), "--out is required")
        self.assertFalse(self.walk.exists())

    def test_help(self):
        help_text = run("waypoints", "--help").stdout
        self.assertIn("Examples", help_text)
        self.assertIn("drop a waypoint", help_text)
        self.assertIn("esim waypoints", run("--help").stdout)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
