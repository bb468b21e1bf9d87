"""Results files of campaigns: damaged files are rejected with a one-line message; shards are merged."""

import contextlib
import random
import sqlite3
import struct
import subprocess
import sys

import pytest

for library in ("jinja2", "regex", "scipy"):
    pytest.importorskip(library)

from lkemu.campaign.export import export
from lkemu.campaign.judge import Result
from lkemu.campaign.merge import merge
from lkemu.campaign.store import Head, Store, StoreError

DIMENSIONS = ({"name": "fault.kind", "words": ["jam", "cut"], "harmless_is_most": False},
              {"name": "fault.at_s", "from": 0.5, "to": 4.0, "harmless_is_most": False})  # fmt: skip
WALL_S = 1234.56789  # its bytes occur once in the file
PLANS = {"plan_text": "[hazard]\nexpectations = []\n"}


def head(cases=12):
    return Head("0.2.0", "night", "", PLANS["plan_text"], "0" * 16, "random", 1, cases, cases, "night.toml", None, DIMENSIONS)


def result(number, **more):
    return Result(number, ("jam", 0.5 + number / 4), "late", 10, 20, 30, None, 25, "it stays", -0.5, "running", "A4", wall_s=0.25, **more)


def write(path, numbers, shard=(0, 1), **more):
    store = Store.create(path, head())
    store.put(result(number, **more) for number in numbers)
    store.note_shard(*shard)
    store.close()
    return path


@pytest.fixture
def night(tmp_path):
    return write(tmp_path / "night.db", range(12))


def change(path, *statements):
    with contextlib.closing(sqlite3.connect(path, isolation_level=None)) as database:
        for statement in statements:
            database.execute(statement)


def change_without_strict(path, statement):
    """Executes a statement while the tables are not STRICT, so any type is stored."""
    schema = "UPDATE sqlite_schema SET sql = replace(sql, '{}', '{}') WHERE name IN ('cases', 'campaign')"
    change(path, "PRAGMA writable_schema = ON", schema.format(") STRICT", ")"))
    change(path, statement)
    change(path, "PRAGMA writable_schema = ON", schema.format(")", ")").replace("replace(sql, ')', ')')", "sql || ' STRICT'"))


def assert_is_refused(path, tmp_path):
    """Checks that the export and merges reject the file."""
    with pytest.raises(StoreError, match="night.db: "):
        lines(path)
    with pytest.raises(StoreError, match="night.db: "):
        merge(tmp_path / "all.db", [path])
    assert not (tmp_path / "all.db").exists()


def lines(path):
    store = Store.read(path)
    with contextlib.closing(store):
        return list(export([one["name"] for one in store.head.dimensions], store))


DAMAGE = {
    "a word of 100 MB": ["UPDATE cases SET note = printf('%.*c', 100000000, 'x') WHERE number = 7"],
    "a plan of 100 MB": ["UPDATE campaign SET plan_text = printf('%.*c', 100000000, '#')"],
    "a word of 2 MB": ["UPDATE cases SET said = printf('%.*c', 2000000, 'x') WHERE number = 7"],
    "a trigger": ["CREATE TRIGGER more AFTER INSERT ON shards BEGIN DELETE FROM cases; END"],
    "a trigger with a name of SQLite": ["CREATE TRIGGER sqlitely AFTER INSERT ON shards BEGIN DELETE FROM cases; END"],
    "a view": ["CREATE VIEW more AS SELECT * FROM cases"],
    "a view in place of the cases": ["ALTER TABLE cases RENAME TO old", "CREATE VIEW cases AS SELECT * FROM old"],
    "an index": ["CREATE INDEX more ON cases (margin)"],
    "another table": ["CREATE TABLE more (x)"],
    "no shards": ["DROP TABLE shards"],
    "another column": ["ALTER TABLE cases ADD COLUMN more TEXT"],
    "10^18 cases": ["UPDATE campaign SET numbers = 1000000000000000000, cases = 1000000000000000000"],
    "a negative number of cases": ["UPDATE campaign SET cases = -1"],
    "two campaigns": ["INSERT INTO campaign SELECT * FROM campaign"],
    "dimensions that are none": ["UPDATE campaign SET dimensions = '[[[['"],
    "a plan that is none": ["UPDATE campaign SET plan_text = '[hazard'"],
    "rates that are words": ["UPDATE campaign SET plan_text = '[rates]' || char(10) || 'jam = \"often\"'"],
    "an unknown outcome": ["UPDATE cases SET outcome = 'fine' WHERE number = 7"],
    "a case that the campaign lacks": ["UPDATE cases SET number = 12 WHERE number = 7"],
    "a negative case": ["UPDATE cases SET number = -1 WHERE number = 7"],
    "an infinite margin": ["UPDATE cases SET margin = 9e999 WHERE number = 7"],
    "a value beyond its range": ['UPDATE cases SET "fault.at_s" = 4.5 WHERE number = 7'],
    "a kind that the plan lacks": ["UPDATE cases SET \"fault.kind\" = 'hang' WHERE number = 7"],
    "another application": ["PRAGMA application_id = 1"],
    "another format": ["PRAGMA user_version = 99"],
}


@pytest.mark.parametrize("statements", DAMAGE.values(), ids=DAMAGE.keys())
def test_rejects_damaged_results(night, tmp_path, statements):
    change(night, *statements)
    assert_is_refused(night, tmp_path)


@pytest.mark.parametrize(
    "statement",
    ["UPDATE cases SET runs = 'many' WHERE number = 7", "UPDATE cases SET note = x'ff00' WHERE number = 7", "UPDATE cases SET real_time = 2",
     "UPDATE cases SET margin = 'wide' WHERE number = 7", "UPDATE campaign SET numbers = 'many'",
     'UPDATE cases SET "fault.at_s" = \'soon\' WHERE number = 7', "UPDATE campaign SET plan_text = x'ff'", "UPDATE cases SET flips = NULL"],
)  # fmt: skip
def test_rejects_values_of_wrong_type(night, tmp_path, statement):
    try:
        change_without_strict(night, statement)
    except sqlite3.IntegrityError:  # NOT NULL is checked without STRICT as well
        change(night, "PRAGMA writable_schema = ON", "UPDATE sqlite_schema SET sql = replace(sql, 'flips INTEGER NOT NULL', 'flips INTEGER')")
        change(night, statement)
        change(night, "PRAGMA writable_schema = ON", "UPDATE sqlite_schema SET sql = replace(sql, 'flips INTEGER', 'flips INTEGER NOT NULL') || ' STRICT'")
    assert_is_refused(night, tmp_path)


def test_rejects_nan(tmp_path):
    path = write(tmp_path / "night.db", range(11))
    store = Store.resume(path, head())
    store.put([Result(11, ("jam", 1.0), "late", wall_s=WALL_S)])
    store.close()
    data = path.read_bytes()
    assert data.count(struct.pack(">d", WALL_S)) == 1
    path.write_bytes(data.replace(struct.pack(">d", WALL_S), struct.pack(">d", float("nan"))))
    assert_is_refused(path, tmp_path)


@pytest.mark.parametrize("seed", range(3))
def test_changed_bytes_never_crash_the_reader(tmp_path, seed):
    """Reading must end without a traceback, a signal or an endless loop."""
    draw = random.Random(seed)
    whole = write(tmp_path / "night.db", range(12)).read_bytes()
    for n in range(40):
        data = bytearray(whole)
        for _ in range(draw.choice((1, 4, 64))):
            data[draw.randrange(len(data))] = draw.randrange(256)
        path = tmp_path / f"{n}.db"
        path.write_bytes(data[: draw.choice((len(data), draw.randrange(len(data))))])
        try:
            store = Store.read(path)
            with contextlib.closing(store):
                assert all(isinstance(row, Result) for row in store) and len(list(export([], store))) <= 13
        except StoreError as problem:
            assert str(path) in str(problem)


def test_resume_rejects_damage_before_running(night):
    change(night, "UPDATE cases SET margin = 9e999 WHERE number = 7")
    with pytest.raises(StoreError, match="damaged: case 7"):
        Store.resume(night, head())


@pytest.mark.parametrize("words", [["report"], ["export"], ["merge", "-o", "all.db"], ["compare", "whole.db"]], ids=lambda words: words[0])
def test_damage_prints_one_line(night, tmp_path, words):
    write(tmp_path / "whole.db", range(12))
    change(night, *DAMAGE["a word of 100 MB"])
    command = [sys.executable, "-m", "lkemu.campaign", *words, "night.db"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=100, check=False)
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and done.stderr.startswith("lk-emu: night.db: damaged: "), done.stderr
    assert not (tmp_path / "all.db").exists()


# Merges


def test_merge_equals_single_run(tmp_path, night):
    for count in (1, 2, 5, 12):
        parts = [write(tmp_path / f"{shard}of{count}.db", range(shard, 12, count), (shard, count)) for shard in range(count)]
        merged = merge(tmp_path / f"all{count}.db", parts[::-1])
        assert merged.is_whole and lines(tmp_path / f"all{count}.db") == lines(night)


def test_merge_rejects_conflicting_results(tmp_path):
    one = write(tmp_path / "one.db", range(8), said="at noon")
    same = write(tmp_path / "same.db", range(4, 12), said="at night")
    merge(tmp_path / "all.db", [one, same])
    assert len(lines(tmp_path / "all.db")) == 13
    other = write(tmp_path / "other.db", range(4, 12), note="not the same")
    with pytest.raises(StoreError, match="one.db and .*other.db: have different results of case 4"):
        merge(tmp_path / "both.db", [one, other])
    assert not (tmp_path / "both.db").exists()


def test_merge_keeps_machine_failures(tmp_path):
    parts = [write(tmp_path / "one.db", range(5)), write(tmp_path / "other.db", range(4, 10))]
    for path, failures in zip(parts, ([(4, "no memory"), (10, "no memory")], [(11, "killed")])):
        change(path, *(f"INSERT INTO failures VALUES ({number}, '{reason}')" for number, reason in failures))
    merge(tmp_path / "all.db", parts)
    with contextlib.closing(Store.read(tmp_path / "all.db")) as whole:
        assert whole.failed_cases() == [(10, "no memory"), (11, "killed")]  # not case 4: the other part has its result
    change(parts[1], "UPDATE failures SET number = 12")
    with pytest.raises(StoreError, match="damaged: failures"):
        merge(tmp_path / "none.db", parts)


def test_merge_lists_few_of_many_missing_shards(tmp_path):
    part = write(tmp_path / "part.db", range(12), (0, 10**18))
    assert str(merge(tmp_path / "all.db", [part])).endswith(f", 9/{10**18}, 10/{10**18} and {10**18 - 11} more")
    change(part, "UPDATE shards SET shard = -1")
    with pytest.raises(StoreError, match="damaged: shards"):
        merge(tmp_path / "none.db", [part])
