"""Finds the smallest failing case of each kind of fault and outcome among the results."""

from __future__ import annotations

import math
from typing import Any, Dict, List, Mapping, Sequence, Tuple

from .judge import Result

Key = Tuple[Any, ...]


def _is_severity(name: str) -> bool:
    """True for dimensions of duration and strength of a fault, false for those of time and place."""
    parts = name.split(".")
    return name in ("fault.for_s", "fault.probability") or (parts[0] == "fault" and len(parts) == 3)


class Smallest:
    """Finds, for each kind and outcome, a failing case that no other one dominates.

    A case dominates another one if no number of it is more harmful and at least one is less harmful. The case with the
    least sum of numbers, each scaled to its range, has this property. Rounding may make sums equal: then the numbers
    themselves are compared. Duration and strength come first, then the other numbers. Words are ignored.
    """

    def __init__(self, dimensions: Sequence[Mapping[str, Any]]) -> None:
        numbers = [(n, one) for n, one in enumerate(dimensions) if "words" not in one]
        self._groups = [[(n, one) for n, one in numbers if _is_severity(one["name"]) is severity] for severity in (True, False)]
        self._least: Dict[Tuple[str, str], Tuple[Key, Result]] = {}

    def add(self, kind: str, result: Result) -> None:
        key = (*(part for group in self._groups for part in self._harm(group, result)), result.number)
        place = kind, result.outcome
        if place not in self._least or key < self._least[place][0]:
            self._least[place] = key, result

    def found(self) -> List[Tuple[str, Result]]:
        """Returns kinds and results, sorted by kind and case number."""
        return sorted(((kind, result) for (kind, _), (_, result) in self._least.items()), key=lambda one: (one[0], one[1].number))

    @staticmethod
    def _harm(group: List[Tuple[int, Mapping[str, Any]]], result: Result) -> Tuple[float, Tuple[float, ...]]:
        """Returns the sum of the scaled numbers, and the numbers; in both, less is more harmless."""
        shares, values = [], []
        for n, one in group:
            value = result.values[n]
            if not isinstance(value, (int, float)):
                continue  # the dimension does not apply to this kind
            least, most = (-one["to"], -one["from"]) if one["harmless_is_most"] else (one["from"], one["to"])
            signed = -value if one["harmless_is_most"] else value
            values.append(signed)
            shares.append((signed - least) / (most - least) if most > least else 0.0)
        return math.fsum(shares), tuple(values)
