"""Writes captures of CAN buses and reads them with tshark and the dissector."""

import json
import os
import pathlib
import struct
import subprocess

LINKTYPE_CAN_SOCKETCAN = 227


def write_pcap(path, frames):
    """Writes a nanosecond pcap file. Frames are (seconds, identifier, data), plus 0x04 for CAN FD."""
    with open(path, "wb") as file:
        file.write(struct.pack("<IHHiIII", 0xA1B23C4D, 2, 4, 0, 0, 65535, LINKTYPE_CAN_SOCKETCAN))
        for at_s, identifier, data, *fd in frames:
            packet = struct.pack(">IBBxx", identifier, len(data), *fd or [0]) + data
            ns = round(at_s * 1e9)
            file.write(struct.pack("<IIII", ns // 10**9, ns % 10**9, len(packet), len(packet)) + packet)


def write_pcapng(path, buses, frames):
    """Writes a file as lk-emu does. Buses are (name, description), frames (bus, seconds, identifier, data)."""
    def option(code, value):
        return struct.pack("<HH", code, len(value)) + value + b"\0" * (-len(value) % 4)

    def block(kind, body):
        return struct.pack("<II", kind, len(body) + 12) + body + struct.pack("<I", len(body) + 12)

    with open(path, "wb") as file:
        file.write(block(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1)))
        for name, description in buses:
            options = option(2, name.encode()) + option(3, description.encode()) + option(9, b"\x09") + option(0, b"")
            file.write(block(1, struct.pack("<HHI", LINKTYPE_CAN_SOCKETCAN, 0, 0) + options))
        for bus, at_s, identifier, data in frames:
            packet = struct.pack(">IBBxx", identifier, len(data), 0) + data
            ns = round(at_s * 1e9)
            file.write(block(6, struct.pack("<IIIII", bus, ns >> 32, ns & 0xFFFFFFFF, len(packet), len(packet))
                             + packet + b"\0" * (-len(packet) % 4)))


class Said:
    """Dissection of one frame: values by the names of the field table, and other results."""

    def __init__(self, packet):
        self.layers = packet["_source"]["layers"]
        said = self.layers.get("lk.motor")
        self.ours = said is not None
        said = said or {}
        expert = said.get("_ws.expert", [])
        self.experts = {name.removeprefix("lk.motor.") for one in (expert if isinstance(expert, list) else [expert])
                        for name in one if name.startswith("lk.motor.")}

        def take(name):
            value = said.pop("lk.motor." + name, None)
            return value

        self.kind = {"0": "query", "1": "reply", None: None}[take("kind")]
        self.drive = int(take("drive") or 0)
        self.command = take("command")
        self.command_name = take("command_name")
        replies = take("reply_in") or []
        self.replies = [int(frame) for frame in (replies if isinstance(replies, list) else [replies])]
        self.reply_to = int(take("reply_to") or 0)
        self.response_time_s = float(take("response_time") or 0)
        self.values = {name.removeprefix("lk.motor."): float(value) for name, value in said.items()
                       if name.startswith("lk.motor.")}


def tshark(capture, dissector, preferences=(), arguments=(), two_passes=True):
    """Returns the output of tshark with default settings."""
    home = pathlib.Path(capture).parent / "home"
    home.mkdir(exist_ok=True)
    command = ["tshark", *(["-2"] if two_passes else []), "-n", "-r", str(capture), "-X", f"lua_script:{dissector}"]
    for preference in preferences:
        command += ["-o", "lk.motor." + preference]
    run = subprocess.run(command + list(arguments), capture_output=True, text=True,
                         env={**os.environ, "HOME": str(home), "LC_ALL": "C.UTF-8"})
    problems = [line for line in run.stderr.splitlines() if "Running as user" not in line]
    assert run.returncode == 0 and not problems, problems
    assert "Lua Error" not in run.stdout, run.stdout
    return run.stdout


def dissect(capture, dissector, preferences=(), two_passes=True):
    said = tshark(capture, dissector, preferences, ["-T", "json", "--no-duplicate-keys"], two_passes)
    return [Said(packet) for packet in json.loads(said)]
