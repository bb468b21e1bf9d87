"""A running lk-emu with slcan buses over TCP, and a host on them."""

import math
import random
import socket
import struct
import subprocess
import threading
import time

PATIENCE_S = 0.5  # for a reply; a drive answers within milliseconds
PERIOD_S = 0.01
PORTS = range(20000, 32768)  # below the ports of outgoing connections, so a port stays free while lk-emu restarts


def free_ports(count):
    found = []
    for port in random.sample(PORTS, len(PORTS)):
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as lk-emu does
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
        found.append(port)
        if len(found) == count:
            break
    return found


class Host:
    """One client of a bus: an open slcan adapter."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), PATIENCE_S)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.socket.sendall(b"O\r")
        self.unread = b""

    def send(self, identifier, data):
        self.socket.sendall(b"t%03X%d%s\r" % (identifier, len(data), data.hex().upper().encode()))

    def receive(self, identifier, command):
        """Returns the data of the next frame with this identifier and first byte; None on time-out."""
        start = b"t%03X" % identifier
        deadline = time.monotonic() + PATIENCE_S
        while True:
            while b"\r" in self.unread:
                line, self.unread = self.unread.split(b"\r", 1)
                if line.startswith(start) and line[5:7] == b"%02X" % command:
                    return bytes.fromhex(line[5:5 + 2 * int(line[4:5])].decode())
            left_s = deadline - time.monotonic()
            if left_s <= 0:
                return None
            self.socket.settimeout(left_s)
            try:
                chunk = self.socket.recv(65536)
            except TimeoutError:
                return None
            if not chunk:
                raise ConnectionError("lk-emu closed the bus")
            self.unread += chunk

    def discard(self):
        """Reads and discards all received data."""
        self.unread = b""
        self.socket.setblocking(False)
        try:
            while self.socket.recv(65536):
                pass
        except BlockingIOError:
            pass
        self.socket.settimeout(PATIENCE_S)

    def close(self):
        self.socket.close()


def position_command(angle_deg, max_speed_dps):
    return struct.pack("<BxHi", 0xA4, max_speed_dps, round(angle_deg * 100))


class Mover(threading.Thread):
    """Sends positions to drives every 10 ms, sines to odd ones and steps to even ones, and state queries in between."""

    def __init__(self, port, drives):
        super().__init__(daemon=True)
        self.host = Host(port)
        self.drives = drives
        self.ended = threading.Event()

    def run(self):
        tick = 0
        while not self.ended.wait(PERIOD_S):
            now = time.monotonic()
            for drive in self.drives:
                angle = 90 * math.sin(now * (0.6 + 0.1 * drive)) if drive % 2 else math.copysign(60, math.sin(now * 1.5 + drive))
                self.host.send(0x140 + drive, position_command(angle, 3000))
                if tick % 10 == drive % 10:
                    self.host.send(0x140 + drive, b"\x9a".ljust(8, b"\0"))
            self.host.discard()
            tick += 1

    def end(self):
        self.ended.set()
        self.join()
        self.host.close()


class Bench:
    """lk-emu with one bus per text in `ids`; None takes the drives from a configuration in `options`. The buses are slcan
    over TCP, or those named."""

    def __init__(self, program, ids, *options, ports=None, buses=None):
        self.http, *free = free_ports(1 + len(ids))
        self.ports = ports or free
        self.buses = buses or [f"slcan-tcp:{port}" for port in self.ports]
        self.bus = self.buses[0]
        self.command = [program, "--rom", ":memory:", "--control", "none", "--http", f"127.0.0.1:{self.http}", *options]
        for bus, which in zip(self.buses, ids):
            self.command += ["--bus", bus, *(["--ids", which] if which else [])]
        self.mover = None
        self.start()

    def start(self):
        self.process = subprocess.Popen(self.command, stdout=subprocess.PIPE)
        if not self.process.stdout.readline().startswith(b"lk-emu ready"):
            raise RuntimeError("lk-emu did not start")

    def stop(self):
        self.move()
        self.process.terminate()
        self.process.communicate()

    close = stop

    def move(self, *drives):
        """Moves exactly these drives of the first bus from now on."""
        if self.mover:
            self.mover.end()
            self.mover = None
        if drives:
            self.mover = Mover(self.ports[0], drives)
            self.mover.start()

    def send(self, identifier, data, bus=0):
        """Returns the data of the reply with equal identifier and command on this bus; None without one."""
        host = Host(self.ports[bus])
        try:
            host.send(identifier, data)
            return host.receive(identifier, data[0])
        finally:
            host.close()

    def ask(self, drive, *data, bus=0):
        """Returns DATA[0..7] of the reply; None without one."""
        return self.send(0x140 + drive, bytes(data).ljust(8, b"\0"), bus)

    def read(self, drive, command):
        """As `ask`, but repeats unanswered queries, since a busy machine may be late."""
        for _ in range(10):
            if data := self.ask(drive, command):
                return data
        raise AssertionError(f"drive {drive} does not answer {command:02X}")

    def position(self, drive, angle_deg, max_speed_dps=0):
        return self.ask(drive, *position_command(angle_deg, max_speed_dps))

    def angle_gain(self, drive, kp):
        """Sends 0x31 with the other gains as delivered; 2.5 times the delivered 100 makes a step overshoot."""
        return self.ask(drive, 0x31, 0, kp, 100, 50, 40, 50, 50)

    def angle_deg(self, drive):
        """Returns the angle of 0x92: 56 bits, signed, 0.01 degrees."""
        data = self.read(drive, 0x92)
        return int.from_bytes(data[1:8], "little", signed=True) / 100

    def voltage_V(self, drive):
        """Returns the voltage of 0x9A, oldest generation: DATA[3..4], 0.1 V."""
        return int.from_bytes(self.read(drive, 0x9A)[3:5], "little") / 10

    def memory_kB(self):
        with open(f"/proc/{self.process.pid}/status", encoding="ascii") as status:
            return next(int(row.split()[1]) for row in status if row.startswith("VmRSS"))
