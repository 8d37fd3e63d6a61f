import filecmp
import gc
import hashlib
import json
import os
import resource
import shlex
import subprocess
import time
import warnings
import weakref

import numpy as np
import pytest

import esim
from conftest import ROOT


def joined(packets, name="events"):
    return np.concatenate([getattr(packet, name) for packet in packets])


def test_packets_end_at_frames_of_ground_truth(poster):
    packets = list(esim.simulate(poster, overrides={"truth.rate_hz": 50}))
    assert [packet.t1 for packet in packets] == [20_000_000 * k for k in range(1, 11)]
    assert [packet.t0 for packet in packets] == [20_000_000 * k for k in range(10)]
    assert packets[0].truth_t.tolist() == [0, 20_000_000]
    for packet in packets[1:]:
        assert packet.truth_t.tolist() == [packet.t1]
        assert ((packet.events["t"] > packet.t0) & (packet.events["t"] <= packet.t1)).all()
        assert packet.irradiance.shape == packet.depth.shape == (1, 30, 40)
        assert packet.motion_field.shape == (1, 2, 30, 40) and packet.pose.shape == (1, 4, 4)
        assert len(packet.imu) == 10 and len(packet.body) == 4
    assert len(joined(packets)) > 1000


def test_packets_of_any_length_hold_the_same(poster):
    usual = list(esim.simulate(poster))
    for packet_s in (0.007, 0.012345678, 1):
        others = list(esim.simulate(poster, packet_s=packet_s))
        for name in ("events", "truth_t", "depth", "motion_field", "irradiance", "pose", "body", "imu"):
            np.testing.assert_array_equal(joined(usual, name), joined(others, name))
        assert others[0].t0 == 0 and others[-1].t1 == 200_000_000
        for packet in others:
            for t in (packet.events["t"], packet.truth_t, packet.imu["t"], packet.body["t"]):
                assert ((t > packet.t0) | (t == 0)).all() and (t <= packet.t1).all()


def test_seed_and_threads(poster):
    noisy = {"event_camera.threshold_noise": 0.05}
    runs = [joined(esim.simulate(poster, overrides=noisy, seed=seed, threads=threads)) for seed, threads in [(1, 1), (1, 2), (2, 1)]]
    np.testing.assert_array_equal(runs[0], runs[1])
    assert len(runs[0]) != len(runs[2]) or (runs[0] != runs[2]).any()


def test_poses_and_states_agree(poster):
    packet = next(esim.simulate(poster))
    x, y, _z, _w = packet.body["orientation"][0]
    np.testing.assert_allclose(packet.pose[0][:3, 3], packet.body["position"][0], atol=1e-12)
    assert packet.pose[0][2, 2] == pytest.approx(1 - 2 * (x * x + y * y))
    # Z of a wall at x = 1 m, on the optical axis: the distance along it.
    axis, position = packet.pose[0][:3, 2], packet.pose[0][:3, 3]
    assert packet.depth[0].mean() == pytest.approx((1 - position[0]) / axis[0], rel=0.05)


def test_a_recording_is_that_of_the_program(poster, tmp_path):
    program = os.environ.get("ESIM_PROGRAM")
    if program is None:
        pytest.skip("ESIM_PROGRAM does not name the program")
    scenario = tmp_path / "s.yaml"
    scenario.write_text(esim.Scenario(poster).to_yaml())
    esim.simulate(scenario, out=tmp_path / "here", overrides=["seed=7"]).run()
    subprocess.run([program, "simulate", scenario, "-o", tmp_path / "there", "--set", "seed=7", "-q"], check=True)
    files = {str(p.relative_to(tmp_path / "there")) for p in (tmp_path / "there").rglob("*") if p.is_file()}
    assert {"report.json", "scenario.yaml", "imu.csv", "poses.txt"} < files
    _same, different, missing = filecmp.cmpfiles(tmp_path / "here", tmp_path / "there", files, shallow=False)
    assert not missing and set(different) <= {"report.json"}  # which has times of the clock on the wall


def report_of(out):
    return json.loads((out / "report.json").read_text())


def test_a_recording_names_its_inputs_and_its_command(poster, tmp_path):
    image = poster["renderer"]["image"]
    digest = hashlib.sha256(image.read_bytes()).hexdigest()
    file = tmp_path / "it's a.yaml"
    file.write_bytes(esim.Scenario(poster).to_yaml().replace("\n", "\r\n").encode())
    scenario = esim.Scenario.load(file).set("event_camera.contrast_threshold", 0.2)
    report = esim.simulate(scenario, overrides={"duration_s": 0.1}, seed=3, out=tmp_path / "a").run()
    assert report == report_of(tmp_path / "a")
    assert {i["file"]: i["sha256"] for i in report["inputs"]} == {
        str(file): hashlib.sha256(file.read_bytes()).hexdigest(), str(image): digest}
    assert shlex.split(report["command"]) == [
        "esim", "simulate", str(file), "--out", str(tmp_path / "a"), "--set", "event_camera.contrast_threshold=0.2", "--set",
        "duration_s=0.1", "--seed", "3"]
    esim.simulate(poster, seed=3, out=tmp_path / "b").run()  # without a file
    command = shlex.split(report_of(tmp_path / "b")["command"])
    assert command == ["esim", "simulate", str(tmp_path / "b/scenario.yaml"), "--out", str(tmp_path / "b-again")]
    assert [i["sha256"] for i in report_of(tmp_path / "b")["inputs"]] == [digest]
    assert "inputs" not in esim.simulate(poster, overrides={"duration_s": 0.01}).run()  # only recordings have inputs
    program = os.environ.get("ESIM_PROGRAM")
    if program is not None:
        for name in "ab":
            words = shlex.split(report_of(tmp_path / name)["command"])
            again = words[4] = tmp_path / f"{name}-again"
            subprocess.run([program, *words[1:], "-q"], check=True)
            assert filecmp.cmp(tmp_path / name / "cam0/events.h5", again / "cam0/events.h5", shallow=False)


def test_a_recording_says_what_a_program_replaced(poster, tmp_path):
    motion = esim.Trajectory.from_poses([0, 0.1, 0.2, 0.3], np.tile(np.eye(4), (4, 1, 1)))
    esim.simulate(poster, trajectory=motion, out=tmp_path / "a").run()
    report = report_of(tmp_path / "a")
    assert report["command"] is None and report["no_command_because"] == "a program replaced the trajectory"


def test_a_changed_input_has_no_checksum(poster, tmp_path):
    calibration = tmp_path / "c.yaml"
    calibration.write_text("cam0: {camera_model: pinhole, intrinsics: [40, 40, 20, 15], resolution: [40, 30]}\n")
    scenario = esim.Scenario({**poster, "camera": {"calibration": calibration}})
    calibration.write_text("cam0: {camera_model: pinhole, intrinsics: [99, 99, 20, 15], resolution: [40, 30]}\n")
    esim.simulate(scenario, out=tmp_path / "a").run()
    # It is read again at the start, so that its sum is of what was used.
    assert {i["file"]: i["sha256"] for i in report_of(tmp_path / "a")["inputs"]}[str(calibration)] == hashlib.sha256(
        calibration.read_bytes()).hexdigest()
    assert "fx: 99" in (tmp_path / "a/scenario.yaml").read_text()


def test_a_recording_holds_the_packets_events(poster, tmp_path):
    out = tmp_path / "out"
    with esim.simulate(poster, out=out, overrides={"output.time_unit": "ns"}) as simulation:
        events = joined(simulation)
        assert simulation.report["status"] == "complete"
        assert simulation.report["cameras"][0]["events"] == len(events)
    np.testing.assert_array_equal(esim.load_events(out), events)
    with pytest.raises(esim.Error, match="exists"):
        esim.simulate(poster, out=out)
    esim.simulate(poster, out=out, force=True, overrides={"duration_s": 0.1}).run()
    assert esim.info(out)["status"] == "complete"


def test_closing_early_finishes_an_interrupted_recording(poster, tmp_path):
    with esim.simulate(poster, out=tmp_path / "out") as simulation:
        next(simulation)
    assert esim.info(tmp_path / "out")["status"] == "interrupted"
    assert simulation.report["status"] == "interrupted"
    simulation.close()
    remaining = list(simulation)
    assert len(remaining) <= 1


@pytest.mark.parametrize("fails_at_ns", [-1, 50_000_000])
def test_a_failed_recording_keeps_what_it_has(poster, tmp_path, fails_at_ns):
    def render(t, T, objects):
        if t > fails_at_ns:
            raise KeyError("on the way")
        return {"irradiance": np.full((30, 40), 0.5), "depth": np.ones((30, 40))}

    simulation = None
    with pytest.raises(KeyError, match="on the way"):
        simulation = esim.simulate(poster, out=tmp_path / "out", renderer=render, overrides={"duration_s": 0.1})
        simulation.run()
    if simulation is not None:
        with pytest.raises(StopIteration):
            while True:
                next(simulation)
    del simulation
    gc.collect()
    if fails_at_ns < 0:
        assert list(tmp_path.iterdir()) == [], "there was nothing yet"
        return
    assert [path.name for path in tmp_path.iterdir()] == ["out.incomplete"]
    assert "on the way" in json.loads((tmp_path / "out.incomplete" / "report.json").read_text())["reason"]
    assert esim.info(tmp_path / "out.incomplete")["status"] == "interrupted"
    assert len((tmp_path / "out.incomplete" / "states.csv").read_text().splitlines()) > 5


def test_a_full_disk_says_what_is_kept(poster, tmp_path):
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    simulation = esim.simulate(poster, out=tmp_path / "out", overrides={"duration_s": 20, "truth.rate_hz": 50})
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, before[1]))
        with pytest.raises(esim.OutputError, match="kept: .*out.incomplete"):
            simulation.run()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    del simulation
    gc.collect()
    assert [path.name for path in tmp_path.iterdir()] == ["out.incomplete"]
    assert esim.info(tmp_path / "out.incomplete")["status"] in ("interrupted", "killed")


def test_rigs_have_packets_by_name(poster):
    rig = {key: value for key, value in poster.items() if key != "camera"}
    rig["cameras"] = [{"name": "left", "width": 40, "height": 30}, {"name": "right", "width": 20, "height": 16, "T_body_camera": {"position": [0.1, 0, 0]}}]
    simulation = esim.simulate(rig)
    assert list(simulation.cameras) == ["left", "right"] and simulation.cameras["right"]["width"] == 20
    packet = next(simulation)
    assert packet["left"].depth.shape == (2, 30, 40) and packet["right"].depth.shape == (2, 16, 20)
    assert (packet["right"].events["x"] < 20).all()
    with pytest.raises(esim.Error, match="several cameras"):
        _ = packet.events
    with pytest.raises(AttributeError):
        _ = packet.evnts


def test_frames_of_the_frame_camera(poster):
    packets = list(esim.simulate(poster, overrides={"frame_camera": {"rate_hz": 100, "exposure_s": 0.002}}))
    images, t = joined(packets, "images"), joined(packets, "image_t")
    assert images.dtype == np.uint8 and images.shape == (19, 30, 40) and 0 < images.mean() < 255
    np.testing.assert_array_equal(t, 10_000_000 * np.arange(1, 20))
    assert (joined(packets, "exposure") == 2_000_000).all()
    assert (joined(packets, "exposure_start") == t - 1_000_000).all()
    for packet in packets:
        ends = packet.image_t + 1_000_000
        assert ((ends > packet.t0) & (ends <= packet.t1)).all()
    deep = next(esim.simulate(poster, overrides={"frame_camera": {"rate_hz": 100, "exposure_s": 0.002, "bits": 12}}))
    assert deep.images.dtype == np.uint16 and deep.images.max() > 255


def test_further_ground_truth(poster):
    wanted = {"truth.optical_flow": True, "truth.objects": True, "truth.event_points": True, "truth.rate_hz": 50}
    packets = list(esim.simulate(poster, overrides=wanted, packet_s=0.013))
    assert joined(packets, "event_points").shape == (len(joined(packets)), 3)
    for packet in packets:
        assert len(packet.event_points) == len(packet.events)
        np.testing.assert_allclose(packet.event_points[:, 0], 1, atol=1e-3)  # the wall
    assert joined(packets, "object").shape == (11, 30, 40) and not joined(packets, "object").any()
    optical_flow, times = joined(packets, "optical_flow"), joined(packets, "optical_flow_t")
    assert optical_flow.shape == (10, 2, 30, 40) and joined(packets, "visible").shape == (10, 30, 40)
    np.testing.assert_array_equal(times[:, 1] - times[:, 0], 20_000_000)


def test_trajectories_from_arrays(poster):
    t = np.linspace(0, 0.5, 101)
    forward = np.array([[0, 0, 1.0, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])  # looks along world x
    T = np.repeat(forward[None], len(t), 0)
    T[:, 1, 3] = 0.3 * t
    trajectory = esim.Trajectory.from_poses(t, T)
    scenario = {key: value for key, value in poster.items() if key not in ("trajectory", "imu")}
    packets = list(esim.simulate(scenario, trajectory=trajectory))
    np.testing.assert_allclose(packets[-1].pose[-1], trajectory.pose(0.2), atol=1e-12)
    # 0.3 m/s to the left, a wall 1 m away: the image moves to the right.
    fx = 20 / np.tan(np.deg2rad(37.5))
    np.testing.assert_allclose(packets[-1].motion_field[0, 0], 0.3 * fx, rtol=1e-3)
    with pytest.raises(esim.Error, match="duration_s"):
        esim.simulate(scenario, trajectory=trajectory, overrides={"duration_s": 3})


def wall(t, T, objects):
    """The texture sin(20 y) on a wall at x = 1 m, for a camera of 40 x 30 px that looks along world x."""
    fx = 20 / np.tan(np.deg2rad(37.5))
    v, u = np.mgrid[:30, :40]
    rays = np.stack([(u - 19.5) / fx, (v - 14.5) / fx, np.ones_like(u, float)], -1) @ T[:3, :3].T
    depth = (1 - T[0, 3]) / rays[..., 0]
    y = T[1, 3] + depth * rays[..., 1]
    return {"irradiance": 0.5 + 0.3 * np.sin(20 * y), "depth": depth}


def test_custom_renderer(poster):
    own = list(esim.simulate(poster, renderer=wall))
    ours = list(esim.simulate(poster))
    for a, b in zip(own, ours):
        np.testing.assert_allclose(a.depth, b.depth, rtol=1e-5)
        np.testing.assert_allclose(a.motion_field, b.motion_field, atol=2e-3 * np.abs(b.motion_field).max())
    np.testing.assert_array_equal(own[0].irradiance[0], np.float32(wall(0, own[0].pose[0], [])["irradiance"]))
    assert len(joined(own)) > 1000


def test_motion_field_of_a_custom_renderer(poster):
    def render(t, T, objects):
        return {**wall(t, T, objects), "motion_field": np.stack([np.full((30, 40), 3), np.full((30, 40), -4)])}

    packet = next(esim.simulate(poster, renderer=esim.Renderer(render)))
    assert (packet.motion_field[:, 0] == 3).all() and (packet.motion_field[:, 1] == -4).all()


def test_objects_of_a_custom_renderer(poster):
    t = np.linspace(0, 0.2, 41)
    T = np.repeat(np.eye(4)[None], len(t), 0)
    T[:, 1, 3] = -0.5 * t
    ball = esim.Trajectory.from_poses(t, T)
    seen = np.zeros((30, 40), int)
    seen[10:20, 15:25] = 1

    def render(t, T, objects):
        np.testing.assert_allclose(objects[0], ball.pose(esim.ns(t)), atol=1e-12)
        return {**wall(t, T, objects), "object": seen}

    still = {**poster, "trajectory": {"type": "static"}}
    renderer = esim.Renderer(render, objects={"ball": ball})
    simulation = esim.simulate(still, renderer=renderer, overrides={"truth.objects": True})
    assert simulation.objects == ["ball"]
    packet = next(simulation)
    np.testing.assert_array_equal(packet.object[-1], seen)
    assert packet.objects.shape == (len(packet.body), 1, 4, 4)
    # It moves to the right at 0.5 m/s, 1 m away; the rest stands still.
    fx = 20 / np.tan(np.deg2rad(37.5))
    np.testing.assert_allclose(packet.motion_field[-1, 0], np.where(seen == 1, 0.5 * fx, 0), atol=0.05)


@pytest.mark.parametrize(
    "images, message",
    [
        ([1], "dict"),
        ({"depth": np.ones((30, 40))}, "must also return irradiance"),
        ({"irradiance": np.ones((40, 30)), "depth": np.ones((30, 40))}, r"irradiance of shape \(40, 30\)"),
        ({"irradiance": np.ones((30, 40)), "depth": np.zeros((30, 40))}, "depth must be above 0"),
        ({"irradiance": np.ones((30, 40)), "depth": np.ones((30, 40)), "flows": 1}, "not flows"),
        ({"irradiance": np.ones((30, 40)), "depth": np.full((30, 40), np.inf)}, "never sees"),
        ({"irradiance": np.ones((30, 40)), "depth": np.ones((30, 40)), "object": np.ones((30, 40))}, "object 1 of 0"),
    ],
)
def test_wrong_images_are_refused(poster, images, message):
    with pytest.raises((esim.Error, TypeError), match=message):
        esim.simulate(poster, renderer=lambda t, T, objects: images).run()


def test_what_renderers_cannot_do(poster):
    for option, message in [("truth.event_points", "event_points"), ("camera.colour", "colour")]:
        value = True if option.startswith("truth") else "rggb"
        with pytest.raises(esim.Error, match=message):
            esim.simulate(poster, renderer=wall, overrides={option: value})


def test_other_threads_run_meanwhile(poster):
    import threading

    ticks, over = [], threading.Event()

    def tick():
        while not over.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    esim.simulate(poster, packet_s=10.0, overrides={"duration_s": 1.0, "camera.width": 320, "camera.height": 240}).run()
    over.set()
    thread.join()
    assert len(ticks) > 5


def test_a_simulation_and_its_owner_are_collected(poster):
    class Owner:
        def __init__(self):
            self.simulation = esim.simulate(poster, renderer=self.render)

        def render(self, t, T, objects):
            return wall(t, T, objects)

    owner = Owner()
    next(owner.simulation)
    gone = weakref.ref(owner)
    del owner
    gc.collect()
    assert gone() is None


def test_warnings_are_warnings(poster):
    with pytest.warns(UserWarning, match="lambda"):
        esim.simulate(poster, overrides={"sampling": {"type": "flow", "lambda": 2}})


FULL = {"event_camera.readout": {"rate_mev_per_s": 0.01, "queue_events": 10}}


def dropped_warnings(caught):
    return [w for w in caught if w.category is esim.LossWarning and "dropped" in str(w.message)]


def test_dropped_events_are_a_warning_and_in_the_report(poster, tmp_path):
    for name in ("run", "iterated", "left"):
        simulation = esim.simulate(poster, overrides=FULL, out=tmp_path / name)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            if name == "run":
                simulation.run()
            elif name == "iterated":
                packets = list(simulation)
                assert next(simulation, None) is None
            else:
                with simulation:
                    next(simulation)
            simulation.close()
        (warning,) = dropped_warnings(caught)  # once
        assert warning.filename == __file__
        report = simulation.report
        (camera,) = report["cameras"]
        dropped = report.dropped["cam0"]
        assert dropped > 0 and dropped == camera["events_dropped_by_readout"]
        message = str(warning.message)
        share = 100 * dropped / (dropped + camera["events"])
        assert f"cam0: the readout dropped {dropped:,} of {dropped + camera['events']:,} events ({share:.3g} %)" in message
        assert "event_camera.readout.queue_events" in message
        assert report.delayed["cam0"] == camera["events_delayed_by_readout"] > 0
        assert any("the readout was saturated" in notice and "rate_mev_per_s" in notice for notice in report.notices)
        assert f"warning: {message}" in report.notices
        assert message in (tmp_path / name / "report.json").read_text()
    assert issubclass(esim.LossWarning, UserWarning) and len(packets) > 1


def test_nothing_dropped_is_no_warning(poster):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        report = esim.simulate(poster).run()
        unlimited = esim.simulate(poster, overrides={"event_camera.readout.rate_mev_per_s": 100.0}).run()
    for summary in (report, unlimited):
        assert summary.dropped == {"cam0": 0} and summary.notices == []
        assert isinstance(summary, dict) and summary["status"] == "complete"


def test_light_that_flickers(poster):
    still = {"trajectory": {"type": "static"}, "duration_s": 0.1, "truth.rate_hz": 400}
    assert len(joined(esim.simulate(poster, overrides=still))) == 0
    packets = list(esim.simulate(poster, overrides={**still, "light.flicker": {"depth": 0.4, "frequency_hz": 100}}))
    events, light = joined(packets), joined(packets, "irradiance")
    # Darkest at the multiples of 10 ms, where the last OFF event may lie: it brightens in the first half of each period.
    first_half = (events["t"] - 1) % 10_000_000 < 5_000_000
    assert ((events["p"] > 0) == first_half).all()
    counts = np.zeros((30, 40), int)
    np.add.at(counts, (events["y"], events["x"]), 1)
    assert counts.min() > 50 and counts.max() <= 100
    depth = 1 - light.min(axis=0) / light.max(axis=0)
    np.testing.assert_allclose(depth, 0.4, atol=1e-5)
    by_pwm = joined(esim.simulate(poster, overrides={**still, "light.flicker.shape": "pwm"}))
    assert len(by_pwm) > 1000 and set((by_pwm["t"] % 5_000_000).tolist()) <= {0, 1, 4_999_999}
    with pytest.raises(esim.Error, match=r"light\.flicker\.depth: 2 is out of range"):
        esim.simulate(poster, overrides={"light.flicker.depth": 2})


def test_scenes_of_the_repository():
    packet = next(esim.simulate(ROOT / "scenes" / "poster.yaml"))
    assert packet.depth.shape == (2, 180, 240) and len(packet.events) > 10000
