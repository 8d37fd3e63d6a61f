"""Surfaces with texture coordinates and skin weights, ready for a glTF file."""
import numpy as np

import fields


class Surface:
    """Points, normals, triangles, texture coordinates (u right, v down), and perhaps joints and weights."""

    def __init__(self, points, normals, triangles, uv, joints=None, weights=None):
        self.points, self.normals, self.triangles, self.uv = points, normals, triangles, uv
        self.joints, self.weights = joints, weights


def of_field(field, low, high, cell, charts, skin=None):
    """The mesh of a field. `charts` maps points to a list of [(owns, uv, turns)] whose arrays have one row per point: a triangle
    belongs to the last chart that owns all or most of its corners; where `turns`, u is an angle in turns, and wraps around.
    `skin` maps points to weights (points, joints)."""
    points, triangles = fields.mesh(field, low, high, cell)
    normals = fields.gradient(field, points)
    owner = np.zeros(len(triangles), int)
    mapped = charts(points)
    for k, (owns, _, _) in enumerate(mapped):
        owner[owns[triangles].sum(1) >= 2] = k
    corners = np.zeros((len(triangles), 3, 2))
    for k, (_, uv, turns) in enumerate(mapped):
        c = uv[triangles[owner == k]].copy()
        if turns:  # where a triangle crosses the seam, its corners on the near side get one turn more
            wide = np.ptp(c[..., 0], axis=1) > 0.5
            c[..., 0] += (wide[:, None] & (c[..., 0] < 0.5)) * 1.0
        corners[owner == k] = c
    keys = np.concatenate([triangles[..., None], owner[:, None, None] + 0 * triangles[..., None],
                           np.round(corners * 1e6).astype(np.int64)], -1).reshape(-1, 4)
    unique, inverse = np.unique(keys, axis=0, return_inverse=True)
    source = unique[:, 0]
    joints, weights = strongest(skin(points)) if skin else (None, None)
    return Surface(points[source], normals[source], inverse.reshape(-1, 3), unique[:, 2:] / 1e6,
                   None if joints is None else joints[source], None if weights is None else weights[source])


def strongest(weights):
    """The four largest weights of each point, as fractions of 65535 that sum to it exactly, and their joints."""
    joints = np.argsort(-weights, axis=1, kind="stable")[:, :4]
    w = np.take_along_axis(weights, joints, 1)
    w = np.round(65535 * w / w.sum(1, keepdims=True)).astype(np.int64)
    w[:, 0] += 65535 - w.sum(1)
    return np.where(w > 0, joints, 0), w


def turned(profile, sides, centre=(0, 0, 0), v=None):
    """A surface of revolution about z. `profile`: (radius, height) from bottom to top, seen from outside; `v`: its texture
    coordinates downwards, by default from 1 to 0 by length. Where two following points are equal, there is a crease."""
    profile = np.asarray(profile, float)
    lengths = np.linalg.norm(np.diff(profile, axis=0), axis=1)
    if v is None:
        v = 1 - np.concatenate([[0], np.cumsum(lengths)]) / lengths.sum()
    tangent = np.zeros_like(profile)
    tangent[:-1] += np.diff(profile, axis=0)
    tangent[1:] += np.diff(profile, axis=0)
    same = np.flatnonzero(lengths == 0)
    tangent[same] = profile[same] - profile[same - 1]
    tangent[same + 1] = profile[same + 2] - profile[same + 1]
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    angle = 2 * np.pi * np.arange(sides + 1) / sides
    out = np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1)
    up = np.array([0, 0, 1.0])
    points = profile[:, None, :1] * out + profile[:, None, 1:] * up + np.asarray(centre)
    normals = tangent[:, None, 1:] * out - tangent[:, None, :1] * up
    uv = np.stack(np.broadcast_arrays((np.arange(sides + 1) / sides)[None], v[:, None]), -1)
    a = (np.arange(len(profile) - 1)[:, None] * (sides + 1) + np.arange(sides)).ravel()
    b = a + sides + 1
    triangles = np.vstack([np.stack([a, a + 1, b + 1], -1), np.stack([a, b + 1, b], -1)])
    p = points.reshape(-1, 3)[triangles]
    area = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    return Surface(points.reshape(-1, 3), normals.reshape(-1, 3), triangles[area > 1e-12], uv.reshape(-1, 2))
