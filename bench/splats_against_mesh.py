"""Compares scenes/splats.yaml with the mesh from which its splats were made, scenes/room.yaml.

    python3 bench/splats_against_mesh.py [--seconds 2]

Simulates both and prints the agreement of images, depth, motion field and events. Needs NumPy, h5py and OpenCV; `esim`
must be on the path, or named by ESIM_PROGRAM.
"""

import argparse
import os
import pathlib
import subprocess
import tempfile

import cv2
import h5py
import numpy as np

FOLDER = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = os.environ.get("ESIM_PROGRAM", "esim")


def simulate(scene, out, seconds):
    """Both with the same sampling and sensor."""
    options = [f"duration_s={seconds}", "truth.rate_hz=10", "camera.sampling.type=adaptive", "output.compression=gzip"]
    scenario = out.with_suffix(".yaml")
    text = (FOLDER / scene).read_text().splitlines()
    text = [line for line in text if not line.startswith("sampling:")]
    scenario.write_text("\n".join(text).replace(": room/", f": {FOLDER}/scenes/room/").replace(
        ": splats/", f": {FOLDER}/scenes/splats/"))
    sets = [argument for option in options for argument in ("--set", option)]
    subprocess.run([PROGRAM, "simulate", scenario, "--out", out, "--quiet", *sets], check=True)


def linear(path):
    """Irradiance of an image of the recording, from 8-bit sRGB."""
    encoded = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) / 255
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def psnr(a, b):
    return -10 * np.log10(np.mean((a - b) ** 2))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=2)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        splats, mesh = pathlib.Path(folder, "splats"), pathlib.Path(folder, "mesh")
        simulate("scenes/splats.yaml", splats, arguments.seconds)
        simulate("scenes/room.yaml", mesh, arguments.seconds)
        images = sorted(path.name for path in (mesh / "cam0/images").glob("*.png"))
        pairs = [(linear(splats / "cam0/images" / name), linear(mesh / "cam0/images" / name)) for name in images]
        a, b = (np.array(side) for side in zip(*pairs, strict=True))
        encoded = [np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055) for x in (a, b)]
        print(f"images: PSNR {psnr(a, b):.1f} dB of irradiance, {psnr(*encoded):.1f} dB as sRGB")
        with h5py.File(splats / "cam0/truth.h5") as one, h5py.File(mesh / "cam0/truth.h5") as other:
            z, true_z = one["depth"][:], other["depth"][:]
            seen = np.isfinite(z) & np.isfinite(true_z)
            error = np.abs(z[seen] / true_z[seen] - 1)
            print(f"depth: median error {100 * np.median(error):.3f} %, above 2 % in {100 * np.mean(error > 0.02):.1f} "
                  f"% of pixels; no surface in {100 * np.mean(~np.isfinite(z)):.2f} %")
            v = np.linalg.norm(one["motion_field"][:] - other["motion_field"][:], axis=1)[seen]
            print(f"motion field: median error {np.median(v):.3f} px/s, 95 % {np.percentile(v, 95):.2f} px/s, of "
                  f"{np.mean(np.linalg.norm(other['motion_field'][:], axis=1)):.0f} px/s")
        report = subprocess.run([PROGRAM, "compare", splats, mesh, "--same-scene"], check=True, capture_output=True,
                                text=True)
        print(report.stdout)


if __name__ == "__main__":
    main()
