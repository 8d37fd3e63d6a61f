"""The event sensor for given frames."""

import warnings

import numpy as np

from . import _checks, _core
from ._errors import Error
from ._events import of_bytes
from ._scenario import to_overrides
from ._types import LABEL_DTYPE

_FLOAT32 = np.dtype(np.float32)


class EventCamera:
    """An event camera that converts frames to events. Between two frames, brightness is interpolated linearly.

    A copy, made by `copy.copy` or pickle, has the same state: given the same frames, both give the same events. A pickle
    can only be loaded by the version of esim that made it.

    Parameters
    ----------
    width, height : int
        Size of the sensor, px.
    preset : str, optional
        Sensor that gives the default values: "ideal", "davis346", ... (`docs/pixel.md`); "davis346@1" is an older version.
    seed : int
        Seed of all random numbers.
    threads : int
        Number of threads; 0 uses every processor. The result does not depend on it.
    **options
        Options of `event_camera` in a scenario: `contrast_threshold=0.2, readout={"row_time_us": 1}`. `filters` takes
        the arguments of `esim.filters.FilterChain`: `filters={"trail": {"threshold_us": 5000}}`.

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
        for text in self._core.warnings:
            warnings.warn(text, stacklevel=2)

    def _make(self, size, overrides, seed, threads):
        self._made = size, overrides, seed, threads
        self._shape = size[::-1]
        self._core = _core.EventCamera(*size, overrides, seed, threads)

    def process(self, frame, t):
        """Returns the events since the previous frame; none for the first frame.

        Parameters
        ----------
        frame : numpy.ndarray, float32, shape (height, width)
            Irradiance: linear intensity, at least 0, 1 = white. C-contiguous float32 is read without a copy; other
            floats are converted. 8-bit images are not linear: convert them with `esim.linear_light`.
        t : float, or numpy.timedelta64 such as esim.ns()
            Time of the frame, s; later than the previous frame.

        Returns
        -------
        esim.Events, shape (N,)
            In order of time. The array owns its memory.

        Raises
        ------
        esim.Error
            For frames of another size, negative or infinite values, and times out of order. The state of the camera does
            not change.
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
    def labels(self):
        """numpy.ndarray of esim.LABEL_DTYPE: why each event of the last process() fired. Empty unless the camera was made
        with `labels=True`. A copy made by pickle begins without them."""
        return self._core.labels().view(LABEL_DTYPE)

    @property
    def dropped(self):
        """int: number of events that the readout dropped because its queue was full."""
        return self._core.statistics()[0]

    @property
    def delayed(self):
        """int: number of events that waited for the readout by more than 1 us."""
        return self._core.statistics()[1]

    def __getstate__(self):
        return {"version": _core.__version__, "options": self._options, "made": self._made, "state": self._core.state()}

    def __setstate__(self, state):
        if state["version"] != _core.__version__:
            raise Error(
                f"an EventCamera pickled by esim {state['version']} cannot be loaded by esim {_core.__version__}; "
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
    """Converts an sRGB image to irradiance: decodes sRGB and converts colours to luminance (Rec. 709).

    Parameters
    ----------
    image : numpy.ndarray, uint8 or uint16, shape (height, width) or (height, width, 3)
        Grey, or red, green and blue.

    Returns
    -------
    numpy.ndarray, float32, shape (height, width)
        Linear intensity, 1 = white.
    """
    image = _checks.picture(image)
    code = np.arange(np.iinfo(image.dtype).max + 1) / np.iinfo(image.dtype).max
    light = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4).astype(np.float32)[image]
    return light if image.ndim == 2 else light @ np.float32([0.2126, 0.7152, 0.0722])
