"""The environment."""

import gymnasium
import numpy as np

from .. import _checks
from .._errors import Error
from .._events import Events
from .._represent import event_count, voxel_grid
from .._scenario import to_scenario
from .._simulate import simulate_live
from .._types import EVENT_DTYPE


def rotation(vector):
    """The rotation matrix of a rotation vector, rad."""
    angle = np.linalg.norm(vector)
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = vector / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K)


class EventEnv(gymnasium.Env):
    """A camera that an agent moves. Subclasses, or the arguments, define start, reward and end.

    Observations are images of the events of the step: float32, shape (bins, height, width) or (2, height, width). They are
    those that are known by then: `info["known_until"]`. The action is a twist of the body: velocity (m/s) and angular
    velocity (rad/s) in its own frame, x y z, each from -1 to 1 times its limit.

    `info` has `t` (the time of the step's last pose, ns), `known_until` (ns) and `pose` (4, 4). The environment itself has
    `events` (esim.Events) and `packets` of the last step, with ground truth and IMU if the scenario has them.

    Parameters
    ----------
    scenario : path, dict or Scenario
        With one camera and one event sensor. Its duration_s is the longest episode; `truncated` is then True.
    start : array_like, shape (4, 4), or callable
        The pose at the start of an episode, or a function of a `numpy.random.Generator` that draws it.
    reward : callable, optional
        `reward(env, info)`: a float. Default: 0.
    terminated : callable, optional
        `terminated(env, info)`: whether the episode ends. Default: never.
    step_s : float
        Simulated time of a step, s: a multiple of interval_s.
    interval_s : float
        Time between two poses, s, as of `esim.simulate_live`.
    max_velocity, max_angular_velocity : float
        m/s, rad/s.
    observation : {"voxels", "counts"}
        `esim.voxel_grid`, or `esim.event_count`.
    bins : int
        Of the voxel grid.
    overrides : dict or list of str, optional
        Options of the scenario to change.
    threads : int
        0 uses every processor.
    """

    metadata = {"render_modes": []}

    def __init__(
        self,
        scenario,
        start,
        *,
        reward=None,
        terminated=None,
        step_s=0.01,
        interval_s=0.005,
        max_velocity=1.0,
        max_angular_velocity=1.0,
        observation="voxels",
        bins=5,
        overrides=None,
        threads=0,
    ):
        self.scenario = to_scenario(scenario)
        self._start, self._reward, self._terminated = start, reward, terminated
        self.step_s = _checks.number(step_s, "step_s", above=0)
        self.interval_s = _checks.number(interval_s, "interval_s", low=1e-6, high=10)
        self._poses = round(self.step_s / self.interval_s)
        if self._poses < 1 or abs(self._poses * self.interval_s - self.step_s) > 1e-9:
            raise Error(f"step_s must be a multiple of interval_s = {interval_s:g} s, not {step_s:g} s")
        self.limits = np.repeat(
            [
                _checks.number(max_velocity, "max_velocity", low=0),
                _checks.number(max_angular_velocity, "max_angular_velocity", low=0),
            ],
            3,
        )
        self._observation = _checks.one_of(observation, "observation", ("voxels", "counts"))
        self._bins = _checks.whole(bins, "bins", 1, 1000)
        self._overrides, self._threads = overrides, threads
        self._simulation = None
        with self._begin(self._draw_start(np.random.default_rng(0)), 0) as simulation:
            (camera,) = simulation.cameras.values()
        if camera["sensors"]:
            raise Error("the scenario has several event sensors: name one in event_camera")
        self.width, self.height = camera["width"], camera["height"]
        channels = self._bins if self._observation == "voxels" else 2
        low = -np.inf if self._observation == "voxels" else 0
        self.observation_space = gymnasium.spaces.Box(low, np.inf, (channels, self.height, self.width), np.float32)
        self.action_space = gymnasium.spaces.Box(-1, 1, (6,), np.float32)

    def _draw_start(self, random):
        return np.array(self._start(random) if callable(self._start) else self._start, np.float64)

    def _begin(self, pose, seed):
        return simulate_live(
            self.scenario, pose, interval_s=self.interval_s, packet_s=self.step_s, overrides=self._overrides, seed=seed,
            threads=self._threads,
        )

    def _observe(self, packets):
        """The observation, and info."""
        none = Events(np.empty(0, EVENT_DTYPE), self.width, self.height)
        self.packets = packets
        self.events = np.concatenate([none, *(packet.events for packet in packets)])
        if packets:
            self._known_until = packets[-1].t1
        if self._observation == "counts":
            image = event_count(self.events).astype(np.float32)
        elif packets:
            image = voxel_grid(self.events, bins=self._bins, t0=_checks.ns(packets[0].t0), t1=_checks.ns(packets[-1].t1))
        else:
            image = np.zeros(self.observation_space.shape, np.float32)
        return image, {"t": self._t, "known_until": self._known_until, "pose": self.pose.copy()}

    def reset(self, *, seed=None, options=None):
        """Begins an episode with a sensor of its own: its noise follows from `seed`."""
        super().reset(seed=seed)
        self.close()
        self.pose = self._draw_start(self.np_random)
        self._simulation = self._begin(self.pose, int(self.np_random.integers(2**32)))
        self._t = self._known_until = self._simulation.start
        return self._observe([])

    def step(self, action):
        """Moves the body for step_s."""
        if self._simulation is None:
            raise Error("reset() comes before step()")
        twist = np.clip(np.asarray(action, np.float64), -1, 1) * self.limits
        packets = []
        for _ in range(self._poses):
            self.pose[:3, 3] += self.interval_s * self.pose[:3, :3] @ twist[:3]
            self.pose[:3, :3] = self.pose[:3, :3] @ rotation(self.interval_s * twist[3:])
            self._t = self._simulation.pose_t
            packets += self._simulation.step(self.pose)
            if self._t - self._simulation.latency >= self._simulation.end:
                break
        truncated = self._t - self._simulation.latency >= self._simulation.end
        image, info = self._observe(packets)
        terminated = bool(self._terminated(self, info)) if self._terminated else False
        reward = float(self._reward(self, info)) if self._reward else 0.0
        if terminated or truncated:
            self.close()
        return image, reward, terminated, truncated, info

    def close(self):
        """Ends the episode."""
        simulation, self._simulation = self._simulation, None
        if simulation is not None:
            simulation.close()
