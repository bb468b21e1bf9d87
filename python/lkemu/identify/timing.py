"""How far the stamps of a log are from when things happened, and when they did.

At speed the encoder is a clock: from one sample to the next the shaft turns by what its reported speeds say, over the true
time, so that what is left over the speed is by how much the stamps are off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .track import Track

FAST_RAD_S = 2.0  # slower ones tell nothing of times (assumed)
STEADY = 0.15  # change of the speed from one sample to the next (assumed)
FEWEST = 50
MOST_LAG_S = 10e-3  # of a reported speed (assumed)


@dataclass
class Timing:
    time: np.ndarray  # of the samples: the best that both stamps say
    orders: np.ndarray  # of the orders
    query_s: float  # standard deviation of the stamps of queries, of replies, and of `time`
    reply_s: float
    sample_s: float
    speed_lag_s: float  # of the reported speed behind the angle
    angle_ratio: float  # how far the shaft turns, over what the reported speeds say; 1 if the encoder is as the motor file has it


def spread(values: np.ndarray) -> float:
    """The standard deviation, whatever a few of them are."""
    low, high = np.percentile(values, (10, 90))
    kept = values[(values >= low - (high - low)) & (values <= high + (high - low))]
    return float(np.std(kept)) if len(kept) else 0.0


def jitter_s(track: Track, stamps: np.ndarray) -> "float | None":
    """Of stamps of the samples; None where the shaft did not turn steadily."""
    before, after = track.speed[:-1], track.speed[1:]
    mean = (before + after) / 2
    steady = track.together & (np.abs(after - before) <= STEADY * np.abs(mean)) & (np.abs(mean) > FAST_RAD_S)
    if np.count_nonzero(steady) < FEWEST:
        return None
    left = np.diff(track.angle) - mean * np.diff(stamps)
    slow = track.together & (np.abs(mean) > 0.3) & (np.abs(mean) < FAST_RAD_S)
    noise = spread(left[slow]) if np.count_nonzero(slow) >= FEWEST else 0.0
    fast = steady & (np.abs(mean) >= np.median(np.abs(mean[steady])))
    speed = float(np.sqrt(np.mean(mean[fast] ** 2)))
    return float(np.sqrt(max(spread(left[fast]) ** 2 - noise**2, 0.0) / 2)) / speed


def speed_lag_s(track: Track, stamps: np.ndarray) -> float:
    """From one sample to the next the shaft turns further than its reported speeds say by the lag times their change."""
    change = np.diff(track.speed)
    left = np.diff(track.angle) - (track.speed[1:] + track.speed[:-1]) / 2 * np.diff(stamps)
    chosen = np.flatnonzero(track.together & (np.abs(change) > np.percentile(np.abs(change), 50)))
    lag = 0.0
    for _ in range(5):
        if len(chosen) < FEWEST:
            return 0.0
        lag = float(np.sum(change[chosen] * left[chosen]) / max(np.sum(change[chosen] ** 2), 1e-12))
        off = np.abs(left[chosen] - lag * change[chosen])
        chosen = chosen[off <= max(5 * np.median(off), 1e-9)]
    return min(max(lag, 0.0), MOST_LAG_S)


def angle_ratio(track: Track) -> float:
    mean = (track.speed[1:] + track.speed[:-1]) / 2
    fast = track.together & (np.abs(mean) > FAST_RAD_S)
    if np.count_nonzero(fast) < FEWEST:
        return 1.0
    return float(np.median(np.diff(track.angle)[fast] / (mean * np.diff(track.time))[fast]))


def timing(track: Track) -> Timing:
    latency = track.reply - track.time
    usual = float(np.median(latency))
    both = spread(latency)
    query, reply = jitter_s(track, track.time), jitter_s(track, track.reply)
    if query is None or reply is None:
        query = reply = both / np.sqrt(2)
    # What latencies tell is the sum of both; the encoder tells how it is shared.
    share = reply**2 / max(query**2 + reply**2, 1e-18)
    time = share * track.time + (1 - share) * (track.reply - usual)
    time = np.maximum.accumulate(time + np.arange(len(time)) * 1e-9)
    sample = jitter_s(track, time)
    if sample is None:
        sample = float(np.sqrt(share**2 * query**2 + (1 - share) ** 2 * reply**2))
    # An order acts when its exchange was; of one that has no reply only the query is known.
    place = np.searchsorted(track.time, track.orders.time)
    place = np.minimum(place, len(time) - 1)
    known = track.time[place] == track.orders.time
    orders = np.where(known, time[place], track.orders.time + float(np.median(time - track.time)))
    return Timing(time, np.maximum.accumulate(orders), float(query), float(reply), sample, speed_lag_s(track, time), angle_ratio(track))
