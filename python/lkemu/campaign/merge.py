"""Merges the results of shards."""

from __future__ import annotations

import contextlib
import heapq
import itertools
import operator
import os
import pathlib
import resource
import tempfile
from dataclasses import dataclass
from typing import Iterator, List, Sequence, Tuple

from .store import Row, Store, StoreError, same_result

BATCH = 1000
MAX_NAMED = 10  # missing shards listed in the message


@dataclass
class Merged:
    cases: int
    all_cases: int
    named: List[Tuple[int, int]]  # first missing shards
    missing: int  # number of missing shards

    @property
    def is_whole(self) -> bool:
        return self.cases >= self.all_cases and not self.missing

    def __str__(self) -> str:
        text = f"{self.cases} of {self.all_cases} cases"
        if self.missing:
            named = ", ".join(f"{index}/{count}" for index, count in self.named)
            more = self.missing - len(self.named)
            return f"{text}; missing: shard {named}" + (f" and {more} more" if more > 0 else "")
        missing_cases = self.all_cases - self.cases
        return text + (f"; missing: {missing_cases} cases of interrupted shards" if missing_cases > 0 else "")


def merge(out: pathlib.Path, paths: Sequence[pathlib.Path]) -> Merged:
    """Creates `out` from the results in `paths`. Raises StoreError if `out` exists or the campaigns differ."""
    if out.exists():
        raise StoreError(f"{out}: already exists")
    # All parts are open at the same time.
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    with contextlib.ExitStack() as stack:
        parts = [stack.enter_context(contextlib.closing(Store.read(path))) for path in paths]
        head = parts[0].head
        for part in parts:
            if part.head.identity != head.identity:
                raise StoreError(f"{part.path}: plan, version or files differ from those of {parts[0].path}")
        shards = sorted({shard for part in parts for shard in part.shards()})
        with tempfile.TemporaryDirectory(dir=out.parent, prefix=".merge-") as folder:
            merged = Store.create(pathlib.Path(folder) / out.name, head)
            cases = _copy(parts, merged)
            for index, count in shards:
                merged.note_shard(index, count)
            for part in parts:
                merged.note_failures(one for one in part.failed_cases() if not merged.numbers_between(one[0], one[0]))
            merged.close()
            try:
                os.link(merged.path, out)
            except FileExistsError:
                raise StoreError(f"{out}: already exists") from None
    return Merged(cases, head.cases, *_missing(shards))


def _copy(parts: Sequence[Store], merged: Store) -> int:
    cases = 0
    rows = _unique_rows(parts)
    while batch := list(itertools.islice(rows, BATCH)):
        merged.put_rows(batch)
        cases += len(batch)
    return cases


def _unique_rows(parts: Sequence[Store]) -> Iterator[Row]:
    """Yields each case once, in order of numbers. Raises StoreError if parts have different results of a case."""
    last: Row = (-1,)
    for row in heapq.merge(*(part.rows() for part in parts), key=operator.itemgetter(0)):
        if row[0] != last[0]:
            yield row
        elif not same_result(row, last):
            names = [str(part.path) for part in parts if part.numbers_between(row[0], row[0])]
            raise StoreError(f"{' and '.join(names)}: have different results of case {row[0]}")
        last = row


def _missing(shards: Sequence[Tuple[int, int]]) -> Tuple[List[Tuple[int, int]], int]:
    """Returns the first missing shards, and how many are missing. Finds none if the shards have different counts."""
    counts = {count for _, count in shards}
    if len(counts) != 1:
        return [], 0
    count = counts.pop()
    there = {index for index, _ in shards}
    absent = ((index, count) for index in range(count) if index not in there)
    return list(itertools.islice(absent, MAX_NAMED)), count - len(there)
