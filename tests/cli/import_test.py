"""esim import, and .blend files as scenes.

Run as: import_test.py ESIM_PROGRAM, with the standard library of Python alone. What needs Blender skips without it.
"""

import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time
import unittest

from program import ESIM, ProgramTest, run

BLENDER = shutil.which("blender")
DATA = pathlib.Path(os.environ.get("ESIM_TEST_DATA", "/nowhere"))

# A closed room seen from inside (its faces' fronts are outside), with a lamp, a moving ball and a camera.
ROOM = """
import bpy, math, sys
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
bpy.ops.mesh.primitive_cube_add(size=4)
bpy.ops.mesh.primitive_ico_sphere_add(radius=0.5, subdivisions=2)
ball = bpy.context.object
ball.name = "Ball"
ball.keyframe_insert("location", frame=1)
ball.location = (0, 1, 0)
ball.keyframe_insert("location", frame=25)
lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
lamp.data.energy = 60
lamp.location = (0, 0, 1.5)
camera = bpy.data.objects.new("Eye", bpy.data.cameras.new("Eye"))
camera.location = (-1.8, 0, 0)
camera.rotation_euler = (math.pi / 2, 0, -math.pi / 2)
for thing in (lamp, camera):
    scene.collection.objects.link(thing)
scene.frame_end = 25
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[sys.argv.index("--") + 1])
"""


class Import(ProgramTest):
    def setUp(self):
        super().setUp()
        self.environment = {**os.environ, "XDG_CACHE_HOME": str(self.folder / "cache")}

    def esim(self, *arguments, **extra):
        return run(*arguments, env={**self.environment, **extra})

    def scenario(self, scene, trajectory="{type: scene}", more=""):
        path = self.folder / "scenario.yaml"
        path.write_text(f"renderer: {{type: mesh, scene: {scene}}}\ntrajectory: {trajectory}\n"
                        f"camera: {{width: 48, height: 36}}\ntruth: {{rate_hz: 4}}\noutput: {{preview: false}}\n{more}")
        return path

    def make_room(self):
        script = self.folder / "room.py"
        script.write_text(ROOM)
        blend = self.folder / "room.blend"
        subprocess.run([BLENDER, "--background", "--factory-startup", "--python", script, "--", blend],
                       check=True, capture_output=True)
        return blend

    def names(self):
        return {path.name for path in self.folder.iterdir()} - {"cache"}  # Blender keeps things there too

    def test_without_blender_the_error_says_how_to_get_it(self):
        blend = self.folder / "a.blend"
        blend.write_bytes(b"BLENDER")
        missing = {"ESIM_BLENDER": "/nowhere/blender"}
        self.assert_refused(self.esim("import", blend, "--out", self.folder / "out.glb", **missing), "apt install blender")
        self.assert_refused(self.esim("check", self.scenario(blend), **missing), "apt install blender")

    def test_existing_files_stay(self):
        scene = self.folder / "a.obj"
        scene.write_text("v 0 0 0\n")
        target = self.folder / "a.glb"
        target.write_text("mine")
        self.assert_refused(self.esim("import", scene), "exists", "--force")
        self.assert_refused(self.esim("import", scene, "--out", self.folder / "b.obj"), "must end in .glb")
        self.assertEqual(target.read_text(), "mine")

    @unittest.skipUnless(BLENDER, "there is no blender; apt install blender")
    def test_a_blend_is_exported_once_and_again_when_it_changes(self):
        blend = self.make_room()
        scenario = self.scenario(blend)
        result = self.esim("check", scenario)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("moving 1 object: Ball", result.stdout)
        cache = self.folder / "cache" / "esim"
        self.assertEqual(sorted(path.suffix for path in cache.iterdir()), [".files", ".glb"])
        # Now it is read from the cache, which needs no Blender; not so when the file has changed.
        self.assertEqual(self.esim("check", scenario, ESIM_BLENDER="/nowhere").returncode, 0)
        blend.write_bytes(blend.read_bytes() + b"\0")
        self.assertEqual(self.esim("check", scenario, ESIM_BLENDER="/nowhere").returncode, 2)

    @unittest.skipUnless(BLENDER, "there is no blender; apt install blender")
    def test_what_blender_says_is_the_reason(self):
        blend = self.folder / "broken.blend"
        blend.write_text("no scene at all")
        self.assert_refused(self.esim("import", blend, "--out", self.folder / "out.glb"), "Blender failed", "broken.blend")
        self.assertEqual(self.names(), {"broken.blend"})

    @unittest.skipUnless(BLENDER, "there is no blender; apt install blender")
    def test_baked_light_is_seen_from_inside_a_room(self):
        blend = self.make_room()
        baked = self.folder / "room_baked.glb"
        result = self.esim("import", blend, "--bake", "--samples", 4, "--size", 64)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("2 textures; moving 1 object: Ball", result.stdout)
        self.assertIn("baking", result.stderr)
        self.assertIn(b"KHR_materials_unlit", baked.read_bytes())
        self.assertIn(b"esim_radiance_scale", baked.read_bytes())
        result = self.esim("simulate", self.scenario(baked), "--out", self.out, "--set", "duration_s=0.3")
        self.assertEqual(result.returncode, 0, result.stderr)
        # A room that were black, as the outside of its walls is, would compress to nearly nothing.
        image = min((self.out / "cam0" / "images").glob("*.png"))
        self.assertGreater(image.stat().st_size, 800)

    @unittest.skipUnless(BLENDER, "there is no blender; apt install blender")
    def test_an_interrupted_bake_leaves_nothing(self):
        blend = self.make_room()
        before = self.names()
        process = subprocess.Popen([ESIM, "import", blend, "--bake", "--samples", "60000", "--size", "1024"],
                                   stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=self.environment)
        for line in process.stderr:
            if "baking" in line:
                break
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
        self.assertEqual(process.returncode, 130)
        self.assertEqual(self.names(), before)

    @unittest.skipUnless(BLENDER and (DATA / "mesh").exists(), "there is no blender, or no test data")
    def test_the_originals_room_keeps_the_textures_that_blender_forgets(self):
        result = self.esim("check", self.scenario(DATA / "mesh/flying_room/flying_room.blend", more="duration_s: 1\n"))
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("1006 triangles, 5 materials, 5 textures", result.stdout)
        self.assertEqual(result.stderr, "")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
