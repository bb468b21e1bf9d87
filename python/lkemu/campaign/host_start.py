"""Starts the host of a case: a program, or a function in a child of a long-lived process (host_functions.py)."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
from typing import Any, Dict, List, Mapping

from ..errors import StartError
from .host_processes import end_with_parent

KB = 1024  # bytes, the unit of ru_maxrss


class ProgramHost:
    """A process in a session of its own. Its file descriptor becomes readable when it exits."""

    def __init__(self, command: List[str], directory: str, environment: Mapping[str, str], out: int) -> None:
        inherited = {name: value for name, value in os.environ.items() if name != "LKEMU_CONTROL"}
        try:
            self._process = subprocess.Popen(command, cwd=directory, env={**inherited, **environment}, stdin=subprocess.DEVNULL, stdout=out,
                                             stderr=out, start_new_session=True, preexec_fn=end_with_parent)  # fmt: skip
        except OSError as problem:
            raise StartError(f"host: command: {command[0]} cannot be started: {problem.strerror}") from None
        self._ended = os.pidfd_open(self._process.pid)

    def fileno(self) -> int:
        return self._ended

    def finish(self) -> "tuple[int, int]":
        """Returns the status as of waitpid(), and the peak memory in bytes."""
        _, status, usage = os.wait4(self._process.pid, 0)
        self._process.returncode = os.waitstatus_to_exitcode(status)
        return status, usage.ru_maxrss * KB

    def reap(self) -> None:
        """Empty: end_descendants() has reaped the process."""

    def __del__(self) -> None:
        os.close(self._ended)


class FunctionProcess:
    """A process that loads the module of `host.python` and forks a child for each case. Raises StartError."""

    def __init__(self, python: str, directory: str) -> None:
        self._socket, theirs = socket.socketpair()
        with theirs:
            # A fixed hash seed gives sets of words the same order in all processes.
            environment = {**os.environ, "PYTHONHASHSEED": "0", "PYTHONUNBUFFERED": "1"}
            self._process = subprocess.Popen([sys.executable, "-m", "lkemu.campaign.host_functions", str(theirs.fileno()), python],
                                             cwd=directory, env=environment, pass_fds=[theirs.fileno()], stdin=subprocess.DEVNULL,
                                             stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
                                             preexec_fn=end_with_parent)  # fmt: skip
        self.pid = self._process.pid
        try:
            problem = self._receive()["problem"]
        except EOFError:
            problem = f"{python}: the process that loads it ended with status {self._process.wait()}"
        if problem:
            raise StartError(f"host.python: {problem}")

    @property
    def is_alive(self) -> bool:
        return self._process.poll() is None

    def start(self, environment: Mapping[str, str], settings: Mapping[str, Any], out: int) -> "FunctionHost":
        task = {"environment": dict(environment), "settings": dict(settings)}
        socket.send_fds(self._socket, [json.dumps(task).encode() + b"\n"], [out])
        return FunctionHost(self)

    def _receive(self) -> Dict[str, Any]:
        line = b""
        while not line.endswith(b"\n"):
            data = self._socket.recv(4096)
            if not data:
                raise EOFError
            line += data
        return dict(json.loads(line))

    def fileno(self) -> int:
        return self._socket.fileno()

    def receive_end(self) -> "tuple[int, int]":
        ended = self._receive()
        return int(ended["status"]), int(ended["memory_kB"]) * KB


class FunctionHost:
    """A case in a child of a FunctionProcess. Its file descriptor becomes readable when the child exits."""

    def __init__(self, process: FunctionProcess) -> None:
        self._process = process
        self._is_finished = False

    def fileno(self) -> int:
        return self._process.fileno()

    def finish(self) -> "tuple[int, int]":
        """Returns the status as of waitpid(), and the peak memory in bytes.

        Raises EOFError if the FunctionProcess has exited.
        """
        self._is_finished = True
        return self._process.receive_end()

    def reap(self) -> None:
        """Removes the status of a killed child, which would count as that of the next case."""
        if not self._is_finished:
            self.finish()
