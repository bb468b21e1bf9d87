#!/usr/bin/python3
"""A host written with python-can: what a user's first script does, against the real program.

usage: python_can_host.py LK_EMU   (where vcan0 is up, see scripts/with-vcan)
"""

import struct
import subprocess
import sys

import can

PATIENCE_S = 20.0


def ask(bus, motor, *data):
    bus.send(can.Message(arbitration_id=0x140 + motor, data=bytes(data).ljust(8, b"\0"), is_extended_id=False))
    reply = bus.recv(PATIENCE_S)
    assert reply is not None, f"motor {motor} does not answer {data[0]:#x}"
    assert reply.arbitration_id == 0x140 + motor and reply.data[0] == data[0], reply
    return bytes(reply.data)


def check_states(bus):
    for motor in range(1, 5):
        _, temperature, _, voltage, _, error = struct.unpack("<BbBHHB", ask(bus, motor, 0x9A))
        assert 0 < temperature < 60 and 200 < voltage < 280 and error == 0


def check_motion(bus):
    target = 18000  # 0.01 degree
    ask(bus, 2, 0xA3, 0, 0, 0, *struct.pack("<i", target))
    for _ in range(20000):
        reply = ask(bus, 2, 0x92)
        angle = int.from_bytes(reply[1:8], "little", signed=True)
        if abs(angle - target) <= 5:
            return
    raise AssertionError(f"motor 2 stands at {angle / 100} degrees instead of {target / 100}")


def main(program):
    emulator = subprocess.Popen([program, "--bus", "vcan0", "--ids", "1-4", "--rom", ":memory:"], stdout=subprocess.PIPE, text=True)
    try:
        assert emulator.stdout.readline() == "lk-emu ready vcan0:1-4\n"
        with can.Bus(interface="socketcan", channel="vcan0") as bus:
            check_states(bus)
            check_motion(bus)
    finally:
        emulator.terminate()
        emulator.communicate()
    assert emulator.returncode == 0
    print("python-can host: good")


if __name__ == "__main__":
    main(sys.argv[1])
