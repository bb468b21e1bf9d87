"""The drives' clock."""

from __future__ import annotations

import re
from typing import List, Optional, Union

from .client import Client
from .faults import Evidence

UNITS_S = {"ns": 1e-9, "us": 1e-6, "µs": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}
LEAST_S = 1e-6  # resolution of the clock; steps below half of it would not advance the clock
Duration = Union[str, float, int]


def seconds(duration: Duration) -> float:
    """Converts 10 or "10 s", "250ms", "20us", "2 min" to seconds."""
    if not isinstance(duration, str):
        return float(duration)
    found = re.fullmatch(r"\s*([0-9.]+(?:[eE][-+]?\d+)?)\s*(\S*)\s*", duration)
    try:
        if found is None:
            raise ValueError
        return float(found[1]) * UNITS_S[found[2] or "s"]
    except (ValueError, KeyError):
        raise ValueError(f"{duration!r} is not a duration; write 0.25 or '250ms'") from None


class Clock:
    """`mode` is "realtime", "stepped" (time only advances on request) or "x10" (any factor)."""

    def __init__(self, client: Client) -> None:
        self._client = client

    @property
    def mode(self) -> str:
        return str(self._client.get("/clock")["mode"])

    @mode.setter
    def mode(self, mode: str) -> None:
        self._client.request("PUT", "/clock", {"mode": mode})

    @property
    def time_s(self) -> float:
        """Returns the drives' time in seconds since their start."""
        return float(self._client.get("/clock")["time_s"])

    def faults(self) -> List[Evidence]:
        """Returns the evidence of all faults that were set on the drives of this clock."""
        return [Evidence.from_json(row) for row in self._client.get("/faults")]

    def tx_room(self, bus: Optional[str] = None) -> float:
        """Returns how many frames the hosts' queue of a bus has room for; inf if it refuses none, or is unknown.

        `bus`: lk-emu's name of it; without one, the only bus.
        """
        buses = self._client.get("/status")["buses"]
        found = [one for one in buses if bus in (None, one["bus"])]
        room = (found[0].get("host") or {}).get("tx_room") if len(found) == 1 else None
        return float("inf") if room is None else float(room)

    def advance(self, by: Duration) -> float:
        """Advances the time by "10ms" or by seconds; returns the new time. Stepped clocks only.

        On return, all events up to the new time have happened and the replies can be received.
        """
        return self._move({"by_s": seconds(by)}, seconds(by))

    def advance_to(self, time_s: float) -> float:
        """Advances the time to `time_s`; returns the new time. Stepped clocks only."""
        return self._move({"to_s": time_s}, time_s - self.time_s)

    def _move(self, how: "dict[str, float]", step_s: float) -> float:
        # Assumed: computing takes at most ten times as long as the simulated time, even on a slow machine.
        limit_s = self._client.timeout_s + 10 * max(0.0, step_s)
        return float(self._client.post("/clock/advance", how, limit_s)["time_s"])
