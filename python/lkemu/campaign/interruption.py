"""Ctrl-C, and SIGTERM, with which batch systems end their jobs."""

from __future__ import annotations

import contextlib
import signal
from typing import Any, Iterator


class Interruption:
    """SIGINT and SIGTERM raise KeyboardInterrupt once, but never while results are written."""

    def __init__(self) -> None:
        self._is_shielded = self._has_come = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._come)

    def _come(self, *_: Any) -> None:
        if self._has_come:
            return  # the campaign is ending already
        self._has_come = True
        if not self._is_shielded:
            raise KeyboardInterrupt

    @contextlib.contextmanager
    def shielded(self) -> Iterator[None]:
        """Raises KeyboardInterrupt at its end if a signal came meanwhile."""
        before, self._is_shielded = self._has_come, True
        try:
            yield
        finally:
            self._is_shielded = False
        if self._has_come and not before:
            raise KeyboardInterrupt
