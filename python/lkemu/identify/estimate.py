"""A number that a log tells, with the interval that holds the true one in 95 of 100 logs."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Estimate:
    value: float
    half_width: float

    @property
    def low(self) -> float:
        return self.value - self.half_width

    @property
    def high(self) -> float:
        return self.value + self.half_width

    @property
    def letter(self) -> str:
        """A within 5 %, B within 15 %, C within 50 %, which is too rough for a motor file; U: the log does not tell it."""
        if not (self.value > 0 and self.half_width <= 0.5 * self.value):  # nothing that is looked for can be negative
            return "U"
        return "A" if self.half_width <= 0.05 * self.value else "B" if self.half_width <= 0.15 * self.value else "C"

    @property
    def told(self) -> bool:
        return self.letter in "AB"
