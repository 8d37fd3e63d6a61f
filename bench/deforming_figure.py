"""Measures the speed and the accuracy of a deforming figure: scenes/walker.yaml.

    python3 bench/deforming_figure.py [--seconds 5]

Prints
- the time of an image of the figure alone, on one thread, with 16 samples per pixel;
- the real-time factor of each sampling method, with two threads, and the errors that the method measured;
- the motion field against finite differences of the positions of the figure's points, from the optical flow of the
  ground truth, which knows the positions but not the velocities of vertices.

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
    rendering, frames = report["wall_s_by_stage"]["render"], report["cameras"][0]["frames"]
    print(f"figure and vase alone, one thread: {1e3 * rendering / frames:.2f} ms per image")
    for method in ("flow", "adaptive", "keyframes"):
        report = simulate(FOLDER / "scenes/walker.yaml", folder / method, f"duration_s={seconds}",
                          f"camera.sampling.type={method}")
        camera = report["cameras"][0]
        known = {key: value for key, value in camera.items() if key in ("tolerance", "measured_error", "frame_equivalents")}
        print(f"{method}: real-time factor {report['real_time_factor']:.2f}, {known}")


def print_motion_field(folder):
    """The optical flow f over h = 1 ms and over 2 h gives V = 2 f(h) / h - f(2 h) / 2 h, up to terms of h^2. Between two
    keys of the animation, since its velocity jumps at keys."""
    differences = []
    for key in range(10, 290, 29):
        flows = []
        for rate in (1000, 500):
            out = folder / f"flow{key}-{rate}"
            simulate(FOLDER / "scenes/walker.yaml", out, f"start_s={key / 60 + 0.001}", "duration_s=0.012",
                     f"truth.rate_hz={rate}", "truth.optical_flow=true", "truth.objects=true", "output.compression=none")
            with h5py.File(out / "cam0/truth.h5") as truth:
                v, flow, seen = truth["motion_field"][:], truth["optical_flow"][:], truth["objects"][:]
            flows.append((flow[-len(v) + 1:] * rate, v, seen))
        (near, v, seen), (far, _, _) = flows
        expected = 2 * near[:2 * len(far):2] - far
        difference = np.linalg.norm(v[:2 * len(far):2] - expected, axis=1)[seen[:2 * len(far):2] > 0]
        differences.append(difference[np.isfinite(difference)])
    difference = np.concatenate(differences)
    print(f"motion field against finite differences, {difference.size} pixels of the figure: rms "
          f"{np.sqrt(np.mean(difference**2)):.4f}, 99 % below {np.quantile(difference, 0.99):.4f} px/s")


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
