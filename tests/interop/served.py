"""A running `esim serve`, and a viewer that subscribes to all of it. For interoperation tests whose second argument is the
folder of the scenes."""

import json
import os
import signal
import struct
import subprocess
import sys
import time

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from websockets.sync.client import connect

from program import ESIM

SCENES = os.path.abspath(sys.argv[2])
SUBPROTOCOLS = ("foxglove.websocket.v1", "foxglove.sdk.v1")


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
