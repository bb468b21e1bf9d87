"""An estimated value with its 95 % confidence interval."""

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
        """Grade by the half width: A up to 5 %, B up to 15 %, C up to 50 %, U unknown. Motor files use A and B."""
        if not (self.value > 0 and self.half_width <= 0.5 * self.value):  # all quantities are positive
            return "U"
        return "A" if self.half_width <= 0.05 * self.value else "B" if self.half_width <= 0.15 * self.value else "C"

    @property
    def is_usable(self) -> bool:
        return self.letter in "AB"
