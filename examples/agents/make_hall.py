#!/usr/bin/env python3
"""Makes a long hall with columns, as a scene for event cameras: hall.obj, hall.mtl, two textures and hall.json, the list of
columns.

    make_hall.py out/hall --seed 1

The textures are "dead leaves": discs of random sizes and grey levels that cover each other. They have edges of high contrast at
all scales, so that everything that moves in the image makes events. Floor and ceiling do not exist: the camera sees the uniform
background there. Needs NumPy and Pillow.
"""

import argparse
import json
import pathlib

import numpy as np
from PIL import Image

LENGTH_M, WIDTH_M, HEIGHT_M = 240.0, 10.0, 3.0  # x from 0 to the length, y from -width / 2 to width / 2; z is up
COLUMNS, RADIUS_M = 192, (0.3, 0.5)
FREE_M = 1.6  # between two columns, and between a wall and a column that does not touch it
SIDES = 16  # of a column's mesh
TEXELS_PER_M = 32


def dead_leaves(rng, width_m, height_m, radius_m=(0.06, 0.5)):
    """An image, uint8 (rows, columns). The density of radii falls with their cube: the image is similar at all scales."""
    shape = round(height_m * TEXELS_PER_M), round(width_m * TEXELS_PER_M)
    image = np.full(shape, 128, np.uint8)
    low, high = np.array(radius_m) * TEXELS_PER_M  # texels
    count = round(6 * image.size / (np.pi * low * high))
    for u, v, w, grey in rng.uniform(size=(count, 4)):
        radius = (low**-2 + w * (high**-2 - low**-2)) ** -0.5
        row, column = u * shape[0], v * shape[1]
        top, left = max(0, int(row - radius)), max(0, int(column - radius))
        part = image[top : int(row + radius) + 2, left : int(column + radius) + 2]
        y, x = np.ogrid[: part.shape[0], : part.shape[1]]
        part[(y + top - row) ** 2 + (x + left - column) ** 2 < radius**2] = 25 + 230 * grey
    return image


def place_columns(rng):
    """Columns (N, 3): x, y and radius, m. Some are partly in the walls: otherwise there would be a free lane along these."""
    columns = []
    while len(columns) < COLUMNS:
        radius = rng.uniform(*RADIUS_M)
        x, y = rng.uniform(0, LENGTH_M), rng.uniform(-0.5, 0.5) * WIDTH_M
        to_wall = WIDTH_M / 2 - abs(y) - radius
        if (to_wall < 0 or to_wall > FREE_M) and all(np.hypot(x - a, y - b) > radius + r + FREE_M for a, b, r in columns):
            columns.append((x, y, radius))
    return np.array(columns)


class Mesh:
    """Upright rectangles with the texture of a material, as the text of an OBJ file."""

    def __init__(self):
        self.lines, self.vertices = ["mtllib hall.mtl"], 0

    def use(self, material):
        self.lines.append(f"usemtl {material}")

    def strip(self, corners, u):
        """Rectangles from floor to ceiling along corners (N, 2; m), where the texture has the horizontal coordinates u (N,)."""
        for (x, y), s in zip(corners, u):
            self.lines += [f"v {x:.4f} {y:.4f} 0", f"v {x:.4f} {y:.4f} {HEIGHT_M:g}", f"vt {s:.6f} 0", f"vt {s:.6f} 1"]
        for i in range(self.vertices + 1, self.vertices + 2 * len(corners) - 2, 2):
            self.lines.append("f " + " ".join(f"{k}/{k}" for k in (i, i + 2, i + 3, i + 1)))
        self.vertices += 2 * len(corners)


def make_hall(folder, seed):
    """Writes the files. The same seed gives the same bytes."""
    rng = np.random.default_rng(seed)
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    columns = place_columns(rng)
    mesh = Mesh()

    mesh.use("walls")
    corners = np.array([[0, -0.5], [1, -0.5], [1, 0.5], [0, 0.5], [0, -0.5]]) * [LENGTH_M, WIDTH_M]
    along = np.array([0, LENGTH_M, LENGTH_M + WIDTH_M, 2 * LENGTH_M + WIDTH_M, 2 * (LENGTH_M + WIDTH_M)])
    mesh.strip(corners, along / along[-1])
    walls = dead_leaves(rng, along[-1], HEIGHT_M)

    mesh.use("columns")  # side by side in their texture
    widths = 2 * np.pi * columns[:, 2]
    ends = np.cumsum(widths) / widths.sum()
    for (x, y, radius), begin, end in zip(columns, [0, *ends], ends):
        angle = np.linspace(0, 2 * np.pi, SIDES + 1)
        mesh.strip(np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle)]), np.linspace(begin, end, SIDES + 1))
    around = dead_leaves(rng, widths.sum(), HEIGHT_M)

    for name, image in (("walls", walls), ("columns", around)):
        Image.fromarray(image).save(folder / f"{name}.png")
    (folder / "hall.obj").write_text("\n".join(mesh.lines) + "\n")
    (folder / "hall.mtl").write_text("".join(f"newmtl {name}\nKd 1 1 1\nillum 0\nmap_Kd {name}.png\n" for name in ("walls", "columns")))
    contents = {"seed": seed, "length_m": LENGTH_M, "width_m": WIDTH_M, "columns_x_y_radius_m": columns.round(4).tolist()}
    (folder / "hall.json").write_text(json.dumps(contents) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", help="where to write")
    parser.add_argument("--seed", type=int, default=1, help="of the columns and textures (default: 1)")
    args = parser.parse_args()
    make_hall(args.folder, args.seed)
    print(f"{args.folder}: {COLUMNS} columns in {LENGTH_M:g} x {WIDTH_M:g} m")


if __name__ == "__main__":
    main()
