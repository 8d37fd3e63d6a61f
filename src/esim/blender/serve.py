# Renders the open scene of Blender for clients with UnrealCV's protocol, on the loopback interface only:
#   blender --background room.blend --python serve.py -- --port 9000
# docs/methods/engines.md lists the commands. engine.py renders.
import argparse
import contextlib
import io
import math
import os
import re
import select
import signal
import socket
import struct
import sys
import time

if "esim_open" not in globals():  # run directly; esim concatenates the files
    for _part in ("legacy.py", "common.py", "engine.py"):
        with open(os.path.join(os.path.dirname(os.path.realpath(__file__)), _part)) as _file:
            exec(_file.read())

import bpy
import numpy as np

MAGIC = 0x9E2B83C1
LONGEST_REQUEST = 1 << 16  # bytes
LARGEST_SIDE, MAX_PIXELS = 16384, 1 << 26
MAX_HEADS = 64  # of arrays, in the cache
FARTHEST = 1e9  # m; Blender writes 1e10 where no surface is visible


# --- commands ---------------------------------------------------------------------------------------------------------

def colour_of(number):
    """Returns the colour of an object in masks: its number, in red and green. Other pixels are black."""
    return number & 255, number >> 8, 0


def numbers(text, count):
    parts = text.split()
    values = tuple(float(part) for part in parts) if len(parts) == count else ()
    if len(values) != count or not all(math.isfinite(value) for value in values):
        raise CommandError(f"this command requires {count} finite numbers")
    return values


def spell(*values):
    return " ".join(f"{value:.9g}" for value in values)


class Commands:
    """Answers requests with text, bytes, or a sequence of bytes."""

    def __init__(self, engine):
        self.engine = engine
        self.views = {"0": engine.first}
        self.buffers, self.heads = {}, {}
        self.seconds_answering = 0.0  # from receiving a request to sending its answer
        number = r"/camera/(\d{1,2})"
        self.table = [(re.compile(pattern + r"\Z", re.IGNORECASE), answer) for pattern, answer in (
            (r"vget /unrealcv/status", self.status),
            (r"vget /unrealcv/version", lambda: "esim for Blender " + bpy.app.version_string),
            (r"vget /objects", lambda: " ".join(engine.objects)),
            (r"vget /object/(.+)/location", lambda name: spell(*pose_of(self.object(name))[0])),
            (r"vget /object/(.+)/rotation", lambda name: spell(*pose_of(self.object(name))[1])),
            (r"vget /object/(.+)/color", self.colour),
            (r"vset /object/(.+)/location (.+)", lambda name, text: self.move(name, location=text)),
            (r"vset /object/(.+)/rotation (.+)", lambda name, text: self.move(name, rotation=text)),
            (r"vrun r\.setres (\d{1,5})x(\d{1,5})[wf]?", self.resize),
            (r"vrun esim\.samples (\d{1,5})", self.set_samples),
            (r"vrun esim\.seed (\d{1,9})", self.set_seed),
            (rf"vset {number}/size (\d{{1,5}}) (\d{{1,5}})", lambda _, width, height: self.resize(width, height)),
            (rf"vget {number}/size", lambda _: spell(*engine.size)),
            (rf"vget {number}/pose", lambda i: spell(*self.view(i).location, *self.view(i).rotation)),
            (rf"vget {number}/location", lambda i: spell(*self.view(i).location)),
            (rf"vget {number}/rotation", lambda i: spell(*self.view(i).rotation)),
            (rf"vget {number}/(?:horizontal_fieldofview|fov)", lambda i: spell(self.view(i).field_of_view)),
            (rf"vset {number}/pose (.+)", self.set_pose),
            (rf"vset {number}/location (.+)", lambda i, text: self.set(i, "location", numbers(text, 3))),
            (rf"vset {number}/rotation (.+)", lambda i, text: self.set(i, "rotation", numbers(text, 3))),
            (rf"vset {number}/(?:horizontal_fieldofview|fov) (.+)", self.set_field_of_view),
            (rf"vget {number}/lit npy", lambda i: self.npy(self.lit(i))),
            (rf"vget {number}/luminance npy", self.luminance),
            (rf"vget {number}/lit png", self.lit_png),
            (rf"vget {number}/plane_depth npy", lambda i: self.npy(self.depth(i))),
            (rf"vget {number}/depth npy", self.ray_length),
            (rf"vget {number}/object_mask npy", lambda i: self.npy(self.ids(i))),
            (rf"vget {number}/object_mask png", self.mask_png),
        )]

    def answer(self, command):
        for pattern, answer in self.table:
            match = pattern.match(command.strip())
            if match:
                try:
                    result = answer(*match.groups())
                    return "ok" if result is None else result
                except (CommandError, ValueError, RuntimeError, MemoryError) as error:
                    return f"error {error}"
        return f"error unknown command '{command[:200]}'"

    def status(self):
        engine = self.engine
        return (f"Blender {bpy.app.version_string}, {engine.scene.render.engine.lower()}, {engine.samples} samples, "
                f"{engine.size[0]}x{engine.size[1]}; {engine.renders} renderings in {engine.seconds_rendering:.6f} s, "
                f"{self.seconds_answering - engine.seconds_rendering:.6f} s beside")

    def view(self, camera):
        return self.views.setdefault(camera, View())

    def render(self, camera):
        return self.engine.render(self.view(camera))

    def set(self, camera, what, value):
        setattr(self.view(camera), what, value)

    def set_pose(self, camera, text):
        values = numbers(text, 6)
        view = self.view(camera)
        view.location, view.rotation = values[:3], values[3:]

    def set_field_of_view(self, camera, text):
        degrees, = numbers(text, 1)
        if not 0.5 <= degrees <= 172:
            raise CommandError("the field of view must be from 0.5 to 172 degrees")
        self.view(camera).field_of_view = degrees

    def resize(self, width, height):
        width, height = int(width), int(height)
        if not (4 <= width <= LARGEST_SIDE and 4 <= height <= LARGEST_SIDE and width * height <= MAX_PIXELS):
            raise CommandError(f"images must have at least 4x4 pixels, at most {LARGEST_SIDE} per side and "
                               f"{MAX_PIXELS} in total")
        self.engine.size = width, height

    def set_samples(self, count):
        self.engine.samples = max(1, int(count))

    def set_seed(self, seed):
        self.engine.seed = int(seed)

    def move(self, name, location=None, rotation=None):
        self.engine.move(spoken_name(name), location and numbers(location, 3), rotation and numbers(rotation, 3))

    def object(self, name):
        return self.engine.object(spoken_name(name))

    def colour(self, name):
        self.object(name)
        red, green, blue = colour_of(self.engine.ids[spoken_name(name)])
        return f"(R={red},G={green},B={blue},A=255)"

    def npy(self, array):
        """Returns a NumPy file in two parts; the pixels are copied only if they are not contiguous."""
        array, kind = np.ascontiguousarray(array), (array.dtype, array.shape)
        if kind not in self.heads:
            head = io.BytesIO()
            np.lib.format.write_array_header_1_0(head, np.lib.format.header_data_from_array_1_0(array))
            if len(self.heads) == MAX_HEADS:
                self.heads.clear()
            self.heads[kind] = head.getvalue()
        return self.heads[kind], array.data.cast("B")

    def lit(self, camera):
        return self.render(camera)["light"][:, ::-1].swapaxes(1, 2)

    def buffer(self, name):
        """Returns an array with a float per pixel in reused memory, since new memory takes time."""
        shape = self.engine.size[::-1]
        if name not in self.buffers or self.buffers[name].shape != shape:
            self.buffers[name] = np.empty(shape, np.float32)
        return self.buffers[name]

    def luminance(self, camera):
        """Returns the luminance of Rec. 709: one channel, a third of the data."""
        shares = np.array([0.0722, 0.7152, 0.2126], np.float32)
        return self.npy(np.matmul(shares, self.render(camera)["light"], out=self.buffer("luminance")))

    def depth(self, camera):
        depth = self.buffer("depth")
        np.copyto(depth, self.render(camera)["depth"])
        depth[depth > FARTHEST] = np.inf
        return depth

    def lit_png(self, camera):
        return esim_png(np.round(esim_srgb(self.lit(camera)) * 255).astype(np.uint8))

    def ray_length(self, camera):
        depth = self.depth(camera)
        height, width = depth.shape
        focal = width / 2 / math.tan(math.radians(self.view(camera).field_of_view) / 2)
        x = (np.arange(width, dtype=np.float32) - (width - 1) / 2) / focal
        y = (np.arange(height, dtype=np.float32) - (height - 1) / 2) / focal
        return self.npy(depth * np.sqrt(1 + x[None, :] ** 2 + y[:, None] ** 2).astype(np.float32))

    def ids(self, camera):
        if "ids" not in self.render(camera):
            raise CommandError("Eevee renders no object masks; use --engine cycles")
        return self.render(camera)["ids"].astype(np.uint16)

    def mask_png(self, camera):
        colours = np.array([colour_of(number) for number in range(len(self.engine.ids) + 1)], np.uint8)
        return esim_png(colours[self.ids(camera)])


# --- connections ------------------------------------------------------------------------------------------------------

class Client:
    def __init__(self, connection, commands):
        self.connection, self.commands, self.received = connection, commands, bytearray()
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.send(b"connected to Blender")

    def send(self, *parts):
        head = struct.pack("<II", MAGIC, sum(len(part) for part in parts))
        self.connection.sendall(b"".join((head, *parts[:-1])))
        self.connection.sendall(parts[-1])

    def serve(self):
        """Answers received requests. False if the client has disconnected, or violates the protocol."""
        data = self.connection.recv(1 << 16)
        begin = time.perf_counter()
        self.received += data
        while len(self.received) >= 8:
            magic, size = struct.unpack_from("<II", self.received)
            if magic != MAGIC or not 0 < size <= LONGEST_REQUEST:
                print(f"esim: a client sent magic {magic:#x} and size {size}; closing", file=sys.stderr)
                return False
            if len(self.received) < 8 + size:
                break
            message = bytes(self.received[8:8 + size])
            del self.received[:8 + size]
            match = re.match(rb"(\d{1,8}):(.*)\Z", message, re.DOTALL)
            if match:
                answer = self.commands.answer(match[2].decode("utf-8", "replace"))
                parts = answer if isinstance(answer, tuple) else (answer.encode() if isinstance(answer, str) else answer,)
                self.send(match[1], b":", *parts)
        self.commands.seconds_answering += time.perf_counter() - begin
        return len(data) > 0


def serve(listener, commands, once, parent):
    """Serves one client at a time, and closes other connections."""
    client = None
    while os.getppid() == parent or not once:
        ready = select.select([listener] + ([client.connection] if client else []), [], [], 1.0)[0]
        try:
            if client and client.connection in ready and not client.serve():
                raise ConnectionError
        except OSError:
            client.connection.close()
            client = None
            if once:
                return
        if listener in ready:
            connection, _ = listener.accept()
            if client is None:
                try:
                    client = Client(connection, commands)
                except OSError:
                    connection.close()
            else:
                connection.close()


def parse(arguments):
    def size(text):
        match = re.match(r"(\d{1,5})x(\d{1,5})\Z", text)
        if not match:
            raise argparse.ArgumentTypeError("must be WIDTHxHEIGHT, such as 640x480")
        return int(match[1]), int(match[2])

    def count(text):
        if not 1 <= int(text) <= 65536:
            raise argparse.ArgumentTypeError("must be from 1 to 65536")
        return int(text)

    parser = argparse.ArgumentParser(prog="serve.py", description="Renders a scene for clients of UnrealCV's protocol.")
    parser.add_argument("--scene", help="scene file, unless Blender has already opened one")
    parser.add_argument("--port", type=int, default=9000, help="TCP port; 0: any free port")
    parser.add_argument("--engine", choices=("cycles", "eevee"), default="cycles")
    parser.add_argument("--samples", type=count, default=16, help="samples per pixel")
    parser.add_argument("--size", type=size, default=(640, 480), help="initial image size, WIDTHxHEIGHT")
    parser.add_argument("--seed", type=int, default=0, help="seed of the path tracer's noise")
    parser.add_argument("--threads", type=int, default=0, help="number of threads; 0: one per processor")
    parser.add_argument("--persistent", action=argparse.BooleanOptionalAction, default=True,
                        help="keep the scene's data between renderings: faster, but needs more memory")
    parser.add_argument("--once", action="store_true",
                        help="exit when the first client disconnects, or when the parent process ends")
    return parser.parse_args(arguments)


def main():
    parent = os.getppid()
    with contextlib.suppress(OSError):
        os.rmdir(bpy.app.tempdir)  # empty; it would remain if Blender is killed
    options = parse(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else [])
    if options.scene:
        if not os.path.isfile(options.scene):
            raise RuntimeError(f"Error: {options.scene}: no such file")
        esim_open(options.scene)
    elif not bpy.data.filepath:
        raise RuntimeError("Error: no scene is open; name a .blend file that Blender can read, or give --scene")
    if not has_light(bpy.context.scene):
        esim_warn("the scene has no light: everything will be black")
    engine = Engine(options)
    listener = socket.socket()
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind(("127.0.0.1", options.port))
    except (OSError, OverflowError) as error:
        raise RuntimeError(f"Error: port {options.port} of 127.0.0.1: {error}; choose another with --port") from None
    listener.listen(8)
    print(f"esim serving 127.0.0.1:{listener.getsockname()[1]}", flush=True)
    # From here on, Blender's messages about every rendering would fill a pipe that is no longer read.
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        serve(listener, Commands(engine), options.once, parent)
    except KeyboardInterrupt:
        pass


main()
