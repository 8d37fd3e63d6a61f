"""The event sensor, for frames of one's own."""

import numpy as np

from . import _checks, _core
from ._errors import Error
from ._events import of_bytes
from ._scenario import to_overrides

_FLOAT32 = np.dtype(np.float32)


class EventCamera:
    """An event camera that is given frames: between two of them, brightness goes straight.

    A copy, of `copy.copy` or of a pickle, goes on where the camera is: given the same frames, both give the same events.
    A pickle is for the version of esim that made it.

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
        self._options = dict(options)
        self._make(
            _checks.sensor_size(width, height),
            to_overrides({f"event_camera.{key}": value for key, value in options.items()}),
            _checks.seed(seed),
            _checks.threads(threads),
        )

    def _make(self, size, overrides, seed, threads):
        self._made = size, overrides, seed, threads
        self._shape = size[::-1]
        self._core = _core.EventCamera(*size, overrides, seed, threads)

    def process(self, frame, t):
        """The events since the frame before; none for the first one.

        Parameters
        ----------
        frame : numpy.ndarray, float32, shape (height, width)
            Irradiance: linear light, 0 and above, 1 = white. Read in place where it is C-contiguous float32; other
            floats are converted. Pictures of 8 bits are not linear light: `esim.linear_light` makes it of them.
        t : float, or numpy.timedelta64 such as esim.ns()
            Time of the frame, s, after the one before.

        Returns
        -------
        esim.Events, shape (N,)
            In order of time; a view of memory that belongs to the array.

        Raises
        ------
        esim.Error
            For frames of another size, values that are no irradiance, times out of order. The camera is then as before.
        """
        if not (
            isinstance(frame, np.ndarray)
            and frame.dtype == _FLOAT32
            and frame.shape == self._shape
            and frame.flags.c_contiguous
        ):
            frame = _checks.irradiance(frame, "frame", self._shape)
        return of_bytes(self._core.process(frame, _checks.time(t)), *self._made[0])

    @property
    def dropped(self):
        """int: events that the readout has dropped, because its queue was full."""
        return self._core.statistics()[0]

    @property
    def delayed(self):
        """int: events whose pixels had to wait for the readout, by more than 1 us."""
        return self._core.statistics()[1]

    def __getstate__(self):
        return {"version": _core.__version__, "options": self._options, "made": self._made, "state": self._core.state()}

    def __setstate__(self, state):
        if state["version"] != _core.__version__:
            raise Error(
                f"an event camera that esim {state['version']} pickled cannot go on in esim {_core.__version__}; "
                "make a new one"
            )
        self._options = state["options"]
        self._make(*state["made"])
        self._core.restore(state["state"])

    def __repr__(self):
        (width, height), _, seed, _ = self._made
        options = "".join(f", {name}={value!r}" for name, value in self._options.items())
        return f"<esim.EventCamera {width} x {height} px{options}, seed={seed}>"


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
    image = _checks.picture(image)
    code = np.arange(np.iinfo(image.dtype).max + 1) / np.iinfo(image.dtype).max
    light = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4).astype(np.float32)[image]
    return light if image.ndim == 2 else light @ np.float32([0.2126, 0.7152, 0.0722])
