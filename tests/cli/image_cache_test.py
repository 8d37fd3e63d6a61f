"""`esim simulate --cache`: the images of engines on disk, with a program that takes the part of Blender.

Run as: image_cache_test.py ESIM_PROGRAM, with the standard library of Python alone.
"""

import json
import os
import pathlib
import random
import socket
import subprocess
import sys
import threading
import time
import unittest

from program import ESIM, ProgramTest, run
from unrealcv_test import Server

# Serves images as Blender does, and writes a line for each.
FAKE = """#!{python}
import socket, sys
sys.argv.insert(1, "esim")  # the tests take the program from there
sys.path.insert(0, {tests!r})
from unrealcv_test import Server
server = Server(-1)
print("esim warning file {texture}", flush=True)
print("esim serving 127.0.0.1:%d" % server.port, flush=True)
answer = server.answer
def noted(command):
    if command.endswith("luminance npy"):
        with open({log!r}, "a") as log:
            log.write("image\\n")
        command = command.replace("luminance", "lit")
    return b"{version}" if command == "vget /unrealcv/version" else answer(command)
server.answer = noted
server.run()
"""

SCENARIO = """
renderer: {type: blender, scene: a.blend, engine: eevee}
trajectory: {type: random, rotation_amplitude_deg: [0, 5, 0]}
duration_s: 0.1
camera: {width: 32, height: 24}
sampling: {type: uniform, rate_hz: 500}
event_camera: {contrast_threshold: 0.1}
output: {preview: false}
"""


class ImageCache(ProgramTest):
    def setUp(self):
        super().setUp()
        self.blend, self.texture, self.log = (self.folder / name for name in ("a.blend", "wood.png", "log"))
        self.blend.write_bytes(b"BLENDER")
        self.texture.write_bytes(b"wood")
        self.log.touch()
        self.scenario = self.folder / "s.yaml"
        self.scenario.write_text(SCENARIO)
        self.cache = self.folder / "cache" / "esim" / "images"
        self.install("one")

    def install(self, version):
        fake = self.folder / "blender"
        fake.write_text(FAKE.format(python=sys.executable, tests=str(pathlib.Path(__file__).parent), texture=self.texture,
                                    log=str(self.log), version=version))
        fake.chmod(0o755)
        self.environment = {**os.environ, "ESIM_BLENDER": str(fake), "XDG_CACHE_HOME": str(self.folder / "cache")}

    def command(self, *arguments, out="out"):
        return ["simulate", self.scenario, "--out", self.folder / out, "--force", *arguments]

    def simulate(self, *arguments, warnings=0):
        """The events, the number of images that were rendered, and the report's entry."""
        before = len(self.log.read_text())
        result = run(*self.command(*arguments), env=self.environment)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(result.stderr.count("warning:"), warnings, result.stderr)
        report = json.loads((self.out / "report.json").read_text())
        self.assertGreater(report["cameras"][0]["events"], 50)
        rendered = (len(self.log.read_text()) - before) // len("image\n")
        return self.files(), rendered, report.get("engine_images")

    def files(self):
        return [(self.out / "cam0" / name).read_bytes() for name in ("events.h5", "truth.h5")]

    def test_the_same_bytes_without_with_an_empty_and_with_a_full_cache(self):
        plain, count, images = self.simulate("--no-cache")
        self.assertIsNone(images)
        self.assertGreater(count, 50)
        self.assertFalse(self.cache.exists())
        empty, rendered, images = self.simulate()
        self.assertEqual(empty, plain)
        self.assertLessEqual(rendered, count)
        self.assertEqual(images["rendered"], len(list(self.cache.iterdir())))
        self.assertEqual(images["cache"], str(self.cache))
        full, rendered, images = self.simulate()
        self.assertEqual(full, plain)
        self.assertEqual((rendered, images["rendered"]), (0, 0))
        self.assertGreaterEqual(images["from_cache"], count - 2)

    def test_what_determines_images_distinguishes_them(self):
        self.simulate()
        for change in (lambda: self.blend.write_bytes(b"BLENDER2"), lambda: self.texture.write_bytes(b"pine"), lambda: self.install("two")):
            change()
            self.assertGreater(self.simulate()[1], 50)
            self.assertEqual(self.simulate()[1], 0)
        for option in ("renderer.samples=3", "renderer.exposure=0.9", "renderer.noise_seed=2", "renderer.engine=cycles",
                       "camera.horizontal_fov_deg=50", "camera.width=40"):
            self.assertGreater(self.simulate("--set", option)[1], 50, option)
        for arguments in (("--set", "event_camera.contrast_threshold=0.05"), ("--set", "renderer.timeout_s=50"), ("--threads", "1")):
            self.assertEqual(self.simulate(*arguments)[1], 0, arguments)

    def test_a_named_folder_and_its_size(self):
        named = self.folder / "named"
        self.simulate("--cache", named)
        self.assertEqual(self.simulate("--cache", named)[1], 0)
        self.assertFalse(self.cache.exists())
        self.simulate("--cache", named, "--cache-size", "20kB", "--set", "renderer.samples=7")
        self.assertLessEqual(sum(file.stat().st_size for file in named.iterdir()), 20000)
        refused = run(*self.command("--cache", named, "--no-cache"), env=self.environment)
        self.assertNotEqual(refused.returncode, 0)
        self.assertIn("--no-cache", refused.stderr)

    def test_damaged_images_are_rendered_again_with_one_warning(self):
        plain, *_ = self.simulate()
        images = sorted(self.cache.iterdir())
        for i, image in enumerate(images):
            data = image.read_bytes()
            image.write_bytes(data[:len(data) // 2] if i % 2 else b"")
        again, rendered, _ = self.simulate(warnings=1)
        self.assertEqual(again, plain)
        self.assertGreaterEqual(rendered, len(images))
        self.assertEqual(self.simulate()[1], 0)

    def test_a_folder_that_cannot_be_written_is_warned_of_once(self):
        plain, *_ = self.simulate("--no-cache")
        without, rendered, images = self.simulate("--cache", self.texture / "images", warnings=1)
        self.assertEqual(without, plain)
        self.assertEqual(images["rendered"], rendered)

    def test_processes_that_share_it_and_are_killed_leave_it_right(self):
        plain, count, _ = self.simulate("--no-cache")
        numbers = random.Random(3)
        for _ in range(6):
            processes = [subprocess.Popen([ESIM, *map(str, self.command("--quiet", out=f"out{i}"))], env=self.environment,
                                          stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) for i in range(2)]
            for process in processes:
                time.sleep(0.15 + 0.25 * numbers.random())
                process.kill()
                process.wait()
        before = len(list(self.cache.glob("*.image")))
        self.assertGreater(before, 0)
        events, rendered, _ = self.simulate()
        self.assertEqual(events, plain)
        self.assertLessEqual(rendered, count - before + 2)
        self.assertEqual(self.simulate()[:2], (plain, 0))

    def test_other_programs_have_one_only_if_it_is_named(self):
        """Their scene cannot be identified."""
        server = Server(-1)
        server.answer = lambda command: Server.answer(server, command.replace("luminance", "lit"))
        threading.Thread(target=self.serve_one_after_the_other, args=(server,), daemon=True).start()
        for renderer in (f"{{type: unrealcv, port: {server.port}}}", f"{{type: blender, address: '127.0.0.1:{server.port}'}}"):
            with self.subTest(renderer):
                chosen = ("--set", "renderer=" + renderer)
                plain, _, images = self.simulate(*chosen)
                self.assertIsNone(images)
                named = ("--cache", self.folder / renderer[7:12])
                self.assertEqual(self.simulate(*chosen, *named)[0], plain)
                full, _, images = self.simulate(*chosen, *named)
                self.assertEqual(full, plain)
                self.assertEqual(images["rendered"], 0)

    @staticmethod
    def serve_one_after_the_other(server):
        listener = server.listener
        while True:
            server.listener = socket.socket(fileno=os.dup(listener.fileno()))
            server.run()

    def test_it_has_no_effect_on_the_processor(self):
        image = self.folder / "p.pgm"
        image.write_bytes(b"P5 40 40 255\n" + bytes((7 * x * y) % 256 for x in range(40) for y in range(40)))
        chosen = ("--set", "renderer={type: panorama, image: p.pgm}")
        self.assertIsNone(self.simulate(*chosen)[2])
        self.assertIsNone(self.simulate(*chosen, "--cache", self.folder / "named", warnings=1)[2])
        self.assertFalse((self.folder / "named").exists())


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
