"""Sends datagrams from a network with this machine's address as forged sender, in a namespace with a TUN device.

usage: forged_sender.py LK_EMU; exit status 77 without namespaces or TUN devices
"""

import fcntl
import os
import socket
import struct
import subprocess
import sys
import unittest

import can

NAMESPACE = ["unshare", "--user", "--map-root-user", "--net"]
TUNSETIFF, IFF_TUN, IFF_NO_PI = 0x400454CA, 0x0001, 0x1000
GROUP = "ff15:7079:7468:6f6e:6465:6d6f:6d63:6173"  # of python-can
OWN = "fd00::1"


def inside() -> bool:
    """Returns True inside the namespace; outside it runs this program again in a new namespace."""
    if os.environ.get("LKEMU_TEST_NAMESPACE"):
        return True
    if not os.access("/dev/net/tun", os.W_OK) or subprocess.run([*NAMESPACE, "true"], check=False).returncode != 0:
        print("skipped: no network namespace, or no TUN device, for this user")
        sys.exit(77)
    os.execvpe(NAMESPACE[0], [*NAMESPACE, sys.executable, "-B", *sys.argv], {**os.environ, "LKEMU_TEST_NAMESPACE": "1"})


def checksum(data: bytes) -> int:
    data += bytes(len(data) % 2)
    total = sum(struct.unpack(f"!{len(data) // 2}H", data))
    while total >> 16:
        total = (total & 0xFFFF) + (total >> 16)
    return ~total & 0xFFFF


def datagram(source: str, port: int, payload: bytes) -> bytes:
    """Returns an IPv6 packet to the group."""
    ends = socket.inet_pton(socket.AF_INET6, source) + socket.inet_pton(socket.AF_INET6, GROUP)
    length = 8 + len(payload)
    udp = struct.pack("!4H", 5555, port, length, 0) + payload
    right = checksum(ends + struct.pack("!II", length, socket.IPPROTO_UDP) + udp)
    udp = udp[:6] + struct.pack("!H", right) + udp[8:]
    return struct.pack("!IHBB", 6 << 28, length, socket.IPPROTO_UDP, 1) + ends + udp


if inside():
    import support
    from can.interfaces.udp_multicast.utils import pack_message
    from can_messages import message, text
    from support import PATIENCE_S, count, emulator, free_port


class ForgedSender(support.TestCase):
    def setUp(self):
        super().setUp()
        self.network = os.open("/dev/net/tun", os.O_RDWR)
        self.addCleanup(os.close, self.network)
        fcntl.ioctl(self.network, TUNSETIFF, struct.pack("16sH14x", b"net0", IFF_TUN | IFF_NO_PI))
        for words in ("link set lo up", "link set net0 up", f"-6 address add {OWN}/64 dev net0 nodad"):
            subprocess.run(["ip", *words.split()], check=True)

    def test_network_frames_are_ignored_for_any_sender_address(self):
        port = free_port()
        with emulator("--bus", f"udp-multicast::{port}", "--ids", "1") as running:
            forged = pack_message(message(1, 0x9A))
            for source in (OWN, "fd00::2"):
                for _ in range(20):
                    os.write(self.network, datagram(source, port, forged))
            with can.Bus(interface="udp_multicast", channel=GROUP, port=port, hop_limit=0) as bus:
                bus.send(message(1, 0x92))
                heard = 0  # its own query and the reply
                while heard < 2:
                    heard += text(bus.recv(PATIENCE_S)).startswith("141#92")
            summary = running.stop()
        self.assertEqual(count(summary, "lines or datagrams that made no sense"), 20)
        self.assertEqual(count(summary, "datagrams of others, dropped"), 20)
        self.assertIn("1 frames, 1 queries, 1 replies", summary)


if __name__ == "__main__":
    unittest.main()
