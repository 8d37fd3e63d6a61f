"""Runs the guide's code, in order."""

import re

import numpy as np

from conftest import ROOT


def test_the_guide_runs(tmp_path, monkeypatch, capsys):
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```python\n(.*?)^```", (ROOT / "docs" / "python.md").read_text(), re.DOTALL | re.MULTILINE)
    assert len(blocks) >= 7
    names = {}
    for block in blocks:
        exec(compile(block, "docs/python.md", "exec"), names)
    np.testing.assert_allclose(names["packet"].motion_field[0, :, 45, 60], [-50, 0], atol=0.1)  # as the guide says
    assert "did you mean contrast_threshold?" in capsys.readouterr().out
    assert len(names["packets"]) == 3 and len(names["events"]) > 1000
    assert names["picture"].shape == (90, 120, 3)
