"""Labelled sequences for learning, simulated on demand. The command `esim dataset` writes them to disk."""

import json
import operator
import os

from . import _checks, _core
from ._events import of_bytes
from ._renamed import OldAttributes, OldKeys, old_arguments
from ._represent import event_tensor, voxel_grid
from ._scenario import to_overrides

__all__ = ["AffineSequence", "AffineSequences"]


class AffineSequence(OldAttributes):
    """A sequence with its labels. All values except the tensors are exact.

    Attributes
    ----------
    index : int
    duration : int
        ns; it begins at 0.
    events : esim.Events
    motion_field : numpy.ndarray, float32, shape (2, height, width)
        Motion field, px/s, to the right and downwards, at the time `motion_field_t` (ns).
    optical_flow : numpy.ndarray, float32, shape (2, height, width)
        Optical flow of each pixel from the start to the end, px, also to points outside the image.
    images : numpy.ndarray, float32, shape (2, height, width)
        Irradiance at the start and at the end: linear intensity, 1 = white.
    info : dict
        The random values: image, contrast_threshold, optical_flow_rms_px, and the motion as the pivot and poses of a
        sprite (`docs/sprites.md`).
    """

    __slots__ = ("index", "duration", "events", "motion_field", "motion_field_t", "optical_flow", "images", "info")

    _renamed = {"flow": "motion_field", "flow_t": "motion_field_t", "displacement": "optical_flow"}

    def __init__(self, index, made):
        events, self.duration, self.motion_field_t, self.motion_field, self.optical_flow, self.images, info = made
        self.index = index
        self.events = of_bytes(events, *self.motion_field.shape[:0:-1])
        self.info = json.loads(info, object_hook=OldKeys)

    def tensor(self, stamp="last"):
        """Computes the four channels of EV-FlowNet from all events: `esim.event_tensor`.

        Parameters
        ----------
        stamp : {"last", "mean"}

        Returns
        -------
        numpy.ndarray, float32, shape (4, height, width)
        """
        return event_tensor(self.events, t0=0, t1=_checks.ns(self.duration), stamp=stamp)

    def voxels(self, bins=5, normalise=False):
        """Computes `esim.voxel_grid` from all events.

        Parameters
        ----------
        bins : int
        normalise : bool

        Returns
        -------
        numpy.ndarray, float32, shape (bins, height, width)
        """
        return voxel_grid(self.events, bins=bins, t0=0, t1=_checks.ns(self.duration), normalise=normalise)


class AffineSequences:
    """Random affine motions of images over the sensor: `sequences[i]` is the i-th, for any i from 0 to 2**32 - 1.

    A sequence depends only on these options and its index. Several threads may make sequences at the same time.

    Parameters
    ----------
    images : path, optional
        Folder of images, including subfolders. Default: generated dead-leaves textures.
    width, height : int
        Size of the sensor, px.
    duration : float, or numpy.timedelta64
        Duration of a sequence, s.
    seed : int
    contrast_threshold : float or (float, float)
        Range of the random threshold of each sequence.
    flow_histogram : path, optional
        Histogram of optical flow over the duration: lines "LOW HIGH WEIGHT", px. Default: MPI Sintel's.
    flow_scale : float
        Factor on the magnitudes of the histogram.
    motion_field_at : {"start", "middle", "end"}
        Time of `motion_field`.
    event_camera : dict, optional
        Additional options of `event_camera` in a scenario: {"threshold_mismatch": 0.03}.

    Raises
    ------
    esim.Error
        For invalid options, and if there is no usable image.
    """

    @old_arguments(flow_at="motion_field_at")
    def __init__(
        self,
        images=None,
        *,
        width=240,
        height=180,
        duration=0.04,
        seed=1,
        contrast_threshold=(0.2, 0.5),
        flow_histogram=None,
        flow_scale=1.0,
        motion_field_at="middle",
        event_camera=None,
    ):
        low, high = contrast_threshold if isinstance(contrast_threshold, (tuple, list)) else (contrast_threshold,) * 2
        named = {f"event_camera.{key}": value for key, value in (event_camera or {}).items()}
        self._core = _core.AffineSequences(
            "" if images is None else os.fspath(images),
            *_checks.sensor_size(width, height),
            _checks.time(duration, "duration") / 1e9,
            _checks.seed(seed),
            _checks.number(low, "contrast_threshold"),
            _checks.number(high, "contrast_threshold"),
            "" if flow_histogram is None else os.fspath(flow_histogram),
            _checks.number(flow_scale, "flow_scale"),
            motion_field_at,
            to_overrides(named),
        )

    def __getitem__(self, index):
        """Makes the sequence with this index.

        Parameters
        ----------
        index : int

        Returns
        -------
        AffineSequence
        """
        index = operator.index(index)
        if not 0 <= index < 2**32:
            raise IndexError(f"index must be between 0 and 2**32 - 1, not {index}")
        return AffineSequence(index, self._core.make(index))
