import subprocess
import sys

import pytest

from esim import _processor


def test_the_processor_is_checked_before_the_module_is_loaded(tmp_path):
    (tmp_path / "cpuinfo").write_text("processor\t: 0\nflags\t\t: fpu sse sse2 fma\n\nflags\t\t: avx2\n")
    features = _processor.present(tmp_path / "cpuinfo")
    assert features == {"fpu", "sse", "sse2", "fma"}
    with pytest.raises(ImportError, match="this processor does not have AVX2, which .* build esim from its sources"):
        _processor.require(features, ("avx2", "fma"))
    _processor.require(features | {"avx2"}, ("avx2", "fma"))
    _processor.require(_processor.present(tmp_path / "missing"), ("avx2",))  # unknown: try


def test_the_module_is_not_imported_for_other_processors():
    code = """
import builtins, io, sys
real = builtins.open
builtins.open = lambda path, *a, **k: io.StringIO("flags : sse") if path == "/proc/cpuinfo" else real(path, *a, **k)
try:
    import esim
except ImportError as error:
    print(error, "esim._core" in sys.modules)
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    if _processor.NEEDED:
        assert "does not have AVX2 and FMA" in result.stdout and result.stdout.endswith("False\n"), result
