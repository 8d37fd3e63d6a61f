"""The program as its users meet it: exit codes, messages, and what is left on disk.

Run as: cli_test.py ESIM_PROGRAM SCENES_FOLDER, with the standard library of Python alone.
"""

import json
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
import unittest

from program import ESIM, ProgramTest, run

SCENES = pathlib.Path(sys.argv[2]).absolute()

# Small enough for a sanitizer: the poster at a low resolution.
FAST = ["--set", "camera.width=64", "--set", "camera.height=48", "--set", "duration_s=0.2"]
ENDLESS = ["--set", "camera.width=64", "--set", "camera.height=48", "--set", "duration_s=5000",
           "--set", "sampling={type: uniform, rate_hz: 2000}", "--set", "output.preview=false"]


class Cli(ProgramTest):
    def simulate(self, *arguments, scenario=SCENES / "poster.yaml", **options):
        return run("simulate", scenario, "--out", self.out, *arguments, **options)

    def start_and_wait_for_events(self):
        process = subprocess.Popen([ESIM, "simulate", SCENES / "poster.yaml", "--out", self.out, *ENDLESS],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        events = pathlib.Path(str(self.out) + ".incomplete") / "cam0" / "events.h5"
        deadline = time.time() + 60
        while not (events.exists() and events.stat().st_size > 500_000):
            self.assertIsNone(process.poll(), "ended early")
            self.assertLess(time.time(), deadline, "wrote no events")
            time.sleep(0.02)
        return process


class RemovedCommands(Cli):
    def test_waypoints_names_the_studio(self):
        for arguments in ([], [SCENES / "room.yaml", "--out", "walk.yaml"], ["room.glb", "--out", "walk.yaml", "--keys", " w x"], ["--help"]):
            self.assert_refused(run("waypoints", *arguments), "removed", "esim studio")
        self.assertNotIn("esim waypoints", run("--help").stdout)
        self.assertNotIn("\n  waypoints", run("--help").stdout)


class Recordings(Cli):
    def test_additional_formats(self):
        for name in ("xyz", "recording"):
            self.assert_refused(run("check", SCENES / "poster.yaml", "--set", f"output.formats=[{name}]"),
                                "output.formats", name)
        result = self.simulate(*FAST, "--set", "output.formats=[text, dsec]")
        self.assertEqual(result.returncode, 0, result.stderr)
        back = self.folder / "back.txt"
        for name in ("events.dsec.h5", "events.h5"):
            self.assertEqual(run("convert", self.out / "cam0" / name, back, "--force").returncode, 0)
            text = (self.out / "cam0" / "events.txt").read_text()
            self.assertEqual(len(back.read_text().splitlines()), len(text.splitlines()))

    def test_reports_name_the_version_of_the_preset(self):
        for given, used in (("davis346", "davis346@2"), ("davis346@1", "davis346@1"), ("ideal", "ideal")):
            result = self.simulate(*FAST, "--force", "--set", "duration_s=0.02", "--set", f"event_camera.preset={given}")
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual(json.loads((self.out / "report.json").read_text())["cameras"][0]["preset"], used)
            self.assertIn(f"preset: {used}\n", (self.out / "scenario.yaml").read_text())

    def test_thresholds_below_the_noise_are_reported_and_limited(self):
        result = self.simulate(*FAST, "--set", "duration_s=0.05", "--set", "event_camera={contrast_threshold: 0.01, circuit: {max_rate_hz: 50}}",
                               "--set", "light.white_lux=0.001")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stderr, r"warning: camera cam0: event_camera: the contrast threshold, 0.01, is below twice the noise .* "
                                        r"expect up to \d+ noise events per second of each pixel")
        self.assertRegex(result.stderr, r"warning: cam0: [\d,]+ events were lost, .*event_camera.circuit.max_rate_hz")
        report = json.loads((self.out / "report.json").read_text())
        camera = report["cameras"][0]
        self.assertGreater(camera["events_lost_by_max_rate"], 0)
        self.assertLess(camera["events"], (0.05 * 50 + 1) * camera["width"] * camera["height"])
        self.assertTrue(any("is below twice the noise" in notice for notice in report["notices"]), report["notices"])

    def test_light_is_named_if_nothing_uses_it(self):
        result = self.simulate(*FAST, "--set", "duration_s=0.02", "--set", "light.white_lux=10")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("warning: light.white_lux: has no effect", result.stderr)

    def test_a_saturated_readout_is_reported(self):
        result = self.simulate(*FAST, "--set", "event_camera.contrast_threshold=0.1",
                               "--set", "event_camera.readout.rate_mev_per_s=0.05", "--set", "output.formats=[text]")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stderr, r"warning: cam0: the readout was saturated: .* % of the events waited")
        self.assertIn("event_camera.readout.rate_mev_per_s (0.05 Mev/s)", result.stderr)
        report = json.loads((self.out / "report.json").read_text())
        camera = report["cameras"][0]
        self.assertGreater(camera["events_delayed_by_readout"], camera["events"] / 100)
        self.assertGreater(camera["longest_readout_delay_s"], 1e-4)
        self.assertTrue(any("the readout was saturated" in notice for notice in report["notices"]), report["notices"])
        # One pixel is never reported twice at once.
        lines = (self.out / "cam0" / "events.txt").read_text().splitlines()
        at_once = {(int(float(t) * 1e6), x, y) for t, x, y, _ in (line.split() for line in lines)}
        self.assertGreater(len(at_once), 1000)
        self.assertEqual(len(at_once), len(lines))

        result = self.simulate(*FAST, "--force", "--set", "event_camera.contrast_threshold=0.1",
                               "--set", "event_camera.readout={rate_mev_per_s: 0.05, queue_events: 10}")
        self.assertRegex(result.stderr, r"warning: cam0: the readout dropped [\d,]+ of [\d,]+ events .*queue_events")

    def test_a_run_that_misses_nothing_warns_of_nothing(self):
        result = self.simulate(*FAST)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertNotIn("warning", result.stderr)

    def test_old_names_of_options_are_valid_with_a_warning(self):
        both = self.simulate("--set", "truth={flow: true, motion_field: true}")
        self.assert_refused(both, "truth.flow: must not be given together with truth.motion_field")
        result = self.simulate(*FAST, "--set", "truth.flow=false", "--set", "truth={displacement: true}")
        self.assertEqual(result.returncode, 0, result.stderr)
        for text in ("truth.flow is now truth.motion_field", "truth.displacement is now truth.optical_flow"):
            self.assertEqual(result.stderr.count(f"warning: {text}"), 1, result.stderr)
            self.assertIn("warning: " + text, json.loads((self.out / "report.json").read_text())["notices"])
        text = (self.out / "scenario.yaml").read_text()
        self.assertIn("optical_flow: true", text)
        self.assertNotIn("displacement: ", text)

    def test_rendering_slower_than_real_time_names_a_faster_sampling(self):
        short = ["--set", "duration_s=0.03", "--set", "truth.rate_hz=0", "--threads", "1", "--force"]
        room = SCENES / "room.yaml"
        slow = self.simulate(*short, "--set", "sampling={type: adaptive}", scenario=room)
        self.assertEqual(slow.returncode, 0, slow.stderr)
        self.assertRegex(slow.stderr, r"hint: .*flow sampling .*: esim simulate \S+room.yaml --set 'sampling=\{type: flow\}'")
        for other in (["--set", "sampling={type: flow}"], ["--set", "sampling={type: adaptive}", "--quiet"]):
            self.assertNotIn("hint:", self.simulate(*short, *other, scenario=room).stderr)

    def test_samples_held_to_the_maximum_rate_are_reported(self):
        result = self.simulate(*FAST, "--set", "sampling={type: flow, lambda: 0.1, max_rate_hz: 100}")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stderr, r"warning: cam0: \d+ intervals between samples were limited by sampling.max_rate_hz "
                                        r"\(100 Hz\).* Raise max_rate_hz, or move more slowly")

    def test_edges_that_move_in_steps_are_reported(self):
        short = ["--set", "start_s=1.5", "--set", "duration_s=0.02", "--set", "truth.rate_hz=0", "--set", "sampling={type: adaptive}", "--force"]
        steps = self.simulate(*short, "--set", "renderer.samples_per_pixel=1", scenario=SCENES / "room.yaml")
        self.assertEqual(steps.returncode, 0, steps.stderr)
        self.assertRegex(steps.stderr, r"warning: cam0: .* limited by sampling.max_rate_hz .* Set renderer.samples_per_pixel to 16")
        smooth = self.simulate(*short, "--set", "renderer.samples_per_pixel=16", scenario=SCENES / "room.yaml")
        self.assertNotIn("max_rate_hz", smooth.stderr)

    def test_a_recording_holds_what_the_manual_says(self):
        result = self.simulate(*FAST, "--set", "output.formats=[text]")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual({p.name for p in self.out.iterdir()},
                         {"calibration", "cam0", "poses.txt", "report.json", "scenario.yaml", "states.csv"})
        self.assertEqual({p.name for p in (self.out / "cam0").iterdir()},
                         {"events.h5", "events.txt", "images", "preview.mp4", "preview.png", "truth.h5"})
        self.assertIn(str(self.out / "cam0" / "preview.png"), result.stderr)
        report = json.loads((self.out / "report.json").read_text())
        self.assertEqual(report["status"], "complete")
        self.assertAlmostEqual(report["simulated_s"], 0.2, places=9)
        camera = report["cameras"][0]
        self.assertEqual(camera["pixel_evaluations"], camera["frames"] * 64 * 48)
        self.assertEqual(camera["events"], len((self.out / "cam0" / "events.txt").read_text().splitlines()))
        self.assertEqual(len((self.out / "poses.txt").read_text().splitlines()), 1 + 41)
        self.assertFalse(any("\r" in line or "\033" in line for line in result.stderr.splitlines()), "a progress bar off a terminal")

    def test_the_same_bytes_with_one_thread_and_two_and_from_the_resolved_scenario(self):
        noise = ["--set", "event_camera.threshold_mismatch=0.02", "--seed", "3"]
        self.assertEqual(self.simulate(*FAST, *noise, "--threads", "1").returncode, 0)
        first = (self.out / "cam0" / "events.h5").read_bytes()
        other = self.folder / "other"
        for arguments in ([SCENES / "poster.yaml", *FAST, *noise, "--threads", "2"], [self.out / "scenario.yaml"]):
            self.assertEqual(run("simulate", *arguments, "--out", other, "--force").returncode, 0)
            self.assertEqual((other / "cam0" / "events.h5").read_bytes(), first)
        self.assertEqual(self.simulate(*FAST, "--seed", "4", "--force").returncode, 0)
        self.assertNotEqual((self.out / "cam0" / "events.h5").read_bytes(), first)

    def test_several_cameras_have_folders(self):
        cameras = "cameras=[{width: 32, height: 24}, {name: right, width: 48, height: 32}]"
        scenario = self.folder / "s.yaml"
        text = (SCENES / "poster.yaml").read_text().replace("poster/", str(SCENES / "poster") + "/")
        scenario.write_text("\n".join(line for line in text.splitlines() if not line.startswith("camera:")))
        truth = "truth={objects: true, optical_flow: true, event_points: true}"
        result = self.simulate("--set", cameras, "--set", truth, "--set", "duration_s=0.1", scenario=scenario)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertTrue((self.out / "cam0" / "events.h5").exists() and (self.out / "right" / "preview.png").exists())
        for camera in json.loads((self.out / "report.json").read_text())["cameras"]:
            header = (self.out / camera["name"] / "event_points.ply").read_bytes().split(b"end_header")[0]
            points = int(header.split(b"element vertex ")[1].split()[0])
            self.assertLessEqual(points, camera["events"])
            self.assertGreater(points, 0.7 * camera["events"], "most are on the poster")
        self.assertIn("right", run("info", self.out).stdout)

    def test_several_sensors_and_new_ones_from_their_samples(self):
        grid = ["--set", "event_camera.contrast_threshold={values: [0.2, 0.4]}", "--set", "sampling={type: flow}"]
        result = self.simulate(*FAST, *grid, "--keep-samples=exact")
        self.assertEqual(result.returncode, 0, result.stderr)
        report = json.loads((self.out / "report.json").read_text())
        self.assertEqual([sensor["varied"] for sensor in report["cameras"][0]["sensors"]],
                         [{"contrast_threshold": "0.2"}, {"contrast_threshold": "0.4"}])
        self.assertIn("cam0/sensor1", run("info", self.out).stdout)
        self.assertIn("cam0/sensor0, cam0/sensor1", run("stats", self.out).stderr)

        again = self.folder / "again"
        result = run("resense", self.out, "--out", again)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("exactly those of a simulation", result.stderr + result.stdout)
        for sensor in ("sensor0", "sensor1"):
            self.assertEqual((self.out / "cam0" / sensor / "events.h5").read_bytes(),
                             (again / "cam0" / sensor / "events.h5").read_bytes())
        self.assertFalse((again / "cam0" / "truth.h5").exists())
        new = self.folder / "new"
        for arguments, problem in (
            ([self.out, "--out", again], "--force"),
            ([self.out, "--out", new, "--set", "camera.width=9"], "--set camera.width: cannot be changed without"),
            ([again, "--out", new], "has no samples; simulate again with output.samples=true (esim simulate --keep-samples)"),
        ):
            result = run("resense", *arguments)
            self.assertEqual(result.returncode, 2)
            self.assertIn(problem, result.stderr)
            self.assertFalse(new.exists())
        self.assertIn("--keep-samples", self.simulate(*FAST, "--keep-samples=some").stderr)

    def test_an_imu_is_written_the_same_again_from_the_resolved_scenario(self):
        imu = ["--set", "imu={rate_hz: 400, T_body_imu: {position: [0.1, 0, 0]}, gyroscope: {random_walk: 0.1}}"]
        self.assertEqual(self.simulate(*FAST, *imu, "--threads", "1").returncode, 0)
        rows = [line.split(",") for line in (self.out / "imu.csv").read_text().splitlines()]
        self.assertEqual(rows[0][0], "#timestamp [ns]")
        self.assertEqual([int(row[0]) for row in rows[1:]], [2_500_000 * k for k in range(81)])
        self.assertTrue(all(len(row) == 7 for row in rows))
        self.assertEqual(json.loads((self.out / "report.json").read_text())["imu_samples"], 81)
        self.assertIn("update_rate: 400", (self.out / "calibration" / "imu.yaml").read_text())
        again = self.folder / "again"
        self.assertEqual(run("simulate", self.out / "scenario.yaml", "--out", again, "--threads", "2").returncode, 0)
        for name in ("imu.csv", "imu_truth.csv", "states.csv", "cam0/events.h5", "calibration/camchain.yaml"):
            self.assertEqual((again / name).read_bytes(), (self.out / name).read_bytes(), name)
        self.assertIn("imu: 400 Hz", run("check", self.out / "scenario.yaml").stdout)
        shutil.rmtree(self.out)
        self.assert_refused(self.simulate(*FAST, "--set", "imu.rate_hz=2e9"), "imu.rate_hz", "out of range")

    def test_quiet_says_nothing(self):
        result = self.simulate(*FAST, "--quiet")
        self.assertEqual((result.returncode, result.stdout, result.stderr), (0, "", ""))

    def test_opengl_shows_what_the_ray_caster_shows(self):
        room = SCENES / "room.yaml"
        options = ["--set", "duration_s=0.05", "--set", "output.preview=false"]
        check = run("check", room, "--set", "renderer.engine=gl")
        if "libegl1" in check.stderr:
            self.skipTest("no OpenGL: libegl1, libgl1-mesa-dri")
        self.assertIn("on OpenGL, ", check.stdout, check.stderr)
        reports = {}
        for engine in ("gl", "raycast", "auto"):
            out = self.folder / engine
            result = run("simulate", room, "--out", out, "--set", f"renderer.engine={engine}", *options)
            self.assertEqual(result.returncode, 0, result.stderr)
            reports[engine] = json.loads((out / "report.json").read_text())["cameras"][0]
        self.assertIn("OpenGL", reports["gl"]["renderer"])
        self.assertEqual(reports["raycast"]["renderer"], "mesh (raycast)")
        events = [reports[engine]["events"] for engine in ("gl", "raycast")]
        self.assertLess(abs(events[0] / events[1] - 1), 0.1)
        self.assert_refused(run("check", room, "--set", "renderer.engine=gl", "--set", "renderer.gl_device=30"),
                            "gl_device", "30")
        self.assert_refused(run("check", room, "--set", "renderer.engine=vulkan"), "renderer.engine", "raycast, raster, gl")

    def test_opengl_shows_the_splats_that_the_processor_shows(self):
        scene = SCENES / "splats.yaml"
        options = ["--set", "duration_s=0.02", "--set", "output.preview=false",
                   "--set", "camera={width: 160, height: 120, horizontal_fov_deg: 75}"]
        cameras = {}
        for engine in ("gl", "processor"):
            out = self.folder / engine
            result = run("simulate", scene, "--out", out, "--set", f"renderer.engine={engine}", *options)
            if "libegl1" in result.stderr:
                self.skipTest("no OpenGL: libegl1, libgl1-mesa-dri")
            self.assertEqual(result.returncode, 0, result.stderr)
            cameras[engine] = json.loads((out / "report.json").read_text())["cameras"][0]
        self.assertIn("on OpenGL, ", cameras["gl"]["renderer"])
        self.assertLess(abs(cameras["gl"]["events"] / cameras["processor"]["events"] - 1), 0.01)
        ball = {"scene": str(SCENES / "room" / "room.obj"), "trajectory": {"type": "static"}}
        self.assert_refused(run("check", scene, "--set", "renderer.engine=gl", "--set", f"renderer.objects=[{json.dumps(ball)}]"),
                            "renderer.engine", "use processor")

    def test_opengl_renders_keyframes(self):
        room = SCENES / "room.yaml"
        if "libegl1" in run("check", room, "--set", "renderer.engine=gl").stderr:
            self.skipTest("no OpenGL: libegl1, libgl1-mesa-dri")
        cameras = {}
        # The samples of a software driver are too few for exact edges; those of a keyframe are four times as dense.
        for engine, sampling in (("raster", "{type: flow, lambda: 1}"), ("gl", "{type: keyframes, supersampling: 2}")):
            out = self.folder / sampling[7:11]
            result = run("simulate", room, "--out", out, "--set", f"renderer.engine={engine}", "--set", f"sampling={sampling}",
                         "--set", "duration_s=0.1", "--set", "output.preview=false",
                         "--set", "camera={width: 120, height: 90, horizontal_fov_deg: 75}")
            self.assertEqual(result.returncode, 0, result.stderr)
            cameras[sampling[7:11]] = json.loads((out / "report.json").read_text())["cameras"][0]
        flow, keyframes = cameras["flow"], cameras["keyf"]
        self.assertIn("OpenGL", keyframes["renderer"])
        self.assertEqual(keyframes["supersampling"], 2)
        self.assertEqual(keyframes["audits"], 1)
        self.assertLess(keyframes["frames"], flow["frames"])
        self.assertLess(abs(keyframes["events"] / flow["events"] - 1), 0.15)
        self.assertEqual(keyframes["bisections"], 0)
        self.assertLess(keyframes["measured_error"]["mean"], 0.1)
        self.assertGreater(keyframes["resampling_error"]["p99"], 0)

    def test_without_egl_says_what_to_install_and_the_ray_caster_works(self):
        nothing = {**os.environ, "__EGL_VENDOR_LIBRARY_DIRS": "/nonexistent"}
        room = SCENES / "room.yaml"
        self.assert_refused(run("check", room, "--set", "renderer.engine=gl", env=nothing), "libegl1", "raycast")
        for engine in ("auto", "raycast"):
            result = run("check", room, "--set", f"renderer.engine={engine}", env=nothing)
            self.assertEqual(result.returncode, 0, result.stderr)

    def test_info_and_check_and_options(self):
        self.simulate(*FAST)
        for path in (self.out, self.out / "cam0", self.out / "cam0" / "events.h5"):
            result = run("info", path)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn("64", result.stdout)
        result = run("check", SCENES / "poster.yaml", *FAST)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("64x48", result.stdout)
        self.assertIn("duration: 2.000 s", run("check", SCENES / "sprites.yaml").stdout)
        reference = (SCENES.parent / "docs" / "scenario.md").read_text()
        self.assertIn(run("options").stdout, reference, "docs/scenario.md is out of date: scripts/update-docs")
        self.assertIn("Examples", run("--help").stdout)
        commands = re.findall(r"^  (\w+) ", run("--help").stdout.split("Subcommands:\n")[1].split("\n\n")[0], re.MULTILINE)
        self.assertIn("docs", commands)
        for command in commands:
            self.assertRegex(run(command, "--help").stdout, rf"Examples?:\n  esim .*\b{command}\b", command)


@unittest.skipUnless(os.environ.get("ESIM_TEST_DATA") and os.path.isdir(os.environ["ESIM_TEST_DATA"]), "needs ESIM_TEST_DATA")
class RealScenes(Cli):
    def test_the_originals_set_ups_run(self):
        for scenario in sorted((SCENES.parent / "tests" / "scenarios").glob("*.yaml")):
            with self.subTest(scenario.name):
                result = self.simulate("--set", "duration_s=0.03", "--force", scenario=scenario)
                self.assertEqual(result.returncode, 0, result.stderr)
                report = json.loads((self.out / "report.json").read_text())
                self.assertGreater(report["cameras"][0]["events"], 100)


class BadInput(Cli):
    def test_command_line(self):
        self.assert_refused(run("simulate"), "scenario")
        self.assert_refused(run("frobnicate"))
        self.assert_refused(run("simulate", self.folder / "none.yaml", "--out", self.out), "none.yaml", "no such")
        self.assert_refused(run("info", self.folder / "none"))

    def test_unknown_words_are_named_with_the_most_similar_ones(self):
        for arguments, *words in ((["simulat"], "no command simulat", "did you mean simulate?"), (["--hlp"], "--help"),
                                  ([], "needs a command", "simulate, resense, sweep, video"), (["evaluate", "relism"], "mean realism?"),
                                  (["simulate", "x.yaml", "--outt", "x"], "no option --outt", "--out?", "esim simulate --help"),
                                  (["simulate", "x.yaml", "--qqqqqqq=5"], "no option --qqqqqqq;", "options are --help, --out")):
            with self.subTest(arguments=arguments):
                self.assert_refused(run(*arguments), *words)

    def test_values(self):
        cases = {
            "event_camera.contrast_treshold=0.2": "did you mean contrast_threshold?",
            "event_camera.contrast_threshold=high": "must be a number",
            "sampling.lambda=0": "above 0",
            "sampling.lambda=.inf": "must be a number",
            "camera.width=0": "at least 1",
            "duration_s=-1": "above 0",
            "truth.rate_hz=-1": "at least 0",
            "truth={rate_hz: 0, optical_flow: true}": "needs two frames",
            "renderer.image=none.jpg": "no such file",
            "trajectory={type: file, path: none.txt}": "none.txt",
            "renderer.pose.look_at=[-5, 0, 0]": "never sees",
            "renderer={type: mesh, scene: none.obj}": "no such file",
            "camera={calibration: none.yaml}": "no such file",
            "output.compression=zip": "is not one of",
        }
        for setting, message in cases.items():
            with self.subTest(setting):
                arguments = ["--set", setting]
                if message == "never sees":
                    arguments += ["--set", "renderer.pose.position=[-6, 0, 0]"]
                self.assert_refused(self.simulate(*arguments), message)

    def test_unreadable_files(self):
        scenario = self.folder / "s.yaml"
        for name, content, message in [
            ("image.png", b"\x89PNG\r\n\x1a\nbroken", "cannot be decoded"),
            ("image.exr", b"\x76\x2f\x31\x01broken", "cannot be read"),
        ]:
            (self.folder / name).write_bytes(content)
            scenario.write_text(f"duration_s: 1\nrenderer: {{type: panorama, image: {name}}}\ntrajectory: {{type: static}}\n")
            self.assert_refused(self.simulate(scenario=scenario), name, message)
        (self.folder / "mesh.obj").write_text("v 0 0 0\n")
        scenario.write_text("duration_s: 1\nrenderer: {type: mesh, scene: mesh.obj}\ntrajectory: {type: static}\n")
        self.assert_refused(self.simulate(scenario=scenario), "mesh.obj")

    def test_degenerate_trajectories(self):
        for content in ("", "0 0 0 0 0 0 0 1\n", "0 0 0 0 0 0 0 1\n0 0 0 1 0 0 0 1\n", "1 0 0 0 0 0 0 1\n0 0 0 1 0 0 0 1\n",
                        "0 0 0 0 0 0 0 0\n1 0 0 0 0 0 0 1\n", "0 0 0 nan 0 0 0 1\n1 0 0 0 0 0 0 1\n", "0 0 0\n1 0 0\n"):
            with self.subTest(content):
                path = self.folder / "t.txt"
                path.write_text(content)
                self.assert_refused(self.simulate("--set", f"trajectory={{type: file, path: {path}}}"), "t.txt")

    def test_a_missing_texture_is_a_warning_and_grey(self):
        (self.folder / "m.obj").write_text("mtllib m.mtl\nv 2 -9 -9\nv 2 9 -9\nv 2 0 9\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n")
        (self.folder / "m.mtl").write_text("newmtl a\nKd 1 1 1\nmap_Kd gone.png\n")
        scenario = self.folder / "s.yaml"
        scenario.write_text("duration_s: 0.1\nrenderer: {type: mesh, scene: m.obj}\ntrajectory: {type: static}\ncamera: {width: 32, height: 24}\n")
        result = self.simulate(scenario=scenario)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("warning: material a", result.stderr)
        self.assertIn("gone.png", result.stderr)

    def test_an_output_that_exists(self):
        self.out.mkdir()
        (self.out / "thesis.txt").write_text("precious")
        for force in ([], ["--force"]):
            result = self.simulate(*FAST, *force)
            self.assertEqual(result.returncode, 2)
            self.assertEqual((self.out / "thesis.txt").read_text(), "precious")
        (self.out / "thesis.txt").unlink()
        self.out.rmdir()
        self.assertEqual(self.simulate(*FAST).returncode, 0)
        before = (self.out / "report.json").read_text()
        result = self.simulate(*FAST)
        self.assertEqual(result.returncode, 2)
        self.assertIn("--force", result.stderr)
        self.assertEqual((self.out / "report.json").read_text(), before)
        self.assertEqual(self.simulate(*FAST, "--force").returncode, 0)

    def test_a_full_disk(self):
        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))

        result = self.simulate("--set", "duration_s=1", preexec_fn=limit)
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("kept: " + str(self.out) + ".incomplete", result.stderr)
        self.assertEqual([p.name for p in self.folder.iterdir() if p.name.startswith("out")], ["out.incomplete"])


class Signals(Cli):
    def test_an_interrupt_finishes_the_files_and_marks_them_incomplete(self):
        process = self.start_and_wait_for_events()
        process.send_signal(signal.SIGINT)
        _, stderr = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 130, stderr)
        report = json.loads((self.out / "report.json").read_text())
        self.assertEqual(report["status"], "interrupted")
        result = run("info", self.out)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("interrupted", result.stdout)

    def test_an_interrupt_while_loading_leaves_nothing(self):
        process = subprocess.Popen([ESIM, "simulate", SCENES / "room.yaml", "--out", self.out, "--quiet"],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        working = pathlib.Path(str(self.out) + ".incomplete")
        deadline = time.time() + 60
        while not working.exists():
            self.assertLess(time.time(), deadline)
            time.sleep(0.001)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
        self.assertEqual(process.returncode, 130)
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_a_kill_leaves_what_info_recognises(self):
        process = self.start_and_wait_for_events()
        process.kill()
        process.communicate(timeout=60)
        self.assertFalse(self.out.exists())
        for path in (self.out, str(self.out) + ".incomplete"):
            result = run("info", path)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn("killed", result.stdout)
        result = self.simulate(*FAST)
        self.assertEqual(result.returncode, 2)
        self.assertIn("--force", result.stderr)
        self.assertEqual(self.simulate(*FAST, "--force").returncode, 0)
        self.assertEqual({p.name for p in self.folder.iterdir()}, {"out"})


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
