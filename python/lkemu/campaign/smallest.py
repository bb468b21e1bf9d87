"""The smallest failing case of each kind of fault and outcome, from the rows themselves."""

from __future__ import annotations

import math
from typing import Any, Dict, List, Mapping, Sequence, Tuple

from .judge import Result

Key = Tuple[Any, ...]


def _is_severity(name: str) -> bool:
    """How long and how strong the fault is, not when and where."""
    parts = name.split(".")
    return name in ("fault.for_s", "fault.probability") or (parts[0] == "fault" and len(parts) == 3)


class Smallest:
    """No other failing case of the same kind and outcome is at least as harmless in every number and more harmless in one.

    The least sum of shares of the ranges has this property; the values themselves decide between equal sums, which rounding
    may have made equal. Severities come first, then the other numbers. Words have no order and do not count."""

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
        """Kinds and results, by kind and number."""
        return sorted(((kind, result) for (kind, _), (_, result) in self._least.items()), key=lambda one: (one[0], one[1].number))

    @staticmethod
    def _harm(group: List[Tuple[int, Mapping[str, Any]]], result: Result) -> Tuple[float, Tuple[float, ...]]:
        """Of dimensions: the sum of the shares of their ranges, and the values, the harmless ones first."""
        shares, values = [], []
        for n, one in group:
            value = result.values[n]
            if not isinstance(value, (int, float)):
                continue  # does not count for this kind
            least, most = (-one["to"], -one["from"]) if one["harmless_is_most"] else (one["from"], one["to"])
            signed = -value if one["harmless_is_most"] else value
            values.append(signed)
            shares.append((signed - least) / (most - least) if most > least else 0.0)
        return math.fsum(shares), tuple(values)
