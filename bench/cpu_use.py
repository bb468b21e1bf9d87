#!/usr/bin/python3
"""How much of one core do 32 live drives take?

usage: scripts/with-vcan bench/cpu_use.py [LK_EMU [SECONDS]]

Prints it for idle drives, for turning ones, and for turning ones that a host polls as fast as the
modelled wire allows. CPU time is what the kernel charged the process.
"""

import os
import socket
import struct
import subprocess
import sys
import time

IDS = 32


def send(bus, motor, data):
    bus.send(struct.pack("<IB3x8s", 0x140 + motor, 8, data))


def ask(bus, motor, data):
    send(bus, motor, data)
    return bus.recv(16)


def cpu_seconds(pid):
    with open(f"/proc/{pid}/stat", encoding="ascii") as stat:
        fields = stat.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def measure(pid, label, seconds, work):
    cpu, start, done = cpu_seconds(pid), time.monotonic(), 0
    while time.monotonic() - start < seconds:
        done += work()
    elapsed = time.monotonic() - start
    share = (cpu_seconds(pid) - cpu) / elapsed
    print(f"{label:<22} {share:6.1%} of a core   {done / elapsed:6.0f} replies/s", flush=True)


def sleep_a_little():
    time.sleep(0.5)
    return 0


def main(program="build/release/emulator/lk-emu", seconds="10"):
    emulator = subprocess.Popen(
        [program, "--bus", "vcan0", "--ids", f"1-{IDS}", "--rom", ":memory:"],
        stdout=subprocess.PIPE,
        text=True,
    )
    emulator.stdout.readline()
    bus = socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    bus.bind(("vcan0",))

    def sweep():
        for motor in range(1, IDS + 1):
            ask(bus, motor, b"\x9c")
        return IDS

    measure(emulator.pid, f"{IDS} drives, idle", float(seconds), sleep_a_little)
    for motor in range(1, IDS + 1):
        ask(bus, motor, b"\xa2\0\0\0" + struct.pack("<i", 36000 * motor // 4))
    measure(emulator.pid, f"{IDS} drives, turning", float(seconds), sleep_a_little)
    measure(emulator.pid, f"{IDS} drives, polled", float(seconds), sweep)
    emulator.terminate()
    print(emulator.communicate()[0], end="")


if __name__ == "__main__":
    main(*sys.argv[1:])
