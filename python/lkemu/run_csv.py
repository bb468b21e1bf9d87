"""Reads the CSV files of `lk-emu run --csv` and `lk-emu replay --csv`."""

from __future__ import annotations

import math
import os
from typing import BinaryIO, Iterator, List, NamedTuple, NoReturn, Tuple

from .command import printable
from .errors import StartError

LONGEST_LINE = 1 << 20  # bytes; enough for a header of many buses with 32 drives and all signals each
LARGEST = 1e100  # larger values are clamped
FOREIGN = "is not a CSV file of lk-emu run or lk-emu replay: the first line does not begin with time_s"


class Column(NamedTuple):
    """Column name, e.g. "vcan0.1.speed_dps". `bus` is empty in a run with one bus; `id` is 0 for body signals."""

    bus: str
    id: int
    signal: str


class RunCsv:
    """Reader of one file; the constructor reads `columns`. All methods raise StartError with file and line."""

    def __init__(self, path: str, command: str) -> None:
        self._name = f"{command}: {path}"
        self._number = 0
        self._file = self._open(path, command)
        header = self._next_line()
        if header is None:
            raise StartError(f"{self._name} is empty")
        names = header.split(b",")
        if names[0] != b"time_s":
            self._fail(FOREIGN)
        self.columns: List[Column] = []
        for name in names[1:]:
            self.columns.append(self._column(printable(name.decode(errors="replace")).replace("\ufffd", "?")))
        if len(set(self.columns)) < len(self.columns):
            twice = next(n for n, column in enumerate(self.columns) if column in self.columns[:n])
            self._fail(f"column {twice + 2} has the name of an earlier column")

    def rows(self) -> Iterator[List[float]]:
        """Yields time and values of each row in the order of the columns; missing values are NaN."""
        last_s = -math.inf
        while (line := self._next_line()) is not None:
            fields = line.split(b",")
            if len(fields) != len(self.columns) + 1:
                self._fail(f"{len(fields)} values, but the first line names {len(self.columns) + 1} columns")
            try:
                row = [float(field) if field else math.nan for field in fields]
            except ValueError:
                self._fail(f"column {1 + next(n for n, field in enumerate(fields) if not is_number(field))} is not a number")
            if not math.isfinite(row[0]):
                self._fail("has no time")
            if row[0] < last_s:
                self._fail("is earlier than the line before it")
            last_s = row[0]
            yield row

    @staticmethod
    def _open(path: str, command: str) -> BinaryIO:
        try:
            if os.path.exists(path) and not os.path.isfile(path):
                what = "a directory" if os.path.isdir(path) else "not a regular file"  # opening a pipe would block
                raise StartError(f"{command}: {path}: is {what}")
            return open(path, "rb")
        except OSError as problem:
            raise StartError(f"{command}: cannot read {path}: {problem.strerror}") from None

    def _next_line(self) -> "bytes | None":
        self._number += 1
        try:
            line = self._file.readline(LONGEST_LINE + 1)
        except OSError as problem:
            self._fail(f"cannot be read: {problem.strerror}")
        if len(line) > LONGEST_LINE:
            self._fail(FOREIGN if self._number == 1 else "is longer than any line of lk-emu")
        return line.rstrip(b"\r\n") if line else None

    def _column(self, name: str) -> Column:
        place, _, signal = name.rpartition(".")
        bus, _, id = place.rpartition(".")
        if id.isascii() and id.isdigit() and 1 <= int(id[:9]) <= 32 and len(bus) <= 64:
            return Column(bus, int(id), signal)
        if not name.startswith("body."):
            self._fail(f"column {len(self.columns) + 2} is not called like 1.speed_dps or vcan0.1.speed_dps")
        return Column("", 0, name)

    def _fail(self, why: str) -> NoReturn:
        raise StartError(f"{self._name}:{self._number}: {why}")


def is_number(field: bytes) -> bool:
    try:
        float(field or b"nan")
    except ValueError:
        return False
    return True


def drives_of(columns: List[Column]) -> List[Tuple[str, int]]:
    """Returns bus and ID of each drive, in the order of the columns."""
    return list(dict.fromkeys((column.bus, column.id) for column in columns if column.id > 0))
