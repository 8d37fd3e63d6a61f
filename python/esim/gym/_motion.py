"""How actions move bodies."""

import gymnasium
import numpy as np

from .._errors import Error

GRAVITY = np.array([0, 0, -9.81])  # m/s^2, in the world


def rotation(vectors):
    """The rotation matrices (..., 3, 3) of rotation vectors (..., 3), rad."""
    vectors = np.asarray(vectors, np.float64)
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    K = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*vectors.shape, 3)
    return np.eye(3) + np.sinc(angle / np.pi) * K + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * (K @ K)


def rotation_vector(rotations):
    """The rotation vectors (N, 3), of at most pi, of rotation matrices (N, 3, 3)."""
    vectors = np.empty((len(rotations), 3))
    for vector, R in zip(vectors, rotations):
        # Quaternions, from the largest of four forms, are accurate at any angle.
        squares = np.array([np.trace(R), *np.diag(R)])
        k = int(np.argmax(squares))
        differences = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
        if k == 0:
            q = np.array([1 + squares[0], *differences])
        else:
            i = k - 1
            q = np.array([differences[i], *(R[i] + R[:, i])])
            q[k] = 1 + 2 * R[i, i] - squares[0]
        q *= (1 if q[0] >= 0 else -1) / np.linalg.norm(q)
        sine = np.linalg.norm(q[1:])
        vector[:] = q[1:] * (2 * np.arctan2(sine, q[0]) / sine if sine > 0 else 2)
    return vectors


class Motion:
    """Moves bodies for a step. The poses of a step are interval_s apart."""

    size, box = 6, (-1, 1)  # of an action

    def __init__(self, interval_s, count, limits):
        self.interval_s, self.count, self.limits = interval_s, count, limits

    @property
    def space(self):
        return gymnasium.spaces.Box(*self.box, (self.size,), np.float32)

    def move(self, poses, velocities, actions):
        """The poses of a step (N, count, 4, 4), and velocities at its end (N, 3; m/s, in the world), of bodies that
        begin with `poses` (N, 4, 4) and `velocities`."""
        actions = np.asarray(actions, np.float64)
        if actions.shape != (len(poses), self.size) or not np.isfinite(actions).all():
            raise Error(f"actions must be {self.size} finite numbers for each body, not {actions}")
        return self._move(np.array(poses), np.array(velocities), actions)

    def _along(self, poses, rates, displacements):
        """Poses that turn at angular velocities (N, 3; rad/s, in the body's frame). displacements(R): in an interval."""
        turns = rotation(self.interval_s * rates)
        moved = np.empty((len(poses), self.count, 4, 4))
        for k in range(self.count):
            R = poses[:, :3, :3]
            moved[:, k] = poses
            moved[:, k, :3, 3] += displacements(R)
            moved[:, k, :3, :3] = R @ turns
            poses = moved[:, k]
        return moved


class Twist(Motion):
    """Velocity and angular velocity in the body's frame, from -1 to 1 times their limits."""

    def _move(self, poses, velocities, actions):
        twists = np.clip(actions, -1, 1) * self.limits
        moved = self._along(poses, twists[:, 3:], lambda R: self.interval_s * (R @ twists[:, :3, None])[..., 0])
        return moved, (moved[:, -1, :3, :3] @ twists[:, :3, None])[..., 0]


class Pose(Motion):
    """Position (m) and rotation vector (rad) of the body in the world at the end of the step."""

    box = (-np.inf, np.inf)

    def _move(self, poses, velocities, actions):
        step_s = self.count * self.interval_s
        velocities = (actions[:, :3] - poses[:, :3, 3]) / step_s
        turns = rotation_vector(np.swapaxes(poses[:, :3, :3], 1, 2) @ rotation(actions[:, 3:]))
        return self._along(poses, turns / step_s, lambda R: self.interval_s * velocities), velocities


class Thrust(Motion):
    """Acceleration along the body's z axis, from 0 to 1 times its limit, and angular velocity in the body's frame, from
    -1 to 1 times its limit; gravity along -z of the world."""

    size = 4

    @property
    def space(self):
        return gymnasium.spaces.Box(np.array([0, -1, -1, -1], np.float32), np.float32(1))

    def _move(self, poses, velocities, actions):
        thrust = np.clip(actions[:, 0], 0, 1) * self.limits[0]

        def fall(R):
            acceleration = R[:, :, 2] * thrust[:, None] + GRAVITY
            displacement = self.interval_s * velocities + 0.5 * self.interval_s**2 * acceleration
            velocities[:] += self.interval_s * acceleration
            return displacement

        return self._along(poses, np.clip(actions[:, 1:], -1, 1) * self.limits[1:], fall), velocities
