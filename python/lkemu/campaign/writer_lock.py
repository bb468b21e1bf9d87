"""Lets only one process at a time write a results file."""

from __future__ import annotations

import errno
import fcntl
import os
import pathlib
import struct
import sys

BYTE = 1 << 62  # beyond the bytes that SQLite locks
HELD = (errno.EAGAIN, errno.EACCES)


class WriterLock:
    """Waits until no other process holds the lock. Holds it until `close` or the end of the process.

    The lock belongs to the open file description. SQLite's locks belong to the process, so neither kind affects the
    other.
    """

    def __init__(self, path: pathlib.Path) -> None:
        self._file = os.open(path, os.O_RDWR | os.O_CLOEXEC)
        try:
            self._lock(fcntl.F_OFD_SETLK)
        except OSError as problem:
            if problem.errno not in HELD:
                return  # the file system does not support locks
            print(f"lk-emu: {path}: another process writes it; waiting for its end", file=sys.stderr)
            self._lock(fcntl.F_OFD_SETLKW)

    def _lock(self, how: int) -> None:
        fcntl.fcntl(self._file, how, struct.pack("hhqqi", fcntl.F_WRLCK, os.SEEK_SET, BYTE, 1, 0))

    def close(self) -> None:
        os.close(self._file)
