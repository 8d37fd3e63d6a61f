"""Events as arrays."""

import numpy as np

from ._checks import optional_sensor_size, sensor_size
from ._errors import Error
from ._types import EVENT_DTYPE


class Events(np.ndarray):
    """An array of esim.EVENT_DTYPE, shape (N,), with the size of the sensor.

    Slices, copies, pickles and concatenations of arrays with the same size keep it. Otherwise it behaves like any NumPy
    array; fields are plain arrays.

    Attributes
    ----------
    width, height : int or None
        Size of the sensor, px; None if unknown.
    """

    width = None
    height = None

    def __new__(cls, events, width=None, height=None):
        self = to_layout(events).view(cls)
        self.width, self.height = optional_sensor_size(width, height)
        return self

    def __array_finalize__(self, of):
        if isinstance(of, Events):
            self.width, self.height = of.width, of.height

    def __array_wrap__(self, array, context=None, return_scalar=False):
        return array[()] if return_scalar else array  # results of computations are not events

    def __array_function__(self, function, types, arguments, options):
        result = super().__array_function__(function, types, arguments, options)
        if function is np.concatenate and all(getattr(part, "dtype", None) == EVENT_DTYPE for part in arguments[0]):
            result = to_layout(np.asarray(result)).view(Events)  # NumPy's result has no padding
            sizes = {(getattr(part, "width", None), getattr(part, "height", None)) for part in arguments[0]}
            result.width, result.height = sizes.pop() if len(sizes) == 1 else (None, None)
        return _plain_unless_events(result)

    def __getitem__(self, key):
        return _plain_unless_events(super().__getitem__(key))

    def __reduce__(self):
        rebuild, arguments, state = super().__reduce__()
        return rebuild, arguments, (state, self.width, self.height)

    def __setstate__(self, state):
        state, self.width, self.height = state
        super().__setstate__(state)


def _plain_unless_events(array):
    return array.view(np.ndarray) if isinstance(array, Events) and array.dtype != EVENT_DTYPE else array


def to_layout(events):
    """Events with EVENT_DTYPE: the array itself if it has this layout, otherwise a copy.

    Fields may have other types; `p` may be bool, or 0 for -1.
    """
    events = np.asanyarray(events)
    if events.dtype.names is None or not {"t", "x", "y", "p"} <= set(events.dtype.names) or events.ndim != 1:
        raise TypeError("events must be a one-dimensional structured array with the fields t, x, y and p")
    if events.dtype == EVENT_DTYPE and events.flags.c_contiguous and events.flags.aligned:
        return events
    out = np.empty(len(events), EVENT_DTYPE)
    for field, low, high in (("t", -(2**63), 2**63 - 1), ("x", 0, 65535), ("y", 0, 65535)):
        column = events[field]
        if column.dtype.kind not in "iu":
            unit = "ns" if field == "t" else "px"
            raise TypeError(f"{field} of events must be ints ({unit}), not {column.dtype}")
        if len(column) and not (low <= int(column.min()) and int(column.max()) <= high):
            raise Error(f"{field} of events must be between {low} and {high}")
        out[field] = column
    if events["p"].dtype.kind not in "biuf":
        raise TypeError(f"p of events must be numbers, not {events['p'].dtype}")
    out["p"] = np.where(events["p"] > 0, 1, -1)
    if not isinstance(events, Events):
        return out
    out = out.view(Events)
    out.width, out.height = events.width, events.height
    return out


def as_bytes(events):
    """Events as bytes for the C++ module, without a copy if they have EVENT_DTYPE."""
    return to_layout(events).view(np.uint8, np.ndarray)


def of_bytes(raw, width=None, height=None):
    """Events from the C++ module, as a view of their memory; a size of 0 means unknown."""
    events = raw.view(EVENT_DTYPE).view(Events)
    if width and height:
        events.width, events.height = width, height
    return events


def size_of(events, width, height):
    """Width and height of the sensor, px: the arguments, or else the size stored with the events."""
    if width is None and height is None:
        width, height = getattr(events, "width", None), getattr(events, "height", None)
        if width is None:
            raise Error("width and height are missing: these events do not contain the size of the sensor")
    elif width is None or height is None:
        raise Error("width and height must be given both or not at all")
    return sensor_size(width, height)
