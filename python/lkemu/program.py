"""Finds lk-emu and runs it as a process."""

from __future__ import annotations

import os
import shutil
import subprocess
import threading
import weakref
from typing import IO, Optional, Sequence

from .errors import StartError

STOP_TIMEOUT_S = 10.0  # assumed; lk-emu writes its ROM to disk before it ends
BUILDS = ("release", "dev", "")  # directories below build/


def find_program(given: Optional[str] = None) -> str:
    """Returns the first that exists: `given`, $LKEMU, the program of our build or installation, the one in PATH."""
    for source, path in (("program", given), ("LKEMU", os.environ.get("LKEMU"))):
        if path:
            found = shutil.which(os.path.expanduser(path))
            if found is None:
                raise StartError(f"{source}: there is no program {path}")
            return os.path.abspath(found)
    root = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
    near = [os.path.join(root, "build", build, "emulator", "lk-emu") for build in BUILDS]
    # Relative to share/lk-emu/python/lkemu, or to lib/python3.N/site-packages/lkemu of a wheel with the program.
    near.append(os.path.join(root, "..", "..", "bin", "lk-emu"))
    for path in near:
        if os.access(path, os.X_OK) and os.path.isfile(path):
            return os.path.normpath(path)
    found = shutil.which("lk-emu")
    if found is None:
        raise StartError("lk-emu is not in PATH: install it, set LKEMU to where it is, or say program=…")
    return os.path.abspath(found)


class Process:
    """A process of lk-emu; standard output and error go to files."""

    def __init__(self, command: Sequence[str], directory: str, keep_open: Sequence[int] = ()) -> None:
        self.out_path = os.path.join(directory, "lk-emu.out")
        self.err_path = os.path.join(directory, "lk-emu.err")
        self.ready_line: Optional[str] = None
        self._ready_or_ended = threading.Event()
        with open(self.err_path, "wb") as err:
            try:
                # lk-emu watches the pipe, which the kernel closes when this process is killed.
                self._popen = subprocess.Popen(
                    [*command, "--end-with-stdin"],
                    stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=err, pass_fds=keep_open,
                )  # fmt: skip
            except OSError as problem:
                raise StartError(f"{command[0]}: {problem.strerror}") from None
        # A forked child that outlives this process must not hold the pipe open.
        pipe = weakref.ref(self._popen.stdin)
        os.register_at_fork(after_in_child=lambda: close(pipe()))
        # Ends lk-emu at exit, even if the caller did not.
        self._last_resort = weakref.finalize(self, end, self._popen)
        assert self._popen.stdout is not None
        self._reader = threading.Thread(
            target=self._read, args=(self._popen.stdout, open(self.out_path, "wb")), daemon=True
        )
        self._reader.start()

    def wait_ready(self, limit_s: float) -> str:
        """Returns the line that lk-emu prints when its drives can answer. Raises StartError."""
        self._ready_or_ended.wait(limit_s)
        if self.ready_line is not None:
            return self.ready_line
        ended = self._ready_or_ended.is_set()
        status = self.stop()
        said = [line for line in self.err().splitlines() if line.strip()]
        last = said[-1].replace("lk-emu: ", "", 1) if said else f"status {status}, and it said nothing"
        raise StartError(("lk-emu: " if ended else f"lk-emu was not ready within {limit_s:g} s: ") + last)

    @property
    def pid(self) -> int:
        return self._popen.pid

    @property
    def status(self) -> Optional[int]:
        """Exit status; -N if signal N killed the process; None while it runs."""
        return self._popen.poll()

    def ended_within(self, limit_s: float) -> bool:
        try:
            self._popen.wait(limit_s)
        except subprocess.TimeoutExpired:
            return False
        return True

    def stop(self) -> int:
        """Sends SIGTERM, then SIGKILL if needed; returns the exit status."""
        status = end(self._popen)
        self._last_resort.detach()
        self._reader.join(STOP_TIMEOUT_S)
        return status

    def out(self) -> str:
        return read(self.out_path)

    def err(self) -> str:
        return read(self.err_path)

    def _read(self, stdout: IO[bytes], file: IO[bytes]) -> None:
        with stdout, file:
            for line in stdout:
                file.write(line)
                file.flush()
                if self.ready_line is None and line.startswith(b"lk-emu ready "):
                    self.ready_line = line.decode(errors="replace").strip()
                    self._ready_or_ended.set()
        self._ready_or_ended.set()


def end(popen: "subprocess.Popen[bytes]") -> int:
    if popen.poll() is None:
        popen.terminate()
        try:
            popen.wait(STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            popen.kill()
    close(popen.stdin)
    return popen.wait()


def close(pipe: Optional[IO[bytes]]) -> None:
    if pipe is not None:
        pipe.close()


def read(path: str) -> str:
    try:
        with open(path, encoding="utf-8", errors="replace") as file:
            return file.read()
    except OSError:
        return ""
