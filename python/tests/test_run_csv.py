"""Tests of the CSV reader and of the parser of ID lists."""

import math
import os

import pytest

from lkemu.command import parse_ids
from lkemu.errors import StartError
from lkemu.run_csv import Column, RunCsv


@pytest.fixture
def read(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def read_file(data):
        (tmp_path / "run.csv").write_bytes(data if isinstance(data, bytes) else data.encode())
        csv = RunCsv("run.csv", "plot")
        return csv.columns, list(csv.rows())

    return read_file


def refusal(read, data):
    with pytest.raises(StartError) as problem:
        read(data)
    return str(problem.value)


def test_columns_and_rows(read):
    columns, rows = read("time_s,1.speed_dps,vcan0.2.iq_A,a.b.32.iq_A,body.trunk.z_m\r\n0,1.5,-2e3,4,5\r\n0.1,,nan,inf,6")
    assert columns == [Column("", 1, "speed_dps"), Column("vcan0", 2, "iq_A"), Column("a.b", 32, "iq_A"), Column("", 0, "body.trunk.z_m")]
    assert rows[0] == [0, 1.5, -2000, 4, 5]
    assert rows[1][0] == 0.1 and math.isnan(rows[1][1]) and math.isnan(rows[1][2]) and rows[1][4] == 6


def test_an_empty_run_has_no_rows(read):
    assert read("time_s,1.iq_A\n") == ([Column("", 1, "iq_A")], [])


def test_names_are_made_printable(read):
    columns, _ = read(b"time_s,\xff<b>\x1b.1.iq_A\n")
    assert columns == [Column("?<b>?", 1, "iq_A")]


@pytest.mark.parametrize("data, problem", [
    (b"", "plot: run.csv is empty"),
    (b"\0", "plot: run.csv:1: is not a CSV file of lk-emu run or lk-emu replay: the first line does not begin with time_s"),
    (b"time,1.iq_A\n", "plot: run.csv:1: is not a CSV file of lk-emu run or lk-emu replay: the first line does not begin with time_s"),
    (b"\x7fELF" * 999999, "plot: run.csv:1: is not a CSV file of lk-emu run or lk-emu replay: the first line does not begin with time_s"),
    (b"time_s,1.iq_A,1.iq_A\n", "plot: run.csv:1: column 3 has the name of an earlier column"),
    (b"time_s,33.iq_A\n", "plot: run.csv:1: column 2 is not called like 1.speed_dps or vcan0.1.speed_dps"),
    (b"time_s,iq_A\n", "plot: run.csv:1: column 2 is not called like 1.speed_dps or vcan0.1.speed_dps"),
    (b"time_s,1.iq_A\n0,1\n0.5\n", "plot: run.csv:3: 1 values, but the first line names 2 columns"),
    (b"time_s,1.iq_A\n0,1\n0.5,one\n", "plot: run.csv:3: column 2 is not a number"),
    (b"time_s,1.iq_A\nnan,1\n", "plot: run.csv:2: has no time"),
    (b"time_s,1.iq_A\n1,1\n0.5,1\n", "plot: run.csv:3: is earlier than the line before it"),
    (b"time_s,1.iq_A\n0," + b"1" * 2**20 + b"\n", "plot: run.csv:2: is longer than any line of lk-emu"),
])  # fmt: skip
def test_refuses(read, data, problem):
    assert refusal(read, data) == problem


def test_refuses_unreadable_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for path, problem in (("none.csv", "plot: cannot read none.csv: No such file or directory"), (".", "plot: .: is a directory")):
        with pytest.raises(StartError, match=problem):
            RunCsv(path, "plot")


def test_ids():
    assert parse_ids("9,1,3-5") == [1, 3, 4, 5, 9]
    for text, problem in (("1-", '"1-" is not an ID'), ("33", '"33" is not an ID'), ("", '"" is not an ID'), ("4-2", "runs backwards"), ("1,1-2", "an ID twice")):
        with pytest.raises(StartError, match=problem):
            parse_ids(text)


def test_a_pipe_and_a_directory_are_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    for name, what in (("pipe.csv", "not a regular file"), (".", "a directory")):
        with pytest.raises(StartError, match=f"is {what}$"):
            RunCsv(str(tmp_path / name), "plot")
