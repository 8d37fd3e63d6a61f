"""`esim serve`: control, slow and broken clients, and its end. tests/interop/foxglove_interop_test.py checks the messages.

Run as: serve_test.py ESIM_PROGRAM SCENES
"""

import json
import os
import signal
import socket
import struct
import subprocess
import sys
import time
import unittest

from program import ESIM, ProgramTest, run
from websocket_client import WebSocketClient

SCENE = os.path.join(os.path.abspath(sys.argv[2]), "poster.yaml")
SMALL = ("--set", "camera.width=60", "--set", "camera.height=40")


class Client(WebSocketClient):
    """A client that knows Foxglove's protocol."""

    def send(self, op, **fields):
        self.send_frame(json.dumps({"op": op, **fields}).encode(), 1)

    def until(self, op):
        """The next message of this kind."""
        while True:
            message = self.receive()
            if isinstance(message, dict) and message["op"] == op:
                return message

    def parameters(self, **values):
        """Sets these, if any, and returns all."""
        if values:
            self.send("setParameters", parameters=[{"name": k, "value": v} for k, v in values.items()], id="x")
        else:
            self.send("getParameters", parameterNames=[], id="x")
        return {p["name"]: p["value"] for p in self.until("parameterValues")["parameters"]}

    def subscribe_to_all(self):
        for k, channel in enumerate(self.until("advertise")["channels"]):
            self.send("subscribe", subscriptions=[{"id": k, "channelId": channel["id"]}])


class ServeTest(ProgramTest):
    def serve(self, *options):
        self.process = subprocess.Popen([ESIM, "serve", SCENE, "--port", "0", *SMALL, *options], stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.end)
        self.addCleanup(self.process.stdout.close)
        return int(self.process.stdout.readline().strip().rsplit(":", 1)[1])

    def end(self, sent=signal.SIGINT):
        """Ends the program; returns its exit status and what it printed on stderr."""
        if self.process.poll() is None:
            self.process.send_signal(sent)
        _, errors = self.process.communicate(timeout=20)
        return self.process.returncode, errors

    def test_pause_step_speed_and_restart(self):
        client = Client(self.serve("--paused", "--set", "duration_s=50"))
        time.sleep(0.3)
        paused = client.parameters()
        self.assertTrue(paused["paused"])
        self.assertLess(paused["time_s"], 0.05)
        client.parameters(step_s=0.2)
        time.sleep(0.6)
        stepped = client.parameters()
        self.assertTrue(stepped["paused"])
        self.assertGreaterEqual(stepped["time_s"], 0.19)
        self.assertLess(stepped["time_s"], 0.26)
        client.parameters(paused=False, speed=0.5)
        before, began = client.parameters()["time_s"], time.monotonic()
        time.sleep(1)
        after, passed = client.parameters()["time_s"], time.monotonic() - began
        self.assertLess(after - before, 0.5 * passed + 0.15)
        self.assertGreater(after - before, 0.1)  # less on a busy machine
        client.parameters(restart=True)
        time.sleep(0.3)
        self.assertLess(client.parameters()["time_s"], 0.25)

    def test_as_fast_as_possible_until_the_end(self):
        client = Client(self.serve("--speed", "0", "--set", "duration_s=0.5"))
        client.subscribe_to_all()
        with self.assertRaises((EOFError, ConnectionResetError)):
            while True:
                client.receive()
        self.assertEqual(self.end()[0], 0)

    def test_signals_end_it(self):
        for sent in (signal.SIGINT, signal.SIGTERM):
            for options in ((), ("--paused",), ("--live-pose",)):
                client = Client(self.serve(*options))
                client.until("serverInfo")
                began = time.monotonic()
                self.assertEqual(self.end(sent)[0], 0)
                self.assertLess(time.monotonic() - began, 10)

    def test_slow_clients_lose_messages_and_delay_nobody(self):
        port = self.serve("--loop", "--set", "camera.width=346", "--set", "camera.height=260", "--set", "truth.rate_hz=60")
        time.sleep(2)  # until all topics are there
        slow, quick = Client(port, receive_bytes=4096), Client(port)
        slow.subscribe_to_all()  # and reads nothing any more
        quick.subscribe_to_all()
        deadline = time.monotonic() + 40
        while quick.parameters()["dropped_messages"] == 0 and time.monotonic() < deadline:
            pass
        values = quick.parameters()
        self.assertGreater(values["dropped_messages"], 0)
        self.assertGreater(values["real_time_factor"], 0)
        size_kib = int(open(f"/proc/{self.process.pid}/statm").read().split()[1]) * 4
        self.assertLess(size_kib, 600_000)

    def test_broken_clients(self):
        port = self.serve("--set", "duration_s=100")
        self.assertIn(b"426", Client(port, protocol="other").head)
        client = Client(port)
        client.until("advertise")
        for text in (b"{", b"[]", b"{}", b'{"op": 3}', b'{"op": "fly"}', b"\xff\xfe",
                     b'{"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 4000000000}, 7, {"id": -1}]}',
                     b'{"op": "setParameters", "parameters": [{"name": "speed", "value": -1}, {"name": "speed"}, {"name": "time_s", "value": 1}]}',
                     b'{"op": "advertise", "channels": [{}, 3, {"id": 1}]}'):
            if text == b"\xff\xfe":  # not UTF-8: the connection may end
                continue
            client.send_frame(text, 1)
            self.assertEqual(client.until("status")["level"], 2)
        for data in (b"", b"\x01", b"\x09abcdefgh", b"\x01\x07\0\0\0abc"):
            client.send_frame(data, 2)
            client.until("status")
        client.socket.close()
        gone = Client(port)
        gone.socket.sendall(b"\x81\xff" + struct.pack(">Q", 1 << 60) + bytes(4))  # an endless message
        raw = socket.create_connection(("127.0.0.1", port))
        raw.sendall(b"\0" * 10000)
        self.assertIn("paused", Client(port).parameters())

    def test_live_poses_in_json(self):
        client = Client(self.serve("--live-pose", "--max-jump", "0.5", "--set", "duration_s=100"))
        client.send("advertise", channels=[{"id": 3, "topic": "/esim/twist", "encoding": "json", "schemaName": "geometry_msgs/msg/Twist"},
                                           {"id": 4, "topic": "/esim/pose", "encoding": "json", "schemaName": "geometry_msgs/msg/Pose"}])

        def publish(channel, message):
            client.send_frame(b"\x01" + struct.pack("<I", channel) + json.dumps(message).encode(), 2)

        client.until("advertise")  # it has begun
        zero = {"x": 0, "y": 0, "z": 0}
        far = {"position": {"x": 9, "y": 0, "z": 0}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}
        publish(3, {"linear": {"x": 0.1, "y": 0, "z": 0}, "angular": zero})
        for bad in (far, {"pose": 3}, [], {"position": zero, "orientation": {"x": 0, "y": 0, "z": 0, "w": 0}}):
            publish(4, bad)
        publish(3, {"linear": {"x": "fast"}, "angular": zero})
        publish(3, {"twist": {"linear": zero, "angular": zero}})
        values = client.parameters()
        self.assertEqual((values["poses"], values["refused_poses"]), (2, 5))

    def test_refused_options(self):
        taken = socket.socket()
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        self.assert_refused(run("serve", SCENE, "--port", taken.getsockname()[1]), "in use by another program")
        self.assert_refused(run("serve", SCENE, "--port", 0, "--speed", -1), "speed: must be")
        self.assert_refused(run("serve", SCENE, "--port", 0, "--live-pose", "--pose-interval", 0), "pose interval: must be")
        self.assert_refused(run("serve", SCENE, "--port", 0, "--host", "nowhere.invalid"), "host nowhere.invalid")
        self.assert_refused(run("serve", SCENE, "--port", 0, "--set", "camera.widht=3"), "width")
        taken.close()


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
