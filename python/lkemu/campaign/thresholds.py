"""Parses and checks --require, the thresholds that a campaign must reach."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, List, Optional, Sequence

from ..errors import StartError
from .outcomes import OUTCOMES

if TYPE_CHECKING:
    from .answer import Answer, Group

MEASURES = ("coverage", "coverage.lower", "latency.p50_s", "latency.p99_s", "latency.worst_s")
QUANTILES = {"latency.p50_s": 0.5, "latency.p99_s": 0.99, "latency.worst_s": 1.0}
FORM = re.compile(r"\s*([a-z_0-9.]+)\s*(?:\[([^\]]+)\])?\s*([<>]=)\s*(\S+)\s*")


@dataclass(frozen=True)
class Threshold:
    text: str
    measure: str
    kind: str  # of fault; empty: all kinds
    at_least: bool
    limit: float


@dataclass(frozen=True)
class Checked:
    threshold: Threshold
    measured: Optional[float]
    missing: int  # cases without a result, which might have failed

    @property
    def holds(self) -> bool:
        if self.measured is None or self.missing > 0:
            return False
        limit = self.threshold.limit
        return self.measured >= limit if self.threshold.at_least else self.measured <= limit

    def __str__(self) -> str:
        measured = "nothing to measure" if self.measured is None else f"measured {self.measured:.6g}"
        return f"{self.threshold.text}: {measured}" + (f", but {self.missing} cases are missing" if self.missing else "")


def parse_threshold(text: str) -> Threshold:
    """Parses, for example, `coverage[jam]>=0.9`. Raises StartError."""
    form = FORM.fullmatch(text)
    if form is None:
        raise _error(text, "must be MEASURE>=NUMBER or MEASURE<=NUMBER, e.g. coverage>=0.99 or coverage[jam]>=0.9")
    measure, kind, sign, number = form.groups()
    known = [*MEASURES, *(one.key for one in OUTCOMES.values())]
    if measure not in known:
        raise _error(text, f"unknown measure {measure}; known: {', '.join(known)}")
    try:
        limit = float(number)
    except ValueError:
        raise _error(text, f"{number} is not a number") from None
    if measure.startswith("coverage") and not 0 <= limit <= 1:
        raise _error(text, "coverage must be from 0 to 1")
    if measure not in MEASURES and (limit < 0 or limit != int(limit)):
        raise _error(text, "a number of cases must be a whole number from 0")
    if measure in QUANTILES and not limit >= 0:
        raise _error(text, "a latency must be 0 s or longer")
    return Threshold(text.strip(), measure, kind or "", sign == ">=", limit)


def check_thresholds(answer: Answer, thresholds: Sequence[Threshold]) -> List[Checked]:
    """Raises StartError for a measure or kind that this campaign does not have."""
    return [Checked(one, _measured(answer, one), answer.missing) for one in thresholds]


def _group_of(answer: Answer, threshold: Threshold) -> Group:
    if not threshold.kind:
        return answer.all
    if threshold.kind not in answer.kinds:
        raise _error(threshold.text, f'the campaign has no fault "{threshold.kind}", but {", ".join(answer.kinds)}')
    return answer.kinds[threshold.kind]


def _measured(answer: Answer, threshold: Threshold) -> Optional[float]:
    group = _group_of(answer, threshold)
    if threshold.measure.startswith("coverage") and not answer.has_hazard:
        raise _error(threshold.text, "the plan has no [hazard], so no case is dangerous and there is no coverage")
    if threshold.measure == "coverage":
        return group.coverage.share
    if threshold.measure == "coverage.lower":
        if group.coverage.interval is None:
            raise _error(threshold.text, f'only sampling = "random" has an interval, and this campaign has "{answer.head.sampling}"')
        return group.coverage.interval[0]
    if threshold.measure in QUANTILES:
        return group.first.quantile_s(QUANTILES[threshold.measure])
    return float(sum(count for name, count in group.outcomes.items() if OUTCOMES[name].key == threshold.measure))


def _error(text: str, why: str) -> StartError:
    return StartError(f'--require: "{text.strip()}": {why}')
