"""Values of a dimension of a plan: a list or a distribution, and their form as text."""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist
from typing import Optional, Sequence, Union

Value = Union[float, str]


def value_text(value: Value) -> str:
    """Returns words unchanged, and a number as the shortest fixed or scientific text that reads back exactly."""
    if isinstance(value, str):
        return value
    value += 0.0  # converts -0 to 0
    digits = repr(float(value))
    mantissa, _, exponent = digits.partition("e")
    sign, figures = ("-", mantissa[1:]) if mantissa.startswith("-") else ("", mantissa)
    whole, _, fraction = figures.partition(".")
    if fraction == "0":
        fraction = ""
    point = len(whole) + int(exponent or 0)
    significant = (whole + fraction).lstrip("0")
    point -= len(whole + fraction) - len(significant)
    significant = significant.rstrip("0")
    if not significant:
        return sign + "0"
    return sign + min(_fixed(significant, point), _scientific(significant, point), key=len)


def _fixed(figures: str, point: int) -> str:
    if point <= 0:
        return "0." + "0" * -point + figures
    if point >= len(figures):
        return figures + "0" * (point - len(figures))
    return figures[:point] + "." + figures[point:]


def _scientific(figures: str, point: int) -> str:
    mantissa = figures[0] + ("." + figures[1:] if len(figures) > 1 else "")
    exponent = point - 1
    return f"{mantissa}e{'-' if exponent < 0 else '+'}{abs(exponent):02d}"


@dataclass(frozen=True)
class Listed:
    """A list of numbers or a list of words. `weights` are empty if all values are equally likely."""

    values: Sequence[Value]
    weights: Sequence[float] = ()

    @property
    def has_words(self) -> bool:
        return isinstance(self.values[0], str)

    @property
    def least(self) -> float:
        return min(float(value) for value in self.values)

    @property
    def most(self) -> float:
        return max(float(value) for value in self.values)

    def quantile(self, share: float) -> Value:
        """Returns the value below which this share of all draws lies, 0 <= share < 1."""
        if not self.weights:
            return self.values[min(int(share * len(self.values)), len(self.values) - 1)]
        left = share * math.fsum(self.weights)
        for value, weight in zip(self.values[:-1], self.weights):
            if left < weight:
                return value
            left -= weight
        return self.values[-1]


@dataclass(frozen=True)
class Ranged:
    """Numbers from `start` to `stop`: uniform, log-uniform, or normal and truncated at both ends."""

    start: float
    stop: float
    log: bool = False
    mean: Optional[float] = None
    sd: float = 1.0
    rounding: str = "figures"  # four significant digits; "ms": multiples of 0.001; "whole": whole numbers

    has_words = False

    @property
    def least(self) -> float:
        return self.start

    @property
    def most(self) -> float:
        return self.stop

    def quantile(self, share: float) -> float:
        """As Listed.quantile(), rounded to few digits, which are easy to type."""
        value = self.start + (self.stop - self.start) * share
        if self.log:
            value = self.start * math.pow(self.stop / self.start, share)
        elif self.mean is not None:
            value = self._normal(share)
        return min(max(self._rounded(value), self.start), self.stop)

    def _normal(self, share: float) -> float:
        normal = NormalDist(self.mean, self.sd)
        below = normal.cdf(self.start)
        at = below + (normal.cdf(self.stop) - below) * share
        if at <= 0:
            return self.start
        return self.stop if at >= 1 else normal.inv_cdf(at)

    def _rounded(self, value: float) -> float:
        if self.rounding == "whole":
            return _half_away(value)
        if self.rounding == "ms":
            return _half_away(value * 1e3) / 1e3
        return float(f"{value:.3e}")


def _half_away(value: float) -> float:
    """Rounds to the nearest whole number, halves away from zero, as round() in C."""
    whole = math.floor(abs(value))
    whole += abs(value) - whole >= 0.5
    return math.copysign(float(whole), value)


Values = Union[Listed, Ranged]
