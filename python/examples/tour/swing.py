"""Swings a motor to 90 degrees and back. It has a bug, which docs/start/tour.md finds: it assumes that the motor always
reaches its target.
"""

import struct
import time

import can

MOVE, SPEED_DPS = 0xA4, 90


def move(bus, target_deg):
    data = struct.pack("<BxHi", MOVE, SPEED_DPS, target_deg * 100)
    bus.send(can.Message(arbitration_id=0x141, data=data, is_extended_id=False))
    time.sleep(90 / SPEED_DPS + 1)
    print(f"at {target_deg} degrees", flush=True)


with can.Bus(interface="socketcan", channel="vcan0") as vcan0:
    move(vcan0, 90)
    move(vcan0, 0)
