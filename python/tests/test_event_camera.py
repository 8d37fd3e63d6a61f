import copy
import datetime
import gc
import pickle

import numpy as np
import pytest

import esim


def test_a_ramp_fires_at_every_threshold():
    camera = esim.EventCamera(4, 3, contrast_threshold=0.25, log_eps=1e-3)
    assert len(camera.process(np.full((3, 4), 0.1, np.float32), 0)) == 0
    events = camera.process(np.full((3, 4), 0.1 * np.exp(1.1), np.float32), 1e-3)
    assert events.dtype == esim.EVENT_DTYPE and len(events) == 4 * 12
    assert (events["p"] == 1).all()
    # Brightness goes straight from the first frame to the second.
    rise = np.log((0.1 * np.exp(1.1) + 1e-3) / (0.1 + 1e-3))
    np.testing.assert_allclose(np.unique(events["t"]), 1e6 * 0.25 * np.arange(1, 5) / rise, atol=2)
    assert (np.diff(events["t"]) >= 0).all()
    assert {(e["x"], e["y"]) for e in events} == {(x, y) for x in range(4) for y in range(3)}


def test_events_outlive_their_camera():
    camera = esim.EventCamera(50, 40, contrast_threshold=0.1)
    camera.process(np.full((40, 50), 0.1, np.float32), 0)
    events = camera.process(np.full((40, 50), 0.5, np.float32), 1e-6)
    assert not events.flags.owndata  # a view of the memory in C++
    kept = events.copy()
    del camera
    gc.collect()
    for _ in range(20):
        np.random.default_rng(0).random((40, 50))
    np.testing.assert_array_equal(events, kept)


@pytest.mark.parametrize("view", [lambda f: f.astype(np.float64), np.asfortranarray, lambda f: np.repeat(f, 2, 1)[:, ::2]])
def test_other_layouts_are_converted(view):
    random = np.random.default_rng(1)
    frames = random.random((5, 30, 40), dtype=np.float32)
    plain, other = (esim.EventCamera(40, 30, "davis346", seed=3) for _ in range(2))
    for k, frame in enumerate(frames):
        np.testing.assert_array_equal(plain.process(frame, 1e-6 * k), other.process(view(frame), 1e-6 * k))


def test_times_say_their_unit():
    frames = np.random.default_rng(1).random((5, 30, 40), dtype=np.float32)
    ways = [
        lambda k: 0.125 * k,
        lambda k: np.float64(0.125 * k),
        lambda k: np.float32(0.125 * k),
        lambda k: np.array(0.125 * k),
        lambda k: esim.ns(125_000_000 * k),
        lambda k: esim.ns(np.int64(125_000_000) * k),
        lambda k: np.timedelta64(125 * k, "ms"),
        lambda k: datetime.timedelta(milliseconds=125 * k),
    ]
    cameras = [esim.EventCamera(40, 30, shot_noise_hz=10) for _ in ways]
    for k, frame in enumerate(frames):
        first, *others = (camera.process(frame, way(k)) for camera, way in zip(cameras, ways))
        for events in others:
            np.testing.assert_array_equal(first, events)
    for int_time in (1, np.int64(1), np.uint8(1), 10**30, np.array(1)):
        with pytest.raises(TypeError, match=r"1\d*\.0 for seconds, or esim\.ns\(1\d*\)"):
            cameras[0].process(frames[0], int_time)
    for wrong in ("0", True, None, 1j, [1.0], np.zeros(2), np.timedelta64(5), np.timedelta64(1, "Y")):
        with pytest.raises(TypeError, match="^t"):
            cameras[0].process(frames[0], wrong)
    for wrong in (float("nan"), 1e10, np.float32("inf"), np.timedelta64("NaT", "ns"), np.timedelta64(7, "ps"), np.timedelta64(10**12, "s")):
        with pytest.raises(esim.Error, match="^t"):
            cameras[0].process(frames[0], wrong)


def test_threads_do_not_matter():
    frames = np.random.default_rng(1).random((4, 200, 300), dtype=np.float32)
    cameras = [esim.EventCamera(300, 200, "davis346", seed=5, threads=threads) for threads in (1, 2)]
    for k, frame in enumerate(frames):
        one, two = (camera.process(frame, 1e-4 * k) for camera in cameras)
        np.testing.assert_array_equal(one, two)
    assert len(one) > 1000


def test_what_is_refused_leaves_the_camera_as_it_was():
    good = np.random.default_rng(1).random((2, 30, 40), dtype=np.float32)
    camera, undisturbed = esim.EventCamera(40, 30), esim.EventCamera(40, 30)
    for c in (camera, undisturbed):
        c.process(good[0], esim.ns(10))
    bad = good[1].copy()
    bad[3, 7] = -1
    for frame, t, message in [(good[1][:20], 20, "40 x 20"), (good[1], 10, "does not come after"), (bad, 20, "frame 1")]:
        with pytest.raises(esim.Error, match=message):
            camera.process(frame, esim.ns(t))
    with pytest.raises(TypeError, match="linear_light"):
        camera.process(np.zeros((30, 40), np.uint8), 1.0)
    with pytest.raises(ValueError, match="shape"):
        camera.process(np.zeros((30, 40, 3), np.float32), 1.0)
    np.testing.assert_array_equal(camera.process(good[1], esim.ns(20)), undisturbed.process(good[1], esim.ns(20)))


@pytest.mark.parametrize("size", [(0, 0), (0, 3), (4, -1), (65537, 1), (4.0, 3), ("4", 3), (True, 3), (None, 3)])
def test_sizes_that_are_no_sensor(size):
    with pytest.raises((esim.Error, TypeError), match="width|height"):
        esim.EventCamera(*size)
    assert len(esim.EventCamera(np.int64(4), np.uint8(3)).process(np.ones((3, 4)), 0)) == 0


@pytest.mark.parametrize("wrong", [{"seed": -1}, {"seed": 2**64}, {"seed": 1.5}, {"threads": -1}, {"threads": "2"}])
def test_invalid_numbers(wrong):
    (name,) = wrong
    with pytest.raises((esim.Error, TypeError), match=name):
        esim.EventCamera(4, 3, **wrong)


STATES = {
    "ideal": {},
    "davis346@1": {"preset": "davis346@1", "latency_us": 2500.0, "latency_jitter_us": 900.0},
    "davis346@2": {"preset": "davis346"},
    "surround": {"surround_px": 2.0, "surround_ms": 3.0},
    "readout": {"contrast_threshold": 0.1, "readout": {"rate_mev_per_s": 0.7, "row_time_us": 5, "queue_events": 500}},
}


@pytest.mark.parametrize("options", STATES.values(), ids=STATES)
@pytest.mark.parametrize("duplicate", [copy.copy, copy.deepcopy, lambda camera: pickle.loads(pickle.dumps(camera))])
def test_a_copy_goes_on_where_the_camera_is(options, duplicate):
    frames = np.random.default_rng(1).random((12, 30, 40), dtype=np.float32)
    camera = esim.EventCamera(40, 30, seed=5, **options)
    count = 0
    for k, frame in enumerate(frames):
        if k in (0, 1, 7):
            other = duplicate(camera)
        there = other.process(frame, 1e-3 * k)
        here = camera.process(frame, 1e-3 * k)
        np.testing.assert_array_equal(here, there)
        assert other.dropped == camera.dropped
        count += len(here)
    assert count > 2000
    if "readout" in options:
        assert camera.dropped > 0
    with pytest.raises(esim.Error, match="frame 12"):  # copies know how far they are
        other.process(frames[0], 0.011)


def test_a_copy_is_independent():
    frames = np.random.default_rng(1).random((3, 30, 40), dtype=np.float32)
    camera, undisturbed = esim.EventCamera(40, 30), esim.EventCamera(40, 30)
    for c in (camera, undisturbed):
        c.process(frames[0], 0)
    copy.copy(camera).process(frames[1], 1.0)
    np.testing.assert_array_equal(camera.process(frames[2], 2.0), undisturbed.process(frames[2], 2.0))


def test_a_pickle_of_another_version_is_refused():
    camera = esim.EventCamera(4, 3)
    state = {**camera.__getstate__(), "version": "0.0.1"}
    with pytest.raises(esim.Error, match="0.0.1"):
        esim.EventCamera.__new__(esim.EventCamera).__setstate__(state)
    damaged = {**camera.__getstate__(), "state": b"short"}
    with pytest.raises(esim.Error, match="damaged"):
        esim.EventCamera.__new__(esim.EventCamera).__setstate__(damaged)


def test_a_camera_prints_what_it_is():
    assert repr(esim.EventCamera(4, 3, "davis346@1", seed=7, shot_noise_hz=1)) == (
        "<esim.EventCamera 4 x 3 px, preset='davis346@1', shot_noise_hz=1, seed=7>"
    )


def test_options_have_the_schema_names():
    with pytest.raises(esim.Error, match="did you mean contrast_threshold"):
        esim.EventCamera(4, 3, contrast_treshold=1)
    with pytest.raises(esim.Error, match="out of range"):
        esim.EventCamera(4, 3, contrast_threshold=1000)
    with pytest.raises(esim.Error, match="davis346"):
        esim.EventCamera(4, 3, "davis345")
    # A preset sets all options that are not given.
    own = esim.EventCamera(40, 30, "davis346@1", shot_noise_hz=0, leak_rate_hz=0, hot_pixels=0, contrast_threshold=0.5)
    assert own.dropped == 0
    limited = esim.EventCamera(40, 30, contrast_threshold=0.01, readout={"rate_mev_per_s": 0.001, "queue_events": 10})
    limited.process(np.full((30, 40), 0.1, np.float32), 0)
    limited.process(np.full((30, 40), 1, np.float32), 1e-6)
    assert limited.dropped > 0


def test_presets_have_versions():
    frames = np.random.default_rng(2).random((5, 30, 40), dtype=np.float32)

    def events(preset):
        camera = esim.EventCamera(40, 30, preset, seed=5)
        return np.concatenate([camera.process(frame, 0.01 * k) for k, frame in enumerate(frames)])

    newest = events("davis346")
    assert len(newest) > 1000 and np.array_equal(newest, events("davis346@2"))
    assert not np.array_equal(newest, events("davis346@1"))
    with pytest.raises(esim.Error, match="davis346 has the versions 1 and 2"):
        esim.EventCamera(4, 3, "davis346@3")
    with pytest.raises(esim.Error, match="choose preset davis346@1"):
        esim.EventCamera(4, 3, "davis346", shot_noise_hz=1)
    with pytest.raises(esim.Error, match="circuit.white_lux"):
        esim.EventCamera(4, 3, "davis346", circuit={"white_lux": -1})


def test_linear_light_decodes_srgb():
    codes = np.arange(256, dtype=np.uint8).reshape(16, 16)
    light = esim.linear_light(codes)
    assert light.dtype == np.float32 and light[0, 0] == 0 and light[-1, -1] == 1
    assert light.flat[188] == pytest.approx(0.5029, abs=1e-4)  # half the light
    white = np.full((2, 3, 3), 65535, np.uint16)
    np.testing.assert_allclose(esim.linear_light(white), 1, rtol=1e-6)
    with pytest.raises(TypeError):
        esim.linear_light(codes.astype(float))


LABELLED = {"contrast_threshold": 0.2, "threshold_noise": 0.02, "leak_rate_hz": 5, "shot_noise_hz": 20, "latency_us": 100}


def labels_of(camera, frames):
    """Events and labels of all frames."""
    events, labels = [], []
    for k, frame in enumerate(frames):
        events.append(camera.process(frame, 1e-3 * k))
        labels.append(camera.labels)
        assert labels[-1].dtype == esim.LABEL_DTYPE  # NumPy leaves out padding when it joins arrays
    return np.concatenate(events), np.concatenate(labels)


def test_labels_explain_the_events():
    frames = np.random.default_rng(1).random((9, 30, 40), dtype=np.float32)
    plain = esim.EventCamera(40, 30, seed=2, **LABELLED)
    expected = np.concatenate([plain.process(frame, 1e-3 * k) for k, frame in enumerate(frames)])
    assert len(plain.labels) == 0 and plain.labels.dtype == esim.LABEL_DTYPE
    events, labels = labels_of(esim.EventCamera(40, 30, seed=2, labels=True, **LABELLED), frames)
    np.testing.assert_array_equal(events, expected)
    assert len(labels) == len(events) > 1000
    parts = np.stack([labels[name].astype(np.float64) for name in esim.CAUSES])
    np.testing.assert_allclose(parts.sum(axis=0), 0.2 * events["p"], atol=1e-6)
    np.testing.assert_array_equal(events["t"] - labels["t_ideal"], 100_000)
    crossings = labels["cause"] != esim.CAUSES.index("noise")
    assert 0 < crossings.sum() < len(events)
    np.testing.assert_array_equal(labels["cause"][crossings], np.argmax(parts * events["p"], axis=0)[crossings])


def test_labels_of_filtered_and_copied_cameras():
    frames = np.random.default_rng(1).random((9, 30, 40), dtype=np.float32)
    options = {"labels": True, **LABELLED}
    events, labels = labels_of(esim.EventCamera(40, 30, **options), frames)
    inside = (events["x"] >= 3) & (events["y"] < 20)
    window = {"region": {"windows": [{"x": 3, "y": 0, "width": 37, "height": 20}]}}
    camera = esim.EventCamera(40, 30, filters=window, **options)
    for k, frame in enumerate(frames):
        passed = camera.process(frame, 1e-3 * k)
        assert len(camera.labels) == len(passed)
        now = inside & (events["t"] <= 1_000_000 * k) & (events["t"] > 1_000_000 * (k - 1))
        np.testing.assert_array_equal(passed, events[now])
        np.testing.assert_array_equal(camera.labels, labels[now])
        camera = pickle.loads(pickle.dumps(camera))  # with the labels of the events that wait for their time stamp
        assert len(camera.labels) == 0
