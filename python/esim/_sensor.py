"""An event camera for the frames of another simulator."""

import warnings

import numpy as np

from . import _checks, _core
from ._errors import Error, LossWarning
from ._events import of_bytes
from ._scenario import to_overrides

# From x right, y down, z forward to the axes of a camera's frame.
_FROM_OPENCV = {
    "opencv": np.eye(4),
    "opengl": np.diag([1.0, -1, -1, 1]),
    "ros": np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]]),
}
_FROM_OPENCV["unreal"] = _FROM_OPENCV["ros"]
_MIRROR_Y = np.diag([1.0, -1, 1, 1])


class Sensor:
    """An event camera for frames with depth and poses, as other simulators give them. Between two frames, it moves their
    pixels along the motion of the camera and of the objects, instead of interpolating brightness (`EventCamera`).

    Parameters
    ----------
    camera : dict
        Size and lens, as `camera` in a scenario: `{"width": 346, "height": 260, "horizontal_fov_deg": 75}`.
    preset : str, optional
        Sensor that gives the default values: "ideal", "davis346", ... (`docs/pixel.md`).
    axes : str
        Axes of the camera's frame in `pose`: "opencv" (x right, y down, z forward), "opengl" (x right, y up, looks
        along -z; also USD and Blender), "ros" (x forward, y left, z up), or "unreal" (x forward, y right, z up; left-handed,
        also the world).
    supersampling : int
        Pixels of a frame per pixel of the sensor, along each side: 2 to 4 give sharper events than 1.
    margin_px : int
        Border of frames around the sensor's image, in its pixels: what comes into view is then already known.
    lambda_px : float, optional
        Motion between two images that are made between frames, in pixels of the sensor; brightness is interpolated linearly
        there. Default: one pixel of the frames, but at most 0.5.
    seed, threads, **options
        As for `EventCamera`.

    Raises
    ------
    esim.Error
        For unknown options and values out of range.
    """

    def __init__(
        self,
        camera,
        preset=None,
        *,
        axes="opencv",
        supersampling=1,
        margin_px=0,
        lambda_px=None,
        seed=0,
        threads=0,
        **options,
    ):
        if not isinstance(camera, dict):
            raise TypeError(f'camera must be a dict such as {{"width": 346, "height": 260}}, not a {type(camera).__name__}')
        if preset is not None:
            options = {"preset": preset, **options}
        self._axes = _checks.one_of(axes, "axes", tuple(_FROM_OPENCV))
        supersampling = _checks.whole(supersampling, "supersampling", 1, 8)
        if lambda_px is None:
            lambda_px = min(0.5, 1 / supersampling)
        self._core = _core.Sensor(
            to_overrides({f"camera.{key}": value for key, value in camera.items()}),
            supersampling,
            _checks.whole(margin_px, "margin_px", 0, 1000),
            _checks.number(lambda_px, "lambda_px", low=0.01, high=100),
            to_overrides({f"event_camera.{key}": value for key, value in options.items()}),
            _checks.seed(seed),
            _checks.threads(threads),
        )
        width, height, self.margin_px = self._core.layout()
        self.frame_shape = (height, width)
        self._objects = {}  # of the caller's ids: their numbers from 1 on
        self._last_poses = []
        self._mode = None
        self._warned = False

    def step(self, t, irradiance, depth, pose=None, *, motion=None, objects=None, object_poses=None):
        """Takes the next frame, and returns the events since the previous one; none for the first.

        All images have the shape `frame_shape`. Objects that move need either `motion`, or `objects` and `object_poses`; what
        moves must be rigid.

        Parameters
        ----------
        t : float, or numpy.timedelta64 such as esim.ns()
            Time of the frame, s; later than the previous one.
        irradiance : numpy.ndarray of floats
            Linear intensity, at least 0, 1 = white. Convert 8-bit images with `esim.linear_light`.
        depth : numpy.ndarray of floats
            Distance along the optical axis, m; 0 or inf where there is no surface.
        pose : array, shape (4, 4), optional
            T_world_camera, m, with the axes named in the constructor; default: the camera rests.
        motion : numpy.ndarray, shape (2, *frame_shape), optional
            Motion vectors: from where the surface point in a pixel was in the previous frame to the pixel, px of this frame
            to the right and downwards. NaN where it is not known. Ignored in the first frame.
        objects : numpy.ndarray of ints, optional
            Id of the object in each pixel. Ids without a pose, and with `motion` the id 0, belong to the static scene.
        object_poses : dict, optional
            T_world_object, shape (4, 4), by id.

        Returns
        -------
        esim.Events, shape (N,)
            In order of time.

        Raises
        ------
        esim.Error
            For images of another size, values out of range, and times out of order. The state of the sensor does not change.
        """
        if object_poses is not None and objects is None:
            raise Error("object_poses need objects: the id of the object in each pixel")
        if objects is not None and object_poses is None and motion is None:
            raise Error("objects need object_poses or motion, from which their motion is known")
        if motion is not None and object_poses is not None:
            raise Error("motion and object_poses are both given; give the one that is more exact, usually object_poses")
        shape = self.frame_shape
        time = _checks.time(t)
        irradiance = _checks.rendered_irradiance(irradiance, "irradiance", shape)
        depth = np.asarray(depth)
        depth = _checks.depth(np.where(depth == 0, depth.dtype.type(np.inf), depth) if depth.dtype.kind == "f" else depth, "depth", shape)
        pose = np.eye(4) if pose is None else self._to_opencv(_checks.pose(pose, "pose"))
        if motion is not None:
            motion = _checks.motion_field(motion, "motion", (2, *shape))
        poses, ids = [], None
        if object_poses is not None:
            ids, poses = self._numbered(objects, object_poses)
        elif objects is not None:
            ids = self._renumbered(objects)
        events = self._core.step(time, irradiance, depth, pose[None], motion, ids, np.array(poses).reshape(-1, 4, 4))
        self._last_poses = poses
        self._warn(motion is not None)
        return of_bytes(events, *self._core.size())

    @property
    def statistics(self):
        """dict: number of `frames` and of `reconstructions` between them; `unseen`: fraction of the pixels between frames
        that neither frame sees; `disagreement`: difference of ln E, halfway between the latest two frames, between what
        they say (99.8 % of blocks of 8 x 8 pixels), a measure of the error; with motion vectors also, of the latest frame, the number of
        `objects` that move, and the fractions of its pixels that are `moving` and `not_rigid`."""
        return self._core.statistics()

    def _to_opencv(self, pose):
        if self._axes == "unreal":
            pose = _MIRROR_Y @ pose @ _MIRROR_Y
        return pose @ _FROM_OPENCV[self._axes]

    def _ids(self, objects):
        ids = np.asarray(objects)
        if ids.dtype.kind not in "iu":
            raise TypeError(f"objects must be ints, not {ids.dtype}")
        if ids.shape != self.frame_shape:
            raise Error(f"objects must have the shape of frames, {self.frame_shape}, not {ids.shape}")
        return ids

    def _number(self, key):
        return self._objects.setdefault(key, len(self._objects) + 1)

    def _numbered(self, objects, object_poses):
        """Numbers instead of ids, and the poses by number. Objects that this frame does not name keep their pose."""
        ids = self._ids(objects)
        numbers = np.zeros(ids.shape, np.uint16)
        poses = list(self._last_poses)
        for key, pose in object_poses.items():
            matrix = _checks.pose(pose, f"object_poses[{key!r}]")
            number = self._number(int(key))
            if number > 65535:
                raise Error("there are more than 65535 objects")
            if self._axes == "unreal":
                matrix = _MIRROR_Y @ matrix @ _MIRROR_Y
            poses[number - 1 : number] = [matrix]
            numbers[ids == key] = number
        return numbers, poses

    def _renumbered(self, objects):
        """Numbers from 1 on for the ids of a frame other than 0."""
        keys, numbers = np.unique(self._ids(objects), return_inverse=True)
        if len(keys) > 65535:
            raise Error(f"objects has {len(keys)} different ids, more than 65535")
        count = np.zeros(len(keys), np.uint16)
        count[keys != 0] = np.arange(1, np.count_nonzero(keys) + 1)
        return count[numbers].reshape(self.frame_shape)

    def _warn(self, has_motion):
        """Warns once of frames that contradict each other."""
        statistics = self._core.statistics()
        if self._warned or statistics["frames"] < 2:
            return
        moving, unseen = statistics["moving"], statistics["unseen"]
        if has_motion and moving > 0.5:
            text = (
                f"the motion vectors contradict pose and depth in {moving:.0%} of the pixels: check their sign, their unit "
                "(px), and the axes of the pose"
            )
        elif unseen > 0.3:
            text = (
                f"neither frame sees {unseen:.0%} of the pixels between two frames, so that their brightness is guessed: check "
                "the axes of the pose and the meaning of depth, or give frames more often"
            )
        else:
            return
        self._warned = True
        warnings.warn(text, LossWarning, stacklevel=3)

    def __repr__(self):
        width, height = self._core.size()
        frame_height, frame_width = self.frame_shape
        return f"<esim.Sensor {width} x {height} px, frames of {frame_width} x {frame_height} px>"
