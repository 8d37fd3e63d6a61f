"""Simulations, packet by packet."""

import json
import os
import warnings

from . import _checks, _core
from ._errors import Error, LossWarning
from ._events import of_bytes
from ._renamed import OldAttributes, OldKeys, present_name
from ._scenario import to_overrides, to_scenario
from ._types import IMU_DTYPE, LABEL_DTYPE, STATE_DTYPE


class CameraPacket(OldAttributes):
    """The records of one camera in a packet: N frames of ground truth, M frames of the frame camera.

    Attributes
    ----------
    events : esim.Events
    truth_t : int64, shape (N,)
        Times of ground truth, ns.
    pose : float64, shape (N, 4, 4)
        T_world_camera at these times; the camera looks along z, x to the right, y downwards.
    irradiance : float32, shape (N, height, width)
        Linear intensity, 1 = white.
    depth : float32, shape (N, height, width)
        Along the optical axis, m; inf without a surface.
    motion_field : float32, shape (N, 2, height, width)
        Motion field, px/s: to the right, and downwards.
    object : uint16, shape (N, height, width)
        i + 1 for moving object i, 0 for the static scene. N = 0 unless the scenario has `truth.objects`.
    optical_flow : float32, shape (K, 2, height, width)
        Optical flow from a frame to the next, px; NaN if the point has no image there. K = 0 unless the scenario has
        `truth.optical_flow`.
    optical_flow_t : int64, shape (K, 2)
        Times of the two frames, ns.
    visible : uint8, shape (K, height, width)
        1 if the point is also visible in the later frame.
    labels : numpy.ndarray of esim.LABEL_DTYPE, shape (number of events,)
        Why each event fired, and what its pixel saw. Empty unless the scenario has `event_camera.labels`.
    event_points : float32, shape (number of events, 3)
        Scene point of each event, world frame, m; NaN without a surface. Empty unless the scenario has
        `truth.event_points`.
    images : uint8, or uint16 above 8 bits, shape (M, height, width)
        Frames of the frame camera: digital numbers; a Bayer mosaic for colour cameras. A frame belongs to the packet in
        which its exposure ends.
    image_t, exposure_start, exposure : int64, shape (M,)
        Middle of the exposure, its start, and its duration, ns.
    trigger_t, trigger_kind : int64, uint8, shape (number of triggers,)
        Triggers of files: time, ns, and kind, numbered as in AEDAT 4 (1, 2: rising, falling edge of the external
        signal).
    sensors : dict of str to CameraPacket
        By name, the `events`, `labels` and `event_points` of each sensor in `event_cameras`. The camera itself then has
        none of these. Empty for a camera with one `event_camera`.
    """

    __slots__ = (
        "sensors events labels truth_t pose irradiance depth motion_field object optical_flow optical_flow_t visible event_points "
        "images image_t exposure_start exposure trigger_t trigger_kind"
    ).split()

    _renamed = {"flow": "motion_field", "displacement": "optical_flow", "displacement_t": "optical_flow_t"}

    _OF_SENSORS = ("events", "labels", "event_points")

    def __init__(self, parts, width, height):
        self.sensors = {name: CameraPacket(sensor, width, height) for name, sensor in parts["sensors"].items()}
        if not self.sensors:
            self.events = of_bytes(parts["events"], width, height)
            self.labels = parts["labels"].view(LABEL_DTYPE)
            self.event_points = parts["event_points"]
        self.truth_t = parts["t"]
        self.optical_flow_t = parts["optical_flow_span"]
        for name in self.__slots__:
            if name in parts and name not in ("sensors", *self._OF_SENSORS):
                setattr(self, name, parts[name])

    def _miss(self, name):
        if name in self._OF_SENSORS:
            raise Error(f"the camera has several event sensors: use sensors[name].{name}, "
                        f"with name one of {list(self.sensors)}")
        super()._miss(name)

    def _count(self):
        """The number of events of all sensors."""
        return sum(len(sensor.events) for sensor in self.sensors.values()) if self.sensors else len(self.events)


class Packet:
    """The records of the time t0 < t <= t1; the first packet includes t0. Arrays own their memory.

    The first packet begins at the start, every other packet where the previous one ends, and the last one ends at the
    end.

    With one camera, its records are attributes of the packet: `packet.events`. With several cameras, write
    `packet["name"].events`. The events of several sensors behind one lens are `packet.sensors["name"].events`.

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
        Empty without an IMU.
    """

    def __init__(self, parts, cameras):
        self.t0, self.t1 = parts["t0"], parts["t1"]
        self.cameras = {
            name: CameraPacket(camera, cameras[name]["width"], cameras[name]["height"])
            for name, camera in parts["cameras"].items()
        }
        self.body = parts["body"].view(STATE_DTYPE)
        self.objects = parts["objects"]
        self.imu = parts["imu"].view(IMU_DTYPE)

    def __getitem__(self, name):
        return self.cameras[name]

    def __getattr__(self, name):
        name = present_name(name, CameraPacket._renamed)
        if name not in CameraPacket.__slots__:
            raise AttributeError(f"a packet has no attribute {name}")
        if len(self.cameras) > 1:
            raise Error(f"the packet has several cameras: use packet[name].{name}, with name one of {list(self.cameras)}")
        (camera,) = self.cameras.values()
        return getattr(camera, name)

    def __dir__(self):
        return [*super().__dir__(), *CameraPacket.__slots__]

    def __repr__(self):
        events = sum(camera._count() for camera in self.cameras.values())
        return f"<esim.Packet from {self.t0 * 1e-9:g} s to {self.t1 * 1e-9:g} s, {events} events>"


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


class _Running:
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


class Simulation(_Running):
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


class LiveSimulation(_Running):
    """A simulation whose body moves as a program says, step by step. Made by `simulate_live`.

    Also a context manager, which ends it, as a `Simulation`.

    Attributes
    ----------
    start, end, cameras, objects
        As of `Simulation`.
    pose_t : int
        The time of the next pose, ns. Before the first one, the body rests for `latency`.
    latency : int
        The motion is known up to this time before the last pose, ns: one interval, or two if `smooth`. Events are known
        up to a sample later: less than 1 / `min_rate_hz` of the scenario's sampling.
    """

    def __init__(self, core, interval, latency):
        super().__init__(core)
        self._interval = interval
        self._packets = []  # that have not been returned: after a signal
        self.latency = latency
        self.pose_t = self.start + latency + interval

    def _moved(self, poses):
        """Counts poses that the body has taken. Returns the time of the last one, ns."""
        self.pose_t += poses * self._interval
        return self.pose_t - self._interval

    def step(self, T_world_body):
        """Moves the body to its pose at `pose_t`, and simulates up to `latency` before it.

        Parameters
        ----------
        T_world_body : array_like, shape (4, 4)

        Returns
        -------
        list of Packet
            The packets that are complete by now: none, one, or several. After the end of the simulation, the last ones.

        Raises
        ------
        esim.Error
            If the pose is not a rigid motion, or rotated by 180 degrees or more from the last one: the body then stays
            where it is. After the end.
        """
        self._core.push(_checks.pose(T_world_body, "T_world_body"))
        self._moved(1)
        while True:
            self._core.append_next(self._made)
            made = self._made.pop()
            if made is None:
                break
            self._packets.append(Packet(made, self.cameras))
        self._warn_of_losses()
        packets, self._packets = self._packets, []
        return packets


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


def simulate_live(
    scenario,
    T_world_body,
    *,
    interval_s=0.005,
    smooth=False,
    overrides=None,
    threads=0,
    seed=None,
    out=None,
    force=False,
    packet_s=None,
):
    """Begins a simulation whose body moves as a program says: a robot, an agent, a person with a controller.

    The motion is a spline that passes near the poses: it misses them by about interval_s^2 / 6 times the acceleration.

    Parameters
    ----------
    scenario : path, dict or Scenario
        A YAML file, or its contents as a dict, with `duration_s`. Its trajectory is not used, and may be missing.
    T_world_body : array_like, shape (4, 4)
        The pose at the start.
    interval_s : float
        Time between two poses, s.
    smooth : bool
        Poses become a spline of order 6 instead of 4, whose acceleration is smooth, for an IMU. Adds an interval of latency.
    overrides, threads, seed, out, force
        As of `simulate`.
    packet_s : float, optional
        Length of packets, s. Default: interval_s.

    Returns
    -------
    LiveSimulation
        Its `step` takes the poses, and returns packets.

    Raises
    ------
    esim.Error
        For problems of the scenario or the pose, with the key and the valid values.
    """
    return begin_live(
        scenario,
        T_world_body,
        interval_s=interval_s,
        smooth=smooth,
        overrides=overrides,
        threads=threads,
        seed=seed,
        out=out,
        force=force,
        packet_s=packet_s,
    )


def begin_live(
    scenario, T_world_body, *, interval_s, smooth=False, overrides=None, threads=0, seed=None, out=None, force=False, packet_s=None,
    scene=None,
):
    """simulate_live() with the shared scene of a scenario with the same renderer and cameras, if it is given."""
    interval_s = _checks.number(interval_s, "interval_s", low=1e-6, high=10)
    scenario = to_scenario(scenario)
    seeded = [] if seed is None else [f"seed={_checks.seed(seed)}"]
    values = scenario._read(to_overrides(overrides) + seeded, True, False)
    interval = round(interval_s * 1e9)
    order = 6 if _checks.flag(smooth, "smooth") else 4
    core = _core.Simulation.live(
        values,
        _checks.pose(T_world_body, "T_world_body"),
        interval,
        order,
        "# A program moved the body: the entry trajectory was not used.\n",
        _checks.threads(threads),
        _checks.packet_length(interval_s if packet_s is None else packet_s),
        "" if out is None else os.fspath(out),
        _checks.flag(force, "force"),
        "a program moved the body",
        scene,
    )
    return LiveSimulation(core, interval, (order // 2 - 1) * interval)
