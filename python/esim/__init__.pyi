# The public interface, written by hand; tests/test_stubs.py compares it with the package. Docstrings give shapes and
# units.
import datetime
from collections.abc import Callable, Iterable, Iterator, Mapping
from os import PathLike
from types import TracebackType
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import dataset as dataset
from . import filters as filters
from . import interpolators as interpolators

Path: TypeAlias = str | PathLike[str]
Int: TypeAlias = int | np.integer[Any]
Number: TypeAlias = float | np.floating[Any] | np.integer[Any]
Duration: TypeAlias = np.timedelta64 | datetime.timedelta
Time: TypeAlias = float | np.floating[Any] | Duration  # float: s; esim.ns() for int ns
EventsLike: TypeAlias = NDArray[np.void]  # EVENT_DTYPE, or with the fields t, x, y and p

__version__: str

EVENT_DTYPE: np.dtype[np.void]
IMU_DTYPE: np.dtype[np.void]
LABEL_DTYPE: np.dtype[np.void]
CAUSES: tuple[str, ...]
STATE_DTYPE: np.dtype[np.void]

class Error(ValueError): ...
class OutputError(Error, OSError): ...
class InternalError(RuntimeError): ...
class LossWarning(UserWarning): ...

class Events(NDArray[np.void]):
    width: int | None
    height: int | None
    def __new__(cls, events: EventsLike, width: Int | None = None, height: Int | None = None) -> Events: ...

def ns(t: ArrayLike) -> Any: ...

class Scenario:
    def __init__(self, options: Mapping[str, Any], *, folder: Path | None = None) -> None: ...
    @classmethod
    def load(cls, path: Path) -> Scenario: ...
    def set(self, key: str, value: Any) -> Scenario: ...
    def to_yaml(self) -> str: ...

class Trajectory:
    @classmethod
    def from_poses(
        cls,
        t: ArrayLike,
        poses: ArrayLike | tuple[ArrayLike, ArrayLike],
        *,
        order: Int = 5,
        knot_interval_s: Number = 0.0,
        smoothing_time_s: Number = 0.0,
    ) -> Trajectory: ...
    @classmethod
    def load(
        cls,
        path: Path,
        *,
        rate_hz: Number | None = None,
        scale: Number = 1.0,
        up: ArrayLike | None = None,
        order: Int = 5,
        knot_interval_s: Number = 0.0,
        smoothing_time_s: Number = 0.0,
    ) -> Trajectory: ...
    @property
    def start(self) -> int: ...
    @property
    def end(self) -> int: ...
    @property
    def fit(self) -> dict[str, float]: ...
    def at(self, t: ArrayLike) -> NDArray[np.void]: ...
    def pose(self, t: ArrayLike) -> NDArray[np.float64]: ...

class EventCamera:
    def __init__(
        self, width: Int, height: Int, preset: str | None = None, *, seed: Int = 0, threads: Int = 0, **options: Any
    ) -> None: ...
    def process(self, frame: NDArray[np.floating], t: Time) -> Events: ...
    @property
    def labels(self) -> NDArray[np.void]: ...
    @property
    def dropped(self) -> int: ...
    @property
    def delayed(self) -> int: ...

class Sensor:
    frame_shape: tuple[int, int]
    margin_px: int
    def __init__(
        self,
        camera: dict[str, Any],
        preset: str | None = None,
        *,
        axes: str = "opencv",
        supersampling: Int = 1,
        margin_px: Int = 0,
        lambda_px: float | None = None,
        seed: Int = 0,
        threads: Int = 0,
        **options: Any,
    ) -> None: ...
    def step(
        self,
        t: Time,
        irradiance: NDArray[np.floating],
        depth: NDArray[np.floating],
        pose: ArrayLike | None = None,
        *,
        motion: NDArray[np.floating] | None = None,
        objects: NDArray[np.integer] | None = None,
        object_poses: dict[int, ArrayLike] | None = None,
    ) -> Events: ...
    @property
    def statistics(self) -> dict[str, float]: ...

def linear_light(image: NDArray[np.uint8] | NDArray[np.uint16]) -> NDArray[np.float32]: ...

class CameraPacket:
    sensors: dict[str, CameraPacket]
    events: Events
    labels: NDArray[np.void]
    truth_t: NDArray[np.int64]
    pose: NDArray[np.float64]
    irradiance: NDArray[np.float32]
    depth: NDArray[np.float32]
    motion_field: NDArray[np.float32]
    object: NDArray[np.uint16]
    optical_flow: NDArray[np.float32]
    optical_flow_t: NDArray[np.int64]
    visible: NDArray[np.uint8]
    event_points: NDArray[np.float32]
    images: NDArray[np.uint8] | NDArray[np.uint16]
    image_t: NDArray[np.int64]
    exposure_start: NDArray[np.int64]
    exposure: NDArray[np.int64]
    trigger_t: NDArray[np.int64]
    trigger_kind: NDArray[np.uint8]

class Packet(CameraPacket):  # the attributes of the only camera
    t0: int
    t1: int
    cameras: dict[str, CameraPacket]
    body: NDArray[np.void]
    objects: NDArray[np.float64]
    imu: NDArray[np.void]
    def __getitem__(self, name: str) -> CameraPacket: ...

class Renderer:
    def __init__(
        self,
        render: Callable[[int, NDArray[np.float64], list[NDArray[np.float64]]], Mapping[str, ArrayLike]],
        *,
        objects: Mapping[str, Trajectory] | None = None,
    ) -> None: ...

class Report(dict[str, Any]):
    @property
    def dropped(self) -> dict[str, int]: ...
    @property
    def delayed(self) -> dict[str, int]: ...
    @property
    def notices(self) -> list[str]: ...

class Simulation(Iterator[Packet]):
    start: int
    end: int
    cameras: dict[str, dict[str, Any]]
    objects: list[str]
    def __iter__(self) -> Simulation: ...
    def __next__(self) -> Packet: ...
    def run(self) -> Report: ...
    def close(self) -> None: ...
    @property
    def report(self) -> Report | None: ...
    def __enter__(self) -> Simulation: ...
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

def simulate(
    scenario: Path | Mapping[str, Any] | Scenario,
    *,
    overrides: Mapping[str, Any] | Iterable[str] | None = None,
    threads: Int = 0,
    seed: Int | None = None,
    out: Path | None = None,
    force: bool = False,
    packet_s: Number | None = None,
    trajectory: Trajectory | None = None,
    renderer: Renderer | Callable[..., Mapping[str, ArrayLike]] | None = None,
    cache: Path | Literal[False] | None = None,
    cache_bytes: Int = 10_000_000_000,
) -> Simulation: ...

class LiveSimulation:
    start: int
    end: int
    cameras: dict[str, dict[str, Any]]
    objects: list[str]
    pose_t: int
    latency: int
    def step(self, T_world_body: ArrayLike) -> list[Packet]: ...
    def close(self) -> None: ...
    @property
    def report(self) -> Report | None: ...
    def __enter__(self) -> LiveSimulation: ...
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

def simulate_live(
    scenario: Path | Mapping[str, Any] | Scenario,
    T_world_body: ArrayLike,
    *,
    interval_s: Number = 0.005,
    smooth: bool = False,
    overrides: Mapping[str, Any] | Iterable[str] | None = None,
    threads: Int = 0,
    seed: Int | None = None,
    out: Path | None = None,
    force: bool = False,
    packet_s: Number | None = None,
) -> LiveSimulation: ...

class EventsIterator(Iterator[Events]):
    def __init__(
        self,
        path: Path,
        delta_t: Time | None = None,
        n_events: Int | None = None,
        *,
        start: Time | None = None,
        width: Int | None = None,
        height: Int | None = None,
    ) -> None: ...
    @property
    def size(self) -> tuple[int, int] | None: ...
    def __iter__(self) -> EventsIterator: ...
    def __next__(self) -> Events: ...

class Recording(Iterator[Packet]):
    def __init__(
        self,
        path: Path,
        packet_s: Number | None = None,
        *,
        width: Int | None = None,
        height: Int | None = None,
        recover: bool = False,
    ) -> None: ...
    @property
    def info(self) -> dict[str, Any]: ...
    def __iter__(self) -> Recording: ...
    def __next__(self) -> Packet: ...

def convert(
    source: Path,
    target: Path,
    *,
    format: str | None = None,
    camera: str | None = None,
    from_zero: bool = False,
    time_unit: Literal["us", "ns"] = "us",
    recover: bool = False,
    force: bool = False,
) -> dict[str, int]: ...
def load_events(path: Path, *, width: Int | None = None, height: Int | None = None) -> Events: ...
def save_events(
    path: Path, events: EventsLike, width: Int | None = None, height: Int | None = None, *, format: str | None = None
) -> None: ...
def info(path: Path) -> dict[str, Any]: ...
def formats() -> list[dict[str, Any]]: ...
def event_count(events: EventsLike, width: Int | None = None, height: Int | None = None) -> NDArray[np.int32]: ...
def event_tensor(
    events: EventsLike,
    width: Int | None = None,
    height: Int | None = None,
    *,
    t0: Time | None = None,
    t1: Time | None = None,
    stamp: Literal["last", "mean"] = "last",
) -> NDArray[np.float32]: ...
def voxel_grid(
    events: EventsLike,
    width: Int | None = None,
    height: Int | None = None,
    bins: Int = 5,
    *,
    t0: Time | None = None,
    t1: Time | None = None,
    normalise: bool = False,
) -> NDArray[np.float32]: ...
def time_surface(
    events: EventsLike,
    width: Int | None = None,
    height: Int | None = None,
    *,
    t: Time | None = None,
    tau_s: Number = 0.03,
) -> NDArray[np.float32]: ...
def event_frame(events: EventsLike, width: Int | None = None, height: Int | None = None) -> NDArray[np.uint8]: ...
def time_surface_picture(
    events: EventsLike,
    width: Int | None = None,
    height: Int | None = None,
    *,
    t: Time | None = None,
    tau_s: Number = 0.03,
) -> NDArray[np.uint8]: ...
def space_time_plot(
    events: EventsLike,
    width: Int | None = None,
    height: Int | None = None,
    *,
    size: tuple[int, int] = (960, 720),
    yaw_deg: Number = 35.0,
    pitch_deg: Number = 20.0,
) -> NDArray[np.uint8]: ...
def video(
    input: Path,
    out: Path,
    *,
    interpolator: interpolators.Interpolator | None = None,
    overrides: Mapping[str, Any] | Iterable[str] | None = None,
    threads: Int = 0,
    seed: Int = 0,
    force: bool = False,
    fps: Number | None = None,
    slow_motion: Number = 1.0,
    start_s: Number = 0.0,
    duration_s: Number | None = None,
    encoding: Literal["auto", "srgb", "linear"] = "auto",
    bayer: bool = False,
    interpolation: bool = True,
    lambda_px: Number = 0.5,
    max_steps: Int = 200,
) -> dict[str, Any]: ...

class play(Iterator[NDArray[np.uint8]]):
    times: NDArray[np.int64]
    def __init__(
        self,
        path: Path,
        *,
        views: str | list[str] | None = None,
        camera: str | None = None,
        at_s: Number | None = None,
        fps: Number = 30.0,
        slow_motion: Number | None = None,
        start_s: Number = 0.0,
        duration_s: Number | None = None,
        window_s: Number | None = None,
        window_events: Int | None = None,
        tau_s: Number | None = None,
        span_s: Number | None = None,
        size: Int | None = None,
        light: bool = False,
        width: Int | None = None,
        height: Int | None = None,
    ) -> None: ...
    def __len__(self) -> int: ...
    def __next__(self) -> NDArray[np.uint8]: ...
