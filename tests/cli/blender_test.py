"""The renderer `blender`: starts Blender, simulates with what it renders, and ends it.

Run as: blender_test.py ESIM_PROGRAM FOLDER_OF_SCRIPTS, with the standard library of Python alone. What needs Blender skips without it.
"""

import json
import os
import pathlib
import signal
import subprocess
import sys
import time
import unittest

from blender_server import BLENDER, Serving, make_scene
from program import ESIM, ProgramTest, run

SCRIPTS = pathlib.Path(sys.argv[2])

# The box crosses the image while the camera stands still.
BOX = "0.0 2.2 1.0 0 0 0 0 1\n0.1 2.2 0.0 0 0 0 0 1\n0.2 2.2 -1.0 0 0 0 0 1\n"
FORWARD = "{position: [0, 0, 0], quaternion: [-0.5, 0.5, -0.5, 0.5]}"  # the camera looks along x, z is up


def running_blenders():
    """Process ids of servers that esim has started."""
    found = set()
    for entry in pathlib.Path("/proc").iterdir():
        try:
            if b"/proc/self/fd/" in (command := (entry / "cmdline").read_bytes()) and b"--port" in command:
                found.add(entry.name)
        except OSError:
            pass
    return found


def leftovers(folder):
    """What esim and Blender have put where files are kept for a while, and not removed."""
    return [*folder.iterdir(), *pathlib.Path("/dev/shm").glob(".esim_*")]


class Blender(ProgramTest):
    def setUp(self):
        super().setUp()
        os.environ["XDG_CACHE_HOME"] = str(self.folder / "cache")

    def scenario(self, scene, more=""):
        (self.folder / "box.txt").write_text("# t x y z qx qy qz qw\n" + BOX)
        path = self.folder / "scenario.yaml"
        path.write_text(f"renderer: {{type: blender, scene: {scene}, samples: 4{more},\n"
                        f"  objects: [{{name: Box, trajectory: {{type: file, path: box.txt}}}}]}}\n"
                        f"trajectory: {{type: static, pose: {FORWARD}}}\nduration_s: 0.2\n"
                        "camera: {width: 32, height: 24, horizontal_fov_deg: 90}\noutput: {preview: false}\n"
                        "sampling: {type: keyframes, supersampling: 2, max_displacement_px: 16}\ntruth: {rate_hz: 10}\n")
        return path

    def events(self, out):
        return (out / "cam0" / "events.h5").read_bytes()

    def test_without_blender_the_error_says_how_to_get_it(self):
        blend = self.folder / "a.blend"
        blend.write_bytes(b"BLENDER")
        for command in (("check", self.scenario(blend)), ("simulate", self.scenario(blend), "--out", self.out)):
            self.assert_refused(run(*command, env={**os.environ, "ESIM_BLENDER": "/nowhere/blender"}), "apt install blender")

    def test_an_address_without_a_server_is_named(self):
        for address, part in (("127.0.0.1:1", "127.0.0.1:1"), ("somewhere", "HOST:PORT"), ("x:70000", "HOST:PORT"), (":9", "HOST:PORT")):
            scenario = self.scenario("none.blend", f", address: '{address}', timeout_s: 2")
            self.assert_refused(run("check", scenario), part)

    @unittest.skipUnless(BLENDER, "there is no blender; apt install blender")
    def test_simulates_a_moving_object_the_same_each_time_and_ends_blender(self):
        scenario = self.scenario(make_scene(self.folder, "bright"))
        before = running_blenders()
        result = run("simulate", scenario, "--out", self.out)
        self.assertEqual(result.returncode, 0, result.stderr)
        report = json.loads((self.out / "report.json").read_text())["cameras"][0]
        self.assertIn("blender", report["renderer"])
        self.assertGreater(report["events_on"], 20)
        self.assertGreater(report["events_off"], 20)
        # The box of light 2 passes before a wall of 0.1, as seen at the middle: never more than ln 20 / 0.25 per pixel and edge.
        self.assertLess(report["events"], 32 * 24 * 13)
        self.assertEqual(running_blenders(), before)
        # The same from the cache, and without it.
        for out, arguments in (("cached", ()), ("rendered", ("--no-cache",))):
            result = run("simulate", scenario, "--out", self.folder / out, *arguments)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual(self.events(self.folder / out), self.events(self.out))
        self.assertEqual(json.loads((self.folder / "cached" / "report.json").read_text())["engine_images"]["rendered"], 0)
        # The same with a server that runs already.
        server = Serving(SCRIPTS, self.folder / "bright.blend", "--samples", "4")
        self.addCleanup(server.end)
        again = self.folder / "again"
        result = run("simulate", self.scenario("none.blend", f", address: '127.0.0.1:{server.port}'"), "--out", again)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(json.loads((again / "report.json").read_text())["cameras"][0]["events"], report["events"])

    @unittest.skipUnless(BLENDER, "there is no blender; apt install blender")
    def test_what_blender_says_is_the_reason(self):
        broken = self.folder / "broken.blend"
        broken.write_text("no scene at all")
        self.assert_refused(run("simulate", self.scenario(broken), "--out", self.out), "broken.blend", "Blender failed")
        self.assert_refused(run("check", self.scenario("missing.blend")), "missing.blend", "no such file")
        dark = make_scene(self.folder, "dark")
        result = run("check", self.scenario(dark))
        self.assertIn("no light", result.stderr)
        self.assert_refused(run("simulate", self.scenario(dark), "--out", self.out), "object Box does not exist", "Cube")

    @unittest.skipUnless(BLENDER, "there is no blender; apt install blender")
    def test_follows_the_camera_of_the_scene(self):
        scenario = self.folder / "filmed.yaml"
        scenario.write_text(f"renderer: {{type: blender, scene: {make_scene(self.folder, 'filmed')}, samples: 1}}\n"
                            "trajectory: {type: scene}\nduration_s: 0.2\nstart_s: 0.4\ncamera: {width: 32, height: 24}\n"
                            "output: {preview: false}\ntruth: {rate_hz: 0, pose_rate_hz: 10}\nsampling: {type: uniform, rate_hz: 20}\n")
        environment = {**os.environ, "XDG_CACHE_HOME": str(self.folder / "cache")}
        result = run("simulate", scenario, "--out", self.out, env=environment)
        self.assertEqual(result.returncode, 0, result.stderr)
        poses = [[float(part) for part in line.split()] for line in (self.out / "poses.txt").read_text().splitlines() if line[0] != "#"]
        self.assertGreater(len(poses), 2)
        start = 1 / 24  # of the first frame, by Blender's count
        for t, x, y, z, *_ in poses:
            self.assertAlmostEqual(x, 0, 4)
            self.assertAlmostEqual(y, 0.5 * (t - start), 2)
            self.assertAlmostEqual(z, 0, 4)
        self.assertRegex((self.out / "calibration" / "camchain.yaml").read_text(), r"intrinsics: \[(16\.0000|15\.9999)")  # 90 degrees
        scenario.write_text(scenario.read_text().replace("filmed.blend", "bright.blend"))
        make_scene(self.folder, "bright")
        self.out = self.folder / "out_of_no_camera"
        result = run("check", scenario, env=environment)
        self.assertEqual(result.returncode, 2)
        self.assertIn("bright.blend has no camera", result.stderr)

    @unittest.skipUnless(BLENDER, "there is no blender; apt install blender")
    def test_eevee_without_opengl_says_what_to_install(self):
        scenario = self.scenario(make_scene(self.folder, "bright"), ", engine: eevee")
        result = run("simulate", scenario, "--out", self.out,
                     env={**os.environ, "__EGL_VENDOR_LIBRARY_FILENAMES": "/nowhere.json", "DISPLAY": "", "WAYLAND_DISPLAY": ""})
        self.assert_refused(result, "libegl1", "engine: cycles")

    @unittest.skipUnless(BLENDER, "there is no blender; apt install blender")
    def test_blender_ends_with_esim_and_its_end_is_reported(self):
        blend, before, temporary = make_scene(self.folder, "bright"), running_blenders(), self.folder / "temporary"
        temporary.mkdir()
        left_before = leftovers(temporary)
        for victim in ("esim", "blender"):
            out = self.folder / victim
            process = subprocess.Popen([ESIM, "simulate", self.scenario(blend), "--out", out, "--set", "sampling={type: uniform, rate_hz: 2000}"],
                                       stderr=subprocess.PIPE, text=True, env={**os.environ, "TMPDIR": str(temporary)})
            deadline = time.monotonic() + 60
            while not (out / "cam0" / "images").exists() and not list(self.folder.glob(f"{victim}*/cam0")) and time.monotonic() < deadline:
                time.sleep(0.05)
            started = running_blenders() - before
            self.assertTrue(started)
            if victim == "esim":
                process.kill()
            else:
                for number in started:
                    os.kill(int(number), signal.SIGKILL)
            _, error = process.communicate(timeout=60)
            deadline = time.monotonic() + 20
            while running_blenders() - before and time.monotonic() < deadline:
                time.sleep(0.05)
            self.assertEqual(running_blenders(), before)
            self.assertEqual(leftovers(temporary), left_before)
            if victim == "blender":
                self.assertEqual(process.returncode, 2, error)
                self.assertIn("Blender failed", error)
                self.assertIn("marked incomplete", error)
                report = json.loads((out / "report.json").read_text())
                self.assertEqual(report["status"], "interrupted")
                self.assertIn("Blender failed", report["reason"])
                info = run("info", out)
                self.assertEqual(info.returncode, 0, info.stderr)
                self.assertIn("interrupted", info.stdout)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
