"""Layouts of arrays, and how times are given."""

import operator

import numpy as np

#: Events: `t` ns, `x` and `y` px, `p` +1 where brightness rose and -1 where it fell.
EVENT_DTYPE = np.dtype(
    {"names": ["t", "x", "y", "p"], "formats": ["<i8", "<u2", "<u2", "i1"], "offsets": [0, 8, 10, 12], "itemsize": 16}
)

#: The motion of a body: `t` ns, `position` m and `orientation` (Hamilton, x y z w) of T_world_body, `velocity` m/s and
#: `acceleration` m/s² in the world frame, `angular_velocity` rad/s and `angular_acceleration` rad/s² in the body frame.
STATE_DTYPE = np.dtype(
    [
        ("t", "<i8"),
        ("position", "<f8", 3),
        ("orientation", "<f8", 4),
        ("velocity", "<f8", 3),
        ("acceleration", "<f8", 3),
        ("angular_velocity", "<f8", 3),
        ("angular_acceleration", "<f8", 3),
    ]
)

#: Measurements of the IMU in its frame: `t` ns, `angular_rate` rad/s, `specific_force` m/s², and the biases in them.
IMU_DTYPE = np.dtype(
    [
        ("t", "<i8"),
        ("angular_rate", "<f8", 3),
        ("specific_force", "<f8", 3),
        ("angular_rate_bias", "<f8", 3),
        ("specific_force_bias", "<f8", 3),
    ]
)


def to_ns(t):
    """A time as int ns: whole numbers are nanoseconds, floats are seconds."""
    if isinstance(t, float):
        if not abs(t) < 9.2e9:
            raise ValueError(f"{t} s is no time; times are within 292 years of 0")
        return round(t * 1e9)
    if isinstance(t, (bool, np.bool_)):
        raise TypeError("a time is an int (ns) or a float (s), not a bool")
    try:
        return operator.index(t)
    except TypeError:
        raise TypeError(f"a time is an int (ns) or a float (s), not a {type(t).__name__}") from None


def to_ns_array(t):
    """Times as an array of int64 ns, contiguous; of floats likewise."""
    t = np.asarray(t)
    if t.dtype.kind in "iu":
        return np.asarray(t, np.int64, order="C")
    if t.dtype == np.float64:
        if not (np.abs(t) < 9.2e9).all():
            raise ValueError("times are finite, and within 292 years of 0")
        return np.asarray(np.rint(t * 1e9), np.int64, order="C")
    raise TypeError(f"times are ints (ns) or float64 (s), not {t.dtype}")


def to_events(events):
    """Events in the one layout: the array itself where it has it, and a copy otherwise.

    Fields may have other types; `p` may be bool, or 0 for -1.
    """
    events = np.asarray(events)
    if events.dtype.names is None or not {"t", "x", "y", "p"} <= set(events.dtype.names) or events.ndim != 1:
        raise TypeError("events are a one-dimensional structured array with the fields t, x, y and p")
    if events.dtype == EVENT_DTYPE and events.flags.c_contiguous and events.flags.aligned:
        return events
    out = np.empty(len(events), EVENT_DTYPE)
    if events.dtype["t"].kind not in "iu":
        raise TypeError(f"times of events are ints (ns), not {events.dtype['t']}")
    out["t"] = events["t"]
    for axis in "xy":
        if len(events) and (events[axis].min() < 0 or events[axis].max() > 65535):
            raise ValueError(f"{axis} of events is between 0 and 65535")
        out[axis] = events[axis]
    out["p"] = np.where(events["p"] > 0, 1, -1)
    return out


def as_bytes(events):
    """Events as the module in C++ takes them, without a copy where they have the one layout."""
    return to_events(events).view(np.uint8)
