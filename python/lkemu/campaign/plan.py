"""The plan of a campaign (docs/guides/campaigns.md) and its cases as requests to lk-emu. plan_file.py reads plans."""

from __future__ import annotations

import pathlib
from dataclasses import dataclass, field
from typing import Any, Callable, Dict, List, Mapping, Optional, Tuple, Union

from .sampling import Case
from .values import Listed, Value, Values

MAX_CASES = 10**15
NO_FAULT = "none"  # value of fault.kind
# Kinds of advice that [hazard] advice counts.
UNASKED = ("lunge", "left-turning", "first-target-zero", "target-wrapped", "answers-shifted", "stale-backlog")


class PlanError(Exception):
    """An error in a plan: `file:line: key: reason`."""


@dataclass(frozen=True)
class Dimension:
    name: str  # "fault.jam.percent"
    values: Values
    harmless_is_most: bool = False

    @property
    def fault_parameter(self) -> Optional[Tuple[str, str]]:
        """Kind of fault and its parameter, e.g. ("jam", "percent") for fault.jam.percent; None for other dimensions."""
        parts = self.name.split(".")
        return (parts[1], parts[2]) if parts[0] == "fault" and len(parts) == 3 else None


@dataclass(frozen=True)
class Host:
    """A host program, started for each case, or a Python function, called for each case."""

    command: Tuple[str, ...]  # with placeholders such as {host.NAME} and {channel}; empty if `python` is set
    python: str = ""  # file or module with run_case(bus, clock)
    bus: str = "slcan-tcp"
    stepped: bool = False
    timeout_s: float = 60.0
    memory_MB: float = 2000.0
    output_MB: float = 20.0
    runs: int = 1  # per case; above 1 only in real time
    passive: Tuple[str, str] = ("", "")  # environment variable that disables the host's reaction, and its value


@dataclass(frozen=True)
class Detection:
    drive_errors: Tuple[str, ...] = ("any",)  # error bits that count
    host: Tuple[Mapping[str, Any], ...] = ()  # [[expect]] tables
    lines: Tuple[str, ...] = ()  # regular expressions for the output of a host program
    exit_status: Tuple[int, ...] = ()


# By index of the dimension: a list of values, or both ends of a range.
Exclusion = Mapping[int, Union[List[Value], Tuple[float, float]]]


@dataclass
class Plan:
    file: pathlib.Path
    text: str
    sampling: str
    seed: int
    cases: int  # as in the plan; 0 if computed
    scenario: str  # an absolute path, or the name of a shipped one
    about: str = ""
    tolerant_time_ns: Optional[int] = None
    dimensions: List[Dimension] = field(default_factory=list)
    exclusions: List[Exclusion] = field(default_factory=list)
    hazards: Tuple[str, ...] = ()  # `says` of expectations; empty: all
    advice: Tuple[str, ...] = ()  # kinds of advice that are hazards
    detection: Detection = Detection()
    host: Optional[Host] = None
    faults: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)  # all kinds of lk-emu
    called: str = ""  # as on the command line
    numbers: int = 0  # cases are numbered 0 to numbers - 1
    included: int = 0  # without excluded cases; `numbers` if not counted
    drives: List[Mapping[str, Any]] = field(default_factory=list)
    expectations: List[str] = field(default_factory=list)
    duration_s: float = 0.0
    inputs: str = ""  # a hash of the files that the scenario names

    @property
    def name(self) -> str:
        return self.file.stem

    @property
    def kinds(self) -> List[str]:
        """Kinds of fault in order of the plan; empty if it has none."""
        for dimension in self.dimensions:
            if dimension.name == "fault.kind":
                assert isinstance(dimension.values, Listed)
                return [str(kind) for kind in dimension.values.values]
        return []

    def counts(self, dimension: Dimension, kind: Optional[str]) -> bool:
        """True if the dimension applies to cases with this kind of fault. `kind` None: cases without a fault."""
        if kind == NO_FAULT:
            return dimension.name == "fault.kind" or not dimension.name.startswith("fault.")
        fault = self.faults[kind] if kind is not None else None
        if dimension.name == "fault.id":
            return fault is not None and not fault["of_bus"]
        if dimension.name == "fault.for_s":
            return fault is not None and not fault["momentary"]
        if dimension.name == "fault.probability":
            return fault is not None and bool(fault["per_frame"])
        parameter = dimension.fault_parameter
        return parameter is None or parameter[0] == kind

    def fill(self, value_of: Callable[[int], Value]) -> Case:
        """Returns a value for each dimension that applies. Chooses the kind of fault first: others depend on it."""
        values: List[Optional[Value]] = [None] * len(self.dimensions)
        kind = None
        for n, dimension in enumerate(self.dimensions):
            if dimension.name == "fault.kind":
                kind = str(value_of(n))
                values[n] = kind
        for n, dimension in enumerate(self.dimensions):
            if values[n] is None and self.counts(dimension, kind):
                values[n] = value_of(n)
        return tuple(values)

    def kind_of(self, values: Case) -> Optional[str]:
        for dimension, value in zip(self.dimensions, values):
            if dimension.name == "fault.kind" and value is not None:
                return str(value)
        return None

    def has_fault(self, values: Case) -> bool:
        return self.kind_of(values) not in (None, NO_FAULT)

    def excludes(self, values: Case) -> bool:
        return any(all(_fits(values[n], what) for n, what in one.items()) for one in self.exclusions)

    def error(self, key: str, reason: str) -> PlanError:
        return PlanError(f"{self.file}: {key}: {reason}")

    def request(self, number: int, values: Case, *, fault: bool = True, watch: bool = True) -> Dict[str, Any]:
        """Returns the case as a line for `lk-emu run --cases`; with `fault` False, its reference run."""
        request: Dict[str, Any] = {"case": number, "scenario": self.scenario}
        settings: Dict[str, Any] = {}
        event: Dict[str, Any] = {}
        for dimension, value in zip(self.dimensions, values):
            if value is None:
                continue
            given: Any = whole_or_not(value)
            parameter = dimension.fault_parameter
            head, _, key = dimension.name.partition(".")
            if parameter is not None:
                event.setdefault("fault", {})[parameter[1]] = given
            elif dimension.name in ("fault.kind", "fault.for_s", "fault.probability"):
                event.setdefault("fault", {})[key] = given
            elif head == "fault":
                event[key] = given
            elif head == "load":
                settings.setdefault("load", {})[key] = given
            elif head in ("supply_V", "ambient_C", "bus_load"):
                settings[head] = given
            elif head != "host":
                request[head] = given
        if settings:
            request["settings"] = settings
        if watch and self.detection.drive_errors:
            request["drive_errors"] = list(self.detection.drive_errors)
        if watch and self.detection.host:
            request["detect"] = list(self.detection.host)
        if fault and self.has_fault(values):
            request["fault"] = event
        return request


def whole_or_not(value: Value) -> Union[int, float, str]:
    """Converts whole numbers to int, because counts and IDs must not have a fraction."""
    if isinstance(value, str) or value != round(value) or abs(value) >= 2.0**53:
        return value
    return int(value)


def _fits(value: Optional[Value], what: Union[List[Value], Tuple[float, float]]) -> bool:
    if value is None:
        return False
    if isinstance(what, list):
        return value in what
    return not isinstance(value, str) and what[0] <= value <= what[1]
