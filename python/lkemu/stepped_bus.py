"""A python-can bus for stepped clocks."""

from __future__ import annotations

import errno
from typing import Any, Optional

import can

from .clock import LEAST_S, Clock, Duration, seconds
from .errors import Error, NoReply
from .faults import Evidence

PATIENCE = "60s"  # assumed: far longer than hosts wait for a drive, which answers within milliseconds


def has_more(bus: Any) -> bool:
    """Returns whether python-can's slcan has unread lines. It reads one line at a time, which may only acknowledge a
    sent frame."""
    port = getattr(bus, "serialPortOrig", None)
    return port is not None and (b"\r" in getattr(bus, "_buffer", b"") or bool(port.in_waiting))


class SteppedBus(can.BusABC):
    """A can.Bus of python-can that advances time while its host waits; otherwise time is stopped.

    Passes all other calls to `bus`. Use it from one thread only: a can.Notifier would advance the clock on its own.
    `patience`: simulated time without a frame, over one or several calls. A longer wait raises NoReply. The time
    restarts with the first frame sent after one was received. A call with a time-out is never cut short.
    `name`: lk-emu's name of the bus, needed if it has several. With the queue of a bus full (key `tx_queue`), `send`
    raises CanOperationError with ENOBUFS, as python-can does on SocketCAN.
    """

    def __init__(self, bus: Any, clock: Clock, step: Duration = "1ms", patience: Duration = PATIENCE,
                 name: Optional[str] = None) -> None:
        self.bus, self.clock, self._name = bus, clock, name
        self._room = 0.0  # frames that the queue takes for certain
        self._step_s = seconds(step)
        self._patience_s = seconds(patience)
        self._waited_s = 0.0  # since the last frame
        self._sent: Optional[Any] = None  # last frame sent
        self._is_waiting = False  # a frame was sent after the last one received
        self.channel_info = bus.channel_info
        super().__init__(channel=None, can_filters=bus.filters)

    def recv(self, timeout: Optional[float] = None) -> Optional[Any]:
        """Returns the next frame, or None after `timeout` s of the drives' time. Raises NoReply, see `patience`."""
        left_s = float("inf") if timeout is None else timeout
        gives_up = True  # with a time-out: only on entry
        while True:
            message = self.bus.recv(0)
            while message is None and has_more(self.bus):
                message = self.bus.recv(0)
            if message is not None:
                self._waited_s = 0.0
                self._is_waiting = False
                return message
            if left_s <= 0:
                return None
            if gives_up and self._waited_s > self._patience_s - LEAST_S:
                raise NoReply(self._why())
            gives_up = timeout is None
            # A host may wait until `deadline - now()` is 0, and so also for the rounding error of this subtraction.
            step_s = max(min(self._step_s, left_s), LEAST_S)
            self.clock.advance(step_s)
            self._waited_s += step_s
            # A remainder below 1 us, the clock's resolution, is a rounding error.
            left_s = left_s - step_s if left_s - step_s > LEAST_S else 0

    def send(self, msg: Any, timeout: Optional[float] = None) -> None:
        if self._room < 1:
            self._room = self.clock.tx_room(self._name)
        if self._room < 1:
            raise can.CanOperationError("No buffer space available", errno.ENOBUFS)
        self._room -= 1
        if not self._is_waiting:
            self._waited_s = 0.0
        self._is_waiting = True
        self._sent = msg
        self.bus.send(msg, timeout)

    def send_periodic(self, *args: Any, **kwargs: Any) -> Any:
        return self.bus.send_periodic(*args, **kwargs)

    def stop_all_periodic_tasks(self, remove_tasks: bool = True) -> None:
        self.bus.stop_all_periodic_tasks(remove_tasks)

    def set_filters(self, filters: Any = None) -> None:
        self.bus.set_filters(filters)

    @property
    def filters(self) -> Any:
        return self.bus.filters

    @filters.setter
    def filters(self, filters: Any) -> None:
        self.bus.set_filters(filters)

    @property
    def state(self) -> Any:
        return self.bus.state

    @state.setter
    def state(self, state: Any) -> None:
        self.bus.state = state

    def flush_tx_buffer(self) -> None:
        self.bus.flush_tx_buffer()

    def fileno(self) -> int:
        return int(self.bus.fileno())

    def shutdown(self) -> None:
        super().shutdown()
        self.bus.shutdown()

    def __del__(self) -> None:
        """Empty: `bus` itself warns if it was not closed."""

    def __getattr__(self, name: str) -> Any:
        if name == "bus":  # __init__ has not set it yet
            raise AttributeError(name)
        return getattr(self.bus, name)

    # --- message of NoReply ---

    def _why(self) -> str:
        waited = f"no frame in {self._waited_s:g} s of simulated time"
        if self._sent is None:
            return f"{waited}, and none was sent"
        frame = f"{self._sent.arbitration_id:03X}#{bytes(self._sent.data).hex().upper()}"
        return f"{waited}, waiting for the reply to {frame}: {self._what_removed_it()}"

    def _what_removed_it(self) -> str:
        try:
            faults = self.clock.faults()
        except Error as problem:
            return str(problem)
        fired = [fault for fault in faults if fault.fired and self._is_asked(fault)]
        # Faults with a frame in their evidence come first: they remove frames.
        fired.sort(key=lambda fault: "#" not in fault.first_on)
        nothing = "no fault on its way has taken effect; is this drive on the bus, with power?"
        return "; ".join(map(str, fired)) or nothing

    def _is_asked(self, fault: Evidence) -> bool:
        """Returns whether the fault acts on the drive of the last frame, on all drives, or on the bus."""
        id = self._sent.arbitration_id - 0x140 if self._sent is not None else 0
        return not fault.ids or not 1 <= id <= 32 or id in fault.ids

