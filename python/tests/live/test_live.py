import json

import numpy as np
import pytest

import esim

INTERVAL = 5_000_000


def pose(t):
    """Near the plane of `poster`, which is 1 m ahead along x."""
    s, c = np.sin(0.5 * t), np.cos(0.5 * t)
    T = np.eye(4)
    T[:3, :3] = [[c, -s, 0], [s, c, 0], [0, 0, 1]]  # about the axis z of the body
    T[:3, :3] = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]]) @ T[:3, :3]  # looks along x
    T[:3, 3] = [0.1 * t, 0.2 * np.sin(3 * t), 0.1 * np.cos(2 * t)]
    return T


def run(scenario, steps, **options):
    with esim.simulate_live(scenario, pose(0), **options) as simulation:
        packets = []
        for _ in range(steps):
            packets += simulation.step(pose(simulation.pose_t * 1e-9))
        return packets, simulation


def joined(packets, name="events"):
    return np.concatenate([getattr(packet, name) for packet in packets])


def test_packets_follow_the_poses(poster):
    simulation = esim.simulate_live(poster, pose(0))
    assert simulation.latency == INTERVAL and simulation.pose_t == 2 * INTERVAL
    covered = 0
    for _ in range(20):
        newest = simulation.pose_t
        for packet in simulation.step(pose(newest * 1e-9)):
            assert packet.t0 == covered and packet.t1 == covered + INTERVAL
            assert packet.t1 <= newest - simulation.latency
            covered = packet.t1
    assert covered > 0.05e9
    simulation.close()
    assert simulation.report["status"] == "interrupted"


def test_the_motion_passes_near_the_poses(poster):
    packets, simulation = run(poster, 40, overrides={"truth.rate_hz": 200})
    assert packets[-1].t1 == simulation.end == 200_000_000
    truth = dict(zip(joined(packets, "truth_t").tolist(), joined(packets, "pose")))
    for t in range(4 * INTERVAL, simulation.end, INTERVAL):  # after the start from rest
        np.testing.assert_allclose(truth[t][:3, 3], pose(t * 1e-9)[:3, 3], atol=2e-5)
    assert len(joined(packets)) > 1000


def test_steps_threads_and_packets_do_not_change_the_events(poster):
    usual, _ = run(poster, 40, threads=1)
    for options in ({"threads": 2}, {"packet_s": 0.03}):
        others, _ = run(poster, 40, **options)
        np.testing.assert_array_equal(joined(usual), joined(others))


def test_a_recording_is_that_of_the_packets(poster, tmp_path):
    packets, simulation = run(poster, 40, out=tmp_path / "live")
    np.testing.assert_array_equal(esim.load_events(tmp_path / "live")["x"], joined(packets)["x"])
    report = json.loads((tmp_path / "live" / "report.json").read_text())
    assert report["status"] == "complete" and simulation.report["cameras"][0]["events"] == len(joined(packets))
    assert "A program moved the body" in (tmp_path / "live" / "scenario.yaml").read_text()


def test_smooth_motion_has_more_latency(poster):
    simulation = esim.simulate_live(poster, pose(0), smooth=True, interval_s=0.01)
    assert simulation.latency == 20_000_000 and simulation.pose_t == 30_000_000


def test_bad_poses_leave_the_body_where_it_is(poster):
    simulation = esim.simulate_live(poster, pose(0))
    for bad, reason in (
        (np.eye(3), "shape"),
        (np.full((4, 4), np.nan), "pose|finite|rotation"),
        (2 * np.eye(4), "pose|rotation|last row"),
        (pose(0) @ np.diag([-1.0, -1, 1, 1]), "180"),
    ):
        before = simulation.pose_t
        with pytest.raises(esim.Error, match=reason):
            simulation.step(bad)
        assert simulation.pose_t == before
    simulation.step(pose(0.01))
    simulation.close()
    with pytest.raises(esim.Error, match="has ended"):
        simulation.step(pose(0.015))


def test_a_duration_is_needed(poster):
    with pytest.raises(esim.Error, match="duration_s"):
        esim.simulate_live({key: value for key, value in poster.items() if key != "duration_s"}, pose(0))
    with pytest.raises(esim.Error, match="interval_s"):
        esim.simulate_live(poster, pose(0), interval_s=0)
