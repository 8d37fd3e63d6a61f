"""Recordings from files in all formats of esim."""

import os
import warnings

from . import _checks, _core
from ._simulation import Packet


class Recording:
    """Iterates over the packets of a recording in a file or folder, as `simulate` does. The memory use does not depend
    on the length of the recording.

    Parameters
    ----------
    path : path
        Of any readable format in `esim.formats()`.
    packet_s : float, optional
        Length of packets, s. Default: until the next frame of ground truth if the recording is a folder with ground
        truth, otherwise 1/30 s.
    width, height : int, optional
        Size of the sensor, px; overrides the file.
    recover : bool
        Read the readable part of a damaged file, with a warning.

    Yields
    ------
    Packet

    Raises
    ------
    esim.Error
        For damaged files, with file and position.
    """

    def __init__(self, path, packet_s=None, *, width=None, height=None, recover=False):
        self._core = _core.RecordingReader(
            os.fspath(path),
            _checks.packet_length(packet_s),
            *_checks.optional_sensor_size(width, height),
            _checks.flag(recover, "recover"),
        )
        self._cameras = self.info["cameras"]
        self._warned = 0

    @property
    def info(self):
        """dict: `start` and `end` (ns; equal if the end is not known in advance), `cameras`: a dict by name with width,
        height, K, T_body_camera and sensors, and `objects`: the names of moving objects."""
        return self._core.info()

    def __iter__(self):
        return self

    def __next__(self):
        parts = self._core.next()
        for problem in self._core.problems()[self._warned :]:
            self._warned += 1
            warnings.warn(problem, stacklevel=2)
        if parts is None:
            raise StopIteration
        return Packet(parts, self._cameras)


def convert(
    source, target, *, format=None, camera=None, from_zero=False, time_unit="us", recover=False, force=False
):
    """Converts a recording or an event file to another format.

    Parameters
    ----------
    source, target : path
    format : str, optional
        A name from `esim.formats()`. Default: by the extension of the target; without extension, a recording folder.
    camera : str, optional
        Convert this camera only.
    from_zero : bool
        Write times relative to the start of the recording.
    time_unit : str
        "us" or "ns": unit of event times, if the format allows a choice.
    recover : bool
        Convert the readable part of a damaged file, with a warning.
    force : bool
        Replace an existing target.

    Returns
    -------
    dict of str to int
        Number of copied events, frames, .... Contents that the format does not support are reported as warnings.

    Raises
    ------
    esim.Error, esim.OutputError
    """
    copied, lost = _core.convert(
        os.fspath(source),
        os.fspath(target),
        format,
        camera or "",
        _checks.flag(from_zero, "from_zero"),
        _checks.one_of(time_unit, "time_unit", ("us", "ns")) == "ns",
        _checks.flag(recover, "recover"),
        _checks.flag(force, "force"),
    )
    for loss in lost:
        warnings.warn(loss, stacklevel=2)
    return copied
