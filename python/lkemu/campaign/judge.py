"""Judges a case: compares its run with a run without the fault (docs/guides/campaigns.md)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Dict, List, Mapping, Optional

from .outcomes import (
    CRASH,
    DETECTED_BY_DRIVE,
    DETECTED_BY_HOST,
    HANG,
    LATE,
    NO_EFFECT,
    NOT_FIRED,
    SILENTLY_WRONG,
    TOLERATED,
)
from .plan import Plan
from .sampling import Case

DANGEROUS, SAFE = "dangerous", "safe"
EXCEPTION = "uncaught "  # prefix of the note; the name of the exception follows


@dataclass
class Result:
    """The result of one case. Times are ns since the start of the scenario; None if the event did not occur."""

    number: int
    values: Case
    outcome: str = NOT_FIRED
    fault_at_ns: Optional[int] = None
    first_effect_at_ns: Optional[int] = None
    detected_by_drive_ns: Optional[int] = None
    detected_by_host_ns: Optional[int] = None
    violated_at_ns: Optional[int] = None  # first failure of a hazardous expectation
    violated: str = ""  # name of this expectation

    margin: Optional[float] = None  # of the worst hazardous expectation: 0 at its limit, negative if it failed
    state: str = ""  # of the drive when the fault acted
    command: str = ""  # latest command received by then
    note: str = ""
    unasked_deg: Optional[float] = None  # largest distance of an output in an unasked motion
    real_time: bool = False  # not reproducible bit by bit
    runs: int = 1
    flips: int = 0  # runs whose outcome differs from the worst one
    false_alarm: bool = False  # the host also detects something without the fault

    passive: str = ""  # DANGEROUS or SAFE with a host that does not react; empty: not run
    said: str = ""  # output of the host program; not exported
    wall_s: float = 0.0  # not exported


@dataclass
class HostEnd:
    """How a host program ended, and its detections."""

    EXITED, HUNG, DIED = "exited", "hung", "died"

    kind: str
    note: str  # "exit status 3"
    output: str = ""  # last line of a host that hung or died
    notices: List[Mapping[str, Any]] = field(default_factory=list)


def earlier(first: Optional[int], second: Optional[int]) -> Optional[int]:
    return second if first is None else first if second is None else min(first, second)


def _event_time(expectation: Mapping[str, Any], on_failure: bool) -> Optional[int]:
    """Returns the time at which a watched expectation passed, or failed; None if it did not."""
    if on_failure:
        return expectation.get("decided_at_ns") if expectation["status"] == "failed" else None
    return expectation.get("at_ns") if expectation["status"] == "passed" else None


def _if_caused_by_fault(without: Optional[int], at: Optional[int]) -> Optional[int]:
    """Returns `at` if the fault is the cause: without it, the event came later or not at all."""
    return at if at is not None and (without is None or at < without) else None


def _drive_errors(seen: Mapping[str, Any]) -> Dict[Any, int]:
    return {(one["bus"], one["id"], one["error"]): one["at_ns"] for one in seen["errors"]}


def is_in_time(at: Optional[int], result: Result, tolerant_ns: Optional[int]) -> bool:
    if at is None:
        return False
    since = next((one for one in (result.first_effect_at_ns, result.fault_at_ns) if one is not None), 0)
    if tolerant_ns is not None and at > since + tolerant_ns:
        return False
    return result.violated_at_ns is None or at <= result.violated_at_ns


def is_safe_by_detection(result: Result) -> bool:
    """True if the fault was detected and no hazard occurred. A hazard may have occurred without a reaction."""
    detected = earlier(result.detected_by_drive_ns, result.detected_by_host_ns) is not None
    return detected and result.violated_at_ns is None and result.outcome not in (NOT_FIRED, HANG, CRASH)


def judge(plan: Plan, result: Result, seen: Mapping[str, Any], reference: Optional[Mapping[str, Any]]) -> None:
    """Fills in `result` from the runs. `reference`: the run without the fault; None if the case has no fault."""
    fault = seen.get("fault")
    if fault is not None:
        result.fault_at_ns, result.first_effect_at_ns = fault.get("began_at_ns"), fault.get("first_effect_at_ns")
        result.state, result.command = fault["state"], fault["command"]
    _judge_hazards(plan, result, seen, reference)
    result.unasked_deg = seen.get("unasked_deg")
    before = _drive_errors(reference) if reference is not None else {}
    for which, at in _drive_errors(seen).items():
        result.detected_by_drive_ns = earlier(result.detected_by_drive_ns, _if_caused_by_fault(before.get(which), at))
    for n, rule in enumerate(plan.detection.host):
        on_failure = "answered" in rule
        without = None if reference is None else _event_time(reference["detect"][n], on_failure)
        result.false_alarm = result.false_alarm or without is not None
        at = _if_caused_by_fault(without, _event_time(seen["detect"][n], on_failure))
        result.detected_by_host_ns = earlier(result.detected_by_host_ns, at)
    invalid: List[str] = seen.get("invalid", [])
    invalid_without = [] if reference is None else reference.get("invalid", [])
    if len(invalid) > len(invalid_without) and result.first_effect_at_ns is not None:
        result.note = invalid[-1]
    same_replies = reference is not None and reference["replies"] == seen["replies"]
    result.outcome = outcome_of(plan, result, fault is not None, same_replies)


def _judge_hazards(
    plan: Plan, result: Result, seen: Mapping[str, Any], reference: Optional[Mapping[str, Any]]
) -> None:
    for n, one in enumerate(seen["expect"]):
        hazardous = not plan.hazards or plan.expectations[n] in plan.hazards
        # An expectation that fails without the fault as well is ignored.
        if not hazardous or (reference is not None and reference["expect"][n]["status"] != "passed"):
            continue
        if "margin" in one:
            result.margin = one["margin"] if result.margin is None else min(result.margin, one["margin"])
        if one["status"] == "passed":
            continue
        _add_violation(result, one.get("decided_at_ns", 0), one["says"])
    for kind in plan.advice:
        if kind in seen["advice"] and (reference is None or kind not in reference["advice"]):
            _add_violation(result, seen["advice"][kind]["at_ns"], seen["advice"][kind]["text"])


def _add_violation(result: Result, at_ns: int, what: str) -> None:
    if result.violated_at_ns is None or at_ns < result.violated_at_ns:
        result.violated_at_ns, result.violated = at_ns, what


def judge_host(plan: Plan, result: Result, end: HostEnd, reference: Optional[HostEnd]) -> None:
    """Adds the end and the detections of a host program. Pre: `judge` has filled in `result`.

    `reference`: end of the host without the fault; None if the case has no fault.
    """
    result.note, result.said = end.note, end.output
    result.false_alarm = result.false_alarm or (reference is not None and bool(reference.notices))
    notice = _first_notice(result, end, reference)
    if notice is not None:
        result.detected_by_host_ns = earlier(result.detected_by_host_ns, notice["at_ns"])
        if notice["rule"] > 0:
            result.note += f"; line {notice['rule']} of [detect]"
            result.said = notice["text"]
    has_fault = reference is not None
    result.outcome = outcome_of(plan, result, has_fault, result.outcome == NO_EFFECT)
    if reference is not None and reference.kind != HostEnd.EXITED:
        result.outcome = NOT_FIRED
        result.note, result.said = f"also without the fault: {reference.note}", reference.output
    elif end.kind != HostEnd.EXITED and not (has_fault and result.first_effect_at_ns is None):
        result.outcome = HANG if end.kind == HostEnd.HUNG else CRASH


def _first_notice(result: Result, end: HostEnd, reference: Optional[HostEnd]) -> Optional[Mapping[str, Any]]:
    """Returns the first notice that the fault has caused.

    In real time, two runs never print a line at the same instant. So a line that the reference also prints is ignored
    there, whatever its time.
    """
    since = (result.first_effect_at_ns or 0) // 1000 * 1000  # times of hosts have a resolution of 1 µs
    for one in end.notices:
        in_reference = reference is not None and any(
            other["gist"] == one["gist"] and (result.real_time or other["at_ns"] <= one["at_ns"]) for other in reference.notices
        )
        if one["at_ns"] >= since and not in_reference:
            return one
    return None


def outcome_of(plan: Plan, result: Result, has_fault: bool, same_replies: bool) -> str:
    """Returns the first outcome whose condition holds."""
    if has_fault and result.first_effect_at_ns is None:
        return NOT_FIRED
    if is_in_time(result.detected_by_host_ns, result, plan.tolerant_time_ns):
        return DETECTED_BY_HOST
    if is_in_time(result.detected_by_drive_ns, result, plan.tolerant_time_ns):
        return DETECTED_BY_DRIVE
    if result.detected_by_host_ns is not None or result.detected_by_drive_ns is not None:
        return LATE
    if result.violated_at_ns is not None:
        return SILENTLY_WRONG
    return NO_EFFECT if same_replies else TOLERATED
