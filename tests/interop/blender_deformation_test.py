"""Meshes that deform, as Blender evaluates them: skeletons and shape keys with linear, cubic and step keys, exported by
Blender's glTF exporter, compared at 101 frames with the vertices of the original scene, and of the import of the GLB.

Scenes with modifiers are read as .blend files, through esim's own export, and as the caches of vertices that Blender's
exporters of PC2, MDD and numbered OBJ files write.

Run as: blender_deformation_test.py PRINT_VERTICES ESIM_PROGRAM. Skips (77) without Blender or NumPy.
"""

import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

try:
    import numpy as np
except ImportError:
    np = None

PRINT_VERTICES, ESIM = sys.argv[1:3]
FPS, FRAMES = 24, 101
TOLERANCE_M = 1e-5
# Blender exports the slopes of cubic rotations of bones only roughly, and its importer ignores them: only keys are exact.
KEYS_ONLY = {"skinned_cubic": (0, 25, 60, 100)}


def vertices_of(scene, times_s, vertices=()):
    """Positions and velocities of the only object: times x vertices x 3. `vertices`: file, frames per second or 0, axes."""
    cache = ["--vertices", *map(str, vertices)] if vertices else []
    done = subprocess.run([PRINT_VERTICES, *cache, scene, *(f"{t_s:.9f}" for t_s in times_s)], capture_output=True, check=True)
    values = np.frombuffer(done.stdout, np.float32).reshape(len(times_s), 2, -1, 3).astype(float)
    return values[:, 0], values[:, 1]


def matching(ours, theirs):
    """For each of our vertices, the index of the vertex that moves with it."""
    distance = np.linalg.norm(ours[0][:, None] - theirs[0][None], axis=2)
    return distance.argmin(axis=1)


class BlenderDeformation(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scratch = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.scratch.name)
        script = pathlib.Path(__file__).with_name("make_deforming.py")
        done = subprocess.run(["blender", "-b", "--python-exit-code", "3", "--python", script, "--", cls.folder],
                              capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(done.stdout + done.stderr)

    @classmethod
    def tearDownClass(cls):
        cls.scratch.cleanup()

    def test_vertices_are_where_blender_puts_them(self):
        times_s = [frame / FPS for frame in range(FRAMES)]
        for case in sorted(self.folder.glob("*.glb")):
            ours, _ = vertices_of(case, times_s)
            for kind in ("", "_imported"):
                theirs = np.load(self.folder / f"{case.stem}{kind}.npy")
                with self.subTest(case=case.stem + kind):
                    at = list(KEYS_ONLY.get(case.stem, range(FRAMES)))
                    error = np.linalg.norm(ours - theirs[:, matching(ours, theirs)], axis=2)[at].max()
                    print(f"{case.stem + kind}: {ours.shape[1]} vertices, largest distance {error:.2e} m")
                    self.assertGreater(np.abs(theirs[0] - theirs[50]).max(), 0.05)
                    self.assertLess(error, TOLERANCE_M)

    def test_scenes_with_modifiers_are_exported_as_they_move(self):
        times_s = [frame / FPS for frame in range(FRAMES)]
        for scene in sorted(self.folder.glob("*.blend")):
            with self.subTest(scene=scene.stem):
                glb = self.folder / "exported" / f"{scene.stem}.glb"
                glb.parent.mkdir(exist_ok=True)
                subprocess.run([ESIM, "import", scene, "--out", glb], check=True, capture_output=True)
                ours, _ = vertices_of(glb, times_s)
                theirs = np.load(scene.with_suffix(".npy"))
                error = np.linalg.norm(ours - theirs[:, matching(ours, theirs)], axis=2).max()
                print(f"{scene.stem}: {ours.shape[1]} vertices, largest distance {error:.2e} m")
                self.assertGreater(np.abs(theirs[0] - theirs[50]).max(), 0.05)
                self.assertLess(error, TOLERANCE_M)

    def test_caches_of_vertices_are_where_blender_puts_them(self):
        times_s = [frame / FPS for frame in range(FRAMES)]
        theirs = np.load(self.folder / "cloth.npy")
        self.assertGreater(np.abs(theirs[0] - theirs[50]).max(), 0.05)
        for name, rate_hz, axes in (("cloth_y_up.pc2", FPS, "y_up"), ("cloth_z_up.pc2", FPS, "same"),
                                    ("cloth.mdd", 0, "same"), ("cloth_#.obj", FPS, "same")):
            with self.subTest(file=name):
                ours, _ = vertices_of(self.folder / "cloth.obj", times_s, (self.folder / name, rate_hz, axes))
                error = np.linalg.norm(ours - theirs[:, matching(ours, theirs)], axis=2).max()
                print(f"{name}: {ours.shape[1]} vertices, largest distance {error:.2e} m")
                self.assertEqual(ours.shape, theirs.shape)
                self.assertLess(error, TOLERANCE_M)

    def test_velocities_are_the_derivative_of_positions(self):
        step_s = 1e-3
        times_s = np.arange(0.7, FRAMES - 2) / FPS  # between keys of every frame
        for case in sorted(self.folder.glob("*.glb")):
            before, _ = vertices_of(case, times_s - step_s)
            after, _ = vertices_of(case, times_s + step_s)
            _, velocities = vertices_of(case, times_s)
            with self.subTest(case=case.stem):
                difference = np.abs((after - before) / (2 * step_s) - velocities).max()
                print(f"{case.stem}: largest speed {np.abs(velocities).max():.2f} m/s, difference {difference:.1e} m/s")
                # Single precision of positions up to 10 m, in the two steps, and the third derivative of the motion.
                self.assertLess(difference, 4e-3)


if __name__ == "__main__":
    if np is None or shutil.which("blender") is None:
        print("needs Blender and NumPy")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1])
