"""`renderer: {type: unrealcv}` as its users meet it: a server that is not there, that serves, and that dies on the way.

Run as: unrealcv_test.py ESIM_PROGRAM, with the standard library of Python alone.
"""

import array
import json
import math
import re
import socket
import struct
import sys
import threading
import unittest

from program import ProgramTest, run

SCENARIO = """
renderer: {type: unrealcv, port: PORT, timeout_s: 0.5}
trajectory: {type: random, rotation_amplitude_deg: [0, 5, 0]}
duration_s: 0.2
camera: {width: 32, height: 24}
sampling: {type: uniform, rate_hz: 500}
event_camera: {contrast_threshold: 0.1}
output: {preview: false}
"""


def npy(values, height, width):
    header = f"{{'descr': '<f4', 'fortran_order': False, 'shape': ({height}, {width}), }}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode() + array.array("f", values).tobytes()


class Server(threading.Thread):
    """Shows a wave that turns with the camera's yaw, 2 m away; hangs up for good after `images` of them."""

    def __init__(self, images):
        super().__init__(daemon=True)
        self.images = images
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.width, self.height, self.yaw = 8, 8, 0.0

    def run(self):
        connection, _ = self.listener.accept()
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.listener.close()
        self.send(connection, b"connected to a test")
        stream = connection.makefile("rb")
        while header := stream.read(8):
            number, command = stream.read(struct.unpack("<II", header)[1]).decode().split(":", 1)
            if self.images == 0:
                break
            self.send(connection, number.encode() + b":" + self.answer(command))
        stream.close()
        connection.close()

    @staticmethod
    def send(connection, payload):
        connection.sendall(struct.pack("<II", 0x9E2B83C1, len(payload)) + payload)

    def answer(self, command):
        if size := re.match(r"vrun r.setres (\d+)x(\d+)", command):
            self.width, self.height = int(size[1]), int(size[2])
        if command.startswith("vset /camera/0/pose"):
            self.yaw = math.radians(float(command.split()[-2]))
        if command.endswith("lit npy"):
            self.images -= 1
            focal = self.width / 2 / math.tan(math.radians(37.5))
            row = [0.5 + 0.4 * math.sin(20 * (self.yaw + math.atan2(x - (self.width - 1) / 2, focal))) for x in range(self.width)]
            return npy(row * self.height, self.height, self.width)
        if command.endswith("plane_depth npy"):
            return npy([2.0] * (self.width * self.height), self.height, self.width)
        return b"error no such command" if command.endswith(("/fov", "/size")) else b"ok"


class Unrealcv(ProgramTest):
    def simulate(self, port):
        scenario = self.folder / "scenario.yaml"
        scenario.write_text(SCENARIO.replace("PORT", str(port)))
        return run("simulate", scenario, "--out", self.out)

    def test_a_server_that_is_not_there(self):
        server = Server(0)
        server.listener.close()
        self.assert_refused(self.simulate(server.port), f"127.0.0.1:{server.port}", "cannot connect: ")

    def test_a_server_that_serves(self):
        server = Server(1000)
        server.start()
        result = self.simulate(server.port)
        self.assertEqual(result.returncode, 0, result.stderr)
        report = json.loads((self.out / "report.json").read_text())
        self.assertEqual(report["status"], "complete")
        self.assertGreater(report["cameras"][0]["events"], 200)
        self.assertEqual(report["cameras"][0]["renderer"], f"unrealcv on 127.0.0.1:{server.port}")

    def test_what_was_simulated_before_a_server_died_is_kept(self):
        server = Server(60)
        server.start()
        result = self.simulate(server.port)
        self.assertEqual(result.returncode, 2, result.stderr)
        lines = [line for line in result.stderr.splitlines() if line.startswith("esim: ")]
        self.assertEqual(len(lines), 1)
        for part in (f"127.0.0.1:{server.port}", "the connection was lost", "could not be restored within 0.5 s",
                     "marked incomplete"):
            self.assertIn(part, lines[0])
        report = json.loads((self.out / "report.json").read_text())
        self.assertEqual(report["status"], "interrupted")
        self.assertIn("the connection was lost", report["reason"])
        info = run("info", self.out)
        self.assertEqual(info.returncode, 0, info.stderr)
        self.assertIn("interrupted", info.stdout)
        self.assertRegex(info.stdout, r"the connection was lost")
        self.assertGreater(report["cameras"][0]["events"], 50)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
