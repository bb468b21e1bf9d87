#!/usr/bin/env python3
"""The host of scripts/demo: talks to four drives through python-can.

Usage: demo_host.py PATH/lk-emu BUS, where BUS is a CAN interface that is up, or slcan-tcp. Exits 0 only if every query got
its reply and every motor reached its target.
"""

import os
import select
import signal
import socket
import statistics
import struct
import subprocess
import sys
import time

import can

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from lk_decode import angle_deg, query_in_words, reply_in_words, state2

SPEED_DPS = {1: 1000, 2: -1500, 3: 2000, 4: -2500}  # fast enough to pass over the cogs evenly
TARGET_DEG = {1: 90.0, 2: -45.0, 3: 360.0, 4: -123.45}
DRIVES = list(SPEED_DPS)

START_LIMIT_S = 20
REPLY_LIMIT_S = 1.0
MOTION_LIMIT_S = 10.0
SPEED_TOLERANCE_DPS = 30  # ripple by cogging, and noise of a drive's speed reading
ANGLE_TOLERANCE_DEG = 360 / 16384 + 0.01  # one encoder count and one unit of the wire
READINGS = 9  # the angle is their median, since each reading has a noise of one count


class Broken(Exception):
    """The session cannot continue."""


class Lines:
    """Reads lines of a program's output with a deadline."""

    def __init__(self, *command):
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE)
        self.fd = self.process.stdout.fileno()
        self.pending = b""

    def next(self, deadline):
        """Returns the next line; None at the deadline or if the program has ended."""
        while b"\n" not in self.pending:
            wait = deadline - time.monotonic()
            if wait <= 0 or not select.select([self.fd], [], [], wait)[0]:
                return None
            data = os.read(self.fd, 65536)
            if not data:
                return None
            self.pending += data
        line, self.pending = self.pending.split(b"\n", 1)
        return line.decode().strip()

    def rest(self, limit_s):
        deadline = time.monotonic() + limit_s
        while (line := self.next(deadline)) is not None:
            yield line


class Host:
    def __init__(self, emulator, bus):
        self.queries = self.replies = 0
        self.problems = []
        self.error_deg = {}  # by drive; only drives that reached their target
        port = free_port()
        address = f"slcan-tcp:{port}" if bus == "slcan-tcp" else bus
        self.emulator = Lines(emulator, "--bus", address, "--ids", "1-4", "--rom", ":memory:")
        line = self.emulator.next(time.monotonic() + START_LIMIT_S)
        if line is None or not line.startswith("lk-emu ready "):
            raise Broken(f"lk-emu did not start: {line}")
        print(line, flush=True)
        if bus == "slcan-tcp":
            self.bus = can.Bus(interface="slcan", channel=f"socket://127.0.0.1:{port}")
        else:
            self.bus = can.Bus(interface="socketcan", channel=bus)

    def problem(self, text):
        self.problems.append(text)
        print(f"  PROBLEM: {text}", flush=True)

    def exchange(self, drive, payload):
        """Sends one query; returns its reply or None."""
        identifier = 0x140 + drive
        self.queries += 1
        self.bus.send(can.Message(arbitration_id=identifier, data=payload, is_extended_id=False))
        deadline = time.monotonic() + REPLY_LIMIT_S
        while (message := self.bus.recv(max(0.0, deadline - time.monotonic()))) is not None:
            if message.arbitration_id == identifier and len(message.data) == 8 and message.data[0] == payload[0]:
                self.replies += 1
                return bytes(message.data)
        self.problem(f"drive {drive} did not answer {query_in_words(payload)}")
        if self.queries - self.replies >= 3:
            raise Broken("too many queries without a reply")
        return None

    def show(self, drive, payload, reply, remark=""):
        query = query_in_words(payload)
        print(f"drive {drive} > {query:38} < {reply_in_words(reply)}{remark}", flush=True)

    def say(self, drive, payload):
        """Exchanges and prints one query and its reply."""
        reply = self.exchange(drive, payload)
        if reply is not None:
            self.show(drive, payload, reply)

    def wait_until(self, drive, payload, measure, goal, tolerance):
        """Polls until the median of the last readings reaches the goal; prints the last reading."""
        readings, polls, reply = [], 0, None
        deadline = time.monotonic() + MOTION_LIMIT_S
        while time.monotonic() < deadline:
            polls += 1
            reply = self.exchange(drive, payload)
            if reply is None:
                continue
            readings = [*readings, measure(reply)][-READINGS:]
            if len(readings) < READINGS:
                continue
            error = abs(statistics.median(readings) - goal)
            if error <= tolerance:
                self.show(drive, payload, reply, f"  ({polls} polls)")
                return error
        last = f"{readings[-1]:g}" if readings else "nothing"
        self.problem(f"drive {drive}: {last} instead of {goal:g} after {MOTION_LIMIT_S:g} s")
        return None

    def session(self):
        print("\n-- State of each drive")
        for drive in DRIVES:
            for command in (0x9A, 0x9C, 0x92, 0x94, 0x90, 0x30, 0x33, 0x9D):
                self.say(drive, query(command))

        print("\n-- Spin each drive at its own speed, then stop")
        for drive, speed in SPEED_DPS.items():
            self.say(drive, query(0xA2, speed * 100))
        for drive, speed in SPEED_DPS.items():
            self.wait_until(drive, query(0x9C), speed_dps, speed, SPEED_TOLERANCE_DPS)
        for drive in DRIVES:
            self.say(drive, query(0x81))
        for drive in DRIVES:
            self.wait_until(drive, query(0x9C), speed_dps, 0, SPEED_TOLERANCE_DPS)

        print("\n-- Move to a position; half of the commands limit the speed")
        for drive, target in TARGET_DEG.items():
            angle = round(target * 100)
            self.say(drive, query(0xA4, angle, 720) if drive % 2 else query(0xA3, angle))
        for drive, target in TARGET_DEG.items():
            self.wait_until(drive, query(0x92), angle_deg, target, ANGLE_TOLERANCE_DEG)

        print("\n-- Read the positions, and switch off")
        for drive, target in TARGET_DEG.items():
            error = self.wait_until(drive, query(0x92), angle_deg, target, ANGLE_TOLERANCE_DEG)
            if error is not None:
                self.error_deg[drive] = error
            for command in (0x94, 0x9C, 0x80):
                self.say(drive, query(command))

    def stop_emulator(self):
        process = self.emulator.process
        if process.poll() is not None:
            self.problem(f"lk-emu ended on its own with status {process.returncode}")
            return
        process.send_signal(signal.SIGINT)
        for line in self.emulator.rest(5.0):
            print(line)
        if process.wait(5.0) != 0:
            self.problem(f"lk-emu ended with status {process.returncode}")


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


def query(command, value=0, max_speed=0):
    return struct.pack("<BxHi", command, max_speed, value)


def speed_dps(payload):
    return state2(payload)[2]


def main():
    sys.stdout.reconfigure(encoding="utf-8", errors="replace")
    problems = []
    host = None
    try:
        host = Host(*sys.argv[1:])
        host.session()
        host.stop_emulator()
    except (Broken, can.CanError, OSError, subprocess.SubprocessError) as reason:
        problems.append(str(reason))
        print(f"  PROBLEM: {reason}")
    if host is not None:
        problems += host.problems
        print(f"\n{host.queries} queries, {host.replies} replies; position error", end="")
        for drive in DRIVES:
            error = host.error_deg.get(drive)
            print(f"  {drive}: " + ("target not reached" if error is None else f"{error:.3f}°"), end="")
        print()
        if host.queries != host.replies or len(host.error_deg) != len(DRIVES):
            problems = problems or ["something is missing"]
    if problems:
        print(f"demo: FAILED: {problems[0]}")
        sys.exit(1)
    print("demo: every query got its reply, and every motor reached its target")


main()
