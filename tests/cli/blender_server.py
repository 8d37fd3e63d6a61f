"""Blender with the script that serves, a scene for it, and a client of UnrealCV's protocol."""

import ast
import os
import re
import select
import shutil
import socket
import struct
import subprocess

BLENDER = shutil.which("blender")
MAGIC = 0x9E2B83C1
# Debian's Blender takes the first Python on PATH, which may be one that lacks the system's modules.
ENVIRONMENT = {**os.environ, "PATH": "/usr/bin:/bin:" + os.environ["PATH"]}


# Walls at 4 m; a box of 0.4 m in front of +x, right and up of the middle, and a small one that hangs on it.
SCENE = """
import bpy, sys
bpy.ops.wm.read_factory_settings(use_empty=True)

def shining(name, strength):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    emission = tree.nodes.new("ShaderNodeEmission")
    emission.inputs["Color"].default_value = (1, 1, 1, 1)
    emission.inputs["Strength"].default_value = strength
    tree.links.new(tree.nodes["Material Output"].inputs["Surface"], emission.outputs["Emission"])
    return material

def box(name, size, place, light):
    bpy.ops.mesh.primitive_cube_add(size=1, location=place)
    thing = bpy.context.object
    thing.name, thing.scale = name, size
    thing.data.materials.append(shining(name, light))
    return thing

kind = sys.argv[sys.argv.index("--") + 2]
if kind == "filmed":
    bpy.ops.object.camera_add(rotation=(1.5707963, 0, -1.5707963))  # along x, z is up
    camera = bpy.context.object
    camera.data.angle = 1.5707963
    for frame, y in ((1, 0.0), (25, 0.5)):
        camera.location[1] = y
        camera.keyframe_insert("location", frame=frame)
    for curve in camera.animation_data.action.fcurves:
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    bpy.context.scene.frame_end = 25
if kind != "dark":
    for axis in range(3):
        for sign in (1, -1):
            size, place = [8.2] * 3, [0.0] * 3
            size[axis], place[axis] = 0.2, sign * 4.1
            box("wall " + "xyz"[axis] + "+-"[sign < 0], size, place, 0.1 + 0.2 * axis + (0.1 if sign < 0 else 0))
    target = box("Box", (0.4, 0.4, 0.4), (2.2, -1, 1), 2.0)
    part = box("Part", (0.1, 0.1, 0.1), (2.2, -1, 1.3), 2.0)
    part.parent = target
    part.matrix_parent_inverse = target.matrix_world.inverted()
    for thing in bpy.context.scene.objects:
        if thing.name.startswith("wall"):
            thing.keyframe_insert("location", frame=1)
else:
    bpy.ops.mesh.primitive_cube_add(size=1)
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[sys.argv.index("--") + 1])
"""


def make_scene(folder, kind):
    """FOLDER/KIND.blend; a bright one has the walls and the box, a filmed one also a camera that moves 0.5 m along y in a
    second, a dark one a cube without light."""
    script, blend = folder / "scene.py", folder / f"{kind}.blend"
    script.write_text(SCENE)
    subprocess.run([BLENDER, "--background", "--factory-startup", "--python", script, "--", blend, kind], check=True, capture_output=True,
                   env=ENVIRONMENT)
    return blend


class Client:
    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=60)
        self.id = 0

    def take(self, size):
        data, have = bytearray(size), 0
        while have < size:
            count = self.socket.recv_into(memoryview(data)[have:])
            if count == 0:
                raise EOFError
            have += count
        return data

    def receive(self):
        magic, size = struct.unpack("<II", self.take(8))
        assert magic == MAGIC
        return self.take(size)

    def ask_all(self, commands):
        """Sends all at once, then takes the answers."""
        first, message = self.id, b""
        for command in commands:
            payload = f"{self.id}:{command}".encode()
            message += struct.pack("<II", MAGIC, len(payload)) + payload
            self.id += 1
        self.socket.sendall(message)
        answers = []
        for number in range(first, self.id):
            head, body = self.receive().split(b":", 1)
            assert int(head) == number
            answers.append(body)
        return answers

    def ask(self, command):
        return self.ask_all([command])[0]

    def text(self, command):
        return self.ask(command).decode()

    def numbers(self, command):
        return [float(part) for part in self.text(command).split()]

    def array(self, command):
        """Rows of pixels; a pixel with several channels is a tuple."""
        data = self.ask(command)
        if data[:6] != b"\x93NUMPY":
            raise AssertionError(data[:200])
        size, = struct.unpack("<H", data[8:10])
        head = ast.literal_eval(data[10:10 + size].decode())
        kind = {"<f4": "f", "<u2": "H"}[head["descr"]]
        values = struct.unpack(f"<{(len(data) - 10 - size) // struct.calcsize(kind)}{kind}", data[10 + size:])
        height, width, *channels = head["shape"]
        if channels:
            values = list(zip(*[iter(values)] * channels[0]))
        return [list(values[row * width:(row + 1) * width]) for row in range(height)]


class Serving:
    """Blender with the script. Its first words are awaited."""

    def __init__(self, scripts, scene, *arguments):
        command = [BLENDER, "--background", "--factory-startup", *([scene] if scene else []), "--python-exit-code", "3",
                   "--python", scripts / "serve.py", "--", "--port", "0", *arguments]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)
        self.said, self.port = "", None
        while self.port is None:
            if not select.select([self.process.stdout], [], [], 60)[0]:
                raise TimeoutError
            line = self.process.stdout.readline()
            if not line:
                break
            self.said += line
            match = re.match(r"esim serving 127\.0\.0\.1:(\d+)$", line)
            self.port = int(match[1]) if match else None

    def end(self):
        self.process.terminate()
        self.process.communicate(timeout=20)
