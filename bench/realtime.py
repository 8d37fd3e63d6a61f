"""Measures the real-time factor of the shipped scenes at several sizes of the sensor, on two threads.

    python3 bench/realtime.py build/release/esim
    python3 bench/realtime.py build/release/esim --scenes room sprites --sizes 346x260 --duration-s 1 --runs 3

Simulates the beginning of each scene with all outputs and prints Markdown. The real-time factor (simulated seconds per
second, without the time of loading the scene), the fraction of that time in which it renders, and the numbers of rendered
frames and of events come from report.json; of several runs, the fastest is printed. The processor time is that of the whole
program, also of loading and writing, and hardly depends on other programs. Scenes that need Blender or Unreal Engine are left out and named. Python's standard library alone.
"""

import argparse
import json
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile

SCENES = pathlib.Path(__file__).resolve().parent.parent / "scenes"
SIZES = ("346x260", "640x480", "1280x720")
PROGRAMS = {"blender": "Blender", "unrealcv": "Unreal Engine"}  # that types of renderers need


def fail(text):
    sys.exit(f"realtime.py: {text}")


def renderer(scene):
    """The type of a scene's renderer."""
    found = re.search(r"^renderer:\s*(?:\{|\n\s+)type: *(\w+)", scene.read_text(), re.MULTILINE)
    return found[1] if found else fail(f"{scene}: renderer.type must come first in renderer")


def simulate(esim, scene, size, duration_s, threads):
    """report.json, and the processor time of the simulation."""
    with tempfile.TemporaryDirectory(prefix="esim_realtime_") as folder:
        out = pathlib.Path(folder) / "out"
        options = (f"duration_s={duration_s:g}", f"camera.width={size[0]}", f"camera.height={size[1]}")
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        result = subprocess.run([esim, "simulate", scene, "--out", out, "--quiet", "--threads", str(threads),
                                 *(word for option in options for word in ("--set", option))],
                                capture_output=True, text=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if result.returncode != 0:
            fail(f"esim simulate {scene} failed at {size[0]} x {size[1]}:\n{result.stderr or result.stdout}")
        report = json.loads((out / "report.json").read_text())
    return report, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def row(name, size, runs):
    report, _ = max(runs, key=lambda run: run[0]["real_time_factor"])
    camera = report["cameras"][0]
    return (f"| `{name}` | {size[0]} x {size[1]} | {camera['renderer']} | {report['real_time_factor']:.2g} "
            f"| {min(processor for _, processor in runs):.2f} | {report['wall_s_by_stage']['render'] / report['wall_s']:.0%} "
            f"| {camera['frames']} | {camera['events'] / 1e6:.2f} |")


def main():
    shipped = {path.stem: path for path in sorted(SCENES.glob("*.yaml"))}
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("esim", type=pathlib.Path, help="program to measure, such as build/release/esim")
    parser.add_argument("--scenes", nargs="+", choices=shipped, default=list(shipped), metavar="NAME",
                        help=f"default: all, {', '.join(shipped)}")
    parser.add_argument("--sizes", nargs="+", default=SIZES, metavar="WIDTHxHEIGHT", help=f"default: {' '.join(SIZES)}")
    parser.add_argument("--duration-s", type=float, default=0.3, help="simulated time (default: 0.3)")
    parser.add_argument("--runs", type=int, default=1, help="of each simulation (default: 1)")
    parser.add_argument("--threads", type=int, default=2, help="of each simulation (default: 2)")
    options = parser.parse_args()
    if not options.esim.is_file():
        parser.error(f"{options.esim} does not exist; build it by scripts/build release")
    if not options.duration_s > 0 or options.runs < 1 or options.threads < 1:
        parser.error("--duration-s must be above 0; --runs and --threads must be at least 1")
    sizes = [re.fullmatch(r"(\d+)x(\d+)", size) for size in options.sizes]
    if not all(sizes):
        parser.error("--sizes must be of the form 346x260")

    found = re.search(r"^model name\s*: (.*)$", pathlib.Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    print(f"The first {options.duration_s:g} s of each scene; {options.threads} threads of {os.cpu_count()} on "
          f"{found[1] if found else 'an unknown processor'}; fastest of {options.runs}.\n")
    print("| scene | px | renderer | real-time factor | processor time, s | rendering | frames | events, million |\n"
          "|---|---|---|---|---|---|---|---|", flush=True)
    left_out = []
    for name in options.scenes:
        program = PROGRAMS.get(renderer(shipped[name]))
        if program:
            left_out.append(f"`{name}` is left out: it needs {program}.")
            continue
        for match in sizes:
            size = int(match[1]), int(match[2])
            runs = [simulate(options.esim.resolve(), shipped[name], size, options.duration_s, options.threads)
                    for _ in range(options.runs)]
            print(row(name, size, runs), flush=True)
    if left_out:
        print("\n" + "\n".join(left_out))


if __name__ == "__main__":
    main()
