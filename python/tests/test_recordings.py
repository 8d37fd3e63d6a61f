import json
import pathlib

import numpy as np
import pytest

import esim
from conftest import random_events

SCENES = pathlib.Path(__file__).parents[2] / "scenes"
OPTIONS = {
    "duration_s": 0.2,
    "camera.width": 64,
    "camera.height": 48,
    "frame_camera": {"rate_hz": 50},
    "imu": {"rate_hz": 100},
    "output.preview": False,
    "output.time_unit": "ns",
}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    out = tmp_path_factory.mktemp("recorded") / "poster"
    packets = list(esim.simulate(SCENES / "poster.yaml", overrides=OPTIONS, out=out, packet_s=0.05))
    return out, packets


def joined(packets, name):
    return np.concatenate([getattr(packet, name) for packet in packets])


@pytest.mark.parametrize("name", ["", ".bag", ".mcap"])
def test_a_recording_reads_as_it_was_simulated(recorded, tmp_path, name):
    out, packets = recorded
    path = out
    if name:
        path = tmp_path / f"poster{name}"
        copied = esim.convert(out, path)
        assert copied["events"] == sum(len(packet.events) for packet in packets)
    recording = esim.Recording(path, 0.05)
    assert recording.info["cameras"]["cam0"]["width"] == 64
    read = list(recording)
    for field in ("events", "images", "image_t", "truth_t"):
        np.testing.assert_array_equal(joined(read, field), joined(packets, field), err_msg=field)
    np.testing.assert_allclose(joined(read, "depth"), joined(packets, "depth"))
    np.testing.assert_allclose(joined(read, "motion_field"), joined(packets, "motion_field"), rtol=1e-6)
    np.testing.assert_allclose(joined(read, "pose"), joined(packets, "pose"), atol=1e-8)
    np.testing.assert_array_equal(joined(read, "imu")["t"], joined(packets, "imu")["t"])
    for packet in read:
        assert (packet.events["t"] <= packet.t1).all()


def test_damaged_files_with_and_without_recovery(tmp_path):
    path = tmp_path / "e.txt"
    path.write_text("0.1 1 2 1\n0.2 1 2 0\nwhat\n")
    with pytest.raises(esim.Error, match="line 3"):
        list(esim.Recording(path))
    with pytest.warns(UserWarning, match="line 3"):
        (packet,) = list(esim.Recording(path, 1.0, recover=True))
    assert len(packet.events) == 2
    with pytest.warns(UserWarning, match="line 3"):
        assert esim.convert(path, tmp_path / "e.npz", recover=True) == {"events": 2}
    with pytest.raises(esim.Error, match="force"):
        esim.convert(tmp_path / "e.npz", path)
    with pytest.raises(ValueError):
        esim.Recording(path, 0)


def test_images_of_another_size_than_the_sensor_are_refused(recorded):
    out, _ = recorded
    with pytest.raises(esim.Error, match="has 64 x 48 px, but the camera 80 x 60"):
        list(esim.Recording(out, width=80, height=60))


def test_what_was_recovered_is_not_called_complete(recorded, tmp_path):
    out, _ = recorded
    bag = tmp_path / "poster.bag"
    esim.convert(out, bag)
    bag.write_bytes(bag.read_bytes()[: bag.stat().st_size * 2 // 3])
    with pytest.warns(UserWarning, match="poster.bag"):
        esim.convert(bag, tmp_path / "again", format="recording", recover=True)
    assert json.loads((tmp_path / "again" / "report.json").read_text())["status"] == "interrupted"


def test_pictures_show_every_event_and_refuse_others():
    events = random_events(2000, 100, 80)
    picture = esim.time_surface_picture(events, 100, 80, tau_s=10.0)
    assert picture.shape == (80, 100, 3) and picture.dtype == np.uint8
    seen = esim.event_count(events, 100, 80).sum(axis=0) > 0
    ground = esim.time_surface_picture(events[:0], 100, 80)
    np.testing.assert_array_equal((picture != ground).any(axis=2), seen)
    plot = esim.space_time_plot(events, 100, 80, size=(320, 240))
    empty = esim.space_time_plot(events[:0], 100, 80, size=(320, 240))
    assert plot.shape == (240, 320, 3) and (plot != empty).any(axis=2).mean() > 0.02
    for draw in (esim.time_surface_picture, esim.space_time_plot):
        with pytest.raises(esim.Error, match="outside the sensor"):
            draw(events, 50, 80)


def test_play_shows_what_there_is_side_by_side(recorded):
    out, _packets = recorded
    pages = esim.play(out, fps=20, slow_motion=1, size=900)
    pictures = list(pages)
    assert len(pictures) == len(pages) == 5
    assert all(picture.shape == pictures[0].shape and picture.dtype == np.uint8 for picture in pictures)
    assert any((a != b).any() for a, b in zip(pictures, pictures[1:]))
    np.testing.assert_array_equal(np.diff(pages.times), 50_000_000)
    (alone,) = esim.play(out, at_s=0.1, views=["image"], size=400, light=True)
    assert 350 < alone.shape[1] < 450
    assert (alone[:10] > 200).all() and (pictures[0][:10] < 100).all()
    for wrong, match in (({"views": ["cube"]}, "no view cube"), ({"camera": "left"}, "no camera left"), ({"at_s": 9.0}, "at_s")):
        with pytest.raises(esim.Error, match=match):
            esim.play(out, **wrong)
    (same,) = esim.play(out, at_s=0.1, views="image", size=400, light=True)
    np.testing.assert_array_equal(same, alone)
    for read in (esim.play, esim.Recording):
        with pytest.raises(esim.Error, match="width and height"):
            read(out, width=64)
    with pytest.raises(ValueError, match="fps"):
        esim.play(out, fps=0)
