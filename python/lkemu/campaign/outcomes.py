"""The table of outcomes of a case."""

from __future__ import annotations

from typing import Dict, NamedTuple


class Outcome(NamedTuple):
    name: str
    meaning: str
    rank: int  # for comparisons: higher is worse; unused for NOT_FIRED
    in_time: bool = False  # the fault was detected in time
    failure: bool = False  # reports list these cases one by one

    @property
    def key(self) -> str:
        """Name in JSON and --require, e.g. detected_by_drive."""
        return self.name.replace(" the ", " ").replace(" ", "_")


NOT_FIRED = "not fired"
NO_EFFECT = "no effect"
TOLERATED = "tolerated"
DETECTED_BY_DRIVE = "detected by the drive"
DETECTED_BY_HOST = "detected by the host"
LATE = "late"
SILENTLY_WRONG = "silently wrong"
HANG = "hang"
CRASH = "crash"
MACHINE_FAILED = "machine failed"  # not an outcome: the case has no result

# In the order of tables. By rank, every detection in time is better than none.
_TABLE = (
    Outcome(NOT_FIRED, "the fault never took effect, or the host hangs or dies without it too; the case says nothing", 0),
    Outcome(NO_EFFECT, "it did, and hosts got what they get without it", 3),
    Outcome(TOLERATED, "they got something else, and all that is expected held", 4),
    Outcome(DETECTED_BY_DRIVE, "an error bit was set in time", 2, in_time=True),
    Outcome(DETECTED_BY_HOST, "the host noticed in time", 1, in_time=True),
    Outcome(LATE, "the one or the other, but too late", 5, failure=True),
    Outcome(SILENTLY_WRONG, "something expected failed, and it was not noticed", 6, failure=True),
    Outcome(HANG, "the host did not come to its end", 7, failure=True),
    Outcome(CRASH, "the host died", 8, failure=True),
)
OUTCOMES: Dict[str, Outcome] = {one.name: one for one in _TABLE}
