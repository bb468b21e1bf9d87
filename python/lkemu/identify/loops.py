"""Speed loop gains from the response to cogging, and winding parameters from the voltage limit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Callable, Iterator, List, Optional, Tuple

import numpy as np
from scipy.stats import t as student

from .balance import BalanceFit
from .estimate import Estimate
from .timing import Timing
from .track import SPEED, TORQUE, Track
from .windows import SLOWEST_RAD_S

SETTLES_S, SHORTEST_S = 0.2, 0.5  # Settling time after a new speed; shortest usable part (assumed).
NYQUIST_SHARE = 0.8  # Share of the Nyquist frequency up to which ripple is used: beyond it, aliases are possible.
# Current below this share of the command, and less than it by this difference, indicates the voltage limit (assumed).
LIMIT_SHARE, LIMIT_LESS_A = 0.8, 0.3
LIMIT_FEWEST, LIMIT_SPREAD_A = 40, 1.5  # Least number of samples and least range of currents for a fit (assumed).
PLATEAU_A = 0.3
PARTS = 20  # groups of the jackknife
T_95 = 2.093  # 97.5 % quantile of Student's t with 19 degrees of freedom


def constant_set_points(track: Track, what: int) -> Iterator[Tuple[int, int, int]]:
    """Yields (index of the set point, first, last): samples [first, last) have this absolute set point, without a gap.

    Repetitions of a set point count as one."""
    set_points, at = track.set_points, track.set_points.at(track.time)
    if len(set_points.time) == 0:
        return
    new = np.ones(len(set_points.time), bool)
    new[1:] = (np.diff(set_points.what) != 0) | (np.diff(set_points.value) != 0) | (set_points.absolute[1:] == 0)
    number = np.where(at >= 0, np.cumsum(new)[at], 0)
    edge = np.flatnonzero((np.diff(number) != 0) | ~track.is_contiguous) + 1
    for first, last in zip([0, *edge], [*edge, len(number)]):
        index = at[first]
        if index >= 0 and set_points.what[index] == what and set_points.absolute[index]:
            yield int(index), int(first), int(last)


# --- the speed loop ---


def ripple(time: np.ndarray, angle: np.ndarray, iq: np.ndarray, orders: List[int]) -> "Optional[Tuple[np.ndarray, ...]]":
    """Complex amplitudes of angle and current at the orders, about a parabola; their deviations; the speed."""
    length = time[-1] - time[0]
    u = (time - time[0]) / length
    columns = [np.ones_like(u), u, u * u]
    for order in orders:
        columns += [np.cos(order * angle), np.sin(order * angle)]
    rows, seen = np.column_stack(columns), np.column_stack((angle, iq))
    found = np.linalg.lstsq(rows, seen, rcond=None)[0]
    variance = np.sum((rows @ found - seen) ** 2, axis=0) / (len(u) - rows.shape[1])
    waves = found[3::2] - 1j * found[4::2]
    return waves, np.sqrt(2 * variance / len(u)), (found[1, 0] + found[2, 0]) / length


def mean(values: List[Tuple[float, float]]) -> Optional[Estimate]:
    """Weighted mean of (value, deviation). The interval is wider if values scatter more than their deviations."""
    if len(values) < 3:
        return None
    value, deviation = np.array(values).T
    weight = 1 / deviation**2
    middle = float(np.sum(weight * value) / np.sum(weight))
    spread = max(1.0, float(np.sum(weight * (value - middle) ** 2)) / (len(value) - 1))
    return Estimate(middle, float(student.ppf(0.975, len(value) - 1)) * math.sqrt(spread / float(np.sum(weight))))


def fit_speed_loop(track: Track, timing: Timing, balance: BalanceFit) -> "Tuple[Optional[Estimate], Optional[Estimate]]":
    """Fits Kp (A·s/rad) and Ki (A/rad) in iq = −(Kp + Ki/s)·ω to the ripple of cogging at steady speeds."""
    orders = [one.order for one in balance.cogging if one.amplitude.is_usable]
    kp: List[Tuple[float, float]] = []
    ki: List[Tuple[float, float]] = []
    if not orders:
        return None, None
    control = track.motor.data["control"]
    pwm_s, motion_s = 1 / track.motor.number("inverter", "f_pwm_kHz", 1e3), track.motor.motion_period_s
    # Lags of estimator, motion period, PWM and current loop (docs/internals/model.md §10, §11).
    lag_s = 1 / control["estimator_bandwidth_rad_s"] + motion_s + pwm_s + 1 / control["current_bandwidth_rad_s"]
    for index, first, last in constant_set_points(track, SPEED):
        first = int(np.searchsorted(track.time, track.time[first] + SETTLES_S))
        if first >= last or timing.time[last - 1] - timing.time[first] < SHORTEST_S:
            continue
        if abs(track.set_points.value[index]) < SLOWEST_RAD_S or last - first < 4 * (3 + 2 * len(orders)):
            continue
        part = slice(first, last)
        waves, deviation, speed = ripple(timing.time[part], track.angle[part], track.iq[part], orders)
        for n, times in enumerate(orders):
            omega = times * speed
            swing = 1j * omega * waves[n, 0]
            off = abs(omega) * deviation[0]
            if abs(omega) > NYQUIST_SHARE * math.pi / track.step_s or abs(swing) < 4 * off:
                continue
            gain = -waves[n, 1] / swing * np.exp(1j * omega * lag_s)
            uncertain = math.hypot(deviation[1], abs(gain) * off) / abs(swing)
            kp.append((gain.real, uncertain))
            ki.append((-gain.imag * omega, uncertain * abs(omega)))
    return mean(kp), mean(ki)


# --- the windings ---


@dataclass
class VoltageFit:
    no_load: Estimate  # rad/s, speed at the voltage limit without current
    k_t: Optional[Estimate]
    resistance: Optional[Estimate]


def limited(track: Track) -> "Tuple[np.ndarray, np.ndarray]":
    """Speeds and currents, in the direction of the command, of samples with less current than commanded."""
    set_points, now = track.set_points, track.set_points.at(track.time)
    if len(set_points.time) == 0:
        return np.zeros(0), np.zeros(0)
    before = np.concatenate(([-1], now[:-1]))
    commanded = np.where(now >= 0, set_points.value[now], 0.0)
    sign = np.sign(commanded)
    iq, speed = sign * track.iq, sign * track.speed
    chosen = (before >= 0) & (set_points.what[now] == TORQUE) & (commanded != 0)
    # An equal set point at the previous sample: the current has settled.
    chosen &= (set_points.value[before] == commanded) & (set_points.what[before] == TORQUE)
    chosen &= (speed > 0) & (iq <= LIMIT_SHARE * np.abs(commanded)) & (iq <= np.abs(commanded) - LIMIT_LESS_A)
    speed, iq = speed[chosen], iq[chosen]
    # A torque limit also reduces the current, at any speed. Many samples at the largest current indicate one (assumed).
    if len(iq):
        high = iq > iq.max() - PLATEAU_A
        if 5 * np.count_nonzero(high) > len(iq):
            speed, iq = speed[~high], iq[~high]
    return speed, iq


def fit_voltage(track: Track) -> Optional[VoltageFit]:
    """Fits √(V² − (ω_e·L_q·iq)²) = R·iq + p·ψ·ω by least squares."""
    speed, iq = limited(track)
    if len(iq) < LIMIT_FEWEST or np.ptp(iq) < LIMIT_SPREAD_A:
        return None
    motor = track.motor
    most_V = motor.modulation * (track.supply_V or motor.supply_V)
    across_V = motor.pole_pairs * speed * motor.number("motor", "L_q_mH", 1e-3) * iq
    volts = np.sqrt(np.maximum(most_V**2 - across_V**2, 0.0))
    rows = np.column_stack((iq, speed))
    part = np.arange(len(iq)) * PARTS // len(iq)

    def windings(chosen: np.ndarray) -> np.ndarray:
        return np.linalg.lstsq(rows[chosen], volts[chosen], rcond=None)[0]

    whole, without = windings(part >= 0), [windings(part != n) for n in range(PARTS)]

    def estimate(of: Callable[[np.ndarray], float]) -> Estimate:
        made = np.array([of(one) for one in without])
        spread = T_95 * math.sqrt(float(np.mean((made - made.mean()) ** 2)) * (PARTS - 1))
        return Estimate(float(of(whole)), math.hypot(0.01 * of(whole), spread))  # the voltage is known to 1 % (assumed)

    known = track.supply_V > 0
    return VoltageFit(
        estimate(lambda w: most_V / w[1]), estimate(lambda w: 1.5 * w[1]) if known else None,
        estimate(lambda w: w[0]) if known else None,
    )  # fmt: skip
