"""The surface of an OBJ as patches with grids of cells: where each cell lies in space, and its colour."""
import os

import numpy as np
from PIL import Image

MAX_LEVEL = 5          # a root cell has at most 2^5 x 2^5 finest cells
ROOT_SIZE = 0.15       # m, largest side of a root cell
ROOT_ASPECT = 4        # longest side of a root cell / its shortest


def to_linear(v):
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


def to_display(v):
    v = np.maximum(v, 0)
    return np.where(v <= 0.0031308, v * 12.92, 1.055 * v ** (1 / 2.4) - 0.055)


def read_obj(path):
    """Corners of the triangles in space and in their textures, their texture, and the textures (sRGB, first row on top)."""
    folder = os.path.dirname(path)
    points, coordinates, triangles, materials, files, material = [], [], [], [], {}, None
    with open(path) as file:
        for words in map(str.split, file):
            if not words:
                continue
            if words[0] == "v":
                points.append([float(w) for w in words[1:4]])
            elif words[0] == "vt":
                coordinates.append([float(w) for w in words[1:3]])
            elif words[0] == "f":
                triangles.append([[int(i) - 1 for i in w.split("/")[:2]] for w in words[1:4]])
                materials.append(material)
            elif words[0] == "usemtl":
                material = words[1]
            elif words[0] == "mtllib":
                with open(os.path.join(folder, words[1])) as library:
                    for line in map(str.split, library):
                        if line and line[0] == "newmtl":
                            name = line[1]
                        if line and line[0] == "map_Kd":
                            files[name] = os.path.join(folder, line[1])
    textures = {name: np.asarray(Image.open(file).convert("RGB"), np.float32) / 255 for name, file in files.items()}
    return np.array(points), np.array(coordinates), np.array(triangles), np.array(materials), textures


def connected(triangles, count):
    """A number per triangle: that of its patch. Triangles that have a texture coordinate in common are of one patch."""
    parent = np.arange(count)

    def root(i):
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    for a, b, c in triangles[:, :, 1]:
        parent[root(b)] = parent[root(c)] = root(a)
    return np.unique([root(i) for i in triangles[:, 0, 1]], return_inverse=True)[1]


def sample(texture, uv):
    """Bilinear, in linear light."""
    height, width = texture.shape[:2]
    x, y = uv[:, 0] * width - 0.5, (1 - uv[:, 1]) * height - 0.5
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = (x - x0)[:, None], (y - y0)[:, None]
    at = lambda i, j: texture[np.clip(j, 0, height - 1), np.clip(i, 0, width - 1)]
    return ((1 - fy) * ((1 - fx) * at(x0, y0) + fx * at(x0 + 1, y0)) + fy * ((1 - fx) * at(x0, y0 + 1) + fx * at(x0 + 1, y0 + 1)))


class Patch:
    """A rectangle of the texture as roots_v x roots_u root cells of 2^levels x 2^levels finest cells.

    valid, P, du, dv, colour: of the finest cells, rows along v: whether a triangle covers them, their centre, their sides
    as vectors, and their mean linear colour.
    """

    def __init__(self, points, uv, texture, finest):
        """points, uv: of the corners of its triangles. texture: linear. finest: least side of a cell, m."""
        low, high = uv.min((0, 1)), uv.max((0, 1))
        edges = uv[:, 1:] - uv[:, :1]
        sides = points[:, 1:] - points[:, :1]
        jacobians = np.linalg.inv(edges) @ sides  # rows: dP/du, dP/dv
        area = np.abs(np.linalg.det(edges))
        # 1: du x dv points to where the triangles are counter-clockwise from; -1: away from there
        self.facing = np.sign(np.linalg.det(edges).sum())
        mean = np.average(np.linalg.norm(jacobians, axis=2), axis=0, weights=area)
        size = np.maximum(mean * (high - low), 1e-4)
        largest = min(ROOT_SIZE, ROOT_ASPECT * size.min())
        self.roots = np.ceil(size / largest).astype(int)
        self.levels = int(np.clip(np.ceil(np.log2(np.sqrt(np.prod(size / self.roots)) / finest)), 0, MAX_LEVEL))
        n = self.roots << self.levels
        step = (high - low) / n
        self.shape = (n[1], n[0])
        self.valid = np.zeros(self.shape, bool)
        self.P = np.zeros((*self.shape, 3))
        self.du, self.dv = np.zeros((*self.shape, 3)), np.zeros((*self.shape, 3))
        for corner, j, e, p in zip(uv[:, 0], jacobians, edges, points[:, 0]):
            self.fill(low, step, corner, j, e, p)
        self.paint(low, step, texture)

    def fill(self, low, step, corner, jacobian, edges, origin):
        """Sets the cells whose centre is in a triangle."""
        ends = (np.stack([corner, corner + edges[0], corner + edges[1]]) - low) / step - 0.5
        a = np.maximum(np.floor(ends.min(0)).astype(int), 0)
        b = np.minimum(np.ceil(ends.max(0)).astype(int) + 1, self.shape[::-1])
        x, y = np.meshgrid(np.arange(a[0], b[0]), np.arange(a[1], b[1]))
        offset = low + step * (np.stack([x, y], -1) + 0.5) - corner
        s = offset @ np.linalg.inv(edges)
        inside = (s.min(-1) >= -1e-6) & (s.sum(-1) <= 1 + 1e-6)
        y, x = y[inside], x[inside]
        self.valid[y, x] = True
        self.P[y, x] = origin + offset[inside] @ jacobian
        self.du[y, x], self.dv[y, x] = jacobian[0] * step[0], jacobian[1] * step[1]

    def paint(self, low, step, texture):
        texels = np.maximum(step * texture.shape[1::-1], 1)
        k = [int(np.clip(np.ceil(t), 1, 6)) for t in texels]
        self.colour = np.zeros((*self.shape, 3), np.float32)
        y, x = np.nonzero(self.valid)
        for i in range(k[0]):
            for j in range(k[1]):
                uv = low + step * np.stack([x + (i + 0.5) / k[0], y + (j + 0.5) / k[1]], -1)
                self.colour[y, x] += sample(texture, uv) / (k[0] * k[1])


def read_patches(path, finest_of):
    """finest_of(points): least side in m of the finest cells of a patch with these corners."""
    points, coordinates, triangles, materials, textures = read_obj(path)
    textures = {name: to_linear(texture).astype(np.float32) for name, texture in textures.items()}
    number = connected(triangles, len(coordinates))
    order = np.argsort(number, kind="stable")
    patches = []
    for part in np.split(order, np.flatnonzero(np.diff(number[order])) + 1):
        corners, uv = points[triangles[part][:, :, 0]], coordinates[triangles[part][:, :, 1]]
        flat = np.abs(np.linalg.det(uv[:, 1:] - uv[:, :1])) > 1e-12
        if flat.any():
            patches.append(Patch(corners[flat], uv[flat], textures[materials[part[0]]], finest_of(corners)))
    return patches
