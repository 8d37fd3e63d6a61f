"""Running esim, and what holds for every command. The program's path is the first argument of a test."""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ESIM = os.path.abspath(sys.argv[1])


def run(*arguments, **options):
    return subprocess.run([ESIM, *map(str, arguments)], capture_output=True, text=True, timeout=120, **options)


class ProgramTest(unittest.TestCase):
    """A test with a temporary folder. `self.out` is the path of its output in it."""

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="esim_cli_"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.out = self.folder / "out"

    def assert_refused(self, result, *parts):
        """One clear line, exit status 2, nothing left behind."""
        self.assertEqual(result.returncode, 2, result.stderr)
        lines = [line for line in result.stderr.splitlines() if line.startswith("esim: ")]
        self.assertEqual(len(lines), 1, result.stderr)
        for part in parts:
            self.assertIn(part, lines[0])
        self.assertEqual([p.name for p in self.folder.iterdir() if p.name.startswith("out")], [])
