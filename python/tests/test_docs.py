"""Runs the examples of the pages that have code in Python, each page in order, with its shell commands (see tests/cli/pages.py)."""

import os
import re
import sys

import numpy as np
import pytest

from conftest import ROOT

sys.path.insert(0, str(ROOT / "tests/cli"))
from pages import Examples, blocks, make_recording, pages

PROGRAM = os.environ.get("ESIM_PROGRAM", "")
PAGES = [page for page in pages() if any(block.language == "python" and not block.reason for block in blocks(page))]

# What the text of a page says of the names that its code defines.


def check_python(names, output):
    assert "did you mean contrast_threshold?" in output
    assert len(names["events"]) > 1000
    assert names["picture"].ndim == 3


def check_tensors(names, _):
    height, width = names["events"].height, names["events"].width
    assert names["counts"].shape == (2, height, width)
    assert names["tensor"].shape == (4, height, width)
    assert names["grid"].shape == (5, height, width)
    assert names["picture"].shape == (height, width, 3)


def check_own(names, _):
    np.testing.assert_allclose(names["packet"].motion_field[0, :, 45, 60], [-50, 0], atol=0.1)
    assert len(names["packets"]) == 3


CHECKS = {"docs/python.md": check_python, "docs/python-tensors.md": check_tensors, "docs/python-own.md": check_own}


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("docs") / "recording"
    make_recording(PROGRAM, path)
    return path


@pytest.mark.skipif(not PROGRAM, reason="needs the program: ESIM_PROGRAM")
@pytest.mark.parametrize("page", PAGES)
def test_the_examples_run(page, recording, tmp_path, monkeypatch, capsys):
    names = {}

    def run(block):
        """Or skips the rest of the page, if a package is not installed."""
        for imported in re.findall(r"^\s*(?:import|from) (.*)", block.text, re.MULTILINE):
            for package in re.findall(r"(?:^|, )(\w+)", imported):
                pytest.importorskip(package)
        exec(compile(block.text, f"{page}:{block.line}", "exec"), names)

    monkeypatch.chdir(tmp_path)
    Examples(page, PROGRAM, tmp_path, recording).run(run)
    CHECKS.get(page, lambda *_: None)(names, capsys.readouterr().out)
