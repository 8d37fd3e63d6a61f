"""Scenarios with Gaussian splats, from a model and its reconstruction to events.

Run as: splats_test.py ESIM_PROGRAM, with the standard library of Python alone.
"""

import json
import math
import random
import struct
import sys
import unittest

from program import ProgramTest, run

PROPERTIES = "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3".split()
CUBE = """v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1
f 1 2 3 4\nf 5 8 7 6\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n"""


def ply(splats, comment=None):
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(splats)}"]
    header[2:2] = [f"comment {comment}"] if comment else []
    header += [f"property float {name}" for name in PROPERTIES] + ["end_header"]
    return "\n".join(header).encode() + b"\n" + b"".join(struct.pack("<14f", *splat) for splat in splats)


def wall(size=4.0, rows=40):
    """Discs of random colours on the plane z = 3, with COLMAP's axes: y points downwards."""
    draw = random.Random(1)
    step = size / rows
    return [(x * step - size / 2, y * step - size / 2, 3.0, *[draw.uniform(-1.7, 1.7)] * 3, 4.0,
             math.log(0.6 * step), math.log(0.6 * step), -12.0, 1, 0, 0, 0) for x in range(rows) for y in range(rows)]


class Splats(ProgramTest):
    def setUp(self):
        super().setUp()
        (self.folder / "lab.ply").write_bytes(ply(wall()))
        (self.folder / "cube.obj").write_text(CUBE)
        model = self.folder / "sparse/0"
        model.mkdir(parents=True)
        (model / "cameras.txt").write_text("1 PINHOLE 120 90 100 100 60 45\n")
        # The camera moves to the right, along x, by 0.5 m/s.
        images = "".join(f"{i + 1} 1 0 0 0 {-0.01 * i} 0 0 1 frame{i}.png\n\n" for i in range(20))
        (model / "images.txt").write_text(images)
        self.text = """
renderer: {type: splats, scene: lab.ply, up: [0, -1, 0], scale: 2%s}
trajectory: {type: file, path: sparse/0, rate_hz: 50, up: [0, -1, 0], scale: 2}
camera: {calibration: sparse/0}
duration_s: 0.1
truth: {rate_hz: 20, objects: true}
"""

    def scenario(self, more="", old="", new=""):
        """The scenario with more options of the renderer, or with `new` instead of `old`."""
        text = (self.text % more).replace(old, new) if old else self.text % more
        path = self.folder / "lab.yaml"
        path.write_text(text)
        return path

    def simulate(self, scenario, *arguments):
        result = run("simulate", scenario, "--out", self.out, "--force", *arguments)
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads((self.out / "report.json").read_text()), result

    def test_a_model_flies_the_path_of_its_reconstruction(self):
        report, result = self.simulate(self.scenario())
        self.assertIn("1600 splats of degree 0", result.stdout + result.stderr)
        camera = report["cameras"][0]
        self.assertEqual(camera["renderer"], "splats")
        self.assertEqual((camera["width"], camera["height"]), (120, 90))
        self.assertGreater(camera["events"], 1000)
        poses = [line.split() for line in (self.out / "poses.txt").read_text().splitlines() if not line.startswith("#")]
        self.assertAlmostEqual(float(poses[-1][1]) - float(poses[0][1]), 0.1, delta=0.002)  # 1 m/s in the world

    def test_keyframes_see_the_same(self):
        adaptive = self.simulate(self.scenario())[0]["cameras"][0]["events"]
        keyframes = self.simulate(self.scenario(), "--set", "sampling={type: keyframes}")[0]["cameras"][0]["events"]
        self.assertAlmostEqual(keyframes / adaptive, 1, delta=0.03)

    def test_meshes_and_splats_are_objects(self):
        objects = """, objects: [
  {name: cube, scene: cube.obj, scale: 0.3, trajectory: {type: static, pose: {position: [0.5, 4, 0]}}},
  {name: picture, scene: lab.ply, scale: 0.1, trajectory: {type: static, pose: {position: [-0.5, 3, 0], quaternion: [-0.7071, 0, 0, 0.7071]}}}]"""
        report, _ = self.simulate(self.scenario(objects))
        self.assertEqual((self.out / "objects").is_dir(), True)
        self.assertGreater(report["cameras"][0]["events"], 1000)

    def test_events_do_not_depend_on_threads(self):
        sums = []
        for threads in (1, 2):
            self.simulate(self.scenario(), "--threads", threads)
            sums.append((self.out / "cam0/events.h5").read_bytes())
        self.assertEqual(*sums)

    def test_what_cannot_be_rendered_is_refused(self):
        def refused(scenario, *parts):
            self.assert_refused(run("check", scenario), *parts)

        refused(self.scenario(old="lab.ply", new="none.ply"), "none.ply", "no such file")
        refused(self.scenario(old="up: [0, -1, 0]", new="up: [0, 0, 0]"), "up")
        (self.folder / "damaged.ply").write_bytes(ply(wall())[:-7])
        refused(self.scenario(old="lab.ply", new="damaged.ply"), "damaged.ply")
        (self.folder / "linear.ply").write_bytes(ply(wall(), "esim_light linear"))
        both = self.scenario(", objects: [{scene: linear.ply, trajectory: {type: static}}]")
        refused(both, "renderer.light", "linear")
        refused(self.scenario(", engine: gl, objects: [{scene: cube.obj, trajectory: {type: static}}]"), "processor")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]])
