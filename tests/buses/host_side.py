"""Tests what hosts see of a full send queue, and of an adapter that is unplugged.

usage: host_side.py LK_EMU
"""

import os
import socket
import time
import unittest

import support
from support import PATIENCE_S, emulator, free_port

ROBOT = """
[[bus]]
interface = "{bus}"
tx_queue = "socketcan"

[[bus.drive]]
id = 1

[[bus.event]]
at_s = 0
id = 1
power = "off"

[[bus.event]]
at_s = 5
id = 1
power = "on"

[[bus.event]]
at_s = 8
fault = {{ kind = "adapter_gone", for_s = 1, renamed = "{renamed}" }}
"""


class HostSide(support.TestCase):
    def start(self, bus: str, renamed: str = "no"):
        robot = self.path("robot.toml")
        with open(robot, "w", encoding="utf-8") as file:
            file.write(ROBOT.format(bus=bus, renamed=renamed))
        running = emulator("--config", robot, "--clock", "stepped", control=self.path("control"))
        self.addCleanup(running.__exit__, None, None, None)
        return running.__enter__()

    def read(self, sock: socket.socket, ends: int, end: bytes) -> bytes:
        got = b""
        while got.count(end) < ends:
            more = sock.recv(4096)
            self.assertTrue(more, got)
            got += more
        return got

    def test_slcan_refuses_frames_beyond_the_queue(self):
        port = free_port()
        running = self.start(f"slcan-tcp:{port}")
        running.advance("3s")  # the drive is dead
        with socket.create_connection(("127.0.0.1", port), PATIENCE_S) as host:
            host.sendall(b"O\r")
            self.read(host, 1, b"\r")
            for n in range(16):
                host.sendall(b"t14189C00000000000000\r")
                self.assertEqual(host.recv(64), b"z\r" if n < 13 else b"\a", n)
            running.advance("3s")
            self.assertEqual(self.read(host, 13, b"\r").count(b"t14189C"), 13)
        running.stop()
        self.assertIn("no drive acknowledges", running.errors)

    def test_socketcand_reports_frames_beyond_the_queue(self):
        port = free_port()
        running = self.start(f"socketcand:{port}")
        running.advance("3s")
        with socket.create_connection(("127.0.0.1", port), PATIENCE_S) as host:
            self.read(host, 1, b">")
            for text in (b"< open can0 >", b"< rawmode >"):
                host.sendall(text)
                self.read(host, 1, b">")
            host.sendall(b"< send 141 8 9C 0 0 0 0 0 0 0 >" * 14)
            self.assertEqual(self.read(host, 1, b">"), b"< error could not send frame >")

    def test_tcp_host_loses_its_adapter(self):
        port = free_port()
        running = self.start(f"slcan-tcp:{port}")
        with socket.create_connection(("127.0.0.1", port), PATIENCE_S) as host:
            host.sendall(b"O\r")
            self.read(host, 1, b"\r")
            running.advance("8.5s")
            self.assertEqual(host.recv(64), b"")
        with self.assertRaises(ConnectionRefusedError):
            socket.create_connection(("127.0.0.1", port), PATIENCE_S)
        running.advance("1s")
        with socket.create_connection(("127.0.0.1", port), PATIENCE_S) as host:
            host.sendall(b"O\rt14189C00000000000000\r")
            self.read(host, 2, b"\r")

    def test_port_waits_until_its_place_is_free(self):
        port = free_port()
        running = self.start(f"slcan-tcp:{port}")
        running.advance("8.5s")
        with socket.create_server(("127.0.0.1", port)):
            running.advance("1s")
        deadline = time.monotonic() + PATIENCE_S
        while True:
            try:
                host = socket.create_connection(("127.0.0.1", port), PATIENCE_S)
                break
            except ConnectionRefusedError:
                self.assertLess(time.monotonic(), deadline, "it opens its port again")
                time.sleep(0.05)
        with host:
            host.sendall(b"O\rt14189C00000000000000\r")
            self.read(host, 2, b"\r")
        running.stop()
        self.assertIn("cannot listen there", running.errors)

    def test_pseudo_terminal_hangs_up(self):
        place = self.path("can")
        running = self.start(f"slcan-pty:{place}")
        host = os.open(place, os.O_RDWR | os.O_NOCTTY)
        self.addCleanup(os.close, host)
        running.advance("8.5s")
        self.assertFalse(os.path.lexists(place))
        with self.assertRaises(OSError):
            os.write(host, b"O\r")
        running.advance("1s")
        os.close(os.open(place, os.O_RDWR | os.O_NOCTTY))

    def test_pseudo_terminal_returns_under_the_next_number(self):
        running = self.start(f"slcan-pty:{self.path('ttyACM9')}", "yes")
        running.advance("9.5s")
        self.assertFalse(os.path.lexists(self.path("ttyACM9")))
        os.close(os.open(self.path("ttyACM10"), os.O_RDWR | os.O_NOCTTY))


if __name__ == "__main__":
    unittest.main()
