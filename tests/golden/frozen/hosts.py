"""A host for each transport of lk-emu, with the standard library alone."""

from __future__ import annotations

import os
import pathlib
import re
import select
import socket
import struct
import termios
import threading
import tty
from typing import Callable

Frame = tuple[int, bytes, bool, bool]  # identifier, data, extended, remote


def parse_frame(text: str) -> Frame:
    """Parses "142#9A", "142#R8" or "12345678#9A", as cansend does."""
    identifier, data = text.split("#")
    remote = data.startswith("R")
    content = bytes(int(data[1:] or "0")) if remote else bytes.fromhex(data)
    return int(identifier, 16), content, len(identifier) > 3, remote


def frame_text(identifier: int, data: bytes, extended: bool = False) -> str:
    return f"{identifier:08X}#{data.hex().upper()}" if extended else f"{identifier:03X}#{data.hex().upper()}"


def free_port(kind: socket.SocketKind = socket.SOCK_STREAM) -> int:
    with socket.socket(socket.AF_INET, kind) as sock:
        sock.bind(("127.0.0.1", 0))
        return int(sock.getsockname()[1])


def connected(port: int) -> int:
    with socket.create_connection(("127.0.0.1", port), timeout=10) as sock:
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.setblocking(True)
        return sock.detach()


def opened(path: pathlib.Path) -> int:
    """Opens a terminal in raw mode at 1 Mbit/s."""
    terminal = os.open(path, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(terminal)
    settings = termios.tcgetattr(terminal)
    settings[4] = settings[5] = termios.B1000000
    termios.tcsetattr(terminal, termios.TCSANOW, settings)
    return terminal


class Host:
    """Base class: a thread reads from the descriptor until close()."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._bytes = b""
        self._arrived = threading.Condition()
        self._ending = False
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def close(self) -> None:
        self._ending = True
        self._reader.join()
        os.close(self._descriptor)

    def received(self) -> list[str]:
        """Returns the frames (RS-485: packets) from drives so far, as text."""
        raise NotImplementedError

    def send(self, what: str) -> None:
        raise NotImplementedError

    def _write(self, data: bytes) -> None:
        while data:
            data = data[os.write(self._descriptor, data):]

    def _say(self, data: bytes, answer: bytes) -> None:
        """Writes `data` and waits for one more `answer`."""
        before = self._bytes.count(answer)
        self._write(data)
        with self._arrived:
            if not self._arrived.wait_for(lambda: self._bytes.count(answer) > before, 10):
                raise OSError(f"no {answer!r} after {data!r}")

    def _take(self) -> bytes:
        return os.read(self._descriptor, 65536)

    def _read(self) -> None:
        while not self._ending:
            if not select.select([self._descriptor], [], [], 0.05)[0]:
                continue
            try:
                data = self._take()
            except OSError:
                return
            if not data:
                return
            with self._arrived:
                self._bytes += data
                self._arrived.notify_all()


class SlcanHost(Host):
    def __init__(self, descriptor: int) -> None:
        super().__init__(descriptor)
        self._say(b"V\r", b"V1013\r")
        self._write(b"S8\rO\r")
        self._say(b"V\r", b"V1013\r")

    def send(self, what: str) -> None:
        identifier, data, extended, remote = parse_frame(what)
        letter = ("R" if extended else "r") if remote else ("T" if extended else "t")
        digits = f"{identifier:08X}" if extended else f"{identifier:03X}"
        line = f"{letter}{digits}{len(data)}" + ("" if remote else data.hex().upper())
        self._say(line.encode() + b"\r", b"Z\r" if extended else b"z\r")

    def received(self) -> list[str]:
        found = re.findall(rb"t([0-9A-F]{3})\d([0-9A-F]*)\r", self._bytes)
        return [f"{identifier.decode()}#{data.decode()}" for identifier, data in found]


class SocketcandHost(Host):
    def __init__(self, descriptor: int) -> None:
        super().__init__(descriptor)
        self._say(b"< open can0 >", b"< ok >")
        self._say(b"< rawmode >", b"< ok >")

    def send(self, what: str) -> None:
        identifier, data, extended, remote = parse_frame(what)
        digits = f"{identifier:08X}" if extended else f"{identifier:03X}"
        bytes_text = "" if remote else "".join(f" {byte:02X}" for byte in data)
        self._write(f"< {'sendrtr' if remote else 'send'} {digits} {len(data)}{bytes_text} >".encode())

    def received(self) -> list[str]:
        found = re.findall(rb"< frame ([0-9A-F]+) \S+ ([0-9A-F ]*)>", self._bytes)
        return [frame_text(int(identifier, 16), bytes.fromhex(data.decode())) for identifier, data in found]


class MulticastHost(Host):
    """Sends and receives datagrams of python-can's udp_multicast, which are maps in MessagePack."""

    GROUP = "239.74.163.2"

    def __init__(self, port: int) -> None:
        self._messages: list[str] = []
        self._sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        self._sender.bind(("", 0))
        self._sender.connect((self.GROUP, port))
        self._receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._receiver.bind((self.GROUP, port))
        self._receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP,
                                  socket.inet_aton(self.GROUP) + socket.inet_aton("0.0.0.0"))
        super().__init__(os.dup(self._receiver.fileno()))

    def close(self) -> None:
        super().close()
        self._sender.close()
        self._receiver.close()

    def send(self, what: str) -> None:
        identifier, data, extended, remote = parse_frame(what)
        flag = {False: b"\xc2", True: b"\xc3"}
        members = [("timestamp", b"\xcb" + struct.pack(">d", 0.0)),
                   ("arbitration_id", b"\xce" + struct.pack(">I", identifier)),
                   ("is_extended_id", flag[extended]), ("is_remote_frame", flag[remote]),
                   ("is_error_frame", flag[False]), ("channel", b"\xc0"), ("dlc", bytes([len(data)])),
                   ("data", b"\xc4\x00" if remote else b"\xc4" + bytes([len(data)]) + data), ("is_fd", flag[False]),
                   ("bitrate_switch", flag[False]), ("error_state_indicator", flag[False])]
        self._sender.send(bytes([0x80 | len(members)]) + b"".join(
            bytes([0xA0 | len(name)]) + name.encode() + value for name, value in members))

    def received(self) -> list[str]:
        return self._messages

    def _take(self) -> bytes:
        data, sender = self._receiver.recvfrom(65536)
        if sender[1] != self._sender.getsockname()[1]:  # skips the host's own datagrams
            self._messages.append(frame_text(number_after(data, b"arbitration_id"), bytes_after(data, b"\xa4data\xc4")))
        return data


def number_after(data: bytes, name: bytes) -> int:
    at = data.index(name) + len(name)
    size = {0xCC: 1, 0xCD: 2, 0xCE: 4}.get(data[at])
    return data[at] if size is None else int.from_bytes(data[at + 1:at + 1 + size], "big")


def bytes_after(data: bytes, name: bytes) -> bytes:
    at = data.index(name) + len(name)
    return data[at + 1:at + 1 + data[at]]


class SocketcanHost(Host):
    FRAME = struct.Struct("=IB3x8s")

    def __init__(self, interface: str) -> None:
        self._messages: list[str] = []
        with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as sock:
            sock.bind((interface,))
            super().__init__(sock.detach())

    def send(self, what: str) -> None:
        identifier, data, extended, remote = parse_frame(what)
        flags = (socket.CAN_EFF_FLAG if extended else 0) | (socket.CAN_RTR_FLAG if remote else 0)
        self._write(self.FRAME.pack(identifier | flags, len(data), data))

    def received(self) -> list[str]:
        return self._messages

    def _take(self) -> bytes:
        data = os.read(self._descriptor, self.FRAME.size)
        identifier, length, content = self.FRAME.unpack(data)
        self._messages.append(frame_text(identifier, content[:length]))
        return data


class SerialHost(Host):
    """RS-485: sends bytes and splits received bytes into complete packets."""

    def send(self, what: str) -> None:
        self._write(bytes.fromhex(what))

    def received(self) -> list[str]:
        rest, packets = self._bytes, []
        while len(rest) >= 5:
            size = 5 + (rest[3] + 1 if rest[3] else 0)
            if len(rest) < size:
                break
            packets.append(rest[:size].hex().upper())
            rest = rest[size:]
        return packets


def transport(name: str, folder: pathlib.Path) -> tuple[str, Callable[[], Host]]:
    """Returns the argument of --bus, and a function that opens a host on the served bus."""
    path = folder / "terminal"
    if name == "slcan-pty":
        return f"slcan-pty:{path}", lambda: SlcanHost(opened(path))
    if name == "rs485-pty":
        return f"rs485:{path}", lambda: SerialHost(opened(path))
    if name == "socketcan":
        return "vcan0", lambda: SocketcanHost("vcan0")
    port = free_port(socket.SOCK_DGRAM if name == "udp-multicast" else socket.SOCK_STREAM)
    if name == "udp-multicast":
        return f"udp-multicast:{MulticastHost.GROUP}:{port}", lambda: MulticastHost(port)
    kinds = {"slcan-tcp": SlcanHost, "socketcand": SocketcandHost, "rs485-tcp": SerialHost}
    return f"{name}:{port}", lambda: kinds[name](connected(port))
