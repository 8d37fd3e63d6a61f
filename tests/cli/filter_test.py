"""`esim filter` as its users meet it: exit codes, messages, results, and what is left on disk.

Run as: filter_test.py ESIM_PROGRAM SCENES, with the standard library of Python alone.
"""

import json
import os
import pathlib
import pty
import random
import subprocess
import sys
import unittest

from program import ESIM, ProgramTest, run

SCENES = pathlib.Path(sys.argv[2])
WIDTH, HEIGHT = 64, 48
SIZE = ["--width", WIDTH, "--height", HEIGHT]


def to_line(event):
    t, x, y, p = event
    return f"{t // 10**9}.{t % 10**9:09} {x} {y} {p}\n"


def random_events(count, seed=1, step_ns=200_000):
    """Events (t ns, x, y, p) in order; few pixels, so that there are bursts."""
    chance = random.Random(seed)
    events, t = [], 1_000_000_000
    for _ in range(count):
        t += 1000 * chance.randrange(1, step_ns // 500)
        events.append((t, chance.randrange(8) * 8, chance.randrange(6) * 8, chance.randrange(2)))
    return events


def trail(events, kind, threshold_ns):
    """What the event trail filter documents, slowly."""
    pixels, kept = {}, []
    for event in events:
        t, x, y, p = event
        last, polarity, position = pixels.get((x, y), (None, None, 0))
        position = position + 1 if polarity == p and t - last <= threshold_ns else 1
        pixels[x, y] = (t, p, position)
        if {"trail": position == 1, "stc_cut_trail": position == 2, "stc_keep_trail": position > 1}[kind]:
            kept.append(event)
    return kept


class Filter(ProgramTest):
    def setUp(self):
        super().setUp()
        self.events = random_events(3000)
        self.text = self.write("events.txt", self.events)

    def write(self, name, events):
        path = self.folder / name
        path.write_text("".join(map(to_line, events)))
        return path

    def filter(self, *arguments, code=0, source=None):
        result = run("filter", source or self.text, *arguments)
        self.assertEqual(result.returncode, code, result.stderr)
        return result

    def filtered(self, *arguments):
        """The lines that pass."""
        out = self.folder / "filtered.txt"
        self.filter("-o", out, *SIZE, "--force", *arguments)
        return out.read_text()

    def lines(self, events):
        return "".join(map(to_line, events))

    def test_regions_and_masks(self):
        def inside(e):
            return 8 <= e[1] < 32 and 16 <= e[2] < 40
        self.assertEqual(self.filtered("--roi", "8,16,24,24"), self.lines(filter(inside, self.events)))
        self.assertEqual(self.filtered("--roni", "8,16,24,24"), self.lines(e for e in self.events if not inside(e)))
        def both(e):
            return inside(e) or (e[1], e[2]) == (56, 40)
        self.assertEqual(self.filtered("--roi", "8,16,24,24", "--roi", "56,40,1,1"), self.lines(filter(both, self.events)))
        masked = [e for e in self.events if (e[1], e[2]) not in ((8, 8), (16, 0), (24, 32))]
        mask = self.folder / "mask.txt"
        mask.write_text("# hot pixels\n16 0\n\n24 32  # the last one\r\n")
        self.assertEqual(self.filtered("--mask-pixel", "8,8", "--mask-file", mask), self.lines(masked))

    def test_each_type_of_trail(self):
        for kind in ("trail", "stc_cut_trail", "stc_keep_trail"):
            expected = trail(self.events, kind, 20_000_000)
            self.assertGreater(len(expected), 100)
            self.assertEqual(self.filtered("--trail-type", kind, "--trail-threshold-us", "20000"), self.lines(expected))
        self.assertEqual(self.filtered("--trail"), self.lines(trail(self.events, "trail", 10_000_000)))

    def test_flicker_and_rates(self):
        flicker = [(1_000_000_000 + k * 5_000_000 + i * 1000, 8 + i % 4, 8 + i // 4, k % 2)
                   for k in range(200) for i in range(16)]  # 100 Hz
        self.text = self.write("flicker.txt", flicker)
        self.assertLess(self.filtered("--anti-flicker").count("\n"), len(flicker) // 5)
        self.assertEqual(self.filtered("--anti-flicker-low-hz", "120"), self.lines(flicker))
        kept = self.filtered("--rate-controller-period-us", "5000", "--rate-controller-events-per-period", "4")
        self.assertEqual(kept.count("\n"), 4 * 200)
        self.assertEqual(self.filtered("--activity-lower-start", "1e6"), "")
        self.assertEqual(self.filtered("--activity-window-us", "10000", "--activity-upper-stop", "1e6"), self.lines(flicker))

    def test_the_order_of_the_options_does_not_matter(self):
        several = [["--rate-controller-events-per-period", "2", "--rate-controller-period-us", "1000"], ["--trail"],
                   ["--roi", "0,0,40,40"], ["--mask-pixel", "8,8"]]
        results = {self.filtered(*(word for option in order for word in option)) for order in (several, several[::-1])}
        self.assertEqual(len(results), 1)

    def test_every_format_gives_the_same_events(self):
        """Formats are read in portions of different sizes."""
        arguments = ["--trail-type", "stc_keep_trail", "--rate-controller-period-us", "5000",
                     "--rate-controller-events-per-period", "9", "--roi", "0,0,60,60"]
        self.text = self.write("long.txt", random_events(300_000, step_ns=2000))
        expected = self.filtered(*arguments)
        self.assertGreater(expected.count("\n"), 1000)
        for extension in (".h5", ".raw", ".dat", ".npy", ".npz", ".aedat4", ".bag", ".mcap"):
            other, out = self.folder / f"other{extension}", self.folder / f"filtered{extension}"
            self.assertEqual(run("convert", self.text, other, *SIZE).returncode, 0)
            self.filter("-o", out, *arguments, *SIZE, source=other)  # .npy does not contain the size
            back = self.folder / "back.txt"
            self.assertEqual(run("convert", out, back, "--force").returncode, 0)
            self.assertEqual(back.read_text(), expected, extension)

    def test_the_report(self):
        out = self.folder / "a.txt"
        result = self.filter("-o", out, *SIZE, "--trail", "--roi", "0,0,32,48", "--json")
        (camera,) = json.loads(result.stdout)
        self.assertEqual(camera["events"], 3000)
        self.assertEqual(list(camera["dropped"]), ["region", "trail"], "the order in which events pass")
        self.assertEqual(camera["dropped"]["region"], sum(e[1] >= 32 for e in self.events))
        self.assertEqual(camera["kept"], out.read_text().count("\n"))
        self.assertEqual(camera["kept"] + sum(camera["dropped"].values()), 3000)
        result = self.filter("-o", out, *SIZE, "--trail", "--force")
        self.assertEqual(result.stdout, "")
        self.assertRegex(result.stderr, r"(?m)^cam0 +3,000 events$")
        self.assertRegex(result.stderr, r"(?m)^  trail +[\d,]+ dropped +[\d.]+ %$")
        self.assertRegex(result.stderr, r"(?m)^  all +[\d,]+ kept +[\d.]+ %$")
        quiet = self.filter("-o", out, *SIZE, "--trail", "--force", "--quiet")
        self.assertEqual(quiet.stdout + quiet.stderr, "")

    def test_keeps_the_other_streams_of_a_recording(self):
        recording = self.folder / "recording"
        simulated = run("simulate", SCENES / "poster.yaml", "--out", recording, "--set", "duration_s=0.1",
                        "--set", "camera.width=64", "--set", "camera.height=48", "--set", "imu.rate_hz=200")
        self.assertEqual(simulated.returncode, 0, simulated.stderr)
        self.filter("-o", self.out, "--trail", "--time-unit", "ns", source=recording)
        report = json.loads((self.out / "report.json").read_text())
        self.assertEqual(report["filters"], {"trail": {"type": "trail", "threshold_us": 10000.0}})
        self.assertEqual(report["filtered"][0]["name"], "cam0")
        self.assertGreater(report["filtered"][0]["dropped"]["trail"], 0)
        plain = self.folder / "plain"
        self.assertEqual(run("convert", recording, plain, "--time-unit", "ns").returncode, 0)
        def names(folder):
            return {p.relative_to(folder) for p in folder.rglob("*") if p.is_file()}
        self.assertEqual(names(self.out), names(plain))
        for name in names(plain) - {pathlib.Path("report.json"), pathlib.Path("cam0/events.h5")}:
            self.assertEqual((self.out / name).read_bytes(), (plain / name).read_bytes(), name)

    def test_removes_the_flicker_of_lamps(self):
        recording = self.folder / "recording"
        simulated = run("simulate", SCENES / "poster.yaml", "--out", recording, "--set", "duration_s=0.5",
                        "--set", "trajectory={type: static}", "--set", "light.flicker={depth: 0.6, frequency_hz: 120}",
                        "--set", "camera.width=64", "--set", "camera.height=48")
        self.assertEqual(simulated.returncode, 0, simulated.stderr)

        def dropped(*arguments):
            result = self.filter("-o", self.out, "--force", "--json", "--anti-flicker", *arguments, source=recording)
            (camera,) = json.loads(result.stdout)
            self.assertGreater(camera["events"], 60 * 64 * 48)  # more than an event per period of each pixel
            return camera["dropped"]["anti_flicker"] / camera["events"]
        self.assertGreater(dropped(), 0.85)  # a block is known to flicker after 6 of 60 periods
        self.assertGreater(dropped("--anti-flicker-low-hz", "110", "--anti-flicker-high-hz", "130"), 0.85)
        self.assertEqual(dropped("--anti-flicker-high-hz", "110"), 0)

    def test_a_scenario_with_filters_gives_the_same_events(self):
        """Filters in the sensor against `esim filter` on the recording without them."""
        filters = {
            "region": ("{windows: [{x: 8, y: 4, width: 50, height: 40}], masked_pixels: [{x: 20, y: 20}]}",
                       ["--roi", "8,4,50,40", "--mask-pixel", "20,20"]),
            "activity": ("{window_us: 5000, lower_start: 2e4, lower_stop: 1e4}",
                         ["--activity-window-us", "5000", "--activity-lower-start", "2e4",
                          "--activity-lower-stop", "1e4"]),
            "anti_flicker": ("{high_hz: 5000, start_threshold: 2, stop_threshold: 1}",
                             ["--anti-flicker-high-hz", "5000", "--anti-flicker-start-threshold", "2",
                              "--anti-flicker-stop-threshold", "1"]),
            "trail": ("{threshold_us: 20000}", ["--trail-threshold-us", "20000"]),
            "rate_controller": ("{period_us: 5000, events_per_period: 50}",
                                ["--rate-controller-period-us", "5000", "--rate-controller-events-per-period", "50"]),
        }

        def simulate(out, *changes):
            result = run("simulate", SCENES / "poster.yaml", "--out", out, "--force", *(word for change in (
                "duration_s=0.1", "camera.width=64", "camera.height=48", "output.time_unit=ns", "output.preview=false",
                "event_camera.contrast_threshold=0.15", "event_camera.leak_rate_hz=5", *changes)
                for word in ("--set", change)))
            self.assertEqual(result.returncode, 0, result.stderr)
            return result

        def text(recording):
            out = self.folder / "events_of.txt"
            self.assertEqual(run("convert", recording, out, "--force", "--time-unit", "ns").returncode, 0)
            return out.read_bytes()

        plain, inside, after = (self.folder / name for name in ("plain", "inside", "after"))
        simulate(plain)
        total = text(plain).count(b"\n")
        for names in [[name] for name in filters] + [list(filters)]:
            result = simulate(inside, *(f"event_camera.filters.{name}={filters[name][0]}" for name in names))
            self.filter("-o", after, "--force", "--time-unit", "ns", *(word for name in names for word in filters[name][1]),
                        source=plain)
            self.assertEqual(text(inside), text(after), names)
            reports = [json.loads((out / "report.json").read_text()) for out in (inside, after)]
            self.assertEqual(reports[0]["filtered"], reports[1]["filtered"])
            (camera,) = reports[0]["filtered"]
            self.assertEqual(camera["events"], total)
            self.assertEqual(list(camera["dropped"]), names)
            self.assertGreater(min(camera["dropped"].values()), 0, camera)
            self.assertGreater(camera["kept"], 50)
            self.assertRegex(result.stderr, rf"(?m)^  {names[-1]} +[\d,]+ dropped +[\d.]+ %$")
        for change in ("truth.rate_hz=1234", "truth.rate_hz=0"):  # other divisions of the stream of events
            simulate(after, change, *(f"event_camera.filters.{name}={filters[name][0]}" for name in names))
            self.assertEqual(text(inside), text(after), change)

    def test_filters_of_the_sensor_in_messages(self):
        made = self.folder / "made"
        def simulate(*changes, out=made):
            return run("simulate", SCENES / "poster.yaml", "--out", out, "--force", "--set", "duration_s=0.02",
                       "--set", "output.preview=false", *(word for change in changes for word in ("--set", change)))
        result = simulate("event_camera.preset=davis346", "event_camera.filters.anti_flicker={}")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("warning: camera cam0: event_camera.filters.anti_flicker: the davis346 has no such filter, but "
                      "these have: gen4.1, imx636, genx320; it is applied anyway\n", result.stderr)
        self.assertIn("anti_flicker", json.loads((made / "report.json").read_text())["notices"][0])
        result = simulate("event_camera.preset=imx636", "event_camera.filters.anti_flicker={}")
        self.assertNotIn("no such filter", result.stderr)
        for change, says in {
            "anti_flicker={low_hz: 300, high_hz: 200}": ["anti_flicker.low_hz", "must be below high_hz, 200 Hz"],
            "activity={}": ["activity: has no bound"],
            "region={windows: [{x: 4000, y: 0}]}": ["region.windows.0", "(4000, 0) lies outside the sensor"],
            "region={masked_pixels: [{x: 0, y: 4000}]}": ["region.masked_pixels.0", "lies outside the sensor"],
            "trail={threshold_us: 0}": ["trail.threshold_us", "must be"],
            "tail={}": ["tail", "trail"],
        }.items():
            refused = simulate(f"event_camera.filters.{change}", out=self.out)
            self.assert_refused(refused, "event_camera.filters.", *says)
        video = self.folder / "frames"
        video.mkdir()
        for k in range(3):
            (video / f"{k}.pgm").write_bytes(b"P5 32 24 255\n" + bytes((x * 5 + k * 40) % 256 for x in range(32 * 24)))
        def convert(*changes, out=made):
            return run("video", video, "--fps", "100", "--out", out, "--force",
                       *(word for change in changes for word in ("--set", change)))
        self.assert_refused(convert("filters.region.windows=[{x: 32, y: 0}]", out=self.out),
                            "event_camera.filters.region.windows.0: (32, 0) lies outside the sensor of 32 x 24 px")
        result = convert("preset=dvs128", "filters.trail={}")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("event_camera.filters.trail: the dvs128 has no such filter", result.stderr)
        self.assertGreater(json.loads((made / "report.json").read_text())["filtered"][0]["events"], 0)

    def test_one_camera_of_several(self):
        rig = self.folder / "rig"
        for camera in ("left", "right"):
            (rig / camera).mkdir(parents=True)
            (rig / camera / "events.txt").write_text(self.lines(self.events))
        (rig / "report.json").write_text(
            '{"cameras": [{"name": "left", "width": 64, "height": 48}, {"name": "right", "width": 64, "height": 48}]}')
        out = self.folder / "a.txt"
        self.assertIn("choose one with --camera", self.filter("-o", out, "--trail", source=rig, code=2).stderr)
        result = self.filter("-o", out, "--trail", "--camera", "right", "--json", source=rig)
        self.assertEqual([c["name"] for c in json.loads(result.stdout)], ["right"])
        both = self.filter("-o", self.folder / "a.bag", "--trail", "--json", source=rig)
        self.assertEqual([c["name"] for c in json.loads(both.stdout)], ["left", "right"])

    def test_what_is_refused(self):
        out = ["-o", self.out.with_suffix(".txt")]
        def refused(*arguments, **options):
            return self.assert_refused(run("filter", self.text, *arguments), *options["says"])
        refused(*out, *SIZE, says=["no filter is chosen", "--trail"])
        refused("--trail", says=["--out"])
        refused(*out, "--trail", says=["size of the sensor", "--width and --height"])
        refused(*out, *SIZE, "--trail-threshold-us", "0", says=["--trail-threshold-us", "at least 1"])
        refused(*out, *SIZE, "--trail-type", "stc", says=["--trail-type", "stc_cut_trail"])
        refused(*out, *SIZE, "--anti-flicker-low-hz", "600", says=["anti_flicker.low_hz", "below high_hz"])
        refused(*out, *SIZE, "--activity-lower-stop", "5", says=["activity"])
        refused(*out, *SIZE, "--roi", "1,2,3", says=["--roi", "X,Y,WIDTH,HEIGHT", "'1,2,3'"])
        refused(*out, *SIZE, "--roi", "1,2,3,4,5", says=["--roi"])
        refused(*out, *SIZE, "--roi", "1,2,3,", says=["--roi"])
        refused(*out, *SIZE, "--roi", "1,2,3,4,", says=["--roi"])
        refused(*out, *SIZE, "--roi", "", says=["--roi"])
        refused(*out, *SIZE, "--roi", "1,2,3,-4", says=["--roi"])
        refused(*out, *SIZE, "--roi", "1,2,0,4", says=["--roi", "at least 1 px"])
        refused(*out, *SIZE, "--roi", "64,2,3,4", says=["region.windows.0", "outside the sensor of 64 x 48 px"])
        refused(*out, *SIZE, "--roi", "1,2,3,4", "--roni", "1,2,3,4", says=["--ro"])
        refused(*out, *SIZE, "--mask-pixel", "1", says=["--mask-pixel", "X,Y"])
        refused(*out, *SIZE, "--mask-file", self.folder / "none", says=["cannot read", "none"])
        refused(*out, *SIZE, "--mask-file", self.folder, says=[str(self.folder)])
        mask = self.folder / "mask.txt"
        for line in ("1", "1 2 3", "1 -2", "one 2", "1,2"):
            mask.write_text(f"# x y\n{line}\n")
            refused(*out, *SIZE, "--mask-file", mask, says=[f"{mask}:2:", f"'{line}'"])
        refused("-o", self.folder / "out.xyz", *SIZE, "--trail", says=[".xyz"])

    def test_replaces_nothing_unasked(self):
        out = self.folder / "a.h5"
        out.write_text("precious")
        self.assertIn("--force", self.filter("-o", out, *SIZE, "--trail", code=2).stderr)
        self.assertEqual(out.read_text(), "precious")
        self.filter("-o", out, *SIZE, "--trail", "--force")
        self.filter("-o", out, "--trail", "--force", source=out)  # a file may replace itself
        self.assertIn("events", run("info", out).stdout)

    def test_damaged_files_with_and_without_recovery(self):
        self.text.write_text(self.lines(self.events[:500]) + "5.1 3 what 1\n")
        out = self.folder / "a.txt"
        self.assertIn("line 501", self.filter("-o", out, *SIZE, "--trail", code=2).stderr)
        self.assertEqual({p.name for p in self.folder.iterdir()}, {"events.txt"}, "nothing is left of a failure")
        self.assertIn("line 501", self.filter("-o", out, *SIZE, "--trail", "--recover").stderr)
        self.assertEqual(out.read_text(), self.lines(trail(self.events[:500], "trail", 10_000_000)))

    def test_memory_does_not_depend_on_the_length(self):
        """Peak memory for ten times as many events, of which none passes."""
        peaks = []
        for count in (100_000, 1_000_000):
            raw = self.folder / f"{count}.raw"
            text = self.folder / "many.txt"
            with text.open("w") as file:
                for k in range(count):
                    file.write(f"0.{k:06}000 {k % 64} {k % 48} {k % 2}\n")
            self.assertEqual(run("convert", text, raw, *SIZE).returncode, 0)
            command = [ESIM, "filter", raw, "-o", self.folder / f"{count}.h5", "--trail-type", "stc_keep_trail",
                       "--anti-flicker", "--rate-controller"]
            measure = ("import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True, capture_output=True); "
                       "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)")
            # A sanitizer keeps what is freed for a while; this limits how much.
            environment = {**os.environ, "ASAN_OPTIONS": os.environ.get("ASAN_OPTIONS", "") + ":quarantine_size_mb=1"}
            peaks.append(int(subprocess.run([sys.executable, "-c", measure, *command], capture_output=True, text=True,
                                            check=True, env=environment).stdout))
        self.assertLess(peaks[1], peaks[0] + 8000, "kB")

    def test_progress_on_a_terminal(self):
        """A bar with the time left, which does not stay."""
        text = self.write("long.txt", random_events(300_000, step_ns=2000))
        master, slave = pty.openpty()
        process = subprocess.Popen([ESIM, "filter", text, "-o", self.folder / "a.txt", *map(str, SIZE), "--trail"],
                                   stderr=slave)
        os.close(slave)
        shown = b""
        while True:
            try:
                part = os.read(master, 4096)
            except OSError:  # the other end is closed
                break
            shown += part
        os.close(master)
        self.assertEqual(process.wait(), 0)
        self.assertRegex(shown.decode(), r"\[[#.]{24}\] \d+ %  (\d+:\d\d|-:--) left")
        self.assertRegex(shown.decode(), r"done: [\d,]+ events")

    def test_help_lists_the_filters_in_the_order_of_the_chip(self):
        text = run("filter", "--help").stdout
        places = [text.index(option) for option in ("--roi", "--activity-lower-start", "--anti-flicker ", "--trail ",
                                                    "--rate-controller ", "Examples:")]
        self.assertEqual(places, sorted(places))
        self.assertIn("esim filter", run("--help").stdout)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
