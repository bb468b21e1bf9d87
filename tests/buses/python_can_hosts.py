"""Tests Debian's python-can as a host of lk-emu, with equal conversations on each kind of bus.

usage: python_can_hosts.py LK_EMU
"""

import contextlib
import fcntl
import os
import re
import socket
import struct
import termios
import time
import unittest

import can
from can.interfaces.udp_multicast import UdpMulticastBus

import support
from can_messages import message, text
from support import PATIENCE_S, count, emulator, free_port


class SlcanTcp:
    """A bus of this kind: its address, and a host's connection to it."""

    def __init__(self, case: support.TestCase):
        self.port = free_port()
        self.name = f"slcan-tcp:{self.port}"
        self.same = f"slcan-tcp:127.0.0.1:{self.port}"

    def open(self) -> can.BusABC:
        return can.Bus(interface="slcan", channel=f"socket://127.0.0.1:{self.port}", sleep_after_open=0)


class Socketcand:
    def __init__(self, case: support.TestCase):
        self.port = free_port()
        self.name = f"socketcand:{self.port}"
        self.same = f"socketcand:127.0.0.1:{self.port}"

    def open(self) -> can.BusABC:
        return can.Bus(interface="socketcand", channel="can0", host="127.0.0.1", port=self.port)


class SlcanPty:
    def __init__(self, case: support.TestCase):
        self.path = case.path("ttyACM0")
        self.name = f"slcan-pty:{self.path}"
        self.same = f"slcan-pty:{case.directory}/../{os.path.basename(case.directory)}/ttyACM0"

    def open(self) -> can.BusABC:
        return can.Bus(interface="slcan", channel=self.path, sleep_after_open=0)


class OthersOnly(UdpMulticastBus):
    """Skips own datagrams, which the group returns to the sender before all replies."""

    def __init__(self, *args, **kwargs):
        self.own = []
        super().__init__(*args, **kwargs)

    def send(self, msg, timeout=None):
        self.own.append(text(msg))
        super().send(msg, timeout)

    def _recv_internal(self, timeout):
        frame, filtered = super()._recv_internal(timeout)
        if frame is not None and self.own and text(frame) == self.own[0]:
            del self.own[0]
            return None, filtered
        return frame, filtered


class UdpMulticast:
    def __init__(self, case: support.TestCase):
        self.port = free_port()
        self.name = f"udp-multicast:239.74.163.2:{self.port}"
        self.same = self.name

    def open(self) -> can.BusABC:
        return OthersOnly("239.74.163.2", port=self.port, hop_limit=0)


SHARED = [SlcanTcp, Socketcand, UdpMulticast]
KINDS = [*SHARED, SlcanPty]


class Hosts(support.TestCase):
    def on_each_kind(self, kinds=tuple(KINDS)):
        for kind in kinds:
            with self.subTest(kind.__name__):
                yield kind(self)

    def open(self, place) -> can.BusABC:
        bus = place.open()

        def close():
            with contextlib.suppress(can.CanError):  # a terminal may be closed already
                bus.shutdown()

        self.addCleanup(close)
        return bus

    def hear(self, bus: can.BusABC) -> str:
        frame = bus.recv(PATIENCE_S)
        self.assertIsNotNone(frame, "nothing comes")
        return text(frame)

    def ask(self, bus: can.BusABC, motor: int, *data: int) -> str:
        bus.send(message(motor, *data))
        return self.hear(bus)

    def test_a_host_talks_to_two_drives(self):
        for place in self.on_each_kind():
            with emulator("--bus", place.name, "--ids", "1-2") as running:
                self.assertEqual(running.ready, f"lk-emu ready {place.name}:1-2")
                bus = self.open(place)
                for motor in (1, 2):
                    self.assertRegex(self.ask(bus, motor, 0x9A), f"14{motor}#9A..00[0-9A-F]{{4}}000000$")
                    self.assertEqual(self.ask(bus, motor, 0x88), f"14{motor}#8800000000000000")
                    self.ask(bus, motor, 0xA2, 0, 0, 0, *(36000).to_bytes(4, "little"))
                places = {self.ask(bus, 1, 0x9C)[-4:] for _ in range(20)}
                self.assertGreater(len(places), 5, "it does not turn")
                self.assertIn("26 queries, 26 replies", running.stop())

    def test_hosts_receive_all_frames_in_bus_order(self):
        for place in self.on_each_kind(SHARED):
            with emulator("--bus", place.name, "--ids", "1"):
                one, other = self.open(place), self.open(place)
                self.ask(one, 1, 0x9A)  # both are connected
                self.ask(other, 1, 0x9B)
                for _ in range(2):
                    self.hear(other)  # the first query and its reply
                for _ in range(2):
                    self.hear(one)
                for _ in range(50):
                    said = self.ask(one, 1, 0x92)
                    self.assertEqual(self.hear(other), "141#9200000000000000")
                    self.assertEqual(self.hear(other), said)

    def test_recording_can_be_replayed(self):
        for n, place in enumerate(self.on_each_kind()):
            recording = self.path(f"recording{n}")
            with emulator("--bus", place.name, "--ids", "1-2", "--record", recording) as running:
                bus = self.open(place)
                self.ask(bus, 1, 0xA3, 0, 0, 0, *(18000).to_bytes(4, "little"))
                for _ in range(20):
                    self.ask(bus, 2, 0x9C)
                running.stop()
            with open(recording + "/frames.log", encoding="ascii") as file:
                self.assertIn(f" {place.name} 142#9C00000000000000 T\n", file.read())
            self.assertIn("identical", self.run_program("replay", recording))

    def test_equal_queries_get_equal_replies_on_all_kinds(self):
        asked = [message(1, 0xA2, 0, 0, 0, *(36000).to_bytes(4, "little")), message(2, 0x9A),
                 message(1, 0x9C), message(2, 0xA3, 0, 0, 0, *(9000).to_bytes(4, "little"))]
        answers = {}
        for place in self.on_each_kind():
            control = self.path(type(place).__name__)
            with emulator("--bus", place.name, "--ids", "1-2", "--clock", "stepped",
                          control=control) as running:
                bus, heard = self.open(place), []
                for _ in range(10):
                    for frame in asked:
                        bus.send(frame)
                    running.advance("10ms")
                    heard += [self.hear(bus) for _ in asked]
                answers[type(place).__name__] = heard
        for kind, heard in answers.items():
            self.assertEqual(heard, answers[KINDS[0].__name__], kind)
        # The motors move: the speed of motor 1 in state 2 varies.
        speeds = {line[10:14] for line in answers[KINDS[0].__name__] if line.startswith("141#9C")}
        self.assertGreater(len(speeds), 1)

    def test_second_program_on_an_address_is_refused(self):
        for place in self.on_each_kind():
            with emulator("--bus", place.name, "--ids", "1"):
                self.assertIn("in use by lk-emu (pid",
                              self.refused("--bus", place.same, "--ids", "1", "--rom", ":memory:"))

    def test_host_can_reconnect(self):
        for place in self.on_each_kind():
            with emulator("--bus", place.name, "--ids", "1"):
                for _ in range(10):
                    bus = place.open()
                    self.assertRegex(self.ask(bus, 1, 0x9A), "^141#9A")
                    bus.shutdown()


def bytes_waiting(wire: socket.socket) -> int:
    return struct.unpack("i", fcntl.ioctl(wire, termios.FIONREAD, bytes(4)))[0]


class SlcanAlone(support.TestCase):
    def test_bus_suggested_without_vcan_works(self):
        if os.path.exists("/sys/class/net/vcan0"):
            self.skipTest("there is one")
        said = self.refused()
        offer = re.search(r'no vcan here: try --bus slcan-tcp:(\d+) --ids 1-4, python-can: (.*?);', said)
        self.assertIsNotNone(offer, said)
        self.assertIn(f"try --bus slcan-tcp:{offer[1]} --ids 1-4", self.refused("--bus", "vcan0", "--ids", "1"))
        port = str(free_port())  # the default port may be in use
        with emulator("--bus", f"slcan-tcp:{port}", "--ids", "1-4"):
            bus = eval(f"can.Bus({offer[2].replace(offer[1], port)})")
            self.addCleanup(bus.shutdown)
            bus.send(message(4, 0x9A))
            self.assertRegex(text(bus.recv(PATIENCE_S)), "^144#9A")

    def test_first_script_works(self):
        place = SlcanTcp(self)
        with emulator("--bus", place.name, "--ids", "1-4") as running:
            bus = place.open()
            self.addCleanup(bus.shutdown)

            def ask(motor: int, *data: int) -> bytes:
                bus.send(message(motor, *data))
                reply = bus.recv(PATIENCE_S)
                self.assertEqual((reply.arbitration_id, reply.data[0]), (0x140 + motor, data[0]))
                return bytes(reply.data)

            for motor in range(1, 5):
                _, temperature, _, voltage, _, error = struct.unpack("<BbBHHB", ask(motor, 0x9A))
                self.assertTrue(0 < temperature < 60 and 200 < voltage < 280 and error == 0)
            target = 18000  # 0.01 degree
            ask(2, 0xA3, 0, 0, 0, *struct.pack("<i", target))
            deadline = time.monotonic() + PATIENCE_S
            while abs(int.from_bytes(ask(2, 0x92)[1:8], "little", signed=True) - target) > 5:
                self.assertLess(time.monotonic(), deadline, "motor 2 does not arrive")
            running.stop()

    def test_adapter_reports_version_and_serial_number(self):
        place = SlcanTcp(self)
        with emulator("--bus", place.name, "--ids", "1"):
            bus = place.open()
            self.addCleanup(bus.shutdown)
            self.assertEqual(bus.get_version(PATIENCE_S), (10, 13))
            self.assertEqual(bus.get_serial_number(PATIENCE_S), "LKEM")

    def test_late_recv_finds_the_first_reply_without_acknowledgements(self):
        """python-can 4.1 reads all pending bytes but, if that took too long, examines only the first line."""
        place = SlcanTcp(self)
        with emulator("--bus", place.name + "?acks=no", "--ids", "1"):
            bus = place.open()
            self.addCleanup(bus.shutdown)
            wire = bus.serialPortOrig._socket
            deadline = time.monotonic() + PATIENCE_S
            for sent in range(10, 600, 10):  # the drive has a queue of 16
                for _ in range(10):
                    bus.send(message(1, 0x9A))
                while bytes_waiting(wire) < sent * len("t14189A11223344556677\r"):
                    self.assertLess(time.monotonic(), deadline, "not all replies come")
                    time.sleep(0.001)
            for _ in range(sent):
                frame = bus.recv(0)
                self.assertIsNotNone(frame, "no frame, though replies wait")
                self.assertRegex(text(frame), "^141#9A")

    def test_wrong_rate_gets_no_reply(self):
        place = SlcanTcp(self)
        with emulator("--bus", place.name, "--ids", "1") as running:
            bus = can.Bus(interface="slcan", channel=f"socket://127.0.0.1:{place.port}",
                          sleep_after_open=0, bitrate=500_000)
            self.addCleanup(bus.shutdown)
            bus.send(message(1, 0x9A))
            bus.set_bitrate(1_000_000)
            bus.send(message(1, 0x9C))
            self.assertRegex(text(bus.recv(PATIENCE_S)), "^141#9C")
            summary = running.stop()
            self.assertIn("is at 500000 bit/s and the drives are at 1000000", running.errors)
            self.assertIn("1 queries, 1 replies", summary)

    def test_public_address_is_reported(self):
        port = free_port()
        with emulator("--bus", f"slcan-tcp:0.0.0.0:{port}", "--ids", "1") as running:
            running.stop()
            self.assertIn("anyone who can reach 0.0.0.0 can command these drives", running.errors)

    def test_invalid_buses_are_refused_with_the_reason(self):
        place = SlcanTcp(self)
        for name, why in (("slcan-tcp:", "needs a port, like slcan-tcp:29536"),
                          ("slcan-tcp:70000", "PORT is 1 to 65535"),
                          ("slcan-tcp:0", "PORT is 1 to 65535"),
                          ("slcan-tcp:::1:29536", "of IPv6 in brackets"),
                          ("slcan-tcp:300.0.0.1:29536", "ADDR is an IP address"),
                          ("scan-tcp:29536", 'unknown kind of bus "scan-tcp:"')):
            self.assertIn(why, self.refused("--bus", name, "--ids", "1"))
        self.assertIn("cannot listen there",
                      self.refused("--bus", f"slcan-tcp:192.0.2.1:{place.port}", "--ids", "1"))


class SlcanPtyAlone(support.TestCase):
    def test_serial_port_is_refused_as_a_path(self):
        master, port = os.openpty()  # a character device, like /dev/ttyUSB0
        self.addCleanup(os.close, master)
        self.addCleanup(os.close, port)
        self.assertIn("is a serial port; slcan-pty creates its own terminal: give a path that does not exist",
                      self.refused("--bus", f"slcan-pty:{os.ttyname(port)}", "--ids", "1"))


class SocketcandAlone(support.TestCase):
    def setUp(self):
        super().setUp()
        self.place = Socketcand(self)

    def connect(self, *words: str) -> socket.socket:
        client = socket.create_connection(("127.0.0.1", self.place.port), PATIENCE_S)
        self.addCleanup(client.close)
        for word, answer in zip(("", *words), ("< hi >", *["< ok >"] * len(words))):
            client.sendall(word.encode())
            self.assertEqual(client.recv(64).decode(), answer)
        return client

    def test_broadcast_manager_sends_queries_in_cycles(self):
        with emulator("--bus", self.place.name, "--ids", "1-2"):
            client = self.connect("< open can0 >")
            client.sendall(b"< subscribe 0 0 141 >< add 0 5000 141 8 9C 0 0 0 0 0 0 0 >"
                           b"< add 0 5000 142 8 9C 0 0 0 0 0 0 0 >")
            text = ""
            while text.count(">") < 20:
                text += client.recv(4096).decode()
            for line in text.split(">")[:20]:
                self.assertRegex(line, r"^< frame 141 \d+\.\d{6} 9C (?:[0-9A-F]{2} ){7} $")
            client.sendall(b"< delete 141 >< delete 142 >< echo >")
            while "< echo >" not in text:  # a late reply may follow
                text += client.recv(4096).decode()

    def test_error_frames_are_reported(self):
        robot = self.path("robot.toml")
        with open(robot, "w", encoding="ascii") as file:
            file.write(f'[[bus]]\ninterface = "{self.place.name}"\n[[bus.drive]]\nid = 1\n'
                       '[[bus.event]]\nat_s = 0.01\nfault = { kind = "error_frames", probability = 0.5 }\n')
        with emulator("--config", robot):
            client = self.connect("< open can0 >", "< rawmode >")
            client.sendall(b"< send 141 8 9C 0 0 0 0 0 0 0 >")
            text = ""
            while "< error " not in text:
                client.sendall(b"< send 141 8 9C 0 0 0 0 0 0 0 >")
                text += client.recv(4096).decode()
            self.assertRegex(text, r"< error [0-9A-F]{3} \d+\.\d{6} >")

    def test_beacon_stays_on_this_machine(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind(("127.255.255.255", 42000))
            listener.settimeout(PATIENCE_S)
            with emulator("--bus", self.place.name, "--ids", "1"):
                text, sender = listener.recvfrom(2048)
                self.assertEqual(sender[0], "127.0.0.1")
                self.assertIn(f"<URL>can://127.0.0.1:{self.place.port}</URL>", text.decode())


class UdpMulticastAlone(support.TestCase):
    def test_default_group_equals_that_of_python_can(self):
        port = free_port()
        with emulator("--bus", f"udp-multicast::{port}", "--ids", "1"):
            with OthersOnly(port=port, hop_limit=0) as bus:
                bus.send(message(1, 0x9A))
                self.assertRegex(text(bus.recv(PATIENCE_S)), "^141#9A")

    def test_invalid_datagrams_are_counted(self):
        port = free_port()
        with emulator("--bus", f"udp-multicast:239.74.163.2:{port}", "--ids", "1") as running:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
                sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
                for datagram in (b"", b"\x91" * 500, b"\xdf\xff\xff\xff\xff", bytes(1400)):
                    sender.sendto(datagram, ("239.74.163.2", port))
            with OthersOnly("239.74.163.2", port=port, hop_limit=0) as bus:
                bus.send(message(1, 0x9A))
                self.assertRegex(text(bus.recv(PATIENCE_S)), "^141#9A")
            self.assertEqual(count(running.stop(), "lines or datagrams that made no sense"), 4)

    def test_ttl_1_reports_network_access(self):
        port = free_port()
        with emulator("--bus", f"udp-multicast:239.74.163.2:{port}?ttl=1", "--ids", "1") as running:
            running.stop()
            self.assertIn("anyone on a network of this machine can command these drives",
                          running.errors)

    def test_invalid_buses_are_refused_with_the_reason(self):
        for name, why in (("udp-multicast:192.0.2.1", "is not a multicast group"),
                          ("udp-multicast:239.1.1.1?ttl=2", "is not udp-multicast:[GROUP]"),
                          ("udp-multicast:[::1]", "is not a multicast group"),
                          ("udp-multicast:239.1.1.1:0", "PORT is 1 to 65535")):
            self.assertIn(why, self.refused("--bus", name, "--ids", "1", "--check"))


if __name__ == "__main__":
    unittest.main(warnings="ignore")  # pyserial leaves closing its sockets to Python
