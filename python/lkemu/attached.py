"""Attaches to a bus whose lk-emu was started by another program, e.g. by lk-emu campaign."""

from __future__ import annotations

import os
import time
from typing import Any, Dict, Optional

from .buses import can_args
from .client import Client
from .clock import LEAST_S, Clock
from .errors import Ended, StartError

TIMEOUT_S = 600.0  # long, for busy machines; the program that started the host limits its run time


class Attached:
    """A bus and its clock.

    `now()` and `sleep(s)` use the drives' time if their clock is stepped, else the module `time`. `clock` is None in
    real time.
    """

    def __init__(self, bus: str, control: Optional[str] = None) -> None:
        self.bus = bus
        self.clock: Optional[Clock] = None
        if control:
            clock = Clock(Client(control, TIMEOUT_S, Ended))
            self.clock = clock if clock.mode == "stepped" else None

    @property
    def can_args(self) -> Dict[str, Any]:
        """Arguments that connect python-can to `bus`: `can.Bus(**attached.can_args)`."""
        return can_args(self.bus)

    def open(self) -> Any:
        """Returns a can.Bus of python-can; with a stepped clock, one that advances time while its host waits."""
        import can

        from .stepped_bus import SteppedBus

        bus = can.Bus(**self.can_args)
        return bus if self.clock is None else SteppedBus(bus, self.clock, name=self.bus)

    def now(self) -> float:
        """Returns seconds since an unspecified start; use differences only."""
        return time.monotonic() if self.clock is None else self.clock.time_s

    def sleep(self, duration_s: float) -> None:
        if self.clock is None:
            time.sleep(duration_s)
        elif duration_s > 0:
            self.clock.advance(max(duration_s, LEAST_S))


def attach() -> Attached:
    """Attaches to bus LKEMU_BUS, with the clock at socket LKEMU_CONTROL. Raises StartError if LKEMU_BUS is unset."""
    bus = os.environ.get("LKEMU_BUS")
    if not bus:
        raise StartError("LKEMU_BUS is not set: it names the bus, as lk-emu campaign does, like slcan-tcp:29536")
    return Attached(bus, os.environ.get("LKEMU_CONTROL"))
