"""Simulations, packet by packet."""

import json
import os
import warnings

from .. import _checks, _core
from .._errors import Error, LossWarning
from .._renamed import OldKeys, present_name
from .._scenario import to_overrides, to_scenario
from ._packets import Packet


class Renderer:
    """A custom renderer that replaces the scenario's renderer in simulate().

    Parameters
    ----------
    render : callable
        `render(t, T_world_camera, T_world_objects)` with t in ns, a (4, 4) matrix, and a list with a (4, 4) matrix for
        each object. Returns a dict of arrays of the camera's size:

        - `irradiance`, (height, width) floats: linear intensity, 1 = white; `esim.linear_light` converts 8-bit images;
        - `depth`, (height, width) floats: along the optical axis, m; inf without a surface;
        - `motion_field`, (2, height, width), optional: the motion field, px/s. By default computed from depth and
          motion;
        - `object`, (height, width) ints, needed if objects move and motion_field is not given: i + 1 for object i,
          otherwise 0.

        The same arguments must give the same images.
    objects : dict of str to Trajectory, optional
        Moving objects by name: T_world_object.
    """

    def __init__(self, render, *, objects=None):
        if not callable(render):
            raise TypeError("render must be a function of t, T_world_camera and T_world_objects")
        self.render = render
        self.objects = dict(objects or {})

    def _checked(self, t, T_world_camera, T_world_objects, shape):
        images = self.render(t, T_world_camera, T_world_objects)
        if not isinstance(images, dict):
            raise TypeError(f"render() must return a dict of images, not a {type(images).__name__}")
        images = {present_name(name, {"flow": "motion_field"}): image for name, image in images.items()}
        unknown = set(images) - {"irradiance", "depth", "motion_field", "object"}
        if unknown:
            raise Error("render() must return irradiance, depth, motion_field and object only, "
                        f"not {', '.join(sorted(unknown))}")
        missing = {"irradiance", "depth"} - set(images)
        if missing:
            raise Error(f"render() must also return {' and '.join(sorted(missing))}")
        if self.objects and not {"motion_field", "object"} & set(images):
            raise Error("render() must return motion_field or object, since objects move")

        def checked(name, check, *arguments):
            return check(images[name], f"render() at {t} ns: {name}", *arguments) if name in images else None

        return (
            checked("irradiance", _checks.rendered_irradiance, shape),
            checked("depth", _checks.depth, shape),
            checked("motion_field", _checks.motion_field, (2, *shape)),
            checked("object", _checks.labels, shape, len(self.objects)),
        )


class Report(dict):
    """The results and the cost of a simulation: the content of a recording's `report.json`.

    Attributes
    ----------
    dropped : dict of str to int
        By camera name, the number of events that the readout dropped because its queue was full.
    delayed : dict of str to int
        By camera name, the number of events that waited for the readout.
    notices : list of str
        Warnings and notes.
    """

    @property
    def dropped(self):
        """dict of str to int: by camera name, the number of events that the readout dropped."""
        return {camera["name"]: camera["events_dropped_by_readout"] for camera in self["cameras"]}

    @property
    def delayed(self):
        """dict of str to int: by camera name, the number of events that waited for the readout."""
        return {camera["name"]: camera["events_delayed_by_readout"] for camera in self["cameras"]}

    @property
    def notices(self):
        """list of str: warnings and notes."""
        return self["notices"]


class Running:
    """A simulation that has begun."""

    def __init__(self, core):
        self._core = core
        self._made = []  # a packet, or None at the end, that has not been returned: after a signal
        self._told = 0
        self._warned = len(core.warnings())
        for text in core.warnings():
            warnings.warn(text, stacklevel=3)
        info = core.info()
        self.start, self.end = info["start"], info["end"]
        self.cameras = info["cameras"]
        self.objects = info["objects"]

    def close(self):
        """Ends the simulation at the current time."""
        self._core.close()
        self._warn_of_losses()

    def _warn_of_losses(self):
        """Warns of each loss and of later problems once. Must be called directly from a public method, for `stacklevel`."""
        later = self._core.warnings()[self._warned :]
        self._warned += len(later)
        for text in later:
            warnings.warn(text, stacklevel=3)
        losses = self._core.losses()[self._told :]
        self._told += len(losses)
        for loss in losses:
            warnings.warn(loss, LossWarning, stacklevel=3)

    @property
    def report(self):
        """Report or None: results and cost (`report.json` of recordings); None before the end."""
        text = self._core.report()
        return Report(json.loads(text, object_hook=OldKeys)) if text else None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._core.close()
        self._warn_of_losses()


class Simulation(Running):
    """A running simulation: an iterator over its packets. Made by `simulate`.

    Also a context manager, which ends it: a recording is then finished and marked as interrupted. If events were lost,
    the end raises a `LossWarning`.

    Attributes
    ----------
    start, end : int
        The simulated time, ns.
    cameras : dict of str to dict
        By camera name, `width` and `height` (px), `K` (3, 3, px, without distortion), `T_body_camera` (4, 4) and
        `sensors`: the names of its event sensors, if it has several.
    objects : list of str
        Names of the moving objects, in the order of their numbers.
    """

    def __iter__(self):
        return self

    def __next__(self):
        if not self._made:
            self._core.append_next(self._made)
        if self._made[0] is None:
            self._warn_of_losses()
            raise StopIteration
        packet = Packet(self._made[0], self.cameras)
        del self._made[0]  # Python does not look for signals from here to the return
        return packet

    def run(self):
        """Simulates to the end without returning packets; a recording is written if `out` is given.

        Returns
        -------
        Report
        """
        while self._made != [None]:
            self._made.clear()
            self._core.append_next(self._made)
        self._warn_of_losses()
        return self.report


def simulate(
    scenario,
    *,
    overrides=None,
    threads=0,
    seed=None,
    out=None,
    force=False,
    packet_s=None,
    trajectory=None,
    renderer=None,
    cache=None,
    cache_bytes=10_000_000_000,
):
    """Simulates a scenario.

    Parameters
    ----------
    scenario : path, dict or Scenario
        A YAML file, or its contents as a dict.
    overrides : dict or list of str, optional
        Options to change: `{"event_camera.contrast_threshold": 0.2}`, or `["event_camera.contrast_threshold=0.2"]`.
    threads : int
        Number of threads; 0 uses every processor. The result does not depend on it.
    seed : int, optional
        Seed of all random numbers; overrides the scenario.
    out : path, optional
        Folder to write a recording to, as `esim simulate` does. After an error, the part recorded before it stays in the
        folder `out`.incomplete.
    force : bool
        Replace an existing recording.
    packet_s : float, optional
        Length of packets, s. Default: until the next frame of ground truth, or 1/30 s without ground truth.
    trajectory : Trajectory, optional
        Motion of the body; replaces the scenario's trajectory, which may be missing.
    renderer : Renderer or callable, optional
        Replaces the scenario's renderer, which may be missing.
    cache : path or False, optional
        Folder of the images that Blender or UnrealCV has rendered, so that none is rendered twice. False: no cache. By
        default, scenes that esim opens in Blender have one, in ~/.cache/esim/images.
    cache_bytes : int
        Maximum size of this folder.

    Returns
    -------
    Simulation
        An iterator over packets, which are simulated on demand.

    Raises
    ------
    esim.Error
        For problems of the scenario, with the key and the valid values.
    esim.OutputError
        If the recording cannot be written; the message names the folder with the part recorded before.
    """
    if renderer is not None and not isinstance(renderer, Renderer):
        renderer = Renderer(renderer)
    if renderer is not None and cache:
        raise Error("cache must not be given with renderer: it keeps images of the renderers blender and unrealcv only")
    scenario = to_scenario(scenario)
    seeded = [] if seed is None else [f"seed={_checks.seed(seed)}"]
    values = scenario._read(to_overrides(overrides) + seeded, renderer is None, trajectory is None)
    given = [name for name, part in (("renderer", renderer), ("trajectory", trajectory)) if part is not None]
    origin = "".join(f"# A program replaced the {name}: the entry {name} was not used.\n" for name in given)
    out = "" if out is None else os.fspath(out)
    obstacle = f"a program replaced the {' and the '.join(given)}" if given else ""
    return Simulation(
        _core.Simulation(
            values,
            None if trajectory is None else trajectory._core,
            None if renderer is None else renderer._checked,
            [] if renderer is None else [(name, motion._core) for name, motion in renderer.objects.items()],
            origin,
            _checks.threads(threads),
            _checks.packet_length(packet_s),
            out,
            _checks.flag(force, "force"),
            "" if given else scenario._command(to_overrides(overrides), seed, out),
            obstacle,
            _core.ImageCacheOptions(
                cache is not False,
                "" if cache is None or cache is False else os.fspath(cache),
                _checks.whole(cache_bytes, "cache_bytes", 1, 2**63 - 1),
            ),
        )
    )
