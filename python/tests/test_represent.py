import numpy as np
import pytest

import esim
from conftest import random_events

WIDTH, HEIGHT = 23, 17


@pytest.fixture(scope="module")
def events():
    return random_events(2000, WIDTH, HEIGHT)


def test_event_count(events):
    slow = np.zeros((2, HEIGHT, WIDTH), np.int32)
    for e in events:
        slow[0 if e["p"] > 0 else 1, e["y"], e["x"]] += 1
    counts = esim.event_count(events, WIDTH, HEIGHT)
    assert counts.dtype == np.int32
    np.testing.assert_array_equal(counts, slow)


@pytest.mark.parametrize("stamp", ["last", "mean"])
@pytest.mark.parametrize("span", [(None, None), (esim.ns(2_000_000), 0.008)])
def test_event_tensor(events, stamp, span):
    t0 = events["t"][0] if span[0] is None else 2_000_000
    t1 = events["t"][-1] if span[1] is None else 8_000_000
    stamps = [[[[] for _ in range(WIDTH)] for _ in range(HEIGHT)] for _ in range(2)]
    for e in events:
        if t0 <= e["t"] <= t1:
            stamps[0 if e["p"] > 0 else 1][e["y"]][e["x"]].append((int(e["t"]) - t0) / (t1 - t0))
    choose = max if stamp == "last" else np.mean
    slow = [[[len(s) for s in row] for row in plane] for plane in stamps]
    slow += [[[choose(s) if s else 0 for s in row] for row in plane] for plane in stamps]
    tensor = esim.event_tensor(events, WIDTH, HEIGHT, t0=span[0], t1=span[1], stamp=stamp)
    assert tensor.dtype == np.float32 and tensor.shape == (4, HEIGHT, WIDTH)
    np.testing.assert_allclose(tensor, slow, atol=1e-6)


@pytest.mark.parametrize("bins", [1, 2, 5])
def test_voxel_grid(events, bins):
    t0, t1 = int(events["t"][0]), int(events["t"][-1])
    slow = np.zeros((bins, HEIGHT, WIDTH))
    for e in events:
        position = (bins - 1) * (int(e["t"]) - t0) / (t1 - t0)
        for b in range(bins):
            slow[b, e["y"], e["x"]] += e["p"] * max(0, 1 - abs(b - position))
    grid = esim.voxel_grid(events, WIDTH, HEIGHT, bins)
    assert grid.dtype == np.float32
    np.testing.assert_allclose(grid, slow, atol=1e-5)
    normalised = esim.voxel_grid(events, WIDTH, HEIGHT, bins, normalise=True)
    some = grid[grid != 0].astype(float)
    np.testing.assert_allclose(normalised[grid != 0], (some - some.mean()) / some.std(), atol=1e-5)
    assert (normalised[grid == 0] == 0).all()


def test_time_surface(events):
    t, tau = 7_000_000, 0.003
    slow = np.zeros((2, HEIGHT, WIDTH))
    for e in events:
        if e["t"] <= t:
            slow[0 if e["p"] > 0 else 1, e["y"], e["x"]] = np.exp(-(t - int(e["t"])) * 1e-9 / tau)
    np.testing.assert_allclose(esim.time_surface(events, WIDTH, HEIGHT, t=esim.ns(t), tau_s=tau), slow, atol=1e-6)
    newest = esim.time_surface(events, WIDTH, HEIGHT)
    assert newest.max() == 1 and newest.dtype == np.float32


def test_event_frame(events):
    few = events[:100]
    slow = np.full((HEIGHT, WIDTH, 3), 255, np.uint8)
    for e in few:
        slow[e["y"], e["x"]] = (255, 152, 20) if e["p"] > 0 else (40, 140, 255)
    np.testing.assert_array_equal(esim.event_frame(few, WIDTH, HEIGHT), slow)


def test_no_events_and_other_layouts(events):
    none = events[:0]
    for make in (esim.event_count, esim.event_tensor, esim.time_surface, lambda *a: esim.voxel_grid(*a, 3)):
        assert not make(none, WIDTH, HEIGHT).any()
    assert (esim.event_frame(none, WIDTH, HEIGHT) == 255).all()
    other = np.empty(len(events), [("x", "i8"), ("y", "i8"), ("t", "i8"), ("p", "?")])
    for field in "txy":
        other[field] = events[field]
    other["p"] = events["p"] > 0
    np.testing.assert_array_equal(esim.event_count(other, WIDTH, HEIGHT), esim.event_count(events, WIDTH, HEIGHT))
    strided = np.repeat(events, 2)[::2]
    np.testing.assert_array_equal(esim.event_count(strided, WIDTH, HEIGHT), esim.event_count(events, WIDTH, HEIGHT))


def test_what_is_refused(events):
    with pytest.raises(esim.Error, match="outside the sensor"):
        esim.event_count(events, 10, HEIGHT)
    with pytest.raises(esim.Error, match="bins"):
        esim.voxel_grid(events, WIDTH, HEIGHT, 0)
    with pytest.raises(esim.Error, match="tau"):
        esim.time_surface(events, WIDTH, HEIGHT, tau_s=0)
    with pytest.raises(esim.Error, match="ends before it starts"):
        esim.event_tensor(events, WIDTH, HEIGHT, t0=5.0, t1=4.0)
    with pytest.raises(ValueError, match="last"):
        esim.event_tensor(events, WIDTH, HEIGHT, stamp="first")
    with pytest.raises(esim.Error, match="between 1 and"):
        esim.event_count(events, 10**6, HEIGHT)
