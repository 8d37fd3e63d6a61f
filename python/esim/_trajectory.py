"""Motions of bodies."""

import os

import numpy as np

from . import _checks, _core
from ._errors import Error
from ._types import STATE_DTYPE


def matrices(position, orientation):
    """Homogeneous matrices (..., 4, 4) of positions (..., 3) and unit quaternions x y z w (..., 4)."""
    x, y, z, w = np.moveaxis(orientation, -1, 0)
    T = np.zeros((*x.shape, 4, 4))
    T[..., 0, 0], T[..., 0, 1], T[..., 0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)
    T[..., 1, 0], T[..., 1, 1], T[..., 1, 2] = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
    T[..., 2, 0], T[..., 2, 1], T[..., 2, 2] = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)
    T[..., :3, 3] = position
    T[..., 3, 3] = 1
    return T


class Trajectory:
    """A smooth motion, T_world_body over time. Made by `from_poses` and `load`.

    It is immutable. A pickle contains the original poses, which are fitted again.
    """

    def __init__(self):
        raise TypeError("use Trajectory.from_poses() or Trajectory.load()")

    @classmethod
    def _of(cls, core):
        self = cls.__new__(cls)
        self._core = core
        return self

    @classmethod
    def from_poses(cls, t, poses, *, order=5, knot_interval_s=0.0, smoothing_time_s=0.0):
        """Fits a spline to poses.

        Parameters
        ----------
        t : array_like, shape (N,)
            Times, increasing: floats, s, or numpy.timedelta64 such as esim.ns().
        poses : array_like, shape (N, 4, 4), or a pair of shapes (N, 3) and (N, 4)
            T_world_body: homogeneous matrices, or positions (m) and quaternions (Hamilton, x y z w; any nonzero norm).
            A camera looks along its z axis, x to the right.
        order : int
            Order of the spline, 4 (cubic) to 6.
        knot_interval_s : float
            Time between the spline's control points, s; 0: derived from the data.
        smoothing_time_s : float
            Time constant of the smoothing, which removes faster motion, s; 0: only as much as the spline needs.

        Returns
        -------
        Trajectory

        Raises
        ------
        esim.Error
            For fewer than two poses, times that do not increase, and matrices that are not poses.
        """
        t = _checks.times(t)
        if isinstance(poses, tuple):
            position, orientation = (np.asarray(part, np.float64) for part in poses)
            norm = np.linalg.norm(orientation, axis=-1, keepdims=True)
            with np.errstate(invalid="ignore", divide="ignore"):
                T = matrices(position, orientation / norm)
        else:
            T = np.ascontiguousarray(poses, np.float64)
        if t.ndim != 1 or T.shape != (len(t), 4, 4):
            raise Error(f"t must have shape (N,) and poses (N, 4, 4), not {t.shape} and {T.shape}")
        return cls._of(_core.Trajectory.from_matrices(t, T, *_fit(order, knot_interval_s, smoothing_time_s)))

    @classmethod
    def load(
        cls, path, *, rate_hz=None, scale=1.0, up=None, order=5, knot_interval_s=0.0, smoothing_time_s=0.0
    ):
        """Fits a spline to the poses of a file.

        The file is TUM text, CSV of the original ESIM, a COLMAP model (folder or images file) or a transforms.json.

        Parameters
        ----------
        path : path
        rate_hz : float, optional
            Images per second of a file without times; 30 if it is not given.
        scale : float
            Metres per unit of the file's positions.
        up : sequence of 3 floats, optional
            Direction in the file that becomes the world's z axis; by default, axes are those of the file.
        order, knot_interval_s, smoothing_time_s
            As in `from_poses`.

        Returns
        -------
        Trajectory
        """
        rate_hz = None if rate_hz is None else _checks.number(rate_hz, "rate_hz", above=0)
        scale = _checks.number(scale, "scale", above=0)
        if up is not None:
            up = [_checks.number(value, "up") for value in np.asarray(up).ravel()]
            if len(up) != 3:
                raise Error(f"up must have three numbers, not {len(up)}")
        fit = _fit(order, knot_interval_s, smoothing_time_s)
        return cls._of(_core.Trajectory.from_file(os.fspath(path), rate_hz, scale, up, *fit))

    @property
    def start(self):
        """int: first time, ns."""
        return self._core.start

    @property
    def end(self):
        """int: last time, ns."""
        return self._core.end

    @property
    def fit(self):
        """dict: residuals of the spline fit, and the chosen options."""
        return self._core.fit_report()

    def at(self, t):
        """Evaluates the motion at times.

        Parameters
        ----------
        t : float (s), numpy.timedelta64 such as esim.ns(), or an array of either

        Returns
        -------
        numpy.ndarray of esim.STATE_DTYPE, shaped as t
            Pose, twist and accelerations; gravity is not part of them.

        Raises
        ------
        esim.Error
            For times outside the trajectory.
        """
        times = _checks.times(t)
        states = self._core.states(times.reshape(-1)).view(STATE_DTYPE)
        return states.reshape(times.shape)

    def pose(self, t):
        """Evaluates T_world_body at times, as homogeneous matrices.

        Parameters
        ----------
        t : float (s), numpy.timedelta64 such as esim.ns(), or an array of either

        Returns
        -------
        numpy.ndarray, shape (..., 4, 4)
        """
        states = self.at(t)
        return matrices(states["position"], states["orientation"])

    def __copy__(self):
        return self

    def __deepcopy__(self, _):
        return self

    def __reduce__(self):
        return _restored, (type(self), *self._core.state())

    def __repr__(self):
        return f"<esim.Trajectory from {self.start * 1e-9:g} s to {self.end * 1e-9:g} s>"


def _fit(order, knot_interval_s, smoothing_time_s):
    """The options of a fit; the fit itself checks their range."""
    return (
        _checks.whole(order, "order", 2, 6),
        _checks.seconds(knot_interval_s, "knot_interval_s", low=0),
        _checks.seconds(smoothing_time_s, "smoothing_time_s", low=0),
    )


def _restored(cls, poses, *options):
    return cls._of(_core.Trajectory.from_state(poses, *options))
