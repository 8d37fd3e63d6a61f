"""Events as arrays, for networks and for people. All of them release Python's lock."""

from . import _checks, _core
from ._events import as_bytes, size_of, to_layout


def span(events, t0, t1):
    """From t0 to t1, and from the first event to the last where they are not given; int ns."""
    start = None if t0 is None else _checks.time(t0, "t0")
    end = None if t1 is None else _checks.time(t1, "t1")
    if len(events) == 0:
        start = start or 0
        return start, start if end is None else end
    return int(events["t"].min()) if start is None else start, int(events["t"].max()) if end is None else end


def moment(events, t):
    """t, or the time of the last event where it is not given; int ns."""
    if t is not None:
        return _checks.time(t)
    return int(events["t"].max()) if len(events) else 0


def event_count(events, width=None, height=None):
    """The number of events of each pixel.

    Parameters
    ----------
    events : numpy.ndarray, shape (N,)
        Structured, with the fields t, x, y and p; read in place where they are of esim.EVENT_DTYPE.
    width, height : int, optional
        Of the sensor, px; of `esim.Events`, what they know otherwise.

    Returns
    -------
    numpy.ndarray, int32, shape (2, height, width)
        ON, OFF.
    """
    return _core.count_events(as_bytes(events), *size_of(events, width, height))


def event_tensor(events, width=None, height=None, *, t0=None, t1=None, stamp="last"):
    """The four channels of EV-FlowNet (Zhu et al., RSS 2018), which the ESIM paper uses for learning optical flow.

    Parameters
    ----------
    events, width, height
        As in `event_count`.
    t0, t1 : float, or numpy.timedelta64 such as esim.ns(), optional
        Events before and after are passed over; s. The first and the last event's time otherwise.
    stamp : {"last", "mean"}
        Which time stamp stands for a pixel's events of a polarity.

    Returns
    -------
    numpy.ndarray, float32, shape (4, height, width)
        Numbers of ON and OFF events, and the time stamps of ON and OFF events, from 0 at t0 to 1 at t1; 0 where there
        are none.
    """
    mean = _checks.one_of(stamp, "stamp", ("last", "mean")) == "mean"
    size, events = size_of(events, width, height), to_layout(events)
    return _core.count_and_stamp(as_bytes(events), *size, *span(events, t0, t1), mean)


def voxel_grid(events, width=None, height=None, bins=5, *, t0=None, t1=None, normalise=False):
    """Polarities spread over bins of time, linearly between the two nearest (Zhu et al., CVPR 2019, Eqs. 1 and 2).

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
        Bring the voxels that are not 0 to a mean of 0 and a standard deviation of 1.

    Returns
    -------
    numpy.ndarray, float32, shape (bins, height, width)
    """
    bins, normalise = _checks.whole(bins, "bins", 1, 65536), _checks.flag(normalise, "normalise")
    size, events = size_of(events, width, height), to_layout(events)
    return _core.voxel_grid(as_bytes(events), *size, bins, *span(events, t0, t1), normalise)


def time_surface(events, width=None, height=None, *, t=None, tau_s=0.03):
    """exp(-(t - t_last) / tau) of each pixel's last event until t.

    Parameters
    ----------
    events, width, height
        As in `event_count`.
    t : float, or numpy.timedelta64 such as esim.ns(), optional
        When it is looked at, s; later events are passed over. The last event's time otherwise.
    tau_s : float
        Time constant, s.

    Returns
    -------
    numpy.ndarray, float32, shape (2, height, width)
        ON, OFF; 0 where there was no event.
    """
    tau = _checks.seconds(tau_s, "tau_s", above=0)
    size, events = size_of(events, width, height), to_layout(events)
    return _core.time_surface(as_bytes(events), *size, moment(events, t), tau)


def event_frame(events, width=None, height=None):
    """A picture for people: on white, each pixel in the colour of the last of its events, ON orange and OFF blue.

    Parameters
    ----------
    events, width, height
        As in `event_count`.

    Returns
    -------
    numpy.ndarray, uint8, shape (height, width, 3)
        Red, green, blue.
    """
    return _core.event_frame(as_bytes(events), *size_of(events, width, height))
