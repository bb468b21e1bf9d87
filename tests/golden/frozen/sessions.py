"""Records a session: one host sends fixed queries over one transport in stepped time."""

from __future__ import annotations

import pathlib
import tempfile

from .hosts import transport
from .program import HERE, Problem, Program
from .values import frame_lines, renamed, text_of

CAN = ("slcan-tcp", "slcan-pty", "socketcand", "udp-multicast", "socketcan")
RS485 = ("rs485-pty", "rs485-tcp")
STEP_MS = 5  # time for each query and its reply


def can_frame(line: str) -> str:
    """Returns the frame for a line of can.session, in cansend's format."""
    if "#" in line:
        return line
    drive, *data = line.split()
    return f"{0x140 + int(drive):03X}#" + "".join(data).ljust(16, "0")


def rs485_packet(line: str) -> str:
    """Returns the bytes for a line of rs485.session, in hexadecimal."""
    drive, *words = line.split()
    if drive == "raw":
        return words[0]
    content = bytes.fromhex("".join(words))
    if drive == "02":
        return with_sum(b"\x02" + content).hex()
    command, data = content[:1], content[1:]
    header = with_sum(b"\x3e" + command + bytes([int(drive), len(data)]))
    return (header + (with_sum(data) if data else b"")).hex()


def with_sum(data: bytes) -> bytes:
    return data + bytes([sum(data) & 0xFF])


def script(name: str) -> list[str]:
    """Returns the lines of a .session file without comments."""
    lines = (line.split(" #")[0].strip() for line in (HERE / f"{name}.session").read_text("utf-8").splitlines())
    return [line for line in lines if line and not line.startswith("#")]


def record(command: str, name: str) -> dict[str, str]:
    """Returns the frames on the bus with their times, and the frames that the host received."""
    kind, bytes_of = ("rs485", rs485_packet) if name in RS485 else ("can", can_frame)
    with tempfile.TemporaryDirectory(prefix="freeze") as directory:
        folder = pathlib.Path(directory)
        bus, connect = transport(name, folder)
        with Program(command, folder, f"{kind}.toml", bus, "--record", str(folder / "recording")) as program:
            host = connect()
            try:
                for line in script(kind):
                    if line.startswith("+"):
                        program.advance(float(line[1:]))
                        continue
                    host.send(bytes_of(line))
                    program.wait_for_host()
                    program.advance(STEP_MS)
                sent = program.counters()["interface"]["sent"]
                program.wait(lambda: len(host.received()) >= sent, f"the host did not receive {sent} frames")
                received = host.received()
            finally:
                host.close()
        log = renamed((folder / "recording" / "frames.log").read_text("utf-8"), bus)
    if not received:
        raise Problem(f"{name}: no drive has answered")
    return {"frames": text_of(frame_lines(log)), "received": text_of(received)}
