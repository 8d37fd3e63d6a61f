"""The examples of the documentation: the fenced blocks of a page, and a folder in which they run as a reader would run them.

Every block of `sh`, `yaml` and `python` runs, in the order of the page. What cannot run is marked in the line above it, which readers do
not see: `<!-- not run: REASON -->`. Blocks of `console` and `cpp` are never run, and have such a line too.
"""

import os
import pathlib
import re
import shlex
import shutil
import subprocess
from typing import NamedTuple

PROJECT = pathlib.Path(__file__).resolve().parents[2]
SMALL = "--set duration_s=0.1 --set camera.width=64 --set camera.height=48"  # of every simulation
RUN, NEVER_RUN = {"sh", "yaml", "python"}, {"console", "cpp"}
WIDTH, HEIGHT, FPS = 64, 48, 30
# What a scenario of an example needs besides the keys that the example shows.
REST = {
    "renderer": "{type: plane, image: scenes/poster/poster.jpg, width_m: 1.2, pose: {position: [1, 0, 0], look_at: [2, 0, 0]}}",
    "trajectory": "{type: random, position_amplitude_m: [0.1, 0.1, 0.1]}",
    "camera": "{width: 640, height: 480}",
    "duration_s": "0.1",
}
# Files that examples take for the reader's own, and what they are here.
OWN_FILES = {
    "room": "scenes/room", "mine.glb": "scenes/studio_room/baked.glb", "ball.csv": "scenes/studio_room/ball.txt",
    "ball.png": "scenes/sprites/wheel.png", "wall.png": "scenes/sprites/wall.png",
}  # fmt: skip
OWN_MESHES = ("room.obj", "ball.obj", "fan.obj", "screen.obj")  # a triangle
MADE_FILES = {
    "events.h5": "cam0/events.h5", "events.txt": "cam0/events.txt", "recording.aedat4": "recording.aedat4", "my_recording.aedat4": "recording.aedat4", "images": "cam0/images",
    "camchain.yaml": "calibration/camchain.yaml", "imu.yaml": "calibration/imu.yaml",
}  # fmt: skip

# The program, which simulates a short time and few pixels, and whose studio, with an empty page, and servers end by themselves.
PROGRAM = """#!/bin/bash
case "$1" in
  simulate) exec {program} "$@" {small} ;;
  studio) timeout 2 {program} "$@" --page "$(dirname "$0")" || [ $? = 124 ] ;;
  serve) timeout 2 {program} "$@" --port 0 || [ $? = 124 ] ;;
  *) exec {program} "$@" ;;
esac
"""


class Block(NamedTuple):
    language: str
    text: str
    reason: str  # why it does not run; empty if it runs
    line: int

    @property
    def file(self):
        """The name in the first line, `# NAME.yaml` or `# NAME.txt`."""
        name = re.match(r"# ([\w-]+\.(?:yaml|txt))\b", self.text)
        return name and name[1]


def pages():
    return sorted(str(path.relative_to(PROJECT)) for path in [PROJECT / "README.md", *(PROJECT / "docs").rglob("*.md")])


def blocks(page):
    text = (PROJECT / page).read_text()
    found = re.finditer(r"^(?:<!-- not run: ([^\n]+) -->\n)?```([\w-]*)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    return [Block(match[2], match[3], match[1] or "", text.count("\n", 0, match.start(2)) + 1) for match in found]


def video(seconds):
    """A grey ramp that moves to the right, as uncompressed video."""
    frames = []
    for k in range(seconds * FPS + 1):
        luma = bytes((4 * (x - k)) % 200 + 20 for x in range(WIDTH)) * HEIGHT
        frames.append(b"FRAME\n" + luma + bytes([128]) * (WIDTH * HEIGHT // 2))
    return b"YUV4MPEG2 W%d H%d F%d:1 Ip A1:1 C420jpeg\n" % (WIDTH, HEIGHT, FPS) + b"".join(frames)


def make_recording(program, folder):
    """The recording from which MADE_FILES and, for pages that make none, out/room are."""
    subprocess.run([program, "simulate", PROJECT / "scenes/room.yaml", "--out", folder, "--quiet", *shlex.split(SMALL), "--set", "duration_s=1.6",
                    "--set", "imu={}", "--set", "output.formats=[text, aedat4]"], check=True)  # fmt: skip


class Examples:
    """The examples of one page in `folder`, which must be empty. `recording` is that of make_recording()."""

    def __init__(self, page, program, folder, recording):
        self.page, self.folder = page, folder
        self.blocks = [block for block in blocks(page) if block.language in RUN and not block.reason]
        (folder / "scenes").symlink_to(PROJECT / "scenes")
        (folder / "examples").symlink_to(PROJECT / "examples")
        for name, path in OWN_FILES.items():
            (folder / name).symlink_to(PROJECT / path)
        for name in OWN_MESHES:
            (folder / name).write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        commands = "".join(block.text for block in self.blocks)
        for name, path in MADE_FILES.items():
            if f"--out {name}" not in commands:
                (folder / name).symlink_to(recording / path)
        (folder / "clip.mp4").write_bytes(video(1))
        (folder / "slow.mp4").write_bytes(video(4))
        if not re.search(r"--out out/room(?![\w/])", commands):
            shutil.copytree(recording, folder / "out/room")
        for block in blocks(page):
            if block.file:
                (folder / block.file).write_text(block.text)
        (folder / "bin").mkdir()
        (folder / "bin/index.html").touch()
        (folder / "bin/esim").write_text(PROGRAM.format(program=shlex.quote(str(program)), small=SMALL))
        (folder / "bin/esim").chmod(0o755)

    def shell(self, block, command):
        path = f"{self.folder / 'bin'}:{os.environ['PATH']}"
        result = subprocess.run(["bash", "-euo", "pipefail", "-c", command], cwd=self.folder, env={**os.environ, "PATH": path},
                                capture_output=True, text=True, timeout=300)  # fmt: skip
        if result.returncode != 0:
            raise AssertionError(f"{self.page}:{block.line}: failed:\n{block.text}\n{result.stdout}\n{result.stderr}")

    def run(self, run_python=None):
        """Runs all blocks; those of Python by `run_python(block)`, if it is given."""
        for block in self.blocks:
            if block.language == "sh":
                self.shell(block, block.text)
            elif block.language == "yaml" and "randomise:" not in block.text:
                keys = re.findall(r"^(\w+):", block.text, re.MULTILINE)
                rest = "".join(f"{key}: {value}\n" for key, value in REST.items() if key not in keys)
                (self.folder / "block.yaml").write_text(block.text + rest)
                self.shell(block, "esim check block.yaml")
            elif block.language == "python" and run_python:
                run_python(block)
