"""Computes the cases of a plan. The values of a case depend only on the plan and the number of the case."""

from __future__ import annotations

import bisect
from typing import TYPE_CHECKING, Dict, List, Optional, Tuple

from .values import Listed, Value

if TYPE_CHECKING:
    from .plan import Plan

Case = Tuple[Optional[Value], ...]  # in order of the plan's dimensions; None if a dimension does not apply
BITS = (1 << 64) - 1
MAX_NUMBER = (1 << 63) - 1
MAX_ATTEMPTS = 1000
MAX_PAIRS = 10_000_000  # take about 1 GB
MAX_TRIED = 100_000  # take about 1 s for one pair


def mix(x: int) -> int:
    """SplitMix64 (Steele, Lea, Flood 2014): neighbouring inputs give unrelated outputs."""
    x = (x + 0x9E3779B97F4A7C15) & BITS
    x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) & BITS
    x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & BITS
    return x ^ (x >> 31)


def uniform(bits: int) -> float:
    """Returns a number from 0 to below 1 with 53 random bits."""
    return (bits >> 11) * 2.0**-53


def draw(seed: int, number: int, dimension: int, attempt: int) -> float:
    return uniform(mix((mix((mix(seed) + number) & BITS) + mix(dimension * 1024 + attempt)) & BITS))


def shuffled(number: int, count: int, key: int) -> int:
    """Permutes 0 to count - 1 pseudo-randomly: applies a Feistel network until the result is below `count`."""
    half = 1
    while half < 31 and (1 << (2 * half)) < count:
        half += 1
    mask = (1 << half) - 1
    while True:
        left, right = number >> half, number & mask
        for step in range(6):
            left, right = right, left ^ (mix((mix((key + step) & BITS) + right) & BITS) & mask)
        number = (left << half) | right
        if number < count:
            return number


class Cases:
    """Maps numbers of cases to their values."""

    def __init__(self, plan: "Plan") -> None:
        self.plan = plan
        self.numbers = plan.cases  # cases are numbered 0 to numbers - 1
        self._before_kind: List[int] = []
        self._pairwise: List[Case] = []
        if plan.sampling == "full":
            self._before_kind = [0]
            for kind in plan.kinds or [None]:
                size = self._size_of(kind)
                self._before_kind.append(min(self._before_kind[-1] + size, MAX_NUMBER))
            self.numbers = self._before_kind[-1]
        elif plan.sampling == "pairwise":
            self._pairwise = Cover(plan).cases()
            self.numbers = len(self._pairwise)

    def values(self, number: int) -> Optional[Case]:
        """Returns the values of a case; None if it is excluded."""
        if self.plan.sampling == "pairwise":
            return self._pairwise[number]
        if self.plan.sampling == "random":
            return self._random(number)
        values = self._full(number) if self.plan.sampling == "full" else self._latin(number)
        return None if self.plan.excludes(values) else values

    def _random(self, number: int) -> Case:
        for attempt in range(MAX_ATTEMPTS):
            values = self.plan.fill(
                lambda n: self.plan.dimensions[n].values.quantile(draw(self.plan.seed, number, n, attempt))
            )
            if not self.plan.excludes(values):
                return values
        raise self.plan.error("exclude", "excludes nearly all cases: 1000 draws in a row were excluded")

    def _size_of(self, kind: Optional[str]) -> int:
        size = 1
        for dimension in self.plan.dimensions:
            if dimension.name == "fault.kind" or not self.plan.counts(dimension, kind):
                continue
            assert isinstance(dimension.values, Listed)
            size = min(size * len(dimension.values.values), MAX_NUMBER)
        return size

    def _full(self, number: int) -> Case:
        """Enumerates all combinations; the last dimension varies fastest."""
        place = bisect.bisect_right(self._before_kind, number) - 1
        rest = number - self._before_kind[place]
        kind = self.plan.kinds[place] if self.plan.kinds else None
        values: List[Optional[Value]] = [None] * len(self.plan.dimensions)
        for n in reversed(range(len(values))):
            dimension = self.plan.dimensions[n]
            assert isinstance(dimension.values, Listed)
            if dimension.name == "fault.kind":
                values[n] = kind
            elif self.plan.counts(dimension, kind):
                rest, choice = divmod(rest, len(dimension.values.values))
                values[n] = dimension.values.values[choice]
        return tuple(values)

    def _latin(self, number: int) -> Case:
        """Cuts each dimension into as many slices as there are cases, and uses each slice once."""
        seed = self.plan.seed

        def value(n: int) -> Value:
            part = shuffled(number, self.numbers, mix((seed + n * 0x9E37) & BITS))
            share = (part + draw(seed, number, n, 0)) / self.numbers
            return self.plan.dimensions[n].values.quantile(min(share, 1 - 2.0**-53))

        return self.plan.fill(value)


Choice = Tuple[int, int]  # index of a dimension, index of a value in its list
Partial = List[Optional[int]]  # index of the chosen value, by dimension


class Cover:
    """Few cases that cover each pair of values of two dimensions, except excluded pairs.

    The algorithm is greedy, as AETG (Cohen, Dalal, Fredman, Patton 1997). Each new case begins with a pair that is not
    covered yet. Each other dimension then gets the allowed value that covers most new pairs.
    """

    def __init__(self, plan: "Plan") -> None:
        self.plan = plan
        self.lists: List[Listed] = []
        for dimension in plan.dimensions:
            assert isinstance(dimension.values, Listed)
            self.lists.append(dimension.values)
        sizes = [len(one.values) for one in self.lists]
        if sum(size * sum(sizes[:n]) for n, size in enumerate(sizes)) > MAX_PAIRS:
            raise plan.error("sampling", "pairwise has more than 10 million pairs of values: shorten the lists, or use sampling random")
        excluding = {n for exclusion in plan.exclusions for n in exclusion}

        def rank(n: int) -> int:
            return 0 if plan.dimensions[n].name == "fault.kind" else 1 if n in excluding else 2

        self.order = sorted(range(len(sizes)), key=rank)
        # Uncovered pairs in lexicographic order. A dict keeps this order and removes fast.
        self.uncovered: Dict[Tuple[Choice, Choice], None] = {
            ((a, n), (b, m)): None
            for a in range(len(sizes))
            for n in range(sizes[a])
            for b in range(a + 1, len(sizes))
            for m in range(sizes[b])
        }

    def cases(self) -> List[Case]:
        if len(self.lists) == 1:
            return [(value,) for value in self.lists[0].values if not self.plan.excludes((value,))]
        cases = []
        for first in list(self.uncovered):
            if first not in self.uncovered:
                continue
            chosen = self._complete(first, len(cases))
            if chosen is not None:
                self._mark_covered(chosen)
                cases.append(self._values(chosen))
            self.uncovered.pop(first, None)  # covered, or part of excluded cases only
        return cases

    def _values(self, chosen: Partial) -> Case:
        return tuple(None if place is None else one.values[place] for one, place in zip(self.lists, chosen))

    def _kind(self, chosen: Partial) -> Optional[str]:
        for n, dimension in enumerate(self.plan.dimensions):
            if dimension.name == "fault.kind" and chosen[n] is not None:
                return str(self.lists[n].values[chosen[n]])
        return None

    def _complete(self, pair: Tuple[Choice, Choice], number: int) -> Optional[Partial]:
        chosen: Partial = [None] * len(self.lists)
        for n, place in pair:
            chosen[n] = place
        self.tried = 0
        if self.plan.excludes(self._values(chosen)):
            return None
        return chosen if self._fill(chosen, 0, mix((self.plan.seed + number) & BITS)) else None

    def _fill(self, chosen: Partial, place: int, random: int) -> bool:
        """Chooses values of the dimensions in `order[place:]`. Returns False if all choices give excluded cases."""
        if place == len(self.order):
            return True
        n = self.order[place]
        is_kind = self.plan.dimensions[n].name == "fault.kind"
        if not is_kind and not self.plan.counts(self.plan.dimensions[n], self._kind(chosen)):
            return self._fill(chosen, place + 1, random)
        if chosen[n] is not None:  # a parameter of another kind of fault does not fit
            return (not is_kind or self._fits(chosen)) and self._fill(chosen, place + 1, random)
        for choice in self._by_gain(chosen, n, mix((random + n) & BITS)):
            self.tried += 1
            if self.tried > MAX_TRIED:
                raise self.plan.error("exclude", "takes too long to check with pairwise: exclude less, or by fewer dimensions")
            chosen[n] = choice
            possible = not self.plan.excludes(self._values(chosen)) and (not is_kind or self._fits(chosen))
            if possible and self._fill(chosen, place + 1, random):
                return True
        chosen[n] = None
        return False

    def _by_gain(self, chosen: Partial, n: int, random: int) -> List[int]:
        """Returns indices of the values of a dimension, most new pairs first; `random` orders ties."""
        count = len(self.lists[n].values)
        places = [(random + k) % count for k in range(count)]
        return sorted(places, key=lambda place: -self._gain(chosen, (n, place)))

    def _gain(self, chosen: Partial, choice: Choice) -> int:
        others = ((m, place) for m, place in enumerate(chosen) if place is not None and m != choice[0])
        return sum((min(other, choice), max(other, choice)) in self.uncovered for other in others)

    def _fits(self, chosen: Partial) -> bool:
        kind = self._kind(chosen)
        return all(
            place is None or self.plan.counts(dimension, kind)
            for dimension, place in zip(self.plan.dimensions, chosen)
        )

    def _mark_covered(self, chosen: Partial) -> None:
        choices = [(n, place) for n, place in enumerate(chosen) if place is not None]
        for k, first in enumerate(choices):
            for second in choices[k + 1 :]:
                self.uncovered.pop((first, second), None)
