"""Starts lk-emu with a stepped clock and controls it over HTTP."""

from __future__ import annotations

import base64
import http.client
import json
import os
import pathlib
import socket
import subprocess
import sys
import time
from typing import Any

HERE = pathlib.Path(__file__).resolve().parent
START_S = 20.0  # generous, for busy machines
STOP_S = 20.0


class Problem(Exception):
    """Reason why an item cannot be recorded, one line."""


class Control(http.client.HTTPConnection):
    """HTTP over a Unix socket."""

    def __init__(self, path: pathlib.Path) -> None:
        super().__init__("localhost", timeout=60)
        self._path = path

    def connect(self) -> None:
        self.sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.sock.settimeout(self.timeout)
        self.sock.connect(str(self._path))


class Program:
    """An lk-emu that serves `bus` with the drives of `config` and writes to `folder` only."""

    def __init__(self, command: str, folder: pathlib.Path, config: str, bus: str, *more: str) -> None:
        self.bus = bus
        self.folder = folder
        self._socket = folder / "control"
        self._errors = (folder / "errors.txt").open("wb")
        self._control = Control(self._socket)
        arguments = ["--config", str(HERE / config), "--bus", bus, "--control", str(self._socket)]
        arguments += ["--rom", ":memory:", "--clock", "stepped", *more]
        self._process = subprocess.Popen([command, *arguments], cwd=folder, env=environment(folder),
                                         stdin=subprocess.DEVNULL, stdout=self._errors, stderr=self._errors)
        try:
            self._wait_until_up()
        except BaseException:
            self.stop()
            raise

    def __enter__(self) -> Program:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def stop(self) -> None:
        """Post: the recording is complete on disk."""
        self._control.close()
        self._process.terminate()
        try:
            self._process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._errors.close()

    def ask(self, method: str, path: str, body: Any = None) -> tuple[int, Any]:
        """Returns status and JSON; for an answer without JSON, its content type."""
        headers = {} if body is None else {"Content-Type": "application/json"}
        text = body if body is None or isinstance(body, str) else json.dumps(body)
        self._control.request(method, "/api/v1" + path, text, headers)
        response = self._control.getresponse()
        data = response.read()
        if response.getheader("Content-Type", "").startswith("application/json"):
            return response.status, json.loads(data)
        return response.status, response.getheader("Content-Type", "")

    def asked(self, method: str, path: str, body: Any = None) -> Any:
        """Returns the JSON; raises Problem unless the status is 200."""
        status, answer = self.ask(method, path, body)
        if status != 200:
            raise Problem(f"{method} {path}: status {status}")
        return answer

    def advance(self, ms: float) -> None:
        self.asked("POST", "/clock/advance", {"by_s": ms / 1000})

    def counters(self) -> dict[str, Any]:
        return self.asked("GET", "/status")["buses"][0]["counters"]

    def wait_for_host(self) -> None:
        """Waits until the program has read the frame that a host has sent."""
        self.wait(lambda: self.counters()["waiting_for_time"] > 0, "a host's frame does not arrive")

    def wait(self, done: Any, problem: str, limit_s: float = 10) -> None:
        end = time.monotonic() + limit_s
        while not done():
            if time.monotonic() > end or self._process.poll() is not None:
                raise Problem(f"{self.bus}: {problem}")
            time.sleep(0.002)

    def listen(self, path: str) -> WebSocket:
        return WebSocket(self._socket, "/api/v1" + path)

    def _wait_until_up(self) -> None:
        def up() -> bool:
            try:
                return bool(self.asked("GET", "/status")["buses"][0]["up"])
            except OSError:
                self._control.close()
                return False

        try:
            self.wait(up, "does not start", START_S)
        except Problem as problem:
            self._errors.flush()
            said = (self.folder / "errors.txt").read_text("utf-8", "replace").strip().splitlines()
            raise Problem(said[-1] if said else str(problem)) from None


class WebSocket:
    """Receives unfragmented JSON messages from the server."""

    def __init__(self, path: pathlib.Path, target: str) -> None:
        self._sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._sock.settimeout(10)
        self._sock.connect(str(path))
        self._file = self._sock.makefile("rb")
        key = base64.b64encode(bytes(16)).decode()
        self._sock.sendall(f"GET {target} HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                           f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n\r\n".encode())
        status = self._file.readline()
        if b" 101 " not in status:
            raise Problem(f"GET {target}: {status.decode().strip()}")
        while self._file.readline().strip():
            pass

    def receive(self) -> Any:
        while True:
            kind, length = self._file.read(2)
            if length >= 126:
                length = int.from_bytes(self._file.read(2 if length == 126 else 8), "big")
            data = self._file.read(length)
            if kind & 0x0F == 1:
                return json.loads(data)

    def close(self) -> None:
        self._file.close()
        self._sock.close()


def environment(folder: pathlib.Path) -> dict[str, str]:
    """Returns the caller's environment with `folder` as home, so that no ROM, socket or setting of the user is used.
    Commands in Python run with the Python of this program, even if PATH begins with another one."""
    path = f"{os.path.dirname(sys.executable)}{os.pathsep}{os.environ.get('PATH', os.defpath)}"
    return {**os.environ, "PATH": path, "HOME": str(folder), "XDG_RUNTIME_DIR": str(folder), "XDG_STATE_HOME": str(folder),
            "XDG_CONFIG_HOME": str(folder), "XDG_DATA_HOME": str(folder), "TMPDIR": str(folder)}


def run(command: list[str], folder: pathlib.Path, statuses: tuple[int, ...] = (0,), given: str | None = None) -> Any:
    """Runs the command until it ends; raises Problem unless its status is in `statuses`."""
    source: dict[str, Any] = {"stdin": subprocess.DEVNULL} if given is None else {"input": given}
    done = subprocess.run(command, cwd=folder, env=environment(folder), capture_output=True, encoding="utf-8",
                          timeout=300, check=False, **source)
    if done.returncode not in statuses:
        said = (done.stderr.strip() or "no message").splitlines()
        raise Problem(f"{pathlib.Path(command[0]).name} {command[1]}: status {done.returncode}: {said[-1][:200]}")
    return done
