"""`esim compare` as its users meet it.

Run as: compare_test.py ESIM_PROGRAM SCENES_FOLDER, with the standard library of Python alone.
"""

import json
import pathlib
import random
import sys
import unittest

from program import ProgramTest, run

SCENES = pathlib.Path(sys.argv[2]).absolute()


def stream(seed, number=20000, duration_s=1.0, on=0.5, start_s=0.0):
    source = random.Random(seed)
    times = sorted(source.uniform(start_s, start_s + duration_s) for _ in range(number))
    return "".join(f"{t:.6f} {source.randrange(32)} {source.randrange(24)} {int(source.random() < on)}\n" for t in times)


class Compare(ProgramTest):
    def refuses(self, part, *arguments):
        result = run(*arguments)
        self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
        self.assertIn(part, result.stderr)

    def write(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return path

    def test_tells_what_differs(self):
        even, other, more = (self.write(name, stream(seed, on=on)) for name, seed, on in
                             (("a.txt", 1, 0.5), ("b.txt", 2, 0.5), ("c.txt", 3, 0.6)))
        result = run("compare", even, other)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("not distinguishable", result.stdout)
        result = run("compare", even, more)
        self.assertRegex(result.stdout, r"ON fraction +0\.(49|50)\d* +0\.(59|60)\d* +\+0\.(09|1)\d* \(.* to .*\) +[\d.]+  differs")
        self.assertIn("distinguishable by: ", result.stdout)
        found = json.loads(run("compare", even, more, "--json").stdout)
        self.assertIn("ON fraction", found["distinguishable_by"])
        on = next(s for s in found["statistics"] if s["name"] == "ON fraction")
        self.assertAlmostEqual(on["difference"], on["b"] - on["a"])
        self.assertLess(on["low"], on["difference"])

    def test_the_longer_recording_is_cut(self):
        short, long = self.write("short.txt", stream(1)), self.write("long.txt", stream(2, 60000, 3.0))
        result = run("compare", long, short)
        self.assertRegex(result.stdout, r"the first 1\.00 s of both")
        self.assertIn("not distinguishable", result.stdout)

    def test_the_same_scene(self):
        options = ["--set", "camera.width=64", "--set", "camera.height=48", "--set", "duration_s=0.3", "--set", "output.preview=false"]
        for name, more in (("a", []), ("b", ["--set", "event_camera.contrast_threshold=0.21"])):
            result = run("simulate", SCENES / "poster.yaml", "--out", self.folder / name, "-q", *options, *more)
            self.assertEqual(result.returncode, 0, result.stderr)
        a, b, figure = self.folder / "a", self.folder / "b", self.folder / "like.png"
        same = json.loads(run("compare", a, a, "--same-scene", "--json").stdout)
        self.assertEqual((same["same_scene"]["missing"], same["same_scene"]["only_in_b"]), (0, 0))
        self.assertEqual((same["same_scene"]["time_surfaces"], same["same_scene"]["voxel_grids"]), (0, 0))
        self.assertEqual(same["distinguishable_by"], [])
        result = run("compare", a, b, "--same-scene", "--out", figure)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stdout, r"matched +[\d,]+ \([\d.]+ % of A\)")
        self.assertTrue(figure.read_bytes().startswith(b"\x89PNG"))
        self.refuses("--force", "compare", a, b, "--out", figure)
        self.assertEqual(run("compare", a, b, "--out", figure, "--force").returncode, 0)

    def test_bad_input(self):
        a, late, empty = self.write("a.txt", stream(1)), self.write("late.txt", stream(2, start_s=5.0)), self.write("empty.txt", "")
        self.refuses("--shift SECONDS", "compare", a, late, "--same-scene")
        self.assertEqual(run("compare", a, late, "--same-scene", "--shift", "-5").returncode, 0)
        self.refuses("--same-scene", "compare", a, late, "--shift", "-5")
        result = run("compare", a, empty)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("too few events to tell", result.stdout)
        self.refuses("no events", "compare", a, empty, "--same-scene", "--width", "32", "--height", "24")
        self.refuses("nothing.txt", "compare", a, self.folder / "nothing.txt")
        wide = self.write("wide.txt", "0.0 100 100 1\n" + stream(1))
        self.assertIn("warning: the sensors have 32 x 24 and 101 x 101 px", run("compare", a, wide).stderr)
        self.refuses("--width and --height", "compare", a, wide, "--same-scene")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
