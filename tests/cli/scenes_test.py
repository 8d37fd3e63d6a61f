"""`esim scenes` and `esim docs`, from an installed program whose files are read-only.

Run as: scenes_test.py ESIM_PROGRAM SCENES_FOLDER, with the standard library of Python alone.
"""

import os
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import unittest

from program import ESIM, ProgramTest, run

SCENES = pathlib.Path(sys.argv[2]).absolute()


class Installed(ProgramTest):
    def setUp(self):
        super().setUp()
        self.program = self.folder / "usr/bin/esim"
        self.program.parent.mkdir(parents=True)
        try:
            os.link(ESIM, self.program)
        except OSError:
            shutil.copy(ESIM, self.program)
        self.share = self.folder / "usr/share/esim"

    def esim(self, *arguments):
        return subprocess.run([self.program, *arguments], capture_output=True, text=True, timeout=60, cwd=self.folder)


class Scenes(Installed):
    def setUp(self):
        super().setUp()
        self.scenes = self.share / "scenes"
        shutil.copytree(SCENES, self.scenes, ignore=shutil.ignore_patterns("*.blend", "room", "studio_room"))
        for path in (*self.scenes.rglob("*"), self.scenes):
            path.chmod(0o555 if path.is_dir() else 0o444)
        self.addCleanup(lambda: [path.chmod(0o755) for path in (self.scenes, *self.scenes.rglob("*")) if path.is_dir()])

    def test_they_are_listed_and_run(self):
        result = self.esim("scenes")
        self.assertEqual(result.returncode, 0, result.stderr)
        paths = result.stdout.splitlines()
        self.assertEqual(paths, sorted(map(str, self.scenes.glob("*.yaml"))))
        poster = str(self.scenes / "poster.yaml")
        self.assertIn(poster, paths)
        self.assertEqual(self.esim("simulate", poster, "--out", self.out, "--quiet", "--set", "duration_s=0.01").returncode, 0)

    def test_copies_are_writable(self):
        result = self.esim("scenes", "--copy", "mine")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("mine/poster.yaml\n", result.stdout)
        for path in (self.folder / "mine").rglob("*"):
            self.assertTrue(path.stat().st_mode & 0o200, path)
            if path.is_file():
                self.assertEqual(path.read_bytes(), (self.scenes / path.relative_to(self.folder / "mine")).read_bytes())
        self.assertEqual(self.esim("check", "mine/poster.yaml").returncode, 0)
        self.assert_refused(self.esim("scenes", "--copy", "mine"), "mine exists", "--copy")
        self.assert_refused(self.esim("scenes", "--copy", "no/such/folder"), "no/such/folder", "No such file", "choose another --copy")

    def test_incomplete_copies_are_errors(self):
        def limit_files():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))

        command = [self.program, "scenes", "--copy", "mine"]
        result = subprocess.run(command, capture_output=True, text=True, timeout=60, cwd=self.folder, preexec_fn=limit_files)
        self.assert_refused(result, "cannot write mine/")

    def test_missing_scenes_are_explained(self):
        elsewhere = self.folder / "elsewhere/bin/esim"
        elsewhere.parent.mkdir(parents=True)
        shutil.move(self.program, elsewhere)
        self.program = elsewhere
        self.assert_refused(self.esim("scenes"), "elsewhere/share/esim/scenes", "missing")


class Docs(Installed):
    def test_the_site_is_preferred_to_the_pages(self):
        pages, site = self.share / "docs", self.share / "site"
        self.assert_refused(self.esim("docs"), str(pages), "missing", "install esim again")
        pages.mkdir(parents=True)
        (pages / "getting-started.md").touch()
        self.assertEqual(self.esim("docs").stdout, f"{pages}\n")
        site.mkdir()
        (site / "index.html").touch()
        result = self.esim("docs")
        self.assertEqual((result.returncode, result.stdout), (0, f"{site}/index.html\n"))

    def test_the_build_tree_has_the_documentation_of_the_sources(self):
        result = run("docs")
        self.assertEqual(result.returncode, 0, result.stderr)
        path = pathlib.Path(result.stdout.strip())
        self.assertTrue((path.is_file() and path.name == "index.html") or (path / "getting-started.md").is_file(), path)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]])
