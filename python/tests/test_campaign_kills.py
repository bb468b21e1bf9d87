"""Campaigns that are killed while they run keep committed cases and give the same export after --resume.

The environment variable LKEMU names the program.
"""

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
def reference(tmp_path_factory):
    """Export of the plan, computed by one job without an interruption."""
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
    """Returns process IDs without zombies."""
    found = []
    for folder in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if fields[3] == str(session) and fields[0] != "Z":
            found.append(int(folder.name))
    return found


def start(*words, more=0):
    """Starts a campaign and waits for more than `more` new cases. Returns the process and committed case numbers."""
    path = words[words.index("-o") + 1]
    before = len(numbers(path))
    running = subprocess.Popen([*COMMAND, "plan.toml", "--quiet", *words], stderr=subprocess.PIPE, text=True, start_new_session=True)
    deadline = time.monotonic() + PATIENCE_S
    while len(committed := numbers(path)) <= before + more:
        assert running.poll() is None and time.monotonic() < deadline, running.communicate()[1]
        time.sleep(0.01)  # polling period
    return running, committed


def assert_session_ends(session):
    deadline = time.monotonic() + PATIENCE_S
    while left := processes_of_session(session):
        assert time.monotonic() < deadline, left
        time.sleep(0.01)


def test_repeated_kills_lose_no_committed_case(reference):
    committed = set()
    for jobs in ("1", "3", "2"):
        running, now = start("-o", "night.db", "-j", jobs, "--resume")
        running.kill()
        running.communicate()
        assert committed <= now <= numbers("night.db")
        committed = numbers("night.db")
        assert_session_ends(running.pid)
    assert len(committed) < CASES
    campaign("plan.toml", "-o", "night.db", "--quiet", "--resume")
    assert campaign("export", "night.db") == reference


def test_resumed_shard_merges_to_same_export(reference):
    running, _ = start("-o", "0.db", "-j", "2", "--shard", "0/3")
    running.kill()
    running.communicate()
    for shard, jobs in ((0, 1), (1, 2), (2, 3)):
        campaign("plan.toml", "-o", f"{shard}.db", "-j", jobs, "--shard", f"{shard}/3", "--quiet", "--resume")
    assert campaign("merge", "-o", "all.db", "2.db", "0.db", "1.db") == f"all.db: {CASES} of {CASES} cases\n"
    assert campaign("export", "all.db") == reference


@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGINT])
def test_interrupted_campaign_prints_one_line_and_leaves_no_processes(reference, how):
    running, committed = start("-o", "night.db", "-j", "2")
    running.send_signal(how)  # not to the process group
    errors = running.communicate(timeout=PATIENCE_S)[1]
    assert running.returncode == 130 and errors.count("\n") == 1, errors
    assert not processes_of_session(running.pid)
    assert not list(pathlib.Path().glob("night.db-*")), "one file remains"
    kept = numbers("night.db")
    assert errors == (f"lk-emu: stopped after {len(kept)} cases, all kept in night.db; "
                    "lk-emu campaign plan.toml --quiet -o night.db -j 2 --resume goes on\n")  # fmt: skip
    assert committed <= kept
    campaign("plan.toml", "-o", "night.db", "--quiet", "--resume")
    assert campaign("export", "night.db") == reference


def test_second_writer_waits_for_first(reference):
    """Occurs, for example, if GNU parallel is killed and its children survive."""
    first, _ = start("-o", "night.db", "-j", "1")
    second = subprocess.Popen([*COMMAND, "plan.toml", "--quiet", "-o", "night.db", "--resume"], stderr=subprocess.PIPE, text=True)
    assert second.stderr.readline() == "lk-emu: night.db: another process writes it; waiting for its end\n"
    first.kill()
    first.communicate()
    errors = second.communicate(timeout=PATIENCE_S)[1]
    assert second.returncode == 0 and not errors
    assert campaign("export", "night.db") == reference


@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGINT])
def test_interrupted_campaign_kills_its_hosts(how):
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
    errors = running.communicate(timeout=PATIENCE_S)[1]
    assert running.returncode == 130 and errors.count("\n") == 1, errors
    assert not [one for one in pathlib.Path("/proc").glob("[0-9]*/environ") if _has(one, f"MARK={os.getcwd()}")]


def _has(file, text):
    try:
        return text.encode() in file.read_bytes().split(b"\0")
    except OSError:
        return False


def test_repeated_signals_act_as_one():
    running, _ = start("-o", "night.db", "-j", "2")
    while running.poll() is None:
        running.send_signal(signal.SIGINT)
    errors = running.communicate()[1]
    assert running.returncode == 130 and errors.count("\n") == 1, errors


def test_killed_program_is_not_an_input_error(reference):
    """The status must not be 2, which makes a batch system give up because the plan is invalid."""
    running, _ = start("-o", "night.db", "-j", "1")
    (program,) = [pid for pid in processes_of_session(running.pid) if pid != running.pid]
    os.kill(program, signal.SIGKILL)
    errors = running.communicate(timeout=PATIENCE_S)[1]
    assert running.returncode == 1 and errors.count("\n") == 1 and "status -9; --resume goes on" in errors, errors
    campaign("plan.toml", "-o", "night.db", "--quiet", "--resume")
    assert campaign("export", "night.db") == reference
