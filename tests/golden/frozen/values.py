"""Reduces output to its values: numbers, identifiers, bytes and times, without wording."""

from __future__ import annotations

import csv
import io
import json
import re
from typing import Any, Iterable

# Keys and columns with text for people.
WORDING = {
    "about", "about_zh", "drawback", "error_words", "evidence", "expected", "first_on", "foreign", "measured", "note",
    "problem", "reason", "robot", "says", "says_zh", "todo", "todo_zh", "violated", "what", "what_zh",
}
# Keys and columns that differ between machines.
MACHINE = {"directory", "file", "pid", "said", "version", "wall_s", "x_real_time"}
# Objects whose keys are sentences: only their values are kept.
KEYED_BY_WORDING = {"meaningless"}
# Lists of sentences: only their length is kept.
SENTENCES = {"invalid"}


def values_of(answer: Any) -> Any:
    """Drops the keys named above, and the name of a command where its byte is given too."""
    if isinstance(answer, list):
        return [values_of(one) for one in answer]
    if not isinstance(answer, dict):
        return answer
    kept = {}
    for key, value in answer.items():
        if key in WORDING or key in MACHINE or (key == "name" and "command" in answer):
            continue
        if key in KEYED_BY_WORDING:
            kept[key] = sorted(value.values())
        elif key in SENTENCES:
            kept[key] = len(value)
        else:
            kept[key] = values_of(value)
    return kept


def json_text(answer: Any) -> str:
    """Returns one value per line, for diff."""
    return json.dumps(values_of(answer), indent=0, sort_keys=True, ensure_ascii=False) + "\n"


def json_lines_text(text: str) -> str:
    """As json_text(), for output with one object per line."""
    lines = (json.dumps(values_of(json.loads(line)), sort_keys=True, ensure_ascii=False) for line in text.splitlines())
    return "".join(line + "\n" for line in lines)


def csv_text(text: str) -> str:
    """Returns the CSV text without columns of wording."""
    rows = list(csv.reader(io.StringIO(text)))
    if not rows:
        return ""
    kept = [n for n, name in enumerate(rows[0]) if name not in WORDING | MACHINE]
    return "".join(",".join(row[n] for n in kept) + "\n" for row in rows)


def renamed(text: str, bus: str) -> str:
    """Replaces the bus name, which contains a port or a path, by "bus"."""
    return text.replace(bus, "bus")


def frame_lines(log: str) -> list[str]:
    """Returns lines of a candump log without the interface name."""
    return [re.sub(r"^(\(\S+\)) \S+ ", r"\1 ", line) for line in log.splitlines()]


def text_of(lines: Iterable[str]) -> str:
    return "".join(line + "\n" for line in lines)
