"""`esim sweep` as its users meet it: the table, runs that share a rendering, continuing, messages.

Run as: sweep_test.py ESIM_PROGRAM, with the standard library of Python alone.
"""

import csv
import json
import signal
import subprocess
import time
import unittest

from program import ESIM, ProgramTest, run

SCENARIO = """
duration_s: 0.2
seed: 3
renderer: {type: plane, image: wall.pgm, width_m: 1, endless: true, pose: {position: [1, 0, 0], look_at: [2, 0, 0]}}
trajectory:
  type: waypoints
  points: [{position: [0, 0, 0], look_at: [1, 0, 0], t: 0}, {position: [0, 0.3, 0.1], look_at: [1, 0.3, 0.1], t: 0.3}]
  rest: false
camera: {width: 48, height: 36}
sampling: {type: flow}
event_camera: {threshold_mismatch: 0.03, shot_noise_hz: 5}
output: {preview: false}
truth: {rate_hz: 0}
"""
THRESHOLDS = "event_camera.contrast_threshold=0.15,0.3"
# Columns of sweep.csv, and where `esim stats --json` has the same.
COLUMNS = {"events": ("stream", "events"), "mean_rate_hz": ("stream", "mean_rate_hz"), "interval_min_s": ("intervals", "shortest_s"),
           "interval_1_percent_s": ("intervals", "quantile_1_percent_s"), "interval_median_s": ("intervals", "median_s"),
           "interval_99_percent_s": ("intervals", "quantile_99_percent_s")}  # fmt: skip


class Sweep(ProgramTest):
    def setUp(self):
        super().setUp()
        self.scenario = self.folder / "wall.yaml"
        self.scenario.write_text(SCENARIO)
        (self.folder / "wall.pgm").write_bytes(b"P5 64 48 255\n" + bytes(i * 37 % 251 for i in range(64 * 48)))

    def sweep(self, *over, options=(), **settings):
        return run("sweep", self.scenario, "--out", self.out, *(word for text in over for word in ("--over", text)), *options, **settings)

    def table(self):
        with open(self.out / "sweep.csv", newline="") as file:
            return list(csv.DictReader(file))

    def simulations(self):
        return sorted(path.name for path in self.out.glob("simulation*"))

    def assert_same_as_alone(self, keys, options=()):
        """The events of each run are those of `esim simulate` with the same options."""
        for row in self.table():
            alone = self.folder / "alone"
            sets = [word for key in keys for word in ("--set", f"{key}={row[key]}")]
            result = run("simulate", self.scenario, "--out", alone, "--force", "--quiet", *sets, *options)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual((self.out / row["folder"] / "events.h5").read_bytes(), (alone / "cam0/events.h5").read_bytes(), row)

    def test_sensors_share_a_rendering(self):
        result = self.sweep(THRESHOLDS, "event_camera.seed=1..3")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("6 runs in 1 simulation", result.stderr)
        self.assertNotIn("hint", result.stderr)
        self.assertEqual(self.simulations(), ["simulation0000"])
        rows = self.table()
        self.assertEqual([(row["event_camera.contrast_threshold"], row["event_camera.seed"]) for row in rows],
                         [(threshold, seed) for threshold in ("0.15", "0.3") for seed in ("1", "2", "3")])
        self.assertEqual(len({row["events"] for row in rows}), 6)
        self.assert_same_as_alone(["event_camera.contrast_threshold", "event_camera.seed"])
        self.assertEqual(len(result.stdout.splitlines()), 1 + 6)
        self.assertTrue((self.out / "sweep.png").read_bytes().startswith(b"\x89PNG"))

    def test_the_table_has_the_statistics_of_the_runs(self):
        self.assertEqual(self.sweep(THRESHOLDS, "camera.width=48,64").returncode, 0)
        self.assertEqual(self.simulations(), ["simulation0000", "simulation0001"])
        for row in self.table():
            stats = json.loads(run("stats", self.out / row["folder"], "--json").stdout)
            for column, (section, name) in COLUMNS.items():
                self.assertAlmostEqual(float(row[column]), stats[section][name], delta=1e-9 * stats[section][name], msg=column)
            self.assertEqual(stats["pixels"]["width"], int(row["camera.width"]))
            self.assertAlmostEqual(float(row["on_fraction"]), stats["stream"]["on"] / stats["stream"]["events"])
            self.assertAlmostEqual(float(row["rate_per_pixel_hz"]), stats["stream"]["mean_rate_hz"] / (int(row["camera.width"]) * 36))
            report = json.loads((self.out / row["folder"].split("/")[0] / "report.json").read_text())
            self.assertEqual(float(row["real_time_factor"]), report["real_time_factor"])

    def test_what_would_change_the_events_is_not_shared(self):
        adaptive = ("--set", "sampling={type: adaptive}")
        result = self.sweep(THRESHOLDS, "event_camera.seed=1,2", options=adaptive)
        self.assertIn("4 runs in 2 simulations", result.stderr)  # sampling depends on the threshold, not on the seed
        self.assertIn("hint: the sampling", result.stderr)
        self.assert_same_as_alone(["event_camera.contrast_threshold", "event_camera.seed"], adaptive)

    def test_the_seed_is_shared_if_it_is_only_that_of_the_sensors(self):
        result = self.sweep("seed=1,2")
        self.assertIn("2 runs in 1 simulation", result.stderr)
        self.assert_same_as_alone(["seed"])
        self.assertFalse((self.out / "sweep.png").exists())
        for text in ("imu={}", "frame_camera={}", "trajectory={type: random, position_amplitude_m: [0, 0.1, 0]}"):
            self.out = self.folder / f"out_{text[:3]}"
            result = self.sweep("seed=1,2", options=("--set", text))
            self.assertIn("2 runs in 2 simulations", result.stderr)
            self.assert_same_as_alone(["seed"], ("--set", text))

    def test_flicker_is_divided_as_each_sensor_requires(self):
        flicker = ("--set", "light.flicker={frequency_hz: 100}")
        result = self.sweep(THRESHOLDS, options=flicker)
        self.assertIn("2 runs in 2 simulations", result.stderr)
        self.assert_same_as_alone(["event_camera.contrast_threshold"], flicker)

    def test_sensors_and_cameras_of_the_scenario(self):
        text = self.scenario.read_text().replace("camera: {width: 48, height: 36}\n", "cameras: [{width: 48, height: 36}, {width: 32, height: 24}]\n")
        self.scenario.write_text(text + "event_cameras: [{name: low, contrast_threshold: 0.1}, {name: high}]\n")
        result = self.sweep("event_camera.refractory_period_us=0,10000")
        self.assertEqual(result.returncode, 0, result.stderr)
        rows = self.table()
        self.assertEqual([row["folder"].split("/", 1)[1] for row in rows if row["run"] == "1"],
                         ["cam0/run0001_low", "cam0/run0001_high", "cam1/run0001_low", "cam1/run0001_high"])
        alone = self.folder / "alone"
        self.assertEqual(run("simulate", self.scenario, "--out", alone, "--set", "event_camera.refractory_period_us=10000").returncode, 0)
        for row in rows[4:]:
            path = row["folder"].split("/", 1)[1].replace("run0001_", "")
            self.assertEqual((self.out / row["folder"] / "events.h5").read_bytes(), (alone / path / "events.h5").read_bytes())

    def test_continues_after_an_end(self):
        over = ("camera.width=40,44,48,52", "event_camera.contrast_threshold=0.2,0.3")
        self.assertEqual(self.sweep(*over, options=("--jobs", 1)).returncode, 0)
        whole = {row["folder"]: (self.out / row["folder"] / "events.h5").read_bytes() for row in self.table()}
        for end, status in ((signal.SIGKILL, -9), (signal.SIGINT, 130)):
            self.out = self.folder / f"out_{end}"
            command = ["sweep", self.scenario, "--out", self.out, "--jobs", 1, *(word for text in over for word in ("--over", text))]
            process = subprocess.Popen([ESIM, *map(str, command)], stderr=subprocess.PIPE, text=True)
            while not (self.out / "simulation0000").exists():
                time.sleep(0.002)
            process.send_signal(end)
            errors = process.communicate(timeout=60)[1]
            if process.returncode != 0:  # otherwise it was faster
                self.assertEqual(process.returncode, status, errors)
                self.assertFalse((self.out / "sweep.csv").exists())
            if process.returncode == 130:
                self.assertRegex(errors, r"interrupted: [1-3] of 4 simulations are complete in .*; the same command continues")
            first = (self.out / "simulation0000/report.json").stat().st_mtime_ns
            result = self.sweep(*over, options=("--jobs", 2))
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual((self.out / "simulation0000/report.json").stat().st_mtime_ns, first, "what is complete is not made again")
            self.assertEqual({row["folder"]: (self.out / row["folder"] / "events.h5").read_bytes() for row in self.table()}, whole)
            self.assertEqual([path.name for path in self.out.iterdir() if "incomplete" in path.name], [])

    def test_other_arguments_are_refused(self):
        self.assertEqual(self.sweep(THRESHOLDS).returncode, 0)
        table = (self.out / "sweep.csv").read_bytes()
        for over, options, named in (
            (["event_camera.contrast_threshold=0.15,0.4"], (), 'over.event_camera.contrast_threshold is ["0.15","0.3"] there, but ["0.15","0.4"] here'),
            ([THRESHOLDS, "seed=1,2"], (), 'over.seed is missing there, but ["1","2"] here'),
            ([THRESHOLDS], ("--set", "duration_s=0.1"), 'set is [] there, but ["duration_s=0.1"] here'),
        ):
            result = self.sweep(*over, options=options)
            self.assertEqual(result.returncode, 2)
            self.assertIn(named, result.stderr)
            self.assertIn("choose another folder", result.stderr)
        self.scenario.write_text(SCENARIO + "# changed\n")
        self.assertIn("text differs", self.sweep(THRESHOLDS).stderr)
        self.assertEqual((self.out / "sweep.csv").read_bytes(), table)

    def test_a_folder_with_other_files_is_refused(self):
        self.out.mkdir()
        (self.out / "notes.txt").write_text("mine")
        result = self.sweep(THRESHOLDS)
        self.assertEqual(result.returncode, 2)
        self.assertIn("must be a sweep or an empty folder", result.stderr)
        self.assertEqual([path.name for path in self.out.iterdir()], ["notes.txt"])

    def test_errors_name_the_option(self):
        for over, named in (
            (["event_camera.contrast_treshold=0.1"], ("--over camera.event_camera.contrast_treshold: unknown key", "did you mean contrast_threshold?")),
            (["event_camera.contrast_threshold=0.1,-1"], ("--over camera.event_camera.contrast_threshold", "-1")),
            (["event_camera.contrast_threshold="], ("has no values",)),
            (["event_camera.contrast_threshold=0.1,,0.2"], ("value 2 is empty",)),
            (["event_camera.contrast_threshold"], ("must be KEY=VALUE",)),
            (["seed=1,2", "seed=3"], ("--over seed: is given twice",)),
            (["event_camera.seed=1,2", "event_camera={preset: ideal},{preset: davis346}"], ("replaces event_camera.seed",)),
            (["seed=1,1"], ("the value 1 is given twice",)),
            (["seed=5..1"], ("the range is reversed; write 1..5",)),
            (["duration_s=0.1..0.5"], ("a range must be of whole numbers",)),
            (["seed=1..2000000000000"], ("more than 1,000 values",)),
            (["seed=1..100", "camera.width=40..60"], ("2,100 runs, but --max-runs is 1,000",)),
            (["camera.events=true,false"], ("no camera has an event sensor with camera.events=false",)),
        ):
            self.assert_refused(self.sweep(*over), *named)
        self.assert_refused(self.sweep("seed=1,2", options=("--set", "seed=4")), "--over seed: is also set for all runs")
        self.assert_refused(self.sweep("seed=1,2", options=("--set", "duration=4")), "--set duration")

    def test_lists_and_maps_are_values(self):
        result = self.sweep("sampling={type: flow, lambda: 1},{type: uniform, rate_hz: 200}")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual([row["sampling"] for row in self.table()], ["{type: flow, lambda: 1}", "{type: uniform, rate_hz: 200}"])

    def test_help_has_examples(self):
        self.assertIn("esim sweep scenes/room.yaml --over event_camera.contrast_threshold=0.1,0.2,0.3", run("sweep", "--help").stdout)


if __name__ == "__main__":
    unittest.main(argv=["sweep_test.py"], verbosity=1)
