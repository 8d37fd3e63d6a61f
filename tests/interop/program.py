"""Shared by the interoperation tests. Their first argument is the path of the program. Missing packages skip a test."""

import importlib
import os
import pathlib
import random
import shutil
import subprocess
import sys
import tempfile
import unittest

ESIM = os.path.abspath(sys.argv[1])
SKIPPED = 77


def need(*modules):
    """Ends the test as skipped unless all of these modules can be imported."""
    for module in modules:
        try:
            importlib.import_module(module)
        except ImportError as error:
            print(f"skipped: {error}: see tests/interop/requirements.txt")
            sys.exit(SKIPPED)


class InteropTest(unittest.TestCase):
    """A test with a temporary folder."""

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="esim_interop_"))
        self.addCleanup(shutil.rmtree, self.folder)

    def convert(self, source, out, *options):
        path = self.folder / out
        result = subprocess.run([ESIM, "convert", str(source), str(path), *options], capture_output=True, text=True, timeout=120)
        self.assertEqual(result.returncode, 0, result.stderr)
        return path

    def write_events(self, events):
        path = self.folder / "events.txt"
        path.write_text("".join(f"{t // 10**9}.{t % 10**9:09d} {x} {y} {p}\n" for t, x, y, p in events))
        return path

    def read_events(self, path):
        """The events of a text file: (ns, x, y, 1 or 0)."""
        events = []
        for line in path.read_text().splitlines():
            t, x, y, p = line.split()
            seconds, decimals = t.split(".")
            events.append((int(seconds) * 10**9 + int(decimals), int(x), int(y), int(p)))
        return events


def random_events(count=20_000, width=640, height=480):
    source = random.Random(1)
    t, events = 5_000_000, []
    for _ in range(count):
        t += source.randrange(4000)
        events.append((t, source.randrange(width), source.randrange(height), source.randrange(2)))
    return events
