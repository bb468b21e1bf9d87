"""The torque current over time: what was commanded, through the delay and the lag of the drive's current loop, as the
measured currents show them; between commands of torque the measured currents themselves."""

from __future__ import annotations

import numpy as np

from .timing import Timing
from .track import TORQUE, Track

CHUNK = 8192  # commands at a time, for memory
LEAST_LAG_S = 50e-6  # less is none: no log has so many samples


def trapezoids(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """The integral from the first time to each."""
    return np.concatenate(([0.0], np.cumsum((values[1:] + values[:-1]) / 2 * np.diff(time))))


class Path:
    """The current that follows commands, at any times."""

    def __init__(self, at: np.ndarray, value: np.ndarray, lag_s: float) -> None:
        self.at, self.value, self.lag = at, value, lag_s if lag_s >= LEAST_LAG_S else 0.0
        steps, area = np.diff(at), value[:-1] * np.diff(at)
        if self.lag:
            decay = np.exp(-steps / self.lag)
            begin, i = np.zeros(len(value)), 0.0
            for first in range(0, len(decay), CHUNK):
                part = slice(first, first + CHUNK)
                made = []
                for keep, towards in zip(decay[part].tolist(), value[part].tolist()):
                    i = towards + (i - towards) * keep
                    made.append(i)
                begin[first + 1 : first + 1 + len(made)] = made
            self.off = begin - value  # by what the current is beyond each command when that acts
            area = area + self.off[:-1] * self.lag * (1 - decay)
        self.area = np.concatenate(([0.0], np.cumsum(area)))

    def __call__(self, times: np.ndarray) -> "tuple[np.ndarray, np.ndarray]":
        """The current, and its integral since the first command."""
        place = np.searchsorted(self.at, times, side="right") - 1
        n = np.maximum(place, 0)
        since = np.where(place >= 0, times - self.at[n], 0.0)
        current, integral = self.value[n], self.area[n] + self.value[n] * since
        if self.lag:
            left = np.exp(-since / self.lag)
            current, integral = current + self.off[n] * left, integral + self.off[n] * self.lag * (1 - left)
        return np.where(place >= 0, current, 0.0), integral


class Commands:
    """The commands of torque of a track. Where others are in force, the current is what was measured last."""

    def __init__(self, track: Track, timing: Timing) -> None:
        torque = track.orders.what == TORQUE
        self.value = np.where(torque, track.orders.value, np.interp(timing.orders, timing.time, track.iq))
        self.time = timing.orders
        self._others = np.concatenate(([0], np.cumsum(~torque)))

    def only_torque(self, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Whether nothing else was in force from then to then."""
        first = np.searchsorted(self.time, begin, side="right") - 1
        last = np.searchsorted(self.time, end, side="right")
        return (first >= 0) & (self._others[last] == self._others[np.maximum(first, 0)])

    def path(self, delay_s: float, lag_s: float, time: "np.ndarray | None" = None) -> Path:
        """`time`: of the commands, in place of the best that is known."""
        return Path((self.time if time is None else time) + delay_s + (lag_s if lag_s < LEAST_LAG_S else 0.0), self.value, lag_s)
