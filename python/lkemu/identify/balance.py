"""What the balance of torques tells of a drive's mechanics, with intervals. All in amperes of torque current: k_t does not
show in a log."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Callable, List, Optional

import numpy as np
from scipy.optimize import minimize

from .estimate import Estimate
from .regression import GROUPS, OUTLIER, RUN_S, Regression, estimate
from .timing import Timing, spread
from .track import TORQUE, Track
from .windows import (
    COULOMB, CONSTANT, FIXED_TERMS, GEAR_LOSS, GRAVITY_COS, GRAVITY_SIN, INERTIA, PULSE_COULOMB, PULSE_VISCOUS, VISCOUS, Balance,
)  # fmt: skip

FEWEST_WINDOWS = 240
FEWEST_COMMANDED = 100  # with a commanded torque, to count as an experiment (assumed)
GRAVITY_TRAVEL_RAD = 1.0  # of the output, for gravity to show (assumed)
HIGHEST_ORDER, MOST_ORDERS = 200, 4
# By how many variances a new order must lower the sum of squares: with 200 to choose from, noise does it once in 10⁷ logs.
ORDER_GAIN = 43.0
SEEN_GAIN, OTHER_SPEED = 12.0, 1.4  # and at each of two speeds at least, so many times apart (assumed)
PATH_SHARE = 0.02  # of an amplitude, for the path between samples (assumed)
# Time since a change of the command, for the mean response of the current; what is later is its end.
AGES_S = np.array([0.0, 1e-3, 2e-3, 3.5e-3, 5e-3, 7e-3, 9e-3, 12e-3, 15e-3, 20e-3, 27e-3, 36e-3, 50e-3, 70e-3])
SIGNIFICANT = 4.0  # standard deviations of χ²
MISSED = 0.02  # windows that miss more of a ripple hardly count (assumed)
SEARCHED = 6_000  # windows that are enough to find an order by
NOT_GIVEN_A, NOT_GIVEN_SHARE = 0.5, 0.2  # a drive that gives less than it was told is at a limit (assumed)
DELAYS_S = (-6e-3, -4e-3, -3e-3, -2e-3, -1e-3, 0.0, 1e-3, 2e-3, 3e-3, 5e-3, 8e-3, 12e-3, 20e-3)
LAGS_S = (0.0, 0.5e-3, 2e-3, 5e-3, 12e-3, 30e-3)
LATE_S = 0.010  # after a change of the command (assumed)
MOST_ROWS = 1500  # windows and samples that are enough to find a delay by
AMBIGUOUS_SHARE, ROUGH_S = 0.2, 2.5e-3  # more than that is refused (assumed)
NEGATIVE_S = 0.5e-3  # a drive cannot act before it is told; so much may be the stamps (assumed)


class TooRough(Exception):
    """Why the stamps do not tell what acted when."""


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
    gravity: Optional[Estimate]  # None: the output did not turn far enough
    gear_loss: Optional[Estimate]  # (1/η − η)/2 over (1/η + η)/2
    gravity_phase: float
    cogging: List[Cogging]  # the strongest first
    one_speed: List[int]  # orders that show at one speed alone
    delay_s: float  # from the stamp of a command until it acts, seen from the reported speed
    lag_s: float
    lag: Optional[Estimate]  # of the current behind the command, s
    commanded: int
    weak_pulses: int  # torques that were commanded, where they hardly moved the shaft
    rms_A: float
    held_out_ratio: float
    autocorrelation: float
    time: np.ndarray  # of the windows, for pictures
    given: np.ndarray
    terms: np.ndarray
    coefficients: np.ndarray
    notes: List[str] = field(default_factory=list)

    def expected(self) -> np.ndarray:
        return self.terms @ self.coefficients


@dataclass
class Looked:
    """Which of the terms are looked for."""

    constant: bool
    viscous: bool
    pulses: bool  # for their friction apart
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


def gravity_of(coefficients: np.ndarray) -> float:
    return float(math.hypot(coefficients[GRAVITY_SIN], coefficients[GRAVITY_COS]))


def coefficient(term: int) -> Callable[[np.ndarray], float]:
    return lambda c: float(c[term])


class Fit:
    def __init__(self, track: Track, timing: Timing) -> None:
        self.track, self.timing = track, timing
        self.balance = Balance(track, timing)
        self.windows = self.balance.windows
        self.orders: List[int] = []
        self.one_speed: List[int] = []
        self.delay_s = self.lag_s = 0.0
        self.lag: Optional[Estimate] = None
        self.terms = self.windows.terms
        self.rough = np.zeros(0)

    def possible(self) -> bool:
        return len(self.windows) >= FEWEST_WINDOWS

    # --- what can be looked for ---

    def looked(self) -> Looked:
        w, track = self.windows, self.track
        self.experiment = np.count_nonzero(w.commanded) >= FEWEST_COMMANDED
        # Friction changes its sign with the speed, and an offset does not: a tenth turns the other way (assumed).
        share = np.mean(w.speed > 0)
        # Of the windows with little acceleration, the fast ones are so much faster than the slow ones (assumed).
        quiet = np.argsort(np.abs(w.terms[:, INERTIA]))[: len(w) // 2]
        low, high = np.percentile(np.abs(w.speed[quiet]), (10, 90))
        known = len(track.first) == 1 or track.span_turns == track.motor.N
        turned = np.ptp(track.angle) / track.motor.N
        geared = track.motor.N > 1
        measured = len(w) - np.count_nonzero(w.commanded)
        return Looked(
            constant=bool(0.1 < share < 0.9), viscous=bool(high > 2.5 * low),
            pulses=geared and bool(self.experiment) and measured >= FEWEST_COMMANDED,
            gravity=bool(known and turned >= GRAVITY_TRAVEL_RAD),
        )  # fmt: skip

    # --- delay and lag of the current ---

    def find_delay(self) -> None:
        """Those with which the commands explain the accelerations and the measured currents best."""
        if not self.experiment:
            return
        w, balance = self.windows, self.balance
        runs = (w.time / RUN_S).astype(int)
        rows = np.flatnonzero(w.commanded)
        # Whole runs of them, from all over the log.
        numbers = np.unique(runs[rows])
        rows = rows[np.isin(runs[rows], numbers[:: len(rows) // MOST_ROWS + 1])]
        own = balance.some(rows)
        acceleration = w.terms[rows, INERTIA]
        others = np.column_stack((w.terms[rows][:, [COULOMB, VISCOUS, CONSTANT]], self.terms[rows, FIXED_TERMS:]))
        followed = np.flatnonzero(balance.follows)
        followed = followed[:: len(followed) // MOST_ROWS + 1]
        overlap = max(1.0, float(np.median(w.last - w.first)))

        def loss(delay_s: float, lag_s: float) -> float:
            columns = np.column_stack((own.followed(delay_s, max(lag_s, 0.0)), others))
            left = acceleration - columns @ np.linalg.lstsq(columns, acceleration, rcond=None)[0]
            kept = np.abs(left) < OUTLIER * np.median(np.abs(left))
            left = acceleration - columns @ np.linalg.lstsq(columns[kept], acceleration[kept], rcond=None)[0]
            off = balance.beyond(delay_s, max(lag_s, 0.0), followed)
            return len(rows) / overlap * math.log(clipped(left)) + len(followed) * math.log(clipped(off))

        # The sum of both is what the shaft tells; how it is shared, what the measured currents do.
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
        # As far as the loss rises by what one degree of freedom lets it rise in 95 of 100 logs.
        step = 0.1e-3
        while step < 0.1 and loss(max(self.delay_s - step, 0.0), self.lag_s + step) < found.fun + 3.84:
            step *= 2
        self.lag = Estimate(self.lag_s, step)

    # --- cogging ---

    def set_terms(self, phase: float = 0.0) -> None:
        averages = self.balance.cogging(self.orders)
        parts = np.empty((len(self.windows), 2 * len(self.orders)))
        parts[:, 0::2], parts[:, 1::2] = averages.real, averages.imag
        self.terms = np.column_stack((self.windows.terms, parts))

    def next_order(self, regression: Regression, averages: np.ndarray, every: int) -> int:
        """The order that explains most of what is left at two speeds at least; 0: none explains enough."""
        chosen = np.flatnonzero(regression.kept[::every])
        weight = regression.weights[::every][chosen]
        left = regression.residual()[::every][chosen]
        overlap = max(1.0, float(np.median(self.windows.last - self.windows.first)) / every)
        speed = self.windows.speed[::every][chosen]
        gains = np.array([gain(averages[chosen, k], weight, left) for k in range(averages.shape[1])]) / overlap
        for order in [*self.orders, *self.one_speed]:
            gains[order - 1] = 0
        while True:
            best = int(np.argmax(gains)) + 1
            if gains[best - 1] < ORDER_GAIN:
                return 0
            if self.at_several_speeds(averages[chosen, best - 1], weight, left, speed, overlap):
                return best
            self.one_speed.append(best)
            gains[best - 1] = 0

    def at_several_speeds(self, average: np.ndarray, weight: np.ndarray, left: np.ndarray, speed: np.ndarray, overlap: float) -> bool:
        """Whatever goes on in time looks like cogging while the shaft turns at one speed, and at another it does not."""
        label = np.floor(np.log(np.abs(speed) + 1e-9) / math.log(1.2)) + 1000 * (speed > 0)
        seen = []
        for one in np.unique(label):
            some = label == one
            if np.count_nonzero(some) >= 3 * overlap and gain(average[some], weight[some], left[some]) / overlap >= SEEN_GAIN:
                seen.append(float(np.mean(speed[some])))
        return bool(seen) and not (min(seen) * max(seen) > 0 and max(map(abs, seen)) < OTHER_SPEED * min(map(abs, seen)))

    def find_orders(self, looked: Looked, given: np.ndarray) -> None:
        every = len(self.windows) // SEARCHED + 1
        averages = self.balance.some(slice(None, None, every)).cogging(list(range(1, HIGHEST_ORDER + 1)))
        while len(self.orders) < MOST_ORDERS:
            regression = self.regression(looked, given)
            order = self.next_order(regression, averages, every)
            if order == 0:
                return
            self.orders.append(order)
            self.set_terms()

    # --- all of it ---

    def response(self) -> np.ndarray:
        """At the samples, what the measured currents are beyond the model, as a mean over the log: in proportion to the last
        change of the command, by the time since. 0 where that is not significant."""
        balance, commands = self.balance, self.balance.commands
        changes = np.flatnonzero(np.diff(commands.value) != 0) + 1
        none = np.zeros(len(balance.time))
        if len(changes) < FEWEST_COMMANDED:
            return none
        beyond = balance.beyond(self.delay_s, self.lag_s, slice(None))
        latest = np.searchsorted(commands.time[changes] + self.delay_s, self.timing.time, side="right") - 1
        place = np.maximum(latest, 0)
        age = self.timing.time - commands.time[changes][place] - self.delay_s
        step = np.diff(commands.value)[changes - 1][place]
        bins = np.where(latest >= 0, np.searchsorted(AGES_S, age), len(AGES_S))
        chosen = balance.follows & (bins < len(AGES_S))
        if not np.any(chosen):
            return none
        size = np.bincount(bins[chosen], step[chosen] ** 2, len(AGES_S) + 1)
        share = np.bincount(bins[chosen], step[chosen] * beyond[chosen], len(AGES_S) + 1) / np.maximum(size, 1e-12)
        noise = spread(beyond[chosen] - (share[bins] * step)[chosen])
        told = size > 0
        chi_squared = np.sum(share[told] ** 2 * size[told]) / max(noise**2, 1e-12)
        if chi_squared < np.count_nonzero(told) + SIGNIFICANT * math.sqrt(2 * np.count_nonzero(told)):
            return none
        share[-1] = 0
        return share[bins] * step

    def given(self, response: np.ndarray) -> np.ndarray:
        """The current of each window: what follows the commands, and what the measured ones are beyond that, as far as it
        is more than their noise."""
        balance, w = self.balance, self.windows
        if not np.any(w.commanded):
            return balance.taken()
        beyond = balance.beyond(self.delay_s, self.lag_s, slice(None)) - response
        mean = balance.over(beyond)[w.commanded]
        noise = spread(np.diff(beyond[balance.follows])) ** 2 / 2 / (np.median(w.last - w.first) + 1)
        share = min(1.0, max(0.0, 2 * spread(mean) ** 2 / max(noise, 1e-12) - 2.4))  # noise alone has 1, none from 1.2 on
        made = balance.taken()
        followed = balance.followed(self.delay_s, self.lag_s) + balance.integrated(response)
        made[w.commanded] = followed[w.commanded] + share * mean
        return made

    def leave_out_limits(self) -> None:
        """Windows in which the drive gave less than it was told: it was at a limit, or did not hear."""
        balance = self.balance
        off = np.abs(balance.over(balance.beyond(self.delay_s, self.lag_s, slice(None))))
        told = np.abs(balance.followed(self.delay_s, self.lag_s))
        sure = ~self.windows.commanded | (off <= NOT_GIVEN_A + NOT_GIVEN_SHARE * told)
        self.balance = balance.some(sure)
        self.windows = self.balance.windows
        self.terms = self.terms[sure]

    def fit(self, looked: Looked) -> Regression:
        return self.regression(looked, self.given(self.response()))

    def regression(self, looked: Looked, given: np.ndarray, chosen: "np.ndarray | slice" = slice(None)) -> Regression:
        used = looked.used(len(self.orders))
        windows = self.balance.some(chosen).windows
        rough = self.rough[chosen] if len(self.rough) else np.zeros(len(windows))
        expected = self.balance.instrument(self.delay_s, self.lag_s)[chosen] if self.experiment else given[chosen]
        return Regression(windows, self.terms[chosen], given[chosen], used, bool(self.experiment), rough, expected)

    def note_rough(self, regression: Regression) -> None:
        """Currents at the samples tell little of a ripple that is faster than these: such windows hardly count."""
        w, c = self.windows, regression.coefficients
        self.rough = np.zeros(len(w))
        for n, order in enumerate(self.orders):
            at = FIXED_TERMS + 2 * n
            self.rough += np.where(missed(order, w.speed, self.track.step_s) > MISSED, 9 * (c[at] ** 2 + c[at + 1] ** 2), 0.0)


def clipped(values: np.ndarray) -> float:
    """The mean square, with what is far off taken for as far as is usual."""
    off = np.abs(values)
    return float(np.mean(np.minimum(off, max(1.5 * OUTLIER * np.median(off), 1e-6)) ** 2))


def gain(average: np.ndarray, weight: np.ndarray, left: np.ndarray) -> float:
    rows = np.column_stack((average.real, average.imag))
    weighed = rows * weight[:, None]
    right = weighed.T @ left
    return float(right @ np.linalg.lstsq(weighed.T @ rows, right, rcond=1e-9)[0])


def whitened(regression: Regression) -> np.ndarray:
    return np.sqrt(regression.weights) * regression.residual()


def held_out_ratio(fit: Fit, looked: Looked, given: np.ndarray) -> float:
    """Each half of the log is fitted and tried on the other: what is left there, over what is left where it was fitted."""
    half = (fit.windows.time / 0.2).astype(int) % 2
    fitted = held = 0.0
    for n in (0, 1):
        own, other = half == n, half != n
        if np.count_nonzero(own) < GROUPS or np.count_nonzero(other) < GROUPS:
            return 1.0
        part = fit.regression(looked, given, own)
        fitted += spread(part.residual()) ** 2
        held += spread(given[other] - fit.terms[other] @ part.coefficients) ** 2
    return math.sqrt(held / fitted) if fitted > 0 else 1.0


def autocorrelation(fit: Fit, regression: Regression) -> float:
    """Of what is left in windows that follow each other and share no sample."""
    left, first, last = whitened(regression), fit.windows.first, fit.windows.last
    after = np.searchsorted(first, last + 1)
    inside = after < len(first)
    follows = np.flatnonzero(inside & (first[np.minimum(after, len(first) - 1)] == last + 1) & regression.kept)
    follows = follows[regression.kept[after[follows]]]
    squares = np.sum(left[follows] ** 2)
    return float(np.sum(left[follows] * left[after[follows]]) / squares) if squares > 0 else 0.0


def widened_inertia(fit: Fit, inertia: Estimate, difference: Optional[Estimate]) -> Estimate:
    """And of what windows do not see. Where torques were commanded: the current rises along a curve (1 %, assumed). Where
    they were not, a current may have come and gone between two samples (a half, assumed). Within the play of a gear, and in
    short pulses, the flange of the output hangs on the rotor or does not. Where the beginning of pulses tells another inertia
    than later windows, the interval has both."""
    motor = fit.track.motor
    flange = motor.J_out / (motor.N**2 * motor.J + motor.J_out) if motor.N > 1 else 0.0
    unseen = (0.01 if fit.experiment else 0.5, flange / 2)
    width = math.hypot(inertia.half_width, *(share * inertia.value for share in unseen))
    if difference is not None and abs(difference.value) > difference.half_width:
        width += abs(difference.value) - difference.half_width
    return Estimate(inertia.value, width)


def late_inertia(fit: Fit, regression: Regression) -> Optional[Estimate]:
    """The inertia of windows well after the last change of the command, less that of all. Play in a gear and a current that
    follows otherwise than modelled make a difference there."""
    balance, w, c = fit.balance, fit.windows, regression.coefficients
    orders = balance.commands
    changes = orders.time[1:][np.diff(orders.value) != 0]
    if len(changes) == 0:
        return None
    latest = np.searchsorted(changes, balance.time[w.last]) - 1
    since = balance.time[w.first] - np.where(latest >= 0, changes[np.maximum(latest, 0)], -np.inf)
    usable = w.commanded & regression.kept
    late = usable & (since >= LATE_S)
    if np.count_nonzero(late) < FEWEST_COMMANDED or np.count_nonzero(usable) - np.count_nonzero(late) < FEWEST_COMMANDED:
        return None
    others = c.copy()
    others[INERTIA] = 0
    weight = regression.weights * regression.instrument
    left, acceleration = weight * (regression.given - regression.terms @ others), weight * regression.terms[:, INERTIA]
    group = (w.time / RUN_S).astype(int) % GROUPS

    def without(chosen: np.ndarray) -> np.ndarray:
        """Of all, and without each group."""
        sums = [np.bincount(group[chosen], one[chosen], GROUPS) for one in (left, acceleration)]
        totals = [float(np.sum(one)) for one in sums]
        return np.concatenate(([totals[0] / totals[1]], (totals[0] - sums[0]) / (totals[1] - sums[1])))

    difference = without(late) - without(usable)
    return estimate(lambda one: float(one[0]), difference[:1], difference[1:, None])


def missed(order: int, speed: np.ndarray, step_s: float) -> np.ndarray:
    """The share of a ripple that a sum over samples misses."""
    x = np.clip(order * np.abs(speed) * step_s / 2, 1e-6, 1.5)
    return 1 - x / np.tan(x)


def widened_cogging(fit: Fit, order: int, at: int, amplitude: Estimate, weights: np.ndarray) -> Estimate:
    """Currents at the samples miss of a ripple what is too fast for them, and half of that may have gone to the inertia
    unseen (assumed). Windows count by what they tell of the ripple."""
    w = fit.windows
    tells = np.sum(fit.terms[:, at : at + 2] ** 2, axis=1) * weights
    x = order * np.abs(w.speed) * w.length / 4
    lost = np.where(w.commanded, 0.0, 1 - np.sinc(x / math.pi) ** 2)
    coarse = np.where(w.commanded, 0.0, missed(order, w.speed, fit.track.step_s))
    share = float(np.sum(tells * np.hypot(lost / 2, coarse)) / np.sum(tells))
    return Estimate(amplitude.value, math.hypot(amplitude.half_width, share * amplitude.value, PATH_SHARE * amplitude.value))


def weak_pulses(fit: Fit) -> int:
    orders = fit.track.orders
    pulses = int(np.count_nonzero((orders.what == TORQUE) & (orders.value != 0)))
    return pulses if not fit.experiment and pulses >= FEWEST_COMMANDED else 0


def check_stamps(track: Track, timing: Timing) -> None:
    """Raises TooRough."""
    share = track.ambiguous / max(len(track.time) + track.ambiguous, 1)
    if share > AMBIGUOUS_SHARE:
        raise TooRough(
            f"{share:.0%} of the replies came after the next query, so that nobody can tell which query they answer: log with "
            "fewer exchanges per second, or with time stamps of the kernel."
        )
    if abs(timing.angle_ratio - 1) > 0.1:
        raise TooRough(
            f"The shaft turns {timing.angle_ratio:.2f} times as far as the reported speeds say: the encoder of the motor file (bits, "
            "encoder_span, gear_ratio) is not that of the drive."
        )
    if timing.sample_s > ROUGH_S:
        raise TooRough("The time stamps are too rough for a balance of torques: log with time stamps of the kernel (candump does).")


def check_delay(fit: Fit) -> None:
    if fit.delay_s + fit.lag_s < -NEGATIVE_S:
        raise TooRough(
            f"Commands seem to act {-1e3 * (fit.delay_s + fit.lag_s):.1f} ms before their time stamps, which cannot be: the stamps are too "
            "rough, or replies have been taken for those of other queries. Log with time stamps of the kernel."
        )


def fit_balance(track: Track, timing: Timing) -> Optional[BalanceFit]:
    """None where the drive hardly turned. Raises TooRough."""
    check_stamps(track, timing)
    fit = Fit(track, timing)
    if not fit.possible():
        return None
    looked = fit.looked()
    fit.find_delay()
    check_delay(fit)
    fit.leave_out_limits()
    fit.find_orders(looked, fit.given(fit.response()))
    phase = 0.0
    if looked.gravity:
        # Where there is none, what a gear takes of it looks like friction.
        regression = fit.fit(looked)
        looked.gravity = estimate(gravity_of, regression.coefficients, regression.jackknife()).letter != "U"
        looked.gear_loss = looked.gravity and track.motor.N > 1
        phase = math.atan2(regression.coefficients[GRAVITY_COS], regression.coefficients[GRAVITY_SIN])
        fit.terms[:, GEAR_LOSS] = fit.balance.gear_loss(phase)
    if fit.orders:
        fit.find_delay()
        check_delay(fit)
    fit.note_rough(fit.fit(looked))
    regression = fit.fit(looked)
    without, c = regression.jackknife(), regression.coefficients

    def of(function: Callable[[np.ndarray], float]) -> Estimate:
        return estimate(function, c, without)

    coulomb = of(coefficient(COULOMB))
    if not looked.constant:
        coulomb.half_width = abs(coulomb.value)
    if not looked.viscous:  # what of it grows with the speed is in it: a tenth, assumed
        coulomb.half_width = math.hypot(coulomb.half_width, 0.1 * coulomb.value)
    cogging = []
    for n, order in enumerate(fit.orders):
        at = FIXED_TERMS + 2 * n
        amplitude = of(lambda one, at=at: float(math.hypot(one[at], one[at + 1])))
        cogging.append(Cogging(order, widened_cogging(fit, order, at, amplitude, regression.weights), math.atan2(c[at], c[at + 1])))
    difference = late_inertia(fit, regression) if fit.experiment else None
    inertia = widened_inertia(fit, of(coefficient(INERTIA)), difference)
    response = fit.response()
    if np.any(response):
        # Half of what the mean response changes may be wrong (assumed).
        plain = fit.regression(looked, fit.given(np.zeros_like(response))).coefficients[INERTIA]
        inertia.half_width += abs(plain - c[INERTIA]) / 2
    notes = []
    if difference is not None and abs(difference.value) - difference.half_width > 0.02 * inertia.value:
        notes.append(
            "The inertia is another at the beginning of torque pulses than later: play in the gear or a load on a spring. Its interval "
            "is wider for that."
        )
    given = fit.given(response)
    weight = np.where(regression.kept, regression.weights, 0)
    return BalanceFit(
        inertia=inertia, coulomb=coulomb, viscous=of(coefficient(VISCOUS)),
        gravity=of(gravity_of) if looked.gravity else None,
        gear_loss=of(lambda one: float(one[GEAR_LOSS] / gravity_of(one))) if looked.gear_loss else None, gravity_phase=phase,
        cogging=sorted(cogging, key=lambda one: -one.amplitude.value), one_speed=fit.one_speed, delay_s=fit.delay_s, lag_s=fit.lag_s, lag=fit.lag,
        commanded=int(np.count_nonzero(fit.windows.commanded)), weak_pulses=weak_pulses(fit),
        rms_A=float(np.sqrt(np.sum(weight * regression.residual() ** 2) / np.sum(weight))),
        held_out_ratio=held_out_ratio(fit, looked, given), autocorrelation=autocorrelation(fit, regression),
        time=fit.windows.time, given=given, terms=fit.terms, coefficients=c, notes=notes,
    )  # fmt: skip
