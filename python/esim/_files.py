"""Files of events, of every format that esim knows."""

import os

from . import _core
from ._types import EVENT_DTYPE, as_bytes, to_ns


class EventsIterator:
    """The events of a file, portion by portion, in memory that does not depend on its length.

    Parameters
    ----------
    path : path
        A file of any format in `esim.formats()` that is read, a recording of one camera, or a camera's folder in it.
    delta_t : int or float, optional
        Portions are [start + k delta_t, start + (k + 1) delta_t), also where nothing happened; int ns or float s.
    n_events : int, optional
        Portions are of so many events, the last one of fewer. Without either, portions are as they come.
    start : int or float, optional
        Where portions of delta_t begin; events before are passed over. The first event's time otherwise.
    width, height : int, optional
        Of the sensor, in place of what the file says.

    Yields
    ------
    numpy.ndarray of esim.EVENT_DTYPE, shape (N,)

    Raises
    ------
    esim.Error
        Naming file and place, for damaged ones.
    """

    def __init__(self, path, delta_t=None, n_events=None, *, start=None, width=None, height=None):
        if delta_t is not None and n_events is not None:
            raise ValueError("give delta_t or n_events, not both")
        if delta_t is not None and to_ns(delta_t) <= 0:
            raise ValueError("delta_t is above 0")
        if n_events is not None and n_events <= 0:
            raise ValueError("n_events is above 0")
        if start is not None and delta_t is None:
            raise ValueError("start goes with delta_t")
        self._core = _core.EventReader(os.fspath(path), width, height)
        self._delta_t = None if delta_t is None else to_ns(delta_t)
        self._count = 1 << 17 if n_events is None else n_events
        self._start = None if start is None else to_ns(start)

    @property
    def size(self):
        """(int, int) or None: width and height of the sensor, px, where they are known."""
        return self._core.sensor()

    def __iter__(self):
        return self

    def __next__(self):
        if self._delta_t is None:
            events = self._core.take(self._count)
            if not len(events):
                raise StopIteration
            return events.view(EVENT_DTYPE)
        first = self._core.next_time()
        if first is None:
            raise StopIteration
        if self._start is None:
            self._start = first
        elif first < self._start:
            self._core.skip_before(self._start)
            return next(self)
        self._start += self._delta_t
        return self._core.take_before(self._start).view(EVENT_DTYPE)


def load_events(path, *, width=None, height=None):
    """All events of a file.

    Parameters
    ----------
    path, width, height
        As in `EventsIterator`.

    Returns
    -------
    numpy.ndarray of esim.EVENT_DTYPE, shape (N,)
    """
    return _core.EventReader(os.fspath(path), width, height).take((1 << 63) - 1).view(EVENT_DTYPE)


def save_events(path, events, width, height, *, format=None):
    """Writes events to a file; one that is there is replaced.

    Parameters
    ----------
    path : path
    events : numpy.ndarray, shape (N,)
        Structured, with the fields t (int, ns), x, y and p, in order of time.
    width, height : int
        Of the sensor, px.
    format : str, optional
        A name from `esim.formats()`; by the path's extension otherwise.

    Raises
    ------
    esim.Error
        For events that are out of order or outside the sensor, and for unknown formats.
    esim.OutputError
        Where the file cannot be written.
    """
    _core.save_events(os.fspath(path), as_bytes(events), width, height, format)


def info(path):
    """What a recording or a file of events holds.

    Parameters
    ----------
    path : path

    Returns
    -------
    dict
        `path`, `status` and `cameras`: a list of dicts with the number of events, their first and last time (ns), mean
        rate (Hz), and the sensor's size (px) where it is known.
    """
    return _core.info(os.fspath(path))


def formats():
    """All formats of files of events.

    Returns
    -------
    list of dict
        Name, description, extensions, what it holds, whether it is read and written, resolution of times (ns).
    """
    return _core.formats()
