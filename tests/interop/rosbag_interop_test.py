"""ROS bags: what esim writes is read by Debian's rosbag and by `rosbags`, what `rosbags` writes is read by esim.

Run as: rosbag_interop_test.py ESIM_PROGRAM
"""

import json
import subprocess
import sys
import unittest

from program import InteropTest, need, random_events

need("numpy", "rosbags")
import numpy as np  # noqa: E402
from rosbags.rosbag1 import Reader, Writer  # noqa: E402
from rosbags.typesys import Stores, get_types_from_msg, get_typestore  # noqa: E402

EVENT = "uint16 x\nuint16 y\ntime ts\nbool polarity\n"
EVENT_ARRAY = "std_msgs/Header header\nuint32 height\nuint32 width\ndvs_msgs/Event[] events\n"

# Debian's tools need Debian's Python. Prints the messages that it reads as JSON.
DEBIAN = r"""
import json, sys
import genpy.dynamic, rosbag
events, topics = [], {}
with rosbag.Bag(sys.argv[1]) as bag:
    for connection in bag._get_connections():
        generated = genpy.dynamic.generate_dynamic(connection.datatype, connection.msg_def)[connection.datatype]
        assert generated._md5sum == connection.md5sum, connection.datatype
    for topic, message, t in bag.read_messages():
        topics[topic] = topics.get(topic, 0) + 1
        if topic == "/cam0/events":
            assert message.header.stamp == t == message.events[-1].ts
            events += [(e.ts.to_nsec(), e.x, e.y, int(e.polarity)) for e in message.events]
print(json.dumps({"events": events, "topics": topics}))
"""

# Plays a bag to a listener, with a separate master. Prints the number of messages on each topic.
PLAY = r"""
import json, os, socket, subprocess, sys, time
with socket.socket() as free:
    free.bind(("127.0.0.1", 0))
    port = free.getsockname()[1]
os.environ.update(ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_IP="127.0.0.1", ROS_HOME=sys.argv[2])
quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
master = subprocess.Popen(["rosmaster", "--core", "-p", str(port)], **quiet)
try:
    import rosbag, rosgraph, rospy
    deadline = time.time() + 20
    while not rosgraph.is_master_online() and time.time() < deadline:
        time.sleep(0.05)
    rospy.init_node("listener", disable_signals=True)
    counts = {}
    def listen(topic):
        def count(message):
            counts[topic] = counts.get(topic, 0) + 1
        return rospy.Subscriber(topic, rospy.AnyMsg, count)
    with rosbag.Bag(sys.argv[1]) as bag:
        wanted = {topic: found.message_count for topic, found in bag.get_type_and_topic_info().topics.items()}
    listeners = [listen(topic) for topic in wanted]
    subprocess.run(["/usr/lib/rosbag/play", "--wait-for-subscribers", "--delay=0.5", sys.argv[1]], check=True, timeout=60, **quiet)
    while counts != wanted and time.time() < deadline + 20:
        time.sleep(0.05)
finally:
    master.terminate()
print(json.dumps({"wanted": wanted, "came": counts}))
"""


def debian_has(*modules):
    imports = "import " + ", ".join(modules)
    return subprocess.run(["/usr/bin/python3", "-c", imports], capture_output=True).returncode == 0


def types():
    store = get_typestore(Stores.ROS1_NOETIC)
    store.register({**get_types_from_msg(EVENT, "dvs_msgs/msg/Event"), **get_types_from_msg(EVENT_ARRAY, "dvs_msgs/msg/EventArray")})
    return store


def read_bag(path):
    """Messages of each topic, decoded by the definitions in the bag."""
    messages = {}
    with Reader(path) as reader:
        store = get_typestore(Stores.EMPTY)
        for connection in reader.connections:
            store.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
        for connection, _, raw in reader.messages():
            messages.setdefault(connection.topic, []).append(store.deserialize_ros1(raw, connection.msgtype))
    return messages


def events_of(messages):
    return [(e.ts.sec * 10**9 + e.ts.nanosec, e.x, e.y, int(e.polarity)) for m in messages for e in m.events]


def write_bag(path, events, compression=None):
    """Messages as the driver of a DAVIS on a robot would record them."""
    store = types()
    made = {name.split("/")[-1]: made for name, made in store.types.items() if not name.startswith("std_msgs/")}
    made["Header"] = store.types["std_msgs/msg/Header"]

    def stamp(t):
        return made["Time"](sec=t // 10**9, nanosec=t % 10**9)

    def header(t):
        return made["Header"](seq=0, stamp=stamp(t), frame_id="dvs")

    vector, no_covariance = made["Vector3"], np.zeros(9)
    writer = Writer(path)
    if compression:
        writer.set_compression(compression)
    with writer:
        def connect(topic, name):
            return writer.add_connection(topic, name, typestore=store)

        def write(connection, t, message):
            writer.write(connection, t, store.serialize_ros1(message, connection.msgtype))

        dvs = connect("/dvs/events", "dvs_msgs/msg/EventArray")
        image, imu = connect("/dvs/image_raw", "sensor_msgs/msg/Image"), connect("/dvs/imu", "sensor_msgs/msg/Imu")
        pose = connect("/optitrack/davis", "geometry_msgs/msg/PoseStamped")
        for begin in range(0, len(events), 1000):
            part = events[begin:begin + 1000]
            t = part[-1][0]
            listed = [made["Event"](x=x, y=y, ts=stamp(s), polarity=bool(p)) for s, x, y, p in part]
            write(dvs, t, made["EventArray"](header=header(t), height=480, width=640, events=listed))
            pixels = np.full(640 * 480, begin // 1000, np.uint8)
            write(image, t, made["Image"](header=header(t), height=480, width=640, encoding="mono8", is_bigendian=0, step=640, data=pixels))
            write(imu, t, made["Imu"](header=header(t), orientation=made["Quaternion"](0.0, 0.0, 0.0, 1.0),
                                      orientation_covariance=no_covariance, angular_velocity=vector(0.1, 0.2, 0.3),
                                      angular_velocity_covariance=no_covariance, linear_acceleration=vector(1.0, 2.0, 9.8),
                                      linear_acceleration_covariance=no_covariance))
            write(pose, t, made["PoseStamped"](header=header(t), pose=made["Pose"](made["Point"](1.0, 2.0, 3.0), made["Quaternion"](0.0, 0.0, 1.0, 0.0))))


class RosbagInterop(InteropTest):
    def test_ours_by_debians_rosbag(self):
        if not debian_has("rosbag"):
            self.skipTest("python3-rosbag is not installed")
        events = random_events()
        bag = self.convert(self.write_events(events), "ours.bag")
        result = subprocess.run(["/usr/bin/python3", "-c", DEBIAN, bag], capture_output=True, text=True)
        self.assertEqual(result.returncode, 0, result.stderr)
        found = json.loads(result.stdout)
        self.assertEqual([tuple(event) for event in found["events"]], events)
        self.assertEqual(found["topics"]["/cam0/camera_info"], 1)

    def test_ours_is_played_by_debians_rosbag(self):
        if not debian_has("rosbag", "rosmaster", "rospy"):
            self.skipTest("python3-rosbag, python3-rosmaster or python3-rospy is not installed")
        bag = self.convert(self.write_events(random_events()), "ours.bag")
        result = subprocess.run(["/usr/bin/python3", "-c", PLAY, bag, self.folder], capture_output=True, text=True)
        self.assertEqual(result.returncode, 0, result.stderr)
        found = json.loads(result.stdout)
        self.assertEqual(found["came"], found["wanted"])
        self.assertIn("/cam0/events", found["came"])

    def test_ours_by_rosbags(self):
        events = random_events()
        messages = read_bag(self.convert(self.write_events(events), "ours.bag"))
        self.assertEqual(events_of(messages["/cam0/events"]), events)

    def test_theirs_by_ours(self):
        events = random_events()
        for compression in (None, Writer.CompressionFormat.BZ2, Writer.CompressionFormat.LZ4):
            with self.subTest(compression=compression):
                name = compression.name if compression else "none"
                write_bag(self.folder / f"{name}.bag", events, compression)
                text = self.convert(self.folder / f"{name}.bag", f"{name}.txt")
                self.assertEqual(self.read_events(text), events)

    def test_theirs_to_ours_keeps_frames_imu_and_poses(self):
        events = random_events()
        write_bag(self.folder / "theirs.bag", events)
        messages = read_bag(self.convert(self.folder / "theirs.bag", "ours.bag"))
        self.assertEqual(events_of(messages["/dvs/events"]), events)
        self.assertEqual(messages["/dvs/events"][0].width, 640)
        self.assertEqual([m.data[0] for m in messages["/dvs/image_raw"]], list(range(20)))
        self.assertEqual([m.linear_acceleration.z for m in messages["/imu"]], [9.8] * 20)
        self.assertEqual([m.transforms[0].transform.rotation.z for m in messages["/tf"]], [1.0] * 20)
        self.assertEqual([m.pose.position.y for m in messages["/dvs/pose"]], [2.0] * 20)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
