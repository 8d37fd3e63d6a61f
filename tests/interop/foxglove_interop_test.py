"""`esim serve` and the WebSocket client `websockets`; `rosbags` reads the messages by the definitions that esim sends.

Run as: foxglove_interop_test.py ESIM_PROGRAM SCENES
"""

import sys
import unittest

from program import need

need("websockets", "rosbags", "numpy")
import numpy as np  # noqa: E402
from rosbags.typesys import Stores, get_typestore  # noqa: E402

from served import SUBPROTOCOLS, Served, Viewer  # noqa: E402

POSE = "geometry_msgs/msg/PoseStamped"


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
