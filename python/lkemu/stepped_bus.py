"""A host that waits for frames while the clock stands."""

from __future__ import annotations

from typing import Any, Iterator, Optional

from .clock import LEAST_S, Clock, Duration, seconds


def has_more(bus: Any) -> bool:
    """Lines of python-can's slcan that have come and were not looked at: it looks at one at a time, and that may be
    the one which says that a frame was taken."""
    port = getattr(bus, "serialPortOrig", None)
    return port is not None and (b"\r" in getattr(bus, "_buffer", b"") or bool(port.in_waiting))


class SteppedBus:
    """A can.Bus of python-can that lets time pass while its host waits; otherwise time stands.

    Everything but waiting is the bus's own. Made for one thread: a can.Notifier would move the clock on its own.
    """

    def __init__(self, bus: Any, clock: Clock, step: Duration = "1ms") -> None:
        self.bus, self.clock = bus, clock
        self._step_s = seconds(step)

    def recv(self, timeout: Optional[float] = None) -> Optional[Any]:
        """The next frame, or None after `timeout` seconds of the drives' time; without it, waits on."""
        left_s = float("inf") if timeout is None else timeout
        while True:
            message = self.bus.recv(0)
            while message is None and has_more(self.bus):
                message = self.bus.recv(0)
            if message is not None or left_s <= 0:
                return message
            # A host that waits until `deadline - now()` is 0 waits for what its subtraction leaves over, too.
            step_s = max(min(self._step_s, left_s), LEAST_S)
            self.clock.advance(step_s)
            # What is left of a step beyond the clock's microsecond is a rounding error.
            left_s = left_s - step_s if left_s - step_s > LEAST_S else 0

    def __iter__(self) -> Iterator[Any]:
        while True:
            message = self.recv(1.0)
            if message is not None:
                yield message

    def __getattr__(self, name: str) -> Any:
        return getattr(self.bus, name)
