"""HTTP over the Unix socket of a running lk-emu."""

from __future__ import annotations

import http.client
import json
import select
import socket
import threading
from typing import Any, Callable, Optional

from .errors import Error, Refused

BASE = "/api/v1"


class UnixConnection(http.client.HTTPConnection):
    """An HTTP connection to a Unix socket path instead of a host."""

    def __init__(self, path: str, timeout_s: float) -> None:
        super().__init__("localhost", timeout=timeout_s)
        self._path = path

    def connect(self) -> None:
        self.sock = open_socket(self._path, self.timeout)

    def was_closed(self) -> bool:
        """Returns whether the other side has closed the connection since the last answer."""
        return self.sock is not None and bool(select.select([self.sock], [], [], 0)[0])


def open_socket(path: str, timeout_s: Optional[float]) -> socket.socket:
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        sock.settimeout(timeout_s)
        sock.connect(path)
    except OSError:
        sock.close()
        raise
    return sock


def refusal(status: int, path: str, body: bytes) -> Refused:
    """Parses {"error": {"where": …, "reason": …}}; other bodies become the reason."""
    try:
        error = json.loads(body)["error"]
        return Refused(str(error.get("where") or ""), str(error["reason"]), status)
    except (ValueError, KeyError, TypeError, AttributeError):
        text = body.decode(errors="replace").strip().splitlines()
        return Refused(path, f"HTTP {status}" + (f", {text[0]}" if text else ""), status)


class Client:
    """Sends requests and returns JSON answers; threads may share it, requests are serialised."""

    def __init__(self, path: str, timeout_s: float, gone: Callable[[str], Exception]) -> None:
        self.path = path
        self.timeout_s = timeout_s
        self._gone = gone  # makes the exception for a server that has ended
        self._connection: Optional[UnixConnection] = None
        self._lock = threading.Lock()

    def get(self, path: str) -> Any:
        return self.request("GET", path)

    def post(self, path: str, body: Any, timeout_s: Optional[float] = None) -> Any:
        return self.request("POST", path, body, timeout_s)

    def request(self, method: str, path: str, body: Any = None, timeout_s: Optional[float] = None) -> Any:
        """Returns the answer's JSON. Never sends a request twice. Raises Refused, Ended or Error."""
        limit_s = self.timeout_s if timeout_s is None else timeout_s
        what = f"{method} {path}"
        with self._lock:
            try:
                status, answer = self._exchange(method, path, body, limit_s)
            except socket.timeout:
                self._hang_up()
                raise Error(f"{what}: lk-emu did not answer within {limit_s:g} s") from None
            except (OSError, http.client.HTTPException) as problem:
                self._hang_up()
                raise self._gone(f"{what}: {problem}") from None
            except BaseException:
                self._hang_up()  # an unread answer must not be taken for the next one's
                raise
        if not 200 <= status < 300:
            raise refusal(status, path, answer)
        try:
            return json.loads(answer) if answer else None
        except ValueError:
            raise Error(f"{what}: the answer is not JSON: {answer[:80]!r}") from None

    def close(self) -> None:
        with self._lock:
            self._hang_up()

    def _exchange(self, method: str, path: str, body: Any, limit_s: float) -> "tuple[int, bytes]":
        if self._connection is not None and self._connection.was_closed():
            self._hang_up()
        if self._connection is None:
            self._connection = UnixConnection(self.path, limit_s)
        connection = self._connection
        connection.timeout = limit_s
        if connection.sock is not None:
            connection.sock.settimeout(limit_s)
        headers = {"Content-Type": "application/json"} if body is not None else {}
        connection.request(method, BASE + path, None if body is None else json.dumps(body), headers)
        response = connection.getresponse()
        return response.status, response.read()

    def _hang_up(self) -> None:
        if self._connection is not None:
            self._connection.close()
            self._connection = None
