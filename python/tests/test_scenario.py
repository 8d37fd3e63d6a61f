import copy
import pickle
import re

import numpy as np
import pytest

import esim
from conftest import ROOT


def test_dict_file_and_text_are_the_same(poster, tmp_path):
    scenario = esim.Scenario(poster)
    file = tmp_path / "whole.yaml"
    file.write_text(scenario.to_yaml())
    assert esim.Scenario.load(file).to_yaml() == scenario.to_yaml()
    assert "contrast_threshold: 0.1" in scenario.to_yaml()


def test_relative_paths_begin_at_the_folder():
    options = {"renderer": {"type": "plane", "image": "poster/poster.jpg"}}
    text = esim.Scenario(options, folder=ROOT / "scenes").to_yaml()
    assert str(ROOT / "scenes" / "poster" / "poster.jpg") in text


def test_set_changes_one_option_or_none(poster):
    scenario = esim.Scenario(poster)
    before = scenario.to_yaml()
    with pytest.raises(esim.Error, match="event_camera.contrast_threshold: 1000 is out of range"):
        scenario.set("event_camera.contrast_threshold", 1000)
    with pytest.raises(esim.Error, match="unknown key"):
        scenario.set("camera.widht", 3)
    assert scenario.to_yaml() == before
    assert scenario.set("event_camera.contrast_threshold", np.float32(0.25)).set("camera.width", 44) is scenario
    assert "contrast_threshold: 0.25" in scenario.to_yaml() and "width: 44" in scenario.to_yaml()


def test_messages_name_the_place(tmp_path):
    file = tmp_path / "s.yaml"
    file.write_text("seed: 1\nrendere: {}\n")
    with pytest.raises(esim.Error, match=r"s\.yaml:2: rendere: unknown key; did you mean renderer\?"):
        esim.Scenario.load(file)
    with pytest.raises(esim.Error, match="^scenario: rendere: unknown key"):
        esim.Scenario({"rendere": {}})
    with pytest.raises(esim.Error, match="cannot read the scenario"):
        esim.Scenario.load(tmp_path / "none.yaml")
    file.write_text("seed: [")
    with pytest.raises(esim.Error, match="not valid YAML"):
        esim.Scenario.load(file)
    file.write_bytes(b"seed: \xff\xfe")
    with pytest.raises(esim.Error, match="not valid YAML"):
        esim.Scenario.load(file)


def test_values_that_yaml_cannot_hold():
    with pytest.raises(TypeError, match="not a set"):
        esim.Scenario({"seed": {1}})
    with pytest.raises(TypeError, match="dict"):
        esim.Scenario("a.yaml")
    with pytest.raises(esim.Error):
        esim.Scenario({"start_s": float("nan")})
    name = '/gräfin "o\\'
    scenario = esim.Scenario({"renderer": {"type": "plane", "image": name}, "trajectory": {"type": "static"}, "duration_s": 1})
    with pytest.raises(esim.Error, match=re.escape(name)):  # as it was given
        esim.simulate(scenario)


def test_a_scenario_that_is_simulated_needs_what_is_not_brought(poster):
    for key in ("renderer", "trajectory"):
        options = {name: value for name, value in poster.items() if name != key}
        esim.Scenario(options)
        with pytest.raises(esim.Error, match=f"{key}: is missing"):
            esim.simulate(options)


DUPLICATES = [copy.copy, copy.deepcopy, lambda scenario: pickle.loads(pickle.dumps(scenario))]


@pytest.mark.parametrize("duplicate", DUPLICATES)
def test_copies_are_the_same_and_independent(poster, duplicate):
    for scenario in (esim.Scenario(poster), esim.Scenario.load(ROOT / "scenes" / "poster.yaml")):
        scenario.set("event_camera.contrast_threshold", 0.31)
        other = duplicate(scenario)
        assert other is not scenario and other.to_yaml() == scenario.to_yaml() and repr(other) == repr(scenario)
        other.set("camera.width", 44)
        assert "width: 44" in other.to_yaml() and "width: 44" not in scenario.to_yaml()
        scenario.set("camera.width", 46).set("camera.height", 48)
        assert "width: 44" in other.to_yaml() and "height: 48" not in other.set("seed", 3).to_yaml()


def test_copies_simulate_the_same(poster):
    scenario = esim.Scenario(poster)
    packets = [next(esim.simulate(s, packet_s=0.1)) for s in (scenario, pickle.loads(pickle.dumps(scenario)))]
    np.testing.assert_array_equal(packets[0].events, packets[1].events)


def test_a_scenario_prints_what_it_is(poster):
    scenario = esim.Scenario(poster).set("seed", 7)
    assert repr(scenario) == "<esim.Scenario scenario: cam0 40 x 30 px, 0.2 s, seed=7>"
    assert "poster.yaml: cam0 240 x 180 px" in repr(esim.Scenario.load(ROOT / "scenes" / "poster.yaml"))
