"""esim.video: events of videos."""

import json
import os
import warnings

from .. import _checks, _core
from .._errors import Error, LossWarning
from .._scenario import to_overrides

_MAX = 1e9


class _Images:
    """Calls an interpolator, checks its images, and keeps what it raises: the conversion ends in order first."""

    def __init__(self, interpolator):
        if not callable(interpolator):
            raise TypeError(
                "interpolator must be a function of frame0, frame1 and fraction, such as esim.interpolators.onnx(path), "
                f"not {_checks._kind(interpolator)}"
            )
        self._interpolator = interpolator
        self.raised = None

    def __call__(self, frame0, frame1, fraction):
        """The image, or the text of a problem."""
        shape = frame0.shape
        try:
            return _checks.interpolated(self._interpolator(frame0, frame1, fraction), "its image", shape)
        except BaseException as error:
            self.raised = error
            return str(error) if isinstance(error, Error) else f"{type(error).__name__}: {error}"


def video(
    input,
    out,
    *,
    interpolator=None,
    overrides=None,
    threads=0,
    seed=0,
    force=False,
    fps=None,
    slow_motion=1.0,
    start_s=0.0,
    duration_s=None,
    encoding="auto",
    bayer=False,
    interpolation=True,
    lambda_px=0.5,
    max_steps=200,
):
    """Converts a video, or a folder of images, to events, as the command `esim video` does.

    Parameters
    ----------
    input : path
        A video file, or a folder of images (`docs/video.md`).
    out : path
        Folder to write a recording to, or a file of events such as `events.h5`.
    interpolator : callable, optional
        Makes the images between frames in place of the optical flow: `interpolator(frame0, frame1, fraction)` returns
        the image at `fraction` in (0, 1) of the time between two frames. Frames and image are float32 arrays of shape
        (height, width), or (height, width, 3) with `bayer`: linear intensity, finite and at least 0, 1 = white. The same
        arguments must give the same image. See `esim.interpolators`.
    overrides : dict or list of str, optional
        Options of the event camera to change: `{"contrast_threshold": 0.2}`.
    threads : int
        Number of threads; 0 uses every processor. The result does not depend on it. The interpolator is called by one
        thread.
    seed : int
        Seed of the noise.
    force : bool
        Replace existing output.
    fps : float, optional
        Frames per second, instead of the input's time stamps.
    slow_motion : float
        Factor by which the scene was faster than the time stamps say.
    start_s, duration_s : float
        Part of the input to convert, s. Default: all.
    encoding : str
        Of the pixel values: "srgb", "linear", or "auto": integers are sRGB, floating point is linear.
    bayer : bool
        Simulate a colour sensor.
    interpolation : bool
        False only blends the frames.
    lambda_px : float
        Maximum motion in a step between frames, px.
    max_steps : int
        Maximum number of steps between two frames.

    Returns
    -------
    dict
        Results and cost: the content of `report.json`.

    Raises
    ------
    esim.Error
        For unusable input. If a later frame or an image of the interpolator is unusable, the part before it is kept in
        `out`, marked incomplete; the exception of the interpolator is the cause (`__cause__`).
    esim.OutputError
        If the output cannot be written.
    """
    images = None if interpolator is None else _Images(interpolator)
    report, problem, lines = _core.convert_video(
        os.fspath(input),
        os.fspath(out),
        images,
        "" if interpolator is None else getattr(interpolator, "__qualname__", type(interpolator).__qualname__),
        to_overrides(overrides),
        _checks.threads(threads),
        _checks.seed(seed),
        _checks.flag(force, "force"),
        None if fps is None else _checks.number(fps, "fps", above=0, high=_MAX),
        _checks.number(slow_motion, "slow_motion", above=0, high=_MAX),
        _checks.number(start_s, "start_s", low=0, high=_MAX),
        None if duration_s is None else _checks.number(duration_s, "duration_s", above=0, high=_MAX),
        ("auto", "srgb", "linear").index(_checks.one_of(encoding, "encoding", ("auto", "srgb", "linear"))),
        _checks.flag(bayer, "bayer"),
        _checks.flag(interpolation, "interpolation"),
        _checks.number(lambda_px, "lambda_px", above=0, high=1000),
        _checks.whole(max_steps, "max_steps", 1, 10**6),
    )
    raised = None if images is None else images.raised
    if raised is not None and not isinstance(raised, Exception):
        raise raised
    for line in lines:
        warnings.warn(line, LossWarning, stacklevel=2)
    if problem:
        raise Error(problem) from raised
    return json.loads(report)
