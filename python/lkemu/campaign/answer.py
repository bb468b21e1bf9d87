"""Evaluates the results of a campaign: outcomes, diagnostic coverage, latencies, failing cases."""

from __future__ import annotations

import math
import re
import shlex
import tomllib
from array import array
from collections import Counter
from dataclasses import dataclass, field
from typing import Dict, Iterable, List, Mapping, Optional, Tuple

import numpy
from scipy.special import betaincinv

from .judge import DANGEROUS, EXCEPTION, Result, earlier
from .outcomes import CRASH, DETECTED_BY_DRIVE, DETECTED_BY_HOST, HANG, LATE, NOT_FIRED, OUTCOMES
from .smallest import Smallest
from .store import Head

CONFIDENCE = 0.95
MAX_RESIDUAL = 25_000  # failing cases kept for each outcome; more are only counted
MAX_ENDS = 100  # distinct ends of hosts that are counted
STATES = ("off", "stopped", "running")


def is_dangerous(result: Result) -> bool:
    """True if a hazard occurred, or would have occurred without the host's reaction.

    Also true if the host hung or crashed, because it could not have prevented a hazard.
    """
    hazard = result.violated_at_ns is not None or result.passive == DANGEROUS
    return result.outcome != NOT_FIRED and (hazard or result.outcome in (HANG, CRASH))


def clopper_pearson(hits: int, trials: int) -> Tuple[float, float]:
    """Returns the exact interval of Clopper and Pearson (1934), with half of 1 - CONFIDENCE on either side."""
    tail = (1 - CONFIDENCE) / 2
    lower = float(betaincinv(hits, trials - hits + 1, tail)) if hits > 0 else 0.0
    upper = 1 - float(betaincinv(trials - hits, hits + 1, tail)) if hits < trials else 1.0
    return lower, upper


@dataclass
class Coverage:
    """Diagnostic coverage, λ_DD / λ_D of IEC 61508: the share of the dangerous cases that was detected in time.

    A detected case without a hazard is dangerous if a hazard would have occurred without the host's reaction.
    If this is unknown, coverage has a lower and an upper bound.
    """

    detected: int = 0  # dangerous and detected in time
    dangerous: int = 0
    open_in_time: int = 0  # detected in time; unknown whether dangerous
    open_late: int = 0  # detected late; unknown whether dangerous
    interval: Optional[Tuple[float, float]] = None

    @property
    def share(self) -> Optional[float]:
        """Lower bound: of the open cases, those detected in time count as safe, those detected late as dangerous."""
        dangerous = self.dangerous + self.open_late
        return self.detected / dangerous if dangerous else None

    @property
    def upper(self) -> Optional[float]:
        """Upper bound: of the open cases, those detected in time count as dangerous, those detected late as safe."""
        dangerous = self.dangerous + self.open_in_time
        return (self.detected + self.open_in_time) / dangerous if dangerous else None

    def add_interval(self) -> None:
        lower, _ = clopper_pearson(self.detected, self.dangerous + self.open_late)
        _, upper = clopper_pearson(self.detected + self.open_in_time, self.dangerous + self.open_in_time)
        self.interval = lower, upper


class Latencies:
    """Times from the first effect of a fault to its detection, in ns."""

    def __init__(self) -> None:
        self._values = array("q")
        self._sorted = True

    def __len__(self) -> int:
        return len(self._values)

    def add(self, since: Optional[int], at: Optional[int]) -> None:
        if since is not None and at is not None:
            self._values.append(at - since)
            self._sorted = False

    def quantile_s(self, share: float) -> Optional[float]:
        """Returns the nearest-rank quantile: at least this share of the cases has this latency or a shorter one."""
        if not self._values:
            return None
        if not self._sorted:
            numpy.frombuffer(self._values, numpy.int64).sort()
            self._sorted = True
        return self._values[max(math.ceil(share * len(self._values)), 1) - 1] / 1e9

    @property
    def worst_s(self) -> Optional[float]:
        return self.quantile_s(1.0)


@dataclass
class Group:
    """Statistics of the cases with one kind of fault, or of all cases."""

    kind: str  # empty: all kinds
    outcomes: "Counter[str]" = field(default_factory=Counter)
    coverage: Coverage = field(default_factory=Coverage)
    safe_detected: int = 0  # detected in time or late, without a hazard
    safe_undetected: int = 0
    false_alarms: int = 0  # cases whose host also detects something without the fault
    by_drive: Latencies = field(default_factory=Latencies)
    by_host: Latencies = field(default_factory=Latencies)
    first: Latencies = field(default_factory=Latencies)  # of the detection that came first

    @property
    def cases(self) -> int:
        return sum(self.outcomes.values())

    @property
    def fired(self) -> int:
        return self.cases - self.outcomes[NOT_FIRED]

    @property
    def failures(self) -> int:
        return sum(count for name, count in self.outcomes.items() if OUTCOMES[name].failure)

    def add(self, result: Result, can_react: bool) -> None:
        self.outcomes[result.outcome] += 1
        self.false_alarms += result.false_alarm
        if result.outcome == NOT_FIRED:
            return
        in_time = OUTCOMES[result.outcome].in_time
        if is_dangerous(result):
            self.coverage.dangerous += 1
            self.coverage.detected += in_time
        elif in_time or result.outcome == LATE:
            self.safe_detected += 1
            if can_react and not result.passive:
                self.coverage.open_in_time += in_time
                self.coverage.open_late += not in_time
        else:
            self.safe_undetected += 1
        effect, drive, host = result.first_effect_at_ns, result.detected_by_drive_ns, result.detected_by_host_ns
        self.by_drive.add(effect, drive)
        self.by_host.add(effect, host)
        self.first.add(effect, earlier(drive, host))


@dataclass
class Space:
    """Covered combinations of the kind of fault, and the drive's state and latest command when the fault acted."""

    kinds: List[str] = field(default_factory=list)
    states: List[str] = field(default_factory=lambda: list(STATES))
    commands: List[str] = field(default_factory=list)
    cells: Dict[Tuple[str, str, str], List[int]] = field(default_factory=dict)  # number of cases, number of failures

    @property
    def size(self) -> int:
        return len(self.kinds) * len(self.states) * len(self.commands)

    @property
    def holes(self) -> int:
        return self.size - len(self.cells)

    def add(self, kind: str, result: Result) -> None:
        if not result.state and not result.command:
            return  # unknown if a host program commands the drive
        place = kind, result.state or "unknown", result.command or "none"
        for word, known in zip(place, (self.kinds, self.states, self.commands)):
            if word not in known:
                known.append(word)
        cell = self.cells.setdefault(place, [0, 0])
        cell[0] += 1
        cell[1] += OUTCOMES[result.outcome].failure


@dataclass
class Answer:
    head: Head
    all: Group = field(default_factory=lambda: Group(""))
    kinds: Dict[str, Group] = field(default_factory=dict)
    space: Space = field(default_factory=Space)
    residual: List[Result] = field(default_factory=list)
    smallest: List[Tuple[str, Result]] = field(default_factory=list)  # kind of fault and failing case (smallest.py)

    real_time: int = 0  # cases in real time
    flipped: int = 0  # real-time cases whose runs differ in outcome
    in_time: "Counter[str]" = field(default_factory=Counter)  # dangerous cases detected in time, by outcome

    ends: "Counter[str]" = field(default_factory=Counter)  # how hosts that hung or crashed ended
    rates: Mapping[str, float] = field(default_factory=dict)  # failure rates of the plan, by kind
    has_hazard: bool = True  # the plan has [hazard]

    machine_failures: Mapping[str, int] = field(default_factory=dict)  # cases without a result, by reason
    has_host: bool = False  # a host program can react to faults; the host of a scenario cannot

    @property
    def missing(self) -> int:
        return self.head.cases - self.all.cases

    def command_of(self, number: int) -> str:
        return shlex.join(["lk-emu", "campaign", self.head.plan_called or self.head.plan_name + ".toml", "--case", str(number)])

    @property
    def weighted_coverage(self) -> Optional[float]:
        """Lower bound of coverage, weighted by the plan's failure rates; None without rates.

        Each kind of fault counts with its rate times its share of dangerous cases.
        """
        detected = dangerous = 0.0
        for kind, rate in self.rates.items():
            group = self.kinds.get(kind)
            if group is not None and group.fired > 0:
                detected += rate * group.coverage.detected / group.fired
                dangerous += rate * (group.coverage.dangerous + group.coverage.open_late) / group.fired
        return detected / dangerous if dangerous > 0 else None


def kind_place(head: Head) -> Optional[int]:
    names = [one["name"] for one in head.dimensions]
    return names.index("fault.kind") if "fault.kind" in names else None


def kind_of(result: Result, place: Optional[int]) -> str:
    if place is None:
        return "any"
    kind = result.values[place]
    return "none" if kind is None else str(kind)


def answer_of(head: Head, results: Iterable[Result], machine_failures: Mapping[str, int] = {}) -> Answer:
    plan = tomllib.loads(head.plan_text)
    answer = Answer(head, rates=plan.get("rates", {}), has_hazard="hazard" in plan, has_host="host" in plan, machine_failures=machine_failures)
    place = kind_place(head)
    if place is not None:
        answer.kinds = {kind: Group(kind) for kind in head.dimensions[place]["words"]}
        answer.space.kinds = list(answer.kinds)
    kept: "Counter[str]" = Counter()
    smallest = Smallest(head.dimensions)
    for result in results:
        kind = kind_of(result, place)
        answer.all.add(result, answer.has_host)
        answer.kinds.setdefault(kind, Group(kind)).add(result, answer.has_host)
        if OUTCOMES[result.outcome].in_time and is_dangerous(result):
            answer.in_time[result.outcome] += 1
        answer.real_time += result.real_time
        answer.flipped += result.flips > 0
        if result.outcome != NOT_FIRED:
            answer.space.add(kind, result)
        end = result.note.partition("; ")[0]
        if result.outcome in (HANG, CRASH) and (end in answer.ends or len(answer.ends) < MAX_ENDS):
            answer.ends[end] += 1
        if OUTCOMES[result.outcome].failure:
            smallest.add(kind, result)
            if kept[result.outcome] < MAX_RESIDUAL:
                kept[result.outcome] += 1
                answer.residual.append(result)
    answer.smallest = smallest.found()
    answer.space.commands.sort()
    if head.sampling == "random":
        for group in (answer.all, *answer.kinds.values()):
            group.coverage.add_interval()
    return answer


def conclusion(answer: Answer) -> str:
    """Summarizes the campaign in a few sentences."""
    return " ".join([_finding(answer), *(f"{text}." for text, _ in uncounted_ends(answer))])


def _finding(answer: Answer) -> str:
    group, coverage = answer.all, answer.all.coverage
    if not answer.has_hazard:
        return f"{group.failures} of {group.cases} cases failed. The plan has no [hazard], so there is no coverage."
    if coverage.dangerous == 0:
        text = f"No hazard occurred in {group.fired} cases whose fault took effect."
    else:
        text = f"{coverage.dangerous} of {group.cases} cases were dangerous; {_detected(answer)}."
    open_ = coverage.open_in_time + coverage.open_late
    if open_:
        text += (
            f" {open_} more were detected without a hazard. The host's reaction may have prevented one; "
            "set [host] passive in the plan to find out."
        )
    return text


def _detected(answer: Answer) -> str:
    coverage = answer.all.coverage
    if coverage.detected == 0:
        return ("the host detected none" if answer.has_host else "none was detected") + " in time"
    by = [f"{answer.in_time[name]} by the {who}" for name, who in ((DETECTED_BY_HOST, "host"), (DETECTED_BY_DRIVE, "drive")) if answer.in_time[name]]
    if len(by) == 1:
        by = ["all " + by[0].partition(" ")[2]] if coverage.detected > 1 else [by[0].partition(" ")[2]]
    return f"{coverage.detected} of these {'was' if coverage.detected == 1 else 'were'} detected in time, {' and '.join(by)} ({100 * coverage.detected / coverage.dangerous:.1f} %)"


def uncounted_ends(answer: Answer) -> List[Tuple[str, str]]:
    """Lists how hosts hung or crashed, each with the line of [[detect.host]] that would make it a detection.

    The line is empty if no rule can match.
    """
    found = []
    for end, count in sorted(answer.ends.items(), key=lambda one: (-one[1], one[0])):
        hosts = f"{count} host{'' if count == 1 else 's'}"
        if end.startswith("exit status "):
            found.append((f"{hosts} exited with status {end.split()[-1]}, which [detect] does not count", f"exit_status = {end.split()[-1]}"))
        elif end.startswith(EXCEPTION):
            name = end.removeprefix(EXCEPTION)
            found.append((f"{hosts} ended by an uncaught {name}, which [detect] does not count", f"says = '^{re.escape(name)}\\b'"))
        else:
            found.append((f"{hosts} {end}" if end.startswith("did not") else f"{hosts} died: {end}", ""))
    return found
