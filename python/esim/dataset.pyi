# The interface of dataset.py. Docstrings there give shapes and units.
from collections.abc import Mapping
from os import PathLike
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import Events, Int, Number, Time

class AffineSequence:
    index: int
    duration: int
    events: Events
    motion_field: NDArray[np.float32]
    motion_field_t: int
    optical_flow: NDArray[np.float32]
    images: NDArray[np.float32]
    info: dict[str, Any]
    def __init__(self, index: int, made: tuple[Any, ...]) -> None: ...
    def tensor(self, stamp: Literal["last", "mean"] = "last") -> NDArray[np.float32]: ...
    def voxels(self, bins: int = 5, normalise: bool = False) -> NDArray[np.float32]: ...

class AffineSequences:
    def __init__(
        self,
        images: str | PathLike[str] | None = None,
        *,
        width: Int = 240,
        height: Int = 180,
        duration: Time = 0.04,
        seed: Int = 1,
        contrast_threshold: Number | tuple[Number, Number] = (0.2, 0.5),
        flow_histogram: str | PathLike[str] | None = None,
        flow_scale: Number = 1.0,
        motion_field_at: Literal["start", "middle", "end"] = "middle",
        event_camera: Mapping[str, Any] | None = None,
    ) -> None: ...
    def __getitem__(self, index: int) -> AffineSequence: ...
