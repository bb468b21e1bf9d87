"""Exports all cases as CSV. The bytes do not depend on jobs, shards or interruptions."""

from __future__ import annotations

from typing import Any, Iterable, Iterator

from .judge import Result
from .values import value_text

COLUMNS = (
    "outcome", "fault_at_ns", "first_effect_at_ns", "detected_by_drive_ns", "detected_by_host_ns", "violated_at_ns",
    "violated", "margin", "state", "command", "note", "real_time", "runs", "flips", "false_alarm", "passive",
    "unasked_deg",
)  # fmt: skip


def export(plan_names: Iterable[str], results: Iterable[Result]) -> Iterator[str]:
    """Yields lines. Pre: `results` are in order of case numbers."""
    yield ",".join(["number", *map(_text, plan_names), *COLUMNS]) + "\n"
    for result in results:
        yield line_of(result)


def line_of(result: Result) -> str:
    fields = [str(result.number), *map(_text, result.values)]
    fields += [_text(getattr(result, column)) for column in COLUMNS]
    return ",".join(fields) + "\n"


def _text(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return value_text(value)
    text = " ".join(str(value).split("\n"))
    return '"' + text.replace('"', '""') + '"' if "," in text or '"' in text else text
