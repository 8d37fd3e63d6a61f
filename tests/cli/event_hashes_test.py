"""The events of the shipped and the tests' scenarios are the same bytes as before.

Run as: event_hashes_test.py ESIM_PROGRAM PROJECT_FOLDER TOOLCHAIN
    or: event_hashes_test.py ESIM_PROGRAM PROJECT_FOLDER --compare [SYSTEM]

Simulates the beginning of each scenario, and some variants with other samplings and sensors, and compares SHA-256 sums of
the events with tests/event_hashes.json. `scripts/renew-event-hashes` rewrites that file after a deliberate change, which
needs a reason in CHANGELOG.md. The sums hold for the toolchain that the file names, because compilers and libraries round
differently; elsewhere the test is skipped. With --compare, it compares anyway; `elsewhere` in the file has the sums that are
known to differ on other systems (ID and VERSION_ID of /etc/os-release), whose causes are in docs/install-details.md. SYSTEM is
the one where the program was built (default: this one); debian12 for the wheels.
"""

import hashlib
import json
import os
import pathlib
import platform
import shutil
import subprocess
import sys
import tempfile

ESIM, ROOT, TOOLCHAIN = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3]
RENEW = bool(os.environ.get("ESIM_RENEW_EVENT_HASHES"))
FILE = ROOT / "tests" / "event_hashes.json"
SKIPPED = 77  # to CTest

NOISY = ("event_camera={contrast_threshold: 0.2, threshold_mismatch: 0.03, threshold_noise: 0.01, low_pass_hz: 300, low_pass_order: 2, "
         "refractory_period_us: 100, leak_rate_hz: 5, leak_jitter: 0.1, shot_noise_hz: 5, hot_pixels: 0.001, latency_us: 20, "
         "latency_jitter_us: 5, readout: {rate_mev_per_s: 5}}")
DURATION_S = {"poster": 0.3, "poster_6dof": 0.3, "room": 0.2, "bicycle_parking": 0.05, "panorama": 0.05, "studio_room_baked": 0.05}  # else 0.1
IN_BLENDER = {"studio_room": "scenes/studio_room/studio_room.blend"}  # and the scene that a script makes
# Name: scenario, then what is set.
VARIANTS = {
    "room, adaptive": ("scenes/room.yaml", "duration_s=0.1", "sampling={type: adaptive}"),
    "room, keyframes": ("scenes/room.yaml", "duration_s=0.2", "sampling={type: keyframes}"),
    "ball, adaptive": ("tests/scenarios/ball.yaml", "duration_s=0.1", "sampling={type: adaptive}"),
    "poster, adaptive": ("scenes/poster.yaml", "duration_s=0.3", "sampling={type: adaptive}"),
    "poster, uniform": ("scenes/poster.yaml", "duration_s=0.3", "sampling={type: uniform, rate_hz: 500}"),
    "poster, brightness": ("scenes/poster.yaml", "duration_s=0.3", "sampling={type: brightness, lambda: 0.5}"),
    "poster, dvs128": ("scenes/poster.yaml", "duration_s=0.3", "event_camera={preset: dvs128@1}"),
    "poster, davis346": ("scenes/poster.yaml", "duration_s=0.3", "event_camera={preset: davis346@1}"),
    "poster, noisy": ("scenes/poster.yaml", "duration_s=0.3", NOISY),
    "poster, noisy, adaptive": ("scenes/poster.yaml", "duration_s=0.2", NOISY, "sampling={type: adaptive}"),
    "panorama, keyframes": ("scenes/panorama.yaml", "duration_s=0.05", "sampling={type: keyframes}"),
    "sprites, adaptive": ("scenes/sprites.yaml", "duration_s=0.2", "sampling={type: adaptive}"),
}


def cases():
    for folder in ("scenes", "tests/scenarios"):
        for path in sorted((ROOT / folder).glob("*.yaml")):
            yield path.stem, (f"{folder}/{path.name}", f"duration_s={DURATION_S.get(path.stem, 0.1)}")
    yield from VARIANTS.items()


def run(*arguments):
    result = subprocess.run([ESIM, *map(str, arguments)], capture_output=True, text=True)
    if result.returncode != 0:
        sys.exit(f"esim {' '.join(map(str, arguments))}\n{result.stderr}")


def events_of(folder, scenario, *settings):
    """SHA-256 of the events of all cameras, as NPY files, and their number."""
    options = [part for setting in (*settings, "truth.rate_hz=0") for part in ("--set", setting)]
    run("simulate", ROOT / scenario, "--out", folder / "out", "--force", "--quiet", *options)
    digest = hashlib.sha256()
    count = 0
    for events in sorted((folder / "out").glob("*/events.h5")):
        run("convert", events, folder / "events.npy", "--force", "--quiet")
        digest.update((folder / "events.npy").read_bytes())
        count += json.loads((folder / "out" / "report.json").read_text())["cameras"][0]["events"]
    return {"sha256": digest.hexdigest(), "events": count}


def toolchain():
    with open("/proc/cpuinfo") as file:  # Embree uses the widest vectors of the processor
        vectors = "avx512" if "avx512f" in file.read() else "avx2"
    return f"{TOOLCHAIN}, {' '.join(platform.libc_ver())}, {vectors}"


def system():
    release = dict(line.rstrip().split("=", 1) for line in open("/etc/os-release") if "=" in line)
    return (release.get("ID", "") + release.get("VERSION_ID", "")).replace('"', "")


def main():
    known = json.loads(FILE.read_text()) if FILE.exists() else {"toolchain": "", "events": {}}
    if not RENEW and TOOLCHAIN != "--compare" and known["toolchain"] != toolchain():
        print(f"skipped: the sums are of {known['toolchain']}, and this is {toolchain()}")
        sys.exit(SKIPPED)
    expected = known["events"] | known.get("elsewhere", {}).get(sys.argv[4] if len(sys.argv) > 4 else system(), {})
    found, wrong, skipped = {}, [], []
    with tempfile.TemporaryDirectory(prefix="esim_hashes_") as folder:
        for name, (scenario, *settings) in cases():
            data = os.environ.get("ESIM_TEST_DATA", "")
            if ("ESIM_TEST_DATA" in (ROOT / scenario).read_text() and not pathlib.Path(data).is_dir()) or (
                    name in IN_BLENDER and (shutil.which("blender") is None or not (ROOT / IN_BLENDER[name]).is_file())):
                skipped.append(name)
                if RENEW and name in known["events"]:
                    found[name] = known["events"][name]
                continue
            found[name] = events_of(pathlib.Path(folder), scenario, *settings)
            if not RENEW and found[name] != expected.get(name):
                wrong.append(f"{name}: {found[name]} instead of {expected.get(name)}")
    if skipped:
        print(f"not simulated, because Blender, its scene or the test data are not there: {', '.join(skipped)}")
    if RENEW:
        FILE.write_text(json.dumps({**known, "toolchain": toolchain(), "events": found}, indent=2) + "\n")
        print(f"{FILE}: {len(found)} sums")
    elif wrong:
        sys.exit("\n".join(["events have changed; if this is meant, run scripts/renew-event-hashes and say why in CHANGELOG.md:", *wrong]))


if __name__ == "__main__":
    main()
