"""Run by packaging/test-wheel: installs the wheel in /wheels and uses it."""

import os
import subprocess
import sys
import time

BIN = "/venv/bin"


def run(*command, **options):
    result = subprocess.run(command, text=True, capture_output=True, **options)
    assert result.returncode == 0, f"{command}: {result.stdout}{result.stderr}"
    return result.stdout


def timed(name, function):
    start = time.monotonic()
    result = function()
    seconds = time.monotonic() - start
    print(f"  {seconds:5.1f} s  {name}", flush=True)
    return result, seconds


def install():
    run(sys.executable, "-m", "venv", "/venv")
    run(f"{BIN}/pip", "install", "--quiet", "--disable-pip-version-check", "--no-index", "--find-links=/wheels", "esim-events")


def simulate():
    poster = next(path for path in run(f"{BIN}/esim", "scenes").split() if path.endswith("poster.yaml"))
    run(f"{BIN}/esim", "simulate", poster, "--out", "/out", "--quiet", "--set", "duration_s=0.2")
    sizes = {name: os.path.getsize(f"/out/cam0/{name}") for name in ("events.h5", "truth.h5", "preview.webp", "preview.png")}
    assert min(sizes.values()) > 1000, sizes
    run(f"{BIN}/esim", "convert", "/out", "/events.txt")
    assert sum(1 for _ in open("/events.txt")) > 1000


def play():
    run(f"{BIN}/esim", "play", "/out", "--size", "300")
    assert open("/out.play.webp", "rb").read(16).endswith(b"WEBPVP8X")


def simulate_in_python():
    return run(f"{BIN}/python", "-c", """
import esim, subprocess
poster = [path for path in subprocess.check_output(["esim", "scenes"], text=True).split() if "poster" in path][0]
print(sum(len(packet.events) for packet in esim.simulate(poster, overrides={"duration_s": 0.1})))
""", env={**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}"})


def render_every_scene():
    for path in run(f"{BIN}/esim", "scenes").split():
        run(f"{BIN}/esim", "simulate", path, "--out", f"/out-{os.path.basename(path)}", "--quiet", "--set", "duration_s=0.02")


def studio():
    run(sys.executable, "/wheels/test_studio.py", f"{BIN}/esim", "studio", "/out")


def import_time():
    """Processor time, so that other programs do not count; the least of five, so that reading the files does not."""
    program = "import time; start = time.process_time(); import esim; print(time.process_time() - start)"
    return min(float(run(f"{BIN}/python", "-c", program)) for _ in range(5))


def refuse(*command, reason):
    result = subprocess.run(command, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    assert result.returncode == 2 and result.stdout.count("\n") == 1 and reason in result.stdout, result


def main():
    start = time.monotonic()
    timed("venv and pip install", install)
    timed("first `esim --version`", lambda: run(f"{BIN}/esim", "--version"))
    timed("first events, by `esim simulate`", simulate)
    first = time.monotonic() - start
    timed("the studio's page over HTTP", studio)
    page = time.monotonic() - start
    events, _ = timed("events in Python", simulate_in_python)
    assert int(events) > 100, events
    timed("every scene", render_every_scene)
    timed("a video of the events", play)
    run(f"{BIN}/python", "-m", "esim", "--version")
    refuse(f"{BIN}/esim", "video", "/clip.mp4", "--out", "/clip", reason="no such file")
    open("/clip.mp4", "w").close()
    refuse(f"{BIN}/esim", "video", "/clip.mp4", "--out", "/clip", reason="without FFmpeg")
    refuse(f"{BIN}/esim", "play", "/out", "--out", "/out.mp4", reason="must end in .webp or .png")
    room = next(path for path in run(f"{BIN}/esim", "scenes").split() if path.endswith("/room.yaml"))
    refuse(f"{BIN}/esim", "simulate", room, "--out", "/gl", "--set", "renderer.engine=gl", "--quiet", reason="libegl1")
    as_another_user = ("setpriv", "--reuid=65534", "--clear-groups")
    refuse(*as_another_user, f"{BIN}/esim", "simulate", room, "--out", f"{os.path.dirname(room)}/out", "--quiet", reason="choose another folder")
    imported = import_time()
    print(f"  {imported:5.2f} s  of processor time to import the package")
    print(f"  {first:5.1f} s  from the file to the first events")
    print(f"  {page:5.1f} s  from the file to the first events and the studio's page")
    assert imported < 0.25, "this must take less than 0.25 s"
    assert page < 60, "this must take less than 60 s"


main()
