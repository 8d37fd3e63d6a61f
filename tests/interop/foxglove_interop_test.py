"""`esim serve` and the WebSocket client `websockets`; `rosbags` reads the messages by the definitions that esim sends.

Run as: foxglove_interop_test.py ESIM_PROGRAM SCENES
"""

import json
import os
import signal
import struct
import subprocess
import sys
import time
import unittest

from program import ESIM, need

need("websockets", "rosbags", "numpy")
import numpy as np  # noqa: E402
from rosbags.typesys import Stores, get_types_from_msg, get_typestore  # noqa: E402
from websockets.sync.client import connect  # noqa: E402

SCENES = os.path.abspath(sys.argv[2])
SUBPROTOCOLS = ("foxglove.websocket.v1", "foxglove.sdk.v1")
POSE = "geometry_msgs/msg/PoseStamped"


class Served:
    """A running `esim serve`, for use with `with`."""

    def __init__(self, *options):
        self.options = options

    def __enter__(self):
        command = [ESIM, "serve", f"{SCENES}/poster.yaml", "--port", "0", "--set", "camera.width=60", "--set", "camera.height=40"]
        self.process = subprocess.Popen([*command, *self.options], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.address = self.process.stdout.readline().strip()
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGINT)
        self.process.wait(20)
        self.process.stdout.close()


class Viewer:
    """A client that subscribes to every topic."""

    def __init__(self, address, protocol=SUBPROTOCOLS[0]):
        self.connection = connect(address, subprotocols=[protocol], max_size=None, close_timeout=0.2)
        self.channels, self.messages, self.store = {}, {}, get_typestore(Stores.EMPTY)

    def __enter__(self):
        self.socket = self.connection.__enter__()
        return self

    def __exit__(self, *_):
        self.connection.__exit__(None, None, None)

    def send(self, op, **fields):
        self.socket.send(json.dumps({"op": op, **fields}))

    def publish(self, channel, payload):
        self.socket.send(b"\x01" + struct.pack("<I", channel) + payload)

    def listen(self, seconds, until=lambda: False):
        """Collects messages by topic, decoded by the definitions of their channels."""
        end = time.monotonic() + seconds
        while time.monotonic() < end and not until():
            try:
                message = self.socket.recv(timeout=max(0.01, end - time.monotonic()))
            except TimeoutError:
                return
            if isinstance(message, str):
                message = json.loads(message)
                self.messages.setdefault(message["op"], []).append(message)
                for channel in message.get("channels", []):
                    self.channels[channel["id"]] = channel
                    self.store.register({k: v for k, v in get_types_from_msg(channel["schema"], channel["schemaName"]).items()
                                         if k not in self.store.types})
                    self.send("subscribe", subscriptions=[{"id": channel["id"], "channelId": channel["id"]}])
            elif message[0] == 1:
                subscription, t = struct.unpack("<IQ", message[1:13])
                channel = self.channels[subscription]
                decoded = self.store.deserialize_cdr(message[13:], channel["schemaName"])
                self.messages.setdefault(channel["topic"], []).append((t, decoded))
            else:
                self.messages.setdefault("time", []).append(struct.unpack("<Q", message[1:9])[0])


class FoxgloveTest(unittest.TestCase):
    def test_all_topics_are_read_by_their_definitions(self):
        for protocol in SUBPROTOCOLS:
            with Served("--loop") as served, Viewer(served.address, protocol) as viewer:
                self.assertEqual(viewer.socket.subprotocol, protocol)
                viewer.listen(1.5)
                messages = viewer.messages
                self.assertIn("parameters", messages["serverInfo"][0]["capabilities"])
                for topic in ("/cam0/events", "/cam0/image_raw", "/cam0/event_image", "/cam0/camera_info", "/tf", "/tf_static", "/odom",
                              "/clock", "/cam0/depthmap"):
                    self.assertIn(topic, messages)
                for t, clock in messages["/clock"]:
                    self.assertEqual(clock.clock.sec * 10**9 + clock.clock.nanosec, t)
                _, packet = messages["/cam0/events"][0]
                self.assertEqual((packet.encoding, packet.width, packet.height), ("evt3", 60, 40))
                numbers = [packet.seq for _, packet in messages["/cam0/events"]]
                self.assertEqual(numbers, list(range(numbers[0], numbers[0] + len(numbers))))
                _, picture = messages["/cam0/event_image"][-1]
                self.assertEqual((picture.encoding, picture.step, picture.data.size), ("rgb8", 180, 60 * 40 * 3))
                _, odometry = messages["/odom"][-1]
                q = odometry.pose.pose.orientation
                self.assertAlmostEqual(q.x**2 + q.y**2 + q.z**2 + q.w**2, 1)

    def test_poses_in_cdr_move_the_camera(self):
        ros = get_typestore(Stores.ROS2_HUMBLE)
        types = ros.types
        with Served("--live-pose", "--set", "sampling.min_rate_hz=200", "--set", "duration_s=100") as served, \
                Viewer(served.address) as viewer:
            viewer.send("advertise", channels=[{"id": 5, "topic": "/esim/pose", "encoding": "cdr", "schemaName": POSE}])
            viewer.listen(5, lambda: len(viewer.messages.get("/odom", [])) > 5)
            start = viewer.messages["/odom"][-1][1].pose.pose

            def pose(y):
                stamp = types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
                point = types["geometry_msgs/msg/Point"](x=start.position.x, y=start.position.y + y, z=start.position.z)
                q = types["geometry_msgs/msg/Quaternion"](x=start.orientation.x, y=start.orientation.y, z=start.orientation.z, w=start.orientation.w)
                whole = types["geometry_msgs/msg/Pose"](position=point, orientation=q)
                return bytes(ros.serialize_cdr(types[POSE](header=types["std_msgs/msg/Header"](stamp=stamp, frame_id="map"), pose=whole), POSE))

            events = len(viewer.messages.get("/cam0/events", []))
            for k in range(30):
                viewer.publish(5, pose(0.002 * k))
                viewer.listen(0.01)
            viewer.listen(0.5)
            moved = viewer.messages["/odom"][-1][1].pose.pose.position.y - start.position.y
            self.assertAlmostEqual(moved, 0.058, places=6)
            self.assertGreater(len(viewer.messages["/cam0/events"]), events + 5)
            for bad in (pose(50), pose(np.nan), pose(0)[:20], b""):
                viewer.publish(5, bad)
            viewer.messages["parameterValues"] = []
            viewer.send("getParameters", parameterNames=["poses", "refused_poses"], id="count")
            viewer.listen(5, lambda: viewer.messages["parameterValues"])
            answer = viewer.messages["parameterValues"][-1]
            self.assertEqual(answer["id"], "count")
            self.assertEqual({p["name"]: p["value"] for p in answer["parameters"]}, {"poses": 30, "refused_poses": 4})


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
