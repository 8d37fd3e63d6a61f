"""What is refused, by every entry alike: messages name the argument in Python, and no flag of the command line."""

import re

import numpy as np
import pytest

import esim
from conftest import random_events

FLAG = re.compile(r"(?<![\w-])--[a-z]")


def refused(kind, match, call):
    """An error of this very class, whose message matches."""
    with pytest.raises(kind, match=match) as caught:
        call()
    assert caught.type is kind
    assert not FLAG.search(str(caught.value)) and "`esim " not in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.fixture(scope="module")
def rig(poster, tmp_path_factory):
    """The recording of two cameras."""
    folder = tmp_path_factory.mktemp("rig")
    cameras = [{"name": name, "width": 40, "height": 30} for name in ("left", "right")]
    scenario = {**{name: part for name, part in poster.items() if name != "camera"}, "cameras": cameras}
    scenario = {**scenario, "duration_s": 0.05, "output": {"time_unit": "ns", "preview": False}}
    esim.simulate(scenario, out=folder / "out").run()
    return folder / "out"


def test_outputs_that_cannot_be_written(poster, rig, tmp_path):
    events = random_events(3, 10, 10)
    refused(esim.OutputError, "cannot create the directory /proc/x", lambda: esim.simulate(poster, out="/proc/x").run())
    refused(esim.OutputError, "cannot create the directory /proc/a", lambda: esim.simulate(poster, out="/proc/a/x").run())
    refused(esim.OutputError, "/proc/x", lambda: esim.convert(rig, "/proc/x", format="recording"))
    refused(esim.OutputError, "is not a folder", lambda: esim.convert(rig, tmp_path / "none" / "x.bag"))
    refused(esim.OutputError, "none", lambda: esim.save_events(tmp_path / "none" / "e.h5", events, 10, 10))
    assert issubclass(esim.OutputError, (OSError,)) and issubclass(esim.OutputError, esim.Error)


def test_outputs_that_are_there(poster, rig, tmp_path):
    for out in (rig, str(rig)):
        refused(esim.Error, "exists already.*force=True", lambda: esim.simulate(poster, out=out))
    refused(esim.Error, "exists already.*force=True", lambda: esim.convert(rig, rig, format="recording"))
    (tmp_path / "x.bag").write_text("")
    refused(esim.Error, "exists already.*force=True", lambda: esim.convert(rig, tmp_path / "x.bag"))
    (tmp_path / "out.incomplete").mkdir()
    refused(esim.Error, "killed.*force=True", lambda: esim.simulate(poster, out=tmp_path / "out"))
    refused(esim.Error, "give the path", lambda: esim.simulate(poster, out="/"))


def test_one_of_several_cameras(rig, tmp_path):
    refused(esim.Error, "choose one with camera=", lambda: esim.convert(rig, tmp_path / "x.txt"))
    esim.convert(rig, tmp_path / "x.bag")
    for read in (esim.load_events, esim.EventsIterator):
        refused(esim.Error, r"esim\.convert\(\.\.\., camera=", lambda: read(tmp_path / "x.bag"))
    refused(esim.Error, "choose one of left, right", lambda: esim.play(rig))


def test_times_that_a_format_has_no_room_for(tmp_path):
    late = random_events(3, 10, 10)
    late["t"] += 10**19 // 2
    for name in ("v2e", "m3ed"):
        refused(esim.Error, "from_zero=True", lambda: esim.save_events(tmp_path / "e.h5", late, 10, 10, format=name))


def test_what_is_rounded_can_be_kept(rig, tmp_path):
    with pytest.warns(UserWarning) as warned:
        esim.convert(rig, tmp_path / "us.h5", camera="left", format="dsec")
    rounded = [str(warning.message) for warning in warned if "rounded" in str(warning.message)]
    assert rounded and 'time_unit="ns"' in rounded[0]
    assert not any(FLAG.search(str(warning.message)) for warning in warned)


def test_recordings_that_are_too_long_to_play(tmp_path):
    events = random_events(3, 10, 10)
    events["t"] = [0, 1, 10**15]
    esim.save_events(tmp_path / "e.txt", events, 10, 10)
    refused(
        esim.Error,
        "start_s=, duration_s=, slow_motion=",
        lambda: esim.play(tmp_path / "e.txt", slow_motion=1, width=10, height=10),
    )


WIDTHS = [0, -1, 65537, 10**30, 4.0, "4", True]


@pytest.mark.parametrize("width", WIDTHS)
def test_sizes(width, tmp_path):
    events = random_events(3, 4, 4)
    esim.save_events(tmp_path / "e.txt", events, 4, 4)
    path = tmp_path / "e.txt"
    kind = esim.Error if type(width) is int else TypeError
    for call in (
        lambda: esim.EventCamera(width, 4),
        lambda: esim.event_count(events, width, 4),
        lambda: esim.event_tensor(events, width, 4),
        lambda: esim.voxel_grid(events, width, 4),
        lambda: esim.time_surface(events, width, 4),
        lambda: esim.event_frame(events, width, 4),
        lambda: esim.time_surface_picture(events, width, 4),
        lambda: esim.space_time_plot(events, width, 4),
        lambda: esim.save_events(tmp_path / "f.txt", events, width, 4),
        lambda: esim.load_events(path, width=width, height=4),
        lambda: esim.EventsIterator(path, width=width, height=4),
        lambda: esim.Recording(path, width=width, height=4),
        lambda: esim.play(path, width=width, height=4),
        lambda: esim.dataset.AffineSequences(width=width),
    ):
        refused(kind, "^width must be", call)


@pytest.mark.parametrize("wrong", [1, np.int64(1), "1", True, float("nan"), 1e10])
def test_times(wrong, tmp_path):
    events = random_events(3, 4, 4)
    esim.save_events(tmp_path / "e.txt", events, 4, 4)
    path, frame = tmp_path / "e.txt", np.ones((4, 4), np.float32)
    t = np.linspace(0, 1, 11)
    trajectory = esim.Trajectory.from_poses(t, np.tile(np.eye(4), (11, 1, 1)))
    kind = esim.Error if type(wrong) is float else TypeError
    for name, call in (
        ("t", lambda: esim.EventCamera(4, 4).process(frame, wrong)),
        ("t", lambda: trajectory.at(wrong)),
        ("t", lambda: trajectory.pose([wrong])),
        ("t", lambda: esim.Trajectory.from_poses([0, wrong], np.tile(np.eye(4), (2, 1, 1)))),
        ("t0", lambda: esim.event_tensor(events, 4, 4, t0=wrong)),
        ("t1", lambda: esim.voxel_grid(events, 4, 4, t1=wrong)),
        ("t", lambda: esim.time_surface(events, 4, 4, t=wrong)),
        ("t", lambda: esim.time_surface_picture(events, 4, 4, t=wrong)),
        ("delta_t", lambda: esim.EventsIterator(path, wrong)),
        ("start", lambda: esim.EventsIterator(path, 0.1, start=wrong)),
        ("duration", lambda: esim.dataset.AffineSequences(duration=wrong)),
    ):
        refused(kind, f"^{name} must be", call)


@pytest.mark.parametrize("wrong", ["1", True, None, float("nan"), 0, -1.0])
def test_seconds(wrong, tmp_path):
    """Arguments whose name says that they are seconds take any number, of numpy's as well."""
    events = random_events(300, 4, 4)
    kind = TypeError if wrong is None or isinstance(wrong, (str, bool)) else esim.Error
    refused(kind, "^tau_s must be", lambda: esim.time_surface(events, 4, 4, tau_s=wrong))
    refused(kind, "^tau_s must be", lambda: esim.time_surface_picture(events, 4, 4, tau_s=wrong))
    for tau in (1, np.int64(1), np.float32(1), np.array(1)):
        np.testing.assert_array_equal(
            esim.time_surface(events, 4, 4, tau_s=tau), esim.time_surface(events, 4, 4, tau_s=1.0)
        )


CODES = [np.uint8, np.uint16, np.int64, bool, complex]


@pytest.mark.parametrize("dtype", CODES)
def test_invalid_irradiance(poster, dtype):
    frame = np.ones((30, 40), dtype)
    depth = np.ones((30, 40))
    refused(TypeError, "linear intensity.*linear_light", lambda: esim.EventCamera(40, 30).process(frame, 0))
    render = lambda t, T, objects: {"irradiance": frame, "depth": depth}
    refused(TypeError, "linear intensity.*linear_light", lambda: esim.simulate(poster, renderer=render).run())
    swapped = lambda t, T, objects: {"irradiance": depth, "depth": frame}
    refused(TypeError, "depth must be floats", lambda: esim.simulate(poster, renderer=swapped).run())


@pytest.mark.parametrize("value", [-1, np.nan, np.inf, 1e300])
def test_light_out_of_range(poster, value):
    frame = np.full((30, 40), 0.5)
    frame[2, 3] = value
    camera = esim.EventCamera(40, 30)
    refused(esim.Error, r"frame 0.*\(3, 2\)", lambda: camera.process(frame, 0))
    render = lambda t, T, objects: {"irradiance": frame, "depth": np.ones((30, 40))}
    refused(esim.Error, r"irradiance.*\(3, 2\)", lambda: esim.simulate(poster, renderer=render).run())
    alone = {"truth": {"rate_hz": 50}, "camera": {**poster["camera"], "events": False}, "frame_camera": {"rate_hz": 50}}
    refused(esim.Error, "irradiance", lambda: esim.simulate({**poster, **alone}, renderer=render).run())


def test_invalid_objects(poster):
    for seen in (np.full((30, 40), -1), np.full((30, 40), 70000), np.full((30, 40), np.nan), np.full((30, 40), 0.5)):
        images = {"irradiance": np.ones((30, 40)), "depth": np.ones((30, 40)), "object": seen}
        refused(esim.Error, "object .* of 0", lambda: esim.simulate(poster, renderer=lambda t, T, objects: images).run())


def test_events_whose_numbers_do_not_fit():
    fields = [("t", "u8"), ("x", "f4"), ("y", "u2"), ("p", "i1")]
    refused(TypeError, "x of events must be ints", lambda: esim.event_count(np.zeros(3, fields), 4, 4))
    late = np.zeros(3, [("t", "u8"), ("x", "u2"), ("y", "u2"), ("p", "i1")])
    late["t"] = 2**63
    refused(esim.Error, "t of events", lambda: esim.event_count(late, 4, 4))


def test_switches_are_bools(poster, rig, tmp_path):
    for call in (
        lambda: esim.simulate(poster, out=rig, force="no"),
        lambda: esim.convert(rig, tmp_path / "x.bag", force=1),
        lambda: esim.Recording(rig, recover="yes"),
        lambda: esim.voxel_grid(random_events(3, 4, 4), 4, 4, normalise="yes"),
    ):
        refused(TypeError, "must be True or False", call)
