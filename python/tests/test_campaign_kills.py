"""Campaigns that are killed in the middle, by the program that LKEMU names: what is committed stays, and the export is the same."""

import contextlib
import os
import pathlib
import signal
import sqlite3
import subprocess
import sys
import time

import pytest

for library in ("jinja2", "regex", "scipy"):
    pytest.importorskip(library)
if "LKEMU" not in os.environ:
    pytest.skip("LKEMU names no program", allow_module_level=True)

CASES = 400
PLAN = f"""
scenario = "joint_moves"
sampling = "random"
cases = {CASES}
[dimension]
fault.kind = ["jam", "drop", "friction"]
fault.id = 1
fault.at_s = {{ from = 0.2, to = 4 }}
fault.for_s = {{ from = 0.01, to = 2 }}
fault.jam.percent = {{ from = 5, to = 100 }}
fault.friction.factor = {{ from = 1.5, to = 50 }}
"""
COMMAND = [sys.executable, "-m", "lkemu.campaign"]
PATIENCE_S = 120


def campaign(*words):
    done = subprocess.run([*COMMAND, *map(str, words)], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The export of the plan, computed by one job without an interruption."""
    folder = tmp_path_factory.mktemp("whole")
    (folder / "plan.toml").write_text(PLAN)
    campaign(folder / "plan.toml", "-j", "1", "--quiet", "-o", folder / "whole.db")
    return campaign("export", folder / "whole.db")


@pytest.fixture(autouse=True)
def plan(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plan.toml").write_text(PLAN)


def numbers(path):
    try:
        with contextlib.closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as database:
            return {row[0] for row in database.execute("SELECT number FROM cases")}
    except sqlite3.OperationalError:
        return set()


def processes_of_session(session):
    """Process IDs, those that have ended aside."""
    found = []
    for folder in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if fields[3] == str(session) and fields[0] != "Z":
            found.append(int(folder.name))
    return found


def started(*words, more=0):
    """A campaign that has committed `more` cases than its file had, and still runs; the numbers of the committed cases."""
    path = words[words.index("-o") + 1]
    before = len(numbers(path))
    running = subprocess.Popen([*COMMAND, "plan.toml", "--quiet", *words], stderr=subprocess.PIPE, text=True, start_new_session=True)
    deadline = time.monotonic() + PATIENCE_S
    while len(committed := numbers(path)) <= before + more:
        assert running.poll() is None and time.monotonic() < deadline, running.communicate()[1]
        time.sleep(0.01)  # between two looks at the file
    return running, committed


def assert_session_ends(session):
    deadline = time.monotonic() + PATIENCE_S
    while left := processes_of_session(session):
        assert time.monotonic() < deadline, left
        time.sleep(0.01)


def test_kill_after_kill_no_committed_case_is_lost(whole):
    committed = set()
    for jobs in ("1", "3", "2"):
        running, now = started("-o", "night.db", "-j", jobs, "--resume")
        running.kill()
        running.communicate()
        assert committed <= now <= numbers("night.db")
        committed = numbers("night.db")
        assert_session_ends(running.pid)
    assert len(committed) < CASES
    campaign("plan.toml", "-o", "night.db", "--quiet", "--resume")
    assert campaign("export", "night.db") == whole


def test_a_killed_shard_goes_on_and_merges_to_the_same_bytes(whole):
    running, _ = started("-o", "0.db", "-j", "2", "--shard", "0/3")
    running.kill()
    running.communicate()
    for shard, jobs in ((0, 1), (1, 2), (2, 3)):
        campaign("plan.toml", "-o", f"{shard}.db", "-j", jobs, "--shard", f"{shard}/3", "--quiet", "--resume")
    assert campaign("merge", "-o", "all.db", "2.db", "0.db", "1.db") == f"all.db: {CASES} of {CASES} cases\n"
    assert campaign("export", "all.db") == whole


@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGINT])
def test_an_interrupted_campaign_says_one_line_and_leaves_nothing(whole, how):
    running, committed = started("-o", "night.db", "-j", "2")
    running.send_signal(how)  # to this process alone
    said = running.communicate(timeout=PATIENCE_S)[1]
    assert running.returncode == 130 and said.count("\n") == 1, said
    assert not processes_of_session(running.pid)
    assert not list(pathlib.Path().glob("night.db-*")), "one file remains"
    kept = numbers("night.db")
    assert said == (f"lk-emu: stopped after {len(kept)} cases, all kept in night.db; "
                    "lk-emu campaign plan.toml --quiet -o night.db -j 2 --resume goes on\n")  # fmt: skip
    assert committed <= kept
    campaign("plan.toml", "-o", "night.db", "--quiet", "--resume")
    assert campaign("export", "night.db") == whole


def test_the_same_command_again_waits_for_the_one_that_runs(whole):
    """As where GNU parallel was killed and its children were not."""
    first, _ = started("-o", "night.db", "-j", "1")
    second = subprocess.Popen([*COMMAND, "plan.toml", "--quiet", "-o", "night.db", "--resume"], stderr=subprocess.PIPE, text=True)
    assert second.stderr.readline() == "lk-emu: night.db: another process writes it; waiting for its end\n"
    first.kill()
    first.communicate()
    said = second.communicate(timeout=PATIENCE_S)[1]
    assert second.returncode == 0 and not said
    assert campaign("export", "night.db") == whole


@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGINT])
def test_an_interrupted_campaign_ends_its_hosts(how):
    pathlib.Path("host.toml").write_text(f"""
scenario = "joint_moves"
sampling = "full"
[dimension]
fault.kind = ["jam", "cut"]
fault.id = 1
fault.at_s = 1
[host]
command = ["{sys.executable}", "waits.py"]
clock = "stepped"
""")
    pathlib.Path("waits.py").write_text("import lkemu, time\nclock = lkemu.attach().clock\nclock.advance_to(2)\nif clock.faults(): open('waits', 'w'); time.sleep(1000)\n")
    command = [*COMMAND, "host.toml", "-j", "2", "--quiet"]
    running = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env={**os.environ, "MARK": str(os.getcwd())})
    deadline = time.monotonic() + PATIENCE_S
    while not pathlib.Path("waits").exists():
        assert running.poll() is None and time.monotonic() < deadline, running.communicate()[1]
        time.sleep(0.01)
    running.send_signal(how)
    said = running.communicate(timeout=PATIENCE_S)[1]
    assert running.returncode == 130 and said.count("\n") == 1, said
    assert not [one for one in pathlib.Path("/proc").glob("[0-9]*/environ") if _has(one, f"MARK={os.getcwd()}")]


def _has(file, text):
    try:
        return text.encode() in file.read_bytes().split(b"\0")
    except OSError:
        return False


def test_many_signals_are_as_one():
    running, _ = started("-o", "night.db", "-j", "2")
    while running.poll() is None:
        running.send_signal(signal.SIGINT)
    said = running.communicate()[1]
    assert running.returncode == 130 and said.count("\n") == 1, said


def test_a_killed_program_is_no_unusable_input(whole):
    """Status 2 would tell a batch system that a plan is wrong, and never to try it again."""
    running, _ = started("-o", "night.db", "-j", "1")
    (program,) = [pid for pid in processes_of_session(running.pid) if pid != running.pid]
    os.kill(program, signal.SIGKILL)
    said = running.communicate(timeout=PATIENCE_S)[1]
    assert running.returncode == 1 and said.count("\n") == 1 and "status -9; --resume goes on" in said, said
    campaign("plan.toml", "-o", "night.db", "--quiet", "--resume")
    assert campaign("export", "night.db") == whole
