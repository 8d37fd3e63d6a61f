import gc

import numpy as np
import pytest

import esim


def test_a_ramp_fires_at_every_threshold():
    camera = esim.EventCamera(4, 3, contrast_threshold=0.25, log_eps=1e-3)
    assert len(camera.process(np.full((3, 4), 0.1, np.float32), 0)) == 0
    events = camera.process(np.full((3, 4), 0.1 * np.exp(1.1), np.float32), 1_000_000)
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
    events = camera.process(np.full((40, 50), 0.5, np.float32), 1000)
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
        np.testing.assert_array_equal(plain.process(frame, k * 1000), other.process(view(frame), k * 1000))


def test_times_are_nanoseconds_or_seconds():
    frames = np.random.default_rng(1).random((5, 30, 40), dtype=np.float32)
    by_int, by_float = (esim.EventCamera(40, 30) for _ in range(2))
    for k, frame in enumerate(frames):
        np.testing.assert_array_equal(by_int.process(frame, np.int32(k * 1000)), by_float.process(frame, k * 1e-6))
    for wrong in ("0", True, None, np.float32(3)):
        with pytest.raises(TypeError, match="int .ns. or a float .s."):
            by_int.process(frames[0], wrong)
    with pytest.raises(ValueError, match="292 years"):
        by_int.process(frames[0], float("nan"))


def test_threads_do_not_matter():
    frames = np.random.default_rng(1).random((4, 200, 300), dtype=np.float32)
    cameras = [esim.EventCamera(300, 200, "davis346", seed=5, threads=threads) for threads in (1, 2)]
    for k, frame in enumerate(frames):
        one, two = (camera.process(frame, k * 100_000) for camera in cameras)
        np.testing.assert_array_equal(one, two)
    assert len(one) > 1000


def test_what_is_refused_leaves_the_camera_as_it_was():
    good = np.random.default_rng(1).random((2, 30, 40), dtype=np.float32)
    camera, undisturbed = esim.EventCamera(40, 30), esim.EventCamera(40, 30)
    for c in (camera, undisturbed):
        c.process(good[0], 10)
    bad = good[1].copy()
    bad[3, 7] = -1
    for frame, t, message in [(good[1][:20], 20, "40 x 20"), (good[1], 10, "does not come after"), (bad, 20, "frame 1")]:
        with pytest.raises(esim.Error, match=message):
            camera.process(frame, t)
    with pytest.raises(TypeError, match="linear_light"):
        camera.process(np.zeros((30, 40), np.uint8), 20)
    with pytest.raises(ValueError, match="shape"):
        camera.process(np.zeros((30, 40, 3), np.float32), 20)
    np.testing.assert_array_equal(camera.process(good[1], 20), undisturbed.process(good[1], 20))


def test_options_have_the_schema_names():
    with pytest.raises(esim.Error, match="did you mean contrast_threshold"):
        esim.EventCamera(4, 3, contrast_treshold=1)
    with pytest.raises(esim.Error, match="out of range"):
        esim.EventCamera(4, 3, contrast_threshold=1000)
    with pytest.raises(esim.Error, match="davis346"):
        esim.EventCamera(4, 3, "davis345")
    # A preset stands for what is not given beside it.
    own = esim.EventCamera(40, 30, "davis346", shot_noise_hz=0, leak_rate_hz=0, hot_pixels=0, contrast_threshold=0.5)
    assert own.dropped == 0
    limited = esim.EventCamera(40, 30, contrast_threshold=0.01, readout={"rate_mev_per_s": 0.001, "queue_events": 10})
    limited.process(np.full((30, 40), 0.1, np.float32), 0)
    limited.process(np.full((30, 40), 1, np.float32), 1000)
    assert limited.dropped > 0


def test_linear_light_decodes_srgb():
    codes = np.arange(256, dtype=np.uint8).reshape(16, 16)
    light = esim.linear_light(codes)
    assert light.dtype == np.float32 and light[0, 0] == 0 and light[-1, -1] == 1
    assert light.flat[188] == pytest.approx(0.5029, abs=1e-4)  # half the light
    white = np.full((2, 3, 3), 65535, np.uint16)
    np.testing.assert_allclose(esim.linear_light(white), 1, rtol=1e-6)
    with pytest.raises(TypeError):
        esim.linear_light(codes.astype(float))
