"""Shows a simulation in rerun (rerun.io) while it runs: events, depth, the camera and its path.

    pip install rerun-sdk                                        # a large package
    python3 examples/rerun_viewer.py scenes/room.yaml            # opens the viewer
    python3 examples/rerun_viewer.py scenes/room.yaml --save out/room.rrd --seconds 1
"""

import argparse
import pathlib
import sys

import numpy as np
import rerun as rr

import esim

ON, OFF = (0, 92, 230), (220, 40, 40)


def picture(events, shape):
    """The last event of each pixel, on white."""
    image = np.full((*shape, 3), 255, np.uint8)
    for polarity, colour in ((1, ON), (0, OFF)):
        some = events[(events["p"] > 0) == polarity]
        image[some["y"], some["x"]] = colour
    return image


def show(packet, camera, path):
    """Logs a packet; `path` holds the positions of the camera so far."""
    rr.set_time("simulated", duration=1e-9 * packet.t1)
    rr.log("events/rate", rr.Scalars(len(packet.events) / (1e-9 * (packet.t1 - packet.t0))))
    rr.log("world/camera/events", rr.Image(picture(packet.events, (camera["height"], camera["width"]))))
    if len(packet.depth):
        rr.log("world/camera/depth", rr.DepthImage(packet.depth[-1], meter=1.0))
        path.append(packet.pose[-1][:3, 3])
        rr.log("world/camera", rr.Transform3D(translation=path[-1], mat3x3=packet.pose[-1][:3, :3]))
        rr.log("world/path", rr.LineStrips3D([path]))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenario", help="scenario file (YAML)")
    parser.add_argument("--seconds", type=float, help="of the scenario to simulate")
    parser.add_argument("--save", metavar="FILE.rrd", help="write a file for the viewer instead of opening it")
    parser.add_argument("--force", action="store_true", help="replace the file")
    arguments = parser.parse_args()
    if arguments.save and pathlib.Path(arguments.save).exists() and not arguments.force:
        sys.exit(f"rerun_viewer.py: {arguments.save} exists; choose another file, or give --force")
    scenario = esim.Scenario.load(arguments.scenario)
    if arguments.seconds:
        scenario.set("duration_s", arguments.seconds)
    rr.init("esim", spawn=not arguments.save)
    if arguments.save:
        rr.save(arguments.save)
    simulation, path = esim.simulate(scenario), []
    (camera,) = simulation.cameras.values()
    rr.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    rr.log("world/camera", rr.Pinhole(image_from_camera=camera["K"], width=camera["width"], height=camera["height"]), static=True)
    for packet in simulation:
        show(packet, camera, path)


if __name__ == "__main__":
    main()
