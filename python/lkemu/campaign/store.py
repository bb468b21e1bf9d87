"""Stores the results of a campaign in one SQLite file with a row for each case."""

from __future__ import annotations

import contextlib
import json
import math
import os
import pathlib
import sqlite3
import sys
import time
import tomllib
from collections import Counter
from dataclasses import dataclass, fields
from typing import Any, Dict, Iterable, Iterator, List, Optional, Sequence, Set, Tuple

from ..errors import Error
from .judge import Result
from .outcomes import OUTCOMES
from .plan import MAX_CASES, Plan
from .writer_lock import WriterLock

APPLICATION_ID = 0x4C4B4643  # "LKFC", which file(1) shows
FORMAT = 5
SYNC_S = 1.0  # a power failure loses at most this; committed cases survive SIGKILL
MAX_TEXT = 1_000_000  # bytes of one field
HEAD = (
    "version TEXT NOT NULL, plan_name TEXT NOT NULL, about TEXT NOT NULL, plan_text TEXT NOT NULL, "
    "input_hash TEXT NOT NULL, sampling TEXT NOT NULL, seed INTEGER NOT NULL, numbers INTEGER NOT NULL, "
    "cases INTEGER NOT NULL, plan_called TEXT NOT NULL, tolerant_time_ns INTEGER, dimensions TEXT NOT NULL"
)
FAILURES = "number INTEGER PRIMARY KEY, reason TEXT NOT NULL"  # cases without a result: the machine failed
SHARDS = "shard INTEGER NOT NULL, shards INTEGER NOT NULL, PRIMARY KEY (shards, shard)"


class StoreError(Exception):
    """A results file cannot be used. The message is one line."""


@dataclass(frozen=True)
class Column:
    name: str  # in Result and in the file
    sql: str
    kind: type


# All fields of Result except `number` and `values`, in order.
TYPES = {"str": ("TEXT NOT NULL", str), "int": ("INTEGER NOT NULL", int), "bool": ("INTEGER NOT NULL", bool),
         "float": ("REAL NOT NULL", float), "Optional[int]": ("INTEGER", int), "Optional[float]": ("REAL", float)}  # fmt: skip
COLUMNS = [Column(one.name, *TYPES[str(one.type)]) for one in fields(Result)[2:]]
NOT_EXPORTED = ("said", "wall_s")
BOOLS = [one.name for one in COLUMNS if one.kind is bool]
Row = Tuple[Any, ...]


def _check_of(column: Column) -> str:
    """Returns an SQL expression that is 1 for values that a campaign can write."""
    if column.name == "outcome":
        return f"outcome IN ({', '.join(repr(name) for name in OUTCOMES)})"
    kind = {str: "text", float: "real"}.get(column.kind, "integer")
    check = f"typeof({column.name}) = '{kind}'"
    check += {"text": f" AND length({column.name}) <= {MAX_TEXT}", "real": f" AND abs({column.name}) <= {sys.float_info.max!r}"}.get(kind, "")
    if column.kind is bool:
        check += f" AND {column.name} IN (0, 1)"
    return f"({check})" if "NOT NULL" in column.sql else f"({column.name} IS NULL OR ({check}))"


@dataclass(frozen=True)
class Head:
    """Identifies the campaign of a results file. All shards of a campaign agree in it, except for `plan_called`."""

    version: str
    plan_name: str
    about: str
    plan_text: str
    input_hash: str
    sampling: str
    seed: int
    numbers: int  # cases are numbered 0 to numbers - 1
    cases: int  # without excluded cases; `numbers` if not counted
    plan_called: str
    tolerant_time_ns: Optional[int]
    dimensions: Tuple[Dict[str, Any], ...]  # name, words or from and to, harmless_is_most

    @property
    def identity(self) -> Tuple[Any, ...]:
        return tuple(getattr(self, one.name) for one in fields(self) if one.name != "plan_called")


def head_of(plan: Plan, version: str, input_hash: str) -> Head:
    dimensions: List[Dict[str, Any]] = []
    for dimension in plan.dimensions:
        values = dimension.values
        one: Dict[str, Any] = {"name": dimension.name, "harmless_is_most": dimension.harmless_is_most}
        if values.has_words:
            one["words"] = list(values.values)  # type: ignore[union-attr]
        else:
            one.update({"from": values.least, "to": values.most})
        dimensions.append(one)
    return Head(version, plan.name, plan.about, plan.text, input_hash, plan.sampling, plan.seed, plan.numbers,
                plan.included, plan.called, plan.tolerant_time_ns, tuple(dimensions))  # fmt: skip


def _check_head(head: Head) -> None:
    """Raises ValueError or TypeError if head_of() cannot have made the head."""
    if not 0 <= head.cases <= head.numbers <= MAX_CASES:
        raise ValueError("number of cases")
    for one in head.dimensions:
        texts, ends = [one["name"], *one.get("words", ())], [] if "words" in one else [one["from"], one["to"]]
        if not all(isinstance(text, str) for text in texts) or not all(math.isfinite(end) for end in ends):
            raise ValueError("dimensions")
    rates = tomllib.loads(head.plan_text).get("rates", {})
    if not all(math.isfinite(rate) and rate >= 0 for rate in rates.values()):
        raise ValueError("rates")


def quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'


def schema(head: Head) -> Dict[str, str]:
    dimensions = [
        f"{quoted(one['name'])} {'TEXT' if 'words' in one else 'REAL'}" for one in head.dimensions
    ]
    columns = ["number INTEGER PRIMARY KEY", *dimensions, *(f"{one.name} {one.sql}" for one in COLUMNS)]
    return {
        "campaign": f"CREATE TABLE campaign ({HEAD}) STRICT",
        "shards": f"CREATE TABLE shards ({SHARDS}) STRICT, WITHOUT ROWID",
        "failures": f"CREATE TABLE failures ({FAILURES}) STRICT",
        "cases": f"CREATE TABLE cases ({', '.join(columns)}) STRICT",
    }


def same_result(row: Row, other: Row) -> bool:
    """True if two rows are equal in all exported columns."""
    ignored = [n - len(COLUMNS) for n, one in enumerate(COLUMNS) if one.name in NOT_EXPORTED]
    return all(a == b for n, (a, b) in enumerate(zip(row, other), -len(row)) if n not in ignored)


class Store:
    """An open results file. Rows are checked when they are read, because the file may be untrusted."""

    def __init__(self, path: pathlib.Path, connection: sqlite3.Connection, head: Head) -> None:
        self.path, self.head, self._connection = path, head, connection
        self._synced_at = time.monotonic()
        self._lock: Optional[WriterLock] = None

    # Constructors

    @classmethod
    def create(cls, path: pathlib.Path, head: Head) -> "Store":
        """Creates a file. Raises StoreError if it exists."""
        names = [one["name"].lower() for one in head.dimensions] + ["number"] + [one.name for one in COLUMNS]
        if len(set(names)) < len(names):
            raise StoreError(f"{path}: two columns would have the same name")
        try:
            os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        except FileExistsError:
            raise StoreError(f"{path}: already exists; continue it with --resume, or start another with -o FILE") from None
        except OSError as problem:
            raise StoreError(f"{path}: {problem.strerror}") from None
        lock = WriterLock(path)
        connection = cls._connect(path, "rw")
        with connection:
            connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
            connection.execute(f"PRAGMA user_version = {FORMAT}")
            for sql in schema(head).values():
                connection.execute(sql)
            values = [json.dumps(value) if one.name == "dimensions" else value
                      for one in fields(head) for value in [getattr(head, one.name)]]  # fmt: skip
            connection.execute(f"INSERT INTO campaign VALUES ({', '.join('?' * len(values))})", values)
        return cls._writing(path, connection, head, lock)

    @classmethod
    def resume(cls, path: pathlib.Path, head: Head) -> "Store":
        """Opens a file for writing; waits while another process writes it. Raises StoreError."""
        try:
            lock = WriterLock(path)
        except OSError as problem:
            raise StoreError(f"{path}: {problem.strerror}") from None
        connection = cls._connect(path, "rw")
        found = cls._read_head(path, connection)
        if found.identity != head.identity:
            raise StoreError(f"{path}: plan, version or files of the plan differ; start another file with -o FILE")
        store = cls._writing(path, connection, found, lock)
        with store._reading():
            store._check_rows()
        return store

    @classmethod
    def read(cls, path: pathlib.Path) -> "Store":
        connection = cls._connect(path, "ro")
        return cls(path, connection, cls._read_head(path, connection))

    @classmethod
    def _writing(cls, path: pathlib.Path, connection: sqlite3.Connection, head: Head, lock: WriterLock) -> "Store":
        # A commit survives SIGKILL; a checkpoint survives a power failure.
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = NORMAL")
        store = cls(path, connection, head)
        store._lock = lock
        return store

    @staticmethod
    def _connect(path: pathlib.Path, mode: str) -> sqlite3.Connection:
        if not path.is_file():
            raise StoreError(f"{path}: no such file")
        connection = sqlite3.connect(f"{path.absolute().as_uri()}?mode={mode}", uri=True, timeout=10)
        connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, 16 * MAX_TEXT)
        connection.execute("PRAGMA trusted_schema = OFF")
        connection.execute("PRAGMA cell_size_check = ON")
        return connection

    @staticmethod
    def _read_head(path: pathlib.Path, connection: sqlite3.Connection) -> Head:
        def damaged(why: str) -> StoreError:
            return StoreError(f"{path}: damaged: {why}")

        try:
            if connection.execute("PRAGMA application_id").fetchone()[0] != APPLICATION_ID:
                raise StoreError(f"{path}: not the results of a campaign")
            format_ = connection.execute("PRAGMA user_version").fetchone()[0]
            if format_ != FORMAT:
                raise StoreError(f"{path}: format {format_}, this version reads {FORMAT}; run the campaign again")
            rows = connection.execute("SELECT * FROM campaign").fetchall()
            if len(rows) != 1:
                raise damaged("no campaign")
            *values, dimensions = rows[0]
            head = Head(*values, dimensions=tuple(json.loads(dimensions)))
            _check_head(head)
            kept = dict(connection.execute("SELECT name, sql FROM sqlite_schema"))
            if kept != schema(head):
                raise damaged("other tables")
        except (sqlite3.Error, ValueError, KeyError, TypeError, AttributeError, RecursionError) as problem:
            raise damaged(str(problem)) from None
        return head

    # Reading and writing

    def put(self, results: Iterable[Result]) -> None:
        """Commits results. They then survive SIGKILL."""
        self.put_rows([(one.number, *one.values, *(getattr(one, column.name) for column in COLUMNS)) for one in results])

    def put_rows(self, rows: Sequence[Row]) -> None:
        """Commits rows in the format of `rows()`."""
        places = ", ".join("?" * (1 + len(self.head.dimensions) + len(COLUMNS)))
        try:
            with self._connection:
                self._connection.executemany(f"INSERT INTO cases VALUES ({places})", rows)
                if self._connection.execute("SELECT EXISTS (SELECT 1 FROM failures)").fetchone()[0]:
                    self._connection.executemany("DELETE FROM failures WHERE number = ?", [row[:1] for row in rows])
            if time.monotonic() - self._synced_at >= SYNC_S:
                self._connection.execute("PRAGMA wal_checkpoint(PASSIVE)")
                self._synced_at = time.monotonic()
        except sqlite3.Error as problem:
            raise Error(f"{self.path}: {problem}; --resume goes on") from None

    def note_shard(self, shard: int, shards: int) -> None:
        with self._connection:
            self._connection.execute("INSERT OR IGNORE INTO shards VALUES (?, ?)", (shard, shards))

    def note_failures(self, failures: Iterable[Tuple[int, str]]) -> None:
        """Commits cases that have no result because the machine failed, with the reason. --resume runs them again."""
        with self._connection:
            self._connection.executemany("INSERT OR REPLACE INTO failures VALUES (?, ?)", failures)

    def failed_cases(self) -> List[Tuple[int, str]]:
        """Returns case numbers and reasons of machine failures. Raises StoreError."""
        with self._reading():
            found = list(self._connection.execute("SELECT number, substr(reason, 1, 1000) FROM failures ORDER BY number"))
        if not all(0 <= number < self.head.numbers and isinstance(reason, str) for number, reason in found):
            raise StoreError(f"{self.path}: damaged: failures")
        return found

    def failures(self) -> "Counter[str]":
        """Returns the number of cases without a result, by reason."""
        rows = self._connection.execute("SELECT substr(reason, 1, 1000), count(*) FROM failures GROUP BY 1 ORDER BY 1")
        return Counter(dict(rows))

    def shards(self) -> List[Tuple[int, int]]:
        """Raises StoreError."""
        found = list(self._connection.execute("SELECT shard, shards FROM shards ORDER BY shards, shard"))
        if not all(isinstance(shard, int) and isinstance(shards, int) and 0 <= shard < shards for shard, shards in found):
            raise StoreError(f"{self.path}: damaged: shards")
        return found

    def count(self) -> int:
        return int(self._connection.execute("SELECT count(*) FROM cases").fetchone()[0])

    def numbers_between(self, first: int, last: int) -> Set[int]:
        rows = self._connection.execute("SELECT number FROM cases WHERE number BETWEEN ? AND ?", (first, last))
        return {row[0] for row in rows}

    def __iter__(self) -> Iterator[Result]:
        """Yields results in order of numbers. Raises StoreError for a row that no campaign writes."""
        places = [n for n, one in enumerate(COLUMNS, 1 + len(self.head.dimensions)) if one.kind is bool]
        values = slice(1, 1 + len(self.head.dimensions))
        for row in self.rows():
            result = Result(row[0], row[values], *row[values.stop :])
            for name, place in zip(BOOLS, places):
                setattr(result, name, bool(row[place]))
            yield result

    def rows(self) -> Iterator[Row]:
        """Yields number, values and other fields of each Result, in order of numbers. Raises StoreError."""
        with self._reading():
            self._check_rows()
            last = -1
            for row in self._connection.execute("SELECT * FROM cases ORDER BY number"):
                if row[0] <= last:
                    raise StoreError(f"{self.path}: damaged: case {row[0]} after case {last}")
                last = row[0]
                yield row

    @contextlib.contextmanager
    def _reading(self) -> Iterator[None]:
        """Reads a snapshot of the file, even if another process writes it meanwhile. Raises StoreError."""
        try:
            self._connection.execute("BEGIN")
            yield
        except sqlite3.Error as problem:
            raise StoreError(f"{self.path}: damaged: {problem}") from None
        finally:
            with contextlib.suppress(sqlite3.ProgrammingError):  # the connection was closed meanwhile
                self._connection.rollback()

    def _check_rows(self) -> None:
        """Checks all rows by one SQL query, because the file may be untrusted. Raises StoreError."""
        checks, parameters = [f"number BETWEEN 0 AND {self.head.numbers - 1}"], []  # type: List[str], List[Any]
        for one in self.head.dimensions:
            name = quoted(one["name"])
            if "words" in one:
                checks.append(f"({name} IS NULL OR {name} IN ({', '.join('?' * len(one['words']))}))")
                parameters += one["words"]
            else:
                checks.append(f"({name} IS NULL OR (typeof({name}) = 'real' AND {name} BETWEEN ? AND ?))")
                parameters += [one["from"], one["to"]]
        for column in COLUMNS:
            checks.append(_check_of(column))
        for (number,) in self._connection.execute(f"SELECT number FROM cases WHERE ({' AND '.join(checks)}) IS NOT 1 LIMIT 1", parameters):
            raise StoreError(f"{self.path}: damaged: case {number}")

    def close(self) -> None:
        """Leaves a single file without a WAL, unless another process has it open."""
        if self._connection.in_transaction:
            self._connection.rollback()
        try:
            self._connection.execute("PRAGMA journal_mode = DELETE")
        except sqlite3.OperationalError:
            pass  # read-only, or open in another process
        self._connection.close()
        if self._lock is not None:
            self._lock.close()
