"""The scenario of the campaign no_lunge with correct hosts, and with hosts that have one bug each (lunging_hosts.py)."""

import csv
import json
import os
import pathlib
import subprocess
import sys

import pytest

pytest.importorskip("scipy")
pytest.importorskip("jinja2")
if "LKEMU" not in os.environ:
    pytest.skip("LKEMU names no program", allow_module_level=True)

TESTS = pathlib.Path(__file__).parent
CAMPAIGNS = TESTS.parents[1] / "configs/campaigns"
sys.path.insert(0, str(CAMPAIGNS))
from lunging_hosts import BUGS, CORRECT  # noqa: E402

KINDS = ["none", "no_ack", "delay", "sag", "voltage_stuck"]
PLAN = f"""
scenario = "{CAMPAIGNS}/bases/no_lunge.toml"
sampling = "full"
[dimension]
host.recovery = "clear"
host.kind = {json.dumps([*BUGS, *CORRECT])}
fault.kind = {json.dumps(KINDS)}
fault.at_s = 1.8
fault.for_s = [0.03, 0.5]
fault.id = 1
fault.delay.delay_ms = 30
fault.sag.to_V = 5
fault.voltage_stuck.value_V = 5
[[exclude]]
fault.kind = "delay"
fault.for_s = 0.5
[[exclude]]
fault.kind = ["no_ack", "sag", "voltage_stuck"]
fault.for_s = 0.03
[hazard]
advice = true
[host]
python = "{TESTS}/lunging_hosts.py"
bus = "socketcand"
clock = "stepped"
[detect]
drive = "none"
"""

# A kind of fault that shows the bug, and a part of what fails then.
SHOWN_BY = {
    "old_target": ("voltage_stuck", "lunge"), "after_lost_input": ("no_ack", "lunge"), "over_power_cycle": ("sag", "lunge"),
    "resumes_by_run": ("none", "since 0x81"), "first_zero": ("none", "first-target-zero"), "backlog": ("no_ack", "stale-backlog"),
    "wrapped": ("none", "target-wrapped"), "shifted": ("delay", "first-target-zero"), "brake_first": ("none", "does not drop"),
    "speed_left": ("no_ack", "unasked motion"),
}  # fmt: skip


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    folder = tmp_path_factory.mktemp("no_lunge")
    (folder / "plan.toml").write_text(PLAN, "utf-8")

    def campaign(*words):
        environment = {**os.environ, "PYTHONPATH": f"{TESTS.parent}:{CAMPAIGNS}"}
        done = subprocess.run([sys.executable, "-m", "lkemu.campaign", *words], capture_output=True, text=True, cwd=folder, timeout=500,
                              check=False, env=environment)  # fmt: skip
        assert done.returncode == 0, done.stderr
        return done.stdout

    campaign("plan.toml", "--quiet")
    return list(csv.DictReader(campaign("export", "plan.db").splitlines()))


@pytest.mark.parametrize("bug", BUGS)
def test_finds_each_bug(rows, bug):
    kind, what = SHOWN_BY[bug]
    violated = [row["violated"] for row in rows if (row["host.kind"], row["fault.kind"]) == (bug, kind)]
    assert any(what in one for one in violated), violated


def test_correct_hosts_pass(rows):
    of_correct = [row for row in rows if row["host.kind"] in CORRECT]
    assert len(of_correct) == len(CORRECT) * len(KINDS)
    assert [row for row in of_correct if row["outcome"] != "tolerated"] == [], "no hazard, and each fault has an effect"
