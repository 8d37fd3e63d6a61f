"""How a recording was made, in its report: every input file with its SHA-256 sum, and the command that repeats it.

Run as: provenance_test.py ESIM_PROGRAM PROJECT_FOLDER, with the standard library of Python alone.
"""

import base64
import hashlib
import json
import os
import pathlib
import shlex
import shutil
import signal
import struct
import subprocess
import sys
import unittest

from opened_files import OpenedFiles
from program import ESIM, ProgramTest, run

PROJECT = pathlib.Path(sys.argv[2]).absolute()
SHORT = ["duration_s=0.02", "output.preview=false", "truth.rate_hz=0"]
PIXEL = base64.b64decode(  # a PNG
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGNgAAAAAgABSK+kcQAAAABJRU5ErkJggg==")
POSES = "".join(f"{0.05 * i} {0.01 * i} 0 0 0 0 0 1\n" for i in range(8))


def settings(*options):
    return [word for option in options for word in ("--set", option)]


def sums(files):
    return {str(path): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def triangle_gltf(folder):
    """A triangle before the camera, whose numbers and texture are files next to it."""
    (folder / "triangle.bin").write_bytes(struct.pack("<15f3H", -5, -5, 4, 0, 9, 4, 5, -5, 4, 0, 0, 0, 1, 1, 0, 0, 1, 2))
    (folder / "skin.png").write_bytes(PIXEL)
    gltf = {
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "scene": 0, "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "doubleSided": True}],
        "textures": [{"source": 0}], "images": [{"uri": "skin.png"}],
        "buffers": [{"uri": "triangle.bin", "byteLength": 66}],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 24},
                        {"buffer": 0, "byteOffset": 60, "byteLength": 6}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [-5, -5, 4], "max": [5, 9, 4]},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5123, "count": 3, "type": "SCALAR"}],
    }
    (folder / "triangle.gltf").write_text(json.dumps(gltf))


class Provenance(ProgramTest):
    def simulate(self, scenario, *options, **arguments):
        return run("simulate", scenario, "--out", self.out, "--quiet", "--force", *options, **arguments)

    def report(self):
        return json.loads((self.out / "report.json").read_text())

    def inputs(self):
        return {entry["file"]: entry["sha256"] for entry in self.report()["inputs"]}

    def assert_lists_what_it_opens(self, folder, scenario, *options):
        opened = OpenedFiles(folder)
        self.addCleanup(opened.close)
        result = self.simulate(scenario, *options)
        files = opened.take()
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn(scenario, files)
        self.assertEqual(self.inputs(), sums(files))
        return {path.name for path in files}


class Inputs(Provenance):
    def test_of_every_shipped_scenario(self):
        scenes = self.folder / "scenes"
        shutil.copytree(PROJECT / "scenes", scenes)
        for scenario in sorted(scenes.glob("*.yaml")):
            if scenario.stem == "studio_room" and not (shutil.which("blender") and (scenes / "studio_room/studio_room.blend").exists()):
                continue
            with self.subTest(scenario=scenario.name):
                self.assert_lists_what_it_opens(scenes, scenario, *settings(*SHORT))

    def test_of_everything_that_a_scenario_can_name(self):
        files = self.folder / "inputs"
        files.mkdir()
        triangle_gltf(files)
        (files / "wall.png").write_bytes(PIXEL)
        (files / "wall.obj").write_text("mtllib wall.mtl\nv 6 -9 -9\nv 6 9 -9\nv 6 0 9\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl wall\nf 1/1 2/2 3/3\n")
        (files / "wall.mtl").write_text("newmtl wall\nKd 1 1 1\nmap_Kd wall.png\n")
        (files / "body.yaml").write_text("points:\n- {position: [0, 0, 0], look_at: [1, 0, 0]}\n- {position: [0.1, 0, 0], look_at: [1, 0, 0]}\n")
        (files / "object.txt").write_text(POSES)
        (files / "response.txt").write_text("0 0\n1 1\n")
        (files / "cameras.yaml").write_text("cam0: {camera_model: pinhole, intrinsics: [40, 40, 20, 15], resolution: [40, 30]}\n")
        (files / "imu.yaml").write_text("update_rate: 200\n" + "".join(
            f"{sensor}_{noise}: 0.001\n" for sensor in ("gyroscope", "accelerometer") for noise in ("noise_density", "random_walk")))
        scenario = files / "all.yaml"
        scenario.write_text("""
duration_s: 0.1
renderer:
  type: mesh
  scene: wall.obj
  objects: [{name: triangle, scene: triangle.gltf, trajectory: {type: file, path: object.txt}}]
trajectory: {type: waypoints, file: body.yaml}
camera: {calibration: cameras.yaml}
frame_camera: {rate_hz: 50, exposure_s: 0.001, response: {type: measured, path: response.txt}}
imu: {calibration: imu.yaml}
""")
        names = self.assert_lists_what_it_opens(files, scenario)
        self.assertEqual(names, {path.name for path in files.iterdir()})

    def test_of_sprites_and_panoramas(self):
        files = self.folder / "inputs"
        files.mkdir()
        (files / "leaf.png").write_bytes(PIXEL)
        (files / "leaf.scene").write_text("40 30 0.1\nleaf.png 0 0 0 0 0 0 0 0 1 1 1 1\n")
        (files / "leaf.yaml").write_text("renderer: {type: sprites, scene: leaf.scene}\n")
        self.assertEqual(len(self.assert_lists_what_it_opens(files, files / "leaf.yaml")), 3)

    def test_of_a_scene_that_blender_reads(self):
        room = PROJECT / "scenes/studio_room"
        blend, texture, cache = self.folder / "a.blend", self.folder / "wood.png", self.folder / "cache"
        blend.write_bytes(b"BLENDER")
        texture.write_bytes(PIXEL)
        fake = self.folder / "blender"  # its last argument is the file to write
        fake.write_text(f'#!/bin/bash\ncp {shlex.quote(str(room / "baked.glb"))} "${{@: -1}}"\n'
                        f'echo "esim warning file {texture}"\necho "esim warning file /nowhere/stone.png"\n')
        fake.chmod(0o755)
        scenario = self.folder / "s.yaml"
        scenario.write_text(f"renderer: {{type: mesh, scene: a.blend}}\ntrajectory: {{type: file, path: {room}/camera.txt}}\n"
                            "camera: {width: 16, height: 12}\n")
        for _ in range(2):  # exported, and from the cache
            result = self.simulate(scenario, *settings(*SHORT), env={**os.environ, "ESIM_BLENDER": str(fake), "XDG_CACHE_HOME": str(cache)})
            self.assertEqual(result.returncode, 0, result.stderr)
            (exported,) = cache.rglob("*.glb")
            self.assertEqual(self.inputs(), sums([scenario, blend, texture, exported, room / "camera.txt"]))
            fake.write_text("#!/bin/sh\nexit 1\n")

    def test_of_a_trajectory_from_a_pipe(self):
        (self.folder / "s.yaml").write_text("renderer: {type: panorama, image: p.png}\ntrajectory: {type: file, path: pipe}\n"
                                            "camera: {width: 16, height: 12}\n")
        (self.folder / "p.png").write_bytes(PIXEL)
        os.mkfifo(self.folder / "pipe")
        with subprocess.Popen(["sh", "-c", 'printf "%s" "$1" > "$0"', self.folder / "pipe", POSES]):
            result = self.simulate(self.folder / "s.yaml")
        self.assertEqual(result.returncode, 0, result.stderr)
        entries = {pathlib.Path(entry["file"]).name: entry for entry in self.report()["inputs"]}
        self.assertEqual(entries["pipe"], {"file": str(self.folder / "pipe"), "sha256": None, "problem": "is not a regular file"})
        self.assertTrue(entries["p.png"]["sha256"])

    def test_of_a_folder_of_images(self):
        images = self.folder / "images"
        images.mkdir()
        for i in range(3):
            (images / f"{i}.pgm").write_bytes(b"P5 40 40 255\n" + bytes((x * y + 40 * i) % 256 for x in range(40) for y in range(40)))
        (images / "timestamps.txt").write_text("".join(f"{0.01 * i} {i}.pgm\n" for i in range(3)))
        opened = OpenedFiles(images)
        self.addCleanup(opened.close)
        result = run("video", images, "--out", self.out, "--quiet")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(self.inputs(), sums(opened.take()))
        self.assertEqual(len(self.inputs()), 4)

    def test_of_an_interrupted_simulation(self):
        poster = PROJECT / "scenes/poster.yaml"
        process = subprocess.Popen([ESIM, "simulate", poster, "--out", self.out, "--quiet", *settings("duration_s=5000", "output.preview=false")])
        events = pathlib.Path(f"{self.out}.incomplete/cam0/events.h5")
        while not (events.exists() and events.stat().st_size > 100_000):
            self.assertIsNone(process.poll())
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(60), 130)
        self.assertEqual(self.inputs(), sums([poster, PROJECT / "scenes/poster/poster.jpg"]))


class Command(Provenance):
    def test_repeats_the_recording(self):
        folder = self.folder / "it's here; $HOME"
        shutil.copytree(PROJECT / "scenes/poster", folder / "poster")
        shutil.copy(PROJECT / "scenes/poster.yaml", folder)
        result = run("simulate", "poster.yaml", "-o", "out *", "--quiet", *settings(*SHORT, "camera={width: 40, height: 30}"), "--seed", 7, cwd=folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        events = folder / "out */cam0/events.h5"
        before = events.read_bytes()
        report = json.loads((folder / "out */report.json").read_text())
        self.assertEqual(report["working_folder"], str(folder))
        self.assertEqual(shlex.split(report["command"])[:4], [ESIM, "simulate", "poster.yaml", "-o"])
        shutil.rmtree(folder / "out *")
        subprocess.run(["sh", "-c", report["command"]], cwd=report["working_folder"], check=True)
        self.assertEqual(events.read_bytes(), before)

    def test_states_the_sources(self):
        self.assertEqual(self.simulate(PROJECT / "scenes/poster.yaml", *settings(*SHORT)).returncode, 0)
        commit = self.report()["esim_commit"]
        self.assertRegex(commit, r"^(unknown|[0-9a-f]{40}(-dirty)?)$")
        described = subprocess.run(["git", "--no-optional-locks", "describe", "--always", "--abbrev=40", "--exclude=*"], cwd=PROJECT,
                                   capture_output=True, text=True)
        if described.returncode == 0 and (PROJECT / ".git").exists():
            self.assertNotEqual(commit, "unknown")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
