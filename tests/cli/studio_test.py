"""`esim studio` as a browser meets it, and as what is not a browser does.

Run as: studio_test.py ESIM_PROGRAM SCENES_FOLDER, with the standard library of Python alone.
"""

import http.client
import json
import pathlib
import re
import resource
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest

from program import ESIM, ProgramTest, run
from studio_server import Server

SCENES = pathlib.Path(sys.argv[2]).absolute()
SMALL = """renderer: {type: plane, image: poster/poster.png, width_m: 2, pose: {position: [1, 0, 0], look_at: [3, 0, 0]}}
trajectory:
  type: waypoints   # back and forth
  points:
    - {position: [0, -0.1, 0], look_at: [1, 0, 0]}
    - {position: [0, 0.1, 0], look_at: [1, 0, 0]}
camera: {width: 64, height: 48}
event_camera: {contrast_threshold: 0.2}
"""


class StudioTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="esim_studio_test_"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.work = cls.folder / "work"
        (cls.work / "poster").mkdir(parents=True)
        image = next((SCENES / "poster").glob("*.[jp][pn]g"))
        cls.image = f"poster/{image.name}"
        shutil.copy(image, cls.work / "poster")
        cls.yaml = SMALL.replace("poster/poster.png", cls.image)
        (cls.work / "small.yaml").write_text(cls.yaml)
        (cls.folder / "secret.yaml").write_text("seed: 1\n")
        cls.server = Server(cls.folder, cls.work / "small.yaml")

    @classmethod
    def tearDownClass(cls):
        status, log = cls.server.stop()
        assert status == 0, (status, log)
        assert cls.server.token not in log, "the token is in the log"
        assert "HDF5" not in log, log  # as where the library cannot be closed

    def ask(self, method, target, body=None, status=200):
        return self.server.json(method, target, body, status)

    def scenario(self, **more):
        return {"yaml": self.yaml, "dir": "work", **more}


class Answers(StudioTest):
    def test_session_and_files(self):
        session = self.ask("GET", "/api/session")
        self.assertEqual(session["opened"], {"kind": "scenario", "path": "work/small.yaml"})
        self.assertEqual(session["roots"], [{"name": "work"}])
        kinds = {entry["name"]: entry["kind"] for entry in self.ask("GET", "/api/files?dir=work")["entries"]}
        self.assertEqual(kinds["small.yaml"], "scenario")
        self.assertEqual(kinds["poster"], "folder")

    def test_the_page_and_its_headers(self):
        status, headers, body = self.server.request("GET", "/")
        self.assertEqual((status, body), (200, b"<!doctype html><title>page</title>"))
        self.assertIn("default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; img", headers["Content-Security-Policy"])
        self.assertEqual(headers["X-Content-Type-Options"], "nosniff")
        self.assertEqual(self.server.request("GET", "/api/session")[1]["Cache-Control"], "no-store")

    def test_the_schema_is_that_of_the_program(self):
        members = {member["name"]: member for member in self.ask("GET", "/api/schema")["members"]}
        threshold = next(m for m in members["event_camera"]["members"] if m["name"] == "contrast_threshold")
        self.assertEqual((threshold["kind"], threshold["default"], threshold["low"]), ("number", 0.5, 0.01))
        filters = next(m for m in members["event_camera"]["members"] if m["name"] == "filters")
        self.assertNotIn("optional", filters)
        self.assertEqual({m["name"]: (m["kind"], m.get("optional")) for m in filters["members"]},
                         dict.fromkeys(["region", "activity", "anti_flicker", "trail", "rate_controller"], ("group", True)))
        region = {member["name"]: member for member in filters["members"][0]["members"]}
        self.assertEqual(region["windows"]["kind"], "list")
        self.assertEqual([m["name"] for m in region["windows"]["element"]["members"]], ["x", "y", "width", "height"])
        light = {member["name"]: member for member in members["light"]["members"]}
        self.assertEqual((light["flicker"]["kind"], light["flicker"]["optional"], light["flicker"]["default"]), ("group", True, None))
        flicker = {member["name"]: member for member in light["flicker"]["members"]}
        self.assertEqual(flicker["shape"]["choices"], ["mains", "sine", "pwm"])
        self.assertEqual((flicker["depth"]["default"], flicker["depth"]["low"], flicker["depth"]["high"]), (0.5, 0, 1))
        self.assertTrue(flicker["frequency_hz"]["positive"])
        names = [option["name"] for option in members["trajectory"]["options"]]
        self.assertEqual(names, ["file", "random", "static", "scene", "waypoints"])
        reference = run("options").stdout

        def check(member):
            if "name" in member:
                self.assertRegex(reference, rf"(?m)^ *{re.escape(member['name'])}:")
            for inner in member.get("members", []) + [m for o in member.get("options", []) for m in o["members"]]:
                check(inner)

        for member in members.values():
            check(member)
        presets = {preset["name"]: preset for preset in self.ask("GET", "/api/presets")}
        self.assertEqual(presets["davis346@1"]["values"]["contrast_threshold"], 0.2)
        self.assertNotIn("circuit", presets["davis346@1"]["values"])
        self.assertEqual(presets["davis346"]["values"], presets["davis346@2"]["values"])
        self.assertEqual(presets["davis346"]["values"]["circuit"]["photocurrent_fa_per_lux"], 33)

    def test_problems_are_reported_together_and_name_their_options(self):
        yaml = self.yaml.replace("width: 64", "width: -3").replace("contrast_threshold: 0.2", "contrast_treshold: 0.2") + "sed: 1\n"
        found = self.ask("POST", "/api/scenario/check", {"yaml": yaml, "dir": "work"})["problems"]
        problems = {problem["where"]: problem["what"] for problem in found}
        self.assertEqual(set(problems), {"camera.width", "event_camera.contrast_treshold", "sed"})
        for problem in found:
            self.assertIn(problem["where"].split(".")[-1], yaml.splitlines()[problem["line"] - 1])
        self.assertIn("did you mean contrast_threshold?", problems["event_camera.contrast_treshold"])
        self.assertEqual(self.ask("POST", "/api/scenario/check", self.scenario())["problems"], [])
        yaml = self.yaml.replace("contrast_threshold: 0.2", "contrast_threshold: 0.2, filters: {activity: {}, anti_flicker: {low_hz: 900}}")
        found = self.ask("POST", "/api/scenario/check", {"yaml": yaml, "dir": "work"})["problems"]
        self.assertEqual([problem["where"] for problem in found],
                         ["event_camera.filters.activity", "event_camera.filters.anti_flicker.low_hz"])
        for problem in found:
            self.assertIn("filters", yaml.splitlines()[problem["line"] - 1])
        yaml = self.yaml + "light: {flicker: {depth: 2, shape: square}, white_lux: 100}\n"
        found = self.ask("POST", "/api/scenario/check", {"yaml": yaml, "dir": "work"})["problems"]
        self.assertEqual({problem["where"] for problem in found}, {"light.flicker.depth", "light.flicker.shape"})
        yaml = self.yaml + "light: {flicker: {}, white_lux: 100}\n"
        self.assertEqual(self.ask("POST", "/api/scenario/check", {"yaml": yaml, "dir": "work"})["problems"], [])
        broken = self.ask("POST", "/api/scenario/check", {"yaml": "a: [", "dir": "work"})
        self.assertIn("not valid YAML", broken["problems"][0]["what"])
        self.assertEqual([problem["line"] for problem in broken["problems"]], [1])

    def test_problems_behind_problems_are_found_in_lists_and_behind_aliases(self):
        yaml = ("renderer: {type: plane, image: none.png}\ntrajectory:\n  type: waypoints\n  points:\n  - {position: [0, 0, 0], look_at: [1, 0, 0], tt: 1}\n"
                "  - {position: [0, 0, 1], look_at: [1, 0, 0], ttt: 1}\n"
                "cameras:\n- &first {name: a, width: -1, height: 24, fov: 3}\n- {name: b, width: -2, height: 24}\nsed: 1\n")
        problems = [p["where"] for p in self.ask("POST", "/api/scenario/check", {"yaml": yaml, "dir": "work"})["problems"]]
        self.assertEqual(sorted(problems), ["cameras.0.fov", "cameras.0.width", "cameras.1.width", "sed", "trajectory.points.0.tt", "trajectory.points.1.ttt"])
        shared = yaml.replace("{name: b, width: -2, height: 24}", "*first")
        problems = [p["where"] for p in self.ask("POST", "/api/scenario/check", {"yaml": shared, "dir": "work"})["problems"]]
        self.assertEqual(set(problems) & {"cameras.0.width", "cameras.0.fov", "sed"}, {"cameras.0.width", "cameras.0.fov", "sed"})

    def test_a_new_scenario_names_its_scene(self):
        for name, written in (("plain.obj", "plain.obj"), ("a: b #1.obj", '"a: b #1.obj"')):
            (self.work / name).write_text("v 0 0 0\n")
            created = self.ask("POST", "/api/scenario/new", {"scene": f"work/{name}"})
            self.assertIn(f"  scene: {written}\n", created["yaml"])
            self.assertEqual(created["values"]["renderer"]["scene"], name)
        self.assertEqual(self.ask("POST", "/api/scenario/new", {})["values"]["renderer"], {"type": "mesh", "scene": ""})

    def test_two_windows_do_not_undo_each_other(self):
        saved = self.ask("PUT", "/api/scenario", {"path": "work/two.yaml", "yaml": "seed: 1\n", "revision": None})
        self.ask("PUT", "/api/scenario", {"path": "work/two.yaml", "yaml": "seed: 9\n", "revision": None}, 409)
        other = self.ask("PUT", "/api/scenario", {"path": "work/two.yaml", "yaml": "seed: 2\n", "revision": saved["revision"]})
        conflict = self.ask("PUT", "/api/scenario", {"path": "work/two.yaml", "yaml": "seed: 3\n", "revision": saved["revision"]}, 409)
        self.assertEqual((conflict["yaml"], conflict["revision"]), ("seed: 2\n", other["revision"]))
        self.assertEqual((self.work / "two.yaml").read_text(), "seed: 2\n")
        self.ask("PUT", "/api/scenario", {"path": "work/two.yaml", "yaml": "seed: 3\n", "revision": saved["revision"], "overwrite": True})
        self.assertEqual(self.ask("GET", "/api/scenario?path=work/two.yaml")["yaml"], "seed: 3\n")
        self.assertEqual([p.name for p in self.work.iterdir() if p.name.endswith(".tmp")], [])

    def test_the_scene_and_its_picture(self):
        scene = self.ask("POST", "/api/scene", self.scenario())
        self.assertEqual(scene["kind"], "plane")
        self.assertEqual([(c["name"], c["width"], c["height"]) for c in scene["cameras"]], [("cam0", 64, 48)])
        status, headers, jpeg = self.server.request("GET", scene["texture"])
        self.assertEqual((status, headers["Content-Type"], jpeg[:2]), (200, "image/jpeg", b"\xff\xd8"))
        for where in ({"t": 0}, {"pose": [0, 0, 0, 0.5, 0.5, 0.5, 0.5]}):
            status, headers, png = self.server.request("POST", "/api/view", self.scenario(width=120, **where))
            self.assertEqual(status, 200, png)
            self.assertEqual(struct.unpack(">II", png[16:24]), (120, 90))

    def test_each_camera_of_a_rig_has_its_picture(self):
        rig = "cameras:\n- {name: left, width: 64, height: 48}\n- {name: right, width: 80, height: 40, T_body_camera: {position: [0.2, 0, 0]}}\n"
        asked = self.scenario(yaml=self.yaml.replace("camera: {width: 64, height: 48}\n", rig), t=0)
        scene = self.ask("POST", "/api/scene", asked)
        self.assertEqual([(c["name"], c["width"]) for c in scene["cameras"]], [("left", 64), ("right", 80)])
        self.assertEqual(scene["cameras"][1]["T_body_camera"][:3], [0.2, 0, 0])
        pictures = {name: self.server.request("POST", "/api/view", {**asked, **name_of}) for name, name_of in
                    (("first", {}), ("left", {"camera": "left"}), ("right", {"camera": "right"}))}
        self.assertEqual(pictures["first"][2], pictures["left"][2])
        self.assertEqual(struct.unpack(">II", pictures["right"][2][16:24]), (80, 40))
        self.assertIn("no camera", self.ask("POST", "/api/view", {**asked, "camera": "third"}, 400)["error"])

    def test_a_mesh_is_a_sound_glb(self):
        cube = "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 1) for z in (0, 1)) + "f 1 2 3\nf 5 6 7\n"
        (self.work / "cube.obj").write_text(cube)
        new = self.ask("POST", "/api/scenario/new", {"scene": "work/cube.obj"})
        scene = self.ask("POST", "/api/scene", {"yaml": new["yaml"], "dir": new["dir"]})
        self.assertEqual((scene["kind"], scene["triangles"]), ("mesh", 2))
        _, headers, glb = self.server.request("GET", scene["glb"])
        self.assertEqual(headers["Content-Type"], "model/gltf-binary")
        magic, version, length, json_length = struct.unpack("<4sIII", glb[:16])
        self.assertEqual((magic, version, length), (b"glTF", 2, len(glb)))
        gltf = json.loads(glb[20:20 + json_length])
        self.assertEqual([node["name"] for node in gltf["nodes"]], [o["glb_node"] for o in scene["objects"]])
        self.assertEqual(gltf["accessors"][0]["min"] + gltf["accessors"][0]["max"], [0, 0, 0, 1, 1, 1])
        binary = len(glb) - 28 - json_length
        for view in gltf["bufferViews"]:
            self.assertLessEqual(view["byteOffset"] + view["byteLength"], binary)

    def glb_of(self, scene_file):
        """The scene, the description in its GLB, and what the description describes."""
        new = self.ask("POST", "/api/scenario/new", {"scene": f"work/{scene_file}"})
        scene = self.ask("POST", "/api/scene", {"yaml": new["yaml"], "dir": new["dir"]})
        glb = self.server.request("GET", scene["glb"])[2]
        json_length = struct.unpack("<I", glb[12:16])[0]
        return scene, json.loads(glb[20:20 + json_length]), glb[28 + json_length:]

    def test_textures_are_small_and_complete(self):
        (self.work / "card.mtl").write_text(f"newmtl a\nmap_Kd {self.image}\nnewmtl b\nmap_Kd none.png\n")
        (self.work / "card.obj").write_text("mtllib card.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n"
                                            "usemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 1/1 3/3 2/2\n")
        scene, gltf, binary = self.glb_of("card.obj")
        self.assertEqual([image["extras"] for image in gltf["images"]], [{"image": 0}])
        view = gltf["bufferViews"][gltf["images"][0]["bufferView"]]
        small = binary[view["byteOffset"]:][:view["byteLength"]]
        whole = (self.work / self.image).read_bytes()
        self.assertLess(len(small), len(whole) / 4)
        texture = scene["glb"].removesuffix(".glb") + "/0"
        status, headers, got = self.server.request("GET", texture)
        self.assertEqual((status, headers["Content-Type"], got), (200, "image/jpeg", whole))
        self.assertEqual([round(m["pbrMetallicRoughness"]["baseColorFactor"][0], 3) for m in gltf["materials"]], [1, 0.2])
        for wrong in ("1", "-1", "x", "0x", "18446744073709551616"):
            self.assertEqual(self.server.request("GET", texture[:-1] + wrong)[0], 404, wrong)

    def test_large_meshes_have_coarse_ones(self):
        n = 240
        vertices = "".join(f"v {x / n} {y / n} {(x * y % 7) / 1000}\n" for y in range(n + 1) for x in range(n + 1))
        corners = [(y * (n + 1) + x + 1, y * (n + 1) + x + n + 2) for y in range(n) for x in range(n)]
        (self.work / "large.obj").write_text(vertices + "".join(f"f {a} {a + 1} {b + 1}\nf {a} {b + 1} {b}\n" for a, b in corners))
        scene, gltf, binary = self.glb_of("large.obj")
        self.assertEqual(scene["triangles"], 2 * n * n)
        primitive = gltf["meshes"][0]["primitives"][0]
        counts = {}
        for name, index in (("whole", primitive["indices"]), ("coarse", primitive["extras"]["coarse"])):
            accessor = gltf["accessors"][index]
            view = gltf["bufferViews"][accessor["bufferView"]]
            indices = struct.unpack(f"<{accessor['count']}I", binary[view["byteOffset"]:][:view["byteLength"]])
            self.assertLess(max(indices), gltf["accessors"][primitive["attributes"]["POSITION"]]["count"])
            counts[name] = len(indices) / 3
        self.assertEqual(counts["whole"], 2 * n * n)
        self.assertTrue(5000 < counts["coarse"] < 30000, counts)

    def test_splats_are_files_of_objects(self):
        grey, upright = bytes([128, 128, 128, 255]), bytes([255, 128, 128, 128])
        (self.work / "row.splat").write_bytes(b"".join(struct.pack("<6f", x, 2, 3, 0.1, 0.1, 0.1) + grey + upright for x in range(4)))
        new = self.ask("POST", "/api/scenario/new", {"scene": "work/row.splat"})
        self.assertEqual(new["values"]["renderer"]["type"], "splats")
        (self.work / "tile.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n")
        objects = ("  scale: 2\n  light: linear\n  objects:\n  - {name: few, scene: row.splat, scale: 1, trajectory: {type: static}}\n"
                   "  - {name: tile, scene: tile.obj, trajectory: {type: static}}\n")
        yaml = new["yaml"].replace("  scene: row.splat\n", "  scene: row.splat\n" + objects)
        scene = self.ask("POST", "/api/scene", {"yaml": yaml, "dir": "work"})
        self.assertEqual((scene["kind"], scene["triangles"], scene["bounds"]), ("splats", 1, [[0, 4, 6], [6, 4, 6]]))
        self.assertEqual(scene["middle"], scene["bounds"])
        still, few, tile = scene["objects"]
        self.assertEqual((still["moving"], few["moving"], tile["splats"]), (False, True, None))
        self.assertEqual({k: v for k, v in still["splats"].items() if k != "file"}, {"shown": 4, "all": 4, "filter": "dilated"})
        status, headers, splats = self.server.request("GET", still["splats"]["file"])
        self.assertEqual((status, headers["Content-Type"], len(splats)), (200, "application/octet-stream", 4 * 32))
        self.assertIn("max-age", headers["Cache-Control"])
        self.assertEqual(struct.unpack("<3f", splats[32:44]), (2, 4, 6))
        self.assertEqual(splats[24], 188)  # the display colour of this linear light
        self.assertEqual(struct.unpack("<3f", self.server.request("GET", few["splats"]["file"])[2][32:44]), (1, 2, 3))
        glb = self.server.request("GET", scene["glb"])[2]
        self.assertIn(tile["glb_node"].encode(), glb)
        for wrong in ("2", "3", "-1", "x"):
            self.assertEqual(self.server.request("GET", scene["glb"].removesuffix(".glb") + f"/{wrong}.splat")[0], 404, wrong)
        self.assertEqual(self.server.request("GET", still["splats"]["file"], token=False)[0], 401)

    def test_objects_that_deform_have_shapes(self):
        """The simulation's shapes, on the clock of the body's trajectory: an object of the scenario has an animation clock of its own."""
        shutil.copy(SCENES / "hand/hand.glb", self.work)
        objects = ("  objects:\n  - {name: slow, scene: hand.glb, trajectory: {type: static}, animation: {time_scale: 2, offset_s: 1}}\n"
                   "  - {name: still, scene: still.obj, trajectory: {type: static}}\n")
        (self.work / "still.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n")
        yaml = f"renderer:\n  type: mesh\n  scene: hand.glb\n{objects}trajectory: {{type: static}}\nduration_s: 2\n"
        scene = self.ask("POST", "/api/scene", {"yaml": yaml, "dir": "work"})
        by_name = {one["name"]: one for one in scene["objects"]}
        slow, still, plain = by_name["slow"], by_name["still"], scene["objects"][0]
        self.assertIsNone(still["shapes"])
        shapes = plain["shapes"]
        self.assertEqual((shapes["rate_hz"], shapes["start"], shapes["end"]), (30, 0, 5_000_000_000))
        size = 24 + 8 * shapes["vertices"]

        def shape(of, first, count=1):
            status, headers, body = self.server.request("GET", f"{of['shapes']['file']}?first={first}&count={count}")
            self.assertEqual((status, headers["Content-Type"], len(body)), (200, "application/octet-stream", count * size), body[:200])
            return body

        both = shape(plain, 33, 2)
        self.assertEqual(both, shape(plain, 33) + shape(plain, 34))
        self.assertNotEqual(both[:size], both[size:])
        self.assertEqual(shape(plain, 150), shape(plain, 10_000))       # it rests after its end
        self.assertEqual(shape(slow, 0), shape(plain, 30))              # it begins at 1 s
        self.assertEqual(shape(slow, 60), shape(plain, 60))             # 2 s are 1 s of its own time
        for query in ("", "?first=0", "?count=1", "?first=-1&count=1", "?first=x&count=1", "?first=0&count=0", "?first=0&count=1e9",
                      "?first=0&count=100000", "?first=18446744073709551615&count=1", "?first=2000000000&count=1"):
            self.assertEqual(self.server.request("GET", shapes["file"] + query)[0], 400, query)
        base = scene["glb"].removesuffix(".glb")
        index = scene["objects"].index(still)
        for wrong in (f"{index}", "99", "-1", "x"):
            self.assertEqual(self.server.request("GET", f"{base}/{wrong}.shapes?first=0&count=1")[0], 404, wrong)
        self.assertEqual(self.server.request("GET", f"{shapes['file']}?first=0&count=1", token=False)[0], 401)

    def test_surfaces_shine_with_pbr_only(self):
        shutil.copy(SCENES / "walker/walker.glb", self.work)
        for light, expected in (("pbr", 0.15), ("lambert", 1)):
            yaml = f"renderer: {{type: mesh, scene: walker.glb, lighting: {{type: {light}}}}}\ntrajectory: {{type: static}}\nduration_s: 1\n"
            scene = self.ask("POST", "/api/scene", {"yaml": yaml, "dir": "work"})
            glb = self.server.request("GET", scene["glb"])[2]
            document = json.loads(glb[20:20 + struct.unpack("<I", glb[12:16])[0]])
            surfaces = {m["name"]: m["pbrMetallicRoughness"] for m in document["materials"]}
            self.assertEqual({s["metallicFactor"] for s in surfaces.values()}, {0})
            self.assertAlmostEqual(surfaces["glaze"]["roughnessFactor"], expected, places=6)

    def test_the_light_of_an_environment_is_a_file(self):
        (self.work / "plate.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        (self.work / "sky.ppm").write_bytes(b"P6 4 2 255\n" + bytes([255, 0, 0] + 7 * [0, 255, 0]))
        (self.work / "square.ppm").write_bytes(b"P6 2 2 255\n" + bytes(12))

        def scene(lighting, status=200):
            yaml = f"renderer: {{type: mesh, scene: plate.obj, lighting: {lighting}}}\n"
            return self.ask("POST", "/api/scene", {"yaml": yaml, "dir": "work"}, status)

        light = scene("{type: pbr, environment: {image: sky.ppm, strength: 3}}")["environment"]
        self.assertEqual((light["width"], light["height"]), (4, 2))
        status, headers, body = self.server.request("GET", light["file"])
        self.assertEqual((status, headers["Content-Type"]), (200, "application/octet-stream"))
        self.assertEqual(struct.unpack("<24e", body), (1, 0, 0) + 7 * (0, 1, 0))
        self.assertEqual(self.server.request("GET", light["file"], token=False)[0], 401)
        dark = scene("{type: pbr}")
        self.assertIsNone(dark["environment"])
        self.assertEqual(self.server.request("GET", dark["glb"].replace(".glb", "/environment.light"))[0], 404)
        for image, reason in (("square.ppm", "twice as wide as high"), ("absent.hdr", "absent.hdr")):
            self.assertIn(reason, scene(f"{{type: pbr, environment: {{image: {image}}}}}", 400)["error"])

    def test_the_motion_is_the_simulators(self):
        motion = self.ask("POST", "/api/trajectory", self.scenario(samples=11))
        self.assertEqual(len(motion["poses"]), 11)
        self.assertEqual([p["t"] for p in motion["waypoints"]], [motion["start"], motion["end"]])
        self.assertAlmostEqual(motion["poses"][0][1], -0.1)
        self.assertAlmostEqual(motion["poses"][-1][1], 0.1)
        self.assertEqual(max(motion["speed_m_per_s"][0], motion["speed_m_per_s"][-1]), 0)
        one = self.yaml.replace("    - {position: [0, 0.1, 0], look_at: [1, 0, 0]}\n", "")
        refused = self.ask("POST", "/api/trajectory", {"yaml": one, "dir": "work"}, 400)
        self.assertTrue(refused["where"].startswith("trajectory"), refused)

    def test_a_run_makes_the_bytes_of_esim_simulate(self):
        started = self.ask("POST", "/api/runs", {"path": "work/small.yaml", "out": "work/made"})
        messages = self.server.events_of(started["id"], ("done", "failed"))
        self.assertEqual(messages[-1], ("done", {"recording": "work/made"}))
        self.assertIn("progress", {kind for kind, _ in messages})
        self.assertEqual(self.server.events_of(started["id"], ("done",))[-1], messages[-1])  # whoever comes later learns it too
        self.assertEqual(self.server.request("GET", f"/api/runs/{started['id']}/picture.png?n=1")[2][1:4], b"PNG")
        result = run("simulate", self.work / "small.yaml", "--out", self.folder / "cli", "-q")
        self.assertEqual(result.returncode, 0, result.stderr)
        for name in ("scenario.yaml", "cam0/events.h5", "cam0/truth.h5", "poses.txt", "states.csv"):
            self.assertEqual((self.work / "made" / name).read_bytes(), (self.folder / "cli" / name).read_bytes(), name)
        self.ask("POST", "/api/runs", {"path": "work/small.yaml", "out": "work/made"}, 409)
        self.check_recording("work/made")
        converted = run("convert", self.work / "made" / "cam0" / "events.h5", self.work / "made.raw")
        self.assertEqual(converted.returncode, 0, converted.stderr)
        self.check_other_format("work/made.raw")
        self.check_cut_recording(self.work / "made")

    def check_cut_recording(self, made):
        """What can still be read of a recording whose events are cut is shown, with what is wrong."""
        shutil.copytree(made, self.work / "cut")
        events = self.work / "cut" / "cam0" / "events.h5"
        events.write_bytes(events.read_bytes()[:events.stat().st_size // 2])
        recording = self.ask("POST", "/api/recordings", {"path": "work/cut"})
        self.assertIn("events.h5", recording["note"])
        self.assertEqual(recording["cameras"][0]["has"], {"events": False, "images": True, "depth": True, "motion_field": True, "samples": False})
        self.ask("GET", f"/api/recordings/{recording['id']}/rate", status=404)

    def check_recording(self, path):
        recording = self.ask("POST", "/api/recordings", {"path": path})
        camera = recording["cameras"][0]
        self.assertEqual((camera["width"], camera["height"], recording["incomplete"], recording["indexing"]), (64, 48, False, 1))
        self.assertEqual(camera["has"], {"events": True, "images": True, "depth": True, "motion_field": True, "samples": False})
        base = f"/api/recordings/{recording['id']}"
        start, end = recording["start"], recording["end"]
        on, off = self.counts(self.ask("GET", f"{base}/rate?bins=7"))
        self.assertEqual(on + off, camera["events"])
        _, _, binary = self.server.request("GET", f"{base}/events.bin?from={start}&to={end}&max=500000")
        first, last, count, total = struct.unpack("<QQII", binary[:24])
        self.assertEqual((first, last, count, total), (start, end, camera["events"], camera["events"]))
        events = list(struct.iter_unpack("<IHH", binary[24:]))
        self.assertEqual(len(events), count)
        self.assertEqual(sum(y >> 15 for _, _, y in events), on)
        self.assertTrue(all(x < 64 and (y & 0x7FFF) < 48 for _, x, y in events))
        for query in ("picture.png?view=counts&over=image", "picture.png?view=onoff&theme=light", "picture.png?view=time_surface", "image.png?kind=image",
                      "image.png?kind=depth", "image.png?kind=motion_field"):
            status, headers, png = self.server.request("GET", f"{base}/{query}&t={(start + end) // 2}")
            self.assertEqual((status, png[1:4], struct.unpack(">II", png[16:24])), (200, b"PNG", (64, 48)), query)
        self.assertLessEqual(int(headers["X-Time-Ns"]), (start + end) // 2)
        light, dark = (self.server.request("GET", f"{base}/picture.png?view=onoff&t={start}&theme={theme}")[2] for theme in ("light", "dark"))
        self.assertNotEqual(light, dark)
        self.ask("GET", f"{base}/picture.png?theme=grey", status=400)
        poses = self.ask("GET", f"{base}/poses?max=5")
        self.assertEqual(len(poses["poses"]), 5)
        self.ask("GET", f"{base}/imu", status=404)
        self.ask("GET", f"{base}/events.bin?camera=none", status=404)
        self.ask("GET", f"{base}/events.bin?from=x", status=400)

    def test_a_recorded_sensor_can_be_changed(self):
        kept = self.work / "kept"
        for command in (("simulate", self.work / "small.yaml", "--out", kept, "--set", "output.samples=exact",
                         "--set", "output.time_unit=ns", "-q"),
                        ("resense", kept, "--out", self.work / "other", "--set", "event_camera.contrast_threshold=0.15", "-q")):
            result = run(*command)
            self.assertEqual(result.returncode, 0, result.stderr)
        recording = self.ask("POST", "/api/recordings", {"path": "work/kept"})
        self.assertTrue(recording["cameras"][0]["has"]["samples"])
        base, span = f"/api/recordings/{recording['id']}", f"from={recording['start']}&to={recording['end']}&max=500000"

        def change(changes, status=200, **more):
            changes = [{"where": where, "value": value} for where, value in changes.items()]
            return self.ask("POST", f"{base}/sensor", {"camera": "cam0", "changes": changes, **more}, status)

        def events(query):
            status, _, binary = self.server.request("GET", f"{base}/events.bin?{span}{query}")
            self.assertEqual(status, 200)
            return binary

        recorded = change({})
        self.assertEqual(recorded["values"]["event_camera"]["refractory_period_us"], 0)
        self.assertEqual(recorded["values"]["light"], {})
        self.assertEqual(events(f"&sensor={recorded['sensor']}"), events(""))
        changed = change({"event_camera.contrast_threshold": 0.15}, replaces=recorded["sensor"])
        self.assertEqual(changed["values"]["event_camera"]["contrast_threshold"], 0.15)
        other = self.ask("POST", "/api/recordings", {"path": "work/other"})
        _, _, whole = self.server.request("GET", f"/api/recordings/{other['id']}/events.bin?{span}")
        self.assertEqual(events(f"&sensor={changed['sensor']}"), whole)
        status, headers, png = self.server.request("GET", f"{base}/picture.png?t={recording['end']}&sensor={changed['sensor']}")
        self.assertEqual((status, png[1:4]), (200, b"PNG"))
        self.assertGreater(int(headers["X-Events"]), 0)
        self.ask("GET", f"{base}/events.bin?{span}&sensor={recorded['sensor']}", status=404)
        for changes, where in (({"event_camera.contrast_threshold": -1}, "event_camera.contrast_threshold"), ({"seed": 3}, "seed"),
                               ({"event_camera.preset": "none"}, "event_camera.preset"), ({"renderer.image": "/etc/passwd"}, "renderer.image")):
            self.assertEqual(change(changes, 400)["where"], where)
        self.ask("POST", f"{base}/sensor", {"camera": "cam0"}, 400)
        self.ask("POST", f"{base}/sensor", {"camera": "cam9", "changes": []}, 404)
        self.assertIn("samples", self.ask("POST", f"/api/recordings/{other['id']}/sensor", {"camera": "cam0", "changes": []}, 404)["error"])

    def check_other_format(self, path):
        recording = self.ask("POST", "/api/recordings", {"path": path})
        self.assertEqual(recording["format"], "evt3")
        base = f"/api/recordings/{recording['id']}"
        self.assertEqual(self.server.request("GET", f"{base}/picture.png?t={recording['end']}")[2][1:4], b"PNG")
        for _ in range(100):
            recording = self.ask("GET", base)
            if recording["indexing"] == 1:
                break
            time.sleep(0.05)
        self.assertEqual(recording["indexing"], 1)
        self.assertNotIn("note", recording)
        self.assertEqual(sum(self.counts(self.ask("GET", f"{base}/rate?bins=3"))), recording["cameras"][0]["events"])

    @staticmethod
    def counts(rate):
        """ON and OFF events of rates in bins."""
        widths_s = [(after - before) / 1e9 for before, after in zip(rate["edges"], rate["edges"][1:])]
        return tuple(sum(round(hz * width) for hz, width in zip(rate[polarity], widths_s)) for polarity in ("on", "off"))

    def test_a_constant_rate_is_drawn_as_one(self):
        (self.work / "even.txt").write_text("".join(f"{i * 1e-4:.6f} {i % 64} 1 1\n" for i in range(50_000)))
        converted = run("convert", self.work / "even.txt", self.work / "even.h5")
        self.assertEqual(converted.returncode, 0, converted.stderr)
        recording = self.ask("POST", "/api/recordings", {"path": "work/even.h5"})
        rate = self.ask("GET", f"/api/recordings/{recording['id']}/rate?bins=800")
        self.assertGreater(len(rate["on"]), 400)
        for hz in rate["on"][1:-1]:
            self.assertAlmostEqual(hz, 1e4, places=6)

    def test_vibrations_stay_fast_where_measurements_are_many(self):
        """1 kHz with a vibration of 250 Hz, drawn by fewer values than there are: its amplitude is seen everywhere."""
        yaml = self.yaml.replace("type: waypoints", "type: waypoints\n  speed: 0.05") + "imu: {rate_hz: 1000}\n"
        (self.work / "imu.yaml").write_text(yaml)
        result = run("simulate", self.work / "imu.yaml", "--out", self.work / "imu", "-q")
        self.assertEqual(result.returncode, 0, result.stderr)
        file = self.work / "imu" / "imu.csv"
        head, *lines = file.read_text().splitlines()
        shaken = [line.split(",") for line in lines]
        for i, values in enumerate(shaken):
            values[1] = str(2.0 if i % 4 < 2 else -2.0)
        file.write_text("\n".join([head, *map(",".join, shaken)]) + "\n")
        recording = self.ask("POST", "/api/recordings", {"path": "work/imu"})
        drawn = self.ask("GET", f"/api/recordings/{recording['id']}/imu?max=300")
        self.assertGreater(len(shaken), 2000)
        self.assertLessEqual(len(drawn["t"]), 300)
        self.assertEqual(drawn["t"], sorted(drawn["t"]))
        self.assertEqual([rate[0] for rate in drawn["angular_velocity"]], [-2.0, 2.0] * (len(drawn["t"]) // 2))
        whole = self.ask("GET", f"/api/recordings/{recording['id']}/imu?max=100000")
        self.assertEqual(len(whole["t"]), len(shaken))

    def test_what_is_damaged_is_one_line(self):
        (self.work / "no.glb").write_bytes(b"glTF no")
        yaml = "renderer: {type: mesh, scene: no.glb}\ntrajectory: {type: static}\nduration_s: 1\n"
        self.assertIn("no.glb", self.ask("POST", "/api/scene", {"yaml": yaml, "dir": "work"}, 400)["error"])
        (self.work / "no.raw").write_bytes(b"% evt 3.0\n")
        (self.work / "no.h5").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
        self.assertIn("no.h5", self.ask("POST", "/api/recordings", {"path": "work/no.h5"}, 400)["error"])
        self.ask("POST", "/api/recordings", {"path": "work/small.yaml"}, 400)
        self.ask("POST", "/api/recordings", {"path": "work/none"}, 404)
        self.ask("GET", "/api/recordings/99/rate", status=404)
        self.ask("GET", "/api/nothing", status=404)
        self.ask("DELETE", "/api/schema", status=405)


class Refusals(StudioTest):
    def get(self, target, host=None, headers="", method="GET"):
        host = host or f"127.0.0.1:{self.server.port}"
        text = f"{method} {target} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\nAuthorization: Bearer {self.server.token}\r\n{headers}\r\n"
        answer = self.server.raw(text.encode())
        return int(answer.split(b" ", 2)[1]) if answer else 0

    def test_only_with_the_token(self):
        for target in ("/", "/api/session", "/assets/x.js", "/api/scenes/x.glb", "/?token=wrong"):
            self.assertEqual(self.server.request("GET", target, token=False)[0], 401, target)
        status, headers, _ = self.server.request("GET", f"/?token={self.server.token}", token=False)
        self.assertEqual((status, headers["Location"]), (303, "/"))
        cookie = headers["Set-Cookie"]
        self.assertIn("HttpOnly; SameSite=Strict", cookie)
        self.assertEqual(self.server.request("GET", "/api/session", headers={"Cookie": cookie.split(";")[0]}, token=False)[0], 200)

    def test_names_that_were_made_to_point_here(self):
        self.assertEqual(self.get("/api/session"), 200)
        for host in ("evil.example", f"evil.example:{self.server.port}", "127.0.0.1", f"127.0.0.1:{self.server.port + 1}"):
            self.assertEqual(self.get("/api/session", host), 403, host)

    def test_other_sites(self):
        self.assertEqual(self.get("/api/session", headers="Origin: http://evil.example\r\n"), 403)
        self.assertEqual(self.get("/api/session", headers="Sec-Fetch-Site: cross-site\r\n"), 403)
        self.assertEqual(self.get("/api/session", headers=f"Origin: http://127.0.0.1:{self.server.port}\r\n"), 200)
        form = "Content-Type: application/x-www-form-urlencoded\r\nContent-Length: 0\r\n"
        self.assertEqual(self.get("/api/runs", headers=form, method="POST"), 400)

    def test_only_this_machine_reaches_it(self):
        listening = pathlib.Path("/proc/net/tcp").read_text() + pathlib.Path("/proc/net/tcp6").read_text()
        places = [line.split()[1] for line in listening.splitlines() if line.split()[1].endswith(f":{self.server.port:04X}") and line.split()[3] == "0A"]
        self.assertEqual(places, [f"0100007F:{self.server.port:04X}"])
        refused = run("studio", self.work, "--host", "0.0.0.0", "--page", self.folder / "page")
        self.assertEqual(refused.returncode, 2)
        self.assertIn("--token", refused.stderr)

    def test_nothing_outside_the_roots(self):
        (self.work / "link.yaml").unlink(missing_ok=True)
        (self.work / "link.yaml").symlink_to(self.folder / "secret.yaml")
        for path in ("../secret.yaml", "work/../secret.yaml", "work/link.yaml", "/etc/passwd", "work/%2e%2e/secret.yaml", "work/..%2fsecret.yaml",
                     "work/%2e%2e%2fsecret.yaml", "work//../secret.yaml", "work/poster/../../secret.yaml", "secret.yaml", ""):
            status, _, body = self.server.request("GET", f"/api/scenario?path={path}")
            self.assertIn(status, (400, 403, 404), path)
            self.assertNotIn(b"seed", body, path)
            self.assertNotEqual(self.server.request("GET", f"/api/files?dir={path.rsplit('/', 1)[0]}/..")[0], 200)
        for path in ("../new.yaml", "work/../new.yaml", "/tmp/new.yaml", "work/poster/../../new.yaml"):
            self.assertIn(self.server.request("PUT", "/api/scenario", {"path": path, "yaml": "", "revision": None})[0], (400, 403), path)
            self.assertIn(self.server.request("POST", "/api/runs", {"path": "work/small.yaml", "out": path})[0], (400, 403), path)
        self.assertFalse((self.folder / "new.yaml").exists())
        (self.work / "up").unlink(missing_ok=True)
        (self.work / "up").symlink_to(self.folder)
        self.assertEqual(self.server.request("PUT", "/api/scenario", {"path": "work/up/x.yaml", "yaml": "", "revision": None})[0], 403)
        for page in ("/../secret.yaml", "/%2e%2e/secret.yaml", "/..%2f..%2fetc/passwd", "//etc/passwd", "/index.html/..", "/log"):
            self.assertNotEqual(self.get(page), 200, page)

    def test_files_that_scenarios_name(self):
        outside = self.folder / "secret.yaml"
        for yaml, where in ((f"renderer: {{type: plane, image: {outside}}}\n", "renderer.image"),
                            ("renderer: {type: mesh, scene: ../secret.yaml}\n", "renderer.scene"),
                            (f"camera: {{calibration: {outside}}}\n", "camera.calibration"),
                            ("trajectory: {type: waypoints, file: up/secret.yaml}\n", "trajectory.file"),
                            (f"imu: {{calibration: {outside}}}\n", "imu.calibration")):
            problems = {p["where"]: p["what"] for p in self.server.json("POST", "/api/scenario/check", {"yaml": yaml, "dir": "work"})["problems"]}
            if "up/" in yaml and not (self.work / "up").exists():
                continue
            self.assertIn("must be in one of the folders", problems.get(where, ""), (yaml, problems))

    def test_nonsense(self):
        for data in (b"", b"\r\n\r\n", b"\0" * 5000, b"GET", b"GET / HTTP/9.9\r\n\r\n", b"GET /%zz HTTP/1.1\r\n\r\n", bytes(range(256)) * 100,
                     b"POST /api/scene HTTP/1.1\r\nHost: x\r\nContent-Length: -1\r\n\r\n", b"GET / HTTP/1.1\r\n" + b"a: b\r\n" * 10000):
            self.server.raw(data, 1)
        for body in (b"", b"[]", b"null", b"{", b"[" * 100000, b'{"yaml": 5}', b'{"yaml": "' + b"[" * 3000 + b'"}', b'{"yaml": "a: &a [*a]"}', b'\xff\xfe',
                     b'{"yaml": "camera: &a {x: *a}", "dir": "work"}', b'{"path": "\\u0000"}'):
            for target in ("/api/scene", "/api/scenario/check", "/api/trajectory", "/api/view", "/api/runs", "/api/recordings"):
                connection = http.client.HTTPConnection("127.0.0.1", self.server.port, timeout=20)
                connection.request("POST", target, body, {"Authorization": f"Bearer {self.server.token}", "Content-Type": "application/json"})
                response = connection.getresponse()
                text = response.read()
                self.assertIn(response.status, (200, 400, 403, 404), (target, body[:40], text[:200]))
                connection.close()
        self.assertEqual(self.server.request("GET", "/api/session")[0], 200)

    def test_large_bodies_are_not_read(self):
        head = (f"POST /api/scene HTTP/1.1\r\nHost: 127.0.0.1:{self.server.port}\r\nAuthorization: Bearer {self.server.token}\r\n"
                "Content-Type: application/json\r\nContent-Length: 100000000\r\n\r\n")
        self.assertIn(b" 413 ", self.server.raw(head.encode())[:20])


class Lives(ProgramTest):
    def setUp(self):
        super().setUp()
        self.work = self.folder / "work"
        (self.work / "poster").mkdir(parents=True)
        image = next((SCENES / "poster").glob("*.[jp][pn]g"))
        shutil.copy(image, self.work / "poster")
        (self.work / "small.yaml").write_text(SMALL.replace("poster.png", image.name))

    def server(self, *arguments, **options):
        server = Server(self.folder, *arguments, **options)
        self.addCleanup(server.stop)
        return server

    def test_idle_it_costs_nothing(self):
        server = self.server(self.work)
        server.json("GET", "/api/session")
        time.sleep(0.3)
        before = server.cpu_seconds()
        time.sleep(2)
        self.assertLessEqual(server.cpu_seconds() - before, 0.02)

    def wait_for(self, server, run_id, is_so):
        """Until that is so of the run, which goes on."""
        for _ in range(3000):
            status = server.json("GET", f"/api/runs/{run_id}")
            if status["state"] == "running" and is_so(status):
                return
            self.assertIn(status["state"], ("waiting", "running"))
            time.sleep(0.02)
        self.fail(f"timed out: {status}")

    def test_an_interrupt_ends_a_run_in_order(self):
        long = (self.work / "small.yaml").read_text().replace("type: waypoints", "type: waypoints\n  speed: 0.0005")
        (self.work / "long.yaml").write_text(long)
        server = self.server(self.work / "long.yaml")
        run_id = server.json("POST", "/api/runs", {"path": "work/long.yaml", "out": "work/cut"})["id"]
        self.wait_for(server, run_id, lambda status: status["t"] > status["start"])
        self.assertEqual(server.stop()[0], 0)
        self.assertEqual(json.loads((self.work / "cut" / "report.json").read_text())["status"], "interrupted")
        self.assertEqual(run("info", self.work / "cut").returncode, 0)
        again = self.server(self.work / "cut")
        self.assertEqual(again.json("GET", "/api/session")["opened"], {"kind": "recording", "path": "work/cut"})
        self.assertTrue(again.json("POST", "/api/recordings", {"path": "work/cut"})["incomplete"])

    def test_a_run_outlives_its_watchers_and_can_be_cancelled(self):
        long = (self.work / "small.yaml").read_text().replace("type: waypoints", "type: waypoints\n  speed: 0.0005")
        (self.work / "long.yaml").write_text(long)
        server = self.server(self.work)
        run_id = server.json("POST", "/api/runs", {"path": "work/long.yaml"})["id"]
        server.events_of(run_id, ("progress",))  # and is gone
        self.wait_for(server, run_id, lambda status: not status["loading"])
        waiting = server.json("POST", "/api/runs", {"path": "work/small.yaml"})["id"]
        self.assertEqual([r["state"] for r in server.json("GET", "/api/runs")], ["running", "waiting"])
        server.json("DELETE", f"/api/runs/{waiting}")
        server.json("DELETE", f"/api/runs/{run_id}")
        self.assertEqual(server.events_of(run_id, ("cancelled",))[-1], ("cancelled", {"recording": "work/out/long"}))
        self.assertEqual([r["state"] for r in server.json("GET", "/api/runs")], ["cancelled", "cancelled"])
        server.json("DELETE", f"/api/runs/{run_id}", status=409)

    def test_a_port_that_is_taken(self):
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            taken.listen()
            port = taken.getsockname()[1]
            self.assert_refused(run("studio", self.work, "--port", port, "--page", self.page()), str(port), "in use by another program")
        first, second = self.server(self.work), self.server(self.work)
        self.assertNotEqual(first.port, second.port)

    def test_existing_files_prevent_a_run(self):
        long = (self.work / "small.yaml").read_text().replace("type: waypoints", "type: waypoints\n  speed: 0.0005")
        (self.work / "long.yaml").write_text(long)
        server = self.server(self.work)
        run_id = server.json("POST", "/api/runs", {"path": "work/long.yaml"})["id"]
        for overwrite in (False, True):  # what a run is writing cannot be replaced
            refused = server.json("POST", "/api/runs", {"path": "work/long.yaml", "overwrite": overwrite}, 409)
            self.assertTrue(refused["running"], refused)
            self.assertIn("a run is writing there", refused["error"])
        self.wait_for(server, run_id, lambda status: not status["loading"])
        server.json("DELETE", f"/api/runs/{run_id}")
        server.events_of(run_id, ("cancelled",))
        refused = server.json("POST", "/api/runs", {"path": "work/long.yaml"}, 409)
        self.assertFalse(refused["running"], refused)
        self.assertIn("exists already", refused["error"])

    def test_a_run_that_fails_names_its_option(self):
        (self.work / "still.yaml").write_text((self.work / "small.yaml").read_text().replace("    - {position: [0, 0.1, 0], look_at: [1, 0, 0]}\n", ""))
        server = self.server(self.work)
        run_id = server.json("POST", "/api/runs", {"path": "work/still.yaml"})["id"]
        kind, message = server.events_of(run_id, ("failed", "done"))[-1]
        self.assertEqual((kind, message["where"]), ("failed", "trajectory"), message)
        self.assertEqual(server.json("GET", f"/api/runs/{run_id}")["where"], "trajectory")

    def moved_program(self, place, **pages):
        """The program in a separate folder, and pages that contain their names in other folders."""
        program = self.folder / place
        program.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ESIM, program)
        for name, page in pages.items():
            (self.folder / page).mkdir(parents=True)
            (self.folder / page / "index.html").write_text(name)
        return program

    def test_a_program_that_was_moved_finds_the_page_next_to_it(self):
        for place, page in (("usr/bin/esim", "usr/share/esim/studio"), ("archive/esim", "archive/share/esim/studio"),
                            ("tree/build/release/esim", "tree/studio/dist")):
            program = self.moved_program(place, **{place: page})
            with subprocess.Popen([program, "studio", self.work], stdout=subprocess.PIPE, text=True) as process:
                port, token = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/\?token=(\S+)", process.stdout.readline().strip()).groups()
                try:
                    connection = http.client.HTTPConnection("127.0.0.1", int(port), timeout=60)
                    connection.request("GET", "/", headers={"Authorization": f"Bearer {token}"})
                    self.assertEqual(connection.getresponse().read().decode(), place)
                    connection.close()
                finally:
                    process.terminate()

    def test_a_program_without_its_page_says_how_to_name_one(self):
        program = self.moved_program("lonely/bin/esim")
        result = subprocess.run([program, "studio", self.work], capture_output=True, text=True, timeout=60)
        self.assert_refused(result, "--page", str(self.folder / "lonely/share/esim/studio"))

    def page(self):
        page = self.folder / "page"
        page.mkdir(exist_ok=True)
        (page / "index.html").write_text("")
        return page

    def test_what_is_not_there(self):
        self.assert_refused(run("studio", self.folder / "none.yaml", "--page", self.page()), "none.yaml")
        self.assert_refused(run("studio", self.work, "--page", self.work), "scripts/studio")
        self.assert_refused(run("studio", self.work, "--root", "nowhere", "--page", self.page()), "nowhere")
        self.assert_refused(run("studio", self.work, "--token", "short", "--page", self.page()), "--token")

    def test_a_full_disk_keeps_what_was_saved(self):
        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))

        server = self.server(self.work, preexec_fn=limit, restore_signals=False)
        saved = server.json("PUT", "/api/scenario", {"path": "work/kept.yaml", "yaml": "seed: 1\n", "revision": None})
        large = {"path": "work/kept.yaml", "yaml": "#" * 5000, "revision": saved["revision"]}
        self.assertIn("cannot write", server.json("PUT", "/api/scenario", large, 507)["error"])
        self.assertEqual((self.work / "kept.yaml").read_text(), "seed: 1\n")
        self.assertEqual([p.name for p in self.work.iterdir() if p.name.endswith(".tmp")], [])
        run_id = server.json("POST", "/api/runs", {"path": "work/small.yaml"})["id"]
        self.assertEqual(server.events_of(run_id, ("failed", "done"))[-1][0], "failed")
        self.assertEqual(server.json("GET", "/api/session")["opened"]["kind"], "folder")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
