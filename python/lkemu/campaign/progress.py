"""Shows progress on one line of the terminal."""

from __future__ import annotations

import sys
import time

STEP_S = 0.5


class Progress:
    def __init__(self, cases: int, before: int, shown: bool) -> None:
        """`cases`: number in the shard, including excluded ones; `before`: number that already has results."""
        self._cases, self._before, self._shown = cases, before, shown
        self._began = self._last = time.monotonic()

    def show(self, done: int) -> None:
        now = time.monotonic()
        if not self._shown or now - self._last < STEP_S:
            return
        self._last = now
        rate = done / (now - self._began)
        left_s = (self._cases - self._before - done) / rate if rate > 0 else 0
        print(f"\r{self._before + done} of {self._cases} cases, {rate:.3g}/s, {left_s:.0f} s left \033[K", end="", file=sys.stderr, flush=True)

    def end(self) -> None:
        if self._shown:
            print("\r\033[K", end="", file=sys.stderr, flush=True)
