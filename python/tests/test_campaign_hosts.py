"""Campaigns with host programs that advance a stepped clock. The environment variable LKEMU names the program."""

import json
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

# Behaviour `how` comes from the dimension host.how of the plan. The fault begins at 1 s.
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
    if fault and how == "advances":
        while True:
            clock.advance(0.01)
    if fault and how == "allocates":
        memory = bytearray(400_000_000)
        clock.advance(0.1)
    if fault and how == "floods":
        while True:
            print("a line of no interest")
    if fault and how == "raises":
        raise ValueError("no such angle: 361")
    if fault and how.endswith("waits"):
        open("waiting", "w").close()
        time.sleep(1000)
    if n == 1 and how.startswith("leaves"):
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
{more}
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

    def write_plan(*hows, timeout_s=20.0, says="^error: ", more=""):
        quoted = ", ".join(f'"{how}"' for how in hows)
        (tmp_path / "plan.toml").write_text(PLAN.format(hows=quoted, python=sys.executable, timeout_s=timeout_s, says=says, more=more))

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


def running_commands(*words):
    listed = subprocess.run(["ps", "-eo", "args"], capture_output=True, text=True, check=True).stdout
    return [line for line in listed.splitlines() if all(word in line for word in words)]


def start(*words):
    """Starts a campaign and returns when one of its hosts waits."""
    running = subprocess.Popen([sys.executable, "-m", "lkemu.campaign", "plan.toml", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               text=True)  # fmt: skip
    assert waits_again(running), running.stderr.read()
    return running


def waits_again(running):
    """Returns True when a host waits, False when the campaign has ended."""
    waiting = pathlib.Path("waiting")
    while not waiting.exists():
        if running.poll() is not None:
            return False
        time.sleep(0.02)  # polling period
    waiting.unlink()
    return True


def find_descendants(parent, *words):
    """Returns process IDs of descendants whose command line contains all these words."""
    listed = subprocess.run(["ps", "-eo", "pid,ppid,args"], capture_output=True, text=True, check=True).stdout
    rows = [line.split(None, 2) for line in listed.splitlines()[1:]]
    found, above = [], [str(parent)]
    while above:
        children = [row for row in rows if row[1] in above]
        found += [int(row[0]) for row in children if len(row) > 2 and all(word in row[2] for word in words)]
        above = [row[0] for row in children]
    return found


def wait_until_gone(*words):
    deadline = time.monotonic() + 30
    while running_commands(*words):
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_detection_has_simulated_time_of_output(run):
    assert run("says", "status", "always", "well").returncode == 0
    says, status, always, well = rows()
    # The host checks every 0.1 s. The fault begins at 1 s; its effect is visible later.
    assert says["outcome"] == status["outcome"] == "detected by the host"
    assert says["detected_by_host_ns"] == status["detected_by_host_ns"] == "1100000000"
    assert always["outcome"] == well["outcome"] == "silently wrong", "an alarm without a fault tells nothing"
    assert says["note"] == "exit status 0; line 1 of [detect]" and status["note"] == "exit status 3"


def test_report_shows_how_hosts_ended(run):
    done = run("dies", "killed", "raises")
    assert [row["outcome"] for row in rows()] == ["crash"] * 3
    assert [row["note"] for row in rows()] == ["exit status 1", "killed by SIGKILL", "uncaught ValueError"]
    assert "uncaught ValueError; ValueError: no such angle: 361" in done.stdout, "the report has the last line of the traceback"
    assert "1 host ended by an uncaught ValueError, which [detect] does not count." in done.stdout
    assert "[[detect.host]]\n  exit_status = 1\n" in done.stdout and "[[detect.host]]\n  says = '^ValueError\\b'\n" in done.stdout


def test_listed_exception_is_a_detection(run):
    run("raises", says=r"^ValueError\b")
    (row,) = rows()
    assert (row["outcome"], row["note"]) == ("detected by the host", "uncaught ValueError; line 1 of [detect]")


def test_timeout_limits_simulated_and_processor_time_of_stepped_host(run):
    assert run("computes", "advances", "waits", timeout_s=3.5).returncode == 0
    assert [row["outcome"] for row in rows()] == ["hang"] * 3
    assert [row["note"] for row in rows()] == [
        "did not end within 3.5 s of processor time", "did not end within 3.5 s of simulated time", "waited for something else than the clock",
    ]  # fmt: skip


def test_exceeded_memory_or_output_is_a_crash(run):
    assert run("allocates", "floods", more="memory_MB = 300\noutput_MB = 1").returncode == 0
    assert [row["outcome"] for row in rows()] == ["crash"] * 2
    assert [row["note"] for row in rows()] == ["used more than 300 MB of memory (memory_MB)", "wrote more than 1 MB (output_MB)"]


def test_busy_machine_does_not_change_results(write):
    write("says", "status", "well", "raises", "computes", "advances", timeout_s=3.5)
    assert campaign("plan.toml", "-j", "1", "--quiet").returncode == 0
    quiet = campaign("export", "plan.db").stdout
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(3)]
    try:
        assert campaign("plan.toml", "-j", "4", "-o", "busy.db", "--quiet").returncode == 0
    finally:
        for one in busy:
            one.kill()
            one.wait()
    assert campaign("export", "busy.db").stdout == quiet


def test_kills_processes_started_by_host(run):
    assert run("leaves").returncode == 0
    assert not running_commands("sleep 7654321")


def test_killed_campaign_leaves_no_processes(write, tmp_path):
    write("waits")
    running = start("-j", "2")
    running.send_signal(signal.SIGKILL)
    running.communicate()
    wait_until_gone("host.py", "waits")
    wait_until_gone(str(tmp_path))


# Processes to kill: words of the command line, index among the matches. A worker has two; its parent is first.
VICTIMS = {"parent": (["host_worker"], 0), "worker": (["host_worker"], 1), "lk-emu": (["--end-with-stdin"], 0), "host": (["host.py", "waits"], 0)}


@pytest.mark.parametrize("victim", VICTIMS)
def test_external_kill_leaves_no_processes_and_no_result(write, victim):
    write("leaves waits", timeout_s=300)
    words, place = VICTIMS[victim]
    running = start("-j", "1")
    os.kill(find_descendants(running.pid, *words)[place], signal.SIGKILL)
    assert waits_again(running), "a run that was killed from outside is repeated once"
    time.sleep(1)  # the host is idle by now, so its end counts as external
    os.kill(find_descendants(running.pid, *words)[place], signal.SIGKILL)
    out, err = running.communicate()
    assert running.returncode == 1 and "1 case without a result, because the machine failed" in err and "was killed from outside" in out
    assert not rows()
    assert not running_commands("host.py", "waits") and not running_commands("sleep 7654321")


def test_resume_reruns_machine_failures(write):
    write("says", "waits", timeout_s=3.5)
    running = start("-j", "1", "--quiet")
    while True:
        os.kill(find_descendants(running.pid, "--end-with-stdin")[0], signal.SIGTERM)
        if not waits_again(running):
            break
    running.communicate()
    assert [row["outcome"] for row in rows()] == ["detected by the host"]
    assert "1 case without a result, because the machine failed (lk-emu was killed from outside)" in campaign("report", "plan.db").stdout
    assert campaign("plan.toml", "--resume", "--quiet").returncode == 0
    assert [row["outcome"] for row in rows()] == ["detected by the host", "hang"]
    assert "machine failed" not in campaign("report", "plan.db").stdout


def test_external_signal_repeats_the_run(write):
    write("waits", timeout_s=3.5)
    running = start("-j", "1", "--quiet")
    os.kill(find_descendants(running.pid, "host.py", "waits")[0], signal.SIGKILL)
    running.communicate()
    assert [row["note"] for row in rows()] == ["waited for something else than the clock"]


def test_rejects_invalid_expression_and_failing_host(run):
    hangs = run("dies", says="(a+")
    assert hangs.returncode == 2 and "is not a regular expression" in hangs.stderr
    pathlib.Path("host.py").write_text("import sys\nsys.exit('no such bus')\n")
    dies = run("dies")
    assert dies.returncode == 2 and "even without a fault" in dies.stderr and "no such bus" in dies.stderr
    assert dies.stderr.count("\n") == 1 and not pathlib.Path("plan.db").exists()


@pytest.mark.parametrize("expression", ["^(a|aa)+$", "(a+)+$"])
def test_rejects_slow_expression(run, expression):
    pathlib.Path("host.py").write_text(HOST + f"print('{'a' * 1999}!')\n")
    done = run("well", says=expression)
    assert done.returncode == 2 and "takes too long" in done.stderr and done.stderr.count("\n") == 1


FUNCTION = """
calls = 0


def run_case(bus, clock, how):
    global calls
    calls += 1
    if calls > 1:
        print("error: this is not the first call")
    for n in range(1, 31):
        clock.advance(0.1)
        if any(one.first_effect_at_s is not None for one in clock.faults()):
            if how == "says":
                print("error: the joint does not move")
            if how == "returns":
                return 3
            if how == "raises":
                raise ValueError("no such angle: 361")
            if how == "dies":
                import os
                os.abort()
            while how == "computes":
                pass
"""


@pytest.fixture
def function(write):
    """Writes a plan whose host is a Python function."""

    def write_function(*hows, **more):
        write(*hows, **more)
        pathlib.Path("my_host.py").write_text(FUNCTION)
        plan = pathlib.Path("plan.toml")
        command = next(line for line in plan.read_text().splitlines() if line.startswith("command"))
        plan.write_text(plan.read_text().replace(command, 'python = "my_host.py"'))

    return write_function


def test_each_case_calls_function_in_new_process(function):
    function("well", "says", "returns", "raises", "dies")
    assert campaign("plan.toml", "-j", "1", "--quiet").returncode == 0
    assert [row["note"] for row in rows()] == [
        "exit status 0", "exit status 0; line 1 of [detect]", "exit status 3", "uncaught ValueError", "killed by SIGABRT",
    ]  # fmt: skip
    assert rows()[0]["outcome"] == "silently wrong" and rows()[1]["detected_by_host_ns"] == "1100000000"
    # --case computes a single case in a new process.
    assert "detected by the host" in campaign("plan.toml", "--case", "1").stdout
    assert "; exit status 0\n" in campaign("plan.toml", "--case", "0").stdout


def test_killed_function_does_not_end_the_next_case(function):
    function("computes", "says", timeout_s=3.5)
    assert campaign("plan.toml", "-j", "1", "--quiet").returncode == 0
    assert [row["note"] for row in rows()] == ["did not end within 3.5 s of processor time", "exit status 0; line 1 of [detect]"]


@pytest.mark.parametrize(
    "text, problem",
    [("import no_such_library\n", "No module named 'no_such_library'"), ("def other(bus, clock): pass\n", "has no function run_case(bus, clock)"),
     ("def run_case(bus): pass\n", "takes 1 parameters"), ("import os\nos._exit(5)\n", "ended with status 5"), ("x = (\n", "SyntaxError"),
     ("def run_case(bus, clock): pass\n", "unexpected keyword argument 'how'")],
)  # fmt: skip
def test_rejects_unusable_function(function, text, problem):
    function("well")
    pathlib.Path("my_host.py").write_text(text)
    done = campaign("plan.toml")
    assert done.returncode == 2 and problem in done.stderr and done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    "change, problem",
    [('clock = "realtime"', "must be stepped for host.python"), ('clock = "stepped"\npassive = "NO_STOP"', "host.passive: must be an environment"),
     ('clock = "stepped"\nmemory_MB = 1', "must be a number from 50 to 1e+06"), ('clock = "stepped"\nbus = "rs485"', "must be a CAN bus"),
     ('clock = "stepped"\ncommand = "true"', "does not go together with command")],
)  # fmt: skip
def test_rejects_invalid_host_table(function, change, problem):
    function("well")
    plan = pathlib.Path("plan.toml")
    plan.write_text(plan.read_text().replace('clock = "stepped"', change))
    done = campaign("plan.toml")
    assert done.returncode == 2 and problem in done.stderr and done.stderr.count("\n") == 1


def test_rejects_two_detections_in_one_table(write):
    write("well")
    plan = pathlib.Path("plan.toml")
    plan.write_text(plan.read_text().replace("exit_status = 3", 'exit_status = 3\nsays = "stop"'))
    done = campaign("plan.toml")
    assert done.returncode == 2 and "exit_status and says exclude each other" in done.stderr and done.stderr.count("\n") == 1


@pytest.mark.parametrize("option", ["--csv", "--candump"])
def test_rejects_signals_of_a_case_with_host(write, option):
    write("well")
    done = campaign("plan.toml", "--case", "0", option, "file")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"lk-emu: {option}: not possible with [host]: the case would run without the host program\n"


def test_rejects_placeholder_without_dimension(write):
    write("well")
    plan = pathlib.Path("plan.toml")
    plan.write_text(plan.read_text().replace("{host.how}", "{host.hwo}"))
    done = campaign("plan.toml")
    assert done.returncode == 2 and done.stderr == "lk-emu: plan.toml:10: host.command: no dimension has the name of {host.hwo}\n"


def test_changed_import_prevents_resume(function):
    function("well")
    pathlib.Path("helper.py").write_text("LIMIT = 1\n")
    pathlib.Path("my_host.py").write_text("import helper\n" + FUNCTION)
    assert campaign("plan.toml", "--quiet").returncode == 0
    pathlib.Path("helper.py").write_text("LIMIT = 2\n")
    done = campaign("plan.toml", "--resume")
    assert done.returncode == 2 and "plan, version or files of the plan differ" in done.stderr


SCENARIO = """
robot = "joint.toml"
duration_s = 3
[[expect]]
says = "it stays within its space"
id = 1
signal = "true_angle_deg"
max = 30
"""

# Turns the joint. Stops it at a fault unless passive, and otherwise at 1.1 s. With `how` "needs", the latter only
# happens without a fault; with "guards", only if not passive.
TURNING = """
import os
import struct
import can


def send(bus, command, value=0):
    bus.send(can.Message(arbitration_id=0x141, is_extended_id=False, data=struct.pack("<B3xi", command, value)))


def run_case(bus, clock, how):
    passive = "NO_STOP" in os.environ
    clock.advance(0.2)
    send(bus, 0xA2, 12000)  # 20 degrees a second behind the gear
    stopped = False
    for n in range(3, 29):
        clock.advance_to(0.1 * n)
        fault = any(one.first_effect_at_s is not None for one in clock.faults())
        if fault or how in ("alarms", "guards"):
            print("error: something is wrong")
        in_the_end = n == 11 and not (how == "needs" and fault) and not (how == "guards" and passive)
        if not stopped and ((fault and not passive) or in_the_end):
            send(bus, 0x81)
            stopped = True
"""

STOPPING_PLAN = """
scenario = "turns.toml"
sampling = "full"
[dimension]
fault.kind = "friction"
fault.id = 1
fault.at_s = 0.5
fault.friction.factor = 2
host.how = ["needs", "carefree", "alarms"]
[hazard]
expectations = ["it stays within its space"]
[host]
python = "my_host.py"
{more}
[detect]
drive = "none"
[[detect.host]]
says = "^error: "
"""


@pytest.fixture
def stopping(tmp_path, monkeypatch):
    """Runs a plan whose host prevents a hazard. Returns `all` of the JSON report."""
    monkeypatch.chdir(tmp_path)
    robot = pathlib.Path(__file__).parents[2] / "configs/scenarios/robots/joint.toml"
    (tmp_path / "joint.toml").write_text(robot.read_text())
    (tmp_path / "turns.toml").write_text(SCENARIO)
    (tmp_path / "my_host.py").write_text(TURNING)

    def run_plan(more, *lines):
        """`lines` replace those of the dimensions."""
        plan = STOPPING_PLAN.format(more=more)
        if lines:
            before, rest = plan.split("[dimension]\n")
            plan = before + "\n".join(["[dimension]", *lines, rest[rest.index("[hazard]") :]])
        (tmp_path / "plan.toml").write_text(plan)
        done = campaign("plan.toml", "--quiet", "--json", "report.json")
        assert done.returncode == 0, done.stderr
        return json.loads(pathlib.Path("report.json").read_text())["all"]

    return run_plan


def test_prevented_hazard_counts_as_dangerous_and_detected(stopping):
    found = stopping('passive = "NO_STOP=1"')
    assert [(row["outcome"], row["passive"]) for row in rows()] == [
        ("detected by the host", "dangerous"), ("detected by the host", "safe"), ("tolerated", ""),
    ]  # fmt: skip
    assert (found["coverage"]["detected"], found["coverage"]["dangerous"], found["coverage"]["share"]) == (1, 1, 1.0)
    assert (found["safe_detected"], found["safe_undetected"], found["false_alarms"]) == (1, 1, 1)


def test_case_of_kind_none_is_judged_alone(stopping):
    stopping("", 'fault.kind = ["none", "friction"]', "fault.id = 1", "fault.at_s = 0.5", "fault.friction.factor = 2", 'host.how = "carefree"')
    kinds = [(row["fault.kind"], row["fault.at_s"], row["first_effect_at_ns"] != "") for row in rows()]
    assert kinds == [("none", "", False), ("friction", "0.5", True)]


def test_rejects_hazardous_advice_without_host(write):
    write("well")
    plan = pathlib.Path("plan.toml")
    text = plan.read_text()
    plan.write_text(text[: text.index("[dimension]")] + "[dimension]\nfault.kind = 'jam'\nfault.at_s = 1\nfault.id = 1\n[hazard]\nadvice = true\n")
    done = campaign("plan.toml")
    assert done.returncode == 2 and "hazard.advice: needs [host]" in done.stderr and done.stderr.count("\n") == 1


def test_passive_host_also_runs_without_fault_dimension(stopping):
    found = stopping('passive = "NO_STOP=1"', 'host.how = ["guards", "alarms"]')
    assert [(row["outcome"], row["passive"]) for row in rows()] == [("detected by the host", "dangerous"), ("detected by the host", "safe")]
    assert (found["coverage"]["detected"], found["coverage"]["dangerous"]) == (1, 1)


def test_note_tells_that_real_time_host_may_have_missed_the_fault(stopping):
    plan = STOPPING_PLAN.format(more='clock = "realtime"').replace('"friction"', '"drop"').replace("fault.friction.factor = 2", "")
    plan = plan.replace("at_s = 0.5", "at_s = 0.1").replace('python = "my_host.py"', 'command = "true"')
    pathlib.Path("plan.toml").write_text(plan.replace('["needs", "carefree", "alarms"]', '["x"]'))
    done = campaign("plan.toml", "--quiet")
    assert done.returncode == 0, done.stderr
    assert [row["outcome"] for row in rows()] == ["not fired"]
    assert "the fault affected nothing from 0.1 s on: the host may have started later" in rows()[0]["note"]


def test_coverage_has_bounds_without_passive_host(stopping):
    found = stopping("")
    assert (found["coverage"]["dangerous"], found["coverage"]["open_in_time"]) == (0, 2)
    assert (found["coverage"]["share"], found["coverage"]["upper"]) == (None, 1.0)
    assert "2 more were detected without a hazard" in campaign("report", "plan.db").stdout


def test_dry_run_with_host_lists_faults_without_effect(stopping):
    stopping("")
    plan = pathlib.Path("plan.toml")
    plan.write_text(plan.read_text().replace('"friction"', '["friction", "drop"]').replace("0.5", "2.95"))
    pathlib.Path("my_host.py").write_text("def run_case(bus, clock, how):\n    clock.advance(0.1)\n")
    assert "took no effect" in campaign("plan.toml", "--dry-run").stdout.splitlines()[-1]
