"""The packets of simulations and recordings."""

from .._errors import Error
from .._events import of_bytes
from .._renamed import OldAttributes, present_name
from .._types import IMU_DTYPE, LABEL_DTYPE, STATE_DTYPE


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
