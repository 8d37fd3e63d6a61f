"""esim.filters against slow definitions of what OpenEB documents of each filter."""

import pickle

import numpy as np
import pytest

import esim
from conftest import random_events

WIDTH, HEIGHT = 24, 16
MS = 1_000_000

ALL = {
    "region": {"windows": [{"x": 2, "y": 1, "width": 20, "height": 14}], "masked_pixels": [{"x": 5, "y": 5}]},
    "activity": {"window_us": 10_000, "lower_start": 2e3, "lower_stop": 1e3},
    "anti_flicker": {"start_threshold": 3, "stop_threshold": 1},
    "trail": {"type": "stc_keep_trail", "threshold_us": 3000},
    "rate_controller": {"period_us": 100, "events_per_period": 15},
}


def events(count=20_000, seed=0):
    return esim.Events(random_events(count, WIDTH, HEIGHT, seed, last=40 * MS), WIDTH, HEIGHT)


def flicker(hz, duration_s=1.0):
    """A block of 4 x 4 pixels under a lamp: all report ON, half a period later OFF."""
    half = np.arange(int(2 * hz * duration_s))
    out = np.empty((len(half), 16), esim.EVENT_DTYPE)
    out["t"] = np.rint(half * 0.5e9 / hz).astype(np.int64)[:, None] + 1000 * np.arange(16)
    out["x"], out["y"] = 8 + np.arange(16) % 4, 4 + np.arange(16) // 4
    out["p"] = np.where(half % 2 == 0, 1, -1)[:, None]
    return esim.Events(out.ravel(), WIDTH, HEIGHT)


def positions_in_bursts(of, threshold):
    """A burst: events of one pixel with the same polarity, each at most the threshold after the previous one."""
    positions = np.empty(len(of), int)
    last = {}
    for i, (t, x, y, p) in enumerate(zip(*(of[field].tolist() for field in ("t", "x", "y", "p")))):
        t0, p0, position = last.get((x, y), (0, 0, 0))
        positions[i] = position + 1 if p == p0 and t - t0 <= threshold else 1
        last[x, y] = (t, p, positions[i])
    return positions


@pytest.mark.parametrize("type, keeps", [("trail", lambda n: n == 1), ("stc_cut_trail", lambda n: n == 2), ("stc_keep_trail", lambda n: n > 1)])
def test_trail(type, keeps):
    given = events()
    kept = keeps(positions_in_bursts(given, 2 * MS))
    assert 100 < kept.sum() < len(given) - 100
    out = esim.filters.filter_events(given, trail={"type": type, "threshold_us": 2000})
    np.testing.assert_array_equal(out, given[kept])
    assert isinstance(out, esim.Events) and (out.width, out.height) == (WIDTH, HEIGHT)


def test_regions_and_masked_pixels():
    given = events()
    inside = (given["x"] >= 3) & (given["x"] < 10) & (given["y"] >= 2) & (given["y"] < 9)
    window = {"x": 3, "y": 2, "width": 7, "height": 7}
    out = esim.filters.filter_events(given, region={"windows": [window]})
    np.testing.assert_array_equal(out, given[inside])
    out = esim.filters.filter_events(given, region={"windows": [window], "invert": True})
    np.testing.assert_array_equal(out, given[~inside])
    pixels = [{"x": np.int64(4), "y": np.uint16(4)}, {"x": 0, "y": 15}]
    masked = ((given["x"] == 4) & (given["y"] == 4)) | ((given["x"] == 0) & (given["y"] == 15))
    assert masked.any()
    np.testing.assert_array_equal(esim.filters.filter_events(given, region={"masked_pixels": pixels}), given[~masked])


def test_flicker_in_the_band_only():
    for hz, kept in ((30, True), (60, False), (100, False), (500, False), (700, True)):
        given = flicker(hz)
        count = len(esim.filters.filter_events(given, anti_flicker={}))
        assert count == len(given) if kept else count < len(given) // 5, hz
    given = flicker(100)
    stop, keep = (esim.filters.filter_events(given, anti_flicker={"mode": mode}) for mode in ("band_stop", "band_pass"))
    assert len(stop) + len(keep) == len(given)


def test_at_most_the_given_number_of_events_per_period():
    given = events(60_000)  # 150 per 100 us
    out = esim.filters.filter_events(given, rate_controller={"period_us": 100, "events_per_period": 40})
    counts = np.bincount(out["t"] // 100_000)
    assert counts.max() == 40 and np.median(counts) == 40
    below = esim.filters.filter_events(given, rate_controller={"period_us": 100, "events_per_period": 1000})
    np.testing.assert_array_equal(below, given)


def test_all_or_nothing_by_the_rate_of_the_previous_window():
    rates = [20, 80, 20, 80, 80, 20]  # events per ms
    t = np.concatenate([k * MS + np.arange(n) * (MS // n) for k, n in enumerate(rates)])
    given = np.zeros(len(t), esim.EVENT_DTYPE)
    given["t"], given["p"] = t, 1
    out = esim.filters.filter_events(given, WIDTH, HEIGHT, activity={"lower_start": 50e3})
    assert sorted(set((out["t"] // MS).tolist())) == [2, 4, 5]
    out = esim.filters.filter_events(given, WIDTH, HEIGHT, activity={"upper_stop": 50e3})
    assert sorted(set((out["t"] // MS).tolist())) == [0, 1, 3]


def test_the_result_does_not_depend_on_the_parts():
    lamp = flicker(100, 0.3)
    lamp["t"] += 40 * MS
    given = np.concatenate([events(), lamp])
    at_once = esim.filters.FilterChain(WIDTH, HEIGHT, **ALL)
    expected = at_once.process(given)
    assert 500 < len(expected) < len(given)
    assert list(at_once.dropped) == list(ALL)
    assert all(count > 0 for count in at_once.dropped.values())
    assert sum(at_once.dropped.values()) == len(given) - len(expected)
    for seed in range(4):
        random = np.random.default_rng(seed)
        cuts = np.sort(random.integers(0, len(given) + 1, 10 ** random.integers(0, 4)))
        chain = esim.filters.FilterChain(WIDTH, HEIGHT, **ALL)
        parts = [chain.process(part) for part in np.split(given, cuts)]
        np.testing.assert_array_equal(np.concatenate(parts), expected)
        assert chain.dropped == at_once.dropped


def test_the_order_of_arguments_does_not_matter():
    given = events()
    backwards = dict(reversed(ALL.items()))
    np.testing.assert_array_equal(
        esim.filters.filter_events(given, **ALL), esim.filters.filter_events(given, **backwards)
    )


def test_other_layouts_are_read():
    given = events(1000)
    other = np.empty(len(given), [("x", "i4"), ("y", "i4"), ("t", "i8"), ("p", "?")])
    for field in ("x", "y", "t"):
        other[field] = given[field]
    other["p"] = given["p"] > 0
    expected = esim.filters.filter_events(given, trail={})
    np.testing.assert_array_equal(esim.filters.filter_events(other, WIDTH, HEIGHT, trail={}), expected)
    assert len(esim.filters.filter_events(given[:0], trail={})) == 0


@pytest.mark.parametrize(
    "options, text",
    [
        ({}, "at least one of region, activity, anti_flicker, trail, rate_controller"),
        ({"trail": {"threshold_us": 0}}, "trail.threshold_us: 0 is out of range"),
        ({"trail": {"treshold_us": 5}}, "did you mean threshold_us?"),
        ({"trail": {"type": "cut"}}, "trail.type"),
        ({"anti_flicker": {"low_hz": 600}}, "anti_flicker.low_hz: must be below high_hz"),
        ({"activity": {}}, "activity: has no bound"),
        ({"region": {"windows": [{"x": 24, "y": 0, "width": 1, "height": 1}]}}, "region.windows.0: .* outside the sensor"),
        ({"rate_controller": {"events_per_period": float("nan")}}, "rate_controller.events_per_period"),
    ],
)
def test_invalid_options(options, text):
    with pytest.raises(esim.Error, match=text) as raised:
        esim.filters.FilterChain(WIDTH, HEIGHT, **options)
    assert "--" not in str(raised.value)


def test_invalid_arguments():
    with pytest.raises(TypeError, match="trail must be a dict of options, not True"):
        esim.filters.FilterChain(WIDTH, HEIGHT, trail=True)
    with pytest.raises(esim.Error, match="width must be between"):
        esim.filters.FilterChain(0, HEIGHT, trail={})
    with pytest.raises(esim.Error, match="width and height are missing"):
        esim.filters.filter_events(random_events(10, WIDTH, HEIGHT), trail={})
    with pytest.raises(TypeError, match="structured array"):
        esim.filters.filter_events(np.zeros(3), WIDTH, HEIGHT, trail={})


def test_refused_events_leave_the_filters_unchanged():
    given = events(2000)
    expected = esim.filters.filter_events(given, **ALL)
    chain = esim.filters.FilterChain(WIDTH, HEIGHT, **ALL)
    first = chain.process(given[:1000])
    with pytest.raises(esim.Error, match="earlier than the event before it"):
        chain.process(given[:1000])
    with pytest.raises(esim.Error, match="earlier"):
        chain.process(given[1000:][::-1])
    outside = given[1000:].copy()
    outside["x"][-1] = WIDTH
    with pytest.raises(esim.Error, match="outside the sensor of 24 x 16 px"):
        chain.process(outside)
    np.testing.assert_array_equal(np.concatenate([first, chain.process(given[1000:])]), expected)


SENSOR = {  # for the 40 x 30 px of `poster`
    "region": {"windows": [{"x": 2, "y": 1, "width": 36, "height": 28}], "masked_pixels": [{"x": 20, "y": 15}]},
    "activity": {"lower_start": 3e4, "lower_stop": 1e4},
    "anti_flicker": {"high_hz": 5000, "start_threshold": 2, "stop_threshold": 1},
    "trail": {"type": "stc_keep_trail", "threshold_us": 20_000},
    "rate_controller": {"period_us": 1000, "events_per_period": 15},
}


@pytest.mark.parametrize("names", [*([name] for name in SENSOR), list(SENSOR)], ids=lambda names: "+".join(names))
def test_filters_of_a_simulated_sensor(poster, names):
    """The same events as filtering afterwards, whatever the length of the packets and the number of threads."""
    unfiltered = np.concatenate([packet.events for packet in esim.simulate(poster)])
    chain = esim.filters.FilterChain(40, 30, **{name: SENSOR[name] for name in names})
    expected = chain.process(unfiltered)
    assert 100 < len(expected) < len(unfiltered)
    overrides = {f"event_camera.filters.{name}": SENSOR[name] for name in names}
    for packet_s, threads in [(None, 1), (0.0123, 2), (1, 1), (0.0004, 2)]:
        simulation = esim.simulate(poster, overrides=overrides, threads=threads, **({"packet_s": packet_s} if packet_s else {}))
        out = np.concatenate([packet.events for packet in simulation])
        np.testing.assert_array_equal(out, expected)
    (camera,) = simulation.report["filtered"]
    assert camera["events"] == len(unfiltered) and camera["kept"] == len(expected)
    assert camera["dropped"] == chain.dropped


def test_filters_of_a_sensor_for_given_frames():
    frames = np.random.default_rng(1).random((9, HEIGHT, WIDTH), dtype=np.float32)
    options = {"trail": {"threshold_us": 1500}, "rate_controller": {"period_us": 1000, "events_per_period": 300}}
    plain = esim.EventCamera(WIDTH, HEIGHT, contrast_threshold=0.2)
    camera = esim.EventCamera(WIDTH, HEIGHT, contrast_threshold=0.2, filters=options)
    chain = esim.filters.FilterChain(WIDTH, HEIGHT, **options)
    for k, frame in enumerate(frames):
        np.testing.assert_array_equal(camera.process(frame, 1e-3 * k), chain.process(plain.process(frame, 1e-3 * k)))
        camera = pickle.loads(pickle.dumps(camera))  # with the state of its filters
    assert all(count > 0 for count in chain.dropped.values())
    with pytest.raises(esim.Error, match=r"^event_camera\.filters\.region\.windows\.0: \(24, 0\) lies outside"):
        esim.EventCamera(WIDTH, HEIGHT, filters={"region": {"windows": [{"x": 24}]}})
    with pytest.raises(esim.Error, match=r"event_camera\.filters\.anti_flicker\.low_hz: must be below high_hz"):
        esim.EventCamera(WIDTH, HEIGHT, filters={"anti_flicker": {"low_hz": 600}})
    with pytest.warns(UserWarning, match="the dvs128 has no such filter"):
        esim.EventCamera(WIDTH, HEIGHT, "dvs128", filters={"trail": {}})
