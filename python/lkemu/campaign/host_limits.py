"""Limits of a host program: time, memory and output."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from typing import Any, Dict, List, Optional

from .host_output import Output
from .host_processes import Usage, descendants, usage_of
from .host_relay import Relay

SAMPLE_S = 0.25  # sampling period
IDLE_SHARE = 0.1  # of one processor; a stepped host that uses less is idle
IDLE_FACTOR = 3.0  # longest idle time, as a multiple of timeout_s
MB = 1_000_000


@dataclass(frozen=True)
class Exceeded:
    kind: str  # "timeout" or "limit"
    why: str  # the same text on fast and slow machines


class Limits:
    """Checks a running host against the limits of the plan.

    With a real-time clock, `timeout_s` limits real time. With a stepped clock it limits simulated time and processor
    time separately: neither depends on the load of the machine. A stepped host is idle if it waits for something else
    than the clock; IDLE_FACTOR limits this time.
    """

    def __init__(
        self, task: Dict[str, Any], output: Output, relay: Optional[Relay], emulator: int, excluded: List[int]
    ) -> None:
        self._task, self._output, self._relay, self._emulator, self._excluded = task, output, relay, emulator, excluded
        self._began = self._sampled = time.monotonic()
        self._before = Usage()
        self._requests = 0
        self._idle_s = 0.0

    @property
    def until_next_sample_s(self) -> float:
        return max(0.0, self._sampled + SAMPLE_S - time.monotonic())

    @property
    def was_idle(self) -> bool:
        """True if a stepped host was idle at the latest sample."""
        return self._idle_s > 0

    def check(self) -> Optional[Exceeded]:
        task = self._task
        if self._output.bytes > task["output_MB"] * MB:
            return Exceeded("limit", f"wrote more than {task['output_MB']:g} MB (output_MB)")
        if self._relay is not None and self._relay.is_over:
            return self._timeout(" of simulated time")
        now = time.monotonic()
        if now < self._sampled + SAMPLE_S:
            return None
        passed_s, self._sampled = now - self._sampled, now
        usage = usage_of(descendants(os.getpid(), [self._emulator, *self._excluded]))
        if usage.memory > task["memory_MB"] * MB:
            return self._over_memory()
        if self._relay is None:
            return self._timeout("") if now - self._began >= task["timeout_s"] else None
        if usage.processor_s > task["timeout_s"]:
            return self._timeout(" of processor time")
        self._count_idle(usage, passed_s)
        if self._idle_s > IDLE_FACTOR * task["timeout_s"]:
            return Exceeded("timeout", "waited for something else than the clock")
        return None

    def at_end(self, memory: int) -> Optional[Exceeded]:
        """`memory`: peak memory of the host in bytes."""
        return self._over_memory() if memory > self._task["memory_MB"] * MB else None

    def _count_idle(self, usage: Usage, passed_s: float) -> None:
        assert self._relay is not None
        emulator = usage_of(iter([self._emulator]))
        used_s = usage.processor_s - self._before.processor_s
        if self._relay.requests != self._requests:
            self._idle_s = 0.0
        elif not usage.is_running and not emulator.is_running and used_s < IDLE_SHARE * passed_s:
            self._idle_s += passed_s
        self._before, self._requests = usage, self._relay.requests

    def _timeout(self, kind_of_time: str) -> Exceeded:
        return Exceeded("timeout", f"did not end within {self._task['timeout_s']:g} s{kind_of_time}")

    def _over_memory(self) -> Exceeded:
        return Exceeded("limit", f"used more than {self._task['memory_MB']:g} MB of memory (memory_MB)")
