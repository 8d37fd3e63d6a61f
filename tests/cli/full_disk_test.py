"""A disk that fills up on the way: what was recorded until then stays, can be read, and the message says where it is.

Run as: full_disk_test.py ESIM_PROGRAM SCENES_FOLDER, with the standard library of Python alone.
"""

import json
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import unittest

from program import ProgramTest, run

SCENES = pathlib.Path(sys.argv[2]).absolute()
EVENTFUL = ["--set", "camera.width=64", "--set", "camera.height=48", "--set", "sampling={type: uniform, rate_hz: 1000}",
            "--set", "event_camera={contrast_threshold: 0.02, refractory_period_us: 0}"]
NO_TRUTH = ["--set", "truth.rate_hz=0"]


def files_of(size):
    """Of a process whose files cannot grow beyond so many bytes."""
    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    return {"preexec_fn": limit}


class FullDisk(ProgramTest):
    def simulate(self, *arguments, out=None, **options):
        return run("simulate", SCENES / "poster.yaml", "--out", out or self.out, "--quiet", *EVENTFUL, *arguments, **options)

    def kept_by(self, result, out):
        """The one line says what is full and where the recording is."""
        self.assertEqual(result.returncode, 2, result.stderr)
        lines = [line for line in result.stderr.splitlines() if line.startswith("esim: ")]
        self.assertEqual(len(lines), 1, result.stderr)
        kept = pathlib.Path(f"{out}.incomplete")
        self.assertIn(f"kept: {kept}", lines[0])
        self.assertFalse(out.exists())
        return kept

    def events_in(self, path):
        result = run("stats", path, "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(result.stdout)["stream"]["events"]

    def all_read(self, kept):
        """Every kind of record that is left can be read without recovery."""
        result = run("convert", kept, self.folder / "copy.bag", "--force")
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stderr

    def test_of_a_simulation_the_events_are_kept(self):
        result = self.simulate("--set", "duration_s=20", *NO_TRUTH, **files_of(1_000_000))
        kept = self.kept_by(result, self.out)
        self.assertGreater(self.events_in(kept), 100_000)
        self.assertIn("interrupted", run("info", kept).stdout)
        self.assertIn("File too large", run("info", self.out).stdout, "the reason")
        self.all_read(kept)
        refused = self.simulate("--set", "duration_s=0.1")
        self.assertEqual(refused.returncode, 2)
        self.assertIn("--force", refused.stderr)
        self.assertEqual(self.simulate("--set", "duration_s=0.1", "--force").returncode, 0)
        self.assertFalse(kept.exists())

    def test_whichever_file_is_too_large_the_others_are_ended_in_order(self):
        """One output at a time fills up: by its size. Without checkpoints, whose journal of all records fills up first."""
        outputs = {
            "rosbag": (["--set", "output.formats=[rosbag]"], "recording.bag"),
            "mcap": (["--set", "output.formats=[mcap]"], "recording.mcap"),
            "aedat4": (["--set", "output.formats=[aedat4]"], "aedat4"),
            "npz": (["--set", "output.formats=[npz]"], "events.npz"),
            "npy": (["--set", "output.formats=[npy]"], "events.npy"),
            "dataset": (["--set", "output.formats=[dataset]"], "events"),
            "dataset folder": (["--set", "output.formats=[dataset-folder]"], "events"),
            "text": (["--set", "output.formats=[text]"], "events.txt"),
            "evt3": (["--set", "output.formats=[evt3]"], "events.raw"),
            "dat": (["--set", "output.formats=[dat]"], "events.dat"),
            "truth": (["--set", "truth={rate_hz: 200, depth: true}"], "truth.h5"),
            "points": (["--set", "truth={rate_hz: 20, event_points: true}"], "event_points.ply"),
            "poses": (["--set", "truth={rate_hz: 0, pose_rate_hz: 1000}"], ""),
            "imu": (["--set", "imu={rate_hz: 4000}"], "imu"),
            "frames": (["--set", "camera.frame_camera={rate_hz: 100}"], ""),
        }
        names = run("convert", "--list").stdout
        for name, (options, file) in outputs.items():
            if "output.formats" in options[1]:
                options = [*options, *NO_TRUTH]
                if options[1].split("[")[1].rstrip("]") not in names:
                    continue
            with self.subTest(name):
                out = self.folder / name.replace(" ", "_")
                result = self.simulate(*options, "--set", "output.compression=gzip", "--set", "duration_s=5", "--set", "output.checkpoints=false",
                                       out=out, **files_of(2_000_000))
                if result.returncode == 0:
                    self.fail("nothing was too large")
                kept = self.kept_by(result, out)
                self.assertIn(file, result.stderr)
                self.assertGreater(self.events_in(kept), 20_000)
                self.all_read(kept)
                self.assertEqual([p.name for p in kept.rglob("*.tmp")], [])

    def test_of_a_video_the_events_are_kept(self):
        images = self.folder / "images"
        images.mkdir()
        for i in range(8):
            rows = bytes((x * 7 + y * 5 + i * 40) % 256 for y in range(96) for x in range(128))
            (images / f"{i}.pgm").write_bytes(b"P5 128 96 255\n" + rows)
        (images / "images.csv").write_text("\n".join(f"{5_000_000 * i}, {i % 8}.pgm" for i in range(3000)))
        for name in ("clip", "clip.h5", "clip.txt", "clip.raw", "clip.npy", "clip.npz"):
            with self.subTest(name):
                out = self.folder / name
                result = run("video", images, "--out", out, "--quiet", "--no-interpolation", **files_of(1_500_000))
                kept = self.kept_by(result, out)
                if name == "clip.npz":  # an archive is made at the end, of its columns
                    kept = pathlib.Path(f"{kept}.t.npy")
                    self.assertGreater(kept.stat().st_size, 1_000_000)
                else:
                    self.assertGreater(self.events_in(kept), 50_000)

    def test_nothing_stays_where_nothing_was_recorded(self):
        self.assert_refused(self.simulate("--set", "duration_s=1", **files_of(1000)), "out.incomplete")

    def test_a_disk_without_any_room(self):
        """A separate file system, so small that even the report does not fit."""
        disk = self.folder / "disk"
        disk.mkdir()
        mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=3m", "none", disk], capture_output=True)
        if mounted.returncode != 0:
            self.skipTest("only root can mount a small disk")
        self.addCleanup(subprocess.run, ["umount", disk], check=True)
        out = disk / "out"
        kept = self.kept_by(self.simulate("--set", "duration_s=30", "--set", "output.checkpoints=false", out=out), out)
        self.assertIn("No space left on device", run("simulate", SCENES / "poster.yaml", "--out", disk / "b").stderr)
        self.assertGreater(self.events_in(kept), 100_000)
        self.all_read(kept)
        info = run("info", out)
        self.assertEqual(info.returncode, 0, info.stderr)
        self.assertRegex(info.stdout, "interrupted|killed")
        shutil.rmtree(kept)
        whole = self.folder / "whole.h5"
        self.assertEqual(self.simulate("--set", "duration_s=4", *NO_TRUTH).returncode, 0)
        self.assertEqual(run("convert", self.out, whole, "--compression", "none").returncode, 0)
        target = disk / "copy.h5"
        kept = self.kept_by(run("convert", whole, target, "--compression", "none"), target)
        self.assertGreater(self.events_in(kept), 60_000)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
