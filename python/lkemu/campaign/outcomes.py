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
    Outcome(NOT_FIRED, "the fault took no effect, or the host also hangs or crashes without it; not evaluated", 0),
    Outcome(NO_EFFECT, "the fault took effect, but replies to hosts did not change", 3),
    Outcome(TOLERATED, "replies changed, but all expectations passed", 4),
    Outcome(DETECTED_BY_DRIVE, "the drive set an error bit in time", 2, in_time=True),
    Outcome(DETECTED_BY_HOST, "the host detected the fault in time", 1, in_time=True),
    Outcome(LATE, "the drive or the host detected the fault too late", 5, failure=True),
    Outcome(SILENTLY_WRONG, "a hazardous expectation failed, and the fault was not detected", 6, failure=True),
    Outcome(HANG, "the host did not end in time", 7, failure=True),
    Outcome(CRASH, "the host crashed", 8, failure=True),
)
OUTCOMES: Dict[str, Outcome] = {one.name: one for one in _TABLE}
