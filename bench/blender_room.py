"""Measures the studio room in Blender's Cycles: what the server adds to each image, the path tracer's noise, a second
simulated with keyframes, and its brightness against a rendering at 1 kHz.

    python3 bench/blender_room.py build/release/esim [OUT [overhead] [noise] [keyframes] [accuracy]] [--span 0.4] [--speed 20]

`accuracy` compares over --span seconds of the room's motion, played --speed times as fast: the image moves by some 30 px/s
of the motion's own time, and 1 kHz of the faster one are fewer renderings for as many pixels of motion. Takes some
ten minutes on two processors. Needs Blender; Python's standard library alone.
"""

import argparse
import array
import json
import math
import pathlib
import re
import statistics
import subprocess
import sys
import time

PROJECT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(PROJECT / "tests" / "cli"))

from blender_server import BLENDER, ENVIRONMENT, Client, Serving  # noqa: E402

SCRIPTS, ROOM = PROJECT / "src" / "esim" / "blender", PROJECT / "scenes" / "studio_room"
LOG_EPS = 0.001  # as the scenario's
SIZE = (346, 260)


class Session:
    """A server with the room, and its client."""

    def __init__(self, *arguments):
        self.server = Serving(SCRIPTS, ROOM / "studio_room.blend", "--size", "{}x{}".format(*SIZE), *arguments)
        self.connect()

    def connect(self):
        self.client = Client(self.server.port)
        self.client.socket.settimeout(600)
        self.client.receive()

    def seconds(self):
        """(renderings, seconds in Blender including writing its file, other seconds of the server)."""
        found = re.search(r"(\d+) renderings in ([\d.]+) s, ([\d.]+) s beside", self.client.text("vget /unrealcv/status"))
        return int(found[1]), float(found[2]), float(found[3])

    def end(self):
        self.client.socket.close()
        self.server.end()


def overhead():
    session = Session("--samples", "1")
    beyond, rendering, serving = [], [], []
    for i in range(30):
        _, rendered, served = session.seconds()
        start = time.perf_counter()
        session.client.ask_all([f"vset /camera/0/pose {155 + 0.1 * i} 200 150 -9 -117 0", "vget /camera/0/luminance npy",
                                "vget /camera/0/plane_depth npy"])
        wall = time.perf_counter() - start
        _, rendered_now, served_now = session.seconds()
        rendering.append(rendered_now - rendered)
        beyond.append(wall - rendering[-1])
        serving.append(served_now - served)
    session.end()
    print(f"pose + luminance npy + plane_depth npy at {SIZE[0]}x{SIZE[1]}, medians: {1e3 * statistics.median(rendering):.1f} ms in Blender, "
          f"with 1 sample; {1e3 * statistics.median(serving):.2f} ms of the server beside; {1e3 * statistics.median(beyond):.2f} ms beside with "
          "this client and its status")


def brightness(session):
    data = session.client.ask("vget /camera/0/lit npy")
    size = int.from_bytes(data[8:10], "little")
    light = array.array("f", data[10 + size:])
    return [math.log(0.2126 * light[i] + 0.7152 * light[i + 1] + 0.0722 * light[i + 2] + LOG_EPS) for i in range(0, len(light), 3)]


def noise(samples):
    """RMSE of L between two renderings of one view that differ in their noise alone."""
    images = []
    for seed in ("1", "2"):
        session = Session("--samples", str(samples), "--seed", seed)
        session.client.ask("vset /camera/0/pose 155 200 150 -9 -117 0")
        images.append(brightness(session))
        session.end()
    rmse = math.sqrt(statistics.fmean((a - b) ** 2 for a, b in zip(*images)))
    mean = statistics.fmean(abs(a - b) for a, b in zip(*images))
    print(f"noise of {samples} samples per pixel, between two renderings: mean |difference of L| {mean:.4f} (of many instants: the mean RMSE), "
          f"RMSE {rmse:.4f}, of one rendering {rmse / 2 ** 0.5:.4f}")


def keyframes(esim, out):
    session = Session("--samples", "16")
    session.client.socket.close()
    recording = out / "second"
    start = time.perf_counter()
    subprocess.run([esim, "simulate", PROJECT / "scenes" / "studio_room.yaml", "--out", recording, "--force", "--quiet", "--set",
                    "duration_s=1", "--set", "truth.rate_hz=0", "--set", f"renderer.address=127.0.0.1:{session.server.port}"], check=True)
    wall = time.perf_counter() - start
    session.connect()
    renderings, rendering, _ = session.seconds()
    session.end()
    camera = json.loads((recording / "report.json").read_text())["cameras"][0]
    print(f"1 s with keyframes: {camera['frames']} images sampled, {renderings} rendered in {rendering:.1f} s, wall {wall:.1f} s "
          f"= {wall / rendering:.2f} of it; {camera['events']} events; measured error {camera['measured_error']}")


START = 0.5  # s, of the motion's own time


def poses(name):
    """(t, place, quaternion) of each line of a trajectory."""
    lines = [[float(part) for part in line.split()] for line in (ROOM / name).read_text().splitlines() if not line.startswith("#")]
    return [(line[0], line[1:4], line[4:]) for line in lines]


def rotated(q, v):
    x, y, z, w = q
    t = [2 * part for part in (y * v[2] - z * v[1], z * v[0] - x * v[2], x * v[1] - y * v[0])]
    return [v[0] + w * t[0] + y * t[2] - z * t[1], v[1] + w * t[1] + z * t[0] - x * t[2], v[2] + w * t[2] + x * t[1] - y * t[0]]


def unreal(place, forward, right, up):
    """As in vset pose, of a thing with these axes in the room."""
    pitch = math.atan2(forward[2], math.hypot(forward[0], forward[1]))
    roll = math.atan2(-right[2], up[2])
    return " ".join(f"{value:.8f}" for value in (100 * place[0], -100 * place[1], 100 * place[2], math.degrees(pitch),
                                                 math.degrees(math.atan2(-forward[1], forward[0])), math.degrees(roll)))


def noise_along(span):
    """The mean over the pixels of the RMSE of L over the span, of two renderings of the same views: one whose noise stands
    still on the sensor, as in the reference, and one whose noise is another each time."""
    session = Session("--samples", "16")
    session.client.ask("vset /camera/0/fov 75")
    squares, count = None, 0
    lines = [pair for pair in zip(poses("camera.txt"), poses("ball.txt")) if START < pair[0][0] <= START + span + 1e-9]
    for (_, place, q), (_, ball, turn) in lines[::max(1, len(lines) // 10)]:
        right, down, forward = (rotated(q, axis) for axis in ([1, 0, 0], [0, 1, 0], [0, 0, 1]))
        x, y, z = (rotated(turn, axis) for axis in ([1, 0, 0], [0, 1, 0], [0, 0, 1]))
        ball_pose = unreal(ball, x, [-part for part in y], z).split()
        session.client.ask_all(["vset /camera/0/pose " + unreal(place, forward, right, [-part for part in down]),
                                "vset /object/Ball/location " + " ".join(ball_pose[:3]), "vset /object/Ball/rotation " + " ".join(ball_pose[3:])])
        images = []
        for seed in (0, count + 1):
            session.client.ask(f"vrun esim.seed {seed}")
            images.append(brightness(session))
        squares = [(a - b) ** 2 + (0 if squares is None else squares[i]) for i, (a, b) in enumerate(zip(*images))]
        count += 1
    session.end()
    return statistics.fmean(math.sqrt(value / count) for value in squares), count


def accuracy(esim, out, span, speed):
    slower = [f"--set={key}time_scale={1 / speed}" for key in ("trajectory.", "renderer.objects.0.trajectory.")]
    subprocess.run([esim, "evaluate", "sampling", PROJECT / "scenes" / "studio_room.yaml", "--out", out / "accuracy", "--force", "--quiet",
                    "--set", f"start_s={START / speed}", "--set", f"duration_s={span / speed}", *slower, "--truth-rate", "1000", "--pixels", "all",
                    "--event-span", "0", "--window", str(span / speed), "--scheme", "keyframes supersampling=2 tolerance=1"], check=True)
    print((out / "accuracy" / "report.md").read_text())
    floor, views = noise_along(span)
    print(f"noise between two renderings of {views} views of these {span:g} s: mean RMSE of L {floor:.4f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("esim", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path, nargs="?", default="out/blender_room")
    parser.add_argument("steps", nargs="*", choices=[[], "overhead", "noise", "keyframes", "accuracy"])
    parser.add_argument("--span", type=float, default=0.4)
    parser.add_argument("--speed", type=float, default=20)
    arguments = parser.parse_args()
    esim, out = arguments.esim.resolve(), arguments.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    if not (ROOM / "studio_room.blend").exists():
        subprocess.run([BLENDER, "--background", "--factory-startup", "--python", ROOM / "make_room.py"], check=True,
                       capture_output=True, env=ENVIRONMENT)
    steps = {"overhead": overhead, "noise": lambda: noise(16), "keyframes": lambda: keyframes(esim, out),
             "accuracy": lambda: accuracy(esim, out, arguments.span, arguments.speed)}
    for step in arguments.steps or steps:
        steps[step]()


main()
