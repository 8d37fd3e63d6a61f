"""Rotation matrices (..., 3, 3) and quaternions (..., 4), x y z w."""
import numpy as np


def about(axis, angle):
    """Rotations about the x, y or z axis (0, 1, 2) by angles in radians."""
    angle = np.asarray(angle, float)
    c, s, matrix = np.cos(angle), np.sin(angle), np.zeros((*angle.shape, 3, 3))
    u, v = (axis + 1) % 3, (axis + 2) % 3
    matrix[..., axis, axis] = 1
    matrix[..., u, u], matrix[..., v, v] = c, c
    matrix[..., u, v], matrix[..., v, u] = -s, s
    return matrix


def transposed(R):
    return np.swapaxes(R, -1, -2)


def frame(first, second):
    """Rotations whose first column is along `first`, and whose second is in the plane of both."""
    a = first / np.linalg.norm(first, axis=-1, keepdims=True)
    b = second - (second * a).sum(-1, keepdims=True) * a
    b = b / np.linalg.norm(b, axis=-1, keepdims=True)
    return np.stack([a, b, np.cross(a, b)], -1)


def quaternions(R):
    """Quaternions of rotations (times, 3, 3), continuous along the times."""
    K = np.stack([
        np.stack([R[:, 0, 0] - R[:, 1, 1] - R[:, 2, 2], R[:, 1, 0] + R[:, 0, 1], R[:, 2, 0] + R[:, 0, 2], R[:, 2, 1] - R[:, 1, 2]], -1),
        np.stack([R[:, 1, 0] + R[:, 0, 1], R[:, 1, 1] - R[:, 0, 0] - R[:, 2, 2], R[:, 2, 1] + R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0]], -1),
        np.stack([R[:, 2, 0] + R[:, 0, 2], R[:, 2, 1] + R[:, 1, 2], R[:, 2, 2] - R[:, 0, 0] - R[:, 1, 1], R[:, 1, 0] - R[:, 0, 1]], -1),
        np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1], R[:, 0, 0] + R[:, 1, 1] + R[:, 2, 2]], -1)], 1)
    q = np.linalg.eigh(K)[1][..., 3]
    q *= np.where(q[:1, 3:] < 0, -1, 1)
    flips = np.where((q[1:] * q[:-1]).sum(1) < 0, -1.0, 1.0)
    q[1:] *= np.cumprod(flips)[:, None]
    return q


def matrices(q):
    """The rotations of unit quaternions."""
    x, y, z, w = np.moveaxis(np.asarray(q, float), -1, 0)
    return np.stack([np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], -1),
                     np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], -1),
                     np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], -1)], -2)


def around(axis, angle):
    """Rotations about any axis by angles in radians (Rodrigues)."""
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.asarray(angle, float)[..., None, None]
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K)
