"""Event representations as arrays, for networks and for display. All functions release the GIL."""

from . import _checks, _core
from ._events import as_bytes, size_of, to_layout


def span(events, t0, t1):
    """(t0, t1) as int ns; by default the times of the first and the last event."""
    start = None if t0 is None else _checks.time(t0, "t0")
    end = None if t1 is None else _checks.time(t1, "t1")
    if len(events) == 0:
        start = start or 0
        return start, start if end is None else end
    return int(events["t"].min()) if start is None else start, int(events["t"].max()) if end is None else end


def moment(events, t):
    """t as int ns; by default the time of the last event."""
    if t is not None:
        return _checks.time(t)
    return int(events["t"].max()) if len(events) else 0


def event_count(events, width=None, height=None):
    """Counts the events of each pixel.

    Parameters
    ----------
    events : numpy.ndarray, shape (N,)
        Structured array with the fields t, x, y and p; esim.EVENT_DTYPE is read without a copy.
    width, height : int, optional
        Size of the sensor, px. Default: the size stored in `esim.Events`.

    Returns
    -------
    numpy.ndarray, int32, shape (2, height, width)
        ON, OFF.
    """
    return _core.count_events(as_bytes(events), *size_of(events, width, height))


def event_tensor(events, width=None, height=None, *, t0=None, t1=None, stamp="last"):
    """Computes the four channels of EV-FlowNet (Zhu et al., RSS 2018), which the ESIM paper uses for optical flow.

    Parameters
    ----------
    events, width, height
        As in `event_count`.
    t0, t1 : float, or numpy.timedelta64 such as esim.ns(), optional
        Time span, s; other events are ignored. Default: the times of the first and the last event.
    stamp : {"last", "mean"}
        Which time stamp represents the events of a pixel and a polarity.

    Returns
    -------
    numpy.ndarray, float32, shape (4, height, width)
        Counts of ON and OFF events, and the time stamps of ON and OFF events, from 0 at t0 to 1 at t1; 0 for pixels
        without events.
    """
    mean = _checks.one_of(stamp, "stamp", ("last", "mean")) == "mean"
    size, events = size_of(events, width, height), to_layout(events)
    return _core.count_and_stamp(as_bytes(events), *size, *span(events, t0, t1), mean)


def voxel_grid(events, width=None, height=None, bins=5, *, t0=None, t1=None, normalise=False):
    """Distributes polarities linearly between the two nearest time bins (Zhu et al., CVPR 2019, Eqs. 1 and 2).

    With p = +1 or -1 and t* = (bins - 1) (t - t0) / (t1 - t0), voxel (b, y, x) is the sum of p max(0, 1 - abs(b - t*))
    over the events of pixel (x, y).

    Parameters
    ----------
    events, width, height
        As in `event_count`.
    bins : int
    t0, t1
        As in `event_tensor`.
    normalise : bool
        Normalise the nonzero voxels to mean 0 and standard deviation 1.

    Returns
    -------
    numpy.ndarray, float32, shape (bins, height, width)
    """
    bins, normalise = _checks.whole(bins, "bins", 1, 65536), _checks.flag(normalise, "normalise")
    size, events = size_of(events, width, height), to_layout(events)
    return _core.voxel_grid(as_bytes(events), *size, bins, *span(events, t0, t1), normalise)


def time_surface(events, width=None, height=None, *, t=None, tau_s=0.03):
    """Computes exp(-(t - t_last) / tau) of each pixel's last event until t.

    Parameters
    ----------
    events, width, height
        As in `event_count`.
    t : float, or numpy.timedelta64 such as esim.ns(), optional
        Time of the surface, s; later events are ignored. Default: the time of the last event.
    tau_s : float
        Time constant, s.

    Returns
    -------
    numpy.ndarray, float32, shape (2, height, width)
        ON, OFF; 0 for pixels without events.
    """
    tau = _checks.seconds(tau_s, "tau_s", above=0)
    size, events = size_of(events, width, height), to_layout(events)
    return _core.time_surface(as_bytes(events), *size, moment(events, t), tau)


def event_frame(events, width=None, height=None):
    """Draws events on white: each pixel has the colour of its last event, ON orange and OFF blue.

    Parameters
    ----------
    events, width, height
        As in `event_count`.

    Returns
    -------
    numpy.ndarray, uint8, shape (height, width, 3)
        RGB image.
    """
    return _core.event_frame(as_bytes(events), *size_of(events, width, height))
