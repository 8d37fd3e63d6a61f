"""Simulations, packet by packet."""

import json
import os
import warnings

import numpy as np

from . import _core
from ._errors import Error
from ._scenario import to_overrides, to_scenario
from ._types import EVENT_DTYPE, IMU_DTYPE, STATE_DTYPE, to_ns


class CameraPacket:
    """What one camera recorded in a packet's time. N frames of ground truth, M frames of the frame camera.

    Attributes
    ----------
    events : numpy.ndarray of esim.EVENT_DTYPE
    truth_t : int64, shape (N,)
        Times of ground truth, ns.
    pose : float64, shape (N, 4, 4)
        T_world_camera at these times; the camera looks along z, x to the right, y downwards.
    irradiance : float32, shape (N, height, width)
        Linear light, 1 = white.
    depth : float32, shape (N, height, width)
        Along the optical axis, m; inf where nothing is seen.
    flow : float32, shape (N, 2, height, width)
        Motion field, px/s: to the right, and downwards.
    object : uint16, shape (N, height, width)
        0, or i + 1 where moving object i is seen; N = 0 unless the scenario has `truth.objects`.
    displacement : float32, shape (K, 2, height, width)
        From a frame to the next, px; NaN where there is no image of it. K = 0 unless the scenario has
        `truth.displacement`.
    displacement_t : int64, shape (K, 2)
        Times of the two frames, ns.
    visible : uint8, shape (K, height, width)
        1 where what is seen is seen in the later frame as well.
    event_points : float32, shape (number of events, 3)
        Point of the scene that each event saw, world frame, m; NaN: none. Empty unless the scenario has
        `truth.event_points`.
    images : uint8, or uint16 above 8 bits, shape (M, height, width)
        Of the frame camera: digital numbers, a Bayer mosaic where it sees colour. A frame belongs to the packet in which
        its exposure ends.
    image_t, exposure_start, exposure : int64, shape (M,)
        Middle of the exposure, its start, and its duration, ns.
    trigger_t, trigger_kind : int64, uint8, shape (number of triggers,)
        Of files that hold triggers: when, ns, and what, numbered as in AEDAT 4 (1, 2: rising, falling edge of the
        external signal).
    """

    __slots__ = (
        "events truth_t pose irradiance depth flow object displacement displacement_t visible event_points "
        "images image_t exposure_start exposure trigger_t trigger_kind"
    ).split()

    def __init__(self, parts):
        self.events = parts["events"].view(EVENT_DTYPE)
        self.truth_t = parts["t"]
        self.displacement_t = parts["displacement_span"]
        for name in self.__slots__:
            if name in parts and name != "events":
                setattr(self, name, parts[name])


class Packet:
    """What happened after `t0`, until `t1`; the first packet includes t0. Arrays own their memory.

    What a camera recorded is an attribute of the packet itself where there is one camera: `packet.events`; with several
    it is that of `packet["name"].events`.

    Attributes
    ----------
    t0, t1 : int
        ns.
    cameras : dict of str to CameraPacket
    body : numpy.ndarray of esim.STATE_DTYPE
        Motion of the body at `truth.pose_rate_hz`.
    objects : float64, shape (len(body), number of moving objects, 4, 4)
        T_world_object at the times of body.
    imu : numpy.ndarray of esim.IMU_DTYPE
        Empty where there is no IMU.
    """

    def __init__(self, parts):
        self.t0, self.t1 = parts["t0"], parts["t1"]
        self.cameras = {name: CameraPacket(camera) for name, camera in parts["cameras"].items()}
        self.body = parts["body"].view(STATE_DTYPE)
        self.objects = parts["objects"]
        self.imu = parts["imu"].view(IMU_DTYPE)

    def __getitem__(self, name):
        return self.cameras[name]

    def __getattr__(self, name):
        if name not in CameraPacket.__slots__:
            raise AttributeError(f"a packet has no {name}")
        if len(self.cameras) > 1:
            raise Error(f"there are several cameras: take packet[name].{name}, with name one of {list(self.cameras)}")
        (camera,) = self.cameras.values()
        return getattr(camera, name)

    def __dir__(self):
        return [*super().__dir__(), *CameraPacket.__slots__]

    def __repr__(self):
        events = sum(len(camera.events) for camera in self.cameras.values())
        return f"<esim.Packet from {self.t0 * 1e-9:g} s to {self.t1 * 1e-9:g} s, {events} events>"


class Renderer:
    """What simulate() renders with instead of the scenario's renderer.

    Parameters
    ----------
    render : callable
        `render(t, T_world_camera, T_world_objects)` with t in ns, a matrix (4, 4), and a list of one for each object.
        Returns a dict of arrays of the camera's size:

        - `irradiance`, (height, width): linear light, 1 = white;
        - `depth`, (height, width): along the optical axis, m; inf where nothing is seen;
        - `flow`, (2, height, width), optional: the motion field, px/s. Without, it is computed from depth and motion;
        - `object`, (height, width) ints, where objects move and flow is not given: 0, or i + 1 where object i is seen.

        The same arguments must give the same images.
    objects : dict of str to Trajectory, optional
        What moves, by name: T_world_object.
    """

    def __init__(self, render, *, objects=None):
        if not callable(render):
            raise TypeError("render is a function of t, T_world_camera and T_world_objects")
        self.render = render
        self.objects = dict(objects or {})

    def _checked(self, t, T_world_camera, T_world_objects, shape):
        images = self.render(t, T_world_camera, T_world_objects)
        if not isinstance(images, dict):
            raise TypeError(f"render() gives a dict of images, not a {type(images).__name__}")
        unknown = set(images) - {"irradiance", "depth", "flow", "object"}
        if unknown:
            raise Error(f"render() gives irradiance, depth, flow and object, not {', '.join(sorted(unknown))}")
        irradiance = _image(images, "irradiance", shape)
        depth = _image(images, "depth", shape)
        if not (depth > 0).all():
            raise Error(f"render() at {t} ns: depth is above 0 everywhere; inf where nothing is seen")
        flow = _image(images, "flow", (2, *shape)) if "flow" in images else None
        seen = _image(images, "object", shape, np.uint16) if "object" in images else None
        if self.objects and flow is None and seen is None:
            raise Error("render() gives neither flow nor object: which pixels see what moves?")
        if seen is not None and seen.max() > len(self.objects):
            raise Error(f"render() at {t} ns: object {seen.max()} of {len(self.objects)}; 0 stands for none")
        return irradiance, depth, flow, seen


def _image(images, name, shape, dtype=np.float32):
    if name not in images:
        raise Error(f"render() gives no {name}")
    image = np.asarray(images[name])
    if image.shape != shape:
        raise Error(f"render() gives {name} of shape {image.shape}, but the camera's is {shape}")
    return np.ascontiguousarray(image, dtype)


class Simulation:
    """A simulation under way: an iterator over its packets. Made by `simulate`.

    Also a context manager, which ends it: a recording that is being written is then finished as an interrupted one.

    Attributes
    ----------
    start, end : int
        Of the time that is simulated, ns.
    cameras : dict of str to dict
        Of each camera `width` and `height` (px), `K` (3, 3, px, without distortion) and `T_body_camera` (4, 4).
    objects : list of str
        Names of what moves, in the order of its numbers.
    """

    def __init__(self, core):
        self._core = core
        for text in core.warnings():
            warnings.warn(text, stacklevel=3)
        info = core.info()
        self.start, self.end = info["start"], info["end"]
        self.cameras = info["cameras"]
        self.objects = info["objects"]

    def __iter__(self):
        return self

    def __next__(self):
        parts = self._core.next()
        if parts is None:
            raise StopIteration
        return Packet(parts)

    def run(self):
        """Simulates to the end, keeping nothing but the recording that is being written.

        Returns
        -------
        dict
            The report.
        """
        for _ in self:
            pass
        return self.report

    def close(self):
        """Ends the simulation where it is."""
        self._core.close()

    @property
    def report(self):
        """dict or None: what was done, and at which cost (`report.json` of recordings); None before the end."""
        text = self._core.report()
        return json.loads(text) if text else None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


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
):
    """Simulates a scenario.

    Parameters
    ----------
    scenario : path, dict or Scenario
        A YAML file, or the same as a dict.
    overrides : dict or list of str, optional
        Options to change: `{"event_camera.contrast_threshold": 0.2}`, or `["event_camera.contrast_threshold=0.2"]`.
    threads : int
        0 takes every processor. The result does not depend on it.
    seed : int, optional
        Of all random numbers, in place of the scenario's.
    out : path, optional
        Folder to write a recording to, as `esim simulate` does. After an error on the way, what was recorded before it
        stays in the folder `out`.incomplete.
    force : bool
        Replace an earlier recording there.
    packet_s : int or float, optional
        Length of packets (int ns, float s). Otherwise each lasts until the next frame of ground truth, or 1/30 s where
        the scenario has none.
    trajectory : Trajectory, optional
        Of the body, in place of the scenario's, which need not have one.
    renderer : Renderer or callable, optional
        In place of the scenario's, which need not have one.

    Returns
    -------
    Simulation
        An iterator over packets. Nothing is simulated before they are asked for.

    Raises
    ------
    esim.Error
        Naming what is wrong in the scenario and what would be right.
    esim.OutputError
        If the recording cannot be written; the message says where what was recorded before is kept.
    """
    if renderer is not None and not isinstance(renderer, Renderer):
        renderer = Renderer(renderer)
    values = to_scenario(scenario)._read(to_overrides(overrides), renderer is None, trajectory is None)
    if seed is not None:
        values.seed = seed
    given = [name for name, part in (("renderer", renderer), ("trajectory", trajectory)) if part is not None]
    origin = "".join(f"# The {name} was given by a program: what stands under {name} was not used.\n" for name in given)
    packet = 0 if packet_s is None else to_ns(packet_s)
    if packet_s is not None and packet <= 0:
        raise ValueError("packet_s is above 0")
    return Simulation(
        _core.Simulation(
            values,
            None if trajectory is None else trajectory._core,
            None if renderer is None else renderer._checked,
            [] if renderer is None else [(name, motion._core) for name, motion in renderer.objects.items()],
            origin,
            threads,
            packet,
            "" if out is None else os.fspath(out),
            force,
        )
    )
