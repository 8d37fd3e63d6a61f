"""The documentation as its readers meet it: its commands run, its scenarios are right, its options exist.

Run as: docs_test.py ESIM_PROGRAM PROJECT_FOLDER, with the standard library of Python alone. Of a page, blocks of `sh` are run one after
the other in a folder that holds `scenes`, `clip.mp4` and a program `esim`, which simulates a short time and few pixels; blocks that begin
with `# NAME.yaml` or `# NAME.txt` are files of that folder. What is not to be run is a block of `console`.
"""

import os
import pathlib
import re
import shlex
import subprocess
import sys
import unittest

from program import ESIM, ProgramTest, run

PROJECT = pathlib.Path(sys.argv[2]).absolute()
SMALL = "--set duration_s=0.1 --set camera.width=64 --set camera.height=48"
MIGRATING = ["docs/migrating.md", "docs/migrating-rpg-esim.md", "docs/migrating-video.md"]  # pages with tables of options
WIDTH, HEIGHT, FRAMES, FPS = 64, 48, 31, 30


def blocks(page):
    """The fenced blocks of a page: language and text."""
    return re.findall(r"^```(\w*)\n(.*?)^```$", (PROJECT / page).read_text(), re.MULTILINE | re.DOTALL)


def file_of(block):
    name = re.match(r"# ([\w-]+\.(?:yaml|txt))\b", block)
    return name and name[1]


def anchors(page):
    """The anchors of its headings, as GitHub names them."""
    text = re.sub(r"^```.*?^```$", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w -]", "", re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading)).strip().lower().replace(" ", "-") for heading in headings}


def option_in(token):
    """The key and the value that `--set key=value` or `path.to.key=value` name, if it is one."""
    setting = re.fullmatch(r"--set ([a-z_]+)(?:=(.*))?|((?!.*\.(?:csv|txt|mp4|conf)$)[a-z_]+(?:\.[a-z_]+)+)(?:=(.*))?", token)
    return (setting[1] or setting[3], setting[2] or setting[4]) if setting else (None, None)


def video():
    """A grey ramp that moves to the right, as uncompressed video."""
    frames = []
    for k in range(FRAMES):
        luma = bytes((4 * (x - k)) % 200 + 20 for x in range(WIDTH)) * HEIGHT
        frames.append(b"FRAME\n" + luma + bytes([128]) * (WIDTH * HEIGHT // 2))
    return b"YUV4MPEG2 W%d H%d F%d:1 Ip A1:1 C420jpeg\n" % (WIDTH, HEIGHT, FPS) + b"".join(frames)


class Pages(ProgramTest):
    def setUp(self):
        super().setUp()
        (self.folder / "scenes").symlink_to(PROJECT / "scenes")
        (self.folder / "clip.mp4").write_bytes(video())
        program = self.folder / "bin" / "esim"
        program.parent.mkdir()
        program.write_text(f'#!/bin/sh\ncase "$1" in simulate) exec {shlex.quote(ESIM)} "$@" {SMALL} ;; esac\nexec {shlex.quote(ESIM)} "$@"\n')
        program.chmod(0o755)

    def run_page(self, page):
        found = blocks(page)
        for _, text in found:
            if file_of(text):
                (self.folder / file_of(text)).write_text(text)
        commands = [text for language, text in found if language == "sh"]
        self.assertGreater(len(commands), 0)
        path = f"{self.folder / 'bin'}:{os.environ['PATH']}"
        for text in commands:
            result = subprocess.run(["bash", "-euo", "pipefail", "-c", text], cwd=self.folder, env={**os.environ, "PATH": path},
                                    capture_output=True, text=True, timeout=300)
            self.assertEqual(result.returncode, 0, f"{page}:\n{text}\n{result.stderr}")

    def test_getting_started(self):
        self.run_page("docs/getting-started.md")
        for path in re.findall(r"`(out/[\w./]+\.\w+)`", (PROJECT / "docs/getting-started.md").read_text()):
            self.assertTrue((self.folder / path).exists(), f"docs/getting-started.md names {path}, which no command makes")

    def test_migrating(self):
        for page in ("docs/migrating.md", "docs/migrating-rpg-esim-examples.md", "docs/migrating-video.md"):
            self.run_page(page)

    def test_motion(self):
        self.run_page("docs/motion.md")

    def test_waypoints(self):
        self.run_page("docs/waypoints.md")

    def test_sampling(self):
        self.run_page("docs/sampling.md")

    def test_sensors(self):
        self.run_page("docs/pixel.md")


class Options(unittest.TestCase):
    def test_every_option_that_migrating_names_exists(self):
        """Second columns of its tables: `--flags` of the commands, and the last part of every `key.of.a.scenario`."""
        flags = set(re.findall(r"--[a-z-]+", "".join(run(command, "--help").stdout for command in ("simulate", "video"))))
        options = run("options").stdout
        names = set(re.findall(r"^ *(\w+):", options, re.MULTILINE))
        values = set(re.findall(r"[\w.-]+", options))
        lines = [line for page in MIGRATING for line in (PROJECT / page).read_text().splitlines()]
        rows = [line.split(" | ") for line in lines if line.startswith("| ")]
        found = 0
        for row in rows:
            for token in re.findall(r"`([^`]+)`", row[1]):
                for flag in re.findall(r"--[a-z-]+", token):
                    self.assertIn(flag, flags, row)
                    found += 1
                key, value = option_in(token)
                if key:
                    self.assertIn(key.split(".")[-1], names, row)
                    self.assertTrue(not value or value in values, row)
                    found += 1
        self.assertGreater(found, 90, "the tables are not read as they should be")


class Links(unittest.TestCase):
    def test_every_link_leads_somewhere(self):
        for page in [*PROJECT.glob("*.md"), *(PROJECT / "docs").rglob("*.md")]:
            for target, anchor in re.findall(r"\]\(([^)#\s]*)(?:#([\w-]*))?\)", page.read_text()):
                if "://" not in target:
                    path = page.parent / target if target else page
                    self.assertTrue(path.exists(), f"{page.relative_to(PROJECT)} links to {target}")
                    if anchor:
                        self.assertIn(anchor, anchors(path), f"{page.relative_to(PROJECT)} links to {target}#{anchor}")

    def test_the_readme_lists_every_page(self):
        listed = set(re.findall(r"\]\((docs/[\w/-]+\.md)\)", (PROJECT / "README.md").read_text()))
        self.assertEqual({str(page.relative_to(PROJECT)) for page in (PROJECT / "docs").rglob("*.md")}, listed)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
