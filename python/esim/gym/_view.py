"""What the environments share: how an agent moves and what it sees."""

import gymnasium
import numpy as np

from .. import _checks, _core
from .._errors import Error
from .._events import Events
from .._represent import event_count, time_surface, voxel_grid
from .._scenario import to_overrides, to_scenario
from .._simulation import begin_live
from .._types import EVENT_DTYPE


def rotation(vectors):
    """The rotation matrices (..., 3, 3) of rotation vectors (..., 3), rad."""
    vectors = np.asarray(vectors, np.float64)
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    K = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*vectors.shape, 3)
    return np.eye(3) + np.sinc(angle / np.pi) * K + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * (K @ K)


OBSERVATIONS = ("voxels", "counts", "time_surface", "depth", "motion_field", "imu", "pose")


class View:
    """The arguments of an environment, checked, and its scene, which all its simulations share."""

    def __init__(
        self,
        scenario,
        start,
        threads,
        *,
        step_s=0.01,
        interval_s=0.005,
        max_velocity=1.0,
        max_angular_velocity=1.0,
        observation="voxels",
        bins=5,
        tau_s=0.03,
        overrides=None,
    ):
        self.scenario, self.overrides, self.start = to_scenario(scenario), overrides, start
        self.step_s = _checks.number(step_s, "step_s", above=0)
        self.interval_s = _checks.number(interval_s, "interval_s", low=1e-6, high=10)
        self.poses = round(self.step_s / self.interval_s)  # of a step
        if self.poses < 1 or abs(self.poses * self.interval_s - self.step_s) > 1e-9:
            raise Error(f"step_s must be a multiple of interval_s = {interval_s:g} s, not {step_s:g} s")
        velocity = _checks.number(max_velocity, "max_velocity", low=0)
        angular = _checks.number(max_angular_velocity, "max_angular_velocity", low=0)
        self.limits = np.array([velocity] * 3 + [angular] * 3)
        self.alone = isinstance(observation, str)
        self.names = [_checks.one_of(name, "observation", OBSERVATIONS) for name in ([observation] if self.alone else observation)]
        self.bins = _checks.whole(bins, "bins", 1, 1000)
        self.tau_s = _checks.seconds(tau_s, "tau_s", above=0)
        values = self.scenario._read(to_overrides(overrides), True, False)
        self.scene = _core.SharedScene(values, _checks.threads(threads))
        with self.begin(self.draw_start(np.random.default_rng(0)), 0, 1) as simulation:
            (camera,) = simulation.cameras.values()
        if camera["sensors"]:
            raise Error("the scenario has several event sensors: name one in event_camera")
        self.width, self.height = camera["width"], camera["height"]
        size = (self.height, self.width)
        shapes = {
            "voxels": (self.bins, *size),
            "counts": (2, *size),
            "time_surface": (2, *size),
            "depth": size,
            "motion_field": (2, *size),
            "imu": (6,),
            "pose": (4, 4),
        }
        limits = {"counts": (0, np.inf), "time_surface": (0, 1), "depth": (0, np.inf)}
        spaces = {
            name: gymnasium.spaces.Box(*limits.get(name, (-np.inf, np.inf)), shapes[name], np.float32) for name in self.names
        }
        self.observation_space = spaces[observation] if self.alone else gymnasium.spaces.Dict(spaces)
        self.blank = {name: np.zeros(space.shape, np.float32) for name, space in spaces.items()}
        self.action_space = gymnasium.spaces.Box(-1, 1, (6,), np.float32)

    def draw_start(self, random):
        """The pose at the start of an episode."""
        return np.array(self.start(random) if callable(self.start) else self.start, np.float64)

    def begin(self, pose, seed, threads):
        """A live simulation."""
        return begin_live(
            self.scenario,
            pose,
            interval_s=self.interval_s,
            packet_s=self.step_s,
            overrides=self.overrides,
            seed=seed,
            threads=threads,
            scene=self.scene,
        )

    def move(self, poses, actions):
        """The poses of a step, (N, self.poses, 4, 4), from poses (N, 4, 4) on: constant velocities in the bodies' frames."""
        actions = np.asarray(actions, np.float64)
        if actions.shape != (len(poses), 6) or not np.isfinite(actions).all():
            raise Error(f"actions must be 6 finite numbers for each body, not {actions}")
        twists = np.clip(actions, -1, 1) * self.limits
        turns = rotation(self.interval_s * twists[:, 3:])
        moved = np.empty((len(poses), self.poses, 4, 4))
        for k in range(self.poses):
            R = poses[:, :3, :3]
            moved[:, k] = poses
            moved[:, k, :3, 3] += self.interval_s * (R @ twists[:, :3, None])[..., 0]
            moved[:, k, :3, :3] = R @ turns
            poses = moved[:, k]
        return moved

    def events(self, packets):
        """The events of packets."""
        if len(packets) == 1:
            return packets[0].events
        none = Events(np.empty(0, EVENT_DTYPE), self.width, self.height)
        return np.concatenate([none, *(packet.events for packet in packets)])

    def observe(self, seen, events, packets, pose):
        """The observation, to be copied. `seen`: what the agent saw last, by name; is replaced by what it sees now."""
        span = {"t0": _checks.ns(packets[0].t0), "t1": _checks.ns(packets[-1].t1)} if packets else {}
        for name in self.names:
            if name == "counts":
                seen[name] = event_count(events).astype(np.float32)
            elif name == "voxels":
                seen[name] = voxel_grid(events, bins=self.bins, **span) if packets else self.blank[name]
            elif name == "pose":
                seen[name] = pose.astype(np.float32)
            elif name == "time_surface" and packets:
                faded = np.float32(np.exp(-1e-9 * (packets[-1].t1 - packets[0].t0) / self.tau_s)) * seen[name]
                seen[name] = np.maximum(faded, time_surface(events, t=span["t1"], tau_s=self.tau_s))
            for packet in packets:
                if name in ("depth", "motion_field") and len(getattr(packet, name)):
                    seen[name] = getattr(packet, name)[-1]
                elif name == "imu" and len(packet.imu):
                    last = packet.imu[-1]
                    seen[name] = np.concatenate([last["angular_rate"], last["specific_force"]]).astype(np.float32)
        return seen[self.names[0]] if self.alone else {name: seen[name] for name in self.names}
