"""The text of a plan: its tables, and the line number of each key."""

from __future__ import annotations

import difflib
import math
import pathlib
import tomllib
from typing import Any, Collection, Dict, List, Mapping, Tuple

from .plan import PlanError


class PlanText:
    """Raises PlanError if the file cannot be read or is not TOML."""

    def __init__(self, file: pathlib.Path) -> None:
        self.file = file
        try:
            self.text = file.read_text(encoding="utf-8")
            self.document = tomllib.loads(self.text)
        except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as problem:
            raise PlanError(f"{file}: {problem}") from None
        self.lines = lines_of(self.text)

    def error(self, key: str, reason: str) -> PlanError:
        """Returns an error with the line on which the key is complete."""
        place = next((f":{n}" for name, n in self.lines.items() if name == key), "")
        return PlanError(f"{self.file}{place}: {key}: {reason}")

    def check_keys(self, table: Mapping[str, Any], known: set[str], path: str) -> None:
        for key in table:
            if key not in known:
                raise self.error(path + key, "unknown key" + did_you_mean(key, known))

    def table(self, key: str, known: set[str]) -> Mapping[str, Any]:
        table = self.document.get(key, {})
        if not isinstance(table, dict):
            raise self.error(key, "must be a table")
        self.check_keys(table, known, key + ".")
        return table

    def number(self, key: str, value: Any, otherwise: str) -> float:
        if not is_number(value):
            raise self.error(key, otherwise)
        return float(value)


def did_you_mean(word: str, known: Collection[str]) -> str:
    """Returns a hint for the most similar known word; empty if there is none."""
    near = difflib.get_close_matches(word, known, 1)
    return f", did you mean {near[0]}?" if near else ""


def is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def is_values(table: Mapping[str, Any]) -> bool:
    return any(key in table for key in ("from", "to", "values", "mean"))


def flat(table: Mapping[str, Any], prefix: str = "") -> List[Tuple[str, Any]]:
    """Joins names of nested tables by dots: `fault.kind = …` and `"fault.kind" = …` both give fault.kind."""
    names: List[Tuple[str, Any]] = []
    for key, node in table.items():
        if isinstance(node, dict) and node and not is_values(node):
            names += flat(node, f"{prefix}{key}.")
        else:
            names.append((prefix + key, node))
    return names


def lines_of(text: str) -> Dict[str, int]:
    """Maps each key to the line on which it is complete.

    tomllib reports no positions. So this parses the first n lines for each n, which takes quadratic time.
    """
    lines = text.split("\n")
    found: Dict[str, int] = {}
    for n in range(1, len(lines) + 1):
        try:
            document = tomllib.loads("\n".join(lines[:n]))
        except tomllib.TOMLDecodeError:
            continue
        for name, _ in flat(document):
            found.setdefault(name, n)
    return found
