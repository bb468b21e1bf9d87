"""Runs the cases of a plan that its results do not have yet."""

from __future__ import annotations

import contextlib
import pathlib
import time
from dataclasses import dataclass
from typing import Callable, Iterator, List, Tuple, Union

from .host_runs import HostRuns
from .judge import Result
from .outcomes import MACHINE_FAILED
from .plan import Plan
from .program import Program
from .sampling import Case, Cases
from .scenario_runs import ScenarioRuns
from .store import Store

MAX_PILE = 128  # cases that one thread sorts by time and shares beginnings of
MIN_PILE = 8
LOOKED_UP = 1024  # numbers that are looked up in the results at once
BATCH = 64  # results that are written together, at most BATCH_S after they came
BATCH_S = 0.2


@dataclass(frozen=True)
class Shard:
    """The cases whose number divided by `count` leaves `index`."""

    index: int = 0
    count: int = 1

    def size(self, numbers: int) -> int:
        """So many numbers it has, with those of excluded cases."""
        return max(0, (numbers - self.index + self.count - 1) // self.count)


def cases_left(plan: Plan, path: pathlib.Path, shard: Shard) -> Iterator[Tuple[int, Case]]:
    """Number and values of the cases that have no result, in order. Opens the results in the thread that asks."""
    cases = Cases(plan)
    with contextlib.closing(Store.read(path)) as store:
        for first in range(shard.index, cases.numbers, shard.count * LOOKED_UP):
            numbers = range(first, min(first + shard.count * LOOKED_UP, cases.numbers), shard.count)
            done = store.numbers_between(numbers[0], numbers[-1])
            for number in numbers:
                values = None if number in done else cases.values(number)
                if values is not None:
                    yield number, values


def runs_of(plan: Plan, program: Program, jobs: int) -> Union[ScenarioRuns, HostRuns]:
    return HostRuns(plan, program, jobs) if plan.host is not None else ScenarioRuns(plan, program, jobs)


def run_campaign(
    plan: Plan, program: Program, store: Store, shard: Shard, jobs: int, progress: Callable[[int], None]
) -> int:
    """Returns how many cases were run. KeyboardInterrupt ends it; what is finished has been written."""
    store.note_shard(shard.index, shard.count)
    pile = min(max(shard.size(plan.numbers) // (4 * jobs + 1), MIN_PILE), MAX_PILE)
    results = runs_of(plan, program, jobs).run(cases_left(plan, store.path, shard), pile)
    done, batch, written_at = 0, [], time.monotonic()
    try:
        for some in results:
            batch += some
            if len(batch) >= BATCH or time.monotonic() - written_at >= BATCH_S:
                done += _write(store, batch)
                batch, written_at = [], time.monotonic()
                progress(done)
    finally:
        done += _write(store, batch)
    progress(done)
    return done


def _write(store: Store, batch: List[Result]) -> int:
    results = [one for one in batch if one.outcome != MACHINE_FAILED]
    if results:
        store.put(results)
    store.note_failures((one.number, one.note) for one in batch if one.outcome == MACHINE_FAILED)
    return len(results)
