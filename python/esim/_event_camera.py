"""The event sensor, for frames of one's own."""

import numpy as np

from . import _core
from ._scenario import to_overrides
from ._types import EVENT_DTYPE, to_ns

_FLOAT32 = np.dtype(np.float32)


class EventCamera:
    """An event camera that is given frames: between two of them, brightness goes straight.

    Parameters
    ----------
    width, height : int
        Of the sensor, px.
    preset : str, optional
        Sensor whose values stand where none are given: "ideal", "davis346", ... (`docs/pixel.md`).
    seed : int
        Of all random numbers.
    threads : int
        0 takes every processor. The result does not depend on it.
    **options
        By their names in a scenario's `event_camera`: `contrast_threshold=0.2, readout={"row_time_us": 1}`.

    Raises
    ------
    esim.Error
        For unknown options and values out of range.
    """

    def __init__(self, width, height, preset=None, *, seed=0, threads=0, **options):
        if preset is not None:
            options = {"preset": preset, **options}
        named = {f"event_camera.{key}": value for key, value in options.items()}
        self._core = _core.EventCamera(width, height, to_overrides(named), seed, threads)

    def process(self, frame, t):
        """The events since the frame before; none for the first one.

        Parameters
        ----------
        frame : numpy.ndarray, float32, shape (height, width)
            Irradiance: linear light, 0 and above, 1 = white. Read in place where it is C-contiguous float32; other
            floats are converted. Pictures of 8 bits are not linear light: `esim.linear_light` makes it of them.
        t : int or float
            Time of the frame, int ns or float s, after the one before.

        Returns
        -------
        numpy.ndarray of esim.EVENT_DTYPE, shape (N,)
            In order of time; a view of memory that belongs to the array.

        Raises
        ------
        esim.Error
            For frames of another size, values that are no irradiance, times out of order. The camera is then as before.
        """
        if not (
            isinstance(frame, np.ndarray) and frame.dtype == _FLOAT32 and frame.ndim == 2 and frame.flags.c_contiguous
        ):
            frame = _to_frame(frame)
        return self._core.process(frame, to_ns(t)).view(EVENT_DTYPE)

    @property
    def dropped(self):
        """int: events that the readout has dropped, because its queue was full."""
        return self._core.statistics()[0]


def _to_frame(frame):
    frame = np.asarray(frame)
    if frame.dtype.kind != "f":
        raise TypeError(f"a frame is float32, linear light with 1 = white, not {frame.dtype}; see esim.linear_light()")
    if frame.ndim != 2:
        raise ValueError(f"a frame has the shape (height, width), not {frame.shape}")
    return np.ascontiguousarray(frame, np.float32)


def linear_light(image):
    """The irradiance that a picture shows: decodes sRGB, and weighs colours to luminance (Rec. 709).

    Parameters
    ----------
    image : numpy.ndarray, uint8 or uint16, shape (height, width) or (height, width, 3)
        Grey, or red, green and blue.

    Returns
    -------
    numpy.ndarray, float32, shape (height, width)
        Linear light, 1 = white.
    """
    image = np.asarray(image)
    if image.dtype not in (np.uint8, np.uint16):
        raise TypeError(f"a picture is uint8 or uint16, not {image.dtype}")
    if not (image.ndim == 2 or (image.ndim == 3 and image.shape[2] == 3)):
        raise ValueError(f"a picture has the shape (height, width) or (height, width, 3), not {image.shape}")
    code = np.arange(np.iinfo(image.dtype).max + 1) / np.iinfo(image.dtype).max
    light = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4).astype(np.float32)[image]
    return light if image.ndim == 2 else light @ np.float32([0.2126, 0.7152, 0.0722])
