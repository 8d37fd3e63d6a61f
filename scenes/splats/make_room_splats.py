"""Make room.spz, the room of ../room/room.obj as Gaussian splats, whose geometry and linear colours are known.

Run:  python3 make_room_splats.py [--count N] [output file]        (needs NumPy and Pillow; 3 min)

Splats are flat, lie on the triangles, and are small where ../room/trajectory.txt shows much detail. The output is .spz,
or .ply in full precision. Colours are linear light: a PLY says so, for .spz set `light: linear` in the scenario. The
coordinates are those of room.obj. The same NumPy gives the same file.
"""
import argparse
import os

import numpy as np

import splat_blend as blend
import splat_cells as cells
import splat_surface as surface
from splat_files import write_ply, write_spz

HERE = os.path.dirname(os.path.abspath(__file__))
ROOM = os.path.join(HERE, "..", "room")
CAMERA = (346 / 2 / np.tan(np.radians(75 / 2)), 346, 260)  # focal length, width and height in pixels, of ../room.yaml
FINEST = 0.5     # px, side of the smallest splats where the camera is nearest
COUNT = 400_000


def read_poses(step):
    """4 x 4 matrices T_world_camera of every step-th pose."""
    poses = []
    for _, x, y, z, i, j, k, w in np.loadtxt(os.path.join(ROOM, "trajectory.txt"))[::step]:
        turn = np.array([[1 - 2 * (j * j + k * k), 2 * (i * j - k * w), 2 * (i * k + j * w)],
                         [2 * (i * j + k * w), 1 - 2 * (i * i + k * k), 2 * (j * k - i * w)],
                         [2 * (i * k - j * w), 2 * (j * k + i * w), 1 - 2 * (i * i + j * j)]])
        poses.append(np.vstack([np.column_stack([turn, [x, y, z]]), [0, 0, 0, 1]]))
    return np.array(poses)


def make(count):
    poses = read_poses(10)
    path = poses[:, :3, 3]
    smallest = 0.008 * np.sqrt(min(1, 300_000 / count))

    def finest(corners):
        distance = np.linalg.norm(corners.reshape(-1, 1, 3) - path, axis=2).min()
        return max(smallest, FINEST * distance / CAMERA[0])

    patches = surface.read_patches(os.path.join(ROOM, "room.obj"), finest)
    cells.hide(patches)
    patches = [patch for patch in patches if patch.valid.any()]
    mean, largest = cells.importance(patches, CAMERA, poses)
    ends = np.cumsum([p.valid.sum() for p in patches])[:-1]
    trees = [cells.Tree(*each, CAMERA) for each in zip(patches, np.split(mean, ends), np.split(largest, ends))]
    cells.choose(trees, count)
    parts = []
    for patch, tree in zip(patches, trees):
        leaves = blend.Leaves(patch, tree.leaves())
        splats = blend.surfels(patch, leaves)
        near = np.linalg.norm(path - splats.positions.mean(0), axis=1).argmin()
        blend.fit(patch, leaves, splats, [None, path[near]])
        parts.append(splats)
    join = lambda name: np.concatenate([getattr(part, name) for part in parts])
    return blend.Splats(join("positions"), join("deviations"), join("rotations"), join("colours"))


def main():
    parser = argparse.ArgumentParser(description="Make the room of Gaussian splats.")
    parser.add_argument("out", nargs="?", default=os.path.join(HERE, "room.spz"), help=".spz or .ply")
    parser.add_argument("--count", type=int, default=COUNT, help="of splats, about")
    arguments = parser.parse_args()
    splats = make(arguments.count)
    write = write_ply if arguments.out.endswith(".ply") else write_spz
    write(arguments.out, splats, blend.OPACITY)
    print("%d splats, %d bytes" % (len(splats.positions), os.path.getsize(arguments.out)))


if __name__ == "__main__":
    main()
