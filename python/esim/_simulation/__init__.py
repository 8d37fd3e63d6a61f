"""Simulations and their packets."""

from ._live import LiveSimulation, begin_live, simulate_live
from ._packets import CameraPacket, Packet
from ._simulate import Renderer, Report, Simulation, simulate

__all__ = [
    "CameraPacket",
    "LiveSimulation",
    "Packet",
    "Renderer",
    "Report",
    "Simulation",
    "begin_live",
    "simulate",
    "simulate_live",
]
