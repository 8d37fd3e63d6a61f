"""esim: an open event-camera simulator.

Returned times are ints in nanoseconds. Time arguments are floats in seconds, or nanoseconds as `esim.ns(...)`; a bare
int is refused, since it has no unit. Irradiance is linear with 1 = white; pixel centres are at integer coordinates;
T_A_B maps points from frame B to frame A; quaternions are Hamilton, x y z w. `docs/python.md` is the guide, and
`docs/scenario.md` lists the options of scenarios.
"""

from . import _processor, dataset, filters, interpolators  # first, _processor checks that the module can run
from ._checks import ns
from ._core import __version__
from ._errors import Error, InternalError, LossWarning, OutputError
from ._event_camera import EventCamera, linear_light
from ._events import Events
from ._files import EventsIterator, formats, info, load_events, save_events
from ._pictures import play, space_time_plot, time_surface_picture
from ._recordings import Recording, convert
from ._represent import (
    event_count,
    event_frame,
    event_tensor,
    time_surface,
    voxel_grid,
)
from ._scenario import Scenario
from ._sensor import Sensor
from ._simulation import CameraPacket, LiveSimulation, Packet, Renderer, Report, Simulation, simulate, simulate_live
from ._trajectory import Trajectory
from ._types import CAUSES, EVENT_DTYPE, IMU_DTYPE, LABEL_DTYPE, STATE_DTYPE
from .interpolators._video import video

__all__ = [
    "CAUSES",
    "EVENT_DTYPE",
    "IMU_DTYPE",
    "LABEL_DTYPE",
    "STATE_DTYPE",
    "CameraPacket",
    "LossWarning",
    "Error",
    "EventCamera",
    "Events",
    "EventsIterator",
    "InternalError",
    "LiveSimulation",
    "OutputError",
    "Packet",
    "Recording",
    "Renderer",
    "Report",
    "Scenario",
    "Sensor",
    "Simulation",
    "Trajectory",
    "__version__",
    "convert",
    "event_count",
    "event_frame",
    "event_tensor",
    "formats",
    "info",
    "linear_light",
    "load_events",
    "ns",
    "play",
    "save_events",
    "simulate",
    "simulate_live",
    "space_time_plot",
    "time_surface",
    "time_surface_picture",
    "video",
    "voxel_grid",
]
