"""`esim dataset` as its users meet it: what is on disk, going on after an end, messages.

Run as: dataset_test.py ESIM_PROGRAM, with the standard library of Python alone.
"""

import json
import random
import resource
import signal
import subprocess
import tarfile
import time
import unittest
import zlib

from program import ESIM, ProgramTest, run

SMALL = ["--width", 48, "--height", 32, "--flow-scale", 0.1, "--duration", 0.01]


def content(folder):
    return {p.name: p.read_bytes() for p in folder.iterdir() if p.name != ".lock"}


class Dataset(ProgramTest):
    def make(self, out, *options, count=24, **settings):
        return run("dataset", "affine", "--out", out, "--count", count, *SMALL, *options, **settings)

    def test_a_dataset(self):
        result = self.make(self.out, "--contents", "motion_field,optical_flow,images,tensor,voxels=3", "--format", "webdataset")
        self.assertEqual(result.returncode, 0, result.stderr)
        manifest = json.loads((self.out / "manifest.json").read_text())
        self.assertEqual(manifest["sequences"], 24)
        keys = []
        for shard in manifest["shards"]:
            data = (self.out / shard["file"]).read_bytes()
            self.assertEqual((len(data), f"{zlib.crc32(data):08x}"), (shard["bytes"], shard["crc32"]))
            with tarfile.open(self.out / shard["file"]) as tar:
                names = tar.getnames()
                keys += sorted({name.split(".")[0] for name in names})
                sample = json.loads(tar.extractfile(f"{shard['first']:08}.json").read())
                self.assertGreaterEqual(sample["contrast_threshold"], 0.2)
                head = tar.extractfile(f"{shard['first']:08}.motion_field.npy").read(128)
                self.assertIn(b"'shape': (2, 32, 48", head)
            self.assertEqual(len(names), 10 * shard["count"])
        self.assertEqual(keys, [f"{i:08}" for i in range(24)], "each once, in order")
        report = json.loads((self.out / "report.json").read_text())
        self.assertLess(report["optical_flow"]["total_variation"], 0.3)
        for picture in ("preview.png", "magnitudes.png"):
            self.assertTrue((self.out / picture).read_bytes().startswith(b"\x89PNG"))
        check = run("dataset", "--check", self.out)
        self.assertEqual(check.returncode, 0, check.stderr)
        self.assertIn("complete: 24 sequences", check.stdout)

    def test_workers_and_ends_change_nothing(self):
        straight, other = self.folder / "straight", self.folder / "other"
        self.assertEqual(self.make(straight, "--workers", 1, count=40).returncode, 0)
        chance = random.Random(3)
        kills = 0
        for _ in range(40):
            arguments = ["dataset", "affine", "--out", other, "--count", 40, *SMALL, "--workers", 2]
            process = subprocess.Popen([ESIM, *map(str, arguments)], stderr=subprocess.DEVNULL)
            try:
                process.wait(chance.uniform(0.05, 0.6))
                break
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGKILL)
                process.wait()
                kills += 1
        self.assertEqual(self.make(other, count=40).returncode, 0)
        self.assertEqual(content(other), content(straight), f"after {kills} ends")

    def test_shares_add_up(self):
        straight, other = self.folder / "straight", self.folder / "other"
        self.assertEqual(self.make(straight).returncode, 0)
        tasks = [subprocess.Popen([ESIM, *map(str, ["dataset", "affine", "--out", other, "--count", 24, *SMALL, "--shard", f"{i}/3"])],
                                  stderr=subprocess.DEVNULL) for i in range(3)]
        self.assertEqual([task.wait() for task in tasks], [0, 0, 0])
        self.assertEqual(content(other), content(straight))
        incomplete = self.folder / "incomplete"
        self.assertEqual(self.make(incomplete, "--shard", "1/3").returncode, 0)
        self.assertFalse((incomplete / "manifest.json").exists())
        check = run("dataset", "--check", incomplete)
        self.assertEqual(check.returncode, 2)
        self.assertIn("are missing; run the command", check.stderr)

    def test_old_names_of_options_are_valid_with_a_warning(self):
        result = self.make(self.out, "--contents", "flow,displacement", "--flow-at", "end", count=2)
        self.assertEqual(result.returncode, 0, result.stderr)
        for text in ("flow is now motion_field", "displacement is now optical_flow", "--flow-at is now --motion-field-at"):
            self.assertIn(text, result.stderr)
        plan = json.loads((self.out / "dataset.json").read_text())
        self.assertEqual(plan["contents"], ["events", "motion_field", "optical_flow"])
        self.assertEqual(plan["made_by"]["motion_field_at"], "end")
        self.assertNotIn("--flow-at", run("dataset", "--help").stdout)

    def test_ctrl_c_keeps_complete_shards(self):
        process = subprocess.Popen([ESIM, *map(str, ["dataset", "affine", "--out", self.out, "--count", 4000, *SMALL, "--shard-size", 2])],
                                   stderr=subprocess.DEVNULL)
        while not (self.out / "shard-000001.json").exists():
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(30), 130)
        self.assertTrue((self.out / "shard-000001.json").exists())
        self.assertEqual([p.name for p in self.out.iterdir() if p.name.endswith(".tmp")], [])

    def test_a_full_disk_is_one_line(self):
        def little_room():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))

        for name in ("hdf5", "webdataset"):
            result = self.make(self.folder / name, "--format", name, preexec_fn=little_room)
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertIn("cannot write", result.stderr)
            self.assertIn(f"stay in {self.folder / name}", result.stderr)
            self.assertEqual(self.make(self.folder / name, "--format", name).returncode, 0)
            self.assertEqual(run("dataset", "--check", self.folder / name).returncode, 0)

    def test_another_dataset_is_refused(self):
        self.assertEqual(self.make(self.out).returncode, 0)
        before = content(self.out)
        for options, named in ((["--seed", 2], "made_by.seed is 1 there, but 2 here"), (["--motion-field-at", "end"], 'motion_field_at is "middle" there, but "end" here'),
                               (["--format", "webdataset"], "format"), (["--contents", "motion_field"], "contents")):
            result = self.make(self.out, *options)
            self.assertEqual(result.returncode, 2)
            self.assertIn(named, result.stderr)
            self.assertIn("choose another folder", result.stderr)
        plan = self.out / "dataset.json"
        plan.write_text(plan.read_text().replace('"esim": "', '"esim": "0.'))
        result = self.make(self.out)
        self.assertEqual(result.returncode, 2)
        self.assertIn("begun by esim 0.", result.stderr)
        plan.write_bytes(before["dataset.json"])
        self.assertEqual(content(self.out), before)

    def test_images_that_cannot_be_used_are_counted(self):
        images = self.folder / "images"
        images.mkdir()
        source = random.Random(1)
        for name in ("a.pgm", "b.pgm"):
            (images / name).write_bytes(b"P5 80 60 255\n" + bytes(source.randrange(256) for _ in range(80 * 60)))
        (images / "broken.png").write_bytes(b"\x89PNG\r\n\x1a\nbroken")
        (images / "tiny.pgm").write_bytes(b"P5 4 4 255\n" + bytes(16))
        result = self.make(self.out, "--images", images)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("warning: 2 images could not be used", result.stderr)
        report = json.loads((self.out / "report.json").read_text())
        self.assertEqual(report["images_passed_over"], 2)
        self.assertEqual(sorted(report["passed_over"]), ["broken.png", "tiny.pgm"])
        (images / "c.pgm").write_bytes((images / "a.pgm").read_bytes())
        changed = self.make(self.out, "--images", images)
        self.assertEqual(changed.returncode, 2)
        self.assertIn("made_by.images", changed.stderr)

    def test_mistakes_are_one_line(self):
        images = self.folder / "images"
        images.mkdir()
        self.assert_refused(self.make(self.out, "--images", images), "has no images")
        (images / "a.png").write_bytes(b"nothing")
        self.assert_refused(self.make(self.out, "--images", images), "none of its 1 images can be used")
        self.assert_refused(self.make(self.out, "--contents", "flwo"), "not 'flwo'")
        self.assert_refused(self.make(self.out, "--contents", "depth"), "have no depth")
        self.assert_refused(self.make(self.out, "--shard", "3/3"), "--shard 3/3")
        self.assert_refused(self.make(self.out, "--set", "contrast_treshold=1"), "contrast_treshold")
        self.assert_refused(self.make(self.out, "--threshold", 0.5, 0.2), "from 0.5 to 0.2")
        self.assert_refused(run("dataset", "affine"), "--out")
        self.assert_refused(run("dataset", "--out", self.out), "give affine, or a scenario file")
        self.assert_refused(run("dataset", self.folder / "none.yaml", "--out", self.out), "none.yaml: cannot be read")
        self.assert_refused(run("dataset", "--check", self.folder), "is not a dataset")
        other = self.folder / "thesis"
        other.mkdir()
        (other / "thesis.tex").write_text("x")
        result = self.make(other)
        self.assertEqual(result.returncode, 2)
        self.assertIn("must be a dataset", result.stderr)
        self.assertEqual([p.name for p in other.iterdir()], ["thesis.tex"])

    def test_a_scenario_is_randomised(self):
        template = self.folder / "t.yaml"
        wall = bytes(i * 37 % 251 for i in range(64 * 48))
        (self.folder / "wall.pgm").write_bytes(b"P5 64 48 255\n" + wall)
        template.write_text("renderer: {type: plane, image: wall.pgm, width_m: 1, endless: true, pose: {position: [1, 0, 0], look_at: [2, 0, 0]}}\n"
                            "trajectory: {type: random, position_amplitude_m: [0.2, 0.2, 0.2]}\nduration_s: 0.05\n"
                            "camera: {width: 32, height: 24}\n"
                            "randomise:\n  event_camera.contrast_threshold: {uniform: [0.1, 0.3]}\n")
        result = run("dataset", template, "--out", self.out, "--count", 6, "--contents", "motion_field,optical_flow,depth", "--format", "webdataset")
        self.assertEqual(result.returncode, 0, result.stderr)
        drawn = set()
        for shard in sorted(self.out.glob("*.tar")):
            with tarfile.open(shard) as tar:
                for name in tar.getnames():
                    if name.endswith(".json"):
                        drawn.add(float(json.loads(tar.extractfile(name).read())["event_camera.contrast_threshold"]))
        self.assertEqual(len(drawn), 6)
        self.assertTrue(all(0.1 <= value <= 0.3 for value in drawn))

    def test_slurm_is_given_a_script(self):
        sbatch = self.folder / "bin" / "sbatch"
        sbatch.parent.mkdir()
        sbatch.write_text("#!/bin/sh\necho \"submitted $1\"\n")
        sbatch.chmod(0o755)
        options = ["--slurm", "--slurm-tasks", 3, "--slurm-options", "--time=5 --partition=long"]
        result = self.make(self.out, *options, env={"PATH": f"{sbatch.parent}:/usr/bin:/bin"})
        self.assertEqual(result.returncode, 0, result.stderr)
        script = self.out / "slurm.sh"
        self.assertIn(f"submitted {script}", result.stdout)
        text = script.read_text()
        for line in ("#SBATCH --array=0-2", "#SBATCH --time=5", "#SBATCH --partition=long", "#SBATCH --requeue"):
            self.assertIn(line + "\n", text)
        self.assertNotIn("--slurm", text)
        for task in range(3):
            self.assertEqual(subprocess.run(["bash", script], env={"SLURM_ARRAY_TASK_ID": str(task), "PATH": "/usr/bin:/bin"},
                                            stderr=subprocess.DEVNULL).returncode, 0)
        self.assertEqual(run("dataset", "--check", self.out).returncode, 0)
        missing = self.make(self.folder / "other", *options, env={"PATH": "/nowhere"})
        self.assertEqual(missing.returncode, 2)
        self.assertIn("sbatch failed", missing.stderr)

    def test_help_has_examples(self):
        result = run("dataset", "--help")
        self.assertEqual(result.returncode, 0)
        self.assertIn("esim dataset affine --out flow", result.stdout)


if __name__ == "__main__":
    unittest.main(argv=["dataset_test.py"], verbosity=1)
