"""Torque balance over windows, in amperes of torque current.

    ⟨iq⟩ = J/k_t·Δω/T + i_c·⟨s(ω)⟩ + B/k_t·⟨ω⟩ + i_0 + Σ cogging + gravity

    s(ω) = sign ω·(1 + (τ_s/τ_c − 1)/(1 + (ω/ω_s)²))

s(ω) is the friction of docs/internals/model.md §4. Δω is the change of speed, from the source with less noise.
Reported speeds do not depend on stamps, because the drive measures them with its own clock. Angles over stamps lag less.
Both are means over some time, and the current is averaged over the same time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Iterator

import numpy as np
from scipy.ndimage import uniform_filter1d

from .current import Commands, Path, trapezoids
from .motor import Motor
from .timing import Timing
from .track import TORQUE, Track

# Window length with torque pulses: the shortest pulse of a plan, at least two sample intervals. Half without (assumed).
WINDOW_S = 0.020
SLOWEST_RAD_S = 1.0  # Lowest speed of a window: below it, static friction may balance the torque (assumed).
PART = 1 << 16  # Samples per step, limits the memory.
TIE_S = 1e-6  # Resolution of stamps: of two equally near samples, the later ends a window.
SETTLED_S = 0.020  # Time under torque commands only, after which the current depends on them alone (assumed).
EVEN_SAMPLES = 21
FEWEST_PULSES = 100  # Samples with a commanded torque (assumed).
# Longer logs have windows that start half a window apart, then a whole window apart (assumed).
MANY_SAMPLES, MOST_SAMPLES = 20_000, 200_000
SHARES = (-0.75, -0.25, 0.25, 0.75)  # Nodes of the mean over an interval, in half intervals from its middle.
# Half width in lags of a box as wide as the triangle of a speed that is measured and held for equal times.
REPORT_HALF = 0.73
REPORT_NOISE_RAD_S = 0.05  # Noise of a reported speed: resolution of 1 dps, and the encoder (assumed).
BEFORE_S = 0.004  # Time for an earlier command to end (assumed).
INERTIA, COULOMB, VISCOUS, CONSTANT, GRAVITY_SIN, GRAVITY_COS, GEAR_LOSS, PULSE_COULOMB, PULSE_VISCOUS = range(9)
FIXED_TERMS, MOST_ORDERS = 9, 4  # Each cogging order adds two terms.


def friction_shape(motor: Motor, speed: np.ndarray) -> np.ndarray:
    excess = motor.static / motor.coulomb - 1 if motor.coulomb > 0 else 0.0
    return np.sign(speed) * (1 + excess / (1 + (speed / motor.stribeck) ** 2))


def even_times(time: np.ndarray) -> np.ndarray:
    """Smooths times: running mean over EVEN_SAMPLES of the deviations from a line."""
    line = np.linspace(time[0], time[-1], len(time)) if len(time) > 1 else time
    return line + uniform_filter1d(time - line, EVEN_SAMPLES, mode="nearest")


def parts(count: int) -> Iterator[slice]:
    """Slices of `count` samples, to avoid large temporary arrays."""
    return (slice(first, first + PART) for first in range(0, count, PART))


def cumulative_count(values: np.ndarray) -> np.ndarray:
    """Number of true values before each index."""
    return np.concatenate((np.zeros(1, np.int32), np.cumsum(values, dtype=np.int32)))


@dataclass
class Windows:
    first: np.ndarray  # index of a sample
    last: np.ndarray
    length: np.ndarray  # s
    time: np.ndarray  # s, middle of the window
    speed: np.ndarray
    commanded: np.ndarray  # torque commands only
    terms: np.ndarray  # one row per window; cogging columns are 0 until an order is found

    def __len__(self) -> int:
        return len(self.first)


class Balance:
    """Computes the windows of a track and their terms, from integrals over the samples."""

    def __init__(self, track: Track, timing: Timing) -> None:
        self.track, self.timing = track, timing
        self.commands = Commands(track, timing)
        # Each sample has an averaging interval: its mean speed, half length and middle, and the angle at the middle.
        is_torque = (track.set_points.what == TORQUE) & (track.set_points.value != 0)
        torque = np.append(is_torque, False)  # False for index -1
        self.pulses = bool(np.count_nonzero(torque[track.set_points.at(track.time)]) >= FEWEST_PULSES)
        self.by_angles = self.pulses and self._less_noise_by_angles()
        if self.by_angles:
            before, after = np.arange(-1, len(timing.time) - 1), np.arange(1, len(timing.time) + 1)
            before[track.first] += 1
            after[np.append(track.first[1:], len(after)) - 1] -= 1
            self.half = np.maximum((timing.time[after] - timing.time[before]) / 2, 1e-6)
            self.time = (timing.time[after] + timing.time[before]) / 2
            self.speed = (track.angle[after] - track.angle[before]) / (2 * self.half)
            self.angle = np.interp(self.time, timing.time, track.angle)
        else:
            lag = timing.speed_lag_s
            self.half = np.broadcast_to(REPORT_HALF * lag, len(timing.time))
            self.time, self.speed, self.angle = timing.time - lag, track.speed, track.angle - lag * track.speed
        # Smoothed times for the instrument, without the jitter of the stamps. They also lack the jitter of the host.
        even = np.concatenate([even_times(part) for part in np.split(timing.time, track.first[1:])])
        self.even = even + np.median(self.time - timing.time)
        self.even_set_points = np.interp(timing.set_points, timing.time, even)
        # Mask of samples after at least SETTLED_S of torque commands only.
        self.is_settled = self.commands.only_torque(timing.time - SETTLED_S, timing.time)
        self.windows = self._windows(WINDOW_S)

    def _less_noise_by_angles(self) -> bool:
        """Compares the noise of angles over stamps with that of reported speeds, which lag by up to twice the mean."""
        track, timing = self.track, self.timing
        if track.step_s <= 0:
            return False
        steps = np.diff(timing.time)
        turning = np.abs(track.speed[1:]) > SLOWEST_RAD_S
        if not np.any(turning):
            return False
        acceleration = (np.diff(track.speed) / np.maximum(steps, track.step_s / 4))[turning]
        counts_rad = 2 * np.pi * track.span_turns / track.span_counts
        speed = np.sqrt(np.mean(track.speed[1:][turning] ** 2))
        of_angles = np.hypot(speed * timing.sample_s, counts_rad / 3) * np.sqrt(2) / (2 * track.step_s)
        of_reports = np.hypot(np.sqrt(np.mean(acceleration**2)) * timing.speed_lag_s / np.sqrt(12), REPORT_NOISE_RAD_S)
        return bool(of_angles < of_reports)

    def with_window(self, window_s: float) -> "Balance":
        """Copy with windows of another length."""
        made = object.__new__(Balance)
        made.__dict__.update(self.__dict__)
        made.windows = self._windows(window_s)
        return made

    def _windows(self, window_s: float) -> Windows:
        track, time, speed = self.track, self.time, self.speed
        # Without commanded torque the inertia is uncertain anyway, and short windows resolve faster ripple.
        least = 2 if self.pulses else 1
        span = max(window_s * least / 2, least * track.step_s)
        # Overlapping windows are nearly redundant: long logs use fewer.
        usual = max(1, round(max(WINDOW_S * least / 2, least * track.step_s) / max(track.step_s, 1e-6)))
        stride = 1 if len(time) < MANY_SAMPLES else max(1, usual // 2) if len(time) < MOST_SAMPLES else usual
        first = np.arange(0, len(time), stride, dtype=np.int32)
        begin = time[first]
        last = np.minimum(np.searchsorted(time, begin + span), len(time) - 1).astype(np.int32)
        nearer = (last > 0) & (np.abs(time[last - 1] - begin - span) < np.abs(time[last] - begin - span) - TIE_S)
        last[nearer] -= 1
        length = time[last] - time[first]
        good = (track.stretch(first) == track.stretch(last)) & (last - first >= least)
        good &= (length > 0.6 * span) & (length < 1.5 * span)
        first, last, length = first[good], last[good], length[good]
        one_way = np.zeros(len(first), bool)
        turned = np.diff(track.angle)
        for sign in (1, -1):
            way, move = cumulative_count(sign * speed >= SLOWEST_RAD_S), cumulative_count(sign * turned > 0)
            one_way |= (way[last + 1] - way[first] == last + 1 - first) & (move[last] - move[first] == last - first)
        first, last, length = first[one_way], last[one_way], length[one_way]
        commanded = self.commands.only_torque(time[first] - BEFORE_S, time[last])
        terms = np.zeros((len(first), FIXED_TERMS + 2 * MOST_ORDERS))
        made = Windows(first, last, length, (time[first] + time[last]) / 2, np.zeros(0), commanded, terms)
        made.speed = (self.angle[last] - self.angle[first]) / length
        terms[:, INERTIA] = (speed[last] - speed[first]) / length
        terms[:, COULOMB] = self.mean(friction_shape(track.motor, speed), made)
        terms[:, VISCOUS] = made.speed
        terms[:, CONSTANT] = 1
        out = self.angle / track.motor.N
        terms[:, GRAVITY_SIN] = self.mean(np.sin(out), made)
        terms[:, GRAVITY_COS] = self.mean(np.cos(out), made)
        terms[commanded, PULSE_COULOMB] = terms[commanded, COULOMB]
        terms[commanded, PULSE_VISCOUS] = terms[commanded, VISCOUS]
        return made

    def mean(self, values: np.ndarray, windows: Windows) -> np.ndarray:
        """Means of `values` at the samples over each window."""
        whole = trapezoids(self.time, values)
        return (whole[windows.last] - whole[windows.first]) / windows.length

    def gear_loss(self, phase: float) -> np.ndarray:
        track = self.track
        return self.mean(np.sign(self.speed) * np.abs(np.sin(self.angle / track.motor.N + phase)), self.windows)

    def smoothed(self, time: np.ndarray, integral: np.ndarray) -> np.ndarray:
        """Mean of an integral over the averaging interval of each sample."""
        return sum(np.interp(self.time + share * self.half, time, integral) for share in SHARES) / len(SHARES)

    def window_mean(self, values: np.ndarray) -> np.ndarray:
        """Means over each window of values at the times of the samples, averaged like the speeds."""
        w, whole = self.windows, self.smoothed(self.timing.time, trapezoids(self.timing.time, values))
        return (whole[w.last] - whole[w.first]) / w.length

    def measured_current(self) -> np.ndarray:
        """Measured current of each window."""
        return self.window_mean(self.track.iq)

    def predicted_current(self, delay_s: float, lag_s: float) -> np.ndarray:
        """Current of each window predicted from the commands."""
        w, path = self.windows, self.commands.path(delay_s, lag_s)
        if len(path.at) == 0:
            return np.zeros(len(w))
        return self.average(path, self.time)

    def instrument(self, delay_s: float, lag_s: float) -> np.ndarray:
        """As `predicted_current`, but without the noise of the stamps."""
        commands = self.commands
        path = commands.path(delay_s, lag_s, self.even_set_points)
        return self.average(path, self.even)

    def average(self, path: Path, time: np.ndarray) -> np.ndarray:
        w, half = self.windows, self.half
        begin, end = time[w.first], time[w.last]
        areas = (path.integral(end + share * half[w.last]) - path.integral(begin + share * half[w.first]) for share in SHARES)
        return sum(areas) / len(SHARES) / (end - begin)

    def current_error(self, delay_s: float, lag_s: float, samples: "np.ndarray | slice") -> np.ndarray:
        """Measured less predicted current at these samples."""
        made, time = self.track.iq[samples].copy(), self.timing.time[samples]
        path = self.commands.path(delay_s, lag_s)
        for part in parts(len(made)) if len(path.at) else ():
            made[part] -= path.current(time[part])
        return made

    def sample_mean(self, values: np.ndarray) -> np.ndarray:
        """Mean over the samples of each window."""
        w, sums = self.windows, np.concatenate(([0.0], np.cumsum(values, dtype=float)))
        return (sums[w.last + 1] - sums[w.first]) / (w.last + 1 - w.first)

    def subset(self, chosen: "np.ndarray | slice") -> "Balance":
        """Copy with some of the windows."""
        made = object.__new__(Balance)
        made.__dict__.update(self.__dict__)
        w = self.windows
        made.windows = Windows(*(one[chosen] for one in (w.first, w.last, w.length, w.time, w.speed, w.commanded, w.terms)))
        return made
