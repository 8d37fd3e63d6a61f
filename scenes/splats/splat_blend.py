"""Splats of the chosen cells, and colours such that their blend is the texture."""
import dataclasses

import numpy as np

SPREAD = 0.6           # standard deviation / side of the cell
SPREAD_AT_EDGE = 0.45  # across the edge of a patch, so that splats stick out less
OPACITY = 0.98
FLATNESS = 0.02        # standard deviation across the surface / along it
LAYER = 0.00006        # m between the splats that overlap, so that their order along a ray is the same from everywhere
REACH = 3.0            # standard deviations; farther away, splats do not matter
SAMPLES = 4            # a cell is compared with the texture at SAMPLES x SAMPLES points at most
ITERATIONS = 4         # few, since the blend is compared at the centres of the smallest cells only
BEHIND = 0.2           # colour of what is seen through gaps


@dataclasses.dataclass
class Splats:
    """positions, deviations, rotations (w x y z) and linear colours of surfels."""

    positions: np.ndarray
    deviations: np.ndarray
    rotations: np.ndarray
    colours: np.ndarray


def quaternions(axes):
    """Unit quaternions w x y z of rotation matrices; the largest component is positive."""
    m = axes
    t = np.stack([1 + m[:, 0, 0] + m[:, 1, 1] + m[:, 2, 2], 1 + m[:, 0, 0] - m[:, 1, 1] - m[:, 2, 2],
                  1 - m[:, 0, 0] + m[:, 1, 1] - m[:, 2, 2], 1 - m[:, 0, 0] - m[:, 1, 1] + m[:, 2, 2]], -1)
    wx, wy, wz = m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]
    xy, xz, yz = m[:, 0, 1] + m[:, 1, 0], m[:, 0, 2] + m[:, 2, 0], m[:, 1, 2] + m[:, 2, 1]
    choices = np.stack([np.stack([t[:, 0], wx, wy, wz], -1), np.stack([wx, t[:, 1], xy, xz], -1),
                        np.stack([wy, xy, t[:, 2], yz], -1), np.stack([wz, xz, yz, t[:, 3]], -1)], 1)
    q = choices[np.arange(len(m)), t.argmax(1)]
    return q / np.linalg.norm(q, axis=1, keepdims=True)


class Leaves:
    """The chosen cells of a patch, smallest last: first column and row, side in finest cells, and the cells' numbers."""

    def __init__(self, patch, level):
        side = 1 << (patch.levels - level)
        y, x = np.indices(patch.shape)
        corner = (y // side * side) * patch.shape[1] + x // side * side
        used = np.unique(corner[patch.valid])
        side_of = side.ravel()[used]
        used = used[np.argsort(-side_of, kind="stable")]
        self.side = side.ravel()[used]
        self.y, self.x = np.divmod(used, patch.shape[1])
        number = np.full(patch.valid.size, -1)
        number[used] = np.arange(len(used))
        self.number = np.where(patch.valid, number[corner], -1)
        # Four layers of each size, the smallest in front.
        self.layer = (4 * np.log2(self.side).astype(int) + 2 * (self.y // self.side % 2)
                      + (self.x // self.side + self.y // self.side) % 2)
        at_edge = lambda start, size: (start == 0) | (start + self.side == size)
        self.spread_x = np.where(at_edge(self.x, patch.shape[1]), SPREAD_AT_EDGE, SPREAD)
        self.spread_y = np.where(at_edge(self.y, patch.shape[0]), SPREAD_AT_EDGE, SPREAD)

    def sums(self, number, values):
        values = values.reshape(len(values), -1)
        return np.stack([np.bincount(number, v, len(self.side)) for v in values.T], -1)


def surfels(patch, leaves):
    """Flat Gaussians with the moments of the cells times SPREAD, and the cells' mean colours."""
    number = leaves.number[patch.valid]
    p, du, dv = patch.P[patch.valid], patch.du[patch.valid], patch.dv[patch.valid]
    area = np.linalg.norm(np.cross(du, dv), axis=1)[:, None] + 1e-30
    total = leaves.sums(number, area)
    mean = lambda values: leaves.sums(number, area * values.reshape(len(values), -1)) / total
    centre, normal, u = mean(p), mean(np.cross(du, dv)), mean(du)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True) + 1e-30
    u -= normal * (u * normal).sum(1, keepdims=True)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(normal, u)
    d = p - centre[number]
    squares = d[:, :, None] * d[:, None, :] + (du[:, :, None] * du[:, None, :] + dv[:, :, None] * dv[:, None, :]) / 12
    covariance = mean(squares).reshape(-1, 3, 3)
    along = lambda a, b: np.einsum("ni,nij,nj->n", a, covariance, b)
    uu, uv, vv = along(u, u), along(u, v), along(v, v)
    angle = np.where(np.abs(uv) > 0.02 * np.sqrt(uu * vv), 0.5 * np.arctan2(2 * uv, uu - vv), 0)[:, None]
    u, v = np.cos(angle) * u + np.sin(angle) * v, np.cos(angle) * v - np.sin(angle) * u
    sigma = np.sqrt(12 * np.maximum(np.stack([along(u, u), along(v, v)], -1), 1e-10)) * np.stack([leaves.spread_x, leaves.spread_y], -1)
    deviations = np.column_stack([sigma, FLATNESS * sigma.min(1)])
    centre = centre - patch.facing * LAYER * leaves.layer[:, None] * normal
    return Splats(centre, deviations, quaternions(np.stack([u, v, normal], -1)), mean(patch.colour[patch.valid]))


def covered(leaves, samples):
    """Pairs of leaves and samples that they cover: numbers of both, and alphas. samples: grid of their numbers or -1."""
    found = []
    for side in np.unique(leaves.side):
        some = np.flatnonzero(leaves.side == side)
        half = int(np.ceil(REACH * SPREAD * side)) + 1
        window = np.arange(-half, side + half)
        for part in np.array_split(some, 1 + len(some) * len(window) ** 2 // 4_000_000):
            x, y = leaves.x[part, None] + window, leaves.y[part, None] + window
            ok = ((y >= 0) & (y < samples.shape[0]))[:, :, None] & ((x >= 0) & (x < samples.shape[1]))[:, None, :]
            i, j, k = np.nonzero(ok)
            sample = samples[y[i, j], x[i, k]]
            i, j, k, sample = i[sample >= 0], j[sample >= 0], k[sample >= 0], sample[sample >= 0]
            offset = window + 0.5 - side / 2
            q = (offset[k] / (leaves.spread_x[part[i]] * side)) ** 2 + (offset[j] / (leaves.spread_y[part[i]] * side)) ** 2
            near = q < REACH ** 2
            found.append((part[i[near]], sample[near], OPACITY * np.exp(-q[near] / 2)))
    return [np.concatenate(values) for values in zip(*found)]


def fit(patch, leaves, splats, eyes):
    """Changes the colours so that the blend of the splats, in their order from each of the eyes, is the texture.

    None among the eyes: their order along rays, by layers.
    """
    finest = np.ones(patch.shape, bool)
    y, x = np.indices(patch.shape)
    number = leaves.number
    step = np.maximum(leaves.side[number] // SAMPLES, 1)
    finest &= (number >= 0) & (x % step == step // 2) & (y % step == step // 2)
    samples = np.full(patch.shape, -1)
    samples[finest] = np.arange(finest.sum())
    colour = patch.colour[finest].astype(np.float64)
    # Errors matter as in an sRGB image: the derivative of its curve squared, times the area.
    emphasis = (step[finest] ** 2) / np.maximum(colour.mean(1), 0.02) ** 1.2
    leaf, sample, alpha = covered(leaves, samples)
    rows = []
    for eye in eyes:
        key = leaves.layer if eye is None else np.linalg.norm(splats.positions - eye, axis=1)
        rank = np.empty(len(leaves.side), int)
        rank[np.argsort(key, kind="stable")] = np.arange(len(rank))
        order = np.argsort(sample * len(rank) + rank[leaf])
        s, a = sample[order], alpha[order]
        logarithm = np.cumsum(np.log1p(-a))
        before = np.concatenate([[0], logarithm[:-1]])
        start = np.searchsorted(s, np.arange(len(colour)))
        weight = a * np.exp(before - before[start][s])
        rows.append((leaf[order], s, weight, 1 - np.bincount(s, weight, len(colour))))
    for _ in range(ITERATIONS):
        change, total = np.zeros_like(splats.colours), np.full(len(rank), 1e-9)
        for leaf, s, weight, gap in rows:
            pull = weight * emphasis[s]
            total += np.bincount(leaf, pull, len(total))
            for c in range(3):
                rest = colour[:, c] - BEHIND * gap - np.bincount(s, weight * splats.colours[leaf, c], len(colour))
                change[:, c] += np.bincount(leaf, pull * rest[s], len(total))
        splats.colours = np.clip(splats.colours + change / total[:, None], 0, 1.4)
