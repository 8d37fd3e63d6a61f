import numpy as np
import pytest

import esim
from conftest import random_events

WRITTEN = [f["name"] for f in esim.formats() if f["writes"] and "events" in f["holds"]]
EXTENSIONS = {f["name"]: f["extensions"][0] for f in esim.formats() if f["extensions"]}


@pytest.mark.parametrize("name", WRITTEN)
def test_every_format_gives_back_what_it_was_given(name, tmp_path):
    resolution = {f["name"]: f["resolution_ns"] for f in esim.formats()}[name]
    events = random_events(3000, 100, 80, last=2_000_000_000)
    path = tmp_path / f"events{EXTENSIONS.get(name, '')}"
    esim.save_events(path, events, 100, 80, format=name)
    expected = events.copy()
    expected["t"] -= expected["t"] % max(resolution, 1000)
    read = esim.load_events(path, width=100, height=80)
    for field in "xyp":
        np.testing.assert_array_equal(np.sort(read[field]), np.sort(expected[field]))
    np.testing.assert_allclose(read["t"], expected["t"], atol=1000)
    summary = esim.info(path)["cameras"][0]
    assert summary["events"] == 3000 and summary["on"] == (events["p"] == 1).sum()


@pytest.fixture
def file(tmp_path):
    events = random_events(5000, 100, 80)
    events["t"] -= events["t"] % 1000  # resolved by every format
    esim.save_events(tmp_path / "events.txt", events, 100, 80)
    return tmp_path / "events.txt", esim.load_events(tmp_path / "events.txt")


def test_portions_by_number(file):
    path, events = file
    portions = list(esim.EventsIterator(path, n_events=999))
    assert [len(portion) for portion in portions] == [999] * 5 + [5]
    np.testing.assert_array_equal(np.concatenate(portions), events)
    np.testing.assert_array_equal(np.concatenate(list(esim.EventsIterator(path))), events)


@pytest.mark.parametrize("delta_t", [100_000, 7e-5])
def test_portions_by_time(file, delta_t):
    path, events = file
    ns = delta_t if isinstance(delta_t, int) else round(delta_t * 1e9)
    first = int(events["t"][0])
    for k, portion in enumerate(esim.EventsIterator(path, delta_t)):
        inside = (events["t"] >= first + k * ns) & (events["t"] < first + (k + 1) * ns)
        np.testing.assert_array_equal(portion, events[inside])
    assert first + (k + 1) * ns > events["t"][-1]


def test_portions_of_no_events_and_a_start(tmp_path):
    events = random_events(4, 10, 10)
    events["t"] = [1000, 2000, 5000, 5000]
    esim.save_events(tmp_path / "e.txt", events, 10, 10)
    lengths = lambda **options: [len(portion) for portion in esim.EventsIterator(tmp_path / "e.txt", 1000, **options)]
    assert lengths() == [1, 1, 0, 0, 2]
    assert lengths(start=0) == [0, 1, 1, 0, 0, 2]
    assert lengths(start=2e-6) == [1, 0, 0, 2]
    assert lengths(start=6000) == []


def test_no_events_are_a_file_too(tmp_path):
    for name in ("e.txt", "e.h5"):
        esim.save_events(tmp_path / name, np.empty(0, esim.EVENT_DTYPE), 10, 10)
        assert len(esim.load_events(tmp_path / name)) == 0
        assert list(esim.EventsIterator(tmp_path / name, 1000)) == []
        assert esim.info(tmp_path / name)["cameras"][0]["t_first"] is None


def test_other_layouts_of_events(tmp_path):
    events = random_events(50, 10, 10)
    other = np.empty(50, [("p", "?"), ("x", "i4"), ("y", "i8"), ("t", "u8")])
    for field in "txy":
        other[field] = events[field]
    other["p"] = events["p"] > 0
    esim.save_events(tmp_path / "a.txt", events, 10, 10)
    esim.save_events(tmp_path / "b.txt", other, 10, 10)
    assert (tmp_path / "a.txt").read_bytes() == (tmp_path / "b.txt").read_bytes()
    with pytest.raises(TypeError, match="fields"):
        esim.save_events(tmp_path / "c.txt", np.zeros((4, 4)), 10, 10)
    other["x"][3] = -1
    with pytest.raises(ValueError, match="x of events"):
        esim.save_events(tmp_path / "c.txt", other, 10, 10)
    seconds = np.zeros(3, [("t", "f8"), ("x", "u2"), ("y", "u2"), ("p", "i1")])
    with pytest.raises(TypeError, match="ints"):
        esim.save_events(tmp_path / "c.txt", seconds, 10, 10)


def test_what_is_refused(tmp_path):
    events = random_events(50, 10, 10)
    with pytest.raises(esim.Error, match="outside the sensor"):
        esim.save_events(tmp_path / "e.txt", events, 9, 10)
    with pytest.raises(esim.Error, match="before that of the event before"):
        esim.save_events(tmp_path / "e.txt", events[::-1], 10, 10)
    zero = events.copy()
    zero["p"][7] = 0
    with pytest.raises(esim.Error, match="event 7: p = 0"):
        esim.save_events(tmp_path / "e.txt", zero, 10, 10)
    with pytest.raises(esim.Error, match="extension"):
        esim.save_events(tmp_path / "e.unknown", events, 10, 10)
    with pytest.raises(esim.Error, match="no format"):
        esim.save_events(tmp_path / "e.txt", events, 10, 10, format="unknown")
    assert list(tmp_path.iterdir()) == []
    for error in (esim.OutputError, esim.Error, OSError, ValueError):
        with pytest.raises(error, match="nowhere"):
            esim.save_events(tmp_path / "nowhere" / "e.txt", events, 10, 10)
    with pytest.raises(esim.Error, match="none.h5"):
        esim.load_events(tmp_path / "none.h5")
    for arguments in ({"delta_t": 1, "n_events": 1}, {"delta_t": 0}, {"n_events": 0}, {"start": 0}):
        with pytest.raises(ValueError):
            esim.EventsIterator(tmp_path, **arguments)


def test_a_damaged_file_names_the_place_after_what_is_whole(file):
    path, events = file
    text = path.read_text().splitlines()
    text[4000] = "rubbish"
    path.write_text("\n".join(text))
    read = []
    with pytest.raises(esim.Error, match="4001"):
        for portion in esim.EventsIterator(path, n_events=1000):
            read.append(portion)
    assert len(read) <= 4
