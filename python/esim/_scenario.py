"""Scenarios from YAML, dicts and single options. The C++ reader checks every option."""

import json
import os
import shlex

import numpy as np

from . import _core
from ._errors import Error


def _plain(value):
    """Converts types that JSON does not support."""
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise TypeError(f"options of a scenario must be numbers, text, lists and dicts, not a {type(value).__name__}")


def to_yaml(value):
    """A value as YAML, in the JSON subset."""
    return json.dumps(value, default=_plain, ensure_ascii=False)


def to_overrides(options):
    """Converts `{"a.b": value}` or `["a.b=value"]` to the reader's form."""
    if options is None:
        return []
    if isinstance(options, dict):
        return [f"{key}={to_yaml(value)}" for key, value in options.items()]
    if isinstance(options, str):
        raise TypeError('overrides must be a dict, {"key.path": value}, or a list of "key.path=value"')
    return list(options)


class Scenario:
    """All options of a simulation; `docs/scenario.md` lists them.

    A copy is independent. A pickle contains the text and the changes and is read again when it is loaded: relative paths
    then refer to the loading process.

    Parameters
    ----------
    options : dict
        Nested as in YAML. Values may also be NumPy types and paths.
    folder : path, optional
        Base of relative paths. Default: the working directory.

    Raises
    ------
    esim.Error
        For unknown keys, values out of range and other problems, with the key and the valid values.
    """

    def __init__(self, options, *, folder=None):
        if not isinstance(options, dict):
            raise TypeError("options of a scenario must be a dict; use Scenario.load() for files")
        name = "scenario" if folder is None else os.path.join(os.fspath(folder), "scenario")
        self._begin(to_yaml(options), name, False)

    def _begin(self, yaml, file, has_lines):
        self._text = (yaml, file, has_lines)
        self._overrides = []
        self._values = self._read([])

    def _read(self, overrides, renderer=False, trajectory=False):
        """The values in C++. If `renderer` or `trajectory` is false, the scenario need not have one."""
        return _core.Scenario(*self._text, self._overrides + overrides, renderer, trajectory)

    def _command(self, overrides, seed, out):
        """The command that simulates the same; for scenarios without a file, from the recording `out` itself."""
        _, file, from_file = self._text
        if not from_file:
            return shlex.join(["esim", "simulate", os.path.join(out, "scenario.yaml"), "--out", f"{out}-again"])
        settings = [word for override in self._overrides + overrides for word in ("--set", override)]
        if seed is not None:
            settings += ["--seed", str(int(seed))]
        return shlex.join(["esim", "simulate", file, "--out", out, *settings])

    @classmethod
    def load(cls, path):
        """Reads a YAML file. Relative paths in it start at its folder.

        Parameters
        ----------
        path : path

        Returns
        -------
        Scenario
        """
        path = os.fspath(path)
        try:
            with open(path, encoding="utf-8", newline="") as file:  # the same bytes, for their checksum
                text = file.read()
        except OSError as error:
            raise Error(f"{path}: cannot read the scenario: {error.strerror}") from None
        except UnicodeDecodeError as error:
            raise Error(f"{path}: not valid YAML: {error}") from None
        self = cls.__new__(cls)
        self._begin(text, path, True)
        return self

    def set(self, key, value):
        """Changes one option.

        Parameters
        ----------
        key : str
            Dotted key, as in `"event_camera.contrast_threshold"`; entries of lists by number.
        value : object
            Value as in a dict of options.

        Returns
        -------
        Scenario
            Itself, for chained calls. It does not change if the value is invalid.
        """
        override = to_overrides({key: value})
        self._values = self._read(override)
        self._overrides += override
        return self

    def to_yaml(self):
        """Returns the complete scenario, with every option, as YAML.

        Returns
        -------
        str
        """
        return self._values.to_yaml()

    def __getstate__(self):
        return {"text": self._text, "overrides": list(self._overrides)}

    def __setstate__(self, state):
        self._text, self._overrides = state["text"], list(state["overrides"])
        self._values = self._read([])

    def __repr__(self):
        changes = "".join(f", {override}" for override in self._overrides)
        return f"<esim.Scenario {self._text[1]}: {self._values.describe()}{changes}>"


def to_scenario(scenario):
    """Converts the argument of simulate() to a Scenario."""
    if isinstance(scenario, Scenario):
        return scenario
    if isinstance(scenario, dict):
        return Scenario(scenario)
    return Scenario.load(scenario)
