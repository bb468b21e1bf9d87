"""A host that knows no virtual drives: finds its bus as python-can or pyserial would, and asks drive 1 how it is."""

import os
import sys
import time

PATIENCE_S = 30
QUERY = bytes([0x9A, 0, 0, 0, 0, 0, 0, 0])


def over_can() -> bool:
    import can

    with can.Bus() as bus:
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until:  # a drive that boots does not answer
            bus.send(can.Message(arbitration_id=0x141, data=QUERY, is_extended_id=False))
            reply = bus.recv(0.1)
            # Some buses give a host its own frames back.
            if reply and reply.arbitration_id == 0x141 and reply.data[0] == 0x9A and reply.data != QUERY:
                return True
    return False


def over_serial() -> bool:
    import serial

    with serial.serial_for_url(os.environ["LKEMU_CHANNEL"], 115200, timeout=0.1) as line:
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until:
            line.write(bytes.fromhex("3E9A0100D9"))
            if line.read(5)[:2] == bytes.fromhex("3E9A"):
                return True
    return False


answered = over_can() if os.environ.get("CAN_INTERFACE") else over_serial()
print("answered" if answered else "silent")
sys.exit(0 if answered else 3)
