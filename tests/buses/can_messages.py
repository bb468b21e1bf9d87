"""Builds python-can messages for tests and formats them as text."""

import can


def message(motor: int, *data: int) -> can.Message:
    return can.Message(arbitration_id=0x140 + motor, data=bytes(data).ljust(8, b"\0"),
                       is_extended_id=False)


def text(frame: can.Message) -> str:
    return f"{frame.arbitration_id:03X}#{bytes(frame.data).hex().upper()}"
