"""The images of engines on disk."""

import sys
import threading

import numpy as np
import pytest

import esim
from conftest import ROOT


@pytest.fixture
def engine(monkeypatch):
    """A scenario whose scene a server shows, which has one client after the other."""
    monkeypatch.setattr(sys, "argv", ["", "esim"])
    monkeypatch.syspath_prepend(str(ROOT / "tests" / "cli"))
    from image_cache_test import ImageCache, Server

    server = Server(-1)
    threading.Thread(target=ImageCache.serve_one_after_the_other, args=(server,), daemon=True).start()
    return {
        "renderer": {"type": "unrealcv", "port": server.port},
        "trajectory": {"type": "random", "rotation_amplitude_deg": [0, 5, 0]},
        "duration_s": 0.05,
        "camera": {"width": 32, "height": 24},
        "sampling": {"type": "uniform", "rate_hz": 500},
        "event_camera": {"contrast_threshold": 0.05},
    }


def run(scenario, **options):
    simulation = esim.simulate(scenario, **options)
    events = np.concatenate([packet.events for packet in simulation])
    report = simulation.report
    del simulation  # the next one needs the server
    return events, report.get("engine_images")


def test_images_come_from_the_folder_that_was_named(engine, tmp_path):
    plain, images = run(engine)
    assert images is None and len(plain) > 100
    empty, first = run(engine, cache=tmp_path / "images")
    full, second = run(engine, cache=tmp_path / "images")
    np.testing.assert_array_equal(empty, plain)
    np.testing.assert_array_equal(full, plain)
    assert first["rendered"] > 20 and second["rendered"] == 0
    assert second["from_cache"] == first["rendered"] + first["from_cache"]
    assert run(engine, cache=False)[1] is None
    run(engine, cache=tmp_path / "images", cache_bytes=5000)
    run(engine, cache=tmp_path / "images", cache_bytes=5000, overrides={"camera.width": 40})
    assert sum(file.stat().st_size for file in (tmp_path / "images").iterdir()) <= 5000


def test_a_folder_that_cannot_be_written_is_a_warning(engine, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.warns(UserWarning, match="further images are not stored"):
        run(engine, cache=tmp_path / "file" / "images")


def test_where_it_has_no_effect(poster, tmp_path):
    with pytest.warns(UserWarning, match="the image cache has no effect"):
        esim.simulate(poster, cache=tmp_path / "images")
    with pytest.raises(esim.Error, match="cache must not be given with renderer"):
        esim.simulate(poster, cache=tmp_path / "images", renderer=lambda t, T, objects: {})
    with pytest.raises(esim.Error, match="cache_bytes"):
        esim.simulate(poster, cache_bytes=0)
    with pytest.raises(TypeError):
        esim.simulate(poster, cache=7)
