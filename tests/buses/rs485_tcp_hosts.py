"""pyserial, Debian's, as a host of lk-emu on RS-485 over TCP: socket:// and rfc2217://.

usage: rs485_tcp_hosts.py LK_EMU
"""

import socket
import unittest

import serial

from pyserial_hosts import ask, packet
from support import PATIENCE_S, TestCase, count, emulator, free_port


class Rs485Tcp(TestCase):
    """One port for both: bytes as they are, and telnet with the serial port's settings (RFC 2217)."""

    def setUp(self):
        super().setUp()
        self.tcp_port = free_port()
        self.arguments = ("--bus", f"rs485-tcp:{self.tcp_port}", "--ids", "1")

    def open(self, scheme: str, baud: int = 1_000_000, **more) -> serial.SerialBase:
        port = serial.serial_for_url(f"{scheme}://127.0.0.1:{self.tcp_port}", baud, timeout=PATIENCE_S, **more)
        self.addCleanup(port.close)
        return port

    def test_the_same_conversation_in_either_way(self):
        with emulator(*self.arguments, "--baud", "1000000") as running:
            for scheme in ("socket", "rfc2217", "socket"):
                port = self.open(scheme)
                self.assertEqual(ask(port, 0x9C, 1)[:4], bytes([0x3E, 0x9C, 1, 7]))
                # Gains of 255: every byte of them is doubled on its way there and back, in telnet alone.
                gains = bytes([255] * 6)
                self.assertEqual(ask(port, 0x31, 1, gains), packet(0x31, 1, gains))
                self.assertEqual(ask(port, 0x30, 1), packet(0x30, 1, gains))
                port.close()
            self.assertIn("9 queries, 9 replies", running.stop())

    def test_a_wrong_rate_is_silence_until_it_is_right(self):
        with emulator(*self.arguments, "--baud", "1000000") as running:
            port = self.open("rfc2217", 115_200)
            port.write(packet(0x9C, 1))
            port.baudrate = 1_000_000  # answered behind it: nothing has come of the packet
            self.assertEqual(port.in_waiting, 0)
            self.assertEqual(len(ask(port, 0x9C, 1)), 13)
            summary = running.stop()
            self.assertIn("is at 115200 bit/s and the drives are at 1000000", running.errors)
            self.assertIn("1 queries, 1 replies", summary)
            self.assertEqual(count(summary, "RS-485: bytes that start no packet"), 5)

    def test_without_a_rate_that_of_the_host_is_of_no_account(self):
        with emulator(*self.arguments, "--baud", "0"):
            for baud in (9600, 4_000_000):
                port = self.open("rfc2217", baud)
                self.assertEqual(len(ask(port, 0x9C, 1)), 13)
                port.close()

    def test_lines_and_buffers_are_there_for_hosts_that_use_them(self):
        with emulator(*self.arguments, "--baud", "1000000"):
            port = self.open("rfc2217")
            port.rts, port.dtr, port.break_condition = False, True, True
            port.break_condition = False
            self.assertFalse(port.cts or port.dsr or port.ri or port.cd)
            port.reset_input_buffer()
            port.reset_output_buffer()
            self.assertEqual(len(ask(port, 0x9C, 1)), 13)

    def test_a_host_that_wants_parity_is_told_that_there_is_none(self):
        with emulator(*self.arguments, "--baud", "1000000"):
            with self.assertRaisesRegex(ValueError, "remote rejected value for option 'parity'"):
                self.open("rfc2217", parity=serial.PARITY_EVEN)
            self.assertEqual(len(ask(self.open("rfc2217"), 0x9C, 1)), 13)

    def test_what_is_no_telnet_is_counted_and_ends_nothing(self):
        with emulator(*self.arguments, "--baud", "1000000") as running:
            begin = b"\xff\xfb\x2c"
            with socket.create_connection(("127.0.0.1", self.tcp_port), PATIENCE_S) as client:
                client.sendall(begin + b"\xff\xf0" * 1000 + b"\xff\xfa" + b"A" * 1_000_000 + b"\xff\xf0")
                client.sendall(packet(0x9C, 1))
                said = b""
                while packet(0x9C, 1, bytes(7))[:4] not in said:
                    said += client.recv(4096)
            self.assertEqual(count(running.stop(), "lines or datagrams that made no sense"), 1000)

    def test_one_host_and_no_second(self):
        with emulator(*self.arguments, "--baud", "1000000") as running:
            line = self.open("socket")
            line.write(packet(0x9C, 1))
            answer = line.read(13)
            self.assertEqual((len(answer), answer[:4]), (13, bytes([0x3E, 0x9C, 1, 7])))
            with socket.create_connection(("127.0.0.1", self.tcp_port), PATIENCE_S) as second:
                self.assertEqual(second.makefile("rb").readline(),
                                 b"lk-emu: this line has its one host already\n")
            line.write(packet(0x9C, 1))
            self.assertEqual(len(line.read(13)), 13)
            self.assertEqual(count(running.stop(), "clients refused: no room"), 1)


if __name__ == "__main__":
    unittest.main(warnings="ignore")  # pyserial leaves its sockets to be closed by Python
