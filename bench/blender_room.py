"""Measures the studio room in Blender's Cycles: what the server adds to each image, the path tracer's noise, a second
simulated with keyframes, and its brightness against a rendering at 1 kHz.

    python3 bench/blender_room.py build/release/esim [OUT [overhead] [noise] [keyframes] [accuracy]]

Takes some ten minutes on two processors. Needs Blender; Python's standard library alone.
"""

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
        self.client.receive()

    def seconds(self):
        """(renderings, seconds in Blender with writing its file, seconds reading that)."""
        found = re.search(r"(\d+) renderings in ([\d.]+) s, read in ([\d.]+) s", self.client.text("vget /unrealcv/status"))
        return int(found[1]), float(found[2]), float(found[3])

    def end(self):
        self.client.socket.close()
        self.server.end()


def overhead():
    session = Session("--samples", "1")
    beyond, reading = [], []
    for i in range(30):
        _, rendered, read = session.seconds()
        start = time.perf_counter()
        session.client.ask_all([f"vset /camera/0/pose {155 + 0.1 * i} 200 150 -9 -117 0", "vget /camera/0/lit npy",
                                "vget /camera/0/plane_depth npy"])
        wall = time.perf_counter() - start
        _, rendered_now, read_now = session.seconds()
        beyond.append(wall - (rendered_now - rendered))
        reading.append(read_now - read)
    session.end()
    print(f"pose + lit npy + depth npy at {SIZE[0]}x{SIZE[1]}: {1e3 * statistics.median(beyond):.2f} ms beyond Blender's rendering, of which "
          f"{1e3 * statistics.median(reading):.2f} ms read Blender's file")


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


def accuracy(esim, out):
    subprocess.run([esim, "evaluate", "sampling", PROJECT / "scenes" / "studio_room.yaml", "--out", out / "accuracy", "--force", "--quiet",
                    "--set", "start_s=0.5", "--set", "duration_s=0.02", "--truth-rate", "1000", "--pixels", "all", "--event-span", "0",
                    "--window", "0.02", "--scheme", "keyframes supersampling=2 tolerance=1"], check=True)
    print((out / "accuracy" / "report.md").read_text())


def main():
    esim, out = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else "out/blender_room").resolve()
    out.mkdir(parents=True, exist_ok=True)
    if not (ROOM / "studio_room.blend").exists():
        subprocess.run([BLENDER, "--background", "--factory-startup", "--python", ROOM / "make_room.py"], check=True,
                       capture_output=True, env=ENVIRONMENT)
    steps = {"overhead": overhead, "noise": lambda: noise(16), "keyframes": lambda: keyframes(esim, out), "accuracy": lambda: accuracy(esim, out)}
    for step in sys.argv[3:] or steps:
        steps[step]()


main()
