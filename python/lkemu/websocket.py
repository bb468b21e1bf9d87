"""The part of RFC 6455 for a client that receives text over a Unix socket."""

from __future__ import annotations

import base64
import hashlib
import os
import struct
from typing import Optional, Tuple

from .client import open_socket, refusal
from .errors import Error

GUID = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"
MOST_BYTES = 16 * 1024 * 1024  # of a message; a longer one is an error
CONTINUATION, TEXT, BINARY, CLOSE, PING, PONG = 0x0, 0x1, 0x2, 0x8, 0x9, 0xA


class WebSocket:
    """`receive()` returns one text at a time, and None once the server has closed."""

    def __init__(self, path: str, target: str, timeout_s: float) -> None:
        self._pending = b""  # received bytes of incomplete frames
        self._message = b""  # received fragments of an incomplete message
        self._sock = open_socket(path, timeout_s)
        try:
            self._handshake(target)
        except BaseException:
            self._sock.close()
            raise

    def receive(self) -> Optional[str]:
        """Returns the next text. Raises socket.timeout at the time limit, without losing data."""
        while True:
            try:
                final, kind, payload = self._frame()
            except (EOFError, ConnectionError):
                return None
            if kind == CLOSE:
                self._try_send(CLOSE, payload[:2])
                return None
            if kind == PING:
                self._try_send(PONG, payload)
            elif kind in (TEXT, BINARY, CONTINUATION):
                self._message += payload
                if len(self._message) > MOST_BYTES:
                    raise Error("telemetry: a message of more than 16 MB")
                if final:
                    message, self._message = self._message, b""
                    return message.decode()

    def close(self) -> None:
        self._try_send(CLOSE, struct.pack("!H", 1000))
        self._sock.close()

    def _handshake(self, target: str) -> None:
        key = base64.b64encode(os.urandom(16)).decode()
        self._sock.sendall(
            f"GET {target} HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
        )
        try:
            head = self._until(b"\r\n\r\n").decode("latin-1").split("\r\n")
        except EOFError:
            raise ConnectionError("the connection was closed during the handshake") from None
        status = int(head[0].split()[1]) if len(head[0].split()) > 1 and head[0].split()[1].isdigit() else 0
        fields = {name.strip().lower(): value.strip() for name, _, value in (line.partition(":") for line in head[1:])}
        if status != 101:
            length = fields.get("content-length", "0")
            body = self._exactly(min(int(length), MOST_BYTES)) if length.isdigit() else b""
            raise refusal(status, target, body)
        accept = base64.b64encode(hashlib.sha1((key + GUID).encode()).digest()).decode()
        if fields.get("sec-websocket-accept") != accept:
            raise Error("telemetry: the other side does not speak WebSocket")

    def _frame(self) -> Tuple[bool, int, bytes]:
        """Returns a frame once it is complete."""
        self._fill(2)
        first, second = self._pending[:2]
        length, begin = second & 0x7F, 2
        if length >= 126:
            form = "!H" if length == 126 else "!Q"
            begin += struct.calcsize(form)
            self._fill(begin)
            (length,) = struct.unpack(form, self._pending[2:begin])
        if length > MOST_BYTES:
            raise Error("telemetry: a frame of more than 16 MB")
        if second & 0x80:
            raise Error("telemetry: a masked frame, which no server sends")
        return bool(first & 0x80), first & 0x0F, self._exactly(begin + length)[begin:]

    def _try_send(self, kind: int, payload: bytes) -> None:
        """Sends a control frame; ignores a closed connection."""
        mask = os.urandom(4)
        try:
            self._sock.sendall(bytes([0x80 | kind, 0x80 | len(payload)]) + mask + masked(payload, mask))
        except OSError:
            pass

    def _fill(self, enough: int) -> None:
        while len(self._pending) < enough:
            data = self._sock.recv(65536)
            if not data:
                raise EOFError
            self._pending += data

    def _exactly(self, count: int) -> bytes:
        self._fill(count)
        data, self._pending = self._pending[:count], self._pending[count:]
        return data

    def _until(self, end: bytes) -> bytes:
        while end not in self._pending:
            self._fill(len(self._pending) + 1)
        data, self._pending = self._pending.split(end, 1)
        return data


def masked(payload: bytes, mask: bytes) -> bytes:
    return bytes(byte ^ mask[n % 4] for n, byte in enumerate(payload))
