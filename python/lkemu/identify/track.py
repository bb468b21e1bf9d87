"""What a log tells of one drive over time: what it was asked for, and what it said of its shaft."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Dict, List, Optional

import numpy as np

from .motor import Motor

GAP_STEPS = 5  # a gap is longer than so many usual steps (assumed)
BETWEEN_LOGS_S = 3600.0
NOTHING, TORQUE, SPEED, POSITION = range(4)  # what a drive follows


@dataclass
class Orders:
    """What the drive follows from an instant on. Values in A, rad/s or rad of the multi-turn angle."""

    time: np.ndarray
    what: np.ndarray
    value: np.ndarray
    limit: np.ndarray  # rad/s on the way to a position; 0: none said
    absolute: np.ndarray  # else an increment, or a place on the circle

    def at(self, times: np.ndarray) -> np.ndarray:
        """The place of the order in force; -1: none yet."""
        return np.searchsorted(self.time, times, side="right") - 1


@dataclass
class Track:
    interface: str
    id: int
    motor: Motor
    generation: str
    generation_given: bool
    fits: List[str]  # generations that the log shows, where none was given
    span_turns: float  # of the encoder field
    time: np.ndarray  # of the samples: when the query was stamped
    reply: np.ndarray  # when their replies were
    iq: np.ndarray  # A
    speed: np.ndarray  # rad/s, as reported
    angle: np.ndarray  # rad of the rotor, over all turns
    orders: Orders
    gains: Optional[Dict[str, int]]
    supply_V: float  # the mean of what it reported; 0: nothing
    queries: int
    unanswered: int
    ambiguous: int  # replies that several queries could have
    backwards: int  # stamps before the one above them
    first: np.ndarray = field(default_factory=lambda: np.zeros(0, int))  # sample of each stretch without a gap

    def __post_init__(self) -> None:
        steps = np.diff(self.time)
        self.step_s = float(np.median(steps)) if len(steps) else 0.0
        self.first = np.concatenate(([0], np.flatnonzero(steps > GAP_STEPS * self.step_s) + 1))

    def stretch(self, samples: np.ndarray) -> np.ndarray:
        """The number of the stretch that each of these samples is of."""
        return np.searchsorted(self.first, samples, side="right")

    @property
    def together(self) -> np.ndarray:
        """Whether each sample but the first one is of the same stretch as the one before."""
        made = np.ones(len(self.time) - 1, bool)
        made[self.first[1:] - 1] = False
        return made

    def options(self) -> str:
        if self.generation_given:
            return f"--generation {self.generation}, as was said"
        if self.fits == [self.generation]:
            return f"--generation {self.generation}, as the log shows"
        if self.fits:
            return f"--generation {self.generation}, a guess: {' or '.join(self.fits)} fits"
        return f"--generation {self.generation}, a guess: nothing in the log fits quite"


def joined(track: Track, more: Track) -> Track:
    """What another log says of the same drive, after a gap in which nobody knows what it followed."""
    last = max(track.time[-1], track.orders.time[-1] if len(track.orders.time) else 0.0)
    shift = last + BETWEEN_LOGS_S
    gap = Orders(*(np.array([one]) for one in (last, NOTHING, 0.0, 0.0, 1.0)))
    moved = Orders(more.orders.time + shift, *(getattr(more.orders, key) for key in ("what", "value", "limit", "absolute")))

    def both(key: str, by: float = 0.0) -> np.ndarray:
        return np.concatenate((getattr(track, key), getattr(more, key) + by))

    orders = Orders(*(
        np.concatenate([getattr(one, key) for one in (track.orders, gap, moved)])
        for key in ("time", "what", "value", "limit", "absolute")
    ))  # fmt: skip
    return Track(
        interface=track.interface, id=track.id, motor=track.motor, generation=track.generation,
        generation_given=track.generation_given, fits=[one for one in track.fits if one in more.fits], span_turns=track.span_turns,
        time=both("time", shift),
        reply=both("reply", shift), iq=both("iq"), speed=both("speed"), angle=both("angle"),
        orders=orders, gains=more.gains or track.gains, supply_V=track.supply_V or more.supply_V,
        queries=track.queries + more.queries, unanswered=track.unanswered + more.unanswered,
        ambiguous=track.ambiguous + more.ambiguous, backwards=track.backwards + more.backwards,
    )  # fmt: skip
