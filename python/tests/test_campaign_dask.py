"""Campaigns on a dask scheduler with local worker processes. The environment variable LKEMU names the program."""

import json
import os
import pathlib
import shutil
import signal
import sqlite3
import subprocess
import sys
import time

import pytest

for library in ("distributed", "jinja2", "regex", "scipy"):
    pytest.importorskip(library)
if "LKEMU" not in os.environ:
    pytest.skip("LKEMU names no program", allow_module_level=True)

from lkemu.campaign.dask_runs import check_address
from lkemu.errors import StartError

PATIENCE_S = 120
PLAN = """
scenario = "joint_moves"
sampling = "random"
cases = 240
[dimension]
fault.kind = ["jam", "drop", "friction"]
fault.id = 1
fault.at_s = { from = 0.5, to = 4 }
fault.for_s = [0.1, 0.5, 2]
fault.jam.percent = { from = 5, to = 100 }
fault.friction.factor = { from = 1.5, to = 50 }
"""
HOST_PLAN = """
scenario = "joint_moves"
sampling = "full"
[dimension]
fault.kind = ["jam", "cut"]
fault.id = 1
fault.at_s = [1, 2]
[host]
command = ["{python}", "-c", "import lkemu; lkemu.attach().clock.advance_to(3)"]
clock = "stepped"
"""


def campaign(*words, check=True):
    done = subprocess.run([sys.executable, "-m", "lkemu.campaign", *map(str, words)], capture_output=True, text=True, timeout=300, check=False)
    if check:
        assert done.returncode == 0, done.stderr
    return done


def wait_until(condition, *processes):
    """Waits for the condition. Fails if a process exits first."""
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert all(process.poll() is None for process in processes) and time.monotonic() < deadline
        time.sleep(0.01)


class Cluster:
    def __init__(self, *words):
        self.processes, self.words = [], words
        self._start("dask_scheduler", "--port", "0", "--scheduler-file", "scheduler.json", *words)
        wait_until(lambda: pathlib.Path("scheduler.json").exists() and pathlib.Path("scheduler.json").read_text().endswith("}"), *self.processes)
        self.address = json.loads(pathlib.Path("scheduler.json").read_text())["address"]

    def _start(self, module, *words, **more):
        command = [sys.executable, "-m", f"distributed.cli.{module}", *words, "--host", "127.0.0.1", "--no-dashboard"]
        self.processes.append(subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, **more))
        return self.processes[-1]

    def start_worker(self, **environment):
        return self._start("dask_worker", self.address, "--nthreads", "1", "--no-nanny", "--local-directory", ".", *self.words, env={**os.environ, **environment})

    def end(self):
        for process in reversed(self.processes):
            process.kill()
            process.wait()


def has_workers(address):
    import distributed

    with distributed.Client(address, set_as_default=False) as client:
        return bool(client.nthreads())


@pytest.fixture(scope="module")
def local(tmp_path_factory):
    """Export of the plan, computed without dask."""
    folder = tmp_path_factory.mktemp("local")
    (folder / "plan.toml").write_text(PLAN)
    campaign(folder / "plan.toml", "-o", folder / "local.db", "--quiet")
    return campaign("export", folder / "local.db").stdout


@pytest.fixture
def cluster(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plan.toml").write_text(PLAN)
    cluster = Cluster()
    yield cluster
    cluster.end()


def rows(path):
    try:
        with sqlite3.connect(f"file:{path}?mode=ro", uri=True) as database:
            return database.execute("SELECT count(*) FROM cases").fetchone()[0]
    except sqlite3.OperationalError:
        return 0


def test_killed_worker_does_not_change_results(cluster, local):
    workers = [cluster.start_worker() for _ in range(2)]
    running = subprocess.Popen([sys.executable, "-m", "lkemu.campaign", "plan.toml", "-o", "dask.db", "--quiet", "--dask", cluster.address])
    wait_until(lambda: rows("dask.db") > 0, running, *workers)
    workers[0].send_signal(signal.SIGKILL)
    kept = rows("dask.db")
    assert running.wait(PATIENCE_S) == 0 and 0 < kept < 240
    assert campaign("export", "dask.db").stdout == local


def test_batch_with_killed_program_is_retried(cluster, local, tmp_path):
    dies_once = tmp_path / "lk-emu"
    dies_once.write_text(f"""#!/bin/sh
case "$*" in *--check*) ;; run*) [ -e {tmp_path}/died ] || {{ : > {tmp_path}/died; kill -9 $$; }};; esac
exec {os.environ["LKEMU"]} "$@"
""")
    dies_once.chmod(0o755)
    cluster.start_worker(LKEMU=str(dies_once))
    campaign("plan.toml", "-o", "dask.db", "--quiet", "--dask", cluster.address)
    assert (tmp_path / "died").exists() and campaign("export", "dask.db").stdout == local


def test_ctrl_c_keeps_results_for_resume(cluster, local):
    worker = cluster.start_worker()
    command = [sys.executable, "-m", "lkemu.campaign", "plan.toml", "-o", "dask.db", "--quiet", "--dask", cluster.address]
    running = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    wait_until(lambda: rows("dask.db") > 0, running, worker)
    running.send_signal(signal.SIGINT)
    errors = running.communicate(timeout=PATIENCE_S)[1]
    assert running.returncode == 130 and errors.count("\n") == 1 and f"--dask {cluster.address} --resume goes on" in errors
    assert 0 < rows("dask.db") < 240
    campaign(*command[3:], "--resume")
    assert campaign("export", "dask.db").stdout == local


def test_host_programs_run_on_workers(cluster):
    pathlib.Path("host.toml").write_text(HOST_PLAN.format(python=sys.executable))
    campaign("host.toml", "-o", "local.db", "--quiet")
    cluster.start_worker()
    campaign("host.toml", "-o", "dask.db", "--quiet", "--dask", cluster.address)
    assert campaign("export", "dask.db").stdout == campaign("export", "local.db").stdout


@pytest.mark.skipif(shutil.which("openssl") is None, reason="no openssl")
def test_documented_tls_setup_works(tmp_path, monkeypatch, local):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plan.toml").write_text(PLAN)
    subprocess.run("openssl req -x509 -newkey rsa:3072 -nodes -days 30 -subj /CN=campaign -keyout key.pem -out cert.pem".split(),
                   check=True, capture_output=True)  # fmt: skip
    cluster = Cluster("--protocol", "tls", *"--tls-ca-file cert.pem --tls-cert cert.pem --tls-key key.pem".split())
    try:
        cluster.start_worker()
        assert cluster.address.startswith("tls://127.0.0.1:")
        refused = campaign("plan.toml", "-o", "dask.db", "--quiet", "--dask", cluster.address, check=False)
        assert refused.returncode == 2 and refused.stderr.count("\n") == 1, "without a key"
        monkeypatch.setenv("DASK_DISTRIBUTED__COMM__TLS__CA_FILE", str(tmp_path / "cert.pem"))
        monkeypatch.setenv("DASK_DISTRIBUTED__COMM__TLS__CLIENT__CERT", str(tmp_path / "cert.pem"))
        monkeypatch.setenv("DASK_DISTRIBUTED__COMM__TLS__CLIENT__KEY", str(tmp_path / "key.pem"))
        campaign("plan.toml", "-o", "dask.db", "--quiet", "--dask", cluster.address)
    finally:
        cluster.end()
    assert campaign("export", "dask.db").stdout == local


def test_rejects_worker_without_package(cluster, tmp_path):
    (tmp_path / "other" / "lkemu").mkdir(parents=True)
    (tmp_path / "other" / "lkemu" / "__init__.py").write_text("raise ModuleNotFoundError(\"No module named 'lkemu'\", name='lkemu')\n")
    worker = cluster.start_worker(PYTHONPATH=str(tmp_path / "other"))
    wait_until(lambda: has_workers(cluster.address), worker)
    done = campaign("plan.toml", "--dask", cluster.address, check=False)
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and "No module named 'lkemu'" in done.stderr, done.stderr
    assert not pathlib.Path("plan.db").exists()


@pytest.mark.parametrize("when", ["before", "later"])
def test_rejects_worker_with_another_version(cluster, when, tmp_path):
    other = tmp_path / "lk-emu"
    other.write_text(f'#!/bin/sh\n[ "$1" = --version ] && echo lk-emu 0.0.1 && exit\nexec {os.environ["LKEMU"]} "$@"\n')
    other.chmod(0o755)
    command = [sys.executable, "-m", "lkemu.campaign", "plan.toml", "--quiet", "--dask", cluster.address]
    if when == "before":
        worker = cluster.start_worker(LKEMU=str(other))
        wait_until(lambda: has_workers(cluster.address), worker)
        running = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    else:
        worker = cluster.start_worker()
        running = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        wait_until(lambda: rows("plan.db") > 0, running, worker)
        cluster.start_worker(LKEMU=str(other))
        worker.kill()
    errors = running.communicate(timeout=PATIENCE_S)[1]
    assert running.returncode == 2 and errors.count("\n") == 1, errors
    assert errors.startswith("lk-emu: --dask: worker ") and "another lk-emu than the campaign (it has 0.0.1)" in errors
    assert (when == "before") != pathlib.Path("plan.db").exists()


@pytest.mark.parametrize("address", ["10.0.0.1:8786", "tcp://example.org:8786", "inproc://127.0.0.1:8786", "127.0.0.1.example.org:8786"])
def test_rejects_plain_tcp_addresses(address):
    with pytest.raises(StartError, match="is neither loopback nor tls://"):
        check_address(address)


@pytest.mark.parametrize("address", ["localhost", "127.0.0.1:port", "tls://host", ""])
def test_rejects_malformed_addresses(address):
    with pytest.raises(StartError, match="is not an address like 127.0.0.1:8786"):
        check_address(address)


def test_accepts_loopback_and_tls():
    assert [check_address(one) for one in ("127.0.0.1:1", "localhost:1", "tcp://[::1]:1", "tls://10.0.0.1:1")] == [
        "tcp://127.0.0.1:1", "tcp://localhost:1", "tcp://[::1]:1", "tls://10.0.0.1:1"]  # fmt: skip


@pytest.mark.parametrize("address, problem", [("10.0.0.1:8786", "is neither loopback nor tls://"), ("127.0.0.1:1", "no scheduler answers")])
def test_rejected_address_prints_one_line(tmp_path, monkeypatch, address, problem):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plan.toml").write_text(PLAN)
    done = campaign("plan.toml", "--dask", address, check=False)
    assert done.returncode == 2 and problem in done.stderr and done.stderr.count("\n") == 1, done.stderr
    assert not (tmp_path / "plan.db").exists()


def test_error_names_missing_library(tmp_path):
    (tmp_path / "plan.toml").write_text(PLAN)
    code = "import runpy, sys; sys.modules['distributed'] = None; runpy.run_module('lkemu.campaign', run_name='__main__', alter_sys=True)"
    command = [sys.executable, "-c", code, str(tmp_path / "plan.toml"), "--dask", "127.0.0.1:1"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert "apt install python3-distributed" in done.stderr and "lk-emu[campaign-dask]" in done.stderr
