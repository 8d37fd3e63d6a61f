"""Implicit surfaces: signed distances in metres (below zero inside), and their meshes.

A field is a function of points (..., 3) that returns a distance, or a bound of it, for each.
"""
import numpy as np


def ellipsoid(centre, radii):
    centre, radii = np.asarray(centre, float), np.asarray(radii, float)

    def field(p):
        q = (p - centre) / radii
        length = np.linalg.norm(q, axis=-1)
        slope = np.linalg.norm(q / radii, axis=-1)
        return np.where(length > 1e-9, length * (length - 1) / np.maximum(slope, 1e-12), -radii.min())
    return field


def sphere(centre, radius):
    return ellipsoid(centre, (radius,) * 3)


def cone(a, b, radius_a, radius_b=None):
    """A capsule whose radius changes linearly from a to b."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    radius_b = radius_a if radius_b is None else radius_b

    def field(p):
        t = np.clip((p - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        return np.linalg.norm(p - a - t[..., None] * (b - a), axis=-1) - (radius_a + (radius_b - radius_a) * t)
    return field


def box(centre, half, radius, axes=np.eye(3)):
    """A box with rounded edges; `half` includes them. Its axes are the rows of `axes`."""
    centre, half = np.asarray(centre, float), np.asarray(half, float) - radius

    def field(p):
        q = np.abs((p - centre) @ np.transpose(axes)) - half
        return np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(-1), 0) - radius
    return field


def torus(centre, axis, ring, radius):
    centre, axis = np.asarray(centre, float), np.asarray(axis, float) / np.linalg.norm(axis)

    def field(p):
        along = (p - centre) @ axis
        across = np.linalg.norm(p - centre - along[..., None] * axis, axis=-1)
        return np.hypot(across - ring, along) - radius
    return field


def below(point, normal):
    """The half-space behind a plane."""
    point, normal = np.asarray(point, float), np.asarray(normal, float) / np.linalg.norm(normal)
    return lambda p: (p - point) @ normal


def blend(a, b, k):
    """The smooth minimum of two distances, which differ by less than k where it acts."""
    h = np.maximum(k - np.abs(a - b), 0) / k
    return np.minimum(a, b) - h * h * k / 4


def union(*fields, k=0.0):
    def field(p):
        total = fields[0](p)
        for other in fields[1:]:
            total = blend(total, other(p), k) if k else np.minimum(total, other(p))
        return total
    return field


def intersection(*fields, k=0.0):
    def field(p):
        total = -fields[0](p)
        for other in fields[1:]:
            total = blend(total, -other(p), k) if k else np.minimum(total, -other(p))
        return -total
    return field


def without(a, b, k=0.0):
    return intersection(a, lambda p: -b(p), k=k)


def grown(a, by):
    return lambda p: a(p) - by


def displaced(a, inwards):
    """A surface that lies deeper by inwards(p)."""
    return lambda p: a(p) + inwards(p)


def gradient(field, points, step=1e-4):
    g = np.stack([field(points + step * e) - field(points - step * e) for e in np.eye(3)], -1)
    return g / np.maximum(np.linalg.norm(g, axis=-1, keepdims=True), 1e-12)


def mesh(field, low, high, cell):
    """Points and triangles of the surface within a box, by surface nets: a point in each cell that the surface crosses, and a
    quadrilateral about each edge that it crosses. `cell` is the size of the cells, along each axis or along all."""
    low, cell = np.asarray(low, float), np.broadcast_to(np.asarray(cell, float), 3)
    counts = np.ceil((np.asarray(high, float) - low) / cell).astype(int) + 1
    grid = low + np.stack(np.meshgrid(*(np.arange(n) for n in counts), indexing="ij"), -1) * cell
    values = field(grid)
    inside = values < 0

    # A point in each cell: the mean of the crossings of its edges.
    cells = counts - 1
    total, number = np.zeros((*cells, 3)), np.zeros(cells)
    for axis in range(3):
        first, second = (np.take(values, range(start, counts[axis] - 1 + start), axis) for start in (0, 1))
        crosses = (first < 0) != (second < 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.where(crosses, first / (first - second), 0)
        at = np.take(grid, range(counts[axis] - 1), axis) + t[..., None] * cell * np.eye(3)[axis]
        others = [a for a in range(3) if a != axis]
        for u in (0, 1):
            for v in (0, 1):
                part = [slice(None)] * 3
                part[others[0]] = slice(u, u + cells[others[0]])
                part[others[1]] = slice(v, v + cells[others[1]])
                c = crosses[tuple(part)]
                total += np.where(c[..., None], at[tuple(part)], 0)
                number += c
    used = number > 0
    index = np.full(cells, -1)
    index[used] = np.arange(used.sum())
    points = total[used] / number[used][:, None]

    quads = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        a, b = (np.take(inside, range(start, counts[axis] - 1 + start), axis) for start in (0, 1))
        at = np.argwhere(a != b)
        at = at[(at[:, u] > 0) & (at[:, v] > 0) & (at[:, u] < cells[u]) & (at[:, v] < cells[v])]
        leaves = a[tuple(at.T)]
        eu, ev = np.eye(3, dtype=int)[u], np.eye(3, dtype=int)[v]
        corners = [index[tuple((at - d).T)] for d in (eu + ev, ev, 0 * eu, eu)]
        quad = np.stack(corners, -1)
        quads.append(np.where(leaves[:, None], quad, quad[:, ::-1]))
    quads = np.vstack(quads)

    for _ in range(3):  # to the surface
        g = gradient(field, points)
        points = points - np.clip(field(points), -0.5 * cell.min(), 0.5 * cell.min())[:, None] * g
    p = points[quads]
    other = np.linalg.norm(p[:, 0] - p[:, 2], axis=1) > np.linalg.norm(p[:, 1] - p[:, 3], axis=1)
    quads = np.where(other[:, None], np.roll(quads, -1, 1), quads)
    return points, np.vstack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
