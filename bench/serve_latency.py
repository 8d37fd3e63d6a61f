"""Measures how long `esim serve --live-pose` takes from a pose to the events that it causes, in another process.

    ESIM_TEST_DATA=DIR python3 bench/serve_latency.py build/release/esim [--seconds 15] [--scenario FILE]

A client moves the camera with 200 poses per second, and notes when each packet of events arrives. The latency of a packet is the time
from when the server read the last pose of its time (that of its last event) to its arrival. Prints a Markdown table. Python's
standard library alone.
"""

import argparse
import json
import math
import pathlib
import signal
import struct
import subprocess
import sys
import threading
import time

FOLDER = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(FOLDER / "tests/cli"))
from websocket_client import WebSocketClient  # noqa: E402


class Listener(threading.Thread):
    """Notes the arrivals of packets, the first odometry, and the differences of this program's clock and the server's."""

    def __init__(self, client):
        super().__init__(daemon=True)
        self.client, self.packets, self.answers, self.pose, self.asked = client, [], [], None, None

    def run(self):
        try:
            while True:
                self.take(self.client.receive())
        except (EOFError, OSError):
            pass

    def take(self, message):
        now = time.perf_counter()
        if isinstance(message, dict):
            for channel in message.get("channels", []):
                if channel["topic"] in ("/cam0/events", "/odom"):
                    wanted = {"id": 1 if channel["topic"] == "/odom" else 0, "channelId": channel["id"]}
                    self.client.send_frame(json.dumps({"op": "subscribe", "subscriptions": [wanted]}).encode(), 1)
            if message["op"] == "parameterValues" and message.get("id") == "time":
                self.answers.append((now - self.asked, 0.5 * (now + self.asked) - message["parameters"][0]["value"]))
        elif message[:1] == b"\x01":
            subscription, t = struct.unpack("<IQ", message[1:13])
            if subscription == 0:
                self.packets.append((now, 1e-9 * t))
            elif self.pose is None:  # position and orientation: the doubles after the header and the two frames' names
                self.pose = struct.unpack("<7d", message[13 + 4 + 32:13 + 4 + 32 + 56])


def measure(program, scenario, seconds, options):
    """The latencies of all packets after the first second, ms."""
    command = [program, "serve", scenario, "--live-pose", "--port", "0", *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        client = WebSocketClient(int(process.stdout.readline().strip().rsplit(":", 1)[1]))
        listener = Listener(client)
        listener.start()
        while listener.pose is None:
            time.sleep(0.05)
        client.send_frame(json.dumps({"op": "advertise", "channels": [{"id": 1, "topic": "/esim/pose", "encoding": "json",
                                                                 "schemaName": "geometry_msgs/msg/PoseStamped"}]}).encode(), 1)
        x, y, z, *q = listener.pose
        began = time.perf_counter()
        for k in range(round(200 * seconds)):
            side = 0.3 * math.sin(math.pi * (time.perf_counter() - began))
            pose = {"position": {"x": x, "y": y + side, "z": z}, "orientation": dict(zip("xyzw", q))}
            client.send_frame(b"\x01" + struct.pack("<I", 1) + json.dumps({"pose": pose}).encode(), 2)
            if k % 7 == 0:
                listener.asked = time.perf_counter()
                client.send_frame(json.dumps({"op": "getParameters", "parameterNames": ["clock_s"], "id": "time"}).encode(), 1)
            time.sleep(max(0, began + (k + 1) / 200 - time.perf_counter()))
        _, ahead_s = min(listener.answers)  # the quickest answer is the most exact
        return sorted(1e3 * (arrival - ahead_s - t) for arrival, t in listener.packets if arrival > began + 1)
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(20)
        process.stdout.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("--scenario", default=str(FOLDER / "tests/scenarios/flying_room.yaml"))
    parser.add_argument("--seconds", type=float, default=15)
    arguments = parser.parse_args()
    print("| pose interval, ms | min_rate_hz | packets | median, ms | 90 % | 99 % | maximum |\n|" + 7 * "---|")
    for interval_s, rate_hz in ((0.005, 50), (0.005, 200), (0.0025, 400)):
        options = ["--pose-interval", str(interval_s), "--set", f"sampling.min_rate_hz={rate_hz}"]
        ms = measure(arguments.program, arguments.scenario, arguments.seconds, options)
        at = [ms[min(len(ms) - 1, int(share * len(ms)))] for share in (0.5, 0.9, 0.99, 1)]
        print(f"| {1e3 * interval_s:g} | {rate_hz} | {len(ms)} | " + " | ".join(f"{value:.1f}" for value in at) + " |", flush=True)


if __name__ == "__main__":
    main()
