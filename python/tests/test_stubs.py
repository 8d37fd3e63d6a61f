"""The stubs are kept by hand: they name what the package has, with the same parameters and defaults."""

import ast
import inspect
import pathlib
import re
import subprocess
import sys

import pytest

import esim

FOLDER = pathlib.Path(__file__).parents[1] / "esim"
STUBS = ast.parse((FOLDER / "__init__.pyi").read_text())


def stubbed_parameters(function):
    """Name, kind and default of each."""
    a = function.args
    plain = a.posonlyargs + a.args
    defaults = [None] * (len(plain) - len(a.defaults)) + a.defaults
    listed = [(p.arg, "positional", d) for p, d in zip(plain, defaults)]
    listed += [(p.arg, "keyword", d) for p, d in zip(a.kwonlyargs, a.kw_defaults)]
    if a.kwarg:
        listed.append((a.kwarg.arg, "rest", None))
    return [(name, kind, None if d is None else ast.literal_eval(d)) for name, kind, d in listed]


def real_parameters(function):
    kinds = {"POSITIONAL_OR_KEYWORD": "positional", "KEYWORD_ONLY": "keyword", "VAR_KEYWORD": "rest"}
    return [
        (p.name, kinds[p.kind.name], None if p.default is p.empty else p.default)
        for p in inspect.signature(function).parameters.values()
    ]


def compare(stub, real, name):
    assert real.__doc__ or "__" in name, f"{name} has no docstring"
    expected = stubbed_parameters(stub)
    if expected and expected[0][0] in ("self", "cls"):
        expected = expected[1:]
    actual = real_parameters(real)
    if actual and actual[0][0] in ("self", "cls"):
        actual = actual[1:]
    assert expected == actual, name


@pytest.mark.parametrize("module, file", [(esim, "__init__.pyi"), (esim.dataset, "dataset.pyi"), (esim.filters, "filters.pyi"), (esim.interpolators, "interpolators/__init__.pyi")])
def test_stubs_and_package_agree(module, file):
    named = set()
    for node in ast.parse((FOLDER / file).read_text()).body:
        if isinstance(node, ast.AnnAssign) and getattr(node.annotation, "id", "") != "TypeAlias":
            named.add(node.target.id)
        if isinstance(node, ast.FunctionDef):
            named.add(node.name)
            compare(node, getattr(module, node.name), node.name)
        if isinstance(node, ast.ClassDef):
            named.add(node.name)
            real = getattr(module, node.name)
            assert real.__doc__, node.name
            members = [m for m in node.body if isinstance(m, ast.FunctionDef)]
            for member in members:
                if member.name in ("__exit__",):
                    continue
                found = inspect.getattr_static(real, member.name)
                if isinstance(found, property):
                    assert found.fget.__doc__, member.name
                else:
                    compare(member, getattr(real, member.name), f"{node.name}.{member.name}")
            public = {name for name, value in vars(real).items() if not name.startswith("_")}
            fields = {m.target.id for m in node.body if isinstance(m, ast.AnnAssign)}
            assert public <= {m.name for m in members} | fields | {"render", "objects"}, node.name
    assert named == set(module.__all__)


def test_the_fields_of_packets_are_those_of_the_stubs():
    (stub,) = [n for n in STUBS.body if isinstance(n, ast.ClassDef) and n.name == "CameraPacket"]
    assert [m.target.id for m in stub.body] == list(esim.CameraPacket.__slots__)


def test_requirements_are_those_of_the_wheel():
    root = pathlib.Path(__file__).parents[2]
    wheels = re.search(r"^requires = \[(.*)\]", (root / "pyproject.toml").read_text(), re.MULTILINE).group(1)
    pinned = re.findall(r'"([^"]+==[^"]+)"', wheels)
    assert len(pinned) == 2 and set(pinned) <= set((root / "python" / "requirements.txt").read_text().split())


def test_importing_loads_nothing_but_numpy():
    code = "import sys, numpy; before = set(sys.modules); import esim; print(*{m.split('.')[0] for m in set(sys.modules) - before})"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert set(loaded) - set(sys.stdlib_module_names) <= {"esim"}


def test_the_version_is_the_projects():
    root = pathlib.Path(__file__).parents[2]
    version = re.search(r"project\(esim VERSION ([0-9.]+)", (root / "CMakeLists.txt").read_text()).group(1)
    assert esim.__version__ == version
