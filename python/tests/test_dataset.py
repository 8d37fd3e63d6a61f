"""Sequences made on the fly."""

import ast
import concurrent.futures
import inspect
import pathlib

import numpy as np
import pytest

import esim

SMALL = {"width": 48, "height": 32, "flow_scale": 0.2}


def test_a_sequence_is_labelled():
    sequence = esim.dataset.AffineSequences(**SMALL)[3]
    assert sequence.events.dtype == esim.EVENT_DTYPE and len(sequence.events) > 100
    assert sequence.duration == 40_000_000 and sequence.motion_field_t == 20_000_000
    assert sequence.events["t"].max() <= sequence.duration
    for array in (sequence.motion_field, sequence.optical_flow, sequence.images):
        assert array.shape == (2, 32, 48) and array.dtype == np.float32
    assert 0.2 <= sequence.info["contrast_threshold"] <= 0.5
    # Fields are affine: all second differences vanish.
    for field in (*sequence.motion_field, *sequence.optical_flow):
        for axis in (0, 1):
            assert np.abs(np.diff(field, 2, axis=axis)).max() <= 2e-6 * np.abs(field).max()
    assert np.array_equal(sequence.tensor()[:2].astype(int), esim.event_count(sequence.events, 48, 32))
    assert sequence.voxels(7).shape == (7, 32, 48)


def test_a_sequence_depends_on_options_and_index_alone():
    sequences = esim.dataset.AffineSequences(**SMALL)
    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        made = list(pool.map(lambda i: sequences[i], range(8)))
    again = esim.dataset.AffineSequences(**SMALL)
    for i in reversed(range(8)):
        assert np.array_equal(made[i].events, again[i].events) and made[i].info == again[i].info
    assert not np.array_equal(esim.dataset.AffineSequences(**SMALL, seed=2)[0].optical_flow, made[0].optical_flow)


def test_options_reach_the_camera():
    plain = esim.dataset.AffineSequences(**SMALL, contrast_threshold=0.3)[0]
    assert plain.info["contrast_threshold"] == 0.3
    noisy = esim.dataset.AffineSequences(**SMALL, contrast_threshold=0.3, event_camera={"shot_noise_hz": 1000})[0]
    assert len(noisy.events) > len(plain.events)


def test_mistakes_are_named(tmp_path):
    with pytest.raises(esim.Error, match="thresh"):
        esim.dataset.AffineSequences(event_camera={"thresh": 1})
    with pytest.raises(esim.Error, match="has no images"):
        esim.dataset.AffineSequences(tmp_path)
    with pytest.raises(esim.Error, match="motion_field_at"):
        esim.dataset.AffineSequences(motion_field_at="never")
    with pytest.raises(IndexError):
        esim.dataset.AffineSequences(**SMALL)[-1]


def test_stubs_and_module_agree():
    stubs = ast.parse((pathlib.Path(__file__).parents[1] / "esim" / "dataset.pyi").read_text())
    classes = {node.name: node for node in stubs.body if isinstance(node, ast.ClassDef)}
    assert set(classes) == set(esim.dataset.__all__)
    for name, node in classes.items():
        for method in (m for m in node.body if isinstance(m, ast.FunctionDef)):
            real = inspect.signature(getattr(getattr(esim.dataset, name), method.name))
            listed = [a.arg for a in method.args.args + method.args.kwonlyargs]
            assert list(real.parameters) == listed, f"{name}.{method.name}"
