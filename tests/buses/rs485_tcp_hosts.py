"""Tests Debian's pyserial as a host of lk-emu on RS-485 over TCP (socket://).

usage: rs485_tcp_hosts.py LK_EMU
"""

import socket
import time
import unittest

import serial

from pyserial_hosts import ask, packet
from support import PATIENCE_S, TestCase, count, emulator, free_port


class Rs485Tcp(TestCase):
    def setUp(self):
        super().setUp()
        self.tcp_port = free_port()
        self.arguments = ("--bus", f"rs485-tcp:{self.tcp_port}", "--ids", "1")

    def open(self) -> serial.SerialBase:
        port = serial.serial_for_url(f"socket://127.0.0.1:{self.tcp_port}", timeout=PATIENCE_S)
        self.addCleanup(port.close)
        return port

    def test_hosts_connect_in_turn(self):
        with emulator(*self.arguments, "--baud", "1000000") as running:
            for _ in range(3):
                port = self.open()
                self.assertEqual(ask(port, 0x9C, 1)[:4], bytes([0x3E, 0x9C, 1, 7]))
                # Gains of 255: the first byte of a telnet command.
                gains = bytes([255] * 6)
                self.assertEqual(ask(port, 0x31, 1, gains), packet(0x31, 1, gains))
                self.assertEqual(ask(port, 0x30, 1), packet(0x30, 1, gains))
                port.close()
            self.assertIn("9 queries, 9 replies", running.stop())

    def test_second_host_is_refused(self):
        with emulator(*self.arguments, "--baud", "1000000") as running:
            line = self.open()
            line.write(packet(0x9C, 1))
            answer = line.read(13)
            self.assertEqual((len(answer), answer[:4]), (13, bytes([0x3E, 0x9C, 1, 7])))
            with socket.create_connection(("127.0.0.1", self.tcp_port), PATIENCE_S) as second:
                self.assertEqual(second.makefile("rb").readline(),
                                 b"lk-emu: this line has its one host already\n")
            line.write(packet(0x9C, 1))
            self.assertEqual(len(line.read(13)), 13)
            self.assertEqual(count(running.stop(), "clients refused: no room"), 1)

    def test_every_port_uses_keep_alive_probes(self):
        http = free_port()
        with emulator(*self.arguments, "--http", f"127.0.0.1:{http}"):
            for port in (self.tcp_port, http):
                with socket.create_connection(("127.0.0.1", port), PATIENCE_S):
                    patience = time.monotonic() + PATIENCE_S
                    while (seconds := keep_alive_s(port)) is None:
                        self.assertLess(time.monotonic(), patience, port)
                        time.sleep(0.01)
                    self.assertLessEqual(seconds, 30)

    def test_half_closed_host_gets_its_reply_and_frees_the_line(self):
        with emulator(*self.arguments, "--baud", "9600") as running:  # the reply takes 14 ms
            for _ in range(3):
                with socket.create_connection(("127.0.0.1", self.tcp_port), PATIENCE_S) as host:
                    host.sendall(packet(0x9C, 1))
                    host.shutdown(socket.SHUT_WR)
                    answer = b""
                    while len(answer) < 13:
                        more = host.recv(13)
                        self.assertTrue(more, "it ends before the reply")
                        answer += more
                    self.assertEqual(answer[:4], bytes([0x3E, 0x9C, 1, 7]))
            self.assertEqual(count(running.stop(), "clients refused: no room"), 0)

    def test_half_closed_host_gets_end_of_file(self):
        with emulator(*self.arguments):
            with socket.create_connection(("127.0.0.1", self.tcp_port), PATIENCE_S) as host:
                host.sendall(packet(0x9C, 1))
                host.shutdown(socket.SHUT_WR)
                self.assertEqual(len(host.makefile("rb").read()), 13)


def keep_alive_s(port: int):
    """Returns when the server's keep-alive probes its peer; None if no such timer runs (proc(5), net/tcp)."""
    with open("/proc/net/tcp", encoding="ascii") as table:
        for line in table:
            fields = line.split()
            if fields[1].endswith(f":{port:04X}") and fields[3] == "01" and fields[5].startswith("02:"):
                return int(fields[5][3:], 16) / 100
    return None


if __name__ == "__main__":
    unittest.main(warnings="ignore")  # pyserial leaves closing its sockets to Python
