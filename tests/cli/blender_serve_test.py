"""The script with which Blender speaks UnrealCV's protocol, in a room of six walls that shine each with its own light.

Run as: blender_serve_test.py FOLDER_OF_SCRIPTS, with the standard library of Python alone. Skips without Blender.
"""

import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

from blender_server import BLENDER, ENVIRONMENT, MAGIC, Client, Serving, make_scene

SCRIPTS = pathlib.Path(sys.argv[1])
SMALL = ("--size", "33x25", "--samples", "2")
# A scene that refers to an image, to an image sequence, to a tiled texture, to a volume, to a library and to a folder of a simulation.
REFERRING = """
import bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
for name, source in (("wood.png", "FILE"), ("frames/0001.png", "SEQUENCE"), ("stone.<UDIM>.png", "TILED")):
    image = bpy.data.images.new(name, 4, 4)
    image.source, image.filepath, image.use_fake_user = source, {files!r} + "/" + name, True
volume = bpy.data.volumes.new("fog")
volume.filepath, volume.use_fake_user = {files!r} + "/fog.vdb", True
with bpy.data.libraries.load({bright!r}, link=True) as (there, here):
    here.objects = ["Box"]
bpy.context.scene.collection.objects.link(here.objects[0])
bpy.ops.mesh.primitive_cube_add()
bpy.context.object.modifiers.new("smoke", "FLUID").fluid_type = "DOMAIN"
bpy.context.object.modifiers[0].domain_settings.cache_directory = {files!r} + "/smoke"
bpy.ops.wm.save_as_mainfile(filepath={files!r} + "/a.blend")
"""


@unittest.skipUnless(BLENDER, "there is no blender; apt install blender")
class Serve(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="esim_blender_test_"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        for light in ("bright", "dark"):
            make_scene(cls.folder, light)
        cls.server = Serving(SCRIPTS, cls.folder / "bright.blend", *SMALL)
        cls.addClassCleanup(cls.server.end)

    def setUp(self):
        self.client = Client(self.server.port)
        self.addCleanup(self.client.socket.close)
        self.assertTrue(self.client.receive().startswith(b"connected"))
        self.look("0 0 0 0 0 0")

    def look(self, pose):
        self.assertEqual(self.client.ask_all(["vset /camera/0/horizontal_fieldofview 90", "vrun r.setres 33x25", "vset /camera/0/pose " + pose]),
                         [b"ok"] * 3)

    def test_light_is_linear_and_each_wall_is_where_unreals_frames_put_it(self):
        # Pitch is upwards, yaw to the right, Unreal's right is Blender's -y.
        for pose, light in (("0 0 0 0 0 0", 0.1), ("0 0 0 0 180 0", 0.2), ("0 0 0 0 -90 0", 0.3), ("0 0 0 0 90 0", 0.4),
                            ("0 0 0 90 0 0", 0.5), ("0 0 0 -90 0 0", 0.6)):
            self.look(pose)
            for value in self.client.array("vget /camera/0/lit npy")[12][16]:
                self.assertAlmostEqual(value, light, 5, pose)

    def test_depth_is_of_the_plane_or_of_the_ray_in_metres(self):
        self.look("50 20 10 0 0 0")
        planar, ray = (self.client.array(f"vget /camera/0/{kind} npy") for kind in ("plane_depth", "depth"))
        for row in (0, 7, 12, 24):
            for column in (0, 5, 16):
                right, down = (column - 16) / 16.5, (row - 12) / 16.5
                self.assertAlmostEqual(planar[row][column], 3.5, 4)
                self.assertAlmostEqual(ray[row][column], 3.5 * (1 + right ** 2 + down ** 2) ** 0.5, 4)

    def test_objects_are_seen_where_they_are_also_when_the_camera_rolls(self):
        number = self.client.text("vget /objects").split().index("Box") + 1
        self.assertEqual(self.client.text("vget /object/Box/color"), f"(R={number},G=0,B=0,A=255)")

        def middle():
            mask = self.client.array("vget /camera/0/object_mask npy")
            seen = [(row, column) for row in range(25) for column in range(33) if mask[row][column] == number]
            return sum(row for row, _ in seen) / len(seen) - 12, sum(column for _, column in seen) / len(seen) - 16

        down, right = middle()
        self.assertAlmostEqual(right, 16.5 * 0.5, delta=1.0)  # 1 m right and up, its front 2 m away
        self.assertAlmostEqual(down, -16.5 * 0.5, delta=1.5)
        self.look("0 0 0 0 0 90")  # the right wing is down: what was right and up is left and up
        down, right = middle()
        self.assertAlmostEqual(right, -16.5 * 0.5, delta=1.5)
        self.assertAlmostEqual(down, -16.5 * 0.5, delta=1.0)

    def test_objects_move_with_what_hangs_on_them_and_come_back(self):
        names = self.client.text("vget /objects").split()
        self.assertIn("wall_x+", names)
        self.assertNotIn("Part", names)
        self.assertTrue(self.client.text("vset /object/Part/location 0 0 0").startswith("error"))
        where = self.client.text("vget /object/Box/location")
        for value, expected in zip(map(float, where.split()), (220, 100, 100)):
            self.assertAlmostEqual(value, expected, 3)
        before = self.client.ask("vget /camera/0/plane_depth npy")
        self.assertEqual(self.client.ask_all(["vset /object/Box/location 150 0 0", "vset /object/Box/rotation 0 0 90"]), [b"ok"] * 2)
        depth = self.client.array("vget /camera/0/plane_depth npy")
        self.assertAlmostEqual(depth[12][16], 1.3, 4)
        # The part was above, and is on the right: right wing down.
        self.assertAlmostEqual(self.client.array("vget /camera/0/object_mask npy")[12][16], names.index("Box") + 1)
        right = [column for column in range(33) if depth[12][column] < 3.99]
        self.assertGreater(max(right) - 16, 16 - min(right))
        self.client.ask_all([f"vset /object/Box/location {where}", "vset /object/Box/rotation 0 0 0"])
        self.assertEqual(self.client.ask("vget /camera/0/plane_depth npy"), before)
        # What an animation holds in place moves all the same.
        self.client.ask("vset /object/wall_x+/location 390 0 0")
        self.assertAlmostEqual(self.client.array("vget /camera/0/plane_depth npy")[24][0], 3.8, 4)
        self.client.ask("vset /object/wall_x+/location 410 0 0")

    def test_one_state_is_rendered_once_and_the_same_state_gives_the_same_bytes(self):
        def renderings():
            return int(re.search(r"(\d+) renderings", self.client.text("vget /unrealcv/status"))[1])

        images = [f"vget /camera/0/{what} npy" for what in ("lit", "depth", "object_mask")]
        self.look("10 0 0 5 0 0")
        first = self.client.ask_all(images)
        count = renderings()
        self.assertEqual(self.client.ask_all(images), first)
        self.assertEqual(renderings(), count)
        self.look("20 0 0 5 0 0")
        self.assertNotEqual(self.client.ask_all(images), first)
        self.look("10 0 0 5 0 0")
        self.assertEqual(self.client.ask_all(images), first)
        self.assertEqual(renderings(), count + 2)

    def test_settings_are_reported(self):
        self.client.ask("vset /camera/0/pose 1.5 -2.25 3 10 20 30")
        self.assertEqual(self.client.numbers("vget /camera/0/pose"), [1.5, -2.25, 3, 10, 20, 30])
        self.client.ask_all(["vset /camera/0/location 4 5 6", "vset /camera/0/rotation 7 8 9"])
        self.assertEqual(self.client.numbers("vget /camera/0/location"), [4, 5, 6])
        self.assertEqual(self.client.numbers("vget /camera/0/rotation"), [7, 8, 9])
        self.client.ask("vset /camera/0/fov 60")
        self.assertEqual(self.client.numbers("vget /camera/0/horizontal_fieldofview"), [60])
        self.client.ask("vset /camera/0/size 48 36")
        self.assertEqual(self.client.numbers("vget /camera/0/size"), [48, 36])
        self.assertIn("esim", self.client.text("vget /unrealcv/version"))
        # Also where the nose points straight up, where only yaw - roll is known.
        for pitch in (30, 90, -90):
            self.client.ask(f"vset /object/Box/rotation {pitch} 40 0")
            told = self.client.numbers("vget /object/Box/rotation")
            for value, expected in zip(told, (pitch, 40, 0)):
                self.assertAlmostEqual(value, expected, delta=0.05)
        self.client.ask("vset /object/Box/rotation 0 0 0")

    def test_luminance_is_that_of_the_light(self):
        light = self.client.array("vget /camera/0/lit npy")
        for row, colours in zip(self.client.array("vget /camera/0/luminance npy"), light):
            for value, (red, green, blue) in zip(row, colours):
                self.assertAlmostEqual(value, 0.2126 * red + 0.7152 * green + 0.0722 * blue, 5)

    def test_noise_is_another_with_another_seed(self):
        first = self.client.ask("vget /camera/0/lit npy")
        self.client.ask("vrun esim.seed 5")
        other = self.client.ask("vget /camera/0/lit npy")
        self.client.ask("vrun esim.seed 0")
        self.assertNotEqual(first, other)
        self.assertEqual(self.client.ask("vget /camera/0/lit npy"), first)

    def test_pictures_are_srgb_png(self):
        picture = self.client.ask("vget /camera/0/lit png")
        self.assertEqual(picture[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(struct.unpack(">II", picture[16:24]), (33, 25))
        self.assertEqual(self.client.ask("vget /camera/0/object_mask png")[:8], b"\x89PNG\r\n\x1a\n")

    def test_what_cannot_be_done_is_an_error_and_the_rest_goes_on(self):
        for command in ("nonsense", "", "vset /camera/0/pose 1 2 3", "vset /camera/0/pose nan 0 0 0 0 0", "vset /camera/0/fov 180",
                        "vrun r.setres 99999x99999", "vrun r.setres 0x5", "vset /object/Absent/location 0 0 0", "vget /camera/0/lit tiff",
                        "vset /object/Box/location inf 0 0", "vrun esim.samples 0x"):
            self.assertTrue(self.client.text(command).startswith("error"), command)
        self.assertEqual(self.client.text("vrun r.setres 40x30"), "ok")

    def test_what_is_not_the_protocol_ends_the_connection_and_not_the_server(self):
        for head in (struct.pack("<II", 1, 5), struct.pack("<II", MAGIC, 0), struct.pack("<II", MAGIC, 0xFFFFFFFF)):
            self.client.socket.sendall(head)
            self.assertRaises((EOFError, ConnectionResetError), self.client.receive)
            self.client = Client(self.server.port)
            self.client.receive()
            self.addCleanup(self.client.socket.close)
        # A message in pieces, and one without an id, which has no answer.
        payload = b"7:vget /camera/0/size"
        message = struct.pack("<II", MAGIC, 5) + b"hello" + struct.pack("<II", MAGIC, len(payload)) + payload
        for byte in message:
            self.client.socket.sendall(bytes([byte]))
        self.assertTrue(self.client.receive().startswith(b"7:"))

    def test_a_second_client_is_turned_away(self):
        second = Client(self.server.port)
        self.assertRaises((EOFError, ConnectionResetError), second.receive)
        second.socket.close()
        self.assertTrue(self.client.text("vget /unrealcv/status").startswith("Blender"))

    def test_a_dark_scene_is_warned_of_and_once_ends_with_the_client(self):
        server = Serving(SCRIPTS, self.folder / "dark.blend", *SMALL, "--once")
        self.assertIn("no light", server.said)
        client = Client(server.port)
        client.receive()
        client.socket.close()
        self.assertEqual(server.process.wait(timeout=20), 0)
        server.process.communicate()
        self.assertNotIn("no light", self.server.said)

    def test_eevee_shows_the_same_light_and_depth_but_no_objects(self):
        server = Serving(SCRIPTS, self.folder / "bright.blend", *SMALL, "--engine", "eevee")
        self.addCleanup(server.end)
        client = Client(server.port)
        self.addCleanup(client.socket.close)
        client.receive()
        client.ask("vset /camera/0/pose 0 0 0 0 0 0")
        self.assertAlmostEqual(client.array("vget /camera/0/luminance npy")[12][16], 0.1, 3)
        self.assertAlmostEqual(client.array("vget /camera/0/plane_depth npy")[12][16], 4.0, 3)
        self.assertIn("use --engine cycles", client.text("vget /camera/0/object_mask npy"))

    def test_a_scene_without_a_camera_is_shown_from_the_origin(self):
        server = Serving(SCRIPTS, self.folder / "bright.blend", *SMALL)
        self.addCleanup(server.end)
        client = Client(server.port)
        self.addCleanup(client.socket.close)
        client.receive()
        self.assertEqual(client.numbers("vget /camera/0/pose"), [0] * 6)
        self.assertAlmostEqual(client.array("vget /camera/0/lit npy")[12][16][0], 0.1, 5)

    def test_all_files_of_a_scene_are_listed(self):
        files = self.folder / "files"
        (files / "frames").mkdir(parents=True)
        (files / "smoke").mkdir()
        for name in ("wood.png", "frames/0001.png", "frames/0002.png", "stone.1001.png", "stone.1002.png", "fog.vdb"):
            (files / name).write_bytes(b"-")
        script = files / "make.py"
        script.write_text(REFERRING.format(bright=str(self.folder / "bright.blend"), files=str(files)))
        subprocess.run([BLENDER, "--background", "--factory-startup", "--python-exit-code", "3", "--python", script], check=True,
                       capture_output=True, env=ENVIRONMENT)
        server = Serving(SCRIPTS, None, "--scene", str(files / "a.blend"), *SMALL)
        self.addCleanup(server.end)
        listed = re.findall(r"esim warning file (.*)", server.said)
        for expected in (files / "wood.png", self.folder / "bright.blend", files / "frames", files, files / "smoke", files / "fog.vdb"):
            self.assertIn(str(expected), listed)

    def test_a_scene_that_cannot_be_opened_is_an_error(self):
        broken = self.folder / "broken.blend"
        broken.write_bytes((self.folder / "bright.blend").read_bytes()[:500])
        for scene, arguments in ((None, ()), (None, ("--scene", str(self.folder / "missing.blend"))), (None, ("--scene", str(broken)))):
            server = Serving(SCRIPTS, scene, *arguments)
            self.assertIsNone(server.port, arguments)
            _, error = server.process.communicate(timeout=20)
            self.assertNotEqual(server.process.returncode, 0)
            self.assertIn("Error", error + server.said)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
