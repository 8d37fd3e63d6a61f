"""Settings of a training from YAML; full.yaml has and explains all of them."""

import pathlib

import yaml

import esim

FULL = pathlib.Path(__file__).with_name("full.yaml")
KINDS = {float: "a number", int: "a whole number", bool: "true or false"}


def read_settings(path, changes=()):
    """Settings as a nested dict: those of full.yaml, changed by the file, changed by texts like `batch=4`.

    Raises esim.Error for what cannot be read, and for names that full.yaml does not have.
    """
    settings = read(FULL)
    change(settings, read(path), str(path))
    for text in changes:
        name, equals, value = text.partition("=")
        if not equals:
            raise esim.Error(f'--set {text}: expected NAME=VALUE, such as "batch=4" or "network.width=0.5"')
        nested = yaml.safe_load(value)
        for part in reversed(name.split(".")):
            nested = {part: nested}
        change(settings, nested, f"--set {text}")
    return settings


def read(path):
    try:
        settings = yaml.safe_load(pathlib.Path(path).read_text())
    except OSError as problem:
        raise esim.Error(f"cannot read {path}: {problem.strerror}") from None
    except yaml.YAMLError as problem:
        raise esim.Error(f"{path} is not valid YAML: {' '.join(str(problem).split())}") from None
    if not isinstance(settings, dict):
        raise esim.Error(f"{path} has no settings")
    simulation = settings.get("simulation")
    if isinstance(simulation, dict) and simulation.get("flow_histogram"):  # relative to the file
        simulation["flow_histogram"] = str(pathlib.Path(path).resolve().parent / simulation["flow_histogram"])
    return settings


def change(settings, changes, where):
    for name, value in changes.items():
        if name not in settings:
            raise esim.Error(f"{where}: unknown setting {name}; valid settings are {', '.join(settings)}")
        known = settings[name]
        if name == "simulation" and isinstance(value, dict):  # esim checks these
            settings[name] = {**known, **value}
        elif isinstance(known, dict):
            if not isinstance(value, dict):
                raise esim.Error(f"{where}: {name} must be a map of these settings: {', '.join(known)}")
            change(known, value, where)
        else:
            settings[name] = like(known, value, f"{where}: {name}")


def like(known, value, where):
    """The value, if it has the type of the known one."""
    kind = type(known)
    try:
        if kind is float and not isinstance(value, bool):
            return float(value)  # for YAML, 1e-4 is text
        if kind in (int, bool) and type(value) is not kind:
            raise ValueError
    except (TypeError, ValueError):
        raise esim.Error(f"{where} must be {KINDS[kind]}, not {value!r}") from None
    return value
