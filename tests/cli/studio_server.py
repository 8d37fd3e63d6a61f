"""A running `esim studio`, and what a browser may ask of it."""

import http.client
import json
import os
import pathlib
import re
import signal
import socket
import subprocess

from program import ESIM


class Server:
    """A studio on a folder with one small scenario, and a page of one file."""

    def __init__(self, folder, *arguments, **options):
        self.folder = folder
        page = folder / "page"
        page.mkdir(exist_ok=True)
        (page / "index.html").write_text("<!doctype html><title>page</title>")
        self.log = open(folder / "log", "w+")
        self.process = subprocess.Popen([ESIM, "studio", "--page", str(page), "-j", "2", *map(str, arguments)], stdout=subprocess.PIPE,
                                        stderr=self.log, text=True, **options)
        self.url = self.process.stdout.readline().strip()
        found = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/\?token=([0-9a-f]{48}|\S+)", self.url)
        if not found:
            raise AssertionError(f"no address, but {self.url!r}: {open(folder / 'log').read()}")
        self.port, self.token = int(found[1]), found[2]

    def request(self, method, target, body=None, headers=None, token=True):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        given = {"Authorization": f"Bearer {self.token}"} if token else {}
        if body is not None or method != "GET":
            given["Content-Type"] = "application/json"
        given.update(headers or {})
        try:
            connection.request(method, target, None if body is None else json.dumps(body), given)
            response = connection.getresponse()
            return response.status, dict(response.getheaders()), response.read()
        finally:
            connection.close()

    def json(self, method, target, body=None, status=200):
        got, _, content = self.request(method, target, body)
        if got != status:
            raise AssertionError(f"{method} {target}: {got} {content[:500]}")
        return json.loads(content)

    def raw(self, data, wait=5):
        with socket.create_connection(("127.0.0.1", self.port), timeout=wait) as connection:
            connection.sendall(data)
            answer = b""
            try:
                while part := connection.recv(65536):
                    answer += part
            except (TimeoutError, ConnectionResetError):
                pass
            return answer

    def events_of(self, run_id, until):
        """Messages of a run's stream until one of the kind `until`."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        connection.request("GET", f"/api/runs/{run_id}/stream", headers={"Authorization": f"Bearer {self.token}"})
        response = connection.getresponse()
        messages, kind = [], None
        for line in response:
            line = line.decode().rstrip("\n")
            if line.startswith("event: "):
                kind = line[7:]
            elif line.startswith("data: "):
                messages.append((kind, json.loads(line[6:])))
                if kind in until:
                    break
        connection.close()
        return messages

    def cpu_seconds(self):
        fields = pathlib.Path(f"/proc/{self.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def stop(self, number=signal.SIGINT):
        if self.process.poll() is None:
            self.process.send_signal(number)
        status = self.process.wait(timeout=60)
        if self.log.closed:
            return status, ""
        self.process.stdout.close()
        self.log.seek(0)
        text = self.log.read()
        self.log.close()
        return status, text
