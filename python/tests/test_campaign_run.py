"""Campaigns without a host program. The environment variable LKEMU names the program."""

import os
import pathlib
import signal
import sqlite3
import subprocess
import sys
import time

import pytest

pytest.importorskip("scipy")
pytest.importorskip("jinja2")
if "LKEMU" not in os.environ:
    pytest.skip("LKEMU names no program", allow_module_level=True)

PLAN = """
scenario = "joint_moves"
sampling = "random"
cases = {cases}
tolerant_time_s = 0.2
[dimension]
fault.kind = ["jam", "cut", "drop", "hang", "id_changed"]
fault.id = 1
fault.at_s = {{ from = 0.5, to = 4 }}
fault.for_s = [0.1, 0.5, 2]
fault.id_changed.new_id = 2
supply_V = [23, 24]
[hazard]
expectations = ["it never leaves its space"]
"""


def campaign(*words, check=True, **more):
    done = subprocess.run([sys.executable, "-m", "lkemu.campaign", *map(str, words)], capture_output=True, text=True, timeout=300, **more)
    if check:
        assert done.returncode == 0, done.stderr
    return done


@pytest.fixture
def plan(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "plan.toml"
    path.write_text(PLAN.format(cases=40))
    return path


def export(results):
    return campaign("export", results).stdout


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    """Export of the plan, computed by one job."""
    folder = tmp_path_factory.mktemp("whole")
    (folder / "plan.toml").write_text(PLAN.format(cases=40))
    campaign("plan.toml", "-j", "1", "--quiet", cwd=folder)
    return campaign("export", "plan.db", cwd=folder).stdout


def test_export_does_not_depend_on_jobs_or_shards(plan, reference):
    assert reference.count("\n") == 41
    campaign(plan, "-j", "2", "-o", "two.db", "--quiet")
    assert export("two.db") == reference
    for n in range(3):
        campaign(plan, "-o", f"part{n}.db", "--shard", f"{n}/3", "--quiet")
    assert campaign("merge", "-o", "merged.db", "part0.db", "part1.db", "part2.db").stdout == "merged.db: 40 of 40 cases\n"
    assert export("merged.db") == reference


def test_merge_lists_missing_shards(plan):
    for n in (0, 2):
        campaign(plan, "-o", f"part{n}.db", "--shard", f"{n}/3", "--quiet")
    done = campaign("merge", "-o", "some.db", "part0.db", "part2.db", check=False)
    assert (done.returncode, done.stdout) == (1, "some.db: 27 of 40 cases; missing: shard 1/3\n")
    assert campaign("merge", "-o", "some.db", "part0.db", check=False).returncode == 2, "nothing is overwritten"


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM])
def test_resume_after_kill_gives_same_export(plan, reference, how):
    command = [sys.executable, "-m", "lkemu.campaign", str(plan), "-j", "1", "-o", "night.db", "--quiet"]
    running = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    while running.poll() is None and not rows("night.db"):
        time.sleep(0.01)  # polling period
    running.send_signal(how)
    errors = running.communicate()[1]
    if how == signal.SIGTERM and running.returncode == 130:
        assert "--resume goes on" in errors
    kept = rows("night.db")
    assert kept > 0
    assert campaign(plan, "-o", "night.db", "--quiet", check=False).returncode == 2, "without --resume nothing is overwritten"
    campaign(plan, "-o", "night.db", "--resume", "--quiet")
    assert export("night.db") == reference


def rows(path):
    if not pathlib.Path(path).exists():
        return 0
    with sqlite3.connect(path) as database:
        try:
            return database.execute("SELECT count(*) FROM cases").fetchone()[0]
        except sqlite3.OperationalError:
            return 0


def test_writes_reports_and_checks_requirements(plan):
    campaign(plan, "-o", "night.db", "--quiet")
    done = campaign("report", "night.db", "--html", "night.html", "--json", "night.json", "--junit", "night.xml", "--require", "crash<=0")
    assert "holds: crash<=0: measured 0" in done.stdout
    assert campaign("report", "night.db", "--require", "not_fired<=-0", "--require", "tolerated<=0", check=False).returncode == 1
    assert "<h1>plan</h1>" in pathlib.Path("night.html").read_text()
    assert campaign("compare", "night.db", "night.db").stdout == "0 worse, 0 better, 40 the same\n"


@pytest.mark.parametrize(
    "change, problem",
    [
        (("fault.for_s", "fault.four_s"), "unknown dimension, did you mean fault.for_s?"),
        (("[0.1, 0.5, 2]", "[]"), "dimension.fault.for_s: is empty"),
        (("from = 0.5, to = 4", "from = 4, to = 0.5"), "the range is empty: to must be above from"),
        (('"jam"', '"jan"'), '"jan" is unknown, did you mean jam?'),
        (("never leaves", "always leaves"), "the scenario has no expectation that says"),
        (('"random"', '"adaptive"'), "must be one of full, random, latin, pairwise"),
        (("joint_moves", "joint_move"), "joint_move"),
        (("fault.id_changed.new_id = 2\n", ""), '"fault.id_changed.new_id" is required'),
    ],
)
def test_invalid_plan_prints_one_line(plan, change, problem):
    plan.write_text(plan.read_text().replace(*change))
    done = campaign(plan, check=False)
    assert done.returncode == 2 and problem in done.stderr
    assert done.stderr.count("\n") == 1 and done.stderr.startswith("lk-emu: ")
    assert not pathlib.Path("plan.db").exists()


@pytest.mark.parametrize(
    "options, problem",
    [
        (("--html", "none/night.html"), "no such directory: none"),
        (("--json", "."), ". is a directory"),
        (("--html", "plan.toml"), "plan.toml is also the plan"),
        (("-o", "a.db", "--json", "./a.db"), "is also the file of the results"),
        (("--html", "a", "--json", "a"), "a is also for --html"),
        (("--require", "coverage"), "MEASURE>=NUMBER"),
        (("--shard", "3/3"), '"3/3" is not a shard'),
        (("--resume", "--case", "1"), "does not go together with --case"),
        (("--csv", "a.csv"), "belongs to --case"),
        (("--case", "40"), "is not one of the 40"),
    ],
)
def test_rejects_invalid_options_before_running(plan, options, problem):
    done = campaign(plan, *options, check=False)
    assert done.returncode == 2 and problem in done.stderr and done.stderr.count("\n") == 1
    assert plan.read_text() == PLAN.format(cases=40) and not list(plan.parent.glob("*.db"))


def test_reruns_one_case(plan):
    campaign(plan, "--quiet")
    row = export("plan.db").splitlines()[8].split(",")
    done = campaign(plan, "--case", row[0], "--csv", "case.csv", "--signals", "true_angle_deg", "--candump", "case.log", "--scenario", "case.toml")
    assert done.stdout.startswith(f"case {row[0]}: ") and row[7] in done.stdout.splitlines()[0]
    assert pathlib.Path("case.csv").read_text().startswith("time_s,1.true_angle_deg\n") and "141#" in pathlib.Path("case.log").read_text()
    changed = campaign(plan, "--case", row[0], "--set", "fault.at_s=3.5").stdout
    assert "fault.at_s=3.5" in changed


def test_dry_run_prints_cost_and_faults_without_effect(plan):
    plan.write_text(plan.read_text().replace('"jam", ', '"jam", "rom_worn", '))
    output = campaign(plan, "--dry-run").stdout
    assert output.startswith("plan: 40 cases, sampling random, scenario joint_moves\n")
    assert "cases/s" in output and "took no effect" in output and "rom_worn" in output.splitlines()[-1]
    assert not pathlib.Path("plan.db").exists()


def test_rejects_resume_or_merge_of_another_plan(plan):
    campaign(plan, "-o", "old.db", "--quiet", "--shard", "0/8")
    plan.write_text(plan.read_text() + "[detect]\ndrive = \"none\"\n")
    assert "plan, version or files of the plan differ" in campaign(plan, "-o", "old.db", "--resume", check=False).stderr
    campaign(plan, "-o", "new.db", "--quiet", "--shard", "1/8")
    assert campaign("merge", "-o", "both.db", "old.db", "new.db", check=False).returncode == 2


@pytest.mark.parametrize("damage", ["UPDATE campaign SET numbers = 1000000000000000000", "UPDATE cases SET outcome = 'fine'",
                                    "UPDATE cases SET note = printf('%.*c', 2000000, 'x')", "DROP TABLE shards",
                                    "CREATE TRIGGER more AFTER INSERT ON shards BEGIN DELETE FROM cases; END"])  # fmt: skip
def test_rejects_damaged_results(plan, damage):
    campaign(plan, "-o", "night.db", "--quiet", "--shard", "0/8")
    with sqlite3.connect("night.db") as database:
        database.execute(damage)
    done = campaign("report", "night.db", check=False)
    assert done.returncode == 2 and "damaged" in done.stderr and done.stderr.count("\n") == 1
