"""Puts the results of shards together."""

from __future__ import annotations

import contextlib
import heapq
import os
import pathlib
import resource
import tempfile
from dataclasses import dataclass
from typing import Iterator, List, Optional, Sequence, Tuple

from .export import line_of
from .judge import Result
from .store import Store, StoreError

BATCH = 1000
MAX_NAMED = 10  # shards that are missing and named


@dataclass
class Merged:
    cases: int
    all_cases: int
    missing: List[Tuple[int, int]]  # shards

    @property
    def is_whole(self) -> bool:
        return self.cases >= self.all_cases and not self.missing

    def __str__(self) -> str:
        text = f"{self.cases} of {self.all_cases} cases"
        if self.missing:
            named = ", ".join(f"{index}/{count}" for index, count in self.missing[:MAX_NAMED])
            more = len(self.missing) - MAX_NAMED
            return f"{text}; missing: shard {named}" + (f" and {more} more" if more > 0 else "")
        lacking = self.all_cases - self.cases
        return text + (f"; missing: {lacking} of shards that were interrupted" if lacking > 0 else "")


def merge(out: pathlib.Path, paths: Sequence[pathlib.Path]) -> Merged:
    """A new file with the results of all `paths`. Raises StoreError: they do not belong together, or `out` exists."""
    if out.exists():
        raise StoreError(f"{out}: exists already")
    # Each part is a file that is open.
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    with contextlib.ExitStack() as stack:
        parts = [stack.enter_context(contextlib.closing(Store.read(path))) for path in paths]
        head = parts[0].head
        for part in parts:
            if part.head.identity != head.identity:
                raise StoreError(f"{part.path}: not of the same plan, version and files as {parts[0].path}")
        shards = sorted({shard for part in parts for shard in part.shards()})
        with tempfile.TemporaryDirectory(dir=out.parent, prefix=".merge-") as folder:
            whole = Store.create(pathlib.Path(folder) / out.name, head)
            cases = _copy(parts, whole)
            for index, count in shards:
                whole.note_shard(index, count)
            whole.close()
            try:
                os.link(whole.path, out)
            except FileExistsError:
                raise StoreError(f"{out}: exists already") from None
    return Merged(cases, head.cases, _missing(shards))


def _copy(parts: Sequence[Store], whole: Store) -> int:
    cases = 0
    batch: List[Result] = []
    for result in _once(parts):
        batch.append(result)
        cases += 1
        if len(batch) == BATCH:
            whole.put(batch)
            batch = []
    whole.put(batch)
    return cases


def _once(parts: Sequence[Store]) -> Iterator[Result]:
    """By number. Several parts may have a case, and then must have the same result."""
    last: Optional[Tuple[Result, Store]] = None
    streams = [((result, part) for result in part) for part in parts]
    for result, part in heapq.merge(*streams, key=lambda one: one[0].number):
        if last is None or last[0].number != result.number:
            last = result, part
            yield result
        elif line_of(last[0]) != line_of(result):
            raise StoreError(f"{part.path}: has another result of case {result.number} than {last[1].path}")


def _missing(shards: Sequence[Tuple[int, int]]) -> List[Tuple[int, int]]:
    """Shards that are not there, if all are of one division."""
    counts = {count for _, count in shards}
    if len(counts) != 1:
        return []
    count = counts.pop()
    there = {index for index, _ in shards}
    return [(index, count) for index in range(count) if index not in there]
