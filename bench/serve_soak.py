"""Lets `esim serve` run for long, and prints its memory every half minute.

    python3 bench/serve_soak.py build/release/esim [--hours 1]

A poster before a trembling camera gives about 1.5 million events per second. One client reads everything, another one subscribes to
everything and reads nothing. Ends with an error if the memory has grown by more than 1 % since the tenth part of the time. Python's standard
library alone.
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile
import threading
import time

from serve_latency import FOLDER, WebSocketClient

SCENARIO = f"""
renderer: {{type: plane, image: {FOLDER}/scenes/poster/poster.jpg, width_m: 1.2, pose: {{position: [1, 0, 0], look_at: [2, 0, 0]}}}}
trajectory: {{type: random, position_amplitude_m: [0.06, 0.05, 0.07], rotation_amplitude_deg: [4, 4, 8], knot_interval_s: 0.3}}
camera: {{width: 240, height: 180, horizontal_fov_deg: 60}}
sampling: {{type: flow, lambda: 0.7}}
event_camera: {{contrast_threshold: 0.25}}
truth: {{rate_hz: 10, pose_rate_hz: 100}}
"""


def subscribe_to_all(client, message):
    for channel in message["channels"]:
        wanted = {"id": channel["id"], "channelId": channel["id"]}
        client.send_frame(json.dumps({"op": "subscribe", "subscriptions": [wanted]}).encode(), 1)


class Reader(threading.Thread):
    """Reads everything; `state` are the parameters that came last."""

    def __init__(self, client):
        super().__init__(daemon=True)
        self.client, self.bytes, self.state = client, 0, {}

    def run(self):
        try:
            while True:
                message = self.client.receive()
                if isinstance(message, bytes):
                    self.bytes += len(message)
                elif message["op"] == "advertise":
                    subscribe_to_all(self.client, message)
                elif message["op"] == "parameterValues":
                    self.state = {one["name"]: one["value"] for one in message["parameters"]}
        except (EOFError, OSError):
            pass


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("--hours", type=float, default=1)
    arguments = parser.parse_args()
    seconds = 3600 * arguments.hours
    with tempfile.TemporaryDirectory(prefix="esim_soak_") as folder:
        scenario = pathlib.Path(folder) / "scenario.yaml"
        scenario.write_text(f"{SCENARIO}duration_s: {seconds + 60}\n")
        process = subprocess.Popen([arguments.program, "serve", scenario, "--port", "0", "--threads", "1"],
                                   stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        try:
            port = int(process.stdout.readline().strip().rsplit(":", 1)[1])
            time.sleep(3)
            reader, idle = Reader(WebSocketClient(port)), WebSocketClient(port)
            reader.start()
            while not isinstance(message := idle.receive(), dict) or message["op"] != "advertise":
                pass
            subscribe_to_all(idle, message)
            began, kib = time.monotonic(), []
            while (passed := time.monotonic() - began) < seconds:
                kib.append(4 * int(pathlib.Path(f"/proc/{process.pid}/statm").read_text().split()[1]))
                reader.client.send_frame(json.dumps({"op": "getParameters", "parameterNames": [], "id": "state"}).encode(), 1)
                print(f"{passed:6.0f} s  {kib[-1]} KiB  read {reader.bytes / 1e9:.2f} GB  {reader.state}", flush=True)
                time.sleep(min(30, seconds / 20))
        finally:
            process.terminate()
            process.wait(20)
    growth = kib[-1] / kib[len(kib) // 10] - 1
    print(f"growth {growth:.2%}")
    sys.exit(growth > 0.01)


if __name__ == "__main__":
    main()
