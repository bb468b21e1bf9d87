"""The plan of a campaign (docs/campaigns.md): a TOML file in, plain values out."""

from __future__ import annotations

import difflib
import hashlib
import math
import os
import pathlib
import shlex
import tomllib
from dataclasses import dataclass, field
from typing import Any, Callable, Dict, List, Mapping, Optional, Tuple, Union

import regex

from .program import Program
from .sampling import Case, Cases
from .values import Listed, Ranged, Value, Values, value_text

SAMPLINGS = ("full", "random", "latin", "pairwise")
MAX_CASES = 10**15
MAX_COUNTED = 1_000_000  # excluded cases are counted up to so many numbers
MAX_STEPS = 1e6
ANYTHING = 1e12
REALTIME_RUNS = 2  # the least that shows a case with two outcomes
HOST_KEYS = {"command", "bus", "clock", "timeout_s", "runs"}


class PlanError(Exception):
    """What is wrong with a plan: `file:line: key: reason`."""


@dataclass(frozen=True)
class Dimension:
    name: str  # "fault.jam.percent"
    values: Values
    harmless_is_most: bool = False

    @property
    def fault_parameter(self) -> Optional[Tuple[str, str]]:
        """("jam", "percent") of fault.jam.percent."""
        parts = self.name.split(".")
        return (parts[1], parts[2]) if parts[0] == "fault" and len(parts) == 3 else None


@dataclass(frozen=True)
class Host:
    """A host program that is started for each case."""

    command: Tuple[str, ...]  # {host.NAME}, {channel} and others are filled in
    bus: str = "slcan-tcp"
    stepped: bool = False
    timeout_s: float = 60.0
    runs: int = 1  # of each case in real time


@dataclass(frozen=True)
class Detection:
    drive_errors: Tuple[str, ...] = ("any",)  # error bits that count
    host: Tuple[Mapping[str, Any], ...] = ()  # [[expect]] tables
    lines: Tuple[str, ...] = ()  # regular expressions for the output of a host program
    exit_status: Tuple[int, ...] = ()


# By dimension: a list of values, or the ends of a range.
Exclusion = Mapping[int, Union[List[Value], Tuple[float, float]]]


@dataclass
class Plan:
    file: pathlib.Path
    text: str
    sampling: str
    seed: int
    cases: int  # as the plan says; 0 if it is counted
    scenario: str  # an absolute path, or the name of a delivered one
    about: str = ""
    tolerant_time_ns: Optional[int] = None
    dimensions: List[Dimension] = field(default_factory=list)
    exclusions: List[Exclusion] = field(default_factory=list)
    hazards: Tuple[str, ...] = ()  # `says` of expectations; empty: all
    detection: Detection = Detection()
    host: Optional[Host] = None
    faults: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)  # kinds that exist
    called: str = ""  # the word on the command line
    numbers: int = 0  # cases are numbered from 0 to this - 1
    included: int = 0  # cases that are not excluded, as far as counted
    drives: List[Mapping[str, Any]] = field(default_factory=list)
    expectations: List[str] = field(default_factory=list)
    duration_s: float = 0.0
    inputs: str = ""  # a hash of the files that the scenario names

    @property
    def name(self) -> str:
        return self.file.stem

    @property
    def kinds(self) -> List[str]:
        """The kinds of fault, in order; empty if the plan has none."""
        for dimension in self.dimensions:
            if dimension.name == "fault.kind":
                assert isinstance(dimension.values, Listed)
                return [str(kind) for kind in dimension.values.values]
        return []

    def counts(self, dimension: Dimension, kind: Optional[str]) -> bool:
        """Whether the dimension counts in cases with this kind of fault; None: without fault."""
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
        """The value of each dimension that counts. The kind of fault comes first: it decides which do."""
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

    def excludes(self, values: Case) -> bool:
        return any(all(_fits(values[n], what) for n, what in one.items()) for one in self.exclusions)

    def error(self, key: str, reason: str) -> PlanError:
        return PlanError(f"{self.file}: {key}: {reason}")

    def request(self, number: int, values: Case, *, fault: bool = True, watch: bool = True) -> Dict[str, Any]:
        """The case as a line for `lk-emu run --cases`; `fault` False: the run it is compared with."""
        request: Dict[str, Any] = {"case": number, "scenario": self.scenario}
        settings: Dict[str, Any] = {}
        event: Dict[str, Any] = {}
        for dimension, value in zip(self.dimensions, values):
            if value is None:
                continue
            said: Any = _number(value)
            parameter = dimension.fault_parameter
            head, _, key = dimension.name.partition(".")
            if parameter is not None:
                event.setdefault("fault", {})[parameter[1]] = said
            elif dimension.name in ("fault.kind", "fault.for_s", "fault.probability"):
                event.setdefault("fault", {})[key] = said
            elif head == "fault":
                event[key] = said
            elif head == "load":
                settings.setdefault("load", {})[key] = said
            elif head in ("supply_V", "ambient_C", "bus_load"):
                settings[head] = said
            elif head != "host":
                request[head] = said
        if settings:
            request["settings"] = settings
        if watch and self.detection.drive_errors:
            request["drive_errors"] = list(self.detection.drive_errors)
        if watch and self.detection.host:
            request["detect"] = list(self.detection.host)
        if fault and "fault" in event:
            request["fault"] = event
        return request


def _number(value: Value) -> Union[int, float, str]:
    """Whole numbers as such: counts and IDs take no fractions."""
    if isinstance(value, str) or value != round(value) or abs(value) >= 2.0**53:
        return value
    return int(value)


def _fits(value: Optional[Value], what: Union[List[Value], Tuple[float, float]]) -> bool:
    if value is None:
        return False
    if isinstance(what, list):
        return value in what
    return not isinstance(value, str) and what[0] <= value <= what[1]


def find_plan(called: str, program: Program) -> pathlib.Path:
    """A file, or a delivered plan by its name. Raises PlanError."""
    file = pathlib.Path(called)
    if file.is_file() or "/" in called or called.endswith(".toml"):
        return file
    package = pathlib.Path(__file__).resolve().parents[2]
    bin_directory = pathlib.Path(program.path).resolve().parent
    shelves = (package / "campaigns", package.parent / "configs/campaigns", package / "configs/campaigns",
               bin_directory.parent / "share/lk-emu/campaigns")  # fmt: skip
    for shelf in shelves:
        if (shelf / f"{called}.toml").is_file():
            return shelf / f"{called}.toml"
    known = sorted({one.stem for shelf in shelves for one in shelf.glob("*.toml")})
    near = difflib.get_close_matches(called, known, 1)
    raise PlanError(f'no campaign "{called}"' + (f"; did you mean {near[0]}?" if near else f"; delivered: {', '.join(known)}"))


def load_plan(called: str, program: Program) -> Plan:
    """Raises PlanError: all that is wrong with a plan is found before a case runs."""
    return _Reader(find_plan(called, program), called, program).read()


class _Reader:
    def __init__(self, file: pathlib.Path, called: str, program: Program) -> None:
        self.file, self.called, self.program = file, called, program

    def fail(self, key: str, reason: str) -> PlanError:
        """With the line on which the key is complete."""
        place = next((f":{n}" for name, n in self.lines.items() if name == key), "")
        return PlanError(f"{self.file}{place}: {key}: {reason}")

    def read(self) -> Plan:
        self.lines: Dict[str, int] = {}
        try:
            self.text = self.file.read_text(encoding="utf-8")
            document = tomllib.loads(self.text)
        except (OSError, UnicodeDecodeError) as problem:
            raise PlanError(f"{self.file}: {problem}") from None
        except tomllib.TOMLDecodeError as problem:
            raise PlanError(f"{self.file}: {problem}") from None
        self.lines = _lines_of(self.text)
        known = {"about", "scenario", "sampling", "cases", "seed", "tolerant_time_s", "dimension", "exclude", "hazard",
                 "detect", "host", "rates"}  # fmt: skip
        self.check_keys(document, known, "")
        plan = self.read_head(document)
        plan.faults = {row["kind"]: row for row in self.program.faults()}
        self.look_at_scenario(plan)
        plan.dimensions = self.read_dimensions(document.get("dimension"), plan)
        plan.exclusions = [self.read_exclusion(one, plan) for one in document.get("exclude", [])]
        hazard = self.table(document, "hazard", {"expectations"})
        plan.hazards = tuple(hazard.get("expectations", ()))
        for one in plan.hazards:
            if one not in plan.expectations:
                raise self.fail("hazard.expectations", f'the scenario expects nothing that says "{one}"')
        plan.detection = self.read_detection(self.table(document, "detect", {"drive", "host"}))
        if "host" in document:
            plan.host = self.read_host(self.table(document, "host", HOST_KEYS))
        self.check_fault(plan)
        self.check_rates(document.get("rates", {}), plan)
        self.check_lists(plan)
        self.count_cases(plan)
        return plan

    def check_keys(self, table: Mapping[str, Any], known: set[str], path: str) -> None:
        for key in table:
            if key not in known:
                near = difflib.get_close_matches(key, known, 1)
                raise self.fail(path + key, "unknown key" + (f", did you mean {near[0]}?" if near else ""))

    def table(self, document: Mapping[str, Any], key: str, known: set[str]) -> Mapping[str, Any]:
        table = document.get(key, {})
        if not isinstance(table, dict):
            raise self.fail(key, "must be a table")
        self.check_keys(table, known, key + ".")
        return table

    def read_head(self, document: Mapping[str, Any]) -> Plan:
        sampling = document.get("sampling")
        if sampling not in SAMPLINGS:
            raise self.fail("sampling", f"must be one of {', '.join(SAMPLINGS)}")
        cases = document.get("cases")
        if sampling in ("random", "latin") and cases is None:
            raise self.fail("cases", "missing")
        if sampling in ("full", "pairwise") and cases is not None:
            raise self.fail("cases", "belongs to random and latin")
        if cases is not None and not (_is_whole(cases) and 1 <= cases <= MAX_CASES):
            raise self.fail("cases", f"must be a whole number from 1 to {MAX_CASES}")
        seed = document.get("seed", 1)
        if not (_is_whole(seed) and 0 <= seed < 2**63):
            raise self.fail("seed", "must be a whole number from 0 to 2^63 - 1")
        scenario = document.get("scenario")
        if not isinstance(scenario, str):
            raise self.fail("scenario", "missing, or not a text")
        if scenario.endswith(".toml") or "/" in scenario:
            scenario = os.path.abspath(self.file.parent / scenario)
        tolerant = document.get("tolerant_time_s")
        if tolerant is not None and not (_is_number(tolerant) and 0 <= tolerant <= 1e8):
            raise self.fail("tolerant_time_s", "must be a number from 0 to 1e8")
        return Plan(
            file=self.file,
            text=self.text,
            called=self.called,
            sampling=sampling,
            seed=seed,
            cases=cases or 0,
            scenario=scenario,
            about=str(document.get("about", "")),
            tolerant_time_ns=None if tolerant is None else round(tolerant * 1e9),
        )

    def look_at_scenario(self, plan: Plan) -> None:
        """Drives, expectations and duration, as the program reads them."""
        (seen,) = self.program.check([{"case": 0, "scenario": plan.scenario}])
        if "error" in seen:
            raise self.fail("scenario", seen["error"])
        plan.drives, plan.expectations, plan.duration_s = seen["drives"], seen["expect"], seen["duration_s"]
        plan.inputs = seen["inputs"]

    # Dimensions

    def read_dimensions(self, table: Any, plan: Plan) -> List[Dimension]:
        if not isinstance(table, dict) or not table:
            raise self.fail("dimension", "missing, or empty")
        dimensions: List[Dimension] = []
        for name, node in sorted(_flat(table), key=lambda one: self.lines.get("dimension." + one[0], 0)):
            if any(name == other.name for other in dimensions):
                raise self.fail(f"dimension.{name}", "is there twice")
            values = self.read_values(name, node, plan)
            harmless = node.get("least", "from") if isinstance(node, dict) else "from"
            if harmless not in ("from", "to"):
                raise self.fail(f"dimension.{name}", 'least: is "from" or "to"')
            dimensions.append(Dimension(name, values, harmless == "to"))
        return dimensions

    def words_of(self, name: str, plan: Plan) -> Optional[List[str]]:
        """The words that the dimension may be; None: numbers. Raises PlanError: no such dimension."""
        numbers = {"fault.id", "fault.at_s", "fault.for_s", "fault.probability", "seed", "bitrate", "bus_load", "supply_V",
                   "ambient_C"}  # fmt: skip
        if name in numbers or name.startswith("load."):
            return None
        if name == "fault.kind":
            return list(plan.faults)
        if name == "generation":
            return self.program.generations()
        if name == "fault.bus":
            return sorted({str(drive["bus"]) for drive in plan.drives})
        if name.startswith("host.") and len(name) > len("host."):
            return []
        for kind, row in plan.faults.items():
            for parameter in row["parameters"]:
                if name == f"fault.{kind}.{parameter['name']}":
                    return parameter.get("choices")
        known = [*numbers, "fault.kind", "fault.bus", "generation"]
        known += [f"fault.{kind}.{one['name']}" for kind, row in plan.faults.items() for one in row["parameters"]]
        near = difflib.get_close_matches(name, known, 1)
        raise self.fail(f"dimension.{name}", "unknown dimension" + (f", did you mean {near[0]}?" if near else ""))

    def rounding_of(self, name: str, plan: Plan) -> str:
        if name in ("fault.at_s", "fault.for_s"):
            return "ms"
        if name in ("fault.id", "seed", "bitrate"):
            return "whole"
        parts = name.split(".")
        if parts[0] == "fault" and len(parts) == 3:
            parameter = next(one for one in plan.faults[parts[1]]["parameters"] if one["name"] == parts[2])
            return "whole" if parameter.get("whole") else "figures"
        return "figures"

    def read_values(self, name: str, node: Any, plan: Plan) -> Values:
        words = self.words_of(name, plan)
        key = f"dimension.{name}"
        if node == "all" and words:
            return Listed(self.possible_kinds(plan) if name == "fault.kind" else words)
        if not isinstance(node, dict):
            return Listed(self.read_list(key, node, words))
        known = {"from", "to", "step", "log", "mean", "sd", "values", "weights", "least"}
        self.check_keys(node, known, key + ".")
        if "values" in node:
            return self.weighted(key, node, words)
        if words:
            raise self.fail(key, "must be a word or a list of words")
        if "weights" in node:
            raise self.fail(key, "weights need values")
        start, stop = (self.number(key, node.get(end), "a range needs from and to") for end in ("from", "to"))
        if not start < stop:
            raise self.fail(key, "the range is empty: to must be above from")
        if "step" in node:
            return self.stepped(key, node, start, stop)
        log = bool(node.get("log", False))
        if log and start <= 0:
            raise self.fail(key, "must be above 0 for log")
        if ("mean" in node) != ("sd" in node):
            raise self.fail(key, "mean and sd belong together")
        if "mean" in node and log:
            raise self.fail(key, "log does not go together with mean")
        mean = self.number(key, node["mean"], "mean must be a number") if "mean" in node else None
        sd = self.number(key, node.get("sd", 1.0), "sd must be a number")
        if not 0 < sd <= ANYTHING:
            raise self.fail(key, "sd must be above 0")
        return Ranged(start, stop, log, mean, sd, self.rounding_of(name, plan))

    def number(self, key: str, value: Any, otherwise: str) -> float:
        if not _is_number(value):
            raise self.fail(key, otherwise)
        return float(value)

    def read_list(self, key: str, node: Any, words: Optional[List[str]]) -> List[Value]:
        given = node if isinstance(node, list) else [node]
        if not given:
            raise self.fail(key, "is empty")
        values: List[Value] = []
        for one in given:
            if isinstance(one, str) and words is not None:
                if words and one not in words:
                    near = difflib.get_close_matches(one, words, 1)
                    raise self.fail(key, f'"{one}" is unknown' + (f", did you mean {near[0]}?" if near else ""))
                values.append(one)
            elif words:
                raise self.fail(key, "must be a word or a list of words")
            else:
                values.append(self.number(key, one, "must be a number"))
            if isinstance(values[-1], str) != isinstance(values[0], str):
                raise self.fail(key, "mixes numbers and words")
            if values[-1] in values[:-1]:
                raise self.fail(key, f"has {value_text(values[-1])} twice")
        return values

    def weighted(self, key: str, node: Mapping[str, Any], words: Optional[List[str]]) -> Listed:
        for other in node:
            if other not in ("values", "weights", "least"):
                raise self.fail(key, f"{other} does not go together with values")
        values = self.read_list(key, node["values"], words)
        weights = node.get("weights")
        if not isinstance(weights, list):
            raise self.fail(key, "values without weights are a list: [ … ]")
        if not all(_is_number(one) and 0 <= one <= ANYTHING for one in weights):
            raise self.fail(key, "weights are 0 or more")
        if len(weights) != len(values):
            raise self.fail(key, "needs as many weights as values")
        if not any(weights):
            raise self.fail(key, "all weights are 0")
        return Listed(values, [float(one) for one in weights])

    def stepped(self, key: str, node: Mapping[str, Any], start: float, stop: float) -> Listed:
        for other in ("log", "mean", "sd"):
            if other in node:
                raise self.fail(key, f"{other} does not go together with step")
        step = node["step"]
        if not _is_number(step) or step <= 0 or (stop - start) / step > MAX_STEPS:
            raise self.fail(key, "step must be above 0, and a millionth of the range or more")
        steps = math.floor((stop - start) / step + 1e-9)
        # As a person would write it: without the last bits of the multiplication.
        return Listed([float(round((start + n * step) * 1e9)) / 1e9 for n in range(steps + 1)])

    def possible_kinds(self, plan: Plan) -> List[str]:
        """The kinds that a drive of the first bus can have."""
        bus = plan.drives[0]["bus"]
        ids = [drive["id"] for drive in plan.drives if drive["bus"] == bus]
        requests = []
        for kind, row in plan.faults.items():
            needed = [one for one in row["parameters"] if one["required"]]
            needed += row["parameters"][:1] if row["needs_one"] else []
            # A drive may refuse one end of a range: the ID that it has already.
            for end in ("min", "max"):
                parameters = {one["name"]: _number(one[end]) for one in needed}
                for drive in [None] if row["of_bus"] else ids:
                    event = {"at_s": 0, "bus": bus, "fault": {"kind": kind, **parameters}}
                    if drive is not None:
                        event["id"] = drive
                    requests.append({"case": list(plan.faults).index(kind), "scenario": plan.scenario, "fault": event})
        possible = {seen["case"] for seen in self.program.check(requests) if "error" not in seen}
        return [kind for n, kind in enumerate(plan.faults) if n in possible]

    # The rest

    def read_exclusion(self, table: Any, plan: Plan) -> Exclusion:
        if not isinstance(table, dict) or not table:
            raise self.fail("exclude", "is empty: it would leave out every case")
        exclusion: Dict[int, Union[List[Value], Tuple[float, float]]] = {}
        names = [dimension.name for dimension in plan.dimensions]
        for name, node in _flat(table):
            key = f"exclude.{name}"
            if name not in names:
                raise self.fail(key, "is no dimension of this plan")
            n = names.index(name)
            if not isinstance(node, dict):
                exclusion[n] = self.read_list(key, node, self.words_of(name, plan))
                continue
            self.check_keys(node, {"from", "to"}, key + ".")
            if plan.dimensions[n].values.has_words:
                raise self.fail(key, "has words, and no range: give one or a list")
            start = self.number(key, node.get("from", -ANYTHING), "from must be a number")
            stop = self.number(key, node.get("to", ANYTHING), "to must be a number")
            if start > stop:
                raise self.fail(key, "the range is empty: to is below from")
            exclusion[n] = (start, stop)
        return exclusion

    def read_detection(self, table: Mapping[str, Any]) -> Detection:
        drive = table.get("drive", "any")
        errors = [] if drive == "none" else [drive] if isinstance(drive, str) else list(drive)
        host, lines, statuses = [], [], []
        for rule in table.get("host", ()):
            if "says" in rule:
                try:
                    regex.compile(rule["says"])
                except regex.error as problem:
                    raise self.fail("detect.host.says", f'"{rule["says"]}" is no regular expression: {problem}') from None
                lines.append(rule["says"])
            elif "exit_status" in rule:
                if not (_is_whole(rule["exit_status"]) and 0 <= rule["exit_status"] <= 255):
                    raise self.fail("detect.host.exit_status", "must be a whole number from 0 to 255")
                statuses.append(rule["exit_status"])
            elif "reply" in rule or "answered" in rule:
                host.append(rule)
            else:
                raise self.fail("detect.host", "needs one of reply, answered, says and exit_status")
        return Detection(tuple(errors), tuple(host), tuple(lines), tuple(statuses))

    def read_host(self, table: Mapping[str, Any]) -> Host:
        command = table.get("command")
        try:
            words = shlex.split(command) if isinstance(command, str) else list(command or ())
        except ValueError as problem:
            raise self.fail("host.command", str(problem)) from None
        if not words:
            raise self.fail("host.command", "missing, or empty")
        clock = table.get("clock", "realtime")
        if clock not in ("realtime", "stepped"):
            raise self.fail("host.clock", "must be realtime or stepped")
        timeout_s = table.get("timeout_s", 60.0)
        if not (_is_number(timeout_s) and 0.1 <= timeout_s <= 1e5):
            raise self.fail("host.timeout_s", "must be a number from 0.1 to 1e5")
        runs = table.get("runs", 1 if clock == "stepped" else REALTIME_RUNS)
        if not (_is_whole(runs) and 1 <= runs <= 1000):
            raise self.fail("host.runs", "must be a whole number from 1 to 1000")
        if clock == "stepped" and runs > 1:
            raise self.fail("host.runs", 'belongs to clock = "realtime": a stepped host does the same each time')
        return Host(tuple(words), table.get("bus", "slcan-tcp"), clock == "stepped", float(timeout_s), runs)

    def check_fault(self, plan: Plan) -> None:
        names = {dimension.name for dimension in plan.dimensions}
        if not plan.kinds:
            for name in names:
                if name.startswith("fault."):
                    raise self.fail("dimension", f"{name} needs fault.kind")
            return
        if "fault.at_s" not in names:
            raise self.fail("dimension", "fault.kind needs fault.at_s")
        for dimension in plan.dimensions:
            parameter = dimension.fault_parameter
            if parameter is not None and parameter[0] not in plan.kinds:
                raise self.fail("dimension", f"{dimension.name}: fault.kind never is {parameter[0]}")
        for kind in plan.kinds:
            row = plan.faults[kind]
            varied = [f"fault.{kind}.{one['name']}" in names for one in row["parameters"]]
            for one, is_varied in zip(row["parameters"], varied):
                if one["required"] and not is_varied:
                    raise self.fail("dimension", f"\"fault.{kind}.{one['name']}\" is required: give it a value, a list or a range")
            if row["needs_one"] and not any(varied):
                first = row["parameters"][0]["name"]
                raise self.fail("dimension", f'"fault.{kind}.{first}" or another of its parameters is required')

    def check_rates(self, rates: Any, plan: Plan) -> None:
        """Failure rates of the kinds, in any unit: only their ratios count. The report reads them from the text."""
        if not isinstance(rates, dict):
            raise self.fail("rates", "must be a table")
        for kind, rate in rates.items():
            if kind not in plan.kinds:
                raise self.fail(f"rates.{kind}", "is no kind of fault of this plan")
            if not (_is_number(rate) and 0 <= rate <= ANYTHING):
                raise self.fail(f"rates.{kind}", "must be a number, 0 or more")
        missing = [kind for kind in plan.kinds if kind not in rates]
        if rates and missing:
            raise self.fail("rates", f"say nothing about {', '.join(missing)}")

    def check_lists(self, plan: Plan) -> None:
        if plan.sampling in ("full", "pairwise"):
            for dimension in plan.dimensions:
                if not isinstance(dimension.values, Listed):
                    raise self.fail(
                        "dimension", f"{dimension.name}: sampling {plan.sampling} needs a list, or a step in the range"
                    )

    def count_cases(self, plan: Plan) -> None:
        cases = Cases(plan)
        plan.numbers = plan.included = cases.numbers
        if plan.exclusions and plan.sampling in ("full", "latin") and cases.numbers <= MAX_COUNTED:
            plan.included = sum(cases.values(n) is not None for n in range(cases.numbers))
        if plan.included == 0:
            raise self.fail("exclude", "leaves no case")


def plan_hash(plan: Plan, program: Program) -> str:
    """Of the plan, the program's version and all files that decide results: hexadecimal."""
    total = hashlib.sha256(f"{program.version()}\0{plan.inputs}\0{plan.text}".encode())
    if plan.host is not None:
        # Words of the command that are files beside the plan: the script of a host.
        for word in plan.host.command:
            file = plan.file.absolute().parent / word
            if file.is_file():
                total.update(word.encode() + b"\0" + hashlib.sha256(file.read_bytes()).digest())
    return total.hexdigest()[:16]


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _is_values(table: Mapping[str, Any]) -> bool:
    return any(key in table for key in ("from", "to", "values", "mean"))


def _flat(table: Mapping[str, Any], prefix: str = "") -> List[Tuple[str, Any]]:
    """`fault.kind = …` is a table in a table, `"fault.kind" = …` is not: both give fault.kind."""
    names: List[Tuple[str, Any]] = []
    for key, node in table.items():
        if isinstance(node, dict) and node and not _is_values(node):
            names += _flat(node, f"{prefix}{key}.")
        else:
            names.append((prefix + key, node))
    return names


def _lines_of(text: str) -> Dict[str, int]:
    """The line on which each key is complete: tomllib tells no places, but reads beginnings of the text."""
    lines = text.split("\n")
    found: Dict[str, int] = {}
    for n in range(1, len(lines) + 1):
        try:
            document = tomllib.loads("\n".join(lines[:n]))
        except tomllib.TOMLDecodeError:
            continue
        for name, _ in _flat(document):
            found.setdefault(name, n)
    return found
