"""Compares OpenGL with the engines of the processor on this machine: single frames, and whole simulations.

    python3 bench/compare_engines.py build/release [--runs 3] [--seconds 1] [--duration-s 1] [--software]

Prints Markdown: the device of OpenGL, the processor, and two tables with ratios. Ends with an error where
OpenGL runs in software, unless --software is given. Python's standard library alone; scripts/bench-gpu builds and runs it.
"""

import argparse
import json
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile
import time

SCENES = pathlib.Path(__file__).resolve().parent.parent / "scenes"
FRAME_ENGINES = ("raycast", "raster", "processor", "gl")  # processor: of splats, which have one engine there
ENGINES = ("processor", "gl")  # of simulations; processor: the ray caster or the rasteriser, whichever suits the scene
SCENARIOS = ("room", "studio_room_baked")
SIZES = ((346, 260), (1280, 720))


def run(*command):
    """The standard output of a command. Exits with its errors if it fails."""
    result = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if result.returncode != 0:
        sys.exit(f"compare_engines.py: {command[0]} failed:\n{result.stderr or result.stdout}")
    return result.stdout


def opengl_device(esim, engine):
    """The OpenGL device of `engine`; None if it chooses the processor."""
    found = re.search(r"renderer mesh on OpenGL, (.*), \w+ sampling$",
                      run(esim, "check", SCENES / "room.yaml", "--set", f"renderer.engine={engine}"), re.MULTILINE)
    return found and found[1]


def processor():
    """The name of the processor, if known."""
    try:
        found = re.search(r"^model name\s*: (.*)$", pathlib.Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    except OSError:
        found = None
    return found[1] if found else "unknown processor"


def frame_times(program, seconds, runs):
    """{(scene, size): {engine: ms per frame}}, the median of the runs."""
    output = json.loads(run(program, "--benchmark_format=json", f"--benchmark_min_time={seconds}",
                            f"--benchmark_repetitions={runs}"))
    times = {}
    for entry in output["benchmarks"]:
        if entry.get("error_occurred"):
            sys.exit(f"compare_engines.py: {entry['name']}: {entry['error_message']}")
        if entry["run_type"] == "iteration":  # not a mean of several runs
            scene, size, engine = entry["run_name"].split("/")[:3]
            times.setdefault((scene, size), {}).setdefault(engine, []).append(entry["real_time"])
    return {view: {engine: statistics.median(ms) for engine, ms in engines.items()} for view, engines in times.items()}


def frame_table(times):
    """Frames per second, and how much faster OpenGL is than the faster engine of the processor."""
    lines = ["| scene | px | ray caster | rasteriser | splats | OpenGL | OpenGL, ns/px | OpenGL is faster by |",
             "|---|---|---|---|---|---|---|---|"]
    for (scene, size), ms in times.items():
        width, height = map(int, size.split("x"))
        cells = " | ".join(f"{1e3 / ms[engine]:.1f}" if engine in ms else "" for engine in FRAME_ENGINES)
        fastest = min(time for engine, time in ms.items() if engine != "gl")
        lines.append(f"| {scene} | {width} x {height} | {cells} | {1e6 * ms['gl'] / (width * height):.2f} "
                     f"| {fastest / ms['gl']:.2f} |")
    return "\n".join(lines)


def simulate(esim, scenario, size, engine, duration_s):
    """Wall-clock seconds of the whole program, those that its report counts for rendering, and the number of events."""
    with tempfile.TemporaryDirectory(prefix="esim_engines_") as folder:
        out = pathlib.Path(folder) / "out"
        began = time.perf_counter()
        run(esim, "simulate", SCENES / f"{scenario}.yaml", "--out", out, "--quiet", "--threads", 0,
            *(word for option in (f"renderer.engine={engine}", f"camera.width={size[0]}", f"camera.height={size[1]}",
                                  f"duration_s={duration_s:g}") for word in ("--set", option)))
        wall = time.perf_counter() - began
        report = json.loads((out / "report.json").read_text())
    return wall, report["wall_s_by_stage"]["render"], report["cameras"][0]["events"]


def simulation_table(esim, duration_s, runs):
    lines = ["| scenario | px | processor, s | of it rendering | OpenGL, s | of it rendering | OpenGL is faster by "
             "| events, OpenGL / processor |",
             "|---|---|---|---|---|---|---|---|"]
    for scenario in SCENARIOS:
        for size in SIZES:
            results = {engine: [] for engine in ENGINES}
            for _ in range(runs):  # alternately, so that other load affects both
                for engine in ENGINES:
                    results[engine].append(simulate(esim, scenario, size, engine, duration_s))
            median = {engine: [statistics.median(column) for column in zip(*results[engine])] for engine in ENGINES}
            cells = [f"{median[engine][0]:.2f} | {median[engine][1]:.2f}" for engine in ENGINES]
            faster = median["processor"][0] / median["gl"][0]
            events = median["gl"][2] / max(median["processor"][2], 1)
            lines.append(f"| {scenario} | {size[0]} x {size[1]} | {cells[0]} | {cells[1]} | {faster:.2f} | {events:.3f} |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build", type=pathlib.Path, help="folder of a build with ESIM_BENCHMARKS=ON")
    parser.add_argument("--runs", type=int, default=3, help="number of runs of each measurement; medians are printed (default: 3)")
    parser.add_argument("--seconds", type=float, default=1.0, help="duration of each run of single frames (default: 1)")
    parser.add_argument("--duration-s", type=float, default=1.0, help="simulated time of each simulation (default: 1)")
    parser.add_argument("--software", action="store_true", help="measure OpenGL in software if there is no graphics card")
    options = parser.parse_args()
    if options.runs < 1 or not options.seconds > 0 or not options.duration_s > 0:
        parser.error("--runs must be at least 1; --seconds and --duration-s must be above 0")

    esim, frames = options.build.resolve() / "esim", options.build.resolve() / "bench" / "bench_engines"
    for program in (esim, frames):
        if not program.is_file():
            parser.error(f"{program} does not exist; build with ESIM_BENCHMARKS=ON, as scripts/bench-gpu does")
    device, card = opengl_device(esim, "gl"), opengl_device(esim, "auto")
    if card is None and not options.software:
        sys.exit(f"compare_engines.py: no graphics card found, OpenGL runs in software ({device}); install the card's driver, or "
                 "give --software to measure that")
    print(f"OpenGL: {card or f'{device}, in software: not a graphics card'}")
    print(f"Processor: {os.cpu_count()} threads, {processor()}\n")
    print(f"One frame with irradiance, depth and motion field, 16 samples per pixel; frames per second, medians, runs: {options.runs}\n")
    print(frame_table(frame_times(frames, options.seconds, options.runs)), flush=True)
    print(f"\n`esim simulate` with all outputs, {options.duration_s:g} s of the scenario; engines in turns; medians, "
          f"runs: {options.runs}\n")
    print(simulation_table(esim, options.duration_s, options.runs))


if __name__ == "__main__":
    main()
