"""Cogging orders: their averages over windows, and the search for them in the residuals."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Callable, List

import numpy as np

from .regression import Regression
from .windows import FIXED_TERMS, MOST_ORDERS, SHARES, Balance

HIGHEST_ORDER = 200
# Least decrease of the sum of squares for a new order, in variances. With 200 candidates, noise reaches it once in
# 10⁷ logs.
ORDER_GAIN = 43.0
# Least decrease at other speeds, in variances. Other speeds differ at least by this factor from the speed with the
# largest decrease (assumed).
SEEN_GAIN, OTHER_SPEED = 9.0, 1.4
# Windows of measured currents that miss a larger share of a ripple are not used for it (assumed).
MISSED = 0.02
SEARCH_RUN = 300  # Consecutive windows in the search.
SEARCHED = 6_000  # Windows used by the search, about.
MOST_EXACT = 8  # Orders integrated exactly.
PARTS = 8  # Integration steps between two samples.
BLOCK, BLOCK_GAP = 4096, 50  # Windows; largest gap inside a block, in samples.


def averages(balance: Balance, orders: List[int]) -> np.ndarray:
    """⟨e^(jnθ)⟩ of each window and order n.

    With commanded torque, the angle follows a cubic through both angles and speeds. With measured currents, the mean
    uses the samples only: ripple too fast for them is then missing from both sides of the equation."""
    w = balance.windows
    made = np.empty((len(w), len(orders)), np.complex64 if len(orders) > MOST_EXACT else complex)
    # Blocks limit the memory. A gap between windows begins a new block.
    blocks = np.flatnonzero(np.diff(w.first) > BLOCK_GAP) + 1
    for block in np.split(np.arange(len(w)), blocks):
        for part in np.array_split(block, len(block) // BLOCK + 1):
            if len(part):
                made[part] = of_block(balance, orders, part)
    return made


def of_block(balance: Balance, orders: List[int], part: np.ndarray) -> np.ndarray:
    w = balance.windows
    low, high = max(int(w.first[part].min()) - 3, 0), int(w.last[part].max()) + 4
    time, angle, speed, half = (one[low:high] for one in (balance.time, balance.angle, balance.speed, balance.half))
    first, last, commanded = w.first[part] - low, w.last[part] - low, w.commanded[part]
    steps = np.diff(time)
    a, b = angle[:-1], angle[1:]
    # With wrong stamps the reported speeds contradict the angles. Clipping keeps the cubic monotone between the angles.
    va = np.clip(speed[:-1] * steps, -np.abs(3 * (b - a)), np.abs(3 * (b - a)))
    vb = np.clip(speed[1:] * steps, -np.abs(3 * (b - a)), np.abs(3 * (b - a)))
    u = (np.arange(PARTS) + 0.5) / PARTS
    v = 1 - u
    path = np.outer(a, v * v * (1 + 2 * u)) + np.outer(b, u * u * (1 + 2 * v)) + u * v * (np.outer(va, v) - np.outer(vb, u))
    fine_time = np.append((time[:-1, None] + steps[:, None] * np.arange(PARTS) / PARTS).ravel(), time[-1])
    search = len(orders) > MOST_EXACT  # the orders are then 1, 2, …, and a mean over each step is accurate enough
    once, once_at = np.exp(1j * path), np.exp(1j * angle)
    power, power_at = np.ones_like(once), np.ones_like(once_at)
    made = np.empty((len(part), len(orders)), complex)
    nodes = [time + share * half for share in SHARES]
    for k, order in enumerate(orders):
        if search:
            power *= once
            power_at *= once_at
        else:
            power, power_at = once**order, once_at**order
        pieces = power * (steps / PARTS)[:, None]
        coarse = (power_at[1:] + power_at[:-1]) / 2 * steps
        fine = (time, pieces.sum(axis=1)) if search else (fine_time, pieces.ravel())
        for chosen, (at, each) in ((commanded, fine), (~commanded, (time, coarse))):
            sums = np.concatenate(([0.0], np.cumsum(each)))
            whole = sum(np.interp(node, at, sums) for node in nodes) / len(SHARES)
            made[chosen, k] = (whole[last[chosen]] - whole[first[chosen]]) / w.length[part][chosen]
    return made


def missed_share(order: int, speed: np.ndarray, step_s: float) -> np.ndarray:
    """Share of a ripple that a sum over samples misses."""
    x = np.clip(order * np.abs(speed) * step_s / 2, 1e-6, 1.5)
    return 1 - x / np.tan(x)


def set_terms(balance: Balance, orders: List[int], begin: int = 0) -> None:
    """Computes the columns of `orders[begin:]` in the terms of the windows."""
    w = balance.windows
    for n, order in enumerate(orders[begin:], begin):
        average = averages(balance, [order])[:, 0]
        average[~w.commanded & (missed_share(order, w.speed, balance.track.step_s) > MISSED)] = 0
        w.terms[:, FIXED_TERMS + 2 * n], w.terms[:, FIXED_TERMS + 2 * n + 1] = average.real, average.imag


@dataclass
class Residuals:
    """Residuals of some windows, and the averages of all orders for a test of each."""

    averages: np.ndarray  # one column per order
    weight: np.ndarray
    residual: np.ndarray
    speed: np.ndarray
    overlap: float  # overlapping windows that count as one independent window

    def gain(self, order: int, subset: "np.ndarray | slice" = slice(None)) -> float:
        """Decrease of the sum of squares by this order, in variances."""
        average = self.averages[subset, order - 1]
        rows = np.column_stack((average.real, average.imag))
        weighed = rows * self.weight[subset, None]
        right = weighed.T @ self.residual[subset]
        return float(right @ np.linalg.lstsq(weighed.T @ rows, right, rcond=1e-9)[0]) / self.overlap

    def at_several_speeds(self, order: int) -> bool:
        """False if the ripple appears at one speed only: it may be an oscillation in time instead of cogging."""
        speed, few = self.speed, 3 * self.overlap
        label = np.floor(np.log(np.abs(speed) + 1e-9) / math.log(1.2)) + 1000 * (speed > 0)
        best, most = 0.0, 0.0
        for one in np.unique(label):
            subset = label == one
            if np.count_nonzero(subset) >= few and (found := self.gain(order, subset)) > most:
                best, most = float(np.mean(speed[subset])), found
        apart = np.abs(speed) / max(abs(best), 1e-9)
        others = (speed * best < 0) | (apart > OTHER_SPEED) | (apart < 1 / OTHER_SPEED)
        return bool(np.count_nonzero(others) >= few and self.gain(order, others) >= SEEN_GAIN)


def next_order(residuals: Residuals, orders: List[int], one_speed: List[int]) -> int:
    """Order with the largest decrease of the residuals at two or more speeds; 0 if none is significant."""
    gains = np.array([residuals.gain(order + 1) for order in range(HIGHEST_ORDER)])
    for order in [*orders, *one_speed]:
        gains[order - 1] = 0
    while True:
        best = int(np.argmax(gains)) + 1
        if gains[best - 1] < ORDER_GAIN:
            return 0
        if residuals.at_several_speeds(best):
            return best
        one_speed.append(best)
        gains[best - 1] = 0


def find_orders(balance: Balance, regress: Callable[[], Regression], orders: List[int], one_speed: List[int]) -> None:
    """Appends to `orders`, which `regress` uses. Orders found at one speed only go to `one_speed`."""
    # Sample runs of windows evenly over the log.
    w, rows = balance.windows, np.arange(len(balance.windows))
    rows = rows[rows // SEARCH_RUN % (len(rows) // SEARCHED + 1) == 0]
    made = averages(balance.subset(rows), list(range(1, HIGHEST_ORDER + 1)))
    overlap = max(1.0, float(np.median(w.last - w.first)) / max(1.0, float(np.median(np.diff(w.first)))))
    while len(orders) < MOST_ORDERS:
        regression = regress()
        kept = regression.kept[rows]
        chosen = rows[kept]
        order = next_order(
            Residuals(made[kept], regression.weights[chosen], regression.residual()[chosen], w.speed[chosen], overlap), orders, one_speed
        )
        if order == 0:
            return
        orders.append(order)
        set_terms(balance, orders, len(orders) - 1)
