"""Event files in all formats of esim."""

import os

from . import _checks, _core
from ._errors import Error
from ._events import as_bytes, of_bytes, size_of

_ALL = (1 << 63) - 1


class EventsIterator:
    """Iterates over the events of a file in portions. The memory use does not depend on the length of the file.

    Parameters
    ----------
    path : path
        A file of any readable format in `esim.formats()`, a recording of one camera, or a camera's folder.
    delta_t : float, or numpy.timedelta64 such as esim.ns(), optional
        Duration of portions, s: [start + k delta_t, start + (k + 1) delta_t), including empty ones.
    n_events : int, optional
        Number of events per portion; the last may have fewer. Without delta_t and n_events, portions have any size.
    start : float, or numpy.timedelta64 such as esim.ns(), optional
        Start of the first portion, s; earlier events are skipped. Default: the time of the first event.
    width, height : int, optional
        Size of the sensor, px; overrides the file.

    Yields
    ------
    esim.Events, shape (N,)

    Raises
    ------
    esim.Error
        For damaged files, with file and position.
    """

    def __init__(self, path, delta_t=None, n_events=None, *, start=None, width=None, height=None):
        if delta_t is not None and n_events is not None:
            raise Error("delta_t and n_events must not both be given")
        if start is not None and delta_t is None:
            raise Error("start needs delta_t")
        self._delta_t = None if delta_t is None else _checks.time(delta_t, "delta_t")
        if self._delta_t is not None and self._delta_t <= 0:
            raise Error("delta_t must be above 0")
        self._count = 1 << 17 if n_events is None else _checks.whole(n_events, "n_events", 1, _ALL)
        self._start = None if start is None else _checks.time(start, "start")
        self._core = _core.EventReader(os.fspath(path), *_checks.optional_sensor_size(width, height))
        self._size = self._core.sensor() or (None, None)

    @property
    def size(self):
        """(int, int) or None: width and height of the sensor, px, if known."""
        return self._core.sensor()

    def __iter__(self):
        return self

    def __next__(self):
        if self._delta_t is None:
            events = self._core.take(self._count)
            if not len(events):
                raise StopIteration
            return of_bytes(events, *self._size)
        first = self._core.next_time()
        if first is None:
            raise StopIteration
        if self._start is None:
            self._start = first
        elif first < self._start:
            self._core.skip_before(self._start)
            return next(self)
        self._start += self._delta_t
        return of_bytes(self._core.take_before(self._start), *self._size)


def load_events(path, *, width=None, height=None):
    """Loads all events of a file.

    Parameters
    ----------
    path, width, height
        As in `EventsIterator`.

    Returns
    -------
    esim.Events, shape (N,)
        With the size of the sensor, if known.
    """
    reader = _core.EventReader(os.fspath(path), *_checks.optional_sensor_size(width, height))
    return of_bytes(reader.take(_ALL), *(reader.sensor() or (None, None)))


def save_events(path, events, width=None, height=None, *, format=None):
    """Writes events to a file; replaces an existing one.

    Parameters
    ----------
    path : path
    events : numpy.ndarray, shape (N,)
        Structured array with the fields t (int, ns), x, y and p, in order of time.
    width, height : int, optional
        Size of the sensor, px. Default: the size stored in `esim.Events`.
    format : str, optional
        A name from `esim.formats()`. Default: by the path's extension.

    Raises
    ------
    esim.Error
        For events that are out of order or outside the sensor, and for unknown formats.
    esim.OutputError
        If the file cannot be written.
    """
    _core.save_events(os.fspath(path), as_bytes(events), *size_of(events, width, height), format)


def info(path):
    """Describes the contents of a recording or an event file.

    Parameters
    ----------
    path : path

    Returns
    -------
    dict
        `path`, `status` and `cameras`: a list of dicts with the number of events, their first and last time (ns), mean
        rate (Hz), and the sensor's size (px) if known.
    """
    return _core.info(os.fspath(path))


def formats():
    """Lists all file formats.

    Returns
    -------
    list of dict
        Name, description, extensions, contents, whether it can be read and written, resolution of times (ns).
    """
    return _core.formats()
