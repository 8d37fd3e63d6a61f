"""Old names of options, attributes, keys and arguments stay valid, with a warning."""

import io
import json
import pickle
import tarfile
import warnings

import numpy as np
import pytest

import esim
from esim._renamed import OldKeys
from esim._shards import Shards

SMALL = {"width": 48, "height": 32, "flow_scale": 0.2}


def test_old_options_of_scenarios(poster):
    truth = {"flow": False, "displacement": True, "rate_hz": 20}
    with pytest.warns(UserWarning, match="truth.flow is now truth.motion_field"):
        packets = list(esim.simulate({**poster, "truth": truth}))
    assert sum(len(packet.optical_flow) for packet in packets) == 4
    with pytest.warns(UserWarning, match="truth.displacement is now truth.optical_flow"):
        esim.simulate(poster, overrides={"truth.displacement": True})
    with pytest.raises(esim.Error, match="truth.flow: must not be given together with truth.motion_field"):
        esim.Scenario({**poster, "truth": {"flow": True, "motion_field": True}})
    assert "motion_field: false" in esim.Scenario(poster).set("truth.flow", False).to_yaml()


def test_old_attributes_of_packets(poster):
    packet = next(esim.simulate(poster, overrides={"truth.optical_flow": True}))
    for owner in (packet, packet["cam0"]):
        for old, now in (("flow", "motion_field"), ("displacement", "optical_flow"), ("displacement_t", "optical_flow_t")):
            with pytest.warns(DeprecationWarning, match=f"^{old} is now {now}$") as caught:
                value = getattr(owner, old)
            assert value is getattr(owner, now)
            assert caught[0].filename == __file__
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                getattr(owner, now)
        with pytest.raises(AttributeError, match="floww"):
            owner.floww


def test_old_names_of_rendered_images(poster):
    shape = (30, 40)
    images = {"irradiance": np.ones(shape), "depth": np.full(shape, 2.0), "flow": np.full((2, *shape), 3.0)}
    with pytest.warns(DeprecationWarning, match="flow is now motion_field"):
        packet = next(esim.simulate(poster, renderer=lambda t, T, objects: images))
    assert (packet.motion_field == 3).all()


def test_old_names_of_sequences():
    with pytest.warns(DeprecationWarning, match="flow_at is now motion_field_at"):
        sequence = esim.dataset.AffineSequences(**SMALL, flow_at="end")[0]
    assert sequence.motion_field_t == sequence.duration
    for old, now in (("flow", "motion_field"), ("flow_t", "motion_field_t"), ("displacement", "optical_flow")):
        with pytest.warns(DeprecationWarning, match=f"{old} is now {now}"):
            assert np.array_equal(getattr(sequence, old), getattr(sequence, now))
    with pytest.warns(DeprecationWarning, match="keyframes is now poses"):
        assert sequence.info["keyframes"] == sequence.info["poses"]
    with pytest.warns(DeprecationWarning, match="displacement_rms_px is now"):
        assert sequence.info["displacement_rms_px"] > 0
    with pytest.raises(TypeError, match="flow_at must not be given together with motion_field_at"):
        esim.dataset.AffineSequences(flow_at="end", motion_field_at="end")
    with pytest.raises(AttributeError, match="floow"):
        sequence.floow


def test_old_keys_of_reports():
    report = OldKeys(resampling_error={"p99": 0.1})
    with pytest.warns(DeprecationWarning, match="resampling_floor is now resampling_error"):
        assert report["resampling_floor"] == {"p99": 0.1}
    for missing in ("unseen_share", "anything", 3):
        with pytest.raises(KeyError, match=str(missing)):
            report[missing]
    assert report == {"resampling_error": {"p99": 0.1}} and "resampling_floor" not in report
    assert json.loads(json.dumps(report)) == pickle.loads(pickle.dumps(report)) == report


def test_arrays_of_older_datasets(tmp_path):
    plan = {"shard_size": 1, "sequences": 1, "format": "webdataset", "made_by": {"duration_s": 0.04}}
    (tmp_path / "dataset.json").write_text(json.dumps(plan))
    arrays = {"flow": np.ones((2, 3, 4), np.float32), "displacement": np.zeros((2, 3, 4), np.float32)}
    with tarfile.open(tmp_path / "shard-000000.tar", "w") as archive:
        for name, array in arrays.items():
            data = io.BytesIO()
            np.save(data, array)
            member = tarfile.TarInfo(f"00000000.{name}.npy")
            member.size = len(data.getvalue())
            archive.addfile(member, io.BytesIO(data.getvalue()))
    shards = Shards(tmp_path)
    assert np.array_equal(shards.array(0, "motion_field"), arrays["flow"])
    assert np.array_equal(shards.array(0, "optical_flow"), arrays["displacement"])
    assert shards.array(0, "depth") is None
