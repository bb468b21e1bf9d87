"""Kinds of faults, and the evidence of faults that were set."""

from __future__ import annotations

import difflib
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Dict, Mapping, Optional, Sequence, Tuple

from .errors import Error

if TYPE_CHECKING:
    from .emulator import Emulator


@dataclass(frozen=True)
class Kind:
    """A kind of fault as lk-emu lists it (`lk-emu faults`). Names of parameters end with the unit."""

    word: str
    about: str
    parameters: Tuple[str, ...]

    @classmethod
    def from_json(cls, row: Mapping[str, Any]) -> "Kind":
        parameters = tuple(str(param["name"]) for param in row.get("parameters", ()))
        return cls(str(row["kind"]), str(row.get("about", "")), parameters)

    def named(self, values: Sequence[Any]) -> Dict[str, Any]:
        """Maps values in the order of the parameters to their names."""
        if len(values) > len(self.parameters):
            takes = ", ".join(self.parameters) or "none"
            raise TypeError(f"fault {self.word}: {len(values)} parameters given, it has: {takes}")
        return dict(zip(self.parameters, values))


def kind_called(word: str, kinds: Mapping[str, Kind]) -> Kind:
    """Returns the kind of this name. Raises AttributeError if there is none, because faults are called as methods."""
    if word in kinds:
        return kinds[word]
    near = difflib.get_close_matches(word, kinds, 1)
    raise AttributeError(f"no fault {word!r}" + (f", did you mean {near[0]}?" if near else "; lk-emu faults lists them"))


@dataclass(frozen=True)
class Evidence:
    """Course and effects of a fault. Times are seconds of the bus; None: not yet."""

    bus: str
    name: str
    kind: str
    ids: Tuple[int, ...]  # of the drives; empty: the whole bus
    state: str  # armed, active, paused, over, cleared
    armed_at_s: float
    began_at_s: Optional[float]
    first_effect_at_s: Optional[float]
    effects: int  # frames; for lasting faults, samples
    first_on: str  # "drive 2", "drive 2, 142#9C…", "bus"
    parameters: Dict[str, Any] = field(default_factory=dict)

    @classmethod
    def from_json(cls, row: Mapping[str, Any]) -> "Evidence":
        return cls(
            bus=str(row["bus"]),
            name=str(row["name"]),
            kind=str(row["kind"]),
            ids=tuple(row.get("ids") or ()),
            state=str(row["state"]),
            armed_at_s=float(row.get("armed_at_s") or 0),
            began_at_s=row.get("began_at_s"),
            first_effect_at_s=row.get("first_effect_at_s"),
            effects=int(row.get("effects") or 0),
            first_on=str(row.get("first_on") or ""),
            parameters=dict(row.get("parameters") or {}),
        )

    @property
    def fired(self) -> bool:
        """Whether the fault has changed anything."""
        return self.effects > 0

    @property
    def title(self) -> str:
        """Title such as "fault jam on drive 2"."""
        name = "" if self.name == self.kind else f' "{self.name}"'
        return f"fault {self.kind}{name} on {on_whom(self.bus, self.ids)}"

    def __str__(self) -> str:
        if self.fired:
            first = f" at {self.first_effect_at_s:.6f} s" if self.first_effect_at_s is not None else ""
            on = f" on {self.first_on}" if self.first_on else ""
            return f"{self.title} took effect {self.effects} times, first{first}{on} ({self.state})"
        if self.began_at_s is None:
            return f"{self.title} never took effect: set at {self.armed_at_s:.6f} s, it has not begun ({self.state})"
        return f"{self.title} never took effect: it began at {self.began_at_s:.6f} s ({self.state})"


def on_whom(bus: str, ids: Sequence[int]) -> str:
    if not ids:
        return bus
    return ("drive " if len(ids) == 1 else "drives ") + ", ".join(map(str, ids))


class Fault:
    """A fault that was set. Each reading is a new request."""

    def __init__(self, emulator: "Emulator", bus: str, name: str, kind: str, optional: bool) -> None:
        self._emulator = emulator
        self.bus = bus
        self.name = name  # unique on its bus
        self.kind = kind
        self.optional = optional  # need not take effect

    @property
    def evidence(self) -> Evidence:
        for evidence in self._emulator.faults():
            if (evidence.bus, evidence.name) == (self.bus, self.name):
                return evidence
        raise Error(f"lk-emu has no fault {self.name} on {self.bus}")

    @property
    def fired(self) -> bool:
        """Whether the fault has taken effect."""
        return self.evidence.fired

    def clear(self) -> None:
        """Ends the fault for good."""
        self._emulator.directive(bus=self.bus, clear=self.name)

    def __repr__(self) -> str:
        return f"<Fault {self.name} on {self.bus}>"
