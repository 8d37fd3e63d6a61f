"""`esim convert` as its users meet it: exit codes, messages, and what is left on disk.

Run as: convert_test.py ESIM_PROGRAM, with the standard library of Python alone.
"""

import sys
import unittest

from program import ProgramTest, run

LINES = "".join(f"{i // 100}.{i % 100:02}0001500 {i % 64} {i % 48} {i % 2}\n" for i in range(500))


class Convert(ProgramTest):
    def setUp(self):
        super().setUp()
        self.text = self.folder / "events.txt"
        self.text.write_text(LINES)

    def convert(self, *arguments, code=0):
        result = run("convert", *arguments)
        self.assertEqual(result.returncode, code, result.stderr)
        return result

    def test_there_and_back(self):
        for extension in (".h5", ".csv"):
            other, back = self.folder / f"other{extension}", self.folder / f"back{extension}.txt"
            result = self.convert(self.text, other, "--time-unit", "ns", "--width", "64", "--height", "48")
            self.assertIn("500 events", result.stderr)
            self.assertNotIn("warning", result.stderr)
            self.assertEqual(result.stdout, "")
            self.convert(other, back, "--quiet")
            self.assertEqual(back.read_text(), LINES)
        self.assertIn("64 x 48 px", run("info", self.folder / "other.h5").stdout)

    def test_lost_data_is_reported(self):
        self.assertRegex(self.convert(self.text, self.folder / "a.h5").stderr, "rounded down to 1 us; --time-unit ns keeps them")

    def test_messages_name_the_flag_that_helps(self):
        """Where the command has it; the library leaves it to the command."""
        self.assertRegex(self.convert(self.text, self.text, code=2).stderr, "exists already: .*pass --force to replace it")
        late = self.folder / "late.txt"
        late.write_text("9999.5 1 1 1\n9999.6 1 2 0\n")
        self.assertIn("--from-zero", self.convert(late, self.folder / "v.h5", "-f", "v2e", code=2).stderr)
        self.convert(late, self.folder / "v.h5", "-f", "v2e", "--from-zero")
        rig = self.folder / "rig"
        for camera in ("left", "right"):
            (rig / camera).mkdir(parents=True)
            (rig / camera / "events.txt").write_text(LINES)
        (rig / "report.json").write_text(
            '{"cameras": [{"name": "left", "width": 64, "height": 48}, {"name": "right", "width": 64, "height": 48}]}')
        self.assertIn("choose one with --camera", self.convert(rig, self.folder / "rig.txt", code=2).stderr)
        bag = self.folder / "rig.bag"
        self.convert(rig, bag)
        refused = run("stats", bag)
        self.assertEqual(refused.returncode, 2)
        self.assertIn("esim convert --camera", refused.stderr)
        long = self.folder / "long.txt"
        long.write_text("0.5 1 1 1\n999999.5 1 2 0\n")
        refused = run("play", long, "--slow-motion", "1", "--width", "64", "--height", "48")
        self.assertEqual(refused.returncode, 2)
        self.assertIn("(--start, --duration, --slow-motion)", refused.stderr)

    def test_replaces_nothing_unasked(self):
        out = self.folder / "a.h5"
        out.write_text("precious")
        self.assertIn("--force", self.convert(self.text, out, code=2).stderr)
        self.assertEqual(out.read_text(), "precious")
        self.convert(self.text, out, "--force")

    def test_damaged_files_with_and_without_recovery(self):
        out = self.folder / "a.h5"
        self.text.write_text(LINES + "5.1 3 what 1\n" + LINES)
        self.assertIn("line 501", self.convert(self.text, out, code=2).stderr)
        self.assertEqual({p.name for p in self.folder.iterdir()}, {"events.txt"}, "nothing is left of a failure")
        self.assertIn("line 501", self.convert(self.text, out, "--recover").stderr)
        self.assertIn("500", run("info", out).stdout)

    def test_what_cannot_be(self):
        self.assertIn(".xyz", self.convert(self.text, self.folder / "a.xyz", code=2).stderr)
        self.assertIn("unknown format \"xyz\"", self.convert(self.text, self.out, "--format", "xyz", code=2).stderr)
        self.assertIn("no such file", self.convert(self.folder / "none.h5", self.out, "-f", "text", code=2).stderr)
        self.assertIn("esim convert IN OUT", self.convert(self.text, code=2).stderr)
        self.assertIn("outside the sensor", self.convert(self.text, self.folder / "a.h5", "--width", "32", "--height",
                                                         "48", code=2).stderr)

    def test_files_of_unknown_topics(self):
        for name in ("a.bag", "a.mcap"):
            path = self.folder / name
            self.convert(self.text, path, "--compression", "none")
            if name == "a.bag":  # checksums tell of changes in the other
                path.write_bytes(path.read_bytes().replace(b"dvs_msgs/EventArray", b"new_msgs/EventArray"))
                for command in (["convert", path, self.folder / "out.txt"], ["stats", path]):
                    result = run(*command)
                    self.assertEqual(result.returncode, 2, result.stdout)
                    self.assertIn("/cam0/events (new_msgs/EventArray)", result.stderr)
                    self.assertIn(str(path), result.stderr)
                self.assertFalse((self.folder / "out.txt").exists())
                self.assertIn("/cam0/events (new_msgs/EventArray)", run("info", path).stdout)
            else:
                self.assertEqual(run("stats", path).returncode, 0)

    def test_the_list_names_every_format(self):
        listed = self.convert("--list").stdout
        for name in ("dsec", "text"):
            self.assertRegex(listed, rf"(?m)^{name} ")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
