import numpy as np
import pytest

import esim


def test_several_sensors_see_the_same(poster, tmp_path):
    several = {"event_cameras": [{"name": "low", "labels": True}, {"name": "high", "contrast_threshold": 0.3}], "sampling.type": "flow"}
    simulation = esim.simulate(poster, overrides=several, out=tmp_path / "out")
    assert simulation.cameras["cam0"]["sensors"] == ["low", "high"]
    packets = list(simulation)
    for packet in packets:
        assert list(packet.cameras) == ["cam0"]
        assert list(packet.sensors) == ["low", "high"]
        assert len(packet.sensors["low"].labels) == len(packet.sensors["low"].events)
        assert packet.depth.shape[1:] == (30, 40)
        with pytest.raises(esim.Error, match=r"use sensors\[name\].events, with name one of \['low', 'high'\]"):
            packet.events  # noqa: B018
    alone = esim.simulate(poster, overrides={"sampling.type": "flow"})
    for packet, one in zip(packets, alone, strict=True):
        np.testing.assert_array_equal(packet.sensors["low"].events, one.events)
        assert one.sensors == {}
    report = simulation.report["cameras"][0]
    assert [sensor["name"] for sensor in report["sensors"]] == ["low", "high"]
    assert report["events"] == sum(sensor["events"] for sensor in report["sensors"])
    for packet in esim.Recording(tmp_path / "out"):
        assert set(packet.sensors) == {"low", "high"}


def test_the_seed_draws_other_sensors(poster):
    drawn = {"event_camera": {"count": 2, "contrast_threshold": {"uniform": [0.1, 0.5]}}, "duration_s": 0.02}
    varied = [esim.simulate(poster, overrides=drawn, seed=seed).run()["cameras"][0]["sensors"][0]["varied"] for seed in (1, 2)]
    assert varied[0]["contrast_threshold"] != varied[1]["contrast_threshold"]
