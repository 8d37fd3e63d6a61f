import copy
import pickle

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


@pytest.mark.parametrize("delta_t", [esim.ns(100_000), 7e-5, np.float32(7e-5)])
def test_portions_by_time(file, delta_t):
    path, events = file
    ns = delta_t.astype(int) if isinstance(delta_t, np.timedelta64) else round(delta_t * 1e9)
    first = int(events["t"][0])
    for k, portion in enumerate(esim.EventsIterator(path, delta_t)):
        inside = (events["t"] >= first + k * ns) & (events["t"] < first + (k + 1) * ns)
        np.testing.assert_array_equal(portion, events[inside])
    assert first + (k + 1) * ns > events["t"][-1]


def test_portions_of_no_events_and_a_start(tmp_path):
    events = random_events(4, 10, 10)
    events["t"] = [1000, 2000, 5000, 5000]
    esim.save_events(tmp_path / "e.txt", events, 10, 10)
    lengths = lambda **options: [len(portion) for portion in esim.EventsIterator(tmp_path / "e.txt", 1e-6, **options)]
    assert lengths() == [1, 1, 0, 0, 2]
    assert lengths(start=0) == [0, 1, 1, 0, 0, 2]
    assert lengths(start=2e-6) == [1, 0, 0, 2]
    assert lengths(start=esim.ns(6000)) == []


def test_no_events_are_a_file_too(tmp_path):
    for name in ("e.txt", "e.h5"):
        esim.save_events(tmp_path / name, np.empty(0, esim.EVENT_DTYPE), 10, 10)
        assert len(esim.load_events(tmp_path / name)) == 0
        assert list(esim.EventsIterator(tmp_path / name, 1e-6)) == []
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
    with pytest.raises(esim.Error, match="before that of the previous event"):
        esim.save_events(tmp_path / "e.txt", events[::-1], 10, 10)
    zero = events.copy()
    zero["p"][7] = 0
    with pytest.raises(esim.Error, match="event 7: p = 0"):
        esim.save_events(tmp_path / "e.txt", zero, 10, 10)
    with pytest.raises(esim.Error, match="extension"):
        esim.save_events(tmp_path / "e.unknown", events, 10, 10)
    with pytest.raises(esim.Error, match="unknown format"):
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


def test_a_damaged_file_names_the_place_of_the_damage(file):
    path, _events = file
    text = path.read_text().splitlines()
    text[4000] = "rubbish"
    path.write_text("\n".join(text))
    read = []
    with pytest.raises(esim.Error, match="4001"):
        for portion in esim.EventsIterator(path, n_events=1000):
            read.append(portion)
    assert len(read) <= 4


@pytest.fixture
def sized(tmp_path):
    events = random_events(3000, 100, 80)
    esim.save_events(tmp_path / "sized.h5", events, 100, 80)
    return tmp_path / "sized.h5"


def test_events_know_their_sensor(sized, tmp_path):
    events = esim.load_events(sized)
    assert isinstance(events, esim.Events) and (events.width, events.height) == (100, 80)
    plain = np.array(events, subok=False)
    for make in (esim.event_count, esim.event_tensor, esim.voxel_grid, esim.time_surface, esim.event_frame, esim.time_surface_picture):
        np.testing.assert_array_equal(make(events), make(plain, 100, 80))
    assert esim.voxel_grid(events, bins=3).shape == (3, 80, 100)
    assert esim.event_count(events, 200, 90).shape == (2, 90, 200)  # what is given counts
    assert (esim.space_time_plot(events, size=(320, 240)) == esim.space_time_plot(plain, 100, 80, size=(320, 240))).all()
    esim.save_events(tmp_path / "again.h5", events)
    again = esim.load_events(tmp_path / "again.h5")
    np.testing.assert_array_equal(again, events)
    assert (again.width, again.height) == (100, 80)
    told = esim.load_events(sized, width=120, height=90)
    assert (told.width, told.height) == (120, 90)
    for part in esim.EventsIterator(sized, 1e-3):
        assert (part.width, part.height) == (100, 80)


def test_events_whose_sensor_is_not_known(tmp_path):
    (tmp_path / "e.txt").write_text("0.1 1 2 1\n0.2 3 2 0\n")
    events = esim.load_events(tmp_path / "e.txt")
    assert events.width is None and events.height is None
    plain = np.array(events, subok=False)
    for them in (events, plain):
        for use in (esim.event_count, esim.voxel_grid, esim.space_time_plot, lambda e: esim.save_events(tmp_path / "f.txt", e)):
            with pytest.raises(esim.Error, match="width and height are missing"):
                use(them)
        with pytest.raises(esim.Error, match="both or not at all"):
            esim.event_count(them, width=10)
    known = esim.Events(plain, 10, 9)
    assert esim.event_count(known).shape == (2, 9, 10)
    with pytest.raises(esim.Error, match="width"):
        esim.Events(plain, 0, 9)
    with pytest.raises(TypeError, match="fields"):
        esim.Events(np.zeros(3), 4, 4)


def test_what_keeps_the_sensor(sized):
    events = esim.load_events(sized)
    keeping = [
        events[10:20], events[events["p"] > 0], events[::-1], events.copy(), np.sort(events, order="x"),
        copy.copy(events), copy.deepcopy(events), pickle.loads(pickle.dumps(events)), pickle.loads(pickle.dumps(events, 5)),
        np.concatenate([events, events[:3]]), np.repeat(events, 2),
    ]
    for part in keeping:
        assert isinstance(part, esim.Events) and (part.width, part.height) == (100, 80)
        assert esim.event_count(part).sum() == len(part)
    np.testing.assert_array_equal(keeping[7], events)
    other = esim.Events(events, 200, 80)
    assert (events.width, other.width) == (100, 200)
    for mixed in ([events, other], [events, np.array(events, subok=False)]):
        assert np.concatenate(mixed).width is None


def test_fields_of_events_are_plain_arrays(sized):
    events = esim.load_events(sized)
    for plain in (events["t"], np.diff(events["t"]), events["p"] > 0, events[["x", "y"]], events == events, events["x"].mean(keepdims=True)):
        assert type(plain) is np.ndarray
    assert type(events[3]) is np.void and type(events["t"].max()) is np.int64
    assert (events == events).all() and not (events != events).any()
    events["t"][0] = -5  # a view
    assert events[0]["t"] == -5


def test_events_of_simulations_and_cameras_know_their_sensor(poster, tmp_path):
    packets = list(esim.simulate(poster, out=tmp_path / "out"))
    events = np.concatenate([packet.events for packet in packets])
    assert (events.width, events.height) == (40, 30) and esim.voxel_grid(events).shape == (5, 30, 40)
    assert {(p.events.width, p.events.height) for p in esim.Recording(tmp_path / "out")} == {(40, 30)}
    camera = esim.EventCamera(4, 3)
    assert camera.process(np.ones((3, 4), np.float32), 0).width == 4
    sequence = esim.dataset.AffineSequences(width=48, height=32, flow_scale=0.2)[0]
    assert (sequence.events.width, sequence.events.height) == (48, 32)
