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
from ._motion import Pose, Thrust, Twist

OBSERVATIONS = ("voxels", "counts", "time_surface", "events", "depth", "motion_field", "imu", "pose")
ACTIONS = ("twist", "pose", "thrust")


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
        max_acceleration=20.0,
        action="twist",
        observation="voxels",
        bins=5,
        tau_s=0.03,
        max_events=10_000,
        overrides=None,
    ):
        self.scenario, self.overrides, self.start = to_scenario(scenario), overrides, start
        self.step_s = _checks.number(step_s, "step_s", above=0)
        self.interval_s = _checks.number(interval_s, "interval_s", low=1e-6, high=10)
        poses = round(self.step_s / self.interval_s)  # of a step
        if poses < 1 or abs(poses * self.interval_s - self.step_s) > 1e-9:
            raise Error(f"step_s must be a multiple of interval_s = {interval_s:g} s, not {step_s:g} s")
        velocity = _checks.number(max_velocity, "max_velocity", low=0)
        angular = _checks.number(max_angular_velocity, "max_angular_velocity", low=0)
        acceleration = _checks.number(max_acceleration, "max_acceleration", low=0)
        motion = {"twist": Twist, "pose": Pose, "thrust": Thrust}[_checks.one_of(action, "action", ACTIONS)]
        linear = [acceleration] if motion is Thrust else [velocity] * 3
        self.motion = motion(self.interval_s, poses, np.array([*linear, *[angular] * 3]))
        self.alone = isinstance(observation, str)
        self.names = [_checks.one_of(name, "observation", OBSERVATIONS) for name in ([observation] if self.alone else observation)]
        self.bins = _checks.whole(bins, "bins", 1, 1000)
        self.tau_s = _checks.seconds(tau_s, "tau_s", above=0)
        self.max_events = _checks.whole(max_events, "max_events", 1, 2**31 - 1)
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
            "events": (self.max_events, 4),
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
        self.action_space = self.motion.space

    def draw_start(self, random):
        """The pose at the start of an episode."""
        return np.array(self.start(random) if callable(self.start) else self.start, np.float64)

    def begin(self, pose, seed, threads):
        """A live simulation."""
        return begin_live(
            self.scenario,
            pose,
            interval_s=self.interval_s,
            packet_s=self.interval_s,  # a step ends with the last complete one
            overrides=self.overrides,
            seed=seed,
            threads=threads,
            scene=self.scene,
        )

    def events(self, packets):
        """The events of packets."""
        if len(packets) == 1:
            return packets[0].events
        none = Events(np.empty(0, EVENT_DTYPE), self.width, self.height)
        return np.concatenate([none, *(packet.events for packet in packets)])

    def _padded(self, events, start):
        """The last max_events events as rows (seconds since the start of the step, x, y, polarity), then rows of zeros."""
        rows = np.zeros((self.max_events, 4), np.float32)
        last = events[-self.max_events :]
        rows[: len(last)] = np.column_stack([1e-9 * (last["t"] - start), last["x"], last["y"], np.where(last["p"] > 0, 1, -1)])
        return rows

    def left_out(self, events):
        """Events of a step for which an observation of events has no place."""
        return max(0, len(events) - self.max_events) if "events" in self.names else 0

    def observe(self, seen, events, packets, pose):
        """The observation, to be copied. `seen`: what the agent saw last, by name; is replaced by what it sees now."""
        span = {"t0": _checks.ns(packets[0].t0), "t1": _checks.ns(packets[-1].t1)} if packets else {}
        for name in self.names:
            if name == "counts":
                seen[name] = event_count(events).astype(np.float32)
            elif name == "events":
                seen[name] = self._padded(events, packets[0].t0 if packets else 0)
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
        return self.chosen(seen)

    def chosen(self, seen):
        """What the agent saw last, as its observation."""
        return seen[self.names[0]] if self.alone else {name: seen[name] for name in self.names}
