"""The digital filters of Prophesee's event cameras, on events from any sensor or file.

Events pass the filters in the order of the arguments, as on the chip. Every option has a default; `docs/filter.md` lists
them. A filter is used if its argument is a dict, which may be empty.

    region           {"windows": [{"x": 100, "y": 50, "width": 320, "height": 240}], "invert": False,
                      "masked_pixels": [{"x": 12, "y": 34}]}
    activity         {"window_us": 1000, "lower_start": 0, "lower_stop": 0, "upper_start": 0, "upper_stop": 0}
    anti_flicker     {"mode": "band_stop", "low_hz": 50, "high_hz": 520, "start_threshold": 6, "stop_threshold": 4}
    trail            {"type": "trail", "threshold_us": 10000}
    rate_controller  {"period_us": 200, "events_per_period": 10000}
"""

from . import _checks, _core
from ._errors import Error
from ._events import as_bytes, of_bytes, size_of
from ._scenario import to_overrides

__all__ = ["FilterChain", "filter_events"]


class FilterChain:
    """Filters that keep their state from one part of a stream to the next.

    The result does not depend on where the stream is cut into parts, and the memory use does not depend on its length.
    The filters are causal: whether an event passes depends on this event and earlier ones.

    Parameters
    ----------
    width, height : int
        Size of the sensor, px.
    region, activity, anti_flicker, trail, rate_controller : dict, optional
        Options of the filters. Default: the filter is not used.

    Raises
    ------
    esim.Error
        If no filter is used; for unknown options, values out of range and contradictions between options.
    """

    def __init__(
        self, width, height, *, region=None, activity=None, anti_flicker=None, trail=None, rate_controller=None
    ):
        filters = {
            "region": region,
            "activity": activity,
            "anti_flicker": anti_flicker,
            "trail": trail,
            "rate_controller": rate_controller,
        }
        used = {name: options for name, options in filters.items() if options is not None}
        if not used:
            raise Error(f"no filter is used: at least one of {', '.join(filters)} must be a dict")
        for name, options in used.items():
            if not isinstance(options, dict):
                raise TypeError(f"{name} must be a dict of options, not {options!r}, a {type(options).__name__}")
        self._size = _checks.sensor_size(width, height)
        self._used = used
        self._core = _core.FilterChain(*self._size, to_overrides(used))

    def process(self, events):
        """Returns the events that pass, unchanged and in their order.

        Parameters
        ----------
        events : numpy.ndarray, shape (N,)
            The next events of the stream: structured array with the fields t (int, ns), x, y and p, in order of time;
            esim.EVENT_DTYPE is read without a copy.

        Returns
        -------
        esim.Events, shape (M,), M <= N
            The array owns its memory.

        Raises
        ------
        esim.Error
            For events that are out of order, also with respect to the previous call, or outside the sensor. The state of
            the filters does not change.
        """
        return of_bytes(self._core.process(as_bytes(events)), *self._size)

    @property
    def dropped(self):
        """dict of str to int: number of events that each filter has dropped so far, in the order of the filters."""
        return self._core.dropped()

    def __repr__(self):
        filters = "".join(f", {name}={options!r}" for name, options in self._used.items())
        return f"<esim.filters.FilterChain {self._size[0]} x {self._size[1]} px{filters}>"


def filter_events(
    events,
    width=None,
    height=None,
    *,
    region=None,
    activity=None,
    anti_flicker=None,
    trail=None,
    rate_controller=None,
):
    """Filters one array of events.

    Parameters
    ----------
    events : numpy.ndarray, shape (N,)
        Structured array with the fields t (int, ns), x, y and p, in order of time.
    width, height : int, optional
        Size of the sensor, px. Default: the size stored in `esim.Events`.
    region, activity, anti_flicker, trail, rate_controller : dict, optional
        As in `FilterChain`.

    Returns
    -------
    esim.Events, shape (M,), M <= N
        The events that pass.

    Raises
    ------
    esim.Error
        As in `FilterChain`.
    """
    chain = FilterChain(
        *size_of(events, width, height),
        region=region,
        activity=activity,
        anti_flicker=anti_flicker,
        trail=trail,
        rate_controller=rate_controller,
    )
    return chain.process(events)
