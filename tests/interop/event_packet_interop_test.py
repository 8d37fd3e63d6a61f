"""Event packets of ROS: what esim writes is read by `rosbags`, what `rosbags` writes is read by esim.

Run as: event_packet_interop_test.py ESIM_PROGRAM
"""

import sys
import unittest

from program import InteropTest, need, random_events

need("numpy", "rosbags")
import numpy as np  # noqa: E402
from rosbags.highlevel import AnyReader  # noqa: E402
from rosbags.rosbag2 import StoragePlugin, Writer  # noqa: E402
from rosbags.typesys import Stores, get_types_from_msg, get_typestore  # noqa: E402

PACKET = ("std_msgs/Header header\nuint32 height\nuint32 width\nuint64 seq\nuint64 time_base\nstring encoding\n"
          "bool is_bigendian\nuint8[] events\n")
TYPE = "event_camera_msgs/msg/EventPacket"
SENSOR = ("--width", "640", "--height", "480")


def evt3_events(words):
    """Plainly, by the rules of the ROS package event_camera_codecs: (us since the clock wrapped, x, y, p)."""
    high = low = y = base = polarity = 0
    seen = set()
    for word in words:
        kind, value = int(word) >> 12, int(word) & 0xFFF
        if kind == 0x8:
            high = value
            seen.add("high")
        elif kind == 0x6:
            low = value
            if "high" in seen:
                seen.add("low")
        elif "low" not in seen:
            continue
        elif kind == 0x0:
            y = value & 0x7FF
        elif kind == 0x2:
            yield high << 12 | low, value & 0x7FF, y, value >> 11
        elif kind == 0x3:
            base, polarity = value & 0x7FF, value >> 11
        elif kind in (0x4, 0x5):
            length = 12 if kind == 0x4 else 8
            for i in range(length):
                if value >> i & 1:
                    yield high << 12 | low, base + i, y, polarity
            base += length
        else:
            raise ValueError(f"a word {word:04x}")


def in_us(events):
    return [(t // 1000, x, y, p) for t, x, y, p in events]


class EventPackets(InteropTest):
    def packets(self, path):
        with AnyReader([path]) as reader:
            return [reader.deserialize(raw, connection.msgtype) for connection, _, raw in reader.messages()
                    if connection.topic == "/cam0/events"]

    def test_evt3_by_rosbags(self):
        events = random_events()
        for name in ("ours.bag", "ours.mcap"):
            with self.subTest(name):
                kind = "rosbag" if name.endswith("bag") else "mcap"
                path = self.convert(self.write_events(events), name, "--format", kind + "-packets", *SENSOR)
                found = []
                for i, packet in enumerate(self.packets(path)):
                    self.assertEqual((packet.seq, packet.encoding, packet.is_bigendian), (i, "evt3", False))
                    self.assertEqual((packet.width, packet.height), (640, 480))
                    decoded = list(evt3_events(np.frombuffer(bytes(packet.events), "<u2")))
                    stamp = packet.header.stamp.sec * 10**6 + packet.header.stamp.nanosec // 1000
                    shift = stamp - decoded[0][0]
                    found += [(t + shift, x, y, p) for t, x, y, p in decoded]
                self.assertTrue(found == in_us(events), f"{len(found)} events")

    def test_mono_by_rosbags(self):
        events = random_events()
        path = self.convert(self.write_events(events), "ours.mcap", "--format", "mcap-packets", "--time-unit", "ns")
        found = []
        for packet in self.packets(path):
            words = np.frombuffer(bytes(packet.events), "<u8").astype(object)
            found += [(packet.time_base + (w & 0xFFFFFFFF), w >> 32 & 0xFFFF, w >> 48 & 0x7FFF, w >> 63) for w in words]
        self.assertTrue(found == events, f"{len(found)} events")

    def test_theirs_by_ours(self):
        events = random_events()
        store = get_typestore(Stores.ROS2_HUMBLE)
        store.register(get_types_from_msg(PACKET, TYPE))
        packet_type, header, time = (store.types[name] for name in (TYPE, "std_msgs/msg/Header", "builtin_interfaces/msg/Time"))
        bag = self.folder / "theirs"
        with Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            connection = writer.add_connection("/event_camera/events", TYPE, typestore=store)
            for i, begin in enumerate(range(0, len(events), 1000)):
                part = events[begin:begin + 1000]
                base = part[0][0]
                words = np.array([(t - base) | x << 32 | y << 48 | p << 63 for t, x, y, p in part], "<u8")
                stamp = time(sec=base // 10**9, nanosec=base % 10**9)
                message = packet_type(header=header(stamp=stamp, frame_id="cam"), height=480, width=640, seq=i,
                                      time_base=base, encoding="mono", is_bigendian=False,
                                      events=np.frombuffer(words.tobytes(), np.uint8))
                writer.write(connection, base, store.serialize_cdr(message, TYPE))
        self.assertTrue(self.read_events(self.convert(next(bag.glob("*.mcap")), "theirs.txt")) == events)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
