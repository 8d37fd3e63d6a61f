"""Compares what esim.Sensor makes of frames of 100 Hz with esim's own keyframes and with linear interpolation.

    ESIM_TEST_DATA=DIR PYTHONPATH=build/release/python python3 bench/given_frames.py [--seconds 0.3] [--rate 100]

Renders frames of scenes with depth, poses and the visible object, computes motion vectors from them as other simulators
give them, and prints a Markdown table: the events of each method, matched with those of frames at --truth-rate. All
sensors are ideal, C = 0.2. Needs NumPy; `esim` must be on the path, or named by ESIM_PROGRAM.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

import esim

FOLDER = pathlib.Path(__file__).resolve().parent.parent
SCENES = ("scenes/room.yaml", "tests/scenarios/ball.yaml", "tests/scenarios/furnished_room.yaml")
WIDTH, HEIGHT = 346, 260
LENS = {"width": WIDTH, "height": HEIGHT, "horizontal_fov_deg": 75}
SENSOR = {"contrast_threshold": 0.2}
PROGRAM = os.environ.get("ESIM_PROGRAM", "esim")


def simulation(scene, seconds, **options):
    """A scenario with the ideal sensor."""
    scenario = esim.Scenario.load(FOLDER / scene)
    for key, value in {"duration_s": seconds, "event_camera": SENSOR, **options}.items():
        scenario.set(key, value)
    return scenario


def events_of(scenario):
    """All events of a simulation."""
    return np.concatenate([packet.events for packet in esim.simulate(scenario)])


def camera_of(scale, margin):
    """The options of a camera with `scale` pixels per pixel of the sensor, and `margin` of these around it."""
    f = scale * WIDTH / 2 / np.tan(np.radians(LENS["horizontal_fov_deg"] / 2))
    width, height = scale * (WIDTH + 2 * margin), scale * (HEIGHT + 2 * margin)
    return {"width": width, "height": height, "fx": f, "cx": (width - 1) / 2, "cy": (height - 1) / 2}


def seen_by_sensor(irradiance, scale, margin):
    """What the sensor sees of a frame: means over its pixels."""
    means = irradiance.reshape(HEIGHT + 2 * margin, scale, WIDTH + 2 * margin, scale).mean((1, 3))
    return np.ascontiguousarray(means[margin : margin + HEIGHT, margin : margin + WIDTH], np.float32)


def frames_of(scene, seconds, camera, rate_hz):
    """Times, E, depth, poses, objects and the objects' poses of frames."""
    scenario = simulation(
        scene,
        seconds,
        camera=camera,
        sampling={"type": "uniform", "rate_hz": rate_hz},
        truth={"rate_hz": rate_hz, "objects": True, "pose_rate_hz": rate_hz},
    )
    for packet in esim.simulate(scenario):
        for i, t in enumerate(packet.truth_t):
            at = np.flatnonzero(packet.body["t"] == t)
            objects = packet.objects[at[0]] if len(at) else np.zeros((0, 4, 4))
            label = packet.object[i] if len(packet.object) else np.zeros(packet.depth[i].shape, np.uint16)
            yield t, packet.irradiance[i], packet.depth[i], packet.pose[i], label, objects


def motion_vectors(camera, earlier, later):
    """The way of the point in each pixel of the later frame since the earlier one, px, shape (2, height, width)."""
    _, _, _, pose0, _, objects0 = earlier
    _, _, depth, pose1, label, objects1 = later
    v, u = np.mgrid[: camera["height"], : camera["width"]].astype(float)
    z = np.where(np.isfinite(depth), depth, 1e6)
    points = np.stack([(u - camera["cx"]) / camera["fx"] * z, (v - camera["cy"]) / camera["fx"] * z, z, np.ones_like(z)], -1)
    motion = np.full((2, *depth.shape), np.nan, np.float32)
    for number in np.unique(label):
        moved = np.eye(4) if number == 0 else objects0[number - 1] @ np.linalg.inv(objects1[number - 1])
        before = points[label == number] @ (np.linalg.inv(pose0) @ moved @ pose1).T
        motion[0, label == number] = u[label == number] - (camera["fx"] * before[:, 0] / before[:, 2] + camera["cx"])
        motion[1, label == number] = v[label == number] - (camera["fx"] * before[:, 1] / before[:, 2] + camera["cy"])
    return motion.astype(np.float16).astype(np.float32)  # as engines store them


def compare(truth, other):
    """The fractions of missing and additional events, and the median and the 95th percentile of the time errors, ms: see
    `esim compare --same-scene`."""
    with tempfile.TemporaryDirectory(prefix="esim_given_frames_") as folder:
        paths = [pathlib.Path(folder) / f"{name}.npz" for name in ("truth", "other")]
        for path, events in zip(paths, (truth, other)):
            esim.save_events(path, events, WIDTH, HEIGHT)
        found = subprocess.run([PROGRAM, "compare", *paths, "--same-scene", "--json"], capture_output=True, text=True, check=False)
    if found.returncode != 0:
        sys.exit(f"given_frames.py: {PROGRAM} compare failed: {found.stderr}")
    found = json.loads(found.stdout)["same_scene"]
    return (found["missing"] / len(truth), found["only_in_b"] / len(truth), 1e3 * found["median_time_error_s"],
            1e3 * found["p95_time_error_s"])


def methods_of(scene, args, scale):
    """The true events of frames with scale^2 pixels per pixel of the sensor, and those of each method."""
    margin = 0 if scale == 1 else 8
    camera = camera_of(scale, margin)
    linear, true = (esim.EventCamera(WIDTH, HEIGHT, **SENSOR) for _ in range(2))
    truth = [true.process(seen_by_sensor(frame[1], scale, margin), esim.ns(int(frame[0])))
             for frame in frames_of(scene, args.seconds, camera, args.truth_rate)]
    sensors = {name: esim.Sensor(LENS, supersampling=scale, margin_px=margin, lambda_px=args.lambda_px, **SENSOR)
               for name in ("object poses", "motion vectors", "motion vectors, ids")}
    made = {name: [] for name in ("linear", *sensors)}
    earlier = None
    for frame in frames_of(scene, args.seconds, camera, args.rate):
        t, irradiance, depth, pose, label, objects = frame
        t = esim.ns(int(t))
        motion = motion_vectors(camera, earlier or frame, frame)
        poses = dict(enumerate(objects, 1))
        made["linear"].append(linear.process(seen_by_sensor(irradiance, scale, margin), t))
        for name, more in (("object poses", {"objects": label, "object_poses": poses}), ("motion vectors", {"motion": motion}),
                           ("motion vectors, ids", {"motion": motion, "objects": label})):
            made[name].append(sensors[name].step(t, irradiance, depth, pose, **more))
        earlier = frame
    for name, sensor in sensors.items():
        print(f"{scene}, {scale} x {scale}, {name}: {sensor.statistics}", file=sys.stderr)
    return np.concatenate(truth), {name: np.concatenate(events) for name, events in made.items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=0.3)
    parser.add_argument("--rate", type=float, default=100, help="frames per second")
    parser.add_argument("--truth-rate", type=float, default=2000, help="frames per second of the truth")
    parser.add_argument("--supersampling", type=int, nargs="*", default=[1, 2, 4, 8])
    parser.add_argument("--lambda-px", type=float, help="largest motion between two images that a sensor makes (default: that of esim.Sensor)")
    parser.add_argument("scenes", nargs="*", default=SCENES)
    args = parser.parse_args()
    print("| scene | pixels | method | events | missing | additional | time error, median, ms | 95 %, ms |\n|" + 8 * "---|")
    for scene in args.scenes:
        for scale in args.supersampling:
            truth, methods = methods_of(scene, args, scale)
            if 1 < scale <= 4:  # keyframes have at most 4 x 4 pixels
                options = {"type": "keyframes", "supersampling": scale, "min_rate_hz": args.rate, "max_rate_hz": 2 * args.rate}
                methods["keyframes"] = events_of(simulation(scene, args.seconds, sampling=options))
            for name, events in methods.items():
                own = events_of(simulation(scene, args.seconds, sampling={"type": "flow", "lambda": 0.05})) if name == "keyframes" else truth
                missing, additional, median, late = compare(own, events)
                print(f"| `{scene}` | {scale} x {scale} | {name} | {len(events)} | {missing:.2%} | {additional:.2%} | {median:.3f} | {late:.2f} |", flush=True)


if __name__ == "__main__":
    main()
