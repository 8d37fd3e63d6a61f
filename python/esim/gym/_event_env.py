"""An environment for one agent."""

from copy import deepcopy

import gymnasium
import numpy as np

from .._errors import Error
from ._view import View


class EventEnv(gymnasium.Env):
    """A camera that an agent moves. Subclasses, or the arguments, define start, reward and end.

    Observations are float32 arrays of what is known by the end of the step: `info["known_until"]`. This lags behind `t` by
    interval_s, and by up to interval_s and the time between two samples (`sampling.min_rate_hz`) more; it does not if
    sampling is `uniform` at a multiple of the rate of the steps. `info` has `t` (the time of the step's last pose, ns; the body
    rests for interval_s before the first step), `known_until` (ns), `pose` (4, 4), `velocity` (3,; m/s, in the world) and
    `events_left_out` (the number of events for which the observation "events" had no place). The environment itself has
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
    threads : int
        0 uses every processor.
    step_s : float
        Simulated time of a step, s: a multiple of interval_s. Default: 0.01.
    interval_s : float
        Time between two poses, s, as of `esim.simulate_live`. Default: 0.005.
    action : str
        Default: "twist".

        - "twist", (6,): velocity and angular velocity in the body's frame, x y z, each from -1 to 1 times its limit;
        - "pose", (6,): position (m) and rotation vector (rad) in the world at the end of the step;
        - "thrust", (4,): acceleration along the body's z axis, from 0 to 1 times its limit, and angular velocity in the
          body's frame, from -1 to 1 times its limit. Gravity is 9.81 m/s^2 along -z of the world. Starts at rest.
    max_velocity, max_angular_velocity, max_acceleration : float
        m/s, rad/s, m/s^2. Default: 1, 1, 20.
    observation : str, or list of str
        Default: "voxels". What the agent sees: one array, or a dict of arrays.

        - "voxels", (bins, height, width): `esim.voxel_grid` of the events of the step;
        - "counts", (2, height, width): `esim.event_count` of these;
        - "time_surface", (2, height, width): `esim.time_surface` of all events so far;
        - "events", (max_events, 4): the last events of the step as rows: seconds since its start, x, y, polarity (1 or -1);
          then rows of zeros;
        - "depth", (height, width), m, and "motion_field", (2, height, width), px/s: the latest ground truth;
        - "imu", (6,): the latest angular rate and specific force;
        - "pose", (4, 4): of the body.
    bins : int
        Of the voxel grid. Default: 5.
    tau_s : float
        Of the time surface, s. Default: 0.03.
    max_events : int
        Rows of the observation "events". Default: 10000.
    overrides : dict or list of str, optional
        Options of the scenario to change.
    """

    metadata = {"render_modes": []}

    def __init__(self, scenario, start, *, reward=None, terminated=None, threads=0, **view):
        self._view = View(scenario, start, threads, **view)
        self.observation_space, self.action_space = self._view.observation_space, self._view.action_space
        self._reward, self._terminated, self._threads = reward, terminated, threads
        self._simulation = None

    def _observe(self, packets):
        """The observation, and info."""
        self.packets, self.events = packets, self._view.events(packets)
        if packets:
            self._known_until = packets[-1].t1
        info = {"t": self._t, "known_until": self._known_until, "pose": self.pose.copy(), "velocity": self.velocity.copy()}
        info["events_left_out"] = self._view.left_out(self.events)
        return deepcopy(self._view.observe(self._seen, self.events, packets, self.pose)), info

    def reset(self, *, seed=None, options=None):
        """Begins an episode with a sensor of its own: its noise follows from `seed`."""
        super().reset(seed=seed)
        self.close()
        self.pose, self.velocity = self._view.draw_start(self.np_random), np.zeros(3)
        self._seen = dict(self._view.blank)
        self._simulation = self._view.begin(self.pose, int(self.np_random.integers(2**32)), self._threads)
        self._t = self._known_until = self._simulation.start
        return self._observe([])

    def step(self, action):
        """Moves the body for step_s."""
        if self._simulation is None:
            raise Error("reset() comes before step()")
        packets, truncated = [], False
        (path,), (self.velocity,) = self._view.motion.move(self.pose[None], self.velocity[None], [action])
        for pose in path:
            self.pose, self._t = pose, self._simulation.pose_t
            packets += self._simulation.step(pose)
            truncated = self._t - self._simulation.latency >= self._simulation.end
            if truncated:
                break
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
