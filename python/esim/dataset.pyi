# The surface of dataset.py. Docstrings there have shapes and units.
from collections.abc import Mapping
from os import PathLike
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

class AffineSequence:
    index: int
    duration: int
    events: NDArray[np.void]
    flow: NDArray[np.float32]
    flow_t: int
    displacement: NDArray[np.float32]
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
        width: int = 240,
        height: int = 180,
        duration: float = 0.04,
        seed: int = 1,
        contrast_threshold: float | tuple[float, float] = (0.2, 0.5),
        flow_histogram: str | PathLike[str] | None = None,
        flow_scale: float = 1.0,
        flow_at: Literal["start", "middle", "end"] = "middle",
        event_camera: Mapping[str, Any] | None = None,
    ) -> None: ...
    def __getitem__(self, index: int) -> AffineSequence: ...
