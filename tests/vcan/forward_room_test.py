"""Both ends of with-vcan --forward when the process can open nothing more.

    forward_room_test.py DIRECTORY_OF_VCAN_FORWARD
"""

import contextlib
import os
import resource
import socket
import sys
import unittest

sys.path.insert(0, sys.argv[1])
import vcan_forward as forward  # noqa: E402


@contextlib.contextmanager
def no_descriptors():
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    lowest = os.open(os.devnull, os.O_RDONLY)  # of those that are free
    os.close(lowest)
    resource.setrlimit(resource.RLIMIT_NOFILE, (lowest, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, before)


class Counting(forward.Outside):
    accepted = 0

    def accept(self, fd):
        self.accepted += 1
        super().accept(fd)


class NoRoom(unittest.TestCase):
    def setUp(self):
        self.line, self.other = socket.socketpair()
        self.listener = forward.listen(0)
        for sock in (self.line, self.other, self.listener):
            self.addCleanup(sock.close)
        self.other.settimeout(60)

    def connect(self):
        sock = socket.create_connection(self.listener.getsockname())
        self.addCleanup(sock.close)

    def say(self, kind, number, payload=b""):
        forward.write(self.other.fileno(), kind, number, payload)

    def test_outside_waits_for_a_connection_to_close(self):
        outside = Counting(self.line.fileno(), [(self.listener, 80)])
        self.connect()
        outside.step()
        self.assertEqual(list(outside.connections), [1])
        self.connect()
        with no_descriptors():
            outside.step()
            self.assertEqual((outside.accepted, list(outside.connections)), (2, [1]))
            for _ in range(3):  # the line is read, and who waits is let wait
                self.say(forward.READ, 0)
                outside.step()
            self.assertEqual(outside.accepted, 2)
        self.say(forward.BREAK, 1)
        outside.step()
        outside.step()
        self.assertEqual((outside.accepted, list(outside.connections)), (3, [2]))
        outside.close(2)

    def test_outside_tries_again_where_none_can_close(self):
        outside = Counting(self.line.fileno(), [(self.listener, 80)])
        self.connect()
        with no_descriptors():
            outside.step()
        outside.step()  # its time passes
        outside.step()
        self.assertEqual((outside.accepted, list(outside.connections)), (2, [1]))
        outside.close(1)

    def test_inside_breaks_off_what_it_cannot_connect(self):
        inside = forward.Inside(self.line.fileno())
        with no_descriptors():
            self.say(forward.OPEN, 7, (80).to_bytes(2, "big"))
            self.assertTrue(inside.step())
        self.assertEqual(inside.connections, {})
        frames = self.other.recv(100)
        self.assertEqual(frames, bytes([forward.READ]) + bytes(6) + bytes([forward.BREAK]) + (7).to_bytes(4, "big") + bytes(2))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
