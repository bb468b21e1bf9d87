"""Runs cases with a host program, one after the other: `python3 -m lkemu.campaign.host_worker`.

Reads one JSON object per line from standard input and writes one per line to standard output.

There are two processes: a worker and its parent. If standard input is closed or the worker exits, the parent kills
the worker and all processes of the case. If the parent exits, the worker kills them. So a kill of any one process
leaves none behind.
"""

from __future__ import annotations

import json
import os
import select
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from selectors import EVENT_READ, DefaultSelector
from typing import Any, Dict, List, NoReturn, Optional, Union

from ..client import Client
from ..errors import Ended, Error, StartError
from .host_bus import HostBus
from .host_limits import Exceeded, Limits
from .host_output import EXIT_STATUS, Notice, Output, notices_json
from .host_processes import adopt_orphans, end_descendants, end_with_parent, enter_own_network
from .host_relay import Relay
from .host_start import FunctionHost, FunctionProcess, ProgramHost

START_S = 60.0  # lk-emu may start slowly on a busy machine
ANSWER_S = 600.0  # before it answers, lk-emu may compute the rest of a scenario

# Times of the control interface are rounded, so the scenario may end slightly later than computed.
BEYOND_END_S = 0.001
MAX_DIRECTORY = 50  # characters, as bus names contain the path of a terminal in it
OUTSIDE = (signal.SIGKILL, signal.SIGTERM)  # signals of kills from outside


class MachineFailed(Exception):
    """The case has no result: a process that it needs was killed from outside or did not answer."""


class Abandoned(BaseException):
    """The parent of the worker has exited."""


class Case:
    """One case, from the start of lk-emu to the verdict."""

    def __init__(self, task: Dict[str, Any], directory: str, functions: Optional[FunctionProcess]) -> None:
        self.task, self.directory, self.functions = task, directory, functions
        self.selector = DefaultSelector()
        self.bus = HostBus(task["bus"], directory)
        self.control = os.path.join(directory, "control")
        self.client = Client(self.control, ANSWER_S, Ended)
        self.output = Output(task["lines"], self.now_ns)
        self.began_s = 0.0

    @property
    def excluded(self) -> List[int]:
        """Processes that outlive the case."""
        return [] if self.functions is None else [self.functions.pid]

    # lk-emu

    def run(self) -> Dict[str, Any]:
        if self.task["bus"] == "vcan":
            enter_own_network()
        log = os.path.join(self.directory, "log")
        with open(log, "wb") as errors:
            emulator = subprocess.Popen(self._emulator_command(), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors,
                                        preexec_fn=end_with_parent)  # fmt: skip
        with emulator:
            try:
                self._wait_ready(emulator)
                return self._run_host(emulator)
            except Ended as problem:
                status = emulator.wait()
                if status == 0 or -status in OUTSIDE:  # 0: lk-emu handles SIGTERM
                    raise MachineFailed("lk-emu was killed from outside") from None
                raise StartError(_last_line(log) or f"lk-emu ended with status {status}: {problem}") from None
            except Error as problem:
                if isinstance(problem, StartError):
                    raise
                raise MachineFailed(str(problem)) from None  # no answer in time
            finally:
                end_descendants(self.excluded)
                self._close()

    def _close(self) -> None:
        self.bus.close()
        self.client.close()
        for key in list(self.selector.get_map().values()):
            if isinstance(key.fileobj, socket.socket):
                key.fileobj.close()
            else:
                os.close(key.fd)
        self.selector.close()

    def _emulator_command(self) -> List[str]:
        task = self.task
        words = [task["program"], "--rom", ":memory:", "--control", self.control, "--clock", "stepped" if task["stepped"] else "realtime",
                 "--log-level", "error", "--end-with-stdin", "--bus", self.bus.name]  # fmt: skip
        if task["bus"] == "vcan":
            words.append("--create-bus")
        words += ["--config", task["robot"]] if task["robot"] else ["--ids", "1"]
        for key in ("generation", "seed", "bitrate"):
            if task[key] is not None:
                words += [f"--{key}", str(task[key])]
        return words

    def _wait_ready(self, emulator: "subprocess.Popen[bytes]") -> None:
        assert emulator.stdout is not None
        printed = b""
        deadline = time.monotonic() + START_S
        with DefaultSelector() as selector:
            selector.register(emulator.stdout, EVENT_READ)
            while b"lk-emu ready" not in printed:
                if not selector.select(max(deadline - time.monotonic(), 0)):
                    raise MachineFailed(f"lk-emu was not ready within {START_S:g} s")
                data = os.read(emulator.stdout.fileno(), 4096)
                if not data:
                    raise Ended("lk-emu did not start")
                printed += data

    def now_ns(self) -> int:
        """Time since the start of the scenario. The clock's resolution is 1 µs."""
        return round((self.client.get("/clock")["time_s"] - self.began_s) * 1e6) * 1000

    # The host

    def _run_host(self, emulator: "subprocess.Popen[bytes]") -> Dict[str, Any]:
        task = self.task
        scenario = os.path.join(self.directory, f"case-{task['case']}.toml")
        with open(scenario, "w", encoding="utf-8") as file:
            file.write(task["scenario"])
        self.client.post("/scenario", {"file": scenario})
        self.began_s = float(self.client.get("/scenario")["buses"][0]["started_s"])
        relay = None
        if task["stepped"]:
            relay = Relay(os.path.join(self.directory, "host"), self.control, self.selector, self._read_output,
                          self.began_s + task["timeout_s"])  # fmt: skip
        limits = Limits(task, self.output, relay, emulator.pid, self.excluded)
        read_end, write_end = os.pipe()
        self.output_pipe: Optional[int] = read_end
        os.set_blocking(read_end, False)
        self.selector.register(read_end, EVENT_READ, self._read_output)
        started = time.monotonic()
        host = self._start_host(relay.path if relay else "", write_end)
        os.close(write_end)
        exceeded, status = self._wait_for(host, emulator, limits)
        wall_s = time.monotonic() - started
        self._read_output()
        ended_ns = self.now_ns()
        end_descendants([emulator.pid, *self.excluded])
        host.reap()
        self._read_output()
        self.output.finish()
        end, number = "exit", os.waitstatus_to_exitcode(status)
        if exceeded is not None:
            end, number = exceeded.kind, 0
        elif number < 0:
            end, number = "signal", -number
        notices = list(self.output.notices)
        if end == "exit" and number in task["exit_status"]:
            text = f"exit status {number}"
            notices.append(Notice(ended_ns, text, EXIT_STATUS, text))
        return {"case": task["case"], "end": end, "status": number, "why": exceeded.why if exceeded else "", "ended_ns": ended_ns,
                "was_idle": limits.was_idle,
                "notices": notices_json(notices), "wall_s": wall_s, "exception": self.output.exception,
                "exception_is_known": self.output.exception_is_known,
                "output": self.output.tail.decode(errors="replace"), "verdict": self._verdict()}  # fmt: skip

    def _start_host(self, relay: str, out: int) -> "Union[ProgramHost, FunctionHost]":
        task = self.task
        environment = {**self.bus.environment(), "LKEMU_CASE": str(task["case"]), "PYTHONUNBUFFERED": "1", **task["environment"]}
        if relay:
            environment["LKEMU_CONTROL"] = relay
        if self.functions is not None:
            return self.functions.start(environment, task["host_values"], out)
        values = {"bus": self.bus.name, "channel": self.bus.channel, "port": self.bus.port, "control": relay, "case": str(task["case"]),
                  **{f"host.{name}": value for name, value in task["host_values"].items()}}  # fmt: skip
        return ProgramHost([_fill_in(word, values) for word in task["command"]], task["directory"], environment, out)

    def _wait_for(
        self, host: "Union[ProgramHost, FunctionHost]", emulator: "subprocess.Popen[bytes]", limits: Limits
    ) -> "tuple[Optional[Exceeded], int]":
        """Returns the limit that the host exceeded, or its status as of waitpid()."""
        emulator_ended = os.pidfd_open(emulator.pid)
        self.selector.register(host, EVENT_READ, None)
        self.selector.register(emulator_ended, EVENT_READ, None)
        try:
            while True:
                exceeded = limits.check()
                if exceeded is not None:
                    return exceeded, 0
                ended = [self._handle(key) for key, _ in self.selector.select(limits.until_next_sample_s)]
                if emulator_ended in ended:
                    raise Ended("lk-emu ended")
                if host.fileno() in ended:  # by now its earlier output and requests are handled
                    status, memory = host.finish()
                    return limits.at_end(memory), status
        except EOFError:
            raise MachineFailed("the process of host.python was killed from outside") from None
        finally:
            self.selector.unregister(host)
            self.selector.unregister(emulator_ended)
            os.close(emulator_ended)

    @staticmethod
    def _handle(key: Any) -> int:
        if key.data is None:
            return int(key.fd)
        key.data()
        return -1

    def _read_output(self) -> None:
        for _ in range(32):  # enough for a full pipe; bounded, since a host may write without end
            if self.output_pipe is None:
                return
            try:
                data = os.read(self.output_pipe, 1 << 16)
            except BlockingIOError:
                return
            if not data:
                self.selector.unregister(self.output_pipe)
                os.close(self.output_pipe)
                self.output_pipe = None
                return
            self.output.take(data)

    # The verdict

    def _verdict(self) -> Any:
        """Computes the rest of the scenario as fast as possible and returns the verdict."""
        slipped_s = self.client.get("/clock")["slipped_s"]
        if not self.task["stepped"]:
            self.client.request("PUT", "/clock", {"mode": "stepped"})
        state = self.client.get("/scenario")
        if state["state"] == "running":
            self.client.post("/clock/advance", {"to_s": self.began_s + state["duration_s"] + BEYOND_END_S})
        verdict = self.client.request("DELETE", "/scenario")
        verdict["slipped_s"] = slipped_s
        verdict["advice"] = [{**one, "at_s": one["first_s"] - self.began_s} for one in self.client.get("/advice")]
        return verdict


def _fill_in(word: str, values: Dict[str, str]) -> str:
    for name, value in values.items():
        word = word.replace("{" + name + "}", value)
    return word


def _last_line(path: str) -> str:
    with open(path, encoding="utf-8", errors="replace") as file:
        lines = [line.strip() for line in file if line.strip()]
    return lines[-1].removeprefix("lk-emu: ") if lines else ""


class Worker:
    def __init__(self, directory: str) -> None:
        self._directory = directory
        self._functions: Optional[FunctionProcess] = None

    def run(self, task: Dict[str, Any]) -> Dict[str, Any]:
        directory = tempfile.mkdtemp(dir=self._directory)
        try:
            if task["python"] and (self._functions is None or not self._functions.is_alive):
                self._functions = FunctionProcess(task["python"], task["directory"])
            return Case(task, directory, self._functions).run()
        except MachineFailed as problem:
            return {"case": task["case"], "failed": str(problem)}
        except Error as problem:
            return {"case": task["case"], "error": str(problem)}
        finally:
            shutil.rmtree(directory, ignore_errors=True)


def work(directory: str) -> None:
    adopt_orphans()
    signal.signal(signal.SIGTERM, _abandon)
    end_with_parent(signal.SIGTERM)
    worker = Worker(directory)
    try:
        for line in sys.stdin.buffer:
            os.write(sys.stdout.fileno(), json.dumps(worker.run(json.loads(line))).encode() + b"\n")
    except (Abandoned, BrokenPipeError):
        pass
    finally:
        end_descendants()
        shutil.rmtree(directory, ignore_errors=True)


def _abandon(*_: object) -> NoReturn:
    raise Abandoned


def main() -> None:
    adopt_orphans()
    os.setsid()  # Ctrl-C must reach only the campaign, which then closes standard input
    above = tempfile.gettempdir()
    directory = tempfile.mkdtemp(prefix="lk-", dir=above if len(above) <= MAX_DIRECTORY else "/tmp")
    worker = os.fork()
    if worker == 0:
        try:
            work(directory)
        finally:
            os._exit(0)
    os.close(sys.stdout.fileno())
    poll = select.poll()
    poll.register(sys.stdin.fileno(), 0)  # reports POLLHUP when closed
    poll.register(os.pidfd_open(worker), select.POLLIN)
    poll.poll()
    end_descendants()
    shutil.rmtree(directory, ignore_errors=True)


if __name__ == "__main__":
    main()
