"""Measures the speed and the accuracy of a deforming figure: scenes/walker.yaml.

    python3 bench/deforming_figure.py [--seconds 5]

Prints
- the time of an image of the figure alone, on one thread, with 16 samples per pixel;
- the real-time factor of each sampling method, with two threads, and the errors that the method measured;
- the motion field against finite differences: the positions of the figure's points 0.1 ms later (the optical flow of
  the ground truth, which knows the positions but not the velocities of vertices).

Needs NumPy and h5py; `esim` must be on the path, or named by ESIM_PROGRAM.
"""

import argparse
import json
import os
import pathlib
import subprocess
import tempfile

import h5py
import numpy as np

FOLDER = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = os.environ.get("ESIM_PROGRAM", "esim")

ALONE = """
renderer: {{type: mesh, scene: {scenes}/walker/walker.glb, samples_per_pixel: 16, engine: raster}}
trajectory: {{type: file, path: {scenes}/walker/camera.txt}}
camera: {{width: 346, height: 260, horizontal_fov_deg: 75}}
sampling: {{type: uniform, rate_hz: 50}}
event_camera: {{contrast_threshold: 0.25}}
"""


def simulate(scenario, out, *options, threads=2):
    """Simulates and returns the report."""
    sets = [argument for option in options for argument in ("--set", option)]
    command = [PROGRAM, "simulate", scenario, "--out", out, "--quiet", "--threads", str(threads), *sets]
    subprocess.run(command, check=True)
    return json.loads((out / "report.json").read_text())


def print_speed(folder, seconds):
    alone = folder / "alone.yaml"
    alone.write_text(ALONE.format(scenes=FOLDER / "scenes"))
    report = simulate(alone, folder / "alone", f"duration_s={min(seconds, 4)}", threads=1)
    rendering = report["wall_seconds"]
    samples = report["cameras"][0]["sampling"]["samples"]
    print(f"figure alone, one thread: {1e3 * rendering / samples:.2f} ms per image, everything included")
    for method in ("flow", "adaptive", "keyframes"):
        report = simulate(FOLDER / "scenes/walker.yaml", folder / method, f"duration_s={seconds}",
                          f"camera.sampling.type={method}")
        sampling = report["cameras"][0]["sampling"]
        errors = {key: value for key, value in sampling.items() if "error" in key or key == "tolerance"}
        print(f"{method}: real-time factor {seconds / report['wall_seconds']:.2f}, {errors}")


def print_motion_field(folder):
    """In 2 ms of each of ten moments: V in the middle of two frames against the displacement between them."""
    rate = 10_000
    differences = []
    for start in np.arange(0.25, 4.9, 0.5):
        out = folder / f"flow{start}"
        simulate(FOLDER / "scenes/walker.yaml", out, f"start_s={start}", "duration_s=0.002", f"truth.rate_hz={rate}",
                 "truth.optical_flow=true", "truth.objects=true", "output.compression=none")
        with h5py.File(out / "cam0/truth.h5") as truth:
            v, flow, seen = truth["motion_field"][:], truth["optical_flow"][:], truth["objects"][:]
        moved = flow[-len(v) + 1:] * rate  # of frame i, by frame i + 1
        figure = (seen[:-1] > 0) & (seen[1:] > 0)
        # V of the same point halfway: the mean of V here and, one frame later, at the same pixel.
        middle = 0.5 * (v[:-1] + v[1:])
        difference = np.linalg.norm(moved - middle, axis=1)[figure]
        differences.append(difference[np.isfinite(difference)])
    difference = np.concatenate(differences)
    print(f"motion field against finite differences, {difference.size} pixels of the figure: rms "
          f"{np.sqrt(np.mean(difference**2)):.4f}, median {np.median(difference):.4f}, 99 % below "
          f"{np.quantile(difference, 0.99):.4f} px/s")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=5)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        print_motion_field(folder)
        print_speed(folder, arguments.seconds)


if __name__ == "__main__":
    main()
