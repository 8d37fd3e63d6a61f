"""Checks of arguments: numbers, sizes, times, images. All functions of the package use them.

A wrong type raises TypeError, a value out of range esim.Error. Both messages name the argument.
"""

import datetime
import math
import numbers
import operator

import numpy as np

from ._errors import Error

MAX_EXTENT = 65536  # px
MAX_TIME_S = 9.2e9  # fits into 64 bits of nanoseconds


def _kind(value):
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype}, shape {value.shape}"
    return f"{value!r}, a {type(value).__name__}"


def whole(value, name, low, high):
    """An int from low to high; also NumPy integers."""
    try:
        if isinstance(value, (bool, np.bool_)):
            raise TypeError
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} must be an int, not {_kind(value)}") from None
    if not low <= number <= high:
        raise Error(f"{name} must be between {low} and {high}, not {number}")
    return number


def number(value, name, *, above=None, low=-math.inf, high=math.inf):
    """A finite float from an int or a float; also NumPy scalars."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Real):
        raise TypeError(f"{name} must be a number, not {_kind(value)}")
    try:
        real = float(value)
    except OverflowError:
        real = math.inf
    if not math.isfinite(real):
        raise Error(f"{name} must be finite, not {value}")
    if above is not None and not real > above:
        raise Error(f"{name} must be above {above:g}, not {value}")
    if not low <= real <= high:
        raise Error(f"{name} must be between {low:g} and {high:g}, not {value}")
    return real


def flag(value, name):
    """A bool."""
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name} must be True or False, not {_kind(value)}")
    return bool(value)


def one_of(value, name, choices):
    """One of some words."""
    if not isinstance(value, str) or value not in choices:
        raise Error(f"{name} must be one of {', '.join(map(repr, choices))}, not {value!r}")
    return value


def seed(value):
    """The seed of random numbers."""
    return whole(value, "seed", 0, 2**64 - 1)


def threads(value):
    """A number of threads; 0: one per processor."""
    return whole(value, "threads", 0, 1024)


def sensor_size(width, height):
    """Width and height of a sensor, px."""
    return whole(width, "width", 1, MAX_EXTENT), whole(height, "height", 1, MAX_EXTENT)


def optional_sensor_size(width, height):
    """The same, or None for both."""
    if (width is None) != (height is None):
        raise Error("width and height must be given both or not at all")
    return (None, None) if width is None else sensor_size(width, height)


# Times. Arguments whose names have no unit refuse bare ints, since an int could mean seconds or nanoseconds.


def seconds(value, name, *, above=None, low=-MAX_TIME_S):
    """A float from any number, for arguments whose name says seconds."""
    return number(value, name, above=above, low=low, high=MAX_TIME_S)


def packet_length(packet_s):
    """Length of packets as int ns; 0 if not given."""
    if packet_s is None:
        return 0
    return max(1, round(seconds(packet_s, "packet_s", above=0) * 1e9))


def ns(t):
    """Converts nanoseconds, the unit of returned times, to a time argument.

    Parameters
    ----------
    t : int, or an array of ints
        ns: `packet.t1`, `events["t"]`, ....

    Returns
    -------
    numpy.timedelta64 of unit "ns", or an array of them

    Raises
    ------
    TypeError
        For anything but ints.
    """
    array = np.asarray(t)
    if array.dtype.kind not in "iu":
        raise TypeError(f"esim.ns() takes ints, not {_kind(t)}; a time in seconds is a float")
    _require_range(array.astype(np.float64) * 1e-9, "t")
    return array.astype("m8[ns]")[()]


def time(t, name="t"):
    """A time as int ns, from a float (s) or a value with a unit, such as esim.ns()."""
    if isinstance(t, float) and abs(t) < MAX_TIME_S:  # the usual case, faster
        return round(t * 1e9)
    value = times(t, name)
    if value.ndim != 0:
        raise TypeError(f"{name} must be one time, not {_kind(t)}")
    return int(value)


def times(t, name="t"):
    """Times as a contiguous array of int64 ns, from the same types."""
    array = np.asarray(np.timedelta64(t) if isinstance(t, datetime.timedelta) else t)
    kind = array.dtype.kind
    if kind == "f":
        array = array.astype(np.float64)
        _require_range(array, name)
        return np.asarray(np.rint(array * 1e9), np.int64, order="C")
    if kind == "m":
        return _of_timedelta(array, name)
    if kind in "iu" and not array.any():  # 0 is 0 in any unit
        return np.asarray(array, np.int64, order="C")
    if kind in "iu" or (array.ndim == 0 and isinstance(t, numbers.Integral) and not isinstance(t, bool)):
        example = array[array != 0].flat[0] if array.dtype.kind != "O" else t
        raise TypeError(
            f"{name} must be a float (s), or esim.ns(...) for an int (ns): the int {example} has no unit; "
            f"write {example}.0 for seconds, or esim.ns({example}) for nanoseconds"
        )
    raise TypeError(f"{name} must be a float (s), or esim.ns(...) for an int (ns), not {_kind(t)}")


def _require_range(array_s, name):
    if not (np.abs(array_s) < MAX_TIME_S).all():
        raise Error(f"{name} must be finite, and within 292 years of 0")


def _of_timedelta(array, name):
    unit = np.datetime_data(array.dtype)[0]
    if unit in ("generic", "Y", "M"):
        raise TypeError(f"{name}: a timedelta64 with unit {unit!r} has no fixed length; use a unit from weeks to nanoseconds")
    if np.isnat(array).any():
        raise Error(f"{name} must be finite, not NaT")
    _require_range(array / np.timedelta64(1, "s"), name)
    exact = array.astype("m8[ns]")
    if (exact.astype(array.dtype) != array).any():
        raise Error(f"{name} must be a whole number of nanoseconds")
    return np.asarray(exact.view(np.int64), order="C")


# Images.


def _require_shape(image, name, shape):
    if image.shape == shape:
        return
    height, width = shape[-2:]
    given = f"{image.shape[1]} x {image.shape[0]} pixels" if image.ndim == 2 else f"{image.ndim} dimensions"
    raise Error(f"{name} of shape {image.shape} must be {width} x {height} pixels, shape {shape}, not {given}")


def _to_float32(image):
    with np.errstate(over="ignore"):  # becomes infinite, which is reported
        return np.ascontiguousarray(image, np.float32)


def irradiance(image, name, shape):
    """Linear intensity as contiguous float32. EventCamera itself checks that values are finite and at least 0."""
    image = np.asarray(image)
    if image.dtype.kind != "f":
        raise TypeError(
            f"{name} must be floats, linear intensity with 1 = white, not {image.dtype}; esim.linear_light() converts "
            "sRGB images"
        )
    _require_shape(image, name, shape)
    return _to_float32(image)


def rendered_irradiance(image, name, shape):
    """The same, with its values checked."""
    image = irradiance(image, name, shape)
    _require_irradiance(image, name)
    return image


def _require_irradiance(image, name):
    wrong = ~((image >= 0) & (image < np.inf))
    if wrong.any():
        at = tuple(np.argwhere(wrong)[0])
        raise Error(f"{name} must be finite and at least 0, not {image[at]} at pixel ({at[1]}, {at[0]})")


def interpolated(image, name, shape):
    """Linear intensity of shape (height, width) or (height, width, 3) as contiguous float32, with its values checked."""
    image = np.asarray(image)
    if image.dtype.kind != "f":
        raise TypeError(f"{name} must be floats, linear intensity with 1 = white, not {image.dtype}")
    if image.shape != shape:
        raise Error(f"{name} must have the shape of the frames, {shape}, not {image.shape}")
    image = _to_float32(image)
    _require_irradiance(image, name)
    return image


def depth(image, name, shape):
    """Depth, m, as contiguous float32; inf without a surface."""
    image = np.asarray(image)
    if image.dtype.kind != "f":
        raise TypeError(f"{name} must be floats, m along the optical axis, not {image.dtype}")
    _require_shape(image, name, shape)
    image = _to_float32(image)
    if not (image > 0).all():
        raise Error(f"{name} must be above 0 everywhere, and inf where there is no surface")
    return image


def motion_field(image, name, shape):
    """A motion field, px/s, as contiguous float32."""
    image = np.asarray(image)
    if image.dtype.kind not in "fi":
        raise TypeError(f"{name} must be signed numbers, px/s, not {image.dtype}")
    _require_shape(image, name, shape)
    return _to_float32(image)


def labels(image, name, shape, count):
    """Integers from 0 to count as contiguous uint16."""
    image = np.asarray(image)
    if image.dtype.kind not in "iuf":
        raise TypeError(f"{name} must be ints, not {image.dtype}")
    _require_shape(image, name, shape)
    wrong = image[~((image >= 0) & (image <= count) & (image == np.floor(image)))]
    if wrong.size:
        raise Error(f"{name} {wrong.flat[0]:g} of {count}: must be ints from 0 (no object) to {count}")
    return np.ascontiguousarray(image, np.uint16)


def pose(value, name):
    """A rigid transformation as a matrix."""
    matrix = np.ascontiguousarray(value, np.float64)
    if matrix.shape != (4, 4):
        raise Error(f"{name} must have shape (4, 4), not {matrix.shape}")
    return matrix


def picture(image):
    """An sRGB image, uint8 or uint16, grey or with three colours."""
    image = np.asarray(image)
    if image.dtype not in (np.uint8, np.uint16):
        raise TypeError(f"image must be uint8 or uint16, not {image.dtype}")
    if not (image.ndim == 2 or (image.ndim == 3 and image.shape[2] == 3)):
        raise Error(f"image must have the shape (height, width) or (height, width, 3), not {image.shape}")
    return image
