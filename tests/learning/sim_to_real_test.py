"""examples/flow/sim_to_real.py: windows within a motion, clips of rotations, the bootstrap, and a tiny run of all.

Run as: sim_to_real_test.py FOLDER_OF_THE_EXAMPLE, by a Python that has PyTorch and the package esim.
"""

import csv
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

try:
    import matplotlib  # noqa: F401
    import numpy as np
    import torch
    import yaml

    import esim
    import esim.torch
except ImportError as missing:
    print(f"skipped: {missing}; scripts/setup --with-learning installs what it needs")
    sys.exit(77)  # skipped, to CTest

EXAMPLE = pathlib.Path(sys.argv.pop(1)).resolve()
sys.path.insert(0, str(EXAMPLE))

import bootstrap  # noqa: E402
from lead import LeadFlowDataset, flow_between, window_of  # noqa: E402
from rotation_clips import read_clip, read_clips  # noqa: E402
from rotation_truth import Calibration, rotation_of  # noqa: E402
from sim_to_real import (  # noqa: E402
    StoredSamples,
    errors_of,
    fit_of,
    fitted,
    read_experiment,
    sequence_options,
    summary_of,
    table_of,
)

torch.set_num_threads(1)
SIZE = 64, 48
OMEGA = np.array([0.4, -1.5, 0.8])  # rad/s
CALIBRATION_TEXT = "50 49 32.5 26 -0.37 0.15 -0.0003 -0.0008 0.01\n"


class Temporary(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory(prefix="esim_learning_")
        self.addCleanup(self.temporary.cleanup)
        self.folder = pathlib.Path(self.temporary.name)

    def clip(self, name="clip", start_s=1.5, duration_s=0.05, given=OMEGA):
        """Points that a camera sees which rotates at OMEGA: an event wherever a point enters a pixel."""
        folder = self.folder / "clips" / name
        folder.mkdir(parents=True)
        (folder / "calib.txt").write_text(CALIBRATION_TEXT)
        (folder / "motion.txt").write_text(" ".join(f"{value:.8f}" for value in given) + "\n")
        np.save(folder / "flow.npy", np.zeros((1, 2, SIZE[1], SIZE[0])))
        calibration = Calibration.read(folder / "calib.txt", *SIZE)
        random = np.random.default_rng(4)
        pixels = random.integers(0, SIZE[0] * SIZE[1], 250)
        bearings = np.concatenate([calibration.bearings.reshape(2, -1)[:, pixels] + random.uniform(-0.01, 0.01, (2, 250)), np.ones((1, 250))])
        events, before = [], None
        for t in np.arange(0, duration_s, 1e-4):
            x, y = np.rint(calibration.project(rotation_of(OMEGA * t).T @ bearings))
            for point in np.flatnonzero((x != before[0]) | (y != before[1])) if before is not None else ():
                if 0 <= x[point] < SIZE[0] and 0 <= y[point] < SIZE[1]:
                    events.append((round((start_s + t) * 1e9), x[point], y[point], 1))
            before = x, y
        esim.save_events(folder / "events.txt", np.array(events, esim.EVENT_DTYPE), *SIZE)
        return folder


class Lead(unittest.TestCase):
    OPTIONS = {"width": 32, "height": 24, "seed": 2, "contrast_threshold": 0.2, "block": 2}
    SEQUENCES = {name: value for name, value in OPTIONS.items() if name != "block"}

    def test_the_optical_flow_is_the_simulators(self):
        options = {"duration": 0.024, "flow_scale": 0.3, **self.SEQUENCES}
        sequences = esim.dataset.AffineSequences(**options)
        for i in range(6):
            sequence = sequences[i]
            poses = sequence.info["poses"]
            scale = max(1, np.abs(sequence.optical_flow).max())
            np.testing.assert_allclose(flow_between(poses, 0, 0.024, 32, 24), sequence.optical_flow, atol=1e-6 * scale)
            for t, at in ((0.0, "start"), (0.012, "middle"), (0.024 - 1e-8, "end")):
                field = esim.dataset.AffineSequences(motion_field_at=at, **options)[i].motion_field
                numeric = flow_between(poses, t, t + 1e-8, 32, 24) / 1e-8
                np.testing.assert_allclose(numeric, field, atol=1e-4 * np.abs(field).max())
            # Parts follow each other: the flow to the end is that to the middle, and on from where it leads.
            first, whole = flow_between(poses, 0, 0.01, 32, 24), flow_between(poses, 0, 0.024, 32, 24)
            second = flow_between(poses, 0.01, 0.024, 32, 24)
            corner = lambda flow, x, y: flow[:, 0, 0] + (flow[:, 0, 1] - flow[:, 0, 0]) * x + (flow[:, 1, 0] - flow[:, 0, 0]) * y
            there = np.array([5, 7]) + first[:, 7, 5]
            np.testing.assert_allclose(there + corner(second, *there), np.array([5, 7]) + whole[:, 7, 5], atol=1e-9)

    def test_samples_are_the_last_part_of_longer_sequences(self):
        dataset = LeadFlowDataset(lead_s=0.016, duration=0.008, flow_scale=2.0, count=3, **self.OPTIONS)
        sequences = esim.dataset.AffineSequences(duration=0.024, flow_scale=6.0, **self.SEQUENCES)
        early = 0
        for i, (tensor, flow, fired) in enumerate(dataset):
            events = sequences[i].events
            late = events[events["t"] >= 16_000_000]
            self.assertEqual(tensor[:2].sum(), len(late))
            self.assertLess(tensor[2:].max(), 1.0001)
            self.assertEqual(fired.sum(), len(np.unique(late["y"] * 32 + late["x"])))
            np.testing.assert_allclose(flow, window_of(sequences[i], 0.016)[1].astype(np.float32))
            early += (late["t"] < 16_200_000).sum()
        self.assertGreater(early, 0)  # pixels fire as soon as the window begins
        parts = [list(torch.utils.data.DataLoader(LeadFlowDataset(lead_s=0.016, duration=0.008, count=4, **self.OPTIONS), 2,
                                                  num_workers=workers)) for workers in (0, 2)]
        for alone, shared in zip(*parts, strict=True):
            self.assertTrue(torch.equal(alone[0], shared[0]) and torch.equal(alone[1], shared[1]))
        with self.assertRaisesRegex(esim.Error, "lead_s must be above 0"):
            LeadFlowDataset(lead_s=0)


class Clips(Temporary):
    def test_windows_have_the_truth_of_the_rate(self):
        clip = read_clip(self.clip(given=0.85 * OMEGA, duration_s=0.1))
        self.assertEqual((clip.calibration.width, clip.calibration.height), SIZE)
        expected = {"motion.txt": 0.85 * OMEGA, "sharpest": OMEGA}
        np.testing.assert_allclose(clip.truths["motion.txt"].rate[0], expected["motion.txt"], atol=1e-8)
        # The events tell the true rate, not the wrong one of the file.
        self.assertLess(np.linalg.norm(clip.truths["sharpest"].rate[0] - OMEGA), 0.05 * np.linalg.norm(OMEGA))
        for truth in clip.truths:
            rows, kept = clip.rows(truth, None, 0.008, keep=100)
            self.assertEqual(len(rows), 12)  # of 100 ms
            self.assertEqual(len(kept), 12)
            flow = clip.calibration.optical_flow(rotation_of(clip.truths[truth].rate[0] * 0.008))
            for row, (tensor, _, known) in zip(rows, kept, strict=True):
                np.testing.assert_allclose(known, flow, atol=1e-9)
                fired = tensor[:2].sum(axis=0) > 0
                self.assertAlmostEqual(row["epe_px"], np.linalg.norm(flow, axis=0)[fired].mean())
                self.assertEqual(row["pixels"], fired.sum())
            perfect = clip.rows(truth, lambda tensor, flow=flow: flow, 0.008)[0]
            self.assertLess(max(row["epe_px"] for row in perfect), 1e-9)

    def test_windows_that_a_fit_has_seen(self):
        clip = read_clip(self.clip())
        start_s, duration_s = clip.start * 1e-9, (clip.end - clip.start) * 1e-9
        seen = [clip.within(start_s + 0.008 * i, 0.008, (0.0, 0.02 / duration_s)) for i in range(6)]
        self.assertEqual(seen, [True, True, True, False, False, False])
        self.assertFalse(clip.within(start_s, 0.008, (0.5, 1)))
        self.assertTrue(clip.within(start_s + 0.04, 0.008, (0.5, 1)))

    def test_what_is_refused(self):
        with self.assertRaisesRegex(esim.Error, "contains no clip"):
            read_clips(self.folder)
        folder = self.clip()
        self.assertEqual([clip.name for clip in read_clips(folder.parent)], ["clip"])
        for name, text, message in (("motion.txt", "0.1 0.2\n", "motion.txt:1: 2 columns instead of 3"),
                                    ("motion.txt", "0.1 0.2 0\n0.1 0.2 0\n", "motion.txt: 2 lines of numbers instead of one"),
                                    ("flow.npy", "text", "cannot read .*flow.npy"), ("events.txt", "0.1 3 4 1\n", "at least two")):
            whole = (folder / name).read_bytes()
            (folder / name).write_text(text)
            with self.assertRaisesRegex(esim.Error, message):
                read_clip(folder)
            (folder / name).write_bytes(whole)


class Bootstrap(unittest.TestCase):
    def test_intervals_hold_about_as_often_as_they_say(self):
        random = np.random.default_rng(7)
        held = 0
        for _ in range(300):
            errors = 1 + random.normal(size=(1, 20))
            low, high = bootstrap.interval(bootstrap.resampled_means({"a": errors})["a"])
            held += low < 1 < high
        self.assertTrue(0.88 < held / 300 < 0.98, held / 300)  # percentile intervals of 20 values are a bit short

    def test_pairs_are_compared_in_the_same_windows(self):
        random = np.random.default_rng(3)
        windows = 2 + random.normal(size=12)  # differ more than the sensors do
        errors = {"a": [windows, windows], "b": [windows + 0.1, windows + 0.1 + 0.01 * random.normal(size=12)],
                  "c": [windows + 0.5 * random.normal(size=12), windows], "zero": [windows + 1]}
        means, pairs = bootstrap.compared(errors)
        self.assertAlmostEqual(means["a"][0], windows.mean())
        low, high = means["a"][1]
        self.assertTrue(low < windows.mean() < high)
        verdicts = {(a, b): verdict for a, b, _, _, verdict in pairs}
        self.assertEqual(verdicts["a", "b"], "lower")
        self.assertEqual(verdicts["a", "c"], "not distinguishable")
        self.assertEqual(verdicts["a", "zero"], "lower")
        swapped = bootstrap.compared({name: errors[name] for name in ("b", "a")})[1]
        self.assertEqual(swapped[0][4], "higher")
        self.assertEqual(bootstrap.compared(errors), (means, pairs))

    def test_trainings_are_resampled_too(self):
        """If one training of three is much better than the others, a lower mean tells little."""
        windows = np.linspace(1, 1.1, 12)
        errors = {"a": [windows - 0.5, windows + 0.1, windows + 0.1], "b": [windows, windows, windows]}
        self.assertEqual(bootstrap.compared(errors)[1][0][4], "not distinguishable")

    def test_few_windows_have_no_interval(self):
        means, pairs = bootstrap.compared({"a": [[1.0, 2.0]], "b": [[3.0, 4.0]]})
        self.assertEqual(means, {"a": (1.5, None), "b": (3.5, None)})
        self.assertEqual(pairs, [("a", "b", -2.0, None, "too few windows")])


class Experiment(Temporary):
    def test_fitted_sensors_keep_both_thresholds(self):
        sensor = {"preset": "ideal", "contrast_threshold": 0.25, "contrast_threshold_on": 0.5, "contrast_threshold_off": 0.4, "threshold_ratio": 1}
        self.assertEqual(sequence_options(sensor), {"contrast_threshold": 0.5, "event_camera": {"preset": "ideal", "threshold_ratio": 0.8}})
        self.assertEqual(sequence_options({"contrast_threshold": 0.3, "threshold_ratio": 2}),
                         {"contrast_threshold": 0.3, "event_camera": {"threshold_ratio": 2}})

    def test_a_sensor_is_fitted_once(self):
        program = self.folder / "program.py"  # in the place of esim, which would need a clip with a frame
        program.write_text("import sys, pathlib\nfolder = pathlib.Path(sys.argv[sys.argv.index('--save-fitted') + 1])\n"
                           "assert sys.argv[sys.argv.index('--fit-to') + 1] == 'clip:0:0.5'\n"
                           "(folder / 'base_fitted.yaml').write_text('event_camera: {contrast_threshold: 0.4}')\nprint('table')\n")
        sensor = {"fit": "clip:0:0.5", "base": {"contrast_threshold": 0.25}}
        for _ in range(2):
            options = fitted(self.folder, sensor, self.folder / "out", [sys.executable, program])
            self.assertEqual(options, {"contrast_threshold": 0.4, "event_camera": {}})
            program.unlink(missing_ok=True)
        self.assertEqual((self.folder / "out/fit.txt").read_text(), "table\n")
        with self.assertRaisesRegex(esim.Error, "could not fit a sensor to clip:0:0.5"):
            fitted(self.folder, sensor, self.folder / "other", [sys.executable, "-c", "raise SystemExit(1)"])

    def test_settings(self):
        experiment = read_experiment(EXAMPLE / "sim_to_real.yaml")
        self.assertEqual(fit_of(experiment["sensors"]["fitted"], ""), ("davis240c_poster_rotation", (0.0, 0.33)))
        path = self.folder / "bad.yaml"
        for text, message in (("{seeds: [1]}", "must have the settings"),
                              ("{training: a, seeds: [x], sensors: {}, near_px: [0, 1]}", "seeds must be a whole number"),
                              ("{training: a, seeds: [1], sensors: {a: {fit: 'clip:1:0'}}, near_px: [0, 1]}", "sensors.a.fit must be CLIP:FROM:TO")):
            path.write_text(text)
            with self.assertRaisesRegex(esim.Error, message):
                read_experiment(path)

    def test_windows_of_a_fit_are_left_out(self):
        row = {"clip": "c", "truth": "motion.txt", "zero_epe_px": 1.0}
        rows = [{**row, "sensor": sensor, "seed": seed, "fitted": int(i < 2), "epe_px": 10.0 * seed + i}
                for sensor in "ab" for seed in (1, 2) for i in range(4)]
        errors = errors_of(rows, "motion.txt", "c")
        self.assertEqual(errors, {"no motion": [[1.0, 1.0]], "a": [[12.0, 13.0], [22.0, 23.0]], "b": [[12.0, 13.0], [22.0, 23.0]]})
        self.assertEqual(errors_of(rows, "motion.txt", "all windows"), errors)
        self.assertEqual(errors_of([{**row, "fitted": 1} for row in rows], "motion.txt", "c"), {})

    def test_a_tiny_run(self):
        self.clip("first"), self.clip("second", start_s=0.2)
        (self.folder / "tiny.yaml").write_text(yaml.safe_dump({
            "simulation": {"width": 32, "height": 24, "duration": 0.008, "seed": 1}, "lead": 0.004, "validation": 4, "sequences": 8, "workers": 0,
            "network": {"width": 0.05, "levels": 3}, "batch": 4, "iterations": 3, "report_every": 2}))
        settings = {"training": "tiny.yaml", "seeds": [1], "near_px": [0.5, 1.5], "sensors": {
            "ideal": {"contrast_threshold": [0.2, 0.5]}, "circuit": {"contrast_threshold": 0.3, "event_camera": {"circuit": {}}}}}

        def run(seeds, *more):
            (self.folder / "experiment.yaml").write_text(yaml.safe_dump({**settings, "seeds": seeds}, sort_keys=False))
            return subprocess.run([sys.executable, EXAMPLE / "sim_to_real.py", self.folder / "clips", "--settings", self.folder / "experiment.yaml",
                                   "--out", out, "--device", "cpu", "--threads", "1", *more], capture_output=True, text=True)

        out = self.folder / "straight"
        straight = run([1, 2])
        self.assertEqual(straight.returncode, 0, straight.stderr)
        self.assertIn("8 of 8 sequences simulated, 0:00:00 left", straight.stdout)
        table, windows = (out / "table.md").read_text(), (out / "windows.csv").read_bytes()
        self.assertIn(table, straight.stdout)
        with open(out / "windows.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(len(rows), 2 * 2 * 2 * 2 * 6)  # seeds, sensors, clips, truths, windows
        summary = json.loads((out / "summary.json").read_text())
        self.assertEqual([(entry["clip"], entry["windows"]) for entry in summary["clips"]],
                         2 * [("first", 6), ("second", 6), ("all windows", 12)])
        self.assertEqual(list(summary["clips"][0]["epe_px"]), ["no motion", "ideal", "circuit"])
        self.assertEqual({len(values) for values in summary["validation"].values()}, {2})
        mean = np.mean([float(row["epe_px"]) for row in rows if (row["clip"], row["truth"], row["sensor"]) == ("first", "sharpest", "ideal")])
        entry = next(entry for entry in summary["clips"] if (entry["clip"], entry["truth"]) == ("first", "sharpest"))
        self.assertAlmostEqual(entry["epe_px"]["ideal"]["mean"], mean, places=4)
        self.assertGreater((out / "figure.png").stat().st_size, 5000)

        # The same in parts: what is done is not done again, and the results are the same.
        out = self.folder / "parts"
        self.assertEqual(run([1]).returncode, 0)
        head = json.loads((out / "circuit/training.json").read_text())
        self.assertEqual(head["done"], 8)
        np.testing.assert_array_equal(np.load(out / "circuit/training.npy"), np.load(self.folder / "straight/circuit/training.npy"))
        again = run([1, 2])
        self.assertNotIn("sequences simulated,", again.stdout)
        self.assertNotIn("training on ideal, seed 1", again.stdout)
        self.assertEqual((out / "windows.csv").read_bytes(), windows)
        self.assertEqual((out / "table.md").read_text(), table)
        settings["sensors"]["other"] = {"fit": "third:0:1", "base": {}}
        (out / "other").mkdir()
        (out / "other/base_fitted.yaml").write_text("event_camera: {contrast_threshold: 0.4}")
        self.assertIn("a sensor is fitted to third, which is not one of the clips", run([1]).stderr)
        del settings["sensors"]["other"]
        settings["sensors"]["ideal"]["contrast_threshold"] = 0.7
        refused = run([1, 2])
        self.assertEqual(refused.returncode, 1)
        self.assertIn("was trained with other settings: simulation", refused.stderr)

    def test_samples_go_on_where_they_were_interrupted(self):
        samples = [[torch.rand(2, channels, 6, 8) for channels in (4, 2, 1)] for _ in range(3)]
        made_by = {"simulation": {"width": 8, "height": 6}, "count": 6}
        stored = StoredSamples(self.folder / "sensor/training", made_by)
        self.assertEqual(len(stored), 0)
        for batch in samples[:2]:
            stored.add(batch)
        again = StoredSamples(self.folder / "sensor/training", made_by)
        self.assertEqual((again.done, len(again)), (4, 4))
        again.add(samples[2])
        for i in (5, 0, 3):
            for part, batch_part in zip(again[i], samples[i // 2]):
                self.assertTrue(torch.equal(part, batch_part[i % 2]))
        with self.assertRaisesRegex(esim.Error, "training.json: the samples were simulated with other settings"):
            StoredSamples(self.folder / "sensor/training", {**made_by, "lead": 0.1})

    def test_the_table_names_every_sensor_and_verdict(self):
        clip = read_clip(self.clip())
        rows = [{"clip": "clip", "truth": truth, "sensor": sensor, "seed": 1, "fitted": 0, "epe_px": error + 0.01 * i, "zero_epe_px": 1.0}
                for truth in clip.truths for sensor, error in (("ideal", 0.5), ("preset", 0.2)) for i in range(6)]
        values = {"epe_px": 0.4, "zero_epe_px": 3.0, "near_epe_px": 0.1, "near_zero_epe_px": 1.0}
        table = table_of(summary_of(rows, {"ideal": [values], "preset": [values]}, [clip], [0.5, 1.5]))
        self.assertIn("pixels that move by 0.5 to 1.5 px", table)
        self.assertIn("| ideal | 0.40 (3.00) | 0.10 (1.00) |", table)
        self.assertIn("| sharpest | clip | ideal | preset | 0.30 [0.30, 0.30] | higher |", table)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
