import copy
import pickle

import numpy as np
import pytest

import esim


def circle(count=201, duration=2.0):
    """A body that goes round once, turning with it: x forward, z up."""
    t = np.linspace(0, duration, count)
    angle = 2 * np.pi * t / duration
    T = np.zeros((count, 4, 4))
    T[:, 0, 0] = T[:, 1, 1] = np.cos(angle)
    T[:, 1, 0], T[:, 0, 1] = np.sin(angle), -np.sin(angle)
    T[:, 2, 2] = T[:, 3, 3] = 1
    T[:, 0, 3], T[:, 1, 3] = np.sin(angle), -np.cos(angle)
    return t, T


def test_twist_and_acceleration_of_a_circle():
    t, T = circle()
    trajectory = esim.Trajectory.from_poses(t, T)
    state = trajectory.at(0.7)
    assert state.shape == () and state.dtype == esim.STATE_DTYPE and state["t"] == 700_000_000
    omega = np.pi
    np.testing.assert_allclose(state["angular_velocity"], [0, 0, omega], rtol=1e-3, atol=1e-6)
    assert np.linalg.norm(state["velocity"]) == pytest.approx(omega, rel=1e-3)
    np.testing.assert_allclose(state["acceleration"], -(omega**2) * state["position"], rtol=2e-2)
    np.testing.assert_allclose(trajectory.pose(0.7), T[70], atol=1e-4)
    assert trajectory.pose(t).shape == (201, 4, 4) and trajectory.at(t[:6].reshape(2, 3)).shape == (2, 3)
    assert trajectory.fit["max_position_m"] < 1e-3
    assert (trajectory.start, trajectory.end) == (0, 2_000_000_000)


def test_quaternions_matrices_and_units_of_time_are_the_same():
    t, T = circle()
    angle = np.pi * t
    quaternions = 3 * np.stack([0 * t, 0 * t, np.sin(angle / 2), np.cos(angle / 2)], 1)  # of any length
    a = esim.Trajectory.from_poses(t, T)
    b = esim.Trajectory.from_poses(esim.ns(np.rint(t * 1e9).astype(np.int64)), (T[:, :3, 3], quaternions))
    np.testing.assert_allclose(a.pose(t), b.pose(t), atol=1e-9)


def test_files(tmp_path):
    t, T = circle()
    angle = np.pi * t
    rows = np.stack([t, *T[:, :3, 3].T, 0 * t, 0 * t, np.sin(angle / 2), np.cos(angle / 2)], 1)
    np.savetxt(tmp_path / "poses.txt", rows, fmt="%.9f")
    trajectory = esim.Trajectory.load(tmp_path / "poses.txt")
    np.testing.assert_allclose(trajectory.pose(1.0), T[100], atol=1e-4)
    with pytest.raises(esim.Error, match="none.txt"):
        esim.Trajectory.load(tmp_path / "none.txt")


def test_poses_of_a_reconstruction(tmp_path):
    # A camera that moves along x; COLMAP stores the inverse of its pose.
    images = "".join(f"{i + 1} 1 0 0 0 {-0.1 * i} 0 0 1 frame{i}.png\n\n" for i in range(20))
    (tmp_path / "images.txt").write_text(images)
    (tmp_path / "cameras.txt").write_text("1 PINHOLE 120 90 100 100 60 45\n")
    trajectory = esim.Trajectory.load(tmp_path, rate_hz=10, scale=2, up=[0, -1, 0])
    np.testing.assert_allclose(trajectory.pose(1.0)[:3, 3], [2, 0, 0], atol=1e-6)
    np.testing.assert_allclose(trajectory.pose(1.0)[:3, 1], [0, 0, -1], atol=1e-9)  # the image's y axis points down
    for option in ({"rate_hz": 0}, {"scale": -1}, {"up": [0, 0, 0]}, {"up": [1, 2]}):
        with pytest.raises(esim.Error, match=next(iter(option))):
            esim.Trajectory.load(tmp_path, **option)


def test_what_is_no_motion_is_refused():
    t, T = circle()
    trajectory = esim.Trajectory.from_poses(t, T)
    with pytest.raises(esim.Error, match="outside the trajectory"):
        trajectory.at(2.1)
    with pytest.raises(TypeError, match="int"):
        trajectory.at("now")
    with pytest.raises(esim.Error):
        esim.Trajectory.from_poses(t[::-1], T)
    with pytest.raises(esim.Error):
        esim.Trajectory.from_poses(t[:1], T[:1])
    with pytest.raises(ValueError, match="must have shape"):
        esim.Trajectory.from_poses(t, T[:-1])
    with pytest.raises(ValueError, match="finite"):
        esim.Trajectory.from_poses(t * np.nan, T)
    mirrored = T.copy()
    mirrored[3, 2, 2] = -1
    with pytest.raises(esim.Error, match="pose 3"):
        esim.Trajectory.from_poses(t, mirrored)
    with pytest.raises(esim.Error):
        esim.Trajectory.from_poses(t, (T[:, :3, 3], np.zeros((len(t), 4))))
    with pytest.raises(TypeError, match="from_poses"):
        esim.Trajectory()


def test_copies_move_the_same(tmp_path):
    t, T = circle()
    angle = np.pi * t
    rows = np.stack([t, *T[:, :3, 3].T, 0 * t, 0 * t, np.sin(angle / 2), np.cos(angle / 2)], 1)
    np.savetxt(tmp_path / "poses.txt", rows)
    for trajectory in (
        esim.Trajectory.from_poses(t, T),
        esim.Trajectory.from_poses(t, T, order=4, knot_interval_s=0.05, smoothing_time_s=0.01),
        esim.Trajectory.load(tmp_path / "poses.txt"),
    ):
        pickled = pickle.dumps(trajectory)
        for other in (copy.copy(trajectory), copy.deepcopy(trajectory), pickle.loads(pickled)):
            assert (other.start, other.end, other.fit) == (trajectory.start, trajectory.end, trajectory.fit)
            np.testing.assert_array_equal(other.at(t), trajectory.at(t))  # every bit
        assert repr(trajectory) == repr(pickle.loads(pickled)) == "<esim.Trajectory from 0 s to 2 s>"
