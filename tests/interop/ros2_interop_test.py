"""`esim serve --ros2` and Cyclone DDS's own binding for Python, as nodes of ROS 2 on the same machine. The messages are compared with
those that Foxglove's protocol delivers, which `rosbags` reads.

Run as: ros2_interop_test.py ESIM_PROGRAM SCENES
"""

import os
import random
import sys
import time
import unittest
from dataclasses import dataclass

from program import need

need("cyclonedds", "websockets", "rosbags", "numpy")
os.environ["CYCLONEDDS_URI"] = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces><AllowMulticast>false</AllowMulticast>'
    '</General><Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>')
import numpy as np  # noqa: E402
from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication  # noqa: E402
from cyclonedds.core import Policy, Qos  # noqa: E402
from cyclonedds.domain import DomainParticipant  # noqa: E402
from cyclonedds.idl import IdlStruct  # noqa: E402
from cyclonedds.idl.types import float64, int32, sequence, uint8, uint32, uint64  # noqa: E402
from cyclonedds.pub import DataWriter  # noqa: E402
from cyclonedds.sub import DataReader  # noqa: E402
from cyclonedds.topic import Topic  # noqa: E402
from rosbags.typesys import Stores, get_types_from_msg, get_typestore  # noqa: E402

from served import Served, Viewer  # noqa: E402

DOMAIN = random.Random(os.getpid()).randrange(20, 200)


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Clock(IdlStruct, typename="rosgraph_msgs::msg::dds_::Clock_"):
    clock: Time


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class EventPacket(IdlStruct, typename="event_camera_msgs::msg::dds_::EventPacket_"):
    header: Header
    height: uint32
    width: uint32
    seq: uint64
    time_base: uint64
    encoding: str
    is_bigendian: bool
    events: sequence[uint8]


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    translation: Vector3
    rotation: Quaternion


@dataclass
class TransformStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    transforms: sequence[TransformStamped]


@dataclass
class Pose(IdlStruct, typename="geometry_msgs::msg::dds_::Pose_"):
    position: Vector3
    orientation: Quaternion


@dataclass
class PoseStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PoseStamped_"):
    header: Header
    pose: Pose


def reader(node, topic, kind, **latched):
    policies = [Policy.Reliability.Reliable(0), Policy.History.KeepLast(1000)]
    if latched:
        policies.append(Policy.Durability.TransientLocal)
    return DataReader(node, Topic(node, f"rt{topic}", kind), qos=Qos(*policies))


class Ros2Test(unittest.TestCase):
    def test_messages_are_those_of_the_other_protocol(self):
        with Served("--loop", "--ros2", "--ros-domain", str(DOMAIN)) as served, Viewer(served.address) as viewer:
            viewer.listen(0.5)  # latched messages are sent before the reader exists
            node = DomainParticipant(DOMAIN)
            events, clock = reader(node, "/cam0/events", EventPacket), reader(node, "/clock", Clock)
            still = reader(node, "/tf_static", TFMessage, latched=True)
            publications = BuiltinDataReader(node, BuiltinTopicDcpsPublication)
            packets, clocks, transforms = [], [], []
            for _ in range(15):
                viewer.listen(0.1)
                packets += events.take(1000)
                clocks += clock.take(1000)
                transforms += still.take(10)
            viewer.listen(0.3)
            self.assertGreater(len(packets), 20)
            self.assertGreater(len(clocks), 20)
            by_number = {(packet.header.stamp.nanosec, packet.seq): packet for _, packet in viewer.messages["/cam0/events"]}
            same = [(p, by_number[p.header.stamp.nanosec, p.seq]) for p in packets if (p.header.stamp.nanosec, p.seq) in by_number]
            self.assertGreater(len(same), 15)
            for ours, other in same:
                self.assertEqual((ours.encoding, ours.width, ours.height, ours.header.frame_id, ours.time_base),
                                 (other.encoding, other.width, other.height, other.header.frame_id, other.time_base))
                np.testing.assert_array_equal(np.array(ours.events, np.uint8), other.events)
            self.assertEqual([t.child_frame_id for t in transforms[0].transforms], ["cam0"])  # although it came late

            # The hashes that ROS 2 compares are those of the definitions that the viewer received.
            store = get_typestore(Stores.EMPTY)
            for channel in viewer.channels.values():
                store.register({k: v for k, v in get_types_from_msg(channel["schema"], channel["schemaName"]).items() if k not in store.types})
            schemas = {channel["topic"]: channel["schemaName"] for channel in viewer.channels.values()}
            hashes = {p.topic_name[2:]: p.qos[Policy.Userdata].data for p in publications.take(200)
                      if p.topic_name[2:] in schemas and Policy.Userdata in p.qos}
            self.assertEqual(set(hashes), set(schemas))
            for topic, found in hashes.items():
                self.assertEqual(found.decode(), f"typehash={store.hash_rihs01(schemas[topic])};", topic)

    def test_poses_move_the_camera(self):
        with Served("--live-pose", "--ros2", "--ros-domain", str(DOMAIN + 1), "--set", "duration_s=100") as served, \
                Viewer(served.address) as viewer:
            viewer.listen(5, lambda: len(viewer.messages.get("/odom", [])) > 5)
            start = viewer.messages["/odom"][-1][1].pose.pose
            node = DomainParticipant(DOMAIN + 1)
            writer = DataWriter(node, Topic(node, "rt/esim/pose", PoseStamped), qos=Qos(Policy.Reliability.Reliable(0)))
            q = start.orientation
            wanted = Pose(Vector3(start.position.x, start.position.y + 0.05, start.position.z), Quaternion(q.x, q.y, q.z, q.w))
            end = time.monotonic() + 10
            while time.monotonic() < end and abs(viewer.messages["/odom"][-1][1].pose.pose.position.y - wanted.position.y) > 1e-9:
                writer.write(PoseStamped(Header(Time(0, 0), "map"), wanted))  # until both have found each other
                viewer.listen(0.1)
            self.assertAlmostEqual(viewer.messages["/odom"][-1][1].pose.pose.position.y, wanted.position.y, places=9)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
