"""Runs the code of the guides, each in order."""

import re

import numpy as np
import pytest

from conftest import ROOT


@pytest.fixture
def run_guide(tmp_path, monkeypatch):
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    monkeypatch.chdir(tmp_path)

    def run(page):
        """Returns the names that the code of the page defines."""
        names = {}
        blocks = re.findall(r"^```python\n(.*?)^```", (ROOT / page).read_text(), re.DOTALL | re.MULTILINE)
        assert blocks
        for block in blocks:
            exec(compile(block, page, "exec"), names)
        return names

    return run


def test_the_guide_runs(run_guide, capsys):
    names = run_guide("docs/python.md")
    assert "did you mean contrast_threshold?" in capsys.readouterr().out
    assert len(names["events"]) > 1000
    assert names["picture"].ndim == 3


def test_the_guide_to_tensors_runs(run_guide):
    names = run_guide("docs/python-tensors.md")
    height, width = names["events"].height, names["events"].width
    assert names["counts"].shape == (2, height, width)
    assert names["tensor"].shape == (4, height, width)
    assert names["grid"].shape == (5, height, width)
    assert names["picture"].shape == (height, width, 3)


def test_the_guide_to_own_data_runs(run_guide):
    names = run_guide("docs/python-own.md")
    np.testing.assert_allclose(names["packet"].motion_field[0, :, 45, 60], [-50, 0], atol=0.1)  # as the guide says
    assert len(names["packets"]) == 3
