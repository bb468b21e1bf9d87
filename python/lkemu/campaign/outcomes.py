"""What can come of a case, in one table."""

from __future__ import annotations

from typing import Dict, NamedTuple


class Outcome(NamedTuple):
    name: str
    meaning: str
    rank: int  # for comparisons: higher is worse; a case that did not fire has none
    in_time: bool = False  # the fault was noticed in time
    failure: bool = False  # listed case by case

    @property
    def key(self) -> str:
        """As in JSON and --require: detected_by_drive."""
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
MACHINE_FAILED = "machine failed"  # no outcome: the case says nothing and has no result

# In this order in tables. The rank says what is worse: to lose a detection is.
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
