"""Events as arrays, for networks and for people. All of them release Python's lock."""

from . import _core
from ._types import as_bytes, to_events, to_ns


def _span(events, t0, t1):
    """From t0 to t1, and from the first event to the last where they are not given."""
    if len(events) == 0:
        return (0 if t0 is None else to_ns(t0)), (to_ns(t1) if t1 is not None else 0 if t0 is None else to_ns(t0))
    start = int(events["t"].min()) if t0 is None else to_ns(t0)
    end = int(events["t"].max()) if t1 is None else to_ns(t1)
    return start, end


def event_count(events, width, height):
    """The number of events of each pixel.

    Parameters
    ----------
    events : numpy.ndarray, shape (N,)
        Structured, with the fields t, x, y and p; read in place where they are of esim.EVENT_DTYPE.
    width, height : int
        Of the sensor, px.

    Returns
    -------
    numpy.ndarray, int32, shape (2, height, width)
        ON, OFF.
    """
    return _core.count_events(as_bytes(events), width, height)


def event_tensor(events, width, height, *, t0=None, t1=None, stamp="last"):
    """The four channels of EV-FlowNet (Zhu et al., RSS 2018), which the ESIM paper uses for learning optical flow.

    Parameters
    ----------
    events, width, height
        As in `event_count`.
    t0, t1 : int or float, optional
        Events before and after are passed over; int ns or float s. The first and the last event's time otherwise.
    stamp : {"last", "mean"}
        Which time stamp stands for a pixel's events of a polarity.

    Returns
    -------
    numpy.ndarray, float32, shape (4, height, width)
        Numbers of ON and OFF events, and the time stamps of ON and OFF events, from 0 at t0 to 1 at t1; 0 where there
        are none.
    """
    if stamp not in ("last", "mean"):
        raise ValueError(f'stamp is "last" or "mean", not {stamp!r}')
    events = to_events(events)
    return _core.count_and_stamp(as_bytes(events), width, height, *_span(events, t0, t1), stamp == "mean")


def voxel_grid(events, width, height, bins, *, t0=None, t1=None, normalise=False):
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
    events = to_events(events)
    return _core.voxel_grid(as_bytes(events), width, height, bins, *_span(events, t0, t1), normalise)


def time_surface(events, width, height, *, t=None, tau_s=0.03):
    """exp(-(t - t_last) / tau) of each pixel's last event until t.

    Parameters
    ----------
    events, width, height
        As in `event_count`.
    t : int or float, optional
        When it is looked at, int ns or float s; later events are passed over. The last event's time otherwise.
    tau_s : float
        Time constant, s.

    Returns
    -------
    numpy.ndarray, float32, shape (2, height, width)
        ON, OFF; 0 where there was no event.
    """
    events = to_events(events)
    return _core.time_surface(as_bytes(events), width, height, _span(events, None, t)[1], float(tau_s))


def event_frame(events, width, height):
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
    return _core.event_frame(as_bytes(events), width, height)
