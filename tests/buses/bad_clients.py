"""Connects a thousand misbehaving clients and checks that another client is served meanwhile.

usage: bad_clients.py LK_EMU
"""

import collections
import contextlib
import random
import socket
import threading
import unittest

import support
from support import PATIENCE_S, count, emulator, free_port

QUERY = b"t14189A00000000000000\r"


class Client:
    """A raw slcan client, which can misbehave unlike python-can."""

    def __init__(self, port: int):
        self.socket = socket.create_connection(("127.0.0.1", port), PATIENCE_S)
        self.unread = b""

    def say(self, line: bytes) -> None:
        self.socket.sendall(line)

    def hear(self) -> bytes:
        """Returns one answer up to its end, \\r or \\a."""
        while True:
            for n, byte in enumerate(self.unread):
                if byte in b"\r\a":
                    line, self.unread = self.unread[:n + 1], self.unread[n + 1:]
                    return line
            more = self.socket.recv(65536)
            if not more:
                raise EOFError(self.unread)
            self.unread += more

    def ask(self, line: bytes) -> bytes:
        self.say(line)
        return self.hear()

    def close(self) -> None:
        self.socket.close()


def rude(random_bytes: random.Random, client: Client) -> None:
    """Misbehaves in a random way."""
    way = random_bytes.randrange(6)
    if way == 0:
        client.say(random_bytes.randbytes(random_bytes.randrange(1, 5000)))
    elif way == 1:
        client.say(b"O\r" + QUERY * 20)  # without reading
    elif way == 2:
        client.say(b"t" * 100_000)  # a line without an end
    elif way == 3:
        client.say(b"T1FFFFFFFF8" + b"00" * 8 + b"\rt1419\rt14180\rR\r\r\r\n\x00")
    elif way == 4:
        client.say(b"O\rt1418")  # disconnects in the middle of a line
    else:
        client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")  # sends a reset


@contextlib.contextmanager
def noise(port: int, some: bytes):
    """A client that sends these bytes as fast as possible and reads nothing."""
    ended = threading.Event()

    def send() -> None:
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), PATIENCE_S) as client:
            while not ended.is_set():
                client.sendall(some * 10_000)

    sender = threading.Thread(target=send)
    sender.start()
    try:
        yield
    finally:
        ended.set()
        sender.join()


class BadClients(support.TestCase):
    def setUp(self):
        super().setUp()
        self.port = free_port()
        self.arguments = ["--bus", f"slcan-tcp:{self.port}", "--ids", "1"]

    def client(self) -> Client:
        client = Client(self.port)
        self.addCleanup(client.close)
        return client

    def served(self, client: Client) -> None:
        """Checks that the client is answered despite other clients."""
        client.say(b"t14189200000000000000\r")
        for _ in range(100_000):
            if client.hear().startswith(b"t141892"):
                return
        self.fail("no answer among 100,000 lines")

    def test_thousand_bad_clients_in_turn_do_not_block_service(self):
        with emulator(*self.arguments) as running:
            good = self.client()
            self.assertEqual(good.ask(b"O\r"), b"\r")
            draw = random.Random(23)
            for _ in range(1000):
                bad = Client(self.port)
                rude(draw, bad)
                bad.close()
                self.served(good)
            self.assertGreater(count(running.stop(), "lines or datagrams that made no sense"), 100)

    def test_noise_does_not_delay_another_bus(self):
        for place, some in (("slcan-tcp", b"zzz\r"), ("slcan-tcp", b"\r"), ("socketcand", b"< echo >"),
                            ("rs485-tcp", b"\xff\xfb\x01")):
            port = free_port()
            with self.subTest(place=place, some=some), \
                    emulator("--bus", f"{place}:{port}", "--ids", "1", *self.arguments) as running, noise(port, some):
                good = self.client()
                self.assertEqual(good.ask(b"O\r"), b"\r")
                for _ in range(20):
                    self.served(good)
                running.stop()

    def test_noise_does_not_delay_another_client(self):
        with emulator(*self.arguments) as running, noise(self.port, b"zzz\r"), noise(self.port, b"\r"):
            good = self.client()
            self.assertEqual(good.ask(b"O\r"), b"\r")
            for _ in range(20):
                self.served(good)
            running.stop()

    def test_number_of_clients_is_limited(self):
        with emulator(*self.arguments) as running:
            clients = [self.client() for _ in range(32)]
            for client in clients:
                self.assertEqual(client.ask(b"V\r"), b"V1013\r")
            for _ in range(10):
                with self.assertRaises((EOFError, ConnectionError)):
                    one = self.client()
                    while one.hear() == b"\a":
                        pass
            self.assertEqual(clients[0].ask(b"O\r"), b"\r")
            self.served(clients[0])
            clients.pop().close()
            # The program accepts another client once it has noticed the disconnection.
            for _ in range(1000):
                try:
                    if self.client().ask(b"V\r") == b"V1013\r":
                        break
                except (EOFError, ConnectionError):
                    pass
            else:
                self.fail("no room again")
            self.assertGreaterEqual(count(running.stop(), "clients refused: no room"), 10)

    def test_client_that_does_not_read_loses_frames_without_delaying_others(self):
        with emulator(*self.arguments, "--bitrate", "0") as running:
            deaf, good = self.client(), self.client()
            # Larger than a loopback segment; a smaller window reopens only by a timer, after minutes at worst.
            deaf.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 18)
            self.assertEqual(deaf.ask(b"O\r"), b"\r")
            self.assertEqual(good.ask(b"O\r"), b"\r")
            asked = 0
            # Unread data fills the kernel's buffers, a few megabytes, and the program's own.
            while asked < 200_000:
                good.say(QUERY * 500)
                for _ in range(1000):  # each query is answered by z and the reply
                    good.hear()
                asked += 500
            flags = b""
            deaf.say(b"F\r")
            while not flags.startswith(b"F"):
                flags = deaf.hear()
            self.assertTrue(int(flags[1:3], 16) & 0x08, flags)
            self.served(good)
            summary = running.stop()
            self.assertIn("does not read: frames for it are lost", running.errors)
            self.assertGreater(count(summary, "frames lost: a client did not read"), 1000)
            self.assertIn(f"{asked + 1} queries, {asked + 1} replies", summary)

    def test_32_drives_at_full_bus_load_lose_no_frame(self):
        sweeps = 200
        with emulator("--bus", f"slcan-tcp:{self.port}", "--ids", "1-32", "--motor", "mg4005") as running:
            client = self.client()
            self.assertEqual(client.ask(b"O\r"), b"\r")
            sweep = b"".join(b"t%03X89C00000000000000\r" % (0x140 + drive) for drive in range(1, 33))
            client.say(sweep)
            replies = collections.Counter()
            for n in range(sweeps):
                if n + 1 < sweeps:
                    client.say(sweep)  # the next sweep is queued, so the wire is never idle
                while replies.total() < 32 * (n + 1):
                    line = client.hear()
                    if line != b"z\r":
                        replies[line[:6]] += 1
            self.assertEqual(replies, {b"t%03X89" % (0x140 + drive): sweeps for drive in range(1, 33)})
            summary = running.stop()
            self.assertIn(f"{32 * sweeps} frames, {32 * sweeps} queries, {32 * sweeps} replies", summary)
            self.assertNotIn("lost", summary)

    def test_slcan_lines_get_the_specified_answers(self):
        with emulator(*self.arguments):
            client = self.client()
            for line, answer in ((b"t1418" + b"00" * 8 + b"\r", b"\a"),  # closed
                                 (b"C\r", b"\a"), (b"F\r", b"\a"), (b"S9\r", b"\a"), (b"S8\r", b"\r"),
                                 (b"L\r", b"\r"), (QUERY, b"\a"), (b"C\r", b"\r"),
                                 (b"O\r", b"\r"), (b"S8\r", b"\a"), (b"O\r", b"\a"),
                                 (b"t8008" + b"00" * 8 + b"\r", b"\a"), (b"t1419\r", b"\a"),
                                 (b"t141800\r", b"\a"), (b"t14110G\r", b"\a"), (b"x\r", b"\a"),
                                 (b"a" * 1000 + b"\r", b"\a"), (b"\r", b"\r"),
                                 (b"r1418\r", b"z\r"), (b"T000001410\r", b"Z\r"), (b"F\r", b"F00\r"),
                                 (b"v\r", b"v0101\r"), (b"N\r", b"NLKEM\r")):
                self.assertEqual(client.ask(line), answer, line)


if __name__ == "__main__":
    unittest.main()
