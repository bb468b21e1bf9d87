"""Handles Ctrl-C, and SIGTERM by which batch systems end jobs."""

from __future__ import annotations

import contextlib
import signal
from typing import Any, Iterator


class Interruption:
    """Raises KeyboardInterrupt at the first SIGINT or SIGTERM, but not while results are written."""

    def __init__(self) -> None:
        self._is_shielded = self._is_signalled = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._on_signal)

    def _on_signal(self, *_: Any) -> None:
        if self._is_signalled:
            return  # the first signal already ends the campaign
        self._is_signalled = True
        if not self._is_shielded:
            raise KeyboardInterrupt

    @contextlib.contextmanager
    def shielded(self) -> Iterator[None]:
        """Defers signals during the block. Raises KeyboardInterrupt at its end if one came."""
        before, self._is_shielded = self._is_signalled, True
        try:
            yield
        finally:
            self._is_shielded = False
        if self._is_signalled and not before:
            raise KeyboardInterrupt
