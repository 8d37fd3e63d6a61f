"""Scenes that deform (walker, hand, eye): their scripts make the same bytes each time and what is in the repository, and they are skinned
correctly. The walking figure's feet stand still on the floor, and it does not touch the furniture.

Run as: figures_test.py SCENES_FOLDER, with NumPy. Without NumPy, it ends with 77.
"""

import pathlib
import subprocess
import sys
import tempfile
import unittest

try:
    import numpy as np
except ImportError:
    print("skipped: NumPy is missing")
    sys.exit(77)

from glb_file import GlbFile

SCENES = pathlib.Path(sys.argv[1]).absolute()
WALKER = SCENES / "walker"


def made(script, name):
    """The bytes of a file that a script makes."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / name
        subprocess.run([sys.executable, script, path], check=True, stdout=subprocess.DEVNULL)
        return path.read_bytes()


def compare(case, script, path):
    """The same bytes twice. Another NumPy may round differently: then the meshes have the same triangles, almost at the same places."""
    data = made(script, path.name)
    case.assertEqual(data, made(script, path.name))
    new, old = GlbFile(data), GlbFile(path.read_bytes())
    case.assertEqual(new.document["nodes"], old.document["nodes"])
    for one, other in zip(new.document["accessors"], old.document["accessors"]):
        case.assertEqual([one[k] for k in ("count", "type", "componentType")], [other[k] for k in ("count", "type", "componentType")])
    for (_, one), (_, other) in zip(new.skinned(), old.skinned()):
        for name in ("POSITION", "NORMAL", "WEIGHTS_0"):
            np.testing.assert_allclose(new.array(one["attributes"][name]), old.array(other["attributes"][name]), atol=1e-4)
    return len(data)


class Figures(unittest.TestCase):
    """What holds for every scene of this kind."""

    files = [SCENES / name / f"{name}.glb" for name in ("walker", "hand", "eye")]

    def test_scripts_make_the_files_of_the_repository(self):
        for path in self.files:
            size = compare(self, path.parent / f"make_{path.stem}.py", path)
            self.assertLess(size, 4_000_000 if path.stem == "walker" else 700_000)
        camera = np.loadtxt(made(WALKER / "make_camera.py", "camera.txt").decode().splitlines())
        np.testing.assert_allclose(camera, np.loadtxt(WALKER / "camera.txt"), atol=2e-6)

    def test_weights_and_rotations_are_normalized(self):
        for file in map(GlbFile, (path.read_bytes() for path in self.files)):
            joints = len(file.document["skins"][0]["joints"])
            for name, primitive in file.skinned():
                weights = file.array(primitive["attributes"]["WEIGHTS_0"])
                np.testing.assert_allclose(weights.sum(1), 1, atol=1e-12, err_msg=name)
                self.assertLess(file.array(primitive["attributes"]["JOINTS_0"]).max(), joints)
                np.testing.assert_allclose(np.linalg.norm(file.array(primitive["attributes"]["NORMAL"]), axis=1), 1, atol=1e-5)
            samplers = file.document["animations"][0]["samplers"]
            for channel in file.document["animations"][0]["channels"]:
                if channel["target"]["path"] == "rotation":
                    q = file.array(samplers[channel["sampler"]]["output"])
                    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1, atol=1e-6)
                    self.assertGreater((q[1:] * q[:-1]).sum(1).min(), 0.97)  # steps of less than 28 degrees
            times = file.array(samplers[0]["input"])[:, 0]
            self.assertEqual((times[0], times[-1]), (0, 5))

    def test_bind_matrices_are_those_of_the_skeleton_at_rest(self):
        for file in map(GlbFile, (path.read_bytes() for path in self.files)):
            nodes = file.document["nodes"]
            joints = file.document["skins"][0]["joints"]
            self.assertEqual(joints, list(range(len(joints))))
            at = np.zeros((len(joints), 3))
            for k in joints:  # parents come before their children
                parents = [p for p in joints if k in nodes[p].get("children", ())]
                at[k] = np.array(nodes[k]["translation"]) + (at[parents[0]] if parents else 0)
            for position, inverse in zip(at, file.inverse_bind()):
                np.testing.assert_allclose(inverse @ np.append(position, 1), (0, 0, 0, 1), atol=1e-6)


class Walker(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.file = GlbFile((WALKER / "walker.glb").read_bytes())

    def test_neighbours_stay_close(self):
        """No edge becomes much longer than twice its length, as it does where weights jump."""
        for name, primitive in self.file.skinned():
            triangles = self.file.array(primitive["indices"]).reshape(-1, 3)
            edges = np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
            rest = self.file.array(primitive["attributes"]["POSITION"])
            length = np.linalg.norm(rest[edges[:, 0]] - rest[edges[:, 1]], axis=1)
            for t in np.linspace(0, 5, 9):
                at = self.file.vertices(primitive, t)
                now = np.linalg.norm(at[edges[:, 0]] - at[edges[:, 1]], axis=1)
                self.assertLess((now - 2 * length).max(), 0.01, f"{name} at {t} s")

    def test_feet_stand_still(self):
        """Wherever a part of a sole lies on the floor, it moves by less than 5 mm until it leaves; and something always lies there."""
        primitive = dict(self.file.skinned())["shoes"]
        at = np.array([self.file.vertices(primitive, t) for t in np.arange(0, 5, 0.01)])
        on_floor = at[:, :, 2] < 0.002
        self.assertTrue(on_floor.any(1).all())
        self.assertGreater(at[..., 2].min(), -0.005)
        worst = 0
        for k in np.flatnonzero(on_floor.any(0)):
            changes = np.flatnonzero(np.diff(np.concatenate([[0], on_floor[:, k].astype(int), [0]])))
            for first, last in zip(changes[::2], changes[1::2]):
                worst = max(worst, np.linalg.norm(np.ptp(at[first:last, k, :2], axis=0)))
        print(f"the soles slide by at most {1000 * worst:.1f} mm")
        self.assertGreater(worst, 0)
        self.assertLess(worst, 0.005)

    def test_it_does_not_touch_the_furniture(self):
        """No vertex comes closer than 5 cm to a surface of the room above the floor."""
        lines = (SCENES / "room/room.obj").read_text().splitlines()
        points = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], float)
        triangles = np.array([[c.split("/")[0] for c in line.split()[1:4]] for line in lines if line.startswith("f ")], int) - 1
        corners = points[triangles]
        sides = np.linalg.norm(corners - np.roll(corners, 1, 1), axis=2).max(1)
        samples = []
        for n in np.unique(np.ceil(sides / 0.05).astype(int)):
            a, b = (x.ravel() / n for x in np.meshgrid(np.arange(n + 1), np.arange(n + 1)))
            keep = a + b <= 1 + 1e-9
            weights = np.stack([1 - a - b, a, b], -1)[keep]
            samples.append((weights @ corners[np.ceil(sides / 0.05).astype(int) == n]).reshape(-1, 3))
        room = np.vstack(samples)
        room = room[room[:, 2] > 0.02]
        for t in np.linspace(0, 5, 26):
            figure = np.vstack([self.file.vertices(primitive, t)[::3] for _, primitive in self.file.skinned()])
            low, high = figure.min(0) - 0.05, figure.max(0) + 0.05
            near = room[((room > low) & (room < high)).all(1)]
            if len(near):
                distance = np.linalg.norm(near[:, None] - figure[None], axis=2).min()
                self.assertGreater(distance, 0.05, f"at {t} s")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
