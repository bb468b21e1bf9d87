#!/usr/bin/python3
"""`candump | lk-emu decode` beside a host on a real bus: every query and reply is told and counted.

usage: decode_host.py LK_EMU   (where vcan0 is up, see scripts/with-vcan)
"""

import json
import select
import subprocess
import sys

import can

PATIENCE_S = 20.0
ROUNDS = 50
# State 1, multi-turn angle, run (an echo), speed 90 dps, state 2.
QUERIES = ("9A00000000000000", "9200000000000000", "8800000000000000", "A200000028230000", "9C00000000000000")


def next_frame(decode):
    """What decode says of the next frame of a drive; those that only woke it are left out."""
    while True:
        said = json.loads(decode.stdout.readline())
        if said["role"] != "other":
            return said


def talk(bus, decode):
    """Asks, waits for the reply, and reads what decode says of both; returns what it said, and what was too late."""
    heard, late, hidden = [], [], set()
    for _ in range(ROUNDS):
        for text in QUERIES:
            for drive in (1, 2):
                bus.send(can.Message(arbitration_id=0x140 + drive, data=bytes.fromhex(text), is_extended_id=False))
                reply = bus.recv(PATIENCE_S)
                assert reply is not None and reply.arbitration_id == 0x140 + drive, reply
                pair = [next_frame(decode), next_frame(decode)]
                assert pair[0]["frame"] == f"{0x140 + drive:03X}#{text}", pair
                assert pair[1]["frame"] == f"{0x140 + drive:03X}#{reply.data.hex().upper()}", pair
                # A machine that stops for longer than a reply may take hides whom the frames are from.
                if pair[1]["time_s"] - pair[0]["time_s"] > 0.1:
                    hidden.add(drive)
                    late.append(pair)
                if drive in hidden:
                    if pair[1]["sure"] and "latency_ms" in pair[1]:
                        hidden.remove(drive)
                    continue
                assert [one["role"] for one in pair] == ["query", "reply"], pair
                assert pair[1]["latency_ms"] > 0, pair
                heard += pair
    return heard, late


def main(program):
    emulator = subprocess.Popen([program, "--bus", "vcan0", "--ids", "1,2", "--rom", ":memory:"],
                                stdout=subprocess.PIPE, text=True)
    dump = subprocess.Popen(["candump", "-t", "z", "vcan0"], stdout=subprocess.PIPE)
    decode = subprocess.Popen([program, "decode", "--json"], stdin=dump.stdout, stdout=subprocess.PIPE, text=True)
    dump.stdout.close()
    try:
        assert emulator.stdout.readline() == "lk-emu ready vcan0:1-2\n"
        with can.Bus(interface="socketcan", channel="vcan0") as bus:
            # candump has opened its socket when a frame comes out of it.
            while not select.select([decode.stdout], [], [], 0.05)[0]:
                bus.send(can.Message(arbitration_id=0x7FF, data=b"", is_extended_id=False))
            heard, late = talk(bus, decode)
        dump.terminate()
        summary = json.loads(decode.stdout.read().splitlines()[-1])
    finally:
        for process in (emulator, dump):
            process.terminate()
            process.wait()
        decode.wait()
    assert decode.returncode == 0 and emulator.returncode == 0
    assert len(heard) > 2 * ROUNDS, "the machine is too slow to hear anything"
    commands = summary["buses"][0]["commands"]
    assert len(commands) == 2 * len(QUERIES), commands
    for command in commands if not late else ():
        assert command["queries"] == command["replies"] == command["latency_ms"]["count"] == ROUNDS, command
        assert command["unanswered"] == command["unclear"] == command["open"] == 0, command
    print("decode beside a host: good")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
