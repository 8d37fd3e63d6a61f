# The interface of interpolators.py. Docstrings there give shapes and units.
from collections.abc import Callable, Iterable
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import Int, Path

Interpolator: TypeAlias = Callable[[NDArray[np.float32], NDArray[np.float32], float], ArrayLike]

def srgb(interpolator: Interpolator) -> Interpolator: ...
def onnx(
    path: Path, *, encoding: Literal["srgb", "linear"] = "srgb", multiple: Int = 32, providers: Iterable[str] | None = None
) -> Interpolator: ...
