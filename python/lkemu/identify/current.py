"""Torque current over time.

Under torque commands it is the command with the delay and lag of the current loop. At other times it is the measured
current.
"""

from __future__ import annotations

import numpy as np

from .timing import Timing
from .track import TORQUE, Track

LEAST_LAG_S = 50e-6  # shorter lags count as 0: no log samples so fast


def trapezoids(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Cumulative integral by the trapezoidal rule, 0 at the first time."""
    return np.concatenate(([0.0], np.cumsum((values[1:] + values[:-1]) / 2 * np.diff(time))))


class Path:
    """Response of the current to commands, a first-order lag in closed form."""

    def __init__(self, at: np.ndarray, value: np.ndarray, lag_s: float) -> None:
        self.at, self.value, self.lag = at, value, lag_s if lag_s >= LEAST_LAG_S else 0.0
        steps, area = np.diff(at), value[:-1] * np.diff(at)
        if self.lag:
            decay = np.exp(-steps / self.lag)
            begin, i = np.zeros(len(value)), 0.0
            for n, (keep, towards) in enumerate(zip(decay, value), 1):
                i = towards + (i - towards) * keep
                begin[n] = i
            self.off = begin - value  # initial difference from each command
            area = area + self.off[:-1] * self.lag * (1 - decay)
        self.area = np.concatenate(([0.0], np.cumsum(area)))

    def _place(self, times: np.ndarray) -> "tuple[np.ndarray, np.ndarray]":
        """Index of the active command, -1 before the first, and its age in s."""
        place = np.searchsorted(self.at, times, side="right") - 1
        return place, np.where(place >= 0, times - self.at[place], 0.0)

    def current(self, times: np.ndarray) -> np.ndarray:
        place, since = self._place(times)
        current = self.value[place]
        if self.lag:
            current = current + self.off[place] * np.exp(-since / self.lag)
        return np.where(place >= 0, current, 0.0)

    def integral(self, times: np.ndarray) -> np.ndarray:
        """Integral of the current since the first command, A·s."""
        place, since = self._place(times)
        place = np.maximum(place, 0)
        integral = self.area[place] + self.value[place] * since
        if self.lag:
            integral += self.off[place] * self.lag * -np.expm1(-since / self.lag)
        return integral


class Commands:
    """Torque commands of a track. Other commands are replaced by the current measured at their end."""

    def __init__(self, track: Track, timing: Timing) -> None:
        torque = track.set_points.what == TORQUE
        ends = np.append(timing.set_points[1:], np.inf)
        self.value = np.where(torque, track.set_points.value, np.interp(ends, timing.time, track.iq))
        self.time = timing.set_points
        self._others = np.concatenate(([0], np.cumsum(~torque)))

    def only_torque(self, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Whether only torque commands were active from `begin` to `end`."""
        first = np.searchsorted(self.time, begin, side="right") - 1
        last = np.searchsorted(self.time, end, side="right")
        return (first >= 0) & (self._others[last] == self._others[np.maximum(first, 0)])

    def path(self, delay_s: float, lag_s: float, time: "np.ndarray | None" = None) -> Path:
        """`time`: stamps of the commands to use instead of the best estimate."""
        return Path((self.time if time is None else time) + delay_s + (lag_s if lag_s < LEAST_LAG_S else 0.0), self.value, lag_s)
