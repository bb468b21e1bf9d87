"""Runs the cases of a plan that have no result yet."""

from __future__ import annotations

import contextlib
import pathlib
import time
from dataclasses import dataclass
from typing import Callable, Iterable, Iterator, List, Tuple, Union

from .dask_runs import DaskRuns
from .host_runs import HostRuns
from .interruption import Interruption
from .judge import Result
from .outcomes import MACHINE_FAILED
from .plan import Plan
from .program import Program
from .sampling import Case, Cases
from .scenario_runs import ScenarioRuns
from .store import Store

MAX_BATCH = 128  # cases that one thread sorts by time; they share the simulation up to their faults
MIN_BATCH = 8
QUERY_SIZE = 4096  # case numbers per query of the results
MAX_UNWRITTEN = 64  # results per write; a write happens at least every WRITE_INTERVAL_S
WRITE_INTERVAL_S = 0.2


@dataclass(frozen=True)
class Shard:
    """The cases whose number modulo `count` is `index`."""

    index: int = 0
    count: int = 1

    def size(self, numbers: int) -> int:
        """Returns the number of cases in the shard, including excluded ones."""
        return max(0, (numbers - self.index + self.count - 1) // self.count)


def numbers_left(plan: Plan, path: pathlib.Path, shard: Shard) -> Iterator[int]:
    """Yields case numbers without a result, in order, including excluded cases.

    May run in another thread than the writer.
    """
    for first in range(shard.index, plan.numbers, shard.count * QUERY_SIZE):
        numbers = range(first, min(first + shard.count * QUERY_SIZE, plan.numbers), shard.count)
        with contextlib.closing(Store.read(path)) as store:  # not kept open: the writer must close last
            done = store.numbers_between(numbers[0], numbers[-1])
        yield from (number for number in numbers if number not in done)


def cases_of(plan: Plan, numbers: Iterable[int]) -> Iterator[Tuple[int, Case]]:
    """Yields numbers and values, without excluded cases."""
    cases = Cases(plan)
    for number in numbers:
        values = cases.values(number)
        if values is not None:
            yield number, values


def runs_of(plan: Plan, program: Program, jobs: int) -> Union[ScenarioRuns, HostRuns]:
    return HostRuns(plan, program, jobs) if plan.host is not None else ScenarioRuns(plan, program, jobs)


def run_campaign(
    plan: Plan, store: Store, shard: Shard, runs: Union[ScenarioRuns, HostRuns, DaskRuns], progress: Callable[[int], None],
    interruption: Interruption,
) -> None:  # fmt: skip
    """Calls `progress` with the number of cases that have run. Writes finished results even after KeyboardInterrupt."""
    store.note_shard(shard.index, shard.count)
    max_batch = runs.max_batch if isinstance(runs, DaskRuns) else MAX_BATCH
    batch_size = min(max(shard.size(plan.numbers) // (4 * runs.jobs + 1), MIN_BATCH), max_batch)
    numbers = numbers_left(plan, store.path, shard)
    results = runs.run(numbers, batch_size) if isinstance(runs, DaskRuns) else runs.run(cases_of(plan, numbers), batch_size)
    done = 0
    unwritten: List[Result] = []

    def write() -> None:
        nonlocal done, unwritten
        with interruption.shielded():
            finished = [one for one in unwritten if one.outcome != MACHINE_FAILED]
            failed = [(one.number, one.note) for one in unwritten if one.outcome == MACHINE_FAILED]
            if finished:
                store.put(finished)
            if failed:
                store.note_failures(failed)
            done, unwritten = done + len(finished), []
            progress(done)

    written_at = time.monotonic()
    with contextlib.closing(results):
        try:
            for new in results:
                unwritten += new
                if len(unwritten) >= MAX_UNWRITTEN or time.monotonic() - written_at >= WRITE_INTERVAL_S:
                    write()
                    written_at = time.monotonic()
        finally:
            write()
