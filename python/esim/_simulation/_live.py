"""Simulations whose body a program moves."""

import os

from .. import _checks, _core
from .._scenario import to_overrides, to_scenario
from ._packets import Packet
from ._simulate import Running


class LiveSimulation(Running):
    """A simulation whose body moves as a program says, step by step. Made by `simulate_live`.

    Also a context manager, which ends it, as a `Simulation`.

    Attributes
    ----------
    start, end, cameras, objects
        As of `Simulation`.
    pose_t : int
        The time of the next pose, ns. Before the first one, the body rests for `latency`.
    latency : int
        The motion is known up to this time before the last pose, ns: one interval, or two if `smooth`. Events are known
        up to a sample later: less than 1 / `min_rate_hz` of the scenario's sampling.
    """

    def __init__(self, core, interval, latency):
        super().__init__(core)
        self._interval = interval
        self._packets = []  # that have not been returned: after a signal
        self.latency = latency
        self.pose_t = self.start + latency + interval

    def _moved(self, poses):
        """Counts poses that the body has taken. Returns the time of the last one, ns."""
        self.pose_t += poses * self._interval
        return self.pose_t - self._interval

    def step(self, T_world_body):
        """Moves the body to its pose at `pose_t`, and simulates up to `latency` before it.

        Parameters
        ----------
        T_world_body : array_like, shape (4, 4)

        Returns
        -------
        list of Packet
            The packets that are complete by now: none, one, or several. After the end of the simulation, the last ones.

        Raises
        ------
        esim.Error
            If the pose is not a rigid motion, or rotated by 180 degrees or more from the last one: the body then stays
            where it is. After the end.
        """
        self._core.push(_checks.pose(T_world_body, "T_world_body"))
        self._moved(1)
        while True:
            self._core.append_next(self._made)
            made = self._made.pop()
            if made is None:
                break
            self._packets.append(Packet(made, self.cameras))
        self._warn_of_losses()
        packets, self._packets = self._packets, []
        return packets


def simulate_live(
    scenario,
    T_world_body,
    *,
    interval_s=0.005,
    smooth=False,
    overrides=None,
    threads=0,
    seed=None,
    out=None,
    force=False,
    packet_s=None,
):
    """Begins a simulation whose body moves as a program says: a robot, an agent, a person with a controller.

    The motion is a spline that passes near the poses: it misses them by about interval_s^2 / 6 times the acceleration.

    Parameters
    ----------
    scenario : path, dict or Scenario
        A YAML file, or its contents as a dict, with `duration_s`. Its trajectory is not used, and may be missing.
    T_world_body : array_like, shape (4, 4)
        The pose at the start.
    interval_s : float
        Time between two poses, s.
    smooth : bool
        Poses become a spline of order 6 instead of 4, whose acceleration is smooth, for an IMU. Adds an interval of latency.
    overrides, threads, seed, out, force
        As of `simulate`.
    packet_s : float, optional
        Length of packets, s. Default: interval_s.

    Returns
    -------
    LiveSimulation
        Its `step` takes the poses, and returns packets.

    Raises
    ------
    esim.Error
        For problems of the scenario or the pose, with the key and the valid values.
    """
    return begin_live(
        scenario,
        T_world_body,
        interval_s=interval_s,
        smooth=smooth,
        overrides=overrides,
        threads=threads,
        seed=seed,
        out=out,
        force=force,
        packet_s=packet_s,
    )


def begin_live(
    scenario, T_world_body, *, interval_s, smooth=False, overrides=None, threads=0, seed=None, out=None, force=False, packet_s=None,
    scene=None,
):
    """simulate_live() with the shared scene of a scenario with the same renderer and cameras, if it is given."""
    interval_s = _checks.number(interval_s, "interval_s", low=1e-6, high=10)
    scenario = to_scenario(scenario)
    seeded = [] if seed is None else [f"seed={_checks.seed(seed)}"]
    values = scenario._read(to_overrides(overrides) + seeded, True, False)
    interval = round(interval_s * 1e9)
    order = 6 if _checks.flag(smooth, "smooth") else 4
    core = _core.Simulation.live(
        values,
        _checks.pose(T_world_body, "T_world_body"),
        interval,
        order,
        "# A program moved the body: the entry trajectory was not used.\n",
        _checks.threads(threads),
        _checks.packet_length(interval_s if packet_s is None else packet_s),
        "" if out is None else os.fspath(out),
        _checks.flag(force, "force"),
        "a program moved the body",
        scene,
    )
    return LiveSimulation(core, interval, (order // 2 - 1) * interval)
