"""Torque balance of a drive: inertia, friction, cogging and gravity, with 95 % confidence intervals.

All values are in amperes of torque current, because a log does not show k_t.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Callable, List, Optional

import numpy as np

from .cogging import missed_share
from .estimate import Estimate
from .fit import FEWEST_COMMANDED, Fit, FitTerms
from .regression import GROUPS, RUN_S, Regression, estimate
from .timing import Timing, spread
from .track import TORQUE, Track
from .windows import COULOMB, FIXED_TERMS, GEAR_LOSS, GRAVITY_COS, GRAVITY_SIN, INERTIA, VISCOUS, WINDOW_S, Balance

LAG_SHARE = 0.2
PATH_SHARE = 0.03  # Error of a cogging amplitude from interpolating the angle between samples (assumed).
AMBIGUOUS_SHARE, ROUGH_S = 0.2, 2.5e-3  # Upper limits of ambiguous replies and stamp error (assumed).
NEGATIVE_S = 0.5e-3  # Largest negative delay that stamp errors may cause (assumed).
# UNEXPLAINED: largest residual share of the inertial current for a gear without backlash.
# UNEXPLAINED_PER_S: its increase per second of stamp error.
# PLAY_SHARE: part of the excess that widens the interval.
# A load behind backlash leaves 0.06 to 0.5 (measured on simulated motors).
UNEXPLAINED, UNEXPLAINED_PER_S, PLAY_SHARE = 0.05, 200.0, 0.5


class TooRough(Exception):
    """Raised if time stamps or encoder settings do not allow a torque balance; the text is the reason."""


@dataclass
class Cogging:
    order: int
    amplitude: Estimate
    phase: float


@dataclass
class BalanceFit:
    inertia: Estimate  # J/k_t, A·s²/rad
    coulomb: Estimate  # A
    viscous: Estimate  # B/k_t, A·s/rad
    gravity: Optional[Estimate]  # None: the output turned too little
    gear_loss: Optional[Estimate]  # (1/η − η)/2 over (1/η + η)/2
    gravity_phase: float
    cogging: List[Cogging]  # strongest first
    one_speed: List[int]  # orders found at one speed only
    delay_s: float  # from the stamp of a command to its effect on the reported speed
    lag_s: float
    lag: Optional[Estimate]  # time constant of the current loop, s
    commanded: int  # windows with a commanded torque
    weak_pulses: int  # torque commands that hardly moved the shaft
    rms_A: float
    held_out_ratio: float
    autocorrelation: float
    time: np.ndarray  # s, middle of each window; for pictures
    current: np.ndarray
    terms: np.ndarray
    coefficients: np.ndarray
    notes: List[str] = field(default_factory=list)

    def expected(self) -> np.ndarray:
        return self.terms @ self.coefficients


def gravity_of(coefficients: np.ndarray) -> float:
    return float(math.hypot(coefficients[GRAVITY_SIN], coefficients[GRAVITY_COS]))


def coefficient(term: int) -> Callable[[np.ndarray], float]:
    return lambda c: float(c[term])


def whitened(regression: Regression) -> np.ndarray:
    return np.sqrt(regression.weights) * regression.residual()


def held_out_ratio(fit: Fit, fit_terms: FitTerms, current: np.ndarray) -> float:
    """Two-fold cross-validation: residuals of the held-out half over those of the fitted half; 1 if too few windows."""
    half = (fit.windows.time / RUN_S).astype(int) % 2
    fitted = held = 0.0
    for n in (0, 1):
        own, other = half == n, half != n
        if np.count_nonzero(own) < GROUPS or np.count_nonzero(other) < GROUPS:
            return 1.0
        residual = fit.regression(fit_terms, current, own).residual()
        fitted += spread(residual[own]) ** 2
        held += spread(residual[other]) ** 2
    return math.sqrt(held / fitted) if fitted > 0 else 1.0


def autocorrelation(fit: Fit, regression: Regression) -> float:
    """Lag-1 autocorrelation of the weighted residuals, over adjacent windows without common samples."""
    residual, first, last = whitened(regression), fit.windows.first, fit.windows.last
    after = np.searchsorted(first, last + 1)
    inside = after < len(first)
    follows = np.flatnonzero(inside & (first[np.minimum(after, len(first) - 1)] == last + 1) & regression.kept)
    follows = follows[regression.kept[after[follows]]]
    squares = np.sum(residual[follows] ** 2)
    return float(np.sum(residual[follows] * residual[after[follows]]) / squares) if squares > 0 else 0.0


def widened_inertia(fit: Fit, inertia: Estimate, shorter: Optional[Estimate]) -> Estimate:
    """Widens the interval for effects inside windows. All shares are assumed.

    Commanded torque adds 1 %, because the current rises along a curve. Measured current adds 50 %, because current may
    flow between two samples. The lag adds a fifth of lag over window, because it need not be of first order. A gear adds
    half of the output flange, which may not follow the rotor within the backlash and in short pulses. A load behind
    backlash changes the inertia in shorter windows. The interval grows by three times the change beyond the interval
    of `shorter`."""
    motor = fit.track.motor
    flange = motor.J_out / (motor.N**2 * motor.J + motor.J_out) if motor.N > 1 else 0.0
    unseen = (0.01 if fit.experiment else 0.5, flange / 2, LAG_SHARE * fit.lag_s / WINDOW_S)
    width = math.hypot(inertia.half_width, *(share * inertia.value for share in unseen))
    if shorter is not None:
        width += 3 * max(abs(shorter.value - inertia.value) - shorter.half_width, 0.0)
    return Estimate(inertia.value, width)


def widened_cogging(fit: Fit, order: int, at: int, amplitude: Estimate, weights: np.ndarray) -> Estimate:
    """Widens the interval for ripple that is too fast for the samples.

    Measured currents miss that ripple, and half of it may bias the inertia (assumed). Windows are weighted by their
    information on the ripple."""
    w = fit.windows
    information = np.sum(fit.terms[:, at : at + 2] ** 2, axis=1) * weights
    x = order * np.abs(w.speed) * w.length / 4
    lost = np.where(w.commanded, 0.0, 1 - np.sinc(x / math.pi) ** 2)
    coarse = np.where(w.commanded, 0.0, missed_share(order, w.speed, fit.track.step_s))
    share = float(np.sum(information * np.hypot(lost / 2, coarse)) / np.sum(information))
    return Estimate(amplitude.value, math.hypot(amplitude.half_width, share * amplitude.value, PATH_SHARE * amplitude.value))


def unexplained(fit: Fit, regression: Regression) -> float:
    """Residual share of the inertial current beyond that of a gear without backlash, over commanded torques.

    Within the backlash the load does not move with the rotor, so one inertia cannot explain both states."""
    commanded = fit.windows.commanded
    if fit.track.motor.N == 1 or not fit.experiment:
        return 0.0
    inertial = regression.coefficients[INERTIA] * fit.terms[commanded, INERTIA]
    share = spread(regression.residual()[commanded]) / max(math.sqrt(np.mean(inertial**2)), 1e-9)
    usual = math.hypot(UNEXPLAINED, UNEXPLAINED_PER_S * fit.timing.sample_s)
    return math.sqrt(max(share**2 - usual**2, 0.0))


def weak_pulses(fit: Fit) -> int:
    set_points = fit.track.set_points
    pulses = int(np.count_nonzero((set_points.what == TORQUE) & (set_points.value != 0)))
    return pulses if not fit.experiment and pulses >= FEWEST_COMMANDED else 0


def inertia_of_shorter(fit: Fit, fit_terms: FitTerms) -> Estimate:
    regression = fit.shorter(fit_terms)
    return estimate(coefficient(INERTIA), regression.coefficients, regression.jackknife())


def check_stamps(track: Track, timing: Timing) -> None:
    """Raises TooRough."""
    share = track.ambiguous / max(len(track.time) + track.ambiguous, 1)
    if share > AMBIGUOUS_SHARE:
        raise TooRough(
            f"{share:.0%} of the replies came after the next query, so they may belong to either query. "
            "Log with fewer exchanges per second, or with kernel time stamps."
        )
    if abs(timing.angle_ratio - 1) > 0.1:
        raise TooRough(
            f"The angle changes {timing.angle_ratio:.2f} times as fast as the reported speed. "
            "The encoder of the motor (encoder_bits, encoder_span, gear_ratio) does not match the drive."
        )
    if timing.sample_s > ROUGH_S:
        raise TooRough(
            f"Time stamp errors of {timing.sample_s * 1e3:.1f} ms rms are too large for a torque balance. "
            "Log with kernel time stamps, e.g. with candump -L."
        )


def check_delay(fit: Fit) -> None:
    if fit.delay_s + fit.lag_s < -NEGATIVE_S:
        raise TooRough(
            f"Commands seem to act {-1e3 * (fit.delay_s + fit.lag_s):.1f} ms before their time stamps, which is impossible. "
            "The stamps are too inaccurate, or replies were paired with the wrong queries. Log with kernel time stamps."
        )


def fit_balance(track: Track, timing: Timing) -> Optional[BalanceFit]:
    """Returns None if the drive hardly turned. Raises TooRough."""
    check_stamps(track, timing)
    fit = Fit(Balance(track, timing))
    if not fit.has_enough_windows():
        return None
    fit_terms = fit.choose_terms()
    fit.fit_delay()
    check_delay(fit)
    fit.drop_limited_windows()
    fit.find_orders(fit_terms, fit.current(fit.response()))
    phase = 0.0
    if fit_terms.gravity:
        # Without gravity, the gear loss cannot be separated from friction.
        regression = fit.fit(fit_terms)
        fit_terms.gravity = estimate(gravity_of, regression.coefficients, regression.jackknife()).letter != "U"
        fit_terms.gear_loss = fit_terms.gravity and track.motor.N > 1
        phase = math.atan2(regression.coefficients[GRAVITY_COS], regression.coefficients[GRAVITY_SIN])
        fit.phase = phase
        fit.terms[:, GEAR_LOSS] = fit.balance.gear_loss(phase)
    if fit.orders:
        fit.fit_delay()
        check_delay(fit)
    regression = fit.fit(fit_terms)
    without, c = regression.jackknife(), regression.coefficients

    def of(function: Callable[[np.ndarray], float]) -> Estimate:
        return estimate(function, c, without)

    coulomb = of(coefficient(COULOMB))
    if not fit_terms.constant:
        coulomb.half_width = abs(coulomb.value)
    if not fit_terms.viscous:  # it includes viscous friction: a tenth (assumed)
        coulomb.half_width = math.hypot(coulomb.half_width, 0.1 * coulomb.value)
    # The curve of friction over speed is that of the motor file, accurate to 1 % (assumed).
    viscous = of(coefficient(VISCOUS))
    viscous.half_width = math.hypot(viscous.half_width, 0.01 * coulomb.value / float(np.percentile(np.abs(fit.windows.speed), 90)))
    cogging = []
    for n, order in enumerate(fit.orders):
        at = FIXED_TERMS + 2 * n
        amplitude = of(lambda one, at=at: float(math.hypot(one[at], one[at + 1])))
        cogging.append(Cogging(order, widened_cogging(fit, order, at, amplitude, regression.weights), math.atan2(c[at], c[at + 1])))
    inertia, shorter, notes = of(coefficient(INERTIA)), None, []
    if fit.experiment:
        shorter = inertia_of_shorter(fit, fit_terms)
        if 3 * (abs(shorter.value - inertia.value) - shorter.half_width) > 0.03 * inertia.value:
            notes.append(
                "Shorter windows give a different inertia: the gear has backlash, or the load is elastic. "
                "The interval is wider to cover this."
            )
    inertia = widened_inertia(fit, inertia, shorter)
    excess = unexplained(fit, regression)
    inertia.half_width += PLAY_SHARE * excess * inertia.value
    if excess > 0.03:
        notes.append(
            f"One inertia leaves {excess:.0%} of its torque unexplained, probably because of a load behind gear backlash. "
            "Its interval is wider to cover this."
        )
    response = fit.response()
    if np.any(response):
        # Half of the correction by the mean response may be wrong (assumed).
        plain = fit.regression(fit_terms, fit.current(np.zeros_like(response))).coefficients[INERTIA]
        inertia.half_width += abs(plain - c[INERTIA]) / 2
    current = fit.current(response)
    weight = np.where(regression.kept, regression.weights, 0)
    return BalanceFit(
        inertia=inertia, coulomb=coulomb, viscous=viscous,
        gravity=of(gravity_of) if fit_terms.gravity else None,
        gear_loss=of(lambda one: float(one[GEAR_LOSS] / gravity_of(one))) if fit_terms.gear_loss else None, gravity_phase=phase,
        cogging=sorted(cogging, key=lambda one: -one.amplitude.value), one_speed=fit.one_speed, delay_s=fit.delay_s, lag_s=fit.lag_s, lag=fit.lag,
        commanded=int(np.count_nonzero(fit.windows.commanded)), weak_pulses=weak_pulses(fit),
        rms_A=float(np.sqrt(np.sum(weight * regression.residual() ** 2) / np.sum(weight))),
        held_out_ratio=held_out_ratio(fit, fit_terms, current), autocorrelation=autocorrelation(fit, regression),
        time=fit.windows.time, current=current, terms=fit.terms, coefficients=c, notes=notes,
    )  # fmt: skip
