"""Fit of the torque balance: delay and lag of the current, its mean response, cogging orders, regression."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import List, Optional

import numpy as np
from scipy.optimize import minimize

from .cogging import find_orders, set_terms
from .estimate import Estimate
from .regression import OUTLIER, RUN_S, Regression
from .timing import spread
from .windows import (
    COULOMB, CONSTANT, FIXED_TERMS, GEAR_LOSS, GRAVITY_COS, GRAVITY_SIN, INERTIA, PULSE_COULOMB, PULSE_VISCOUS, VISCOUS,
    WINDOW_S, Balance, Windows, parts,
)  # fmt: skip

FEWEST_WINDOWS = 240
FEWEST_COMMANDED = 100  # Windows with commanded torque that make a log an experiment (assumed).
GRAVITY_TRAVEL_RAD = 1.0  # Travel of the output needed to estimate gravity (assumed).
# Bins of the mean response of the current: time since a change of the command.
AGES_S = np.array([2e-3, 3.5e-3, 5e-3, 7e-3, 9e-3, 12e-3, 15e-3, 20e-3, 27e-3, 36e-3, 50e-3, 70e-3])
SIGNIFICANT = 4.0  # Standard deviations of χ².
LIMITED_A, LIMITED_SHARE = 0.5, 0.2  # Deviation from the command that indicates a limit (assumed).
DELAYS_S = (-6e-3, -4e-3, -3e-3, -2e-3, -1e-3, 0.0, 1e-3, 2e-3, 3e-3, 5e-3, 8e-3, 12e-3, 20e-3)
LAGS_S = (0.0, 0.5e-3, 2e-3, 5e-3, 12e-3, 30e-3)
MOST_RESPONSES = 200_000  # Samples used for the mean response, about.
MOST_ROWS = 1500  # Windows, and samples, used to fit the delay, about.


@dataclass
class FitTerms:
    """Terms of the regression that the log can determine."""

    constant: bool
    viscous: bool
    pulses: bool  # separate friction terms under commanded torque
    gravity: bool
    gear_loss: bool = False

    def used(self, orders: int) -> List[int]:
        chosen = [INERTIA, COULOMB]
        for wanted, terms in (
            (self.constant, [CONSTANT]), (self.viscous, [VISCOUS]), (self.pulses, [PULSE_COULOMB]),
            (self.pulses and self.viscous, [PULSE_VISCOUS]), (self.gravity, [GRAVITY_SIN, GRAVITY_COS]), (self.gear_loss, [GEAR_LOSS]),
        ):  # fmt: skip
            chosen += terms if wanted else []
        return chosen + list(range(FIXED_TERMS, FIXED_TERMS + 2 * orders))


class Fit:
    def __init__(self, balance: Balance) -> None:
        self.track, self.timing, self.balance = balance.track, balance.timing, balance
        self.orders: List[int] = []
        self.one_speed: List[int] = []
        self.delay_s = self.lag_s = 0.0
        self.lag: Optional[Estimate] = None
        self.phase = 0.0  # rad, of gravity

    @property
    def windows(self) -> Windows:
        return self.balance.windows

    @property
    def terms(self) -> np.ndarray:
        return self.balance.windows.terms

    def has_enough_windows(self) -> bool:
        return len(self.windows) >= FEWEST_WINDOWS

    # --- choice of terms ---

    def choose_terms(self) -> FitTerms:
        w, track = self.windows, self.track
        self.experiment = np.count_nonzero(w.commanded) >= FEWEST_COMMANDED
        # Only friction changes its sign with speed. A tenth of each direction separates it from an offset (assumed).
        share = np.mean(w.speed > 0)
        # Viscous friction needs a ratio of 2.5 between fast and slow windows with little acceleration (assumed).
        quiet = np.argsort(np.abs(w.terms[:, INERTIA]))[: len(w) // 2]
        low, high = np.percentile(np.abs(w.speed[quiet]), (10, 90))
        known = len(track.first) == 1 or track.span_turns == track.motor.N
        turned = np.ptp(track.angle) / track.motor.N
        geared = track.motor.N > 1
        measured = len(w) - np.count_nonzero(w.commanded)
        return FitTerms(
            constant=bool(0.1 < share < 0.9), viscous=bool(high > 2.5 * low),
            pulses=geared and bool(self.experiment) and measured >= FEWEST_COMMANDED,
            gravity=bool(known and turned >= GRAVITY_TRAVEL_RAD),
        )  # fmt: skip

    # --- delay and lag of the current ---

    def fit_delay(self) -> None:
        """Fits delay and lag, so that the commands best explain accelerations and measured currents."""
        if not self.experiment:
            return
        w, balance = self.windows, self.balance
        runs = (w.time / RUN_S).astype(int)
        rows = np.flatnonzero(w.commanded)
        # Whole runs of windows, sampled evenly over the log.
        numbers = np.unique(runs[rows])
        rows = rows[np.isin(runs[rows], numbers[:: len(rows) // MOST_ROWS + 1])]
        own = balance.subset(rows)
        acceleration = w.terms[rows, INERTIA]
        ripples = self.terms[rows, FIXED_TERMS : FIXED_TERMS + 2 * len(self.orders)]
        others = np.column_stack((w.terms[rows][:, [COULOMB, VISCOUS, CONSTANT]], ripples))
        settled = np.flatnonzero(balance.is_settled)
        settled = settled[:: len(settled) // MOST_ROWS + 1]
        overlap = max(1.0, float(np.median(w.last - w.first)))

        def loss(delay_s: float, lag_s: float) -> float:
            columns = np.column_stack((own.predicted_current(delay_s, max(lag_s, 0.0)), others))
            residual = acceleration - columns @ np.linalg.lstsq(columns, acceleration, rcond=None)[0]
            kept = np.abs(residual) < OUTLIER * np.median(np.abs(residual))
            residual = acceleration - columns @ np.linalg.lstsq(columns[kept], acceleration[kept], rcond=None)[0]
            off = balance.current_error(delay_s, max(lag_s, 0.0), settled)
            return len(rows) / overlap * math.log(clipped(residual)) + len(settled) * math.log(clipped(off))

        # The shaft determines the sum of delay and lag. The measured currents determine the shares.
        sums = [(loss(d, 0.0), d) for d in DELAYS_S]
        whole = min(sums)[1]
        if whole < 0:
            self.delay_s, self.lag_s = whole, 0.0
            return
        shares = [(loss(max(whole - lag, 0.0), lag), lag) for lag in LAGS_S]
        lag = min(shares)[1]
        start = np.array([max(whole - lag, 0.0), lag]) * 1e3
        steps = np.array([start, start + (0.5, 0.0), start + (-0.3 - lag * 250, 0.3 + lag * 250)])
        found = minimize(lambda x: loss(abs(x[0]) / 1e3, abs(x[1]) / 1e3), start, method="Nelder-Mead",
                         options={"initial_simplex": steps, "xatol": 0.02, "fatol": 0.1, "maxfev": 40})  # fmt: skip
        self.delay_s, self.lag_s = np.abs(found.x) / 1e3
        # 95 % interval by the likelihood ratio: 3.84 is the quantile of χ² with one degree of freedom.
        step = 0.1e-3
        while step < 0.1 and loss(max(self.delay_s - step, 0.0), self.lag_s + step) < found.fun + 3.84:
            step *= 2
        self.lag = Estimate(self.lag_s, step)

    # --- regression ---

    def find_orders(self, fit_terms: FitTerms, current: np.ndarray) -> None:
        find_orders(self.balance, lambda: self.regression(fit_terms, current), self.orders, self.one_speed)

    def shorter(self, fit_terms: FitTerms) -> Regression:
        """Regression over windows of half the length."""
        half = Fit(self.balance.with_window(WINDOW_S / 2))
        half.experiment, half.orders, half.delay_s, half.lag_s = self.experiment, self.orders, self.delay_s, self.lag_s
        set_terms(half.balance, half.orders)
        half.terms[:, GEAR_LOSS] = half.balance.gear_loss(self.phase)
        half.drop_limited_windows()
        return half.fit(fit_terms)

    def response(self) -> np.ndarray:
        """Mean deviation of the measured currents from the model, at the samples.

        It is proportional to the last step of the command, and depends on the time since. 0 if not significant."""
        balance, time = self.balance, self.timing.time
        changes = np.flatnonzero(np.diff(balance.commands.value) != 0) + 1
        made = np.zeros(len(time), np.float32)
        if len(changes) < FEWEST_COMMANDED:
            return made
        steps = np.append(np.diff(balance.commands.value)[changes - 1], 0.0)  # 0: before the first step
        acts = np.append(balance.commands.time[changes] + self.delay_s, np.inf)

        def last_change(samples: "np.ndarray | slice") -> "tuple[np.ndarray, np.ndarray]":
            """Age of the last step as an index into AGES_S, and its size."""
            latest = np.searchsorted(acts, time[samples], side="right") - 1
            return np.searchsorted(AGES_S, time[samples] - acts[latest]), steps[latest]

        # Close to a step, stamp errors look like a response: skip these bins.
        clear = np.concatenate(([False], AGES_S[:-1] >= AGES_S[0] + 3 * self.timing.sample_s, [False]))
        chosen = np.flatnonzero(balance.is_settled)
        chosen = chosen[:: len(chosen) // MOST_RESPONSES + 1]
        ages, step = last_change(chosen)
        current_error = balance.current_error(self.delay_s, self.lag_s, chosen)
        ages, step, current_error = (one[clear[ages]] for one in (ages, step, current_error))
        if len(current_error) == 0:
            return made
        size = np.bincount(ages, step**2, len(clear))
        share = np.bincount(ages, step * current_error, len(clear)) / np.maximum(size, 1e-12)
        noise = spread(current_error - share[ages] * step)
        bins = np.count_nonzero(size)
        chi_squared = np.sum(share**2 * size) / max(noise**2, 1e-12)
        if chi_squared < bins + SIGNIFICANT * math.sqrt(2 * bins):
            return made
        for part in parts(len(time)):
            ages, step = last_change(part)
            made[part] = np.where(clear[ages], share[ages] * step, 0.0)
        return made

    def current(self, response: np.ndarray) -> np.ndarray:
        """Current of each window.

        With commanded torque, it is the modelled current plus the part of the measured deviation that exceeds noise."""
        balance, w = self.balance, self.windows
        if not np.any(w.commanded):
            return balance.measured_current()
        current_error = balance.current_error(self.delay_s, self.lag_s, slice(None)) - response
        mean = balance.sample_mean(current_error)[w.commanded]
        noise = spread(np.diff(current_error[balance.is_settled])) ** 2 / 2 / (np.median(w.last - w.first) + 1)
        share = min(1.0, max(0.0, 2 * spread(mean) ** 2 / max(noise, 1e-12) - 2.4))  # ratio 1 is pure noise
        made = balance.measured_current()
        predicted_current = balance.predicted_current(self.delay_s, self.lag_s) + balance.window_mean(response)
        made[w.commanded] = predicted_current[w.commanded] + share * mean
        return made

    def drop_limited_windows(self) -> None:
        """Removes windows in which the drive did not follow its command: it was at a limit, or lost the frame."""
        balance = self.balance
        off = np.abs(balance.sample_mean(balance.current_error(self.delay_s, self.lag_s, slice(None))))
        commanded = np.abs(balance.predicted_current(self.delay_s, self.lag_s))
        sure = ~self.windows.commanded | (off <= LIMITED_A + LIMITED_SHARE * commanded)
        self.balance = balance.subset(sure)

    def fit(self, fit_terms: FitTerms) -> Regression:
        return self.regression(fit_terms, self.current(self.response()))

    def regression(self, fit_terms: FitTerms, current: np.ndarray, among: Optional[np.ndarray] = None) -> Regression:
        used, windows = fit_terms.used(len(self.orders)), self.windows
        expected = self.balance.instrument(self.delay_s, self.lag_s) if self.experiment else current
        if among is None:
            among = np.ones(len(windows), bool)
        return Regression(windows, windows.terms, current, used, bool(self.experiment), expected, among)


def clipped(values: np.ndarray) -> float:
    """Mean square with outliers clipped to a multiple of the median."""
    off = np.abs(values)
    return float(np.mean(np.minimum(off, max(1.5 * OUTLIER * np.median(off), 1e-6)) ** 2))
