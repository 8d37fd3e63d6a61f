"""Compares events and images with those of pixels that are averaged over 4 x 4 parts.

    python3 bench/pixel_area.py build/release/esim scenes/panorama.yaml [SECONDS]

Renders SCENARIO, whose camera must be a pinhole given by its field of view, at 1000 images per second with its own camera
and with one of 4 x 4 times as many pixels. From both series of images, it counts the events of ideal pixels with a
threshold of 0.3. Needs NumPy and Pillow.
"""

import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np
from PIL import Image

PARTS = 4  # along each side of a pixel
THRESHOLD = 0.3
LOG_EPS = 0.001
CODES = np.arange(256) / 255
IRRADIANCE = np.where(CODES <= 0.04045, CODES / 12.92, ((CODES + 0.055) / 1.055) ** 2.4)


def images(esim, scenario, seconds, width, height, folder):
    """Irradiance of all images; the sensor is set not to fire."""
    settings = [f"duration_s={seconds}", f"camera.width={width}", f"camera.height={height}", "truth.rate_hz=1000",
                "truth.depth=false", "truth.motion_field=false", "output.preview=false",
                "sampling={type: uniform, rate_hz: 1000}", "event_camera={contrast_threshold: 10}"]
    options = [part for setting in settings for part in ("--set", setting)]
    subprocess.run([esim, "simulate", scenario, "--out", folder, "--quiet", *options], check=True)
    for path in sorted(pathlib.Path(folder, "cam0", "images").glob("*.png")):
        yield IRRADIANCE[np.asarray(Image.open(path).convert("L"))]


def events(series):
    """How often the brightness of a pixel has changed by the threshold since its last event."""
    brightness = np.log(series + LOG_EPS)
    reference, count = brightness[0].copy(), 0
    for now in brightness[1:]:
        steps = np.trunc((now - reference) / THRESHOLD)
        count += int(np.abs(steps).sum())
        reference += steps * THRESHOLD
    return count


def main():
    esim, scenario, seconds = sys.argv[1], sys.argv[2], float(sys.argv[3]) if len(sys.argv) > 3 else 0.1
    text = pathlib.Path(scenario).read_text()
    width, height = (int(re.search(rf"\b{name}: (\d+)", text)[1]) for name in ("width", "height"))
    with tempfile.TemporaryDirectory() as folder:
        seen = np.array(list(images(esim, scenario, seconds, width, height, f"{folder}/own")))
        parts = images(esim, scenario, seconds, PARTS * width, PARTS * height, f"{folder}/parts")
        mean = np.array([image.reshape(height, PARTS, width, PARTS).mean((1, 3)) for image in parts])
    error = np.sqrt(((seen - mean) ** 2).mean())
    print(f"events {events(seen)}, of the mean {events(mean)}: {events(seen) / events(mean):.3f}; "
          f"rms difference of irradiance {error:.4f}, {error / mean.mean():.2%} of the mean")


if __name__ == "__main__":
    main()
