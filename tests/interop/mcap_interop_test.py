"""Files of ROS 2: what esim writes is read by `mcap` and `rosbags`, what these write is read by esim.

Run as: mcap_interop_test.py ESIM_PROGRAM
"""

import shutil
import subprocess
import sys
import unittest

from program import InteropTest, need, random_events

need("mcap", "mcap_ros2", "rosbags")
from mcap.reader import make_reader  # noqa: E402
from mcap.stream_reader import StreamReader  # noqa: E402
from mcap.writer import CompressionType  # noqa: E402
from mcap_ros2.decoder import DecoderFactory  # noqa: E402
from mcap_ros2.writer import Writer as Ros2Writer  # noqa: E402
from rosbags.highlevel import AnyReader  # noqa: E402
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin  # noqa: E402
from rosbags.rosbag2 import Writer as BagWriter  # noqa: E402
from rosbags.typesys import Stores, get_types_from_msg, get_typestore  # noqa: E402

EVENT_ARRAY = f"""std_msgs/Header header
uint32 height
uint32 width
Event[] events
{"=" * 80}
MSG: dvs_msgs/Event
uint16 x
uint16 y
builtin_interfaces/Time ts
bool polarity
{"=" * 80}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
"""

# Reads through the index and from start to end, and checks the checksums. npm: @mcap/core, @mcap/nodejs, @mcap/support.
CORE = """
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { FileHandleReadable } from "@mcap/nodejs";
import { loadDecompressHandlers } from "@mcap/support";
import fs from "fs/promises";
const path = process.argv[1];
const decompressHandlers = await loadDecompressHandlers();
const readable = new FileHandleReadable(await fs.open(path));
const indexed = await McapIndexedReader.Initialize({ readable, decompressHandlers });
let count = 0n;
for await (const message of indexed.readMessages()) ++count;
const stream = new McapStreamReader({ decompressHandlers, validateCrcs: true });
stream.append(await fs.readFile(path));
let streamed = 0n;
for (let record; (record = stream.nextRecord()); ) if (record.type === "Message") ++streamed;
const told = indexed.statistics.messageCount;
console.log(stream.done() && count === told && streamed === told ? "equal" : `${count} ${streamed} ${told}`);
process.exit(0);
"""


def time(t):
    return {"sec": t // 10**9, "nanosec": t % 10**9}


def write_mcap(path, events, compression):
    with open(path, "wb") as file:
        writer = Ros2Writer(file, compression=compression)
        schema = writer.register_msgdef("dvs_msgs/msg/EventArray", EVENT_ARRAY)
        for begin in range(0, len(events), 1000):
            part = events[begin:begin + 1000]
            t = part[-1][0]
            message = {"header": {"stamp": time(t), "frame_id": "dvs"}, "height": 480, "width": 640,
                       "events": [{"x": x, "y": y, "ts": time(s), "polarity": bool(p)} for s, x, y, p in part]}
            writer.write_message("/dvs/events", schema, message, log_time=t, publish_time=t)
        writer.finish()


def write_bag(path, events, plugin, mode, version):
    types = get_typestore(Stores.ROS2_HUMBLE)
    types.register(get_types_from_msg("uint16 x\nuint16 y\nbuiltin_interfaces/Time ts\nbool polarity\n", "dvs_msgs/msg/Event"))
    types.register(get_types_from_msg("std_msgs/Header header\nuint32 height\nuint32 width\ndvs_msgs/Event[] events\n",
                                      "dvs_msgs/msg/EventArray"))
    array, event = types.types["dvs_msgs/msg/EventArray"], types.types["dvs_msgs/msg/Event"]
    header, stamp = types.types["std_msgs/msg/Header"], types.types["builtin_interfaces/msg/Time"]
    writer = BagWriter(path, version=version, storage_plugin=plugin)
    if mode is not CompressionMode.NONE:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection("/dvs/events", array.__msgtype__, typestore=types)
        for begin in range(0, len(events), 1000):
            part = events[begin:begin + 1000]
            message = array(header(stamp(*divmod(part[-1][0], 10**9)), "dvs"), 480, 640,
                            [event(x, y, stamp(*divmod(s, 10**9)), bool(p)) for s, x, y, p in part])
            writer.write(connection, part[-1][0], types.serialize_cdr(message, array.__msgtype__))


class McapInterop(InteropTest):
    def test_ours_by_mcap(self):
        events = random_events()
        path = self.convert(self.write_events(events), "ours.mcap")
        with open(path, "rb") as file:
            reader = make_reader(file, decoder_factories=[DecoderFactory()], validate_crcs=True)
            statistics = reader.get_summary().statistics
            found = []
            for _, channel, record, message in reader.iter_decoded_messages():
                if channel.topic == "/cam0/events":
                    found += [(e.ts.sec * 10**9 + e.ts.nanosec, e.x, e.y, int(e.polarity)) for e in message.events]
                    self.assertEqual(record.log_time, found[-1][0])
                if channel.topic == "/cam0/camera_info":
                    self.assertEqual(message.distortion_model, "plumb_bob")
                if channel.topic == "/tf_static":
                    self.assertEqual(message.transforms[0].child_frame_id, "cam0")
            self.assertEqual(found, events)
            self.assertEqual((statistics.message_start_time, statistics.message_end_time), (events[0][0], events[-1][0]))
        with open(path, "rb") as file:
            self.assertEqual(type(list(StreamReader(file, validate_crcs=True).records)[-1]).__name__, "Footer")

    def test_ours_by_rosbags(self):
        events = random_events()
        for name, options in (("ours.mcap", ()), ("bag", ("--format", "rosbag2"))):
            found = []
            with self.subTest(name=name), AnyReader([self.convert(self.write_events(events), name, *options)]) as reader:
                for connection, time_of_recording, raw in reader.messages():
                    message = reader.deserialize(raw, connection.msgtype)
                    if connection.topic == "/cam0/events":
                        found += [(e.ts.sec * 10**9 + e.ts.nanosec, e.x, e.y, int(e.polarity)) for e in message.events]
                        self.assertEqual(time_of_recording, found[-1][0])
                self.assertEqual(found, events)
                durability = {c.topic: [qos.durability.name for qos in c.ext.offered_qos_profiles] for c in reader.connections}
                if options:
                    self.assertEqual(durability["/tf_static"], ["TRANSIENT_LOCAL"])

    def test_bags_of_rosbags(self):
        events = random_events(5000)
        for version in (8, 9):
            for plugin in (StoragePlugin.SQLITE3, StoragePlugin.MCAP):
                for mode in (CompressionMode.NONE, CompressionMode.MESSAGE):
                    name = f"{version}_{plugin.name}_{mode.name}"
                    with self.subTest(name=name):
                        write_bag(self.folder / name, events, plugin, mode, version)
                        self.assertEqual(self.read_events(self.convert(self.folder / name, f"{name}.txt")), events)

    def test_ours_by_core(self):
        if shutil.which("node") is None:
            self.skipTest("no node")
        path = self.convert(self.write_events(random_events()), "ours.mcap")
        result = subprocess.run(["node", "--input-type=module", "-e", CORE, path], capture_output=True, text=True)
        if "ERR_MODULE_NOT_FOUND" in result.stderr:
            self.skipTest("@mcap/core, @mcap/nodejs and @mcap/support are not in a node_modules folder above")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(result.stdout.strip(), "equal")

    def test_theirs_by_ours(self):
        events = random_events()
        for compression in (CompressionType.NONE, CompressionType.LZ4, CompressionType.ZSTD):
            with self.subTest(compression=compression):
                write_mcap(self.folder / "theirs.mcap", events, compression)
                self.assertEqual(self.read_events(self.convert(self.folder / "theirs.mcap", f"{compression.name}.txt")), events)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
