"""Jitter of the time stamps of a log, and better estimates of the true times.

At steady speed the encoder is a clock: the angle between two samples over the reported speed is the true interval. The
difference from the interval of the stamps is their error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .track import Track

FAST_RAD_S = 2.0  # lowest speed used for times (assumed)
STEADY = 0.15  # largest relative change of a steady speed between samples (assumed)
FEWEST = 50
MOST_LAG_S = 10e-3  # largest lag of a reported speed (assumed)


@dataclass
class Timing:
    time: np.ndarray  # times of the samples, estimated from both stamps
    set_points: np.ndarray  # times of the set points
    query_s: float  # standard deviation of query stamps
    reply_s: float
    sample_s: float  # standard deviation of `time`
    speed_lag_s: float  # lag of the reported speed
    angle_ratio: float  # change of angle over integrated speed; 1 if the motor file has the right encoder


def spread(values: np.ndarray) -> float:
    """Standard deviation without outliers."""
    low, high = np.percentile(values, (10, 90))
    kept = values[(values >= low - (high - low)) & (values <= high + (high - low))]
    return float(np.std(kept)) if len(kept) else 0.0


def jitter_s(track: Track, stamps: np.ndarray) -> "float | None":
    """Jitter of these stamps; None if the shaft did not turn steadily."""
    before, after = track.speed[:-1], track.speed[1:]
    mean = (before + after) / 2
    steady = track.is_contiguous & (np.abs(after - before) <= STEADY * np.abs(mean)) & (np.abs(mean) > FAST_RAD_S)
    if np.count_nonzero(steady) < FEWEST:
        return None
    residual = np.diff(track.angle) - mean * np.diff(stamps)
    slow = track.is_contiguous & (np.abs(mean) > 0.3) & (np.abs(mean) < FAST_RAD_S)
    noise = spread(residual[slow]) if np.count_nonzero(slow) >= FEWEST else 0.0
    fast = steady & (np.abs(mean) >= np.median(np.abs(mean[steady])))
    speed = float(np.sqrt(np.mean(mean[fast] ** 2)))
    return float(np.sqrt(max(spread(residual[fast]) ** 2 - noise**2, 0.0) / 2)) / speed


def speed_lag_s(track: Track, stamps: np.ndarray) -> float:
    """Lag of the reported speed: the angle step exceeds the integrated speed by lag times change of speed."""
    change = np.diff(track.speed)
    residual = np.diff(track.angle) - (track.speed[1:] + track.speed[:-1]) / 2 * np.diff(stamps)
    chosen = np.flatnonzero(track.is_contiguous & (np.abs(change) > np.percentile(np.abs(change), 50)))
    lag = 0.0
    for _ in range(5):
        if len(chosen) < FEWEST:
            return 0.0
        lag = float(np.sum(change[chosen] * residual[chosen]) / max(np.sum(change[chosen] ** 2), 1e-12))
        off = np.abs(residual[chosen] - lag * change[chosen])
        chosen = chosen[off <= max(5 * np.median(off), 1e-9)]
    return min(max(lag, 0.0), MOST_LAG_S)


def angle_ratio(track: Track) -> float:
    mean = (track.speed[1:] + track.speed[:-1]) / 2
    fast = track.is_contiguous & (np.abs(mean) > FAST_RAD_S)
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
    # The latencies give the sum of both jitters. The encoder gives their shares.
    share = reply**2 / max(query**2 + reply**2, 1e-18)
    time = share * track.time + (1 - share) * (track.reply - usual)
    time = np.maximum.accumulate(time + np.arange(len(time)) * 1e-9)
    sample = jitter_s(track, time)
    if sample is None:
        sample = float(np.sqrt(share**2 * query**2 + (1 - share) ** 2 * reply**2))
    # A set point acts at the time of its exchange. Without a reply only the query stamp is known.
    place = np.searchsorted(track.time, track.set_points.time)
    place = np.minimum(place, len(time) - 1)
    known = track.time[place] == track.set_points.time
    set_points = np.where(known, time[place], track.set_points.time + float(np.median(time - track.time)))
    lag_s, ratio = speed_lag_s(track, time), angle_ratio(track)
    return Timing(time, np.maximum.accumulate(set_points), float(query), float(reply), sample, lag_s, ratio)
