"""Compares images and events of pixels with those of pixels that are divided into 4 x 4 parts, or 8 x 8.

    export PYTHONPATH=build/release/python
    python3 bench/pixel_area.py scenes/panorama.yaml
    python3 bench/pixel_area.py scenes/room.yaml --try renderer.engine=raycast --reference renderer.engine=raycast

Renders the scenario, whose camera must be a pinhole given by its field of view, with its own camera and with one of 4 x 4
times as many pixels, whose mean over each pixel is the reference. Each --try renders the scenario's own pixels once more
with other options. Prints, for each of them, the number of events of ideal pixels in proportion to the reference, and the
root mean square differences of irradiance and of brightness L = ln(E + log_eps). Needs NumPy and esim's Python package.
"""

import argparse
import re
import sys

import numpy as np

import esim

LOG_EPS = 0.001


def images(scenario, settings, rate, seconds, factor):
    """Irradiance of all images, `factor` times the scenario's size along each side; the sensor does not fire."""
    text = esim.Scenario.load(scenario).to_yaml()
    size = [factor * int(re.search(rf"\b{side}: (\d+)", text)[1]) for side in ("width", "height")]
    fixed = [f"duration_s={seconds:g}", f"camera.width={size[0]}", f"camera.height={size[1]}", f"truth.rate_hz={rate:g}",
             "truth.depth=false", "truth.motion_field=false", f"sampling={{type: uniform, rate_hz: {rate:g}}}",
             "event_camera={contrast_threshold: 100}"]
    for packet in esim.simulate(scenario, overrides=[*settings, *fixed]):
        yield from packet.irradiance


def means(image, parts):
    height, width = image.shape
    return image.reshape(height // parts, parts, width // parts, parts).mean((1, 3), dtype=np.float64)


class Pixels:
    """Ideal pixels that see a series of images."""

    def __init__(self, name, series, options):
        self.name, self.series, self.options = name, series, options
        self.camera, self.count, self.events, self.light, self.log = None, 0, 0, 0.0, 0.0

    def next(self, index, reference):
        """Sees the next image; the first argument is its number. Compares it with that of the reference."""
        image = next(self.series, None)
        if image is None:
            return None
        if self.camera is None:
            self.camera = esim.EventCamera(*image.shape[::-1], contrast_threshold=self.options.threshold, log_eps=LOG_EPS)
        self.events += len(self.camera.process(image.astype(np.float32), index / self.options.rate))
        if reference is not None:
            self.count += 1
            self.light += ((image - reference) ** 2).mean(dtype=np.float64)
            self.log += ((np.log(image + LOG_EPS) - np.log(reference + LOG_EPS)) ** 2).mean(dtype=np.float64)
        return image


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenario", help="YAML file; its camera must be given by horizontal_fov_deg")
    parser.add_argument("--parts", type=int, default=4, help="parts of a pixel along each side (default: 4)")
    parser.add_argument("--seconds", type=float, default=0.1, help="simulated time (default: 0.1)")
    parser.add_argument("--rate", type=float, default=1000, help="images per second (default: 1000)")
    parser.add_argument("--threshold", type=float, default=0.3, help="contrast threshold of the pixels (default: 0.3)")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="option of all renderings")
    parser.add_argument("--reference", action="append", default=[], metavar="KEY=VALUE", help="option of the reference only")
    parser.add_argument("--try", action="append", default=[], metavar="KEY=VALUE", dest="trials",
                        help="also compare the scenario's own pixels with this option")
    options = parser.parse_args()
    if options.parts < 2 or not options.seconds > 0 or not options.rate > 0:
        parser.error("--parts must be at least 2; --seconds and --rate must be above 0")

    def series(settings, factor=1):
        return images(options.scenario, [*options.set, *settings], options.rate, options.seconds, factor)

    reference = Pixels(f"mean of {options.parts} x {options.parts} parts",
                       (means(image, options.parts) for image in series(options.reference, options.parts)), options)
    seen = [Pixels("scenario", series([]), options), *(Pixels(trial, series([trial]), options) for trial in options.trials)]
    total, index = 0.0, 0
    while (exact := reference.next(index, None)) is not None:
        total += exact.mean()
        for pixels in seen:
            pixels.next(index, exact)
        index += 1
    print(f"{reference.name}: {index} images, {reference.events} events, mean irradiance {total / index:.4f}")
    for pixels in seen:
        light = np.sqrt(pixels.light / pixels.count)
        print(f"{pixels.name}: {pixels.events} events, {pixels.events / max(reference.events, 1):.3f} times as many; "
              f"rms difference of E {light:.5f}, {light * index / total:.2%} of the mean; of L {np.sqrt(pixels.log / pixels.count):.5f}")


if __name__ == "__main__":
    try:
        main()
    except esim.Error as error:
        sys.exit(f"pixel_area.py: {error}")
