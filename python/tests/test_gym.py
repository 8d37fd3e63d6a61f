import numpy as np
import pytest

import esim

gymnasium = pytest.importorskip("gymnasium")
from gymnasium.utils.env_checker import check_env  # noqa: E402

import esim.gym  # noqa: E402

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
