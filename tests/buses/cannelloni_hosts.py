"""The other end of cannelloni. Neither python-can nor Debian has one: this is written after its documents.

usage: cannelloni_hosts.py LK_EMU
"""

import socket
import struct
import unittest

import can

import support
from can_messages import message, text
from support import PATIENCE_S, count, emulator, free_udp_port


class CannelloniPeer(can.BusABC):
    """As an interface of python-can's."""

    HEADER = struct.Struct("!BBBH")  # version, op code, number, frames
    FRAME = struct.Struct("!IB")  # identifier as in linux/can.h, length
    EXTENDED, REMOTE = 0x80000000, 0x40000000

    def __init__(self, own: int, other: int):
        super().__init__("cannelloni")
        self.other = ("127.0.0.1", other)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", own))
        self.number = 0
        self.numbers = []  # of what came
        self.unread = []

    def packet(self, *frames: can.Message) -> bytes:
        packed = self.HEADER.pack(2, 0, self.number % 256, len(frames))
        self.number += 1
        for one in frames:
            flags = (self.EXTENDED if one.is_extended_id else 0) | (self.REMOTE if one.is_remote_frame else 0)
            packed += self.FRAME.pack(one.arbitration_id | flags, one.dlc) + bytes(one.data)
        return packed

    def say(self, datagram: bytes) -> None:
        self.socket.sendto(datagram, self.other)

    def send(self, msg, timeout=None):
        self.say(self.packet(msg))

    def _recv_internal(self, timeout):
        if not self.unread:
            self.socket.settimeout(timeout)
            datagram = self.socket.recv(1500)
            version, code, number, frames = self.HEADER.unpack_from(datagram)
            assert (version, code) == (2, 0), datagram
            self.numbers.append(number)
            at = self.HEADER.size
            for _ in range(frames):
                known, length = self.FRAME.unpack_from(datagram, at)
                at += self.FRAME.size
                self.unread.append(can.Message(arbitration_id=known & 0x1FFFFFFF, data=datagram[at:at + length],
                                               is_extended_id=known & self.EXTENDED != 0))
                at += length
            assert at == len(datagram), datagram
        return self.unread.pop(0), False

    def shutdown(self):
        self.socket.close()


class Cannelloni:
    def __init__(self, case: support.TestCase):
        self.port, self.own = free_udp_port(), free_udp_port()
        self.name = f"cannelloni:127.0.0.1:{self.port}?local={self.own}"
        self.same = f"cannelloni:localhost:{self.port}?local={free_udp_port()}"

    def open(self) -> CannelloniPeer:
        return CannelloniPeer(self.port, self.own)


class CannelloniAlone(support.TestCase):
    def setUp(self):
        super().setUp()
        self.place = Cannelloni(self)

    def open(self) -> CannelloniPeer:
        peer = self.place.open()
        self.addCleanup(peer.shutdown)
        return peer

    def test_frames_of_one_packet_are_on_the_bus_in_its_order(self):
        with emulator("--bus", self.place.name, "--ids", "1") as running:
            peer = self.open()
            peer.say(peer.packet(*(message(1, command) for command in (0x9C, 0x88, 0x9A))))
            self.assertEqual([text(peer.recv(PATIENCE_S))[:6] for _ in range(3)], ["141#9C", "141#88", "141#9A"])
            self.assertEqual(peer.numbers, list(range(len(peer.numbers))))
            self.assertIn("3 queries, 3 replies", running.stop())
            self.assertNotIn("command these drives", running.errors)

    def test_packets_that_make_no_sense_are_counted_and_none_of_their_frames_is_heard(self):
        query = message(1, 0x9A)
        with emulator("--bus", self.place.name, "--ids", "1") as running:
            peer = self.open()
            whole = peer.packet(query, query)
            for wrong in (b"", b"\x02", whole[:-1], whole[:12], b"\x01" + whole[1:], b"\x02\x01" + whole[2:],
                          whole[:3] + b"\xff\xff" + whole[5:], whole[:9] + b"\x09" + whole[10:], bytes(1600)):
                peer.say(wrong)
            peer.say(peer.packet(query) + b"behind it")
            self.assertRegex(text(peer.recv(PATIENCE_S)), "^141#9A")
            summary = running.stop()
            self.assertEqual(count(summary, "lines or datagrams that made no sense"), 9)
            self.assertIn("1 queries, 1 replies", summary)

    def test_only_the_other_end_is_heard(self):
        with emulator("--bus", self.place.name, "--ids", "1") as running:
            peer = self.open()
            stranger = CannelloniPeer(0, self.place.own)
            self.addCleanup(stranger.shutdown)
            for _ in range(3):
                stranger.send(message(1, 0x88))
            peer.send(message(1, 0x9A))
            self.assertRegex(text(peer.recv(PATIENCE_S)), "^141#9A")
            summary = running.stop()
            self.assertEqual(count(summary, "datagrams of others, dropped"), 3)
            self.assertIn("1 queries, 1 replies", summary)
            self.assertEqual(running.errors.count("is not the other end: its frames are dropped"), 1)

    def test_what_was_lost_on_the_way_is_told(self):
        with emulator("--bus", self.place.name, "--ids", "1") as running:
            peer = self.open()
            for number in (254, 255, 0, 3, 2, 9):  # after 0, 1 and 2 are missing, and later 4 to 8
                peer.number = number
                peer.send(message(1, 0x9A))
                self.assertRegex(text(peer.recv(PATIENCE_S)), "^141#9A")
            self.assertEqual(count(running.stop(), "datagrams lost on their way here"), 7)
            self.assertIn("2 datagrams of the other end did not come: their frames are lost", running.errors)

    def test_who_may_reach_it_is_told(self):
        with emulator("--bus", f"cannelloni:192.0.2.1:{self.place.port}", "--ids", "1") as running:
            running.stop()
            self.assertIn(f"whoever can send from 192.0.2.1, or as if from there, to UDP port {self.place.port}",
                          running.errors)

    def test_what_cannot_be_is_told_in_a_line(self):
        for name, why in (("cannelloni:20000", "ADDR and PORT are those of the other end"),
                          ("cannelloni:127.0.0.1:20000", "cannot have the same port; like cannelloni:"),
                          ("cannelloni:239.1.1.1:20000", "is no machine's address"),
                          ("cannelloni:robot:20000", "ADDR is an IP address"),
                          ("cannelloni:192.0.2.1:20000?port=1", "is not cannelloni:ADDR:PORT[?local=PORT]")):
            self.assertIn(why, self.refused("--bus", name, "--ids", "1", "--check"))
        peer = self.open()  # has the port that the program would need
        self.assertIn(f"cannot have UDP port {self.place.port}",
                      self.refused("--bus", f"cannelloni:127.0.0.1:{self.place.own}?local={self.place.port}",
                                   "--ids", "1"))
        peer.shutdown()


if __name__ == "__main__":
    unittest.main()
