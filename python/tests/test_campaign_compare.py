"""`lk-emu campaign compare` with two hosts. The environment variable LKEMU names the program."""

import json
import os
import pathlib
import subprocess
import sys

import pytest

for library in ("can", "jinja2", "regex", "scipy"):
    pytest.importorskip(library)
if "LKEMU" not in os.environ:
    pytest.skip("LKEMU names no program", allow_module_level=True)

# Reads the temperature (second byte of the reply to 0x9A) and switches the drive off (0x80) above 90 degrees Celsius.
HOST = """
import can, lkemu

attached = lkemu.attach()
bus = attached.open()
for _ in range(20):
    attached.sleep(0.1)
    bus.send(can.Message(arbitration_id=0x141, data=[0x9A, 0, 0, 0, 0, 0, 0, 0], is_extended_id=False))
    hot = False
    while (reply := bus.recv(0.005)) is not None:
        hot = hot or (reply.data[0] == 0x9A and reply.data[1] > 90)
    if hot:
        print("error: too hot")
        bus.send(can.Message(arbitration_id=0x141, data=[0x80, 0, 0, 0, 0, 0, 0, 0], is_extended_id=False))
        break
bus.shutdown()
"""
STOP = HOST[HOST.index("    if hot") : HOST.index("bus.shutdown")]
PLAN = f"""
scenario = "joint_moves"
sampling = "full"
[dimension]
fault.kind = "temperature_stuck"
fault.id = 1
fault.at_s = [0.55, 1.05]
fault.temperature_stuck.value_C = 110
[host]
command = ["{sys.executable}", "host.py"]
clock = "stepped"
[detect]
drive = "none"
[[detect.host]]
says = '^error: '
"""


def campaign(*words):
    return subprocess.run([sys.executable, "-m", "lkemu.campaign", *words], capture_output=True, text=True, timeout=300, check=False)


def test_removed_over_temperature_stop_is_worse(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    pathlib.Path("plan.toml").write_text(PLAN)
    for name, host in (("before", HOST), ("now", HOST.replace(STOP, ""))):
        pathlib.Path("host.py").write_text(host)
        done = campaign("plan.toml", "-o", f"{name}.db", "--quiet")
        assert done.returncode == 0, done.stderr
    done = campaign("compare", "before.db", "now.db", "--json", "worse.json", "--html", "worse.html")
    assert done.returncode == 1 and done.stdout.startswith("2 worse, 0 better, 0 the same\n  2 detected by the host -> silently wrong\n"), done.stdout
    data = json.loads(pathlib.Path("worse.json").read_text())
    assert data["worse"] == 2 and [one["before"] for one in data["cases"]] == ["detected_by_host"] * 2
    assert "2 worse, 0 better" in pathlib.Path("worse.html").read_text()
    assert campaign("compare", "now.db", "before.db").returncode == 0, "better"
    assert campaign("compare", "now.db", "plan.toml").returncode == 2
    assert campaign("compare", "now.db", "before.db", "--html", "now.db").stderr.count("is also the file of results before") == 1
