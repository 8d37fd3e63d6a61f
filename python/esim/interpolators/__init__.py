"""Learned interpolators, which make the images between the frames of a video (`esim.video`).

An interpolator is a callable, `interpolator(frame0, frame1, fraction)`, that returns the image at `fraction` in (0, 1) of
the time between two frames. Frames and image are float32 arrays of the same shape, (height, width) or
(height, width, 3): linear intensity, 1 = white. The same arguments must give the same image.
"""

import os

import numpy as np

from .. import _checks
from .._errors import Error

__all__ = ["onnx", "srgb"]

_LUMINANCE = np.float32([0.2126, 0.7152, 0.0722])
_NEEDS = "onnxruntime is not installed; install it with `pip install onnxruntime`"


def _to_srgb(light):
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 0) ** np.float32(1 / 2.4) - 0.055).astype(np.float32)


def _from_srgb(codes):
    codes = np.maximum(codes, 0)
    return np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** np.float32(2.4)).astype(np.float32)


def srgb(interpolator):
    """Adapts an interpolator of sRGB images, as most neural networks are, to linear intensity.

    Parameters
    ----------
    interpolator : callable
        `interpolator(frame0, frame1, fraction)` for float32 frames in sRGB, 1 = white. Values of its images below 0
        become 0; those above 1 remain.

    Returns
    -------
    callable
        The same for linear intensity.
    """
    if not callable(interpolator):
        raise TypeError("interpolator must be a function of frame0, frame1 and fraction")

    def in_linear_light(frame0, frame1, fraction):
        image = np.asarray(interpolator(_to_srgb(frame0), _to_srgb(frame1), fraction), np.float32)
        return _from_srgb(image)

    return in_linear_light


def onnx(path, *, encoding="srgb", multiple=32, providers=None):
    """Loads an interpolator from an ONNX file. Needs the package onnxruntime.

    The inputs of the model are, in this order, two frames, float32 of shape (1, C, height, width) with C = 1 or 3 (red,
    green, blue), and the fraction, a float32 of any shape with one element. Its first output is the image, of the shape
    of the frames. If C = 3 and the frames are grey, the model gets them as three equal colours, and the luminance of its
    image is used. If C = 1 and the frames are coloured, each colour is interpolated by itself.

    Parameters
    ----------
    path : path
    encoding : str
        What the model takes and returns: "srgb" or "linear"; 1 = white.
    multiple : int
        If the model takes frames of any size, width and height are extended to multiples of this number by repeating the
        pixels of the right and lower edge, as U-shaped networks need.
    providers : list of str, optional
        Execution providers of ONNX Runtime. Default: CUDA if this onnxruntime has it, and the processor.

    Returns
    -------
    callable
        For `esim.video`.

    Raises
    ------
    esim.Error
        If the file cannot be loaded, or its inputs or outputs are different.
    ImportError
        If onnxruntime is not installed.
    """
    encoding = _checks.one_of(encoding, "encoding", ("srgb", "linear"))
    return OnnxInterpolator(os.fspath(path), encoding, _checks.whole(multiple, "multiple", 1, 4096), providers)


def _is_fixed(size):
    return isinstance(size, int)


class OnnxInterpolator:
    """What `onnx` returns."""

    def __init__(self, path, encoding, multiple, providers):
        try:
            import onnxruntime
        except ImportError as error:
            if error.name != "onnxruntime":
                raise
            raise ImportError(f"{path}: {_NEEDS}") from None
        if not os.path.isfile(path):
            raise Error(f"{path}: no such file; name a model in ONNX")
        if providers is None:
            wanted = ["CUDAExecutionProvider", "CPUExecutionProvider"]
            providers = [name for name in wanted if name in onnxruntime.get_available_providers()]
        self._path, self._multiple = path, multiple
        self._interpolate = srgb(self._run) if encoding == "srgb" else self._run
        try:
            self._session = onnxruntime.InferenceSession(path, providers=list(providers))
        except Exception as error:
            raise Error(f"{path}: ONNX Runtime cannot load it: {' '.join(str(error).split())}") from error
        self._check_inputs()

    def _check_inputs(self):
        inputs = self._session.get_inputs()
        given = ", ".join(f"{i.name} ({i.type}, shape {i.shape})" for i in inputs) or "none"

        def refuse(problem):
            raise Error(
                f"{self._path}: {problem}. The inputs must be frame 0, frame 1, each tensor(float) of shape "
                f"(1, 1 or 3, height, width), and the fraction of the time, a tensor(float) of one element; they are: {given}"
            )

        if len(inputs) != 3:
            refuse(f"the model has {len(inputs)} inputs instead of 3")
        if any(i.type != "tensor(float)" for i in inputs):
            refuse("an input is not tensor(float)")
        frame0, frame1, fraction = inputs
        if len(frame0.shape) != 4 or len(frame1.shape) != 4:
            refuse("the first two inputs do not have 4 dimensions")
        batch, self._channels, self._height, self._width = frame0.shape
        if self._channels not in (1, 3) or frame1.shape[1] != self._channels:
            refuse("the frames do not have 1 or 3 channels")
        if _is_fixed(batch) and batch != 1:
            refuse(f"the model takes {batch} frames at once")
        if any(_is_fixed(size) and size != 1 for size in fraction.shape):
            refuse("the fraction has more than one element")
        self._fraction_shape = (1,) * len(fraction.shape)
        self._names = [i.name for i in inputs]

    def check_size(self, height, width):
        """Raises esim.Error if the model does not take frames of this size."""
        for size, fixed, name in ((height, self._height, "high"), (width, self._width, "wide")):
            if _is_fixed(fixed) and fixed != size:
                raise Error(
                    f"{self._path}: the model takes frames that are {fixed} px {name}, not {size} px; scale the video, or "
                    "export the model with variable height and width"
                )

    def _padding(self, size, fixed):
        return 0 if _is_fixed(fixed) else -size % self._multiple

    def _run(self, frame0, frame1, fraction):
        """The image of the model for frames of shape (height, width, C)."""
        height, width = frame0.shape[:2]
        pad = ((0, 0), (0, self._padding(height, self._height)), (0, self._padding(width, self._width)))
        frames = [np.pad(np.moveaxis(frame, 2, 0), pad, mode="edge")[None] for frame in (frame0, frame1)]
        values = [*frames, np.full(self._fraction_shape, fraction, np.float32)]
        try:
            image = self._session.run(None, dict(zip(self._names, values)))[0]
        except Exception as error:
            raise Error(f"{self._path}: ONNX Runtime cannot run it: {' '.join(str(error).split())}") from error
        if image.shape != frames[0].shape:
            raise Error(f"{self._path}: the model must return an image of shape {frames[0].shape}, not {image.shape}")
        return np.moveaxis(image[0, :, :height, :width], 0, 2)

    def __call__(self, frame0, frame1, fraction):
        self.check_size(*frame0.shape[:2])
        if frame0.ndim == 2:
            shape = (*frame0.shape, self._channels)
            image = self._interpolate(*(np.broadcast_to(f[..., None], shape) for f in (frame0, frame1)), fraction)
            return image[..., 0] if self._channels == 1 else image @ _LUMINANCE
        if self._channels == 3:
            return self._interpolate(frame0, frame1, fraction)
        colours = [self._interpolate(frame0[..., [c]], frame1[..., [c]], fraction) for c in range(3)]
        return np.concatenate(colours, axis=2)
