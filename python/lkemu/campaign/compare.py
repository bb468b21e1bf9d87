"""Compares two campaigns of the same plan, case by case."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Iterable, Iterator, List, Optional, Tuple

from ..errors import StartError
from .judge import Result
from .outcomes import NOT_FIRED, OUTCOMES
from .store import Head
from .values import value_text

MAX_WORSE = 25_000  # cases kept; more are only counted


@dataclass
class Comparison:
    before: Head
    now: Head
    moves: "Counter[Tuple[str, str]]" = field(default_factory=Counter)  # by outcome before and outcome now
    worse: int = 0
    better: int = 0
    same: int = 0  # equal outcomes
    not_fired: int = 0  # in one campaign only: neither worse nor better
    only_before: int = 0
    only_now: int = 0
    cases: List[Tuple[str, Result]] = field(default_factory=list)  # worse cases: outcome before, result now

    @property
    def changes(self) -> List[Tuple[Tuple[str, str], int]]:
        """Different outcomes before and now, with the number of cases; the most frequent change comes first."""
        return sorted((move for move in self.moves.items() if move[0][0] != move[0][1]), key=lambda move: (-move[1], move[0]))


def compare(before: Head, old: Iterable[Result], now: Head, new: Iterable[Result]) -> Comparison:
    """Pre: `old` and `new` are sorted by case number. A worse case has an outcome of higher rank (outcomes.py) now.

    Raises StartError if equal numbers belong to different cases.
    """
    _check_same_plan(before, now)
    comparison = Comparison(before, now)
    for was, is_now in _pairs(iter(old), iter(new)):
        if was is None or is_now is None:
            comparison.only_before += was is not None
            comparison.only_now += is_now is not None
        else:
            _check_same_case(now, was, is_now)
            _count(comparison, was.outcome, is_now)
    return comparison


def _count(comparison: Comparison, before: str, result: Result) -> None:
    comparison.moves[before, result.outcome] += 1
    if before == result.outcome:
        comparison.same += 1
    elif NOT_FIRED in (before, result.outcome):
        comparison.not_fired += 1
    elif OUTCOMES[result.outcome].rank < OUTCOMES[before].rank:
        comparison.better += 1
    else:
        comparison.worse += 1
        if len(comparison.cases) < MAX_WORSE:
            comparison.cases.append((before, result))


def _pairs(old: Iterator[Result], new: Iterator[Result]) -> Iterator[Tuple[Optional[Result], Optional[Result]]]:
    one, other = next(old, None), next(new, None)
    while one is not None or other is not None:
        takes_one = other is None or (one is not None and one.number <= other.number)
        takes_other = one is None or (other is not None and other.number <= one.number)
        yield (one if takes_one else None), (other if takes_other else None)
        if takes_one:
            one = next(old, None)
        if takes_other:
            other = next(new, None)


def _check_same_plan(before: Head, now: Head) -> None:
    for what in ("sampling", "seed", "numbers", "dimensions"):
        was, is_now = getattr(before, what), getattr(now, what)
        if was == is_now:
            continue
        if what == "dimensions":
            names = [[one["name"] for one in head.dimensions] for head in (before, now)]
            changed = next((one["name"] for one, other in zip(now.dimensions, before.dimensions) if one != other), None)
            raise _other_plan(f"dimension {changed} has other values" if names[0] == names[1] else "the dimensions differ")
        raise _other_plan(f"{what} was {was} and is {is_now}")


def _check_same_case(head: Head, was: Result, is_now: Result) -> None:
    for dimension, old, new in zip(head.dimensions, was.values, is_now.values):
        if old != new:
            texts = ["nothing" if value is None else value_text(value) for value in (old, new)]
            raise _other_plan(f"case {was.number} had {dimension['name']} = {texts[0]} and has {texts[1]}")


def _other_plan(why: str) -> StartError:
    return StartError(f"compare: the campaigns have different plans: {why}")
