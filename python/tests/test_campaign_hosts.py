"""Campaigns with host programs, by the program that LKEMU names. Hosts are small and move the clock."""

import os
import pathlib
import signal
import subprocess
import sys
import time

import pytest

pytest.importorskip("scipy")
pytest.importorskip("jinja2")
if "LKEMU" not in os.environ:
    pytest.skip("LKEMU names no program", allow_module_level=True)

# {how} comes from the plan. The fault begins at 1 s.
HOST = '''
import os, subprocess, sys, time
import lkemu

how = sys.argv[1]
clock = lkemu.attach().clock
fault = False
for n in range(1, 31):
    clock.advance_to(0.1 * n)
    fault = any(one.first_effect_at_s is not None for one in clock.faults())
    if fault and how == "says":
        print("error: the joint does not move")
    if fault and how == "status":
        sys.exit(3)
    if fault and how == "dies":
        sys.exit(1)
    if fault and how == "killed":
        os.kill(os.getpid(), 9)
    if fault and how == "computes":
        while True:
            pass
    if fault and how == "waits":
        time.sleep(1000)
    if n == 1 and how == "leaves":
        subprocess.Popen(["sleep", "7654321"], start_new_session=True)
    if how == "always":
        print("error: an alarm that the fault does not cause")
'''

PLAN = """
scenario = "joint_moves"
sampling = "full"
[dimension]
fault.kind = "jam"
fault.id = 1
fault.at_s = 1
host.how = [{hows}]
[host]
command = ["{python}", "host.py", "{{host.how}}"]
clock = "stepped"
timeout_s = {timeout_s}
[detect]
drive = "none"
[[detect.host]]
says = '{says}'
[[detect.host]]
exit_status = 3
"""


def campaign(*words, **more):
    return subprocess.run([sys.executable, "-m", "lkemu.campaign", *words], capture_output=True, text=True, timeout=300, **more)


@pytest.fixture
def write(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "host.py").write_text(HOST)

    def write_plan(*hows, timeout_s=20.0, says="^error: "):
        quoted = ", ".join(f'"{how}"' for how in hows)
        (tmp_path / "plan.toml").write_text(PLAN.format(hows=quoted, python=sys.executable, timeout_s=timeout_s, says=says))

    return write_plan


@pytest.fixture
def run(write):
    def write_and_run(*hows, **more):
        write(*hows, **more)
        return campaign("plan.toml")

    return write_and_run


def rows():
    lines = campaign("export", "plan.db").stdout.splitlines()
    names = lines[0].split(",")
    return [dict(zip(names, line.split(","))) for line in lines[1:]]


def are_running(*words):
    listed = subprocess.run(["ps", "-eo", "args"], capture_output=True, text=True, check=True).stdout
    return [line for line in listed.splitlines() if all(word in line for word in words)]


def test_what_hosts_notice_is_of_the_instant_at_which_they_did(run):
    assert run("says", "status", "always", "well").returncode == 0
    says, status, always, well = rows()
    # The host looks every 0.1 s. The fault begins at 1 s, and shows after that.
    assert says["outcome"] == status["outcome"] == "detected by the host"
    assert says["detected_by_host_ns"] == status["detected_by_host_ns"] == "1100000000"
    assert always["outcome"] == well["outcome"] == "silently wrong", "an alarm without a fault tells nothing"
    assert says["note"] == "exit status 0; line 1 of [detect]" and status["note"] == "exit status 3"


def test_how_hosts_end(run):
    assert run("dies", "killed", "computes", "waits", timeout_s=0.5).returncode == 0
    assert [row["outcome"] for row in rows()] == ["crash", "crash", "hang", "hang"]
    assert [row["note"] for row in rows()] == ["exit status 1", "killed by SIGKILL", "did not end in time", "did not end in time"]


def test_nothing_that_a_host_has_started_stays(run):
    assert run("leaves").returncode == 0
    assert not are_running("sleep 7654321")


def test_nothing_stays_when_the_campaign_is_killed(write, tmp_path):
    write("waits")
    command = [sys.executable, "-m", "lkemu.campaign", "plan.toml", "-j", "2"]
    running = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while not are_running("host.py", "waits"):
        assert running.poll() is None
        time.sleep(0.02)  # between two looks at the processes
    running.send_signal(signal.SIGKILL)
    running.wait()
    patience = time.monotonic() + 20
    while are_running("host.py", "waits") or are_running(str(tmp_path)):
        assert time.monotonic() < patience
        time.sleep(0.02)


def test_a_worker_that_was_killed_is_no_result(write):
    write("says", "waits", timeout_s=0.5)
    command = [sys.executable, "-m", "lkemu.campaign", "plan.toml", "-j", "1", "--quiet"]
    running = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    while not are_running("host.py", "waits"):
        assert running.poll() is None
        time.sleep(0.02)  # between two looks at the processes
    subprocess.run(["pkill", "-KILL", "-P", str(running.pid), "-f", "host_worker"], check=True)
    assert "ended from outside" in running.communicate()[1] and running.returncode == 1
    assert len(rows()) == 1
    assert campaign("plan.toml", "--resume", "--quiet").returncode == 0
    assert [row["outcome"] for row in rows()] == ["detected by the host", "hang"]


def test_refuses_what_cannot_run(run):
    hangs = run("dies", says="(a+")
    assert hangs.returncode == 2 and "is no regular expression" in hangs.stderr
    pathlib.Path("host.py").write_text("import sys\nsys.exit('no such bus')\n")
    dies = run("dies")
    assert dies.returncode == 2 and "even without a fault" in dies.stderr and "no such bus" in dies.stderr
    assert dies.stderr.count("\n") == 1 and not pathlib.Path("plan.db").exists()


def test_an_expression_that_never_ends_is_refused(run):
    pathlib.Path("host.py").write_text(HOST + f"print('{'a' * 200}!')\n")
    done = run("well", says="^(a|aa)+$")
    assert done.returncode == 2 and "takes too long" in done.stderr
