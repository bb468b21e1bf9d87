"""Commands to drives and readings of one. Names end with their units: _V, _s, _C, _deg, _dps."""

from __future__ import annotations

import difflib
from typing import TYPE_CHECKING, Any, Callable, Dict, List, Mapping, Optional, Sequence, Union, overload
from urllib.parse import quote

from .errors import Refused
from .faults import Fault, kind_called

if TYPE_CHECKING:
    from .emulator import Emulator

When = Mapping[str, Any]
"""A condition: {"signal": "speed_dps", "above": 100}, {"error": "stall"} or {"command": 0xA4, "count": 3}; "id": the
drive."""


class Power:
    """Switches the supply."""

    def __init__(self, targets: "Targets") -> None:
        self._targets = targets

    def on(self, **timing: Any) -> float:
        return self._targets.do(power="on", **timing)

    def off(self, **timing: Any) -> float:
        """Disconnects the supply; the DC link still feeds the drive for a moment."""
        return self._targets.do(power="off", **timing)

    def cycle(self, off_s: Optional[float] = None, **timing: Any) -> float:
        """Switches the supply off, and on again after `off_s` seconds (default: 0.5)."""
        return self._targets.do(power="cycle", off_s=off_s, **timing)


class Targets:
    """Some drives of a bus. Every kind of fault is a method too: `drive.jam(percent=50, for_s=0.2)`.

    All methods take effect at once, or at `at_s=` or on `when=`. They return the time in seconds at which lk-emu
    accepted the request; faults return a `Fault`. Raise `Refused` if lk-emu refuses the request.
    """

    def __init__(self, emulator: "Emulator", bus: str, ids: Sequence[int]) -> None:
        self._emulator = emulator
        self.bus = bus
        self.ids = list(ids)
        self.power = Power(self)

    def do(self, **words: Any) -> float:
        """Sends a directive with the keys of docs/reference/events.md. Omits keys whose value is None."""
        return float(self._emulator.directive(bus=self.bus, ids=self.ids, **words)["time_s"])

    def supply(self, volts: float, ramp_s: Optional[float] = None, **timing: Any) -> float:
        """Sets the supply to `volts`: linearly within `ramp_s` seconds, or at once."""
        return self.do(supply_V=volts, ramp_s=ramp_s, **timing)

    def sag(self, to_V: float, s: float, **timing: Any) -> float:
        """Lowers the supply to `to_V` volts for `s` seconds. `fault("sag", …)` does so with evidence."""
        return self.do(sag_to_V=to_V, sag_s=s, **timing)

    def ambient(self, C: float, **timing: Any) -> float:
        """Sets the ambient temperature in °C."""
        return self.do(ambient_C=C, **timing)

    def load(self, *, at_s: Optional[float] = None, when: Optional[When] = None, **load: Any) -> float:
        """Sets the load on the output: `J_g_cm2`, `tau_Nm`, `tau_gravity_Nm`, `theta_min_deg`, `theta_max_deg`."""
        return self.do(load=load, at_s=at_s, when=when)

    def turn(self, deg: float, **timing: Any) -> float:
        """Turns the output shaft as by hand; clockwise is positive."""
        return self.do(turn_deg=deg, **timing)

    def settings(self, *, at_s: Optional[float] = None, when: Optional[When] = None, **settings: Any) -> float:
        """Writes settings of RAM and ROM, as the vendor's tool does: `max_speed_dps=…`, `gains={…}`."""
        return self.do(settings=settings, at_s=at_s, when=when)

    def fault(
        self,
        kind: str,
        *,
        name: Optional[str] = None,
        for_s: Optional[float] = None,
        every_s: Optional[float] = None,
        times: Optional[int] = None,
        probability: Optional[float] = None,
        at_s: Optional[float] = None,
        when: Optional[When] = None,
        optional: bool = False,
        **parameters: Any,
    ) -> Fault:
        """Sets a fault of this kind; `lk-emu faults` lists kinds and parameters.

        `for_s`, `every_s`, `times`: duration, period and number of repetitions. `probability`: per frame, for kinds
        that act on frames. `optional`: a test does not fail if the fault never takes effect.
        """
        course = {"name": name, "for_s": for_s, "every_s": every_s, "times": times, "probability": probability}
        words = {"kind": kind, **{key: value for key, value in course.items() if value is not None}, **parameters}
        return self._emulator.set_fault(self.bus, self.ids, words, at_s, when, optional)

    def __getattr__(self, word: str) -> Callable[..., Fault]:
        if word.startswith("_"):
            raise AttributeError(word)
        kind = kind_called(word, self._emulator.fault_kinds())

        def set_it(*values: Any, **more: Any) -> Fault:
            return self.fault(kind.word, **kind.named(values), **more)

        set_it.__name__ = word
        set_it.__doc__ = f"Fault: {kind.about}. Parameters: {', '.join(kind.parameters) or 'none'}."
        return set_it

    def __dir__(self) -> List[str]:
        return sorted({*super().__dir__(), *self._emulator.fault_kinds()})


def chosen(values: Dict[str, float], signals: Sequence[str]) -> Union[float, Dict[str, float]]:
    """Returns the value of one signal; a dict for several or, if none is named, for all."""
    for name in signals:
        if name not in values:
            near = difflib.get_close_matches(name, values, 1)
            raise Refused("signals", f"there is no signal {name!r}" + (f", did you mean {near[0]}?" if near else ""))
    if len(signals) == 1:
        return float(values[signals[0]])
    return {name: values[name] for name in signals} if signals else dict(values)


class Drive(Targets):
    """One drive. Each reading is a new request; its values belong to one instant."""

    def __init__(self, emulator: "Emulator", bus: str, id: int) -> None:
        super().__init__(emulator, bus, [id])
        self.id = id

    def view(self) -> Dict[str, Any]:
        """Returns the whole state of the drive: motor, state, errors, signals, registers, counters."""
        return dict(self._emulator.client.get(f"/drives/{quote(self.bus, safe='')}/{self.id}"))

    @overload
    def telemetry(self, signal: str, /) -> float: ...

    @overload
    def telemetry(self, *signals: str) -> Dict[str, float]: ...

    def telemetry(self, *signals: str) -> Union[float, Dict[str, float]]:
        """Returns the value of one signal; a dict for several or for all (GET /signals lists them)."""
        return chosen(self.view()["signals"], signals)

    @property
    def state(self) -> str:
        """State of the motor: off, stopped or running."""
        return str(self.view()["state"])

    @property
    def alive(self) -> bool:
        """Whether the controller has power and has booted."""
        return bool(self.view()["alive"])

    @property
    def errors(self) -> List[str]:
        """Latched errors by name: under_voltage, stall, …"""
        return list(self.view()["errors"])

    @property
    def registers(self) -> Dict[str, Any]:
        """{"ram": {…}, "rom": {…}}"""
        return dict(self.view()["registers"])

    @property
    def counters(self) -> Dict[str, int]:
        return dict(self.view()["counters"])

    def __repr__(self) -> str:
        return f"<Drive {self.id} on {self.bus}>"
