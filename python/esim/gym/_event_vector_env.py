"""An environment for many agents at once."""

from copy import deepcopy

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space, concatenate, create_empty_array

from .. import _checks, _core
from .._errors import Error
from .._simulation import Packet
from ._view import View


class EventVectorEnv(gymnasium.vector.VectorEnv):
    """Many cameras in one scene, each moved by an agent of its own, in one process: they share the scene, and run in
    parallel on all processors.

    As `EventEnv`, with arrays of shape (num_envs, ...). `events` and `packets` of the last step are lists, by agent. Seeds,
    observations and rewards do not depend on the number of threads.

    Parameters
    ----------
    num_envs : int
    scenario, start, and all others
        As of `EventEnv`.
    reward : callable, optional
        `reward(env, infos)`: floats, shape (num_envs,). Default: 0.
    terminated : callable, optional
        `terminated(env, infos)`: bools, shape (num_envs,). Default: False.
    autoreset : str
        After an episode of an agent ends, another begins with its "next_step" (default) or in the "same_step"; its last
        observation and info are then in `infos["final_obs"]` and `infos["final_info"]`.
    """

    metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self, num_envs, scenario, start, *, reward=None, terminated=None, threads=0, autoreset="next_step", **view
    ):
        _checks.one_of(autoreset, "autoreset", ("next_step", "same_step"))
        self._resets_at_once = autoreset == "same_step"
        if self._resets_at_once:
            self.metadata = {**self.metadata, "autoreset_mode": AutoresetMode.SAME_STEP}
        self.num_envs = _checks.whole(num_envs, "num_envs", 1, 100_000)
        self._view = View(scenario, start, threads, **view)
        self.single_observation_space, self.single_action_space = self._view.observation_space, self._view.action_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._reward, self._terminated = reward, terminated
        self._simulations = [None] * self.num_envs
        self._randoms = [None] * self.num_envs
        self._seen = [{} for _ in range(self.num_envs)]
        self._over = np.zeros(self.num_envs, bool)
        self.pose, self.velocity = np.tile(np.eye(4), (self.num_envs, 1, 1)), np.zeros((self.num_envs, 3))
        self._t = np.zeros(self.num_envs, np.int64)
        self._known_until = np.zeros(self.num_envs, np.int64)

    def _begin(self, i):
        if self._simulations[i] is not None:
            self._simulations[i].close()
        random = self._randoms[i]
        self.pose[i], self.velocity[i] = self._view.draw_start(random), 0
        simulation = self._view.begin(self.pose[i], int(random.integers(2**32)), 1)
        self._simulations[i] = simulation
        self._seen[i] = dict(self._view.blank)
        self._t[i] = self._known_until[i] = simulation.start

    def _batch(self, all_seen):
        space = self.single_observation_space
        return concatenate(space, all_seen, create_empty_array(space, self.num_envs))

    def _observe(self, packets):
        self.packets, self.events = packets, [self._view.events(own) for own in packets]
        for i, own in enumerate(packets):
            if own:
                self._known_until[i] = own[-1].t1
        images = self._batch(
            [self._view.observe(seen, events, own, pose) for seen, events, own, pose in zip(self._seen, self.events, packets, self.pose)]
        )
        infos = {"t": self._t, "known_until": self._known_until, "pose": self.pose, "velocity": self.velocity}
        infos = {name: values.copy() for name, values in infos.items()}
        infos["events_left_out"] = np.array([self._view.left_out(own) for own in self.events])
        return images, infos

    def reset(self, *, seed=None, options=None):
        """Begins an episode of each agent. `seed`: an int, to which the number of the agent is added, or one for each."""
        if seed is not None or self._randoms[0] is None:
            if seed is None or np.ndim(seed) == 0:
                first = int(np.random.default_rng().integers(2**32)) if seed is None else seed
                seed = [first + i for i in range(self.num_envs)]
            if len(seed) != self.num_envs:
                raise Error(f"{len(seed)} seeds for {self.num_envs} environments")
            self._randoms = [gymnasium.utils.seeding.np_random(None if one is None else int(one))[0] for one in seed]
        for i in range(self.num_envs):
            self._begin(i)
        self._over[:] = False
        return self._observe([[] for _ in range(self.num_envs)])

    def step(self, actions):
        """Moves all bodies for step_s, except those whose episode has ended before: these begin again."""
        if self._simulations[0] is None:
            raise Error("reset() comes before step()")
        paths, velocities = self._view.motion.move(self.pose, self.velocity, actions)
        fresh = self._over.copy()
        for i in np.flatnonzero(fresh):
            self._begin(i)
        moving = np.flatnonzero(~fresh)
        packets = [[] for _ in range(self.num_envs)]
        if len(moving):
            simulations = [self._simulations[i] for i in moving]
            made = _core.step_together([simulation._core for simulation in simulations], paths[moving], self._view.scene)
            for i, simulation, path, own in zip(moving, simulations, paths[moving], made):
                self.pose[i], self.velocity[i] = path[-1], velocities[i]
                self._t[i] = simulation._moved(len(path))
                packets[i] = [Packet(parts, simulation.cameras) for parts in own]
        images, infos = self._observe(packets)
        ends = np.array([simulation.end + simulation.latency for simulation in self._simulations])
        truncated = ~fresh & (self._t >= ends)
        terminated, rewards = np.zeros(self.num_envs, bool), np.zeros(self.num_envs)
        if self._terminated:
            terminated = np.asarray(self._terminated(self, infos), bool) & ~fresh
        if self._reward:
            rewards = np.where(fresh, 0.0, np.asarray(self._reward(self, infos), np.float64))
        self._over = terminated | truncated
        if self._resets_at_once and self._over.any():
            images, infos = self._begin_again(infos)
        return images, rewards, terminated, truncated, infos

    def _begin_again(self, infos):
        """Begins the next episodes of the agents whose episodes are over; the others keep what they have seen."""
        over, self._over = self._over, np.zeros(self.num_envs, bool)
        final = {"final_obs": np.empty(self.num_envs, object), "_final_obs": over, "final_info": infos, "_final_info": over}
        infos = {name: values.copy() for name, values in infos.items()}
        for i in np.flatnonzero(over):
            final["final_obs"][i] = deepcopy(self._view.chosen(self._seen[i]))
            self._begin(i)
            self._view.observe(self._seen[i], self._view.events([]), [], self.pose[i])
            infos["t"][i] = infos["known_until"][i] = self._t[i]
            infos["pose"][i], infos["velocity"][i], infos["events_left_out"][i] = self.pose[i], 0, 0
        return self._batch([self._view.chosen(seen) for seen in self._seen]), {**infos, **final}

    def close_extras(self, **_):
        """Ends all episodes."""
        for simulation in self._simulations:
            if simulation is not None:
                simulation.close()
        self._simulations = [None] * self.num_envs
