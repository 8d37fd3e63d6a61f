import numpy as np
import pytest

import esim

gymnasium = pytest.importorskip("gymnasium")
from gymnasium.utils.env_checker import check_env  # noqa: E402

import esim.gym  # noqa: E402
from esim.gym._motion import rotation_vector  # noqa: E402

START = np.eye(4)
START[:3, :3] = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]  # looks along x, at the plane of `poster`


def make(poster, **options):
    return esim.gym.EventEnv(poster, START, **{"overrides": {"duration_s": 0.1, "sampling": {"type": "flow", "min_rate_hz": 200}}, **options})


def episode(env, seed, action):
    """All observations, and the last results of step()."""
    image, info = env.reset(seed=seed)
    images, over = [image], False
    while not over:
        image, reward, terminated, truncated, info = env.step(action)
        images.append(image)
        over = terminated or truncated
    return np.array(images), (reward, terminated, truncated, info)


@pytest.mark.parametrize("observation", ["voxels", "counts"])
def test_the_checker_passes(poster, observation):
    check_env(make(poster, observation=observation), skip_render_check=True)


def test_it_is_registered(poster):
    env = gymnasium.make("esim/Events-v0", scenario=poster, start=START)
    assert env.reset(seed=1)[0].shape == (5, 30, 40)


def test_motion_makes_events_and_rest_makes_none(poster):
    still, _ = episode(make(poster), 1, np.zeros(6))
    assert not still.any()
    moving, (_, terminated, truncated, info) = episode(make(poster, observation="counts"), 1, [1, 0, 0, 0, 0, 0])
    assert len(moving) == 11 and moving.sum() > 500 and truncated and not terminated
    assert info["known_until"] == 100_000_000 and info["t"] == 105_000_000
    np.testing.assert_allclose(info["pose"][:3, 3], START[:3, 0] * 0.1, atol=1e-9)


def test_actions_are_twists_of_the_body(poster):
    env = make(poster, max_angular_velocity=2)
    env.reset(seed=1)
    for _ in range(3):
        *_, info = env.step([0, 0, 0, 0, 0, 5])  # clipped to 1
    expected = START[:3, :3] @ esim.gym.rotation(np.array([0, 0, 0.06]))
    np.testing.assert_allclose(info["pose"][:3, :3], expected, atol=1e-9)
    np.testing.assert_allclose(esim.gym.rotation(np.array([0, 0, np.pi / 2])), [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-12)


def test_the_seed_determines_an_episode(poster):
    noisy = {**poster, "event_camera": {**poster["event_camera"], "threshold_noise": 0.05}}

    def start(random):
        T = START.copy()
        T[1, 3] = random.uniform(-0.1, 0.1)
        return T

    runs = [episode(esim.gym.EventEnv(noisy, start, overrides={"duration_s": 0.05}), seed, [1, 0, 0, 0, 0, 1])[0] for seed in (1, 1, 2)]
    np.testing.assert_array_equal(runs[0], runs[1])
    assert (runs[0] != runs[2]).any()


def test_reward_and_end(poster):
    env = make(poster, reward=lambda env, info: -len(env.events), terminated=lambda env, info: info["t"] > 40_000_000)
    _, (reward, terminated, truncated, _) = episode(env, 1, [1, 0, 0, 0, 0, 0])
    assert reward < 0 and terminated and not truncated
    with pytest.raises(esim.Error, match="reset"):
        env.step(np.zeros(6))


def test_bad_actions_move_nothing(poster):
    env = make_vector(poster, 2)
    env.reset(seed=1)
    for bad in ([[0] * 6, [np.nan] * 6], [[0] * 6], [[0] * 5] * 2):
        with pytest.raises(esim.Error, match="6 finite numbers"):
            env.step(bad)
    assert env.step(np.zeros((2, 6)))[4]["t"].tolist() == [15_000_000] * 2


def test_bad_arguments(poster):
    with pytest.raises(TypeError, match="observations"):
        make(poster, observations="counts")
    with pytest.raises(esim.Error, match="multiple of interval_s"):
        make(poster, step_s=0.012)
    with pytest.raises(esim.Error, match="observation"):
        make(poster, observation="frames")
    with pytest.raises(esim.Error, match="action"):
        make(poster, action="force")
    with pytest.raises(esim.Error, match="max_events"):
        make(poster, max_events=0)
    with pytest.raises(esim.Error, match="autoreset"):
        make_vector(poster, 2, autoreset="disabled")
    with pytest.raises(esim.Error, match="several event sensors"):
        make(poster, overrides={"duration_s": 0.1, "event_camera.contrast_threshold": {"values": [0.2, 0.4]}})


def make_vector(poster, count, **options):
    return esim.gym.EventVectorEnv(
        count, poster, START, **{"overrides": {"duration_s": 0.1, "sampling": {"type": "flow", "min_rate_hz": 200}}, **options}
    )


def test_many_agents_see_what_one_sees(poster):
    noisy = {**poster, "event_camera": {**poster["event_camera"], "threshold_noise": 0.05}}
    actions = np.array([[1, 0, 0, 0, 0, 0], [0, 1, 0, 0, 0, 0.5], [0, 0, 0, 0, 0, 1]])
    runs = []
    for threads in (1, 2):
        env = make_vector(noisy, 3, threads=threads)
        images, _ = env.reset(seed=5)
        runs.append([images, *(env.step(actions)[0] for _ in range(10))])
        env.close()
    np.testing.assert_array_equal(runs[0], runs[1])
    for i in range(3):
        alone, _ = episode(make(noisy), 5 + i, actions[i])
        np.testing.assert_array_equal(alone, np.array(runs[0])[:, i])


def test_episodes_end_and_begin_by_themselves(poster):
    def terminated(env, infos):
        return infos["pose"][:, 2, 3] > 0.0349  # agent 1 rises by 1 cm in each step

    env = make_vector(poster, 2, terminated=terminated, reward=lambda env, infos: infos["pose"][:, 2, 3])
    env.reset(seed=1)
    actions = np.array([[0, 0, 0, 0, 0, 0], [0, -1, 0, 0, 0, 0]])
    rows = []
    for _ in range(12):
        images, rewards, ended, truncated, infos = env.step(actions)
        assert images.shape == (2, 5, 30, 40) and images.dtype == np.float32
        rows.append((rewards[1], ended.tolist(), truncated.tolist(), infos["t"].tolist()))
    assert [row[1] for row in rows] == [[False, k in (3, 8)] for k in range(12)]  # after four steps, and one that begins
    assert rows[4][0] == 0 and rows[4][3][1] == 0 and rows[5][0] == pytest.approx(0.01)
    assert [row[2][0] for row in rows] == [k == 9 for k in range(12)] and rows[10][3][0] == 0


def test_episodes_end_and_begin_in_the_same_step(poster):
    options = {"terminated": lambda env, infos: infos["pose"][:, 2, 3] > 0.0349, "observation": ["counts", "pose"]}
    usual, at_once = make_vector(poster, 2, **options), make_vector(poster, 2, autoreset="same_step", **options)
    assert at_once.metadata["autoreset_mode"] == gymnasium.vector.AutoresetMode.SAME_STEP
    usual.reset(seed=1), at_once.reset(seed=1)
    actions = np.array([[0, 0, 0, 0, 0, 0], [0, -1, 0, 0, 0, 0]])
    for k in range(4):
        seen, _, ended, _, infos = usual.step(actions)
        seen_at_once, _, ended_at_once, _, infos_at_once = at_once.step(actions)
        assert ended.tolist() == ended_at_once.tolist() == [False, k == 3]
    assert infos_at_once["_final_obs"].tolist() == [False, True] and infos_at_once["final_obs"][0] is None
    for name in ("counts", "pose"):
        np.testing.assert_array_equal(infos_at_once["final_obs"][1][name], seen[name][1])
        np.testing.assert_array_equal(seen_at_once[name][0], seen[name][0])
    np.testing.assert_array_equal(infos_at_once["final_info"]["t"], infos["t"])
    assert not seen_at_once["counts"][1].any() and infos_at_once["t"].tolist() == [infos["t"][0], 0]
    np.testing.assert_allclose(seen_at_once["pose"][1], START)
    for _ in range(2):  # agent 1 begins again, and moves
        usual.step(actions)
    at_once.step(actions)
    np.testing.assert_array_equal(at_once.pose[1], usual.pose[1])


def random_rotations(count, seed):
    vectors = np.random.default_rng(seed).normal(size=(count, 3))
    return vectors * np.minimum(1, 3.1 / np.linalg.norm(vectors, axis=1))[:, None]


def test_rotation_vectors_are_found_again():
    vectors = np.concatenate([random_rotations(200, 1), np.pi * np.eye(3), -3.14 * np.eye(3), [[0, 0, 0], [1e-9, 0, 0]]])
    found = rotation_vector(esim.gym.rotation(vectors))
    np.testing.assert_allclose(esim.gym.rotation(found), esim.gym.rotation(vectors), atol=1e-7)
    assert (np.linalg.norm(found, axis=1) <= np.pi + 1e-9).all()


def test_poses_are_reached(poster):
    env = make(poster, action="pose")
    check_env(make(poster, action="pose"), skip_render_check=True)
    env.reset(seed=1)
    target = np.array([0.01, -0.02, 0.005, 1.2, -1.21, 1.22])
    *_, info = env.step(target)
    np.testing.assert_allclose(info["pose"][:3, 3], target[:3], atol=1e-9)
    np.testing.assert_allclose(info["pose"][:3, :3], esim.gym.rotation(target[3:]), atol=1e-9)
    np.testing.assert_allclose(info["velocity"], target[:3] / 0.01, atol=1e-9)


def test_thrust_accelerates_against_gravity(poster):
    upright = np.eye(4)
    env = esim.gym.EventEnv(poster, upright, action="thrust", max_acceleration=19.62, overrides={"duration_s": 0.5})
    check_env(env, skip_render_check=True)
    env.reset(seed=1)
    for _ in range(10):
        *_, info = env.step([0.5, 0, 0, 0])  # hovers
    np.testing.assert_allclose(info["pose"], upright, atol=1e-6)
    for _ in range(10):
        *_, info = env.step([0, 0, 0, 0])
    np.testing.assert_allclose(info["velocity"], [0, 0, -0.981], atol=1e-6)
    np.testing.assert_allclose(info["pose"][:3, 3], [0, 0, -0.5 * 9.81 * 0.01], atol=1e-6)
    env.reset(seed=1)
    *_, info = env.step([1, 0, 0, 0])
    assert info["velocity"][2] == pytest.approx(0.0981)
    many = make_vector(poster, 2, action="thrust", max_acceleration=19.62)
    many.reset(seed=1)
    *_, infos = many.step([[1, 0, 0, 0], [0, 0, 0, 1]])
    # START looks along x: the body's z axis is x.
    np.testing.assert_allclose(infos["velocity"], [[0.1962, 0, -0.0981], [0, 0, -0.0981]], atol=1e-6)


def test_raw_events_are_padded(poster):
    env = make_vector(poster, 2, observation="events", max_events=50)
    env.reset(seed=1)
    left_out = 0
    for _ in range(5):
        seen, *_, infos = env.step([[1, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0]])
        events, rows = env.events[0], seen[0]
        assert infos["events_left_out"].tolist() == [max(0, len(events) - 50), 0] and not seen[1].any()
        left_out += infos["events_left_out"][0]
        last = events[-50:]
        np.testing.assert_array_equal(rows[: len(last), 1:3], np.column_stack([last["x"], last["y"]]))
        np.testing.assert_array_equal(rows[: len(last), 3], np.where(last["p"] > 0, 1, -1))
        np.testing.assert_allclose(rows[: len(last), 0], 1e-9 * (last["t"] - env.packets[0][0].t0), atol=1e-8)
        assert not rows[len(last) :].any()
    assert left_out > 0
    check_env(make(poster, observation="events"), skip_render_check=True)


def test_gymnasium_makes_it(poster):
    env = gymnasium.make_vec("esim/Events-v0", num_envs=2, vectorization_mode="vector_entry_point", scenario=poster, start=START)
    images, _ = env.reset(seed=[3, 4])
    assert env.observation_space.contains(images) and env.action_space.shape == (2, 6)
    assert env.step(env.action_space.sample())[0] in env.observation_space
    with pytest.raises(esim.Error, match="3 seeds for 2"):
        env.reset(seed=[1, 2, 3])
    env.close()


EVERYTHING = ["voxels", "counts", "time_surface", "depth", "motion_field", "imu", "pose"]


def test_everything_can_be_seen(poster):
    overrides = {"duration_s": 0.1, "sampling": {"type": "flow", "min_rate_hz": 200}, "truth.rate_hz": 100}
    check_env(make(poster, observation=EVERYTHING, overrides=overrides), skip_render_check=True)
    env = make_vector(poster, 2, observation=EVERYTHING, overrides=overrides)
    env.reset(seed=1)
    events = [[], []]
    for _ in range(5):
        seen, *_, infos = env.step([[1, 0, 0, 0, 0, 0], [0, 0, 0.5, 0, 0, 1]])
        for own, new in zip(events, env.events):
            own.append(new)
    assert env.observation_space.contains(seen)
    for i in range(2):
        packet = env.packets[i][-1]
        np.testing.assert_array_equal(seen["depth"][i], packet.depth[-1])
        np.testing.assert_array_equal(seen["motion_field"][i], packet.motion_field[-1])
        np.testing.assert_allclose(seen["pose"][i], infos["pose"][i], rtol=1e-6)
        np.testing.assert_allclose(seen["imu"][i], [*packet.imu[-1]["angular_rate"], *packet.imu[-1]["specific_force"]], rtol=1e-6)
        np.testing.assert_array_equal(seen["counts"][i], esim.event_count(env.events[i]))
        surface = esim.time_surface(np.concatenate(events[i]), t=esim.ns(packet.t1))
        np.testing.assert_allclose(seen["time_surface"][i], surface, atol=1e-6)


def test_events_stay_near_the_end_of_the_step(poster):
    # With flow sampling, samples soon leave the times of the steps.
    overrides = {"duration_s": 2, "sampling": {"type": "flow", "min_rate_hz": 70}}
    env = make(poster, step_s=0.1, overrides=overrides)
    env.reset(seed=1)
    lags_ms = []
    for k in range(12):
        *_, info = env.step([0, 0.3 * (-1) ** k, 0, 0, 0, 0.37])
        lags_ms.append((info["t"] - info["known_until"]) / 1e6)
    # An interval of the motion for its spline and one for the packet, and the longest interval between samples.
    assert max(lags_ms) <= 5 + 5 + 1000 / 70
