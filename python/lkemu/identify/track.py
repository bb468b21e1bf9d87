"""Set points and samples of one drive over time."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Dict, List, Optional

import numpy as np

from .motor import Motor

GAP_STEPS = 5  # least length of a gap in median sample intervals (assumed)
BETWEEN_LOGS_S = 3600.0
NOTHING, TORQUE, SPEED, POSITION = range(4)  # kinds of set points


@dataclass
class SetPoints:
    """Set points with the times from which they apply. Values in A, rad/s or rad of the multi-turn angle."""

    time: np.ndarray
    what: np.ndarray
    value: np.ndarray
    limit: np.ndarray  # speed limit of a move, rad/s; 0: no limit in the command
    absolute: np.ndarray  # else an increment, or an angle within one turn

    def at(self, times: np.ndarray) -> np.ndarray:
        """Index of the active set point at these times; -1 before the first."""
        return np.searchsorted(self.time, times, side="right") - 1


@dataclass
class Track:
    interface: str
    id: int
    motor: Motor
    generation: str
    generation_given: bool
    fits: List[str]  # Generations that fit the log.
    span_turns: float  # Rotor turns per span of the encoder field.
    span_counts: int
    time: np.ndarray  # Query stamps of the samples, s.
    reply: np.ndarray  # Reply stamps, s.
    iq: np.ndarray  # A.
    speed: np.ndarray  # As reported, rad/s.
    angle: np.ndarray  # Multi-turn angle of the rotor, rad.
    set_points: SetPoints
    gains: Optional[Dict[str, int]]
    supply_V: float  # mean of the reported voltages; 0: none reported
    queries: int
    unanswered: int
    ambiguous: int  # replies that may belong to several queries
    backwards: int  # stamps that went back
    first: np.ndarray = field(default_factory=lambda: np.zeros(0, int))  # first sample of each stretch without a gap

    def __post_init__(self) -> None:
        steps = np.diff(self.time)
        self.step_s = float(np.median(steps)) if len(steps) else 0.0
        self.first = np.concatenate(([0], np.flatnonzero(steps > GAP_STEPS * self.step_s) + 1))

    def stretch(self, samples: np.ndarray) -> np.ndarray:
        """Stretch number of each of these samples."""
        return np.searchsorted(self.first, samples, side="right")

    @property
    def is_contiguous(self) -> np.ndarray:
        """For each sample but the first: whether it is in the stretch of the previous sample."""
        made = np.ones(len(self.time) - 1, bool)
        made[self.first[1:] - 1] = False
        return made

    def options(self) -> str:
        if self.generation_given:
            return f"--generation {self.generation}, as given"
        if self.fits == [self.generation]:
            return f"--generation {self.generation}, found from the log"
        if self.fits:
            return f"--generation {self.generation}, a guess: {' or '.join(self.fits)} fits the log"
        return f"--generation {self.generation}, a guess: no generation fits the whole log"


def joined(track: Track, more: Track) -> Track:
    """Appends another log of the same drive, after a gap of BETWEEN_LOGS_S without a set point."""
    last = max(track.time[-1], track.set_points.time[-1] if len(track.set_points.time) else 0.0)
    shift = last + BETWEEN_LOGS_S
    gap = SetPoints(*(np.array([one]) for one in (last, NOTHING, 0.0, 0.0, 1.0)))
    rest = (getattr(more.set_points, key) for key in ("what", "value", "limit", "absolute"))
    moved = SetPoints(more.set_points.time + shift, *rest)

    def both(key: str, by: float = 0.0) -> np.ndarray:
        return np.concatenate((getattr(track, key), getattr(more, key) + by))

    set_points = SetPoints(*(
        np.concatenate([getattr(one, key) for one in (track.set_points, gap, moved)])
        for key in ("time", "what", "value", "limit", "absolute")
    ))  # fmt: skip
    return Track(
        interface=track.interface, id=track.id, motor=track.motor, generation=track.generation,
        generation_given=track.generation_given, fits=[one for one in track.fits if one in more.fits], span_turns=track.span_turns,
        span_counts=track.span_counts,
        time=both("time", shift),
        reply=both("reply", shift), iq=both("iq"), speed=both("speed"), angle=both("angle"),
        set_points=set_points, gains=more.gains or track.gains, supply_V=track.supply_V or more.supply_V,
        queries=track.queries + more.queries, unanswered=track.unanswered + more.unanswered,
        ambiguous=track.ambiguous + more.ambiguous, backwards=track.backwards + more.backwards,
    )  # fmt: skip
