"""Formats the report of a campaign as text, HTML, JUnit and JSON (docs/guides/campaigns.md)."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any, Dict, List, Optional, Sequence, Tuple

import jinja2

from ..command import printable
from ..page_style import page_style
from .answer import Answer, Coverage, Group, Latencies, conclusion, kind_of, kind_place, uncounted_ends
from .compare import Comparison
from .judge import Result
from .outcomes import NOT_FIRED, OUTCOMES
from .thresholds import Checked
from .values import value_text

CASES_IN_TEXT = 5  # per outcome
CASES_IN_PAGE = 1000
CASES_IN_JUNIT = 10
SMALLEST_IN_TEXT = 10
HEADINGS = ("not fired", "no effect", "tolerated", "drive", "host", "late", "silent", "hang", "crash")


def number_text(value: Optional[float]) -> str:
    return "-" if value is None else f"{value:.4g}"


def coverage_text(coverage: Coverage) -> str:
    if coverage.share is None:
        return "no hazard occurred, or all dangerous cases were detected in time" if coverage.open_in_time else "no case was dangerous"
    if coverage.upper is None:
        return "0, or no case was dangerous"  # all possibly dangerous cases were detected late
    if coverage.open_in_time + coverage.open_late:
        text = f"from {coverage.share:.4f} to {coverage.upper:.4f}"
    else:
        text = f"{coverage.share:.4f}, {coverage.detected} of {coverage.dangerous}"
    if coverage.interval is not None:
        text += f" (95 %: {coverage.interval[0]:.4f} to {coverage.interval[1]:.4f})"
    return text


def sentence(answer: Answer, result: Result) -> str:
    """Describes the result of a case on one line."""
    kind = kind_place(answer.head)
    values = ", ".join(
        f"{dimension['name']}={value_text(value)}"
        for dimension, value in zip(answer.head.dimensions, result.values)
        if value is not None and dimension["name"] != "fault.kind"
    )
    times = (
        ("began", result.fault_at_ns), ("first effect", result.first_effect_at_ns), ("drive", result.detected_by_drive_ns),
        ("host", result.detected_by_host_ns),
    )  # fmt: skip
    text = f"case {result.number}: {result.outcome}: {kind_of(result, kind)}" + (f" ({values})" if values else "")
    text += "".join(f", {what} at {at / 1e9:.6g} s" for what, at in times if at is not None)
    if result.violated_at_ns is not None:
        text += f", {result.violated} failed at {result.violated_at_ns / 1e9:.6g} s"
    for note in (result.note, result.said):
        text += f"; {note}" if note else ""
    return printable(text)


def text_report(answer: Answer, required: Sequence[Checked]) -> str:
    return _render("report.txt.j2", answer, required, CASES_IN_TEXT, table=_table(answer), smallest_most=SMALLEST_IN_TEXT)


def page(answer: Answer, required: Sequence[Checked], comparison: Optional[Comparison] = None) -> str:
    groups = [*(group for group in answer.kinds.values() if group.cases), answer.all]
    latencies = [(group.kind, group.first) for group in groups[:-1] if len(group.first)]
    latencies += [("all", answer.all.first), ("all, by the drive", answer.all.by_drive), ("all, by the host", answer.all.by_host)]
    return _render("page.html.j2", answer, required, CASES_IN_PAGE, style=page_style(), groups=groups, outcomes=OUTCOMES,
                   comparison=comparison, latencies=latencies)  # fmt: skip


def junit(answer: Answer) -> str:
    return _render("junit.xml.j2", answer, (), 0, tests=[_test(answer, group) for group in answer.kinds.values()])


def _render(template: str, answer: Answer, required: Sequence[Checked], most: int, **more: Any) -> str:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("lkemu.campaign"),
        autoescape=not template.endswith(".txt.j2"),
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters.update(number=number_text, printable=printable, coverage=coverage_text, sentence=lambda result: sentence(answer, result))
    text = environment.get_template(template).render(
        answer=answer, head=answer.head, conclusion=conclusion(answer), uncounted=uncounted_ends(answer), required=required,
        residual=_residual(answer, most), most=most, **more
    )
    return _clean(text)


def _clean(text: str) -> str:
    """Replaces control characters, which an untrusted results file may contain."""
    return "".join(c if c.isprintable() or c in "\n\t" else "?" for c in text)


def _residual(answer: Answer, most: int) -> List[Tuple[str, int, List[Result]]]:
    """Returns each failing outcome with its number of cases and the first `most` cases."""
    found = []
    for name, outcome in OUTCOMES.items():
        count = answer.all.outcomes[name]
        if outcome.failure and count:
            found.append((name, count, [one for one in answer.residual if one.outcome == name][:most]))
    return found


def _table(answer: Answer) -> str:
    rates = ("rate",) if answer.rates else ()
    rows = [["fault", "cases", *HEADINGS, *rates, *(("dangerous", "in time", "coverage") if answer.has_hazard else ()), "p50 s", "p99 s", "worst s"]]
    for group in (*(group for group in answer.kinds.values() if group.cases), answer.all):
        row = [printable(group.kind or "all"), str(group.cases), *(str(group.outcomes[name] or "-") for name in OUTCOMES)]
        if answer.rates:
            row.append(number_text(answer.rates.get(group.kind)))
        if answer.has_hazard:
            share = group.coverage.share
            row += [str(group.coverage.dangerous), str(group.coverage.detected), "-" if share is None else f"{share:.4f}"]
        rows.append([*row, *(number_text(group.first.quantile_s(share)) for share in (0.5, 0.99, 1.0))])
    widths = [max(len(row[n]) for row in rows) for n in range(len(rows[0]))]
    return "".join(
        "  ".join([row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:]))]).rstrip() + "\n"
        for row in rows
    )


def _test(answer: Answer, group: Group) -> Dict[str, str]:
    test = {"kind": group.kind, "verdict": "passed", "message": "", "text": ""}
    if group.cases == 0:
        return {**test, "verdict": "skipped", "message": "no cases"}
    if group.outcomes[NOT_FIRED] == group.cases:
        return {**test, "verdict": "error", "message": f"took effect in none of {group.cases} cases"}
    if group.failures == 0:
        return test
    counts = ", ".join(f"{group.outcomes[name]} {name}" for name in reversed(OUTCOMES) if group.outcomes[name])
    place = kind_place(answer.head)
    failing = [one for one in answer.residual if kind_of(one, place) == group.kind]
    lines = [f"{sentence(answer, one)}\n  {answer.command_of(one.number)}\n" for one in failing[:CASES_IN_JUNIT]]
    more = ["for more, see --json\n"] if len(failing) > CASES_IN_JUNIT else []
    return {**test, "verdict": "failure", "message": f"of {group.cases} cases, {counts}", "text": "".join(lines + more)}


# JSON


def json_report(answer: Answer, required: Sequence[Checked]) -> str:
    head = asdict(answer.head)
    plan_text, tolerant = head.pop("plan_text"), head.pop("tolerant_time_ns")
    report = {
        "type": "campaign",
        "campaign": {**head, "tolerant_time_s": None if tolerant is None else tolerant / 1e9, "plan": plan_text},
        "conclusion": conclusion(answer),
        "case_command": answer.command_of(0)[:-1],
        "outcomes": [one.key for one in OUTCOMES.values()],
        "machine_failures": dict(answer.machine_failures),
        "real_time": answer.real_time,
        "flipped": answer.flipped,
        "all": _group_json(answer, answer.all),
        "kinds": [_group_json(answer, group) for group in answer.kinds.values()],
        "weighted_coverage": answer.weighted_coverage,
        "space": _space_json(answer),
        "required": [{"text": one.threshold.text, "holds": one.holds, "measured": one.measured, "missing": one.missing} for one in required],
        "residual": [case_json(answer, one) for one in answer.residual],
        "smallest": [{"kind": kind, "outcome": OUTCOMES[one.outcome].key, "command": answer.command_of(one.number),
                      "case": case_json(answer, one)} for kind, one in answer.smallest],
    }  # fmt: skip
    return json.dumps(report, ensure_ascii=False) + "\n"


def case_json(answer: Answer, result: Result) -> Dict[str, Any]:
    names = [one["name"] for one in answer.head.dimensions]
    row = asdict(result)
    row["outcome"] = OUTCOMES[result.outcome].key
    row["values"] = {name: value for name, value in zip(names, result.values) if value is not None}
    return row


def comparison_json(answer: Answer, comparison: Comparison) -> str:
    moves = [{"before": OUTCOMES[old].key, "now": OUTCOMES[new].key, "cases": count} for (old, new), count in comparison.moves.items()]
    counts = ("worse", "better", "same", "not_fired", "only_before", "only_now")
    report = {
        "type": "comparison",
        **{name: getattr(comparison, name) for name in counts},
        "before": {"version": comparison.before.version, "input_hash": comparison.before.input_hash},
        "moves": moves,
        "cases": [{"before": OUTCOMES[old].key, "case": case_json(answer, result)} for old, result in comparison.cases],
    }
    return json.dumps(report, ensure_ascii=False) + "\n"


def comparison_text(answer: Answer, comparison: Comparison) -> str:
    lines = [f"{comparison.worse} worse, {comparison.better} better, {comparison.same} the same"]
    neither = (
        (comparison.not_fired, "did not fire before or now"), (comparison.only_before, "have no result now"),
        (comparison.only_now, "had no result before"),
    )  # fmt: skip
    lines += [f"{count} {what}" for count, what in neither if count]
    lines += [f"  {count} {old} -> {new}" for (old, new), count in comparison.changes]
    for old, result in comparison.cases[:CASES_IN_JUNIT]:
        lines += [f"was {old}: {sentence(answer, result)}", f"  {answer.command_of(result.number)}"]
    return _clean("\n".join(lines) + "\n")


def _group_json(answer: Answer, group: Group) -> Dict[str, Any]:
    coverage = group.coverage
    return {
        "kind": group.kind,
        "failure_rate": answer.rates.get(group.kind),
        "cases": group.cases,
        "outcomes": {one.key: group.outcomes[name] for name, one in OUTCOMES.items()},
        "coverage": {"detected": coverage.detected, "dangerous": coverage.dangerous, "open_in_time": coverage.open_in_time, "open_late": coverage.open_late,
                     "share": coverage.share, "upper": coverage.upper, "interval": coverage.interval}
        if answer.has_hazard
        else None,
        "safe_detected": group.safe_detected,
        "safe_undetected": group.safe_undetected,
        "false_alarms": group.false_alarms,
        "latency": {"drive": _latency_json(group.by_drive), "host": _latency_json(group.by_host), "first": _latency_json(group.first)},
    }


def _latency_json(latencies: Latencies) -> Dict[str, Any]:
    return {"cases": len(latencies), "p50_s": latencies.quantile_s(0.5), "p99_s": latencies.quantile_s(0.99), "worst_s": latencies.worst_s}


def _space_json(answer: Answer) -> Optional[Dict[str, Any]]:
    space = answer.space
    if space.size == 0:
        return None
    met = [{"kind": kind, "state": state, "command": command, "cases": cell[0], "failures": cell[1]}
           for (kind, state, command), cell in sorted(space.cells.items())]  # fmt: skip
    return {"kinds": space.kinds, "states": space.states, "commands": space.commands, "combinations": space.size, "holes": space.holes,
            "met": met}  # fmt: skip
