#!/usr/bin/python3
"""A host on a real bus that writes down what it saw, as JSON: a list of runs, each with its frames. The kernel tells
which of them this host has sent: those are the queries.

usage: capture_host.py LK_EMU SCRATCH   (where vcan0 is up, see scripts/with-vcan)
"""

import json
import pathlib
import socket
import struct
import subprocess
import sys

PATIENCE_S = 20.0
SO_TIMESTAMPNS = 35  # asm-generic/socket.h; not in Python 3.11

ROBOTS = {
    # Drive 2 reports under-voltage from the start: its threshold lies above the 24 V of its supply.
    "legacy": """
[[bus.drive]]
id = 1
[[bus.drive]]
id = 2
settings.protection.under_voltage = { enabled = true, threshold_V = 30, hysteresis_V = 1, delay_s = 0 }
[[bus.drive]]
id = 3
settings.broadcast_mode = true
""",
    "v236": """
[[bus.drive]]
id = 1
motor = "mg8016"
generation = "v236"
""",
    "apart": """
[[bus.drive]]
id = 1
quirks.reply_id_base = 0x180
""",
}

# Hosts' frames of each run; a drive that is not there, 9, says nothing.
LEGACY = """
141#9A00000000000000 141#3000000000000000 141#3107060504030201 141#3300000000000000 141#3401020310270000
141#9000000000000000 141#91112233445566AA 141#9200000000000000 141#9400000000000000 141#9500000000000000
141#9B00000000000000 141#9C00000000000000 141#9D00000000000000 141#8800000000000000
141#A100000064000000 141#A2000000A08C0000 141#A200000060FAFFFF 141#A300000028230000 141#A4002C01D8DCFFFF
141#A501000050460000 141#A6012C0150460000 141#A7000000E8030000 141#A8002C0118FCFFFF 141#8100000000000000
141#8100000000000000 141#8000000000000000 142#9A00000000000000 149#9C00000000000000 280#64000000C8000000
141#1900000000000000 141#9C00000000000000
""".split()
V236 = """
141#9A00000000000000 141#9200000000000000 141#9400000000000000 141#8C01000000000000 141#8C10000000000000
141#C00A000000000000 141#C020000000000000 141#C120000000E1F505 141#C01E000000000000 141#9500000010270000
141#9200000000000000 141#A2006400A08C0000 141#9C00000000000000 141#9D00000000000000 141#3000000000000000
""".split()
APART = "141#9A00000000000000 141#8000000000000000 141#8000000000000000".split()

# Those that get no reply: nobody is there, and a command that the generation lacks.
SILENT = {"149#9C00000000000000", "141#3000000000000000@v236"}


class Wire:
    """All frames of the bus in the kernel's order and with its times, and who sent them."""

    def __init__(self):
        self.socket = socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self.socket.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_RECV_OWN_MSGS, 1)
        self.socket.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
        self.socket.bind(("vcan0",))
        self.socket.settimeout(PATIENCE_S)
        self.frames = []

    def send(self, text):
        identifier, data = text.split("#")
        self.socket.send(struct.pack("=IB3x8s", int(identifier, 16), 8, bytes.fromhex(data)))

    def receive(self):
        packet, ancillary, flags, _ = self.socket.recvmsg(16, 256)
        seconds, nanoseconds = struct.unpack("=qq", ancillary[0][2][:16])
        identifier, data = struct.unpack("=IB3x8s", packet)[0], packet[8:]
        direction = "query" if flags & socket.MSG_CONFIRM else "reply"
        self.frames.append([seconds + nanoseconds * 1e-9, direction, f"{identifier:03X}#{data.hex().upper()}"])
        return direction


LONGEST_REPLY_S = 0.1  # of the dissector: what takes longer is no reply to it
TRIES = 20


def is_prompt(frames):
    """No reply came too late to be known as one; a machine with much to do makes them wait."""
    return all(later[0] - earlier[0] < 0.9 * LONGEST_REPLY_S for earlier, later in zip(frames, frames[1:])
               if later[1] == "reply")


def run(program, scratch, name, queries):
    for _ in range(TRIES):
        frames = run_once(program, scratch, name, queries)
        if is_prompt(frames):
            return frames
    sys.exit(f"in {TRIES} runs some reply always took longer than {LONGEST_REPLY_S} s")


def run_once(program, scratch, name, queries):
    config = scratch / f"{name}.toml"
    config.write_text('[[bus]]\ninterface = "vcan0"\n' + ROBOTS[name])
    emulator = subprocess.Popen([program, "--config", str(config), "--rom", ":memory:", "--control", "none"],
                                stdout=subprocess.PIPE, text=True)
    try:
        assert emulator.stdout.readline().startswith("lk-emu ready vcan0:")
        wire = Wire()
        for query in queries:
            wire.send(query)
            assert wire.receive() == "query"
            if query in SILENT or f"{query}@{name}" in SILENT:
                continue
            assert wire.receive() == "reply"
        return wire.frames
    finally:
        emulator.terminate()
        emulator.communicate()


def main(program, scratch):
    scratch = pathlib.Path(scratch)
    runs = {name: run(program, scratch, name, queries)
            for name, queries in (("legacy", LEGACY), ("v236", V236), ("apart", APART))}
    (scratch / "runs.json").write_text(json.dumps(runs))


if __name__ == "__main__":
    main(*sys.argv[1:])
