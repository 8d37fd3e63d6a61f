"""Scenarios: from YAML, from dicts, option by option. The reader in C++ knows and checks every option."""

import json
import os

import numpy as np

from . import _core
from ._errors import Error


def _plain(value):
    """What JSON has no words for."""
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise TypeError(f"a scenario holds numbers, text, lists and dicts, not a {type(value).__name__}")


def to_yaml(value):
    """A value as YAML, of which JSON is a part."""
    return json.dumps(value, default=_plain, ensure_ascii=False)


def to_overrides(options):
    """`{"a.b": value}`, or `["a.b=value"]`, as the reader takes them."""
    if options is None:
        return []
    if isinstance(options, dict):
        return [f"{key}={to_yaml(value)}" for key, value in options.items()]
    if isinstance(options, str):
        raise TypeError('overrides are a dict, {"key.path": value}, or a list of "key.path=value"')
    return list(options)


class Scenario:
    """Everything that determines a simulation; `docs/scenario.md` lists the options.

    A copy is independent. A pickle holds what was given, text and changes, and reads it again: relative paths are those
    of the process that does so.

    Parameters
    ----------
    options : dict
        Nested as in YAML. Values may be numpy's, and paths.
    folder : path, optional
        Where relative paths begin; the working directory otherwise.

    Raises
    ------
    esim.Error
        For unknown keys, values out of range and whatever else the reader finds, naming the key and what would be right.
    """

    def __init__(self, options, *, folder=None):
        if not isinstance(options, dict):
            raise TypeError("options of a scenario are a dict; Scenario.load() reads files")
        name = "scenario" if folder is None else os.path.join(os.fspath(folder), "scenario")
        self._begin(to_yaml(options), name, False)

    def _begin(self, yaml, file, has_lines):
        self._text = (yaml, file, has_lines)
        self._overrides = []
        self._values = self._read([])

    def _read(self, overrides, renderer=False, trajectory=False):
        """Values in C++. A renderer or a trajectory may be missing where one is brought, or nothing is simulated yet."""
        return _core.Scenario(*self._text, self._overrides + overrides, renderer, trajectory)

    @classmethod
    def load(cls, path):
        """Reads a YAML file. Relative paths in it are taken from its folder.

        Parameters
        ----------
        path : path

        Returns
        -------
        Scenario
        """
        path = os.fspath(path)
        try:
            with open(path, encoding="utf-8") as file:
                text = file.read()
        except OSError as error:
            raise Error(f"{path}: no scenario can be read there: {error.strerror}") from None
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
            Dotted, as in `"event_camera.contrast_threshold"`; entries of lists by their number.
        value : object
            As in a dict of options.

        Returns
        -------
        Scenario
            Itself, so that calls chain. Where the value is refused, it is as it was before.
        """
        override = to_overrides({key: value})
        self._values = self._read(override)
        self._overrides += override
        return self

    def to_yaml(self):
        """The scenario in full, every option explicit, as YAML.

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
    """What simulate() takes, as a Scenario."""
    if isinstance(scenario, Scenario):
        return scenario
    if isinstance(scenario, dict):
        return Scenario(scenario)
    return Scenario.load(scenario)
