"""Recordings from files, of every format that esim knows."""

import os
import warnings

from . import _checks, _core
from ._simulate import Packet


class Recording:
    """A recording from a file or folder, packet by packet, as `simulate` gives them; memory does not grow with it.

    Parameters
    ----------
    path : path
        Of any format in `esim.formats()` that is read.
    packet_s : float, optional
        Length of packets, s. Otherwise as of a simulation: each lasts until the next frame of ground truth where the
        recording is a folder that has some, and 1/30 s elsewhere.
    width, height : int, optional
        Of the sensor, in place of what the file says.
    recover : bool
        Read what can be read of a damaged file, and warn.

    Yields
    ------
    Packet

    Raises
    ------
    esim.Error
        Naming file and place, for damaged ones.
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
        """dict: `start` and `end` (ns; the end is the start where it is not known beforehand), `cameras`: a dict by
        name with width, height, K and T_body_camera, and names of moving `objects`."""
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
    """Copies a recording or a file of events into another format.

    Parameters
    ----------
    source, target : path
    format : str, optional
        A name from `esim.formats()`; by the extension of the target otherwise, where none is a folder.
    camera : str, optional
        This one only.
    from_zero : bool
        Times count from the start of the recording.
    time_unit : str
        "us" or "ns": of the times of events, where the format leaves the choice.
    recover : bool
        Convert what can be read of a damaged file, and warn.
    force : bool
        Replace what is there.

    Returns
    -------
    dict of str to int
        What was copied: events, frames, ...: how many. What the format does not hold is a warning.

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
