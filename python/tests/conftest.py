import pathlib

import numpy as np
import pytest

import esim

ROOT = pathlib.Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def poster(tmp_path_factory):
    """A short scenario, as a dict."""
    path = tmp_path_factory.mktemp("poster") / "poster.pgm"
    y, x = np.mgrid[:64, :64]
    picture = (128 + 100 * np.sin(x * 0.4) * np.sin(y * 0.3)).astype(np.uint8)
    path.write_bytes(b"P5 64 64 255\n" + picture.tobytes())
    return {
        "duration_s": 0.2,
        "renderer": {"type": "plane", "image": path, "width_m": 2.0, "endless": True, "pose": {"position": [1, 0, 0], "look_at": [2, 0, 0]}},
        "trajectory": {"type": "random", "position_amplitude_m": [0.2, 0.2, 0.1], "rotation_amplitude_deg": [5, 5, 10]},
        "camera": {"width": 40, "height": 30},
        "event_camera": {"contrast_threshold": 0.1},
        "imu": {"rate_hz": 500},
    }


def random_events(count, width, height, seed=0, last=10_000_000):
    """Events in order."""
    random = np.random.default_rng(seed)
    events = np.empty(count, esim.EVENT_DTYPE)
    events["t"] = np.sort(random.integers(1000, last, count))
    events["x"] = random.integers(0, width, count)
    events["y"] = random.integers(0, height, count)
    events["p"] = random.choice([-1, 1], count)
    return events
