"""Weighted least squares over windows with an instrumental variable, and jackknife intervals.

Noise of the measured acceleration would bias the inertia of least squares towards 0. The instrument is the acceleration
predicted from the commands, which has no such noise.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Callable, List

import numpy as np

from .estimate import Estimate
from .windows import INERTIA, Windows

GROUPS = 24  # Groups of the jackknife: each has runs from all parts of the log.
RUN_S = 0.2  # Length of a run: overlapping windows stay in one group.
STUDENT = 2.069  # 97.5 % quantile of Student's t with GROUPS − 1 degrees of freedom.
OUTLIER = 5.0  # Standard deviations: larger residuals are due to lines missing from the log.
ROUNDS = 6
FEWEST_MEASURED = 20
CHUNK = 8192  # Windows per step, limits the memory.


@dataclass
class Regression:
    """Regression of the current of each window, `current`, on the columns `used` of `terms`."""

    windows: Windows
    terms: np.ndarray
    current: np.ndarray
    used: List[int]
    experiment: bool  # the inertia is estimated from commanded torques only
    expected: np.ndarray  # current of each window without the noise of its stamps
    among: np.ndarray  # mask of usable windows
    coefficients: np.ndarray = field(init=False)
    weights: np.ndarray = field(init=False)
    kept: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        count = len(self.current)
        self.weights, self.kept = np.ones(count), self.among
        self.coefficients = np.zeros(self.terms.shape[1])
        self.instrument = self.terms[:, INERTIA].copy()
        if self.experiment:
            self.instrument[~self.windows.commanded] = 0
        self.speed = np.abs(self.windows.speed)
        for number in range(ROUNDS):
            self._fit()
            if self.experiment and self.coefficients[INERTIA] > 0:
                self._expect()
            self._weigh()
            if number:
                self._trim()
        self._fit()

    def residual(self) -> np.ndarray:
        return self.current - self.terms @ self.coefficients

    def _sums(self, chosen: np.ndarray) -> "tuple[np.ndarray, np.ndarray]":
        count, at = len(self.used), self.used.index(INERTIA)
        normal, right = np.zeros((count, count)), np.zeros(count)
        for part in np.array_split(chosen, len(chosen) // CHUNK + 1):
            rows = self.terms[np.ix_(part, self.used)]
            left = rows.copy()
            left[:, at] = self.instrument[part]
            left *= self.weights[part, None]
            normal += left.T @ rows
            right += left.T @ self.current[part]
        return normal, right

    def _solve(self, normal: np.ndarray, right: np.ndarray) -> np.ndarray:
        # Scale each term to 1: terms have different units.
        scale = 1 / np.sqrt(np.maximum(np.abs(np.diag(normal)), 1e-300))
        scaled = normal * scale[:, None] * scale
        found = np.zeros(self.terms.shape[1])
        found[self.used] = np.linalg.lstsq(scaled, scale * right, rcond=1e-12)[0] * scale
        return found

    def _fit(self) -> None:
        self.coefficients = self._solve(*self._sums(np.flatnonzero(self.kept)))

    def _expect(self) -> None:
        """Sets the instrument to the acceleration predicted from the commands."""
        commanded = self.windows.commanded
        others = self.coefficients.copy()
        others[INERTIA] = 0
        expected = (self.expected - self.terms @ others) / self.coefficients[INERTIA]
        self.instrument[commanded] = expected[commanded]

    def _weigh(self) -> None:
        squares = self.residual() ** 2
        commanded = self.windows.commanded
        chosen = commanded & self.kept
        if np.any(chosen):
            self.weights[commanded] = 1 / max(np.mean(squares[chosen]), 1e-12)
        measured = np.flatnonzero(~commanded & self.among)
        if len(measured) <= FEWEST_MEASURED:
            return
        # The variance is that of the half with less acceleration, plus a part proportional to the squared acceleration.
        # Fast and slow windows have separate variances.
        acceleration = self.terms[measured, INERTIA] ** 2
        quiet = acceleration <= np.median(acceleration)
        steady = np.empty(len(measured))
        fast = self.speed[measured] > np.median(self.speed[measured[quiet]])
        for which in (fast, ~fast):
            some = quiet & which if np.count_nonzero(quiet & which) > FEWEST_MEASURED else quiet
            steady[which] = max(np.mean(squares[measured[some]]), 1e-12)
        more = np.sum(squares[measured[~quiet]] - steady[~quiet])
        per = max(more / max(np.sum(acceleration[~quiet]), 1e-300), 0.0)
        self.weights[measured] = 1 / (steady + per * acceleration)

    def _trim(self) -> None:
        """Drops outliers under commanded torque. Measured currents keep theirs: they often determine the inertia."""
        commanded = self.windows.commanded
        if np.any(commanded & self.among):
            off = np.abs(self.residual())
            usual = OUTLIER * 1.4826 * np.median(off[commanded & self.among])
            self.kept = self.among & (~commanded | (off <= usual))

    def jackknife(self) -> np.ndarray:
        """Coefficients with each group left out."""
        group = (self.windows.time / RUN_S).astype(int) % GROUPS
        sums = [self._sums(np.flatnonzero(self.kept & (group == n))) for n in range(GROUPS)]
        normal, right = sum(one[0] for one in sums), sum(one[1] for one in sums)
        return np.array([self._solve(normal - one[0], right - one[1]) for one in sums])


def estimate(of: Callable[[np.ndarray], float], fitted: np.ndarray, without: np.ndarray) -> Estimate:
    """Estimates a function of the coefficients with its interval; `without` is the result of `jackknife`."""
    made = np.array([of(one) for one in without])
    return Estimate(float(of(fitted)), float(STUDENT * np.sqrt(np.mean((made - made.mean()) ** 2) * (GROUPS - 1))))
