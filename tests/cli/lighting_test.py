"""Lights of scenarios: surfaces that shine, surroundings, lights that change, and what is refused.

Run as: lighting_test.py ESIM_PROGRAM, with the standard library of Python alone.
"""

import re
import unittest

from program import ProgramTest, run

CUBE = """mtllib cube.mtl\nusemtl shiny\nv -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1
f 1 2 3 4\nf 5 8 7 6\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n"""
SCENARIO = """
renderer:
  type: mesh
  scene: cube.obj
  objects: [{name: carrier, scene: cube.obj, scale: 0.05, trajectory: {type: static, pose: {position: [0, -2, 1.5]}}}]
  lighting:
    type: pbr
    points: [{position: [0, -3, 0], strength: 4}]
trajectory: {type: static, pose: {position: [0.5, -4, 0.5], look_at: [0, 0, 0]}}
camera: {width: 64, height: 48, horizontal_fov_deg: 50}
duration_s: 0.2
"""


def radiance(width, height, value=128):
    """A Radiance HDR image of one colour."""
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n"
    return head.encode() + bytes([value, value, value, 128]) * (width * height)


class Lighting(ProgramTest):
    def setUp(self):
        super().setUp()
        (self.folder / "cube.obj").write_text(CUBE)
        (self.folder / "cube.mtl").write_text("newmtl shiny\nKd 0.6 0.6 0.6\nPr 0.4\nPm 0.5\n")
        (self.folder / "sky.hdr").write_bytes(radiance(64, 32))
        self.scenario = self.folder / "scenario.yaml"
        self.scenario.write_text(SCENARIO)

    def with_options(self, command, *options):
        return run(command, self.scenario, *(["--out", self.out] if command == "simulate" else []),
                   *(part for option in options for part in ("--set", option)))

    def events(self, *options):
        result = self.with_options("simulate", *options)
        self.assertEqual(result.returncode, 0, result.stderr)
        stats = run("stats", self.out).stdout
        found = re.search(r"events\s+([\d,]+)", stats)
        return int(found[1].replace(",", "")) if found else 0

    def test_what_cannot_be_is_refused(self):
        (self.folder / "square.hdr").write_bytes(radiance(32, 32))
        (self.folder / "cut.hdr").write_bytes(radiance(64, 32)[:500])
        lighting = "renderer.lighting."
        for option, parts in [
                ("environment={image: none.hdr}", ["none.hdr", "no such file"]),
                ("environment={image: cut.hdr}", ["cut.hdr", "cannot be decoded"]),
                ("environment={image: square.hdr}", ["square.hdr", "twice as wide as high, not 32 x 32"]),
                ("environment={}", ["environment.image", "is missing"]),
                ("environment={image: sky.hdr, strength: -1}", ["environment.strength"]),
                ("areas=[{size: [0, 1]}]", ["areas.0.size", "above 0"]),
                ("areas=[{size: [.nan, 1]}]", ["areas.0.size"]),
                ("areas=[{samples: 5}]", ["areas.0.samples", "square number, not 5; use 4"]),
                ("areas=[{direction: [0, 0, 0]}]", ["areas.0", "must not be [0, 0, 0]"]),
                ("suns=[{curve: [[1, 1], [0.5, 2]]}]", ["suns.0.curve.1", "order of time"]),
                ("suns=[{curve: [[0, -1]]}]", ["suns.0.curve.0", "from 0 to 1e6"]),
                ("suns=[{curve: [[0, .nan]]}]", ["suns.0.curve.0"]),
                ("points=[{object: lamp}]", ["points.0.object", "no moving object lamp; it has carrier"])]:
            with self.subTest(option):
                self.assert_refused(self.with_options("simulate", lighting + option), *parts)

    def test_sampling_by_motion_is_warned_of_highlights(self):
        for sampling, warned in ("adaptive", False), ("flow", True), ("keyframes", True):
            result = self.with_options("check", f"camera.sampling.type={sampling}")
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual("highlights" in result.stderr, warned, result.stderr)
        matte = self.with_options("check", "camera.sampling.type=flow", "renderer.lighting.type=lambert")
        self.assertNotIn("highlights", matte.stderr)
        changing = self.with_options("check", "camera.sampling.type=flow", "renderer.lighting.type=lambert",
                                     "renderer.lighting.suns=[{curve: [[0, 1], [1, 2]]}]")
        self.assertIn("lights that move or change", changing.stderr)

    def test_constant_light_makes_no_events(self):
        self.assertEqual(self.events(), 0)

    def test_a_light_that_brightens_makes_events(self):
        point = "{position: [0, -3, 0], strength: 4, curve: [[0.05, 1], [0.1, 3]]}"
        self.assertGreater(self.events(f"renderer.lighting.points=[{point}]", "renderer.lighting.ambient=0"), 1000)

    def test_a_lamp_moves_with_its_object(self):
        (self.folder / "path.txt").write_text("".join(f"{0.05 * i} {0.5 * i - 1} -2 1.5 0 0 0 1\n" for i in range(5)))
        options = ["renderer.objects.0.trajectory={type: file, path: path.txt}", "renderer.lighting.points.0.object=carrier",
                   "renderer.lighting.points.0.position=[0, 0, -0.2]", "renderer.lighting.ambient=0"]
        self.assertGreater(self.events(*options), 1000)

    def test_the_surroundings_are_the_background(self):
        options = ["renderer.lighting.environment={image: sky.hdr, strength: 2}", "truth.rate_hz=10"]
        self.assertEqual(self.events(*options), 0)
        self.assertEqual(self.with_options("check", *options).returncode, 0)


if __name__ == "__main__":
    unittest.main(argv=["lighting_test"], verbosity=0)
