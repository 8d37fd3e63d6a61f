"""Tests of esim.Sensor."""

import numpy as np
import pytest

import esim

LENS = {"width": 64, "height": 48, "horizontal_fov_deg": 60}
F = 32 / np.tan(np.radians(30))
SHAPE = (48, 64)
V, U = np.mgrid[:48, :64]
MOVED = [0, 0.02, 0.03, 0.06]


def wall(x):
    """E and depth of a wall 2 m in front of a camera at x."""
    X, Y = (U - 31.5) / F * 2 + x, (V - 23.5) / F * 2
    return 0.5 + 0.4 * np.sin(20 * X) * np.sin(17 * Y + 1), np.full(SHAPE, 2.0)


def pose(x):
    T = np.eye(4)
    T[0, 3] = x
    return T


def make(**options):
    return esim.Sensor(LENS, **{"contrast_threshold": 0.2, "seed": 3, **options})


def run(sensor, convert=lambda T: T):
    return [sensor.step(0.01 * k, *wall(x), convert(pose(x))) for k, x in enumerate(MOVED)]


def test_events_are_those_of_the_scene():
    events = run(make())
    assert len(events[0]) == 0 and all(len(some) > 100 for some in events[1:])
    truth, camera = [], esim.EventCamera(64, 48, contrast_threshold=0.2, seed=3)
    path = np.interp(np.linspace(0, 0.01, 201), [0, 0.01], [0, 0.02])
    for t, x in zip(np.linspace(0, 0.01, 201), path):
        truth.append(camera.process(wall(x)[0], float(t)))
    truth, found = np.concatenate(truth), events[1]
    assert abs(len(found) - len(truth)) < 0.03 * len(truth)
    # Between two frames, the wall moves at constant speed; events are spread over all of the time.
    histogram = [np.histogram(e["t"], 5, (0, 10_000_000))[0] for e in (truth, found)]
    assert np.all(np.abs(histogram[1] - histogram[0]) < 0.15 * histogram[0].max())


@pytest.mark.parametrize(
    "axes, convert",
    [
        ("opengl", lambda T: T @ np.diag([1, -1, -1, 1])),
        ("ros", lambda T: T @ np.array([[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1.0]])),
    ],
)
def test_axes_of_cameras(axes, convert):
    for a, b in zip(run(make()), run(make(axes=axes), convert)):
        np.testing.assert_array_equal(a, b)


def test_unreal_axes_are_left_handed():
    # In Unreal's frame, x is forward and y to the right: the camera moves along y.
    to_right = [np.array([[1, 0, 0, 0], [0, 1, 0, x], [0, 0, 1, 0], [0, 0, 0, 1.0]]) for x in MOVED]
    sensor = make(axes="unreal")
    events = [sensor.step(0.01 * k, *wall(x), T) for k, (x, T) in enumerate(zip(MOVED, to_right))]
    for a, b in zip(run(make()), events):
        np.testing.assert_array_equal(a, b)


def square(x, to=1.0):
    """A square at column x, 1 m away, in front of the wall: E, depth, object."""
    E, depth = wall(0)
    inside = (np.abs(U - x) < 8) & (np.abs(V - 24) < 8)
    E = np.where(inside, np.where((U - x) % 4 < 2, 0.9, 0.1), E)
    return E, np.where(inside, to, depth), np.where(inside, 7, 0)


def object_pose(x):
    T = np.eye(4)
    T[:3, 3] = (x - 31.5) / F, 0, 1
    return T


def test_objects_by_pose_and_by_motion_vectors_agree():
    by_pose, by_motion, by_both = make(), make(), make()
    for k, x in enumerate((20, 24, 28)):
        E, depth, objects = square(x)
        motion = np.zeros((2, *SHAPE), np.float32)
        motion[0, objects == 7] = 4
        first = by_pose.step(0.01 * k, E, depth, objects=objects, object_poses={7: object_pose(x)})
        second = by_motion.step(0.01 * k, E, depth, motion=motion)
        third = by_both.step(0.01 * k, E, depth, motion=motion, objects=objects)
        for other in (second, third):
            assert abs(len(first) - len(other)) <= 0.1 * len(first)
    assert len(first) > 500
    assert by_motion.statistics["objects"] == by_both.statistics["objects"] == 1
    assert by_motion.statistics["moving"] == pytest.approx(15 * 15 / 64 / 48)
    # Without its motion, the object would appear and vanish.
    assert by_pose.statistics["reconstructions"] > 10


def test_supersampling_and_margin_change_the_size_of_frames():
    sensor = make(supersampling=2, margin_px=4)
    assert sensor.frame_shape == (112, 144) and sensor.margin_px == 4
    assert "frames of 144 x 112 px" in repr(sensor)
    sensor.step(0.0, np.full((112, 144), 0.5), np.ones((112, 144)))
    with pytest.raises(esim.Error, match="144 x 112 pixels"):
        sensor.step(0.01, *wall(0))


def test_labels_of_seed_and_presets():
    assert make(preset="davis346").step(0.0, *wall(0)).size == 0
    with pytest.raises(esim.Error, match="preset"):
        make(preset="davis999")
    with pytest.raises(esim.Error, match="focal"):
        esim.Sensor({**LENS, "focal": 3})
    with pytest.raises(TypeError, match="camera must be a dict"):
        esim.Sensor(346, 260)
    with pytest.raises(esim.Error, match="axes must be one of"):
        make(axes="blender")


def test_bad_frames_are_refused_without_effect():
    sensor, same = make(), make()
    for s in (sensor, same):
        s.step(0.0, *wall(0), pose(0))
    E, depth = wall(0.02)
    bad_depth, negative = depth.copy(), E.copy()
    bad_depth[3, 4], negative[3, 4] = np.nan, -1
    for arguments, options, text in (
        ((0.01, E, bad_depth), {}, "depth"),
        ((0.01, negative, depth), {}, r"-1.0 at pixel \(4, 3\)"),
        ((0.0, E, depth), {}, "not later than the previous one"),
        ((0.01, E, depth, np.eye(3)), {}, "pose must have shape"),
        ((0.01, E, depth, 2 * np.eye(4)), {}, "pose"),
        ((0.01, E, depth, np.full((4, 4), np.nan)), {}, "pose"),
        ((0.01, E, depth), {"object_poses": {}}, "object_poses need objects"),
        ((0.01, E, depth), {"objects": np.zeros(SHAPE, int)}, "objects need object_poses or motion"),
        ((0.01, E, depth), {"objects": np.zeros((3, 3), int), "object_poses": {}}, "shape of frames"),
        ((0.01, E, depth), {"motion": np.zeros(SHAPE)}, "motion"),
        ((0.01, E, depth), {"motion": np.zeros((2, *SHAPE)), "objects": np.zeros(SHAPE, int), "object_poses": {}}, "both given"),
    ):
        with pytest.raises(esim.Error, match=text):
            sensor.step(*arguments, **options)
    for a, b in zip(*([s.step(0.01, E, depth, pose(0.02)), s.step(0.02, *wall(0.03), pose(0.03))] for s in (sensor, same))):
        np.testing.assert_array_equal(a, b)


def test_contradictory_frames_warn():
    sensor = make()
    sensor.step(0.0, *wall(0), pose(0))
    motion = np.zeros((2, *SHAPE))
    motion[0] = -F * 0.02 / 2 * -1  # the wrong sign: the wall moves to the left
    with pytest.warns(esim.LossWarning, match="check their sign"):
        sensor.step(0.01, *wall(0.02), pose(0.02), motion=motion)


def test_depth_of_the_sky_may_be_zero_or_infinite():
    events = []
    for sky in (0, np.inf):
        sensor = make()
        for k in range(2):
            E, depth = wall(0.02 * k)
            depth[:10] = sky
            events.append(sensor.step(0.01 * k, E, depth, pose(0.02 * k)))
    np.testing.assert_array_equal(events[1], events[3])


def test_images_are_made_at_distances_of_a_pixel_of_the_frames():
    def made(**options):
        sensor = make(supersampling=4, **options)
        frames = [[np.repeat(np.repeat(image, 4, 0), 4, 1) for image in wall(x)] for x in MOVED]
        return [sensor.step(0.01 * k, *frame, pose(x)) for k, (frame, x) in enumerate(zip(frames, MOVED))]

    default = made()
    for a, b in zip(default, made(lambda_px=0.25)):
        np.testing.assert_array_equal(a, b)
    assert any(not np.array_equal(a, b) for a, b in zip(default, made(lambda_px=0.5)))
