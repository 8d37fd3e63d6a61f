"""Which cells of the surface become a splat: small ones where cameras see much detail, large ones elsewhere."""
import numpy as np

from splat_surface import to_display

FLOOR = 0.02           # weight of what no camera sees, relative to what one sees from FLOOR_DISTANCE
FLOOR_DISTANCE = 3.0   # m
RAMP = 0.6             # part of the error of a linear ramp that overlapping splats avoid
BEHIND_M = 0.03        # m, behind another surface, where cells are hidden
KEEP = 0.015           # m, of hidden cells that are kept next to visible ones
VOXEL = 0.01           # m
BENT = 0.5             # error of a cell whose normals point everywhere
HALF = 2               # the depth maps have a pixel per HALF x HALF pixels


def depth_map(x, y, z, shape):
    """Depth of the nearest point in the 3 x 3 pixels around each pixel; the largest, so that edges hide nothing."""
    depth = np.full(shape, np.inf, np.float32)
    np.minimum.at(depth, (y, x), z)
    padded = np.pad(depth, 1, mode="edge")
    return np.max([padded[j:j + shape[0], i:i + shape[1]] for j in range(3) for i in range(3)], axis=0)


def importance(patches, camera, poses):
    """Pixels per square metre of each finest cell: mean over the poses, and maximum. camera: f, width, height."""
    f, width, height = camera
    points = np.concatenate([p.P[p.valid] for p in patches]).astype(np.float32)
    normals = np.concatenate([np.cross(p.du[p.valid], p.dv[p.valid]) for p in patches])
    normals = (normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)).astype(np.float32)
    mean, largest = np.zeros(len(points), np.float32), np.zeros(len(points), np.float32)
    shape = (int(height * 1.1) // HALF, int(width * 1.1) // HALF)  # with a margin of 5 % around the image
    for pose in poses.astype(np.float32):
        d = points - pose[:3, 3]
        x, y, z = (d @ pose[:3, :3]).T
        near = np.flatnonzero(z > 0.05)
        column = np.floor(f / HALF * x[near] / z[near] + shape[1] / 2)
        row = np.floor(f / HALF * y[near] / z[near] + shape[0] / 2)
        inside = (column >= 0) & (column < shape[1]) & (row >= 0) & (row < shape[0])
        seen, column, row = near[inside], column[inside].astype(int), row[inside].astype(int)
        depth = depth_map(column, row, z[seen], shape)
        seen = seen[z[seen] <= 1.02 * depth[row, column] + 0.02]
        density = f * f * np.abs((normals[seen] * d[seen]).sum(1)) / np.maximum(z[seen], 0.3) ** 3
        mean[seen] += density / len(poses)
        largest[seen] = np.maximum(largest[seen], density)
    return mean, largest


def halved(a):
    """Sums of 2 x 2 cells."""
    return a[0::2, 0::2] + a[0::2, 1::2] + a[1::2, 0::2] + a[1::2, 1::2]


def hide(patches):
    """Makes the cells invalid that lie closely behind another patch, except near the border of what it hides.

    The floor under a carpet is never seen. Where splats are sorted by their centres, it would show through.
    """
    points = np.concatenate([p.P[p.valid] for p in patches])
    number = np.repeat(np.arange(len(patches)), [p.valid.sum() for p in patches])
    low = points.min(0) - 2 * BEHIND_M
    size = np.ceil((points.max(0) + 2 * BEHIND_M - low) / VOXEL).astype(np.int64)

    def keys(p):
        i = ((p - low) / VOXEL).astype(np.int64)
        return (i[..., 0] * size[1] + i[..., 1]) * size[2] + i[..., 2]

    occupied, first = np.unique(keys(points), return_index=True)
    owner = number[first]
    for i, patch in enumerate(patches):
        normal = np.cross(patch.du, patch.dv)
        normal *= patch.facing / np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-30)
        hidden = np.zeros(patch.shape, bool)
        for distance in np.arange(VOXEL / 2, BEHIND_M, VOXEL / 2):
            key = keys(np.where(patch.valid[..., None], patch.P, points[0]) + distance * normal)
            at = np.minimum(np.searchsorted(occupied, key), len(occupied) - 1)
            hidden |= (occupied[at] == key) & (owner[at] != i)
        side = np.sqrt(np.linalg.norm(np.cross(patch.du, patch.dv), axis=2)[patch.valid].mean())
        for _ in range(int(np.ceil(KEEP / side))):  # erosion
            padded = np.pad(hidden, 1, mode="edge")
            hidden = hidden & padded[2:, 1:-1] & padded[:-2, 1:-1] & padded[1:-1, 2:] & padded[1:-1, :-2]
        patch.valid &= ~hidden


class Tree:
    """The cells of one patch. errors[level] and counts[level]: of the cells of this level, 0 the roots."""

    def __init__(self, patch, mean, largest, camera):
        grid = lambda values: np.add(np.zeros(patch.shape), 0) if values is None else values
        area = np.linalg.norm(np.cross(patch.du, patch.dv), axis=2) * patch.valid
        weight, pixels = grid(None), grid(None)
        floor = FLOOR * (camera[0] / FLOOR_DISTANCE) ** 2
        weight[patch.valid] = np.maximum(0.5 * mean + 0.5 * largest, floor)
        pixels[patch.valid] = np.maximum(largest, 10 * floor)
        shown = to_display(patch.colour.astype(np.float64))
        fields = [area, area * weight, area * pixels, area[..., None] * shown, area[..., None] * shown ** 2,
                  np.cross(patch.du, patch.dv) * patch.valid[..., None]]
        self.errors, self.used = [], []
        previous = None
        for _ in range(patch.levels + 1):
            a, w, px, s, s2, normal = fields
            n = np.maximum(a, 1e-30)
            mean_shown = s / n[..., None]
            variance = np.maximum(s2 / n[..., None] - mean_shown ** 2, 0).sum(-1)
            if previous is not None:
                m = previous
                gx = (m[0::2, 1::2] + m[1::2, 1::2] - m[0::2, 0::2] - m[1::2, 0::2]) / 2
                gy = (m[1::2, 0::2] + m[1::2, 1::2] - m[0::2, 0::2] - m[0::2, 1::2]) / 2
                variance -= np.minimum(RAMP * (gx ** 2 + gy ** 2).sum(-1) / 3, RAMP * variance)
            error = w * variance * np.minimum(px, 1)
            error += w * BENT * np.maximum(1 - (np.linalg.norm(normal, axis=-1) / n) ** 2, 0) * (a > 0)
            self.errors.insert(0, error)
            self.used.insert(0, a > 0)
            previous = mean_shown
            if _ < patch.levels:
                fields = [halved(v) for v in fields]

    def choose(self, price):
        """Whether each cell of each level is divided, where dividing saves more error than its splats cost, and the number of splats."""
        cost = self.errors[-1] + price * self.used[-1]
        count = self.used[-1].astype(int)
        self.divided = [np.zeros(cost.shape, bool)]
        for errors, used in zip(self.errors[-2::-1], self.used[-2::-1]):
            below, parts = halved(cost), halved(count)
            alone = errors + price * used
            divided = below < alone
            cost, count = np.where(divided, below, alone), np.where(divided, parts, used)
            self.divided.insert(0, divided)
        return count.sum()

    def leaves(self):
        """Level of the chosen cell of each finest cell."""
        level = np.zeros(self.divided[0].shape, int)
        for i, divided in enumerate(self.divided):
            if i:
                level = np.repeat(np.repeat(level, 2, 0), 2, 1)
            level[divided & (level == i)] = i + 1
        return level


def choose(trees, count):
    """Divides the cells of all trees so that there are at most about count."""
    low, high = -16.0, 4.0
    for _ in range(22):
        middle = (low + high) / 2
        if sum(tree.choose(10 ** middle) for tree in trees) > count:
            low = middle
        else:
            high = middle
    return sum(tree.choose(10 ** high) for tree in trees)
