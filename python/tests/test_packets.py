"""Where packets begin and end: they tile the time of a recording, and nothing is lost or doubled on the way."""

import numpy as np
import pytest

import esim

MS = 1_000_000
DURATION = 200 * MS

# Ones that divide the duration, that nearly do, that do not, and that are longer; int, float, numpy's.
LENGTHS = [None, 0.05, 0.1, 0.2, 0.025, 1 / 30, 0.049999999, 0.050000001, 0.199999999, 0.0070001, np.float32(0.05), 0.3, 1, np.int64(7)]


def boundaries(packet_s):
    """Where packets of a length that is given should end."""
    length = round(float(packet_s) * 1e9)
    return [*range(length, DURATION, length), DURATION]


def joined(packets, name):
    return np.concatenate([getattr(packet, name) for packet in packets])


def assert_tiled(packets, start, end):
    assert packets[0].t0 == start and packets[-1].t1 == end
    for before, after in zip(packets, packets[1:]):
        assert before.t1 == after.t0
    for packet in packets:
        assert packet.t0 < packet.t1
        for camera in packet.cameras.values():
            for t in (camera.events["t"], camera.truth_t, packet.imu["t"], packet.body["t"]):
                assert (t <= packet.t1).all() and ((t > packet.t0) | (t == start)).all()


@pytest.fixture(scope="module")
def scenario(poster):
    imu = {"rate_hz": 500}
    small = {"camera": {"width": 24, "height": 18}, "truth": {"rate_hz": 40}, "frame_camera": {"rate_hz": 60}, "imu": imu}
    return {**poster, **small, "output": {"preview": False, "time_unit": "ns"}}


@pytest.fixture(scope="module")
def recording(scenario, tmp_path_factory):
    out = tmp_path_factory.mktemp("packets") / "out"
    return out, list(esim.simulate(scenario, out=out))


@pytest.mark.parametrize("packet_s", LENGTHS)
def test_packets_of_simulations(scenario, recording, packet_s):
    packets = list(esim.simulate(scenario, packet_s=packet_s))
    assert_tiled(packets, 0, DURATION)
    assert [packet.t1 for packet in packets] == boundaries(0.025 if packet_s is None else packet_s)
    for name in ("events", "truth_t", "image_t", "imu", "body"):
        np.testing.assert_array_equal(joined(packets, name), joined(recording[1], name))


@pytest.mark.parametrize("packet_s", LENGTHS)
@pytest.mark.parametrize("extension", ["", ".bag", ".mcap"])
def test_packets_of_recordings(recording, tmp_path, extension, packet_s):
    path, whole = recording
    if extension:
        path = tmp_path / f"r{extension}"
        esim.convert(recording[0], path)
    read = esim.Recording(path, packet_s)
    assert read.info["end"] == DURATION
    packets = list(read)
    assert_tiled(packets, 0, DURATION)
    if packet_s is not None:
        expected = boundaries(packet_s)
    elif extension:
        expected = [round(1e9 * k / 30) for k in range(1, 7)]
    else:
        expected = [packet.t1 for packet in whole]  # at the frames of ground truth
    assert [packet.t1 for packet in packets] == expected
    for name in ("events", "truth_t", "image_t"):
        np.testing.assert_array_equal(joined(packets, name), joined(whole, name), err_msg=name)
    for name in ("body", "imu"):
        np.testing.assert_array_equal(joined(packets, name)["t"], joined(whole, name)["t"], err_msg=name)
    assert list(read) == []


@pytest.mark.parametrize("rate_hz", [30, 29.97, 59.94, 1 / 0.07, 3])
def test_packets_end_at_frames_of_ground_truth_when_they_are_read_too(scenario, tmp_path, rate_hz):
    simulated = list(esim.simulate(scenario, overrides={"truth.rate_hz": rate_hz}, out=tmp_path / "out"))
    read = list(esim.Recording(tmp_path / "out"))
    if rate_hz > 5:
        assert [(p.t0, p.t1, len(p.truth_t)) for p in read] == [(p.t0, p.t1, len(p.truth_t)) for p in simulated]
    assert_tiled(read, 0, DURATION)


@pytest.mark.parametrize("packet_s", [None, 0.05, 0.0333, 1])
def test_packets_of_files_of_events(tmp_path, packet_s):
    """Which last from their first event to their last."""
    for times in ([5 * MS, 55 * MS, 105 * MS], [0, DURATION], [7, 8], [-3 * MS, 0, 90 * MS], [4 * MS] * 3):
        events = np.zeros(len(times), esim.EVENT_DTYPE)
        events["t"], events["p"], events["x"] = times, 1, range(len(times))
        esim.save_events(tmp_path / "e.txt", events, 10, 10)
        packets = list(esim.Recording(tmp_path / "e.txt", packet_s, width=10, height=10))
        np.testing.assert_array_equal(joined(packets, "events"), events)
        if times[0] < times[-1]:
            assert_tiled(packets, times[0], times[-1])
        else:  # an instant has no length
            ((t0, t1),) = [(packet.t0, packet.t1) for packet in packets]
            assert t0 == t1 == times[0]


def test_files_without_events_have_no_packets(tmp_path):
    esim.save_events(tmp_path / "e.txt", np.zeros(0, esim.EVENT_DTYPE), 10, 10)
    assert list(esim.Recording(tmp_path / "e.txt", width=10, height=10)) == []


def test_a_silent_end_is_recorded(scenario, tmp_path):
    """A recording of events alone lasts as long as was simulated, not until the last event."""
    still = {**scenario, "trajectory": {"type": "static"}, "truth": {"rate_hz": 0, "pose_rate_hz": 0}}
    still = {name: part for name, part in still.items() if name not in ("imu", "frame_camera")}
    still["event_camera"] = {"shot_noise_hz": 1}
    simulated = list(esim.simulate(still, out=tmp_path / "out", packet_s=0.05))
    read = list(esim.Recording(tmp_path / "out", 0.05))
    assert 0 < len(joined(simulated, "events")) < 100
    assert [(p.t0, p.t1) for p in read] == [(p.t0, p.t1) for p in simulated]
    np.testing.assert_array_equal(joined(read, "events"), joined(simulated, "events"))


@pytest.mark.parametrize("packets", [0, 1, 2, 3, 4])
def test_simulations_that_are_closed_early(scenario, tmp_path, packets):
    with esim.simulate(scenario, packet_s=0.05, out=tmp_path / "out") as simulation:
        seen = [next(simulation) for _ in range(packets)]
    seen += list(simulation)
    for packet in seen:
        assert packet.t0 < packet.t1
    if seen:
        assert_tiled(seen, 0, seen[-1].t1)
    assert len(seen) >= packets


@pytest.mark.parametrize("extension", ["", ".bag", ".mcap"])
def test_several_cameras(scenario, tmp_path, extension):
    cameras = [{"name": name, "width": 24, "height": 18, "T_body_camera": {"position": [x, 0, 0]}} for name, x in (("left", 0), ("right", 0.1))]
    rig = {**{name: part for name, part in scenario.items() if name != "camera"}, "cameras": cameras}
    simulated = list(esim.simulate(rig, out=tmp_path / "out", packet_s=0.0071))
    path = tmp_path / f"r{extension}" if extension else tmp_path / "out"
    if extension:
        esim.convert(tmp_path / "out", path)
    read = list(esim.Recording(path, 0.0071))
    for packets in (simulated, read):
        assert_tiled(packets, 0, DURATION)
    for a, b in zip(simulated, read):
        for name in ("left", "right"):
            np.testing.assert_array_equal(a[name].events, b[name].events)
            np.testing.assert_array_equal(a[name].truth_t, b[name].truth_t)


def test_invalid_lengths(scenario, recording):
    for wrong in (0, -1, -0.5, float("nan"), float("inf")):
        for make in (lambda: esim.simulate(scenario, packet_s=wrong), lambda: esim.Recording(recording[0], wrong)):
            with pytest.raises(esim.Error, match="packet_s"):
                make()
    for wrong in ("1", True, [1.0]):
        for make in (lambda: esim.simulate(scenario, packet_s=wrong), lambda: esim.Recording(recording[0], wrong)):
            with pytest.raises(TypeError, match="packet_s"):
                make()


def test_packets_have_the_labels_of_their_events(poster):
    overrides = {"event_camera.labels": True, "event_camera.leak_rate_hz": 5, "event_camera.latency_us": 700}
    whole = [(packet.events, packet.labels) for packet in esim.simulate(poster, overrides=overrides, packet_s=1)]
    events, labels = (np.concatenate(part) for part in zip(*whole))
    assert whole[0][1].dtype == esim.LABEL_DTYPE and len(labels) == len(events) > 100
    np.testing.assert_array_equal(events["t"] - labels["t_ideal"], 700_000)
    for packet_s in (0.0123, 0.0004):
        packets = list(esim.simulate(poster, overrides=overrides, packet_s=packet_s))
        assert all(len(packet.labels) == len(packet.events) for packet in packets)
        np.testing.assert_array_equal(np.concatenate([packet.labels for packet in packets]), labels)
    for packet in esim.simulate(poster):
        assert len(packet.labels) == 0
