"""One process at a time writes a file of results."""

from __future__ import annotations

import errno
import fcntl
import os
import pathlib
import struct
import sys

BYTE = 1 << 62  # beyond what SQLite locks
HELD = (errno.EAGAIN, errno.EACCES)


class WriterLock:
    """Held until `close` or the end of the process, however it ends. Waits while another process holds it.

    A lock of the open file: SQLite's own, which are of the process, neither conflict with it nor end it."""

    def __init__(self, path: pathlib.Path) -> None:
        self._file = os.open(path, os.O_RDWR | os.O_CLOEXEC)
        try:
            self._lock(fcntl.F_OFD_SETLK)
        except OSError as problem:
            if problem.errno not in HELD:
                return  # a file system without locks
            print(f"lk-emu: {path}: another process writes it; waiting for its end", file=sys.stderr)
            self._lock(fcntl.F_OFD_SETLKW)

    def _lock(self, how: int) -> None:
        fcntl.fcntl(self._file, how, struct.pack("hhqqi", fcntl.F_WRLCK, os.SEEK_SET, BYTE, 1, 0))

    def close(self) -> None:
        os.close(self._file)
