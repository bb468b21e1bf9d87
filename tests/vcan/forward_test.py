"""with-vcan --forward: the dashboard and a bus inside are reached from outside.

    forward_test.py WITH_VCAN LK_EMU
"""

import http.client
import json
import pathlib
import socket
import subprocess
import sys
import unittest

WITH_VCAN, LK_EMU = sys.argv[1:]
WEB = pathlib.Path(__file__).resolve().parents[2] / "web"
PATIENCE_S = 60.0
HTTP, SLCAN = 8474, 29536  # inside, where nobody else has them


def free_ports(count):
    sockets = [socket.socket() for _ in range(count)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


def with_vcan(*words):
    return subprocess.Popen([WITH_VCAN, *words], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True)


class Forward(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.http, cls.slcan, cls.nobody = free_ports(3)
        cls.machine = with_vcan(
            "--forward", f"{cls.http}:{HTTP}", f"--forward={cls.slcan}:{SLCAN}", "--forward", str(cls.nobody),
            LK_EMU, "--bus", "vcan0", "--ids", "1-4", "--bus", f"slcan-tcp:{SLCAN}", "--ids", "5",
            "--rom", ":memory:", "--control", "none", "--http", f"127.0.0.1:{HTTP}")  # fmt: skip
        ready = cls.machine.stdout.readline()
        assert ready == f"lk-emu ready vcan0:1-4 slcan-tcp:{SLCAN}:5\n", ready

    @classmethod
    def tearDownClass(cls):
        cls.machine.terminate()
        cls.machine.communicate(timeout=PATIENCE_S)

    def connect(self, port):
        sock = socket.create_connection(("127.0.0.1", port), PATIENCE_S)
        self.addCleanup(sock.close)
        return sock

    def get(self, path):
        connection = http.client.HTTPConnection("127.0.0.1", self.http, timeout=PATIENCE_S)
        self.addCleanup(connection.close)
        connection.request("GET", path)
        answer = connection.getresponse()
        self.assertEqual(answer.status, 200, path)
        return answer.read()

    def test_the_control_interface_answers(self):
        buses = json.loads(self.get("/api/v1/status"))["buses"]
        self.assertEqual([bus["bus"] for bus in buses], ["vcan0", f"slcan-tcp:{SLCAN}"])

    def test_the_page_comes_whole(self):
        for name in ("app.js", "vendor/uPlot.min.js"):
            self.assertEqual(self.get(f"/{name}"), (WEB / name).read_bytes(), name)

    def test_a_host_outside_talks_to_a_drive_inside(self):
        sock = self.connect(self.slcan)
        lines = sock.makefile("rb")
        sock.sendall(b"O\rt14589A00000000000000\r")
        said = b""
        while not said.endswith(b"\r") or b"t1458" not in said:
            said += lines.read(1)
        self.assertTrue(said.startswith(b"\rz\rt14589A"), said)

    def test_who_does_not_read_holds_up_nobody(self):
        deaf = self.connect(self.http)
        deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        asked = b"GET /vendor/uPlot.min.js HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n" % self.http
        deaf.setblocking(False)
        try:
            while deaf.send(asked * 100):
                pass
        except BlockingIOError:
            pass
        for _ in range(3):
            self.get("/api/v1/status")

    def test_where_nobody_listens_the_connection_ends(self):
        try:
            self.assertEqual(self.connect(self.nobody).recv(1), b"")
        except ConnectionResetError:
            pass

    def test_a_port_that_is_taken_is_told_in_one_line(self):
        done = subprocess.run([WITH_VCAN, "--forward", str(self.http), "true"], stderr=subprocess.PIPE, text=True)
        self.assertEqual((done.returncode, done.stderr),
                         (125, f"with-vcan: --forward {self.http}: cannot listen on 127.0.0.1: Address already in use\n"))

    def test_what_is_no_port_is_told_in_one_line(self):
        for word in ("0", "65536", "80:", ":80", "x", "1:2:3", ""):
            done = subprocess.run([WITH_VCAN, "--forward", word, "true"], stderr=subprocess.PIPE, text=True)
            self.assertEqual(done.returncode, 125, word)
            self.assertEqual(done.stderr, "with-vcan: --forward wants PORT or HOST_PORT:PORT, numbers from 1 to 65535\n")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
