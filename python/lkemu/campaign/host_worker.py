"""Runs cases with a host program, one after the other: `python3 -m lkemu.campaign.host_worker`.

Reads a JSON object per line on standard input, writes one per line on standard output. All that a case has started
ends with it, and with this process, which ends when its standard input does.
"""

from __future__ import annotations

import ctypes
import json
import os
import selectors
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from typing import Any, Dict, List, Optional, Set

from ..client import Client
from ..errors import Ended, Error, StartError
from .host_bus import HostBus
from .host_output import EXIT_STATUS, Notice, Output, notices_json

START_S = 60.0  # a machine with much to do may take long to start lk-emu
ANSWER_S = 600.0  # the rest of a long scenario may have to pass before an answer
BEYOND_END_S = 0.001  # times of the control interface are rounded, so the last instant may be later
WALL_FACTOR = 10.0  # a stepped host that computes is given so many times its timeout_s of wall time
GLANCE_S = 1.0  # between two looks at the processor time of a stepped host
MAX_DIRECTORY = 60  # characters: the path of a terminal in it has to fit into the name of a bus
PR_SET_PDEATHSIG, PR_SET_CHILD_SUBREAPER = 1, 36
CLONE_NEWUSER, CLONE_NEWNET = 0x10000000, 0x40000000

libc = ctypes.CDLL(None, use_errno=True)


class Abandoned(Exception):
    """The campaign has ended."""


def children_of(parent: int) -> List[int]:
    found = []
    for name in os.listdir("/proc"):
        if name.isdecimal() and _stat(int(name))[1:2] == [str(parent)]:
            found.append(int(name))
    return found


def _stat(pid: int) -> List[str]:
    """The fields of /proc/PID/stat behind the name: state, parent, …"""
    try:
        with open(f"/proc/{pid}/stat", encoding="ascii", errors="replace") as file:
            return file.read().rpartition(")")[2].split()
    except OSError:
        return []


def end_children(spared: Set[int]) -> None:
    """Kills all children, then what has become one of ours because its parent ended, until there are none."""
    while children := [pid for pid in children_of(os.getpid()) if pid not in spared]:
        for pid in children:
            try:
                os.kill(pid, signal.SIGKILL)
                os.waitpid(pid, 0)
            except (ProcessLookupError, ChildProcessError):
                pass


def processor_time_s(pid: int) -> float:
    """Of a process, its descendants and those of its children that have ended."""
    fields = _stat(pid)
    own = sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK") if len(fields) > 15 else 0.0
    return own + sum(processor_time_s(child) for child in children_of(pid))


def enter_own_network() -> None:
    if libc.unshare(CLONE_NEWNET) == 0:
        return
    user, group = os.geteuid(), os.getegid()
    if libc.unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0:
        raise StartError(f"no network of its own: {os.strerror(ctypes.get_errno())}; run the campaign under scripts/with-vcan, or say "
                         'bus = "slcan-tcp"')  # fmt: skip
    for file, text in (("setgroups", "deny"), ("uid_map", f"0 {user} 1\n"), ("gid_map", f"0 {group} 1\n")):
        with open(f"/proc/self/{file}", "w", encoding="ascii") as out:
            out.write(text)


def die_with_parent() -> None:
    libc.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    signal.pthread_sigmask(signal.SIG_SETMASK, [])


class Case:
    """One case from its start to its verdict."""

    def __init__(self, task: Dict[str, Any], directory: str) -> None:
        self.task, self.directory = task, directory
        self.selector = selectors.DefaultSelector()
        self.selector.register(sys.stdin.fileno(), selectors.EVENT_READ, self._campaign_ended)
        self.bus = HostBus(task["bus"], directory)
        self.control = os.path.join(directory, "control")
        self.client = Client(self.control, ANSWER_S, Ended)
        self.output = Output(task["lines"], self.now_ns)
        self.began_s = 0.0

    # lk-emu

    def run(self) -> Dict[str, Any]:
        if self.task["bus"] == "vcan":
            enter_own_network()
        log = os.path.join(self.directory, "log")
        with open(log, "wb") as errors:
            emulator = subprocess.Popen(self._emulator_command(), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors,
                                        preexec_fn=die_with_parent)  # fmt: skip
        with emulator:
            try:
                self._wait_ready(emulator)
                return self._run_host(emulator.pid)
            except Ended as problem:
                raise StartError(_last_line(log) or str(problem)) from None
            finally:
                end_children(set())
                self.bus.close()
                self.client.close()

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
        said = b""
        deadline = time.monotonic() + START_S
        with selectors.DefaultSelector() as selector:
            selector.register(emulator.stdout, selectors.EVENT_READ)
            while b"lk-emu ready" not in said:
                if not selector.select(max(deadline - time.monotonic(), 0)):
                    raise StartError(f"lk-emu was not ready within {START_S:g} s")
                data = os.read(emulator.stdout.fileno(), 4096)
                if not data:
                    raise Ended("lk-emu did not start")
                said += data

    def now_ns(self) -> int:
        """Since the scenario began. The clock shows microseconds."""
        return round((self.client.get("/clock")["time_s"] - self.began_s) * 1e6) * 1000

    # The host

    def _run_host(self, emulator: int) -> Dict[str, Any]:
        scenario = os.path.join(self.directory, f"case-{self.task['case']}.toml")
        with open(scenario, "w", encoding="utf-8") as file:
            file.write(self.task["scenario"])
        self.client.post("/scenario", {"file": scenario})
        self.began_s = float(self.client.get("/scenario")["buses"][0]["started_s"])
        relay = os.path.join(self.directory, "host") if self.task["stepped"] else ""
        if relay:
            self._listen(relay)
        read_end, write_end = os.pipe()
        self.said: Optional[int] = read_end
        os.set_blocking(read_end, False)
        self.selector.register(read_end, selectors.EVENT_READ, self._take_output)
        started = time.monotonic()
        host = self._start_host(relay, write_end)
        os.close(write_end)
        end, status = self._wait_for(host)
        wall_s = time.monotonic() - started
        self._take_output()
        ended_ns = self.now_ns()
        end_children({emulator})
        self._take_output()
        self.output.finish()
        notices = list(self.output.notices)
        if end == "exit" and status in self.task["exit_status"]:
            text = f"exit status {status}"
            notices.append(Notice(ended_ns, text, EXIT_STATUS, text))
        return {"case": self.task["case"], "end": end, "status": status, "notices": notices_json(notices), "wall_s": wall_s,
                "output": self.output.tail.decode(errors="replace"), "verdict": self._verdict()}  # fmt: skip

    def _start_host(self, relay: str, out: int) -> "subprocess.Popen[bytes]":
        task = self.task
        values = {"bus": self.bus.name, "channel": self.bus.channel, "port": self.bus.port, "control": relay, "case": str(task["case"]),
                  **{f"host.{name}": value for name, value in task["host_values"].items()}}  # fmt: skip
        command = [_filled_in(word, values) for word in task["command"]]
        environment = {**os.environ, **self.bus.environment(), "LKEMU_CASE": str(task["case"]), "PYTHONUNBUFFERED": "1"}
        environment.pop("LKEMU_CONTROL", None)
        if relay:
            environment["LKEMU_CONTROL"] = relay
        try:
            return subprocess.Popen(command, cwd=task["directory"], env=environment, stdin=subprocess.DEVNULL, stdout=out, stderr=out,
                                    process_group=0, preexec_fn=die_with_parent)  # fmt: skip
        except OSError as problem:
            raise StartError(f"host: command: {command[0]} cannot be started: {problem.strerror}") from None

    def _wait_for(self, host: "subprocess.Popen[bytes]") -> "tuple[str, int]":
        """How it ended: by itself, by a signal, or not in time. Time is processor time for a stepped host."""
        timeout_s, stepped = self.task["timeout_s"], self.task["stepped"]
        ended = os.pidfd_open(host.pid)
        self.selector.register(ended, selectors.EVENT_READ, None)
        look_at = time.monotonic()
        deadline = look_at + timeout_s * (WALL_FACTOR if stepped else 1.0)
        try:
            while True:
                now = time.monotonic()
                left_s = deadline - now
                if stepped and now >= look_at:
                    look_at = now + GLANCE_S
                    left_s = left_s if processor_time_s(host.pid) <= timeout_s else 0.0
                if left_s <= 0:
                    return "timeout", 0
                is_over = False
                for key, _ in self.selector.select(min(left_s, GLANCE_S) if stepped else left_s):
                    if key.data is None:
                        is_over = True  # what it said and asked before comes first
                    else:
                        key.data()
                if is_over:
                    status = host.wait()
                    return ("signal", -status) if status < 0 else ("exit", status)
        finally:
            self.selector.unregister(ended)
            os.close(ended)

    def _take_output(self) -> None:
        while self.said is not None:
            try:
                data = os.read(self.said, 1 << 16)
            except BlockingIOError:
                return
            if not data:
                self.selector.unregister(self.said)
                os.close(self.said)
                self.said = None
                return
            self.output.take(data)

    def _campaign_ended(self) -> None:
        if not os.read(sys.stdin.fileno(), 1):
            raise Abandoned

    # The host's control socket: what it printed before a request is of the time before that.

    def _listen(self, path: str) -> None:
        listener = socket.socket(socket.AF_UNIX)
        listener.bind(path)
        listener.listen()
        self.selector.register(listener, selectors.EVENT_READ, lambda: self._accept(listener))

    def _accept(self, listener: socket.socket) -> None:
        host = listener.accept()[0]
        emulator = socket.socket(socket.AF_UNIX)
        emulator.connect(self.control)
        self.selector.register(host, selectors.EVENT_READ, lambda: self._pass_on(host, emulator, asks=True))
        self.selector.register(emulator, selectors.EVENT_READ, lambda: self._pass_on(emulator, host, asks=False))

    def _pass_on(self, source: socket.socket, to: socket.socket, asks: bool) -> None:
        try:
            data = source.recv(1 << 16)
            if asks:
                self._take_output()
            if data:
                to.sendall(data)
                return
        except OSError:
            pass
        for one in (source, to):
            self.selector.unregister(one)
            one.close()

    # The verdict

    def _verdict(self) -> Any:
        """Nobody waits for the rest of the scenario any more: as fast as it goes."""
        slipped_s = self.client.get("/clock")["slipped_s"]
        if not self.task["stepped"]:
            self.client.request("PUT", "/clock", {"mode": "stepped"})
        state = self.client.get("/scenario")
        if state["state"] == "running":
            self.client.post("/clock/advance", {"to_s": self.began_s + state["duration_s"] + BEYOND_END_S})
        verdict = self.client.request("DELETE", "/scenario")
        verdict["slipped_s"] = slipped_s
        return verdict


def _filled_in(word: str, values: Dict[str, str]) -> str:
    for name, value in values.items():
        word = word.replace("{" + name + "}", value)
    return word


def _last_line(path: str) -> str:
    with open(path, encoding="utf-8", errors="replace") as file:
        lines = [line.strip() for line in file if line.strip()]
    return lines[-1].removeprefix("lk-emu: ") if lines else ""


def run_case(task: Dict[str, Any]) -> Dict[str, Any]:
    above = tempfile.gettempdir()
    directory = tempfile.mkdtemp(prefix="lk-case-", dir=above if len(above) <= MAX_DIRECTORY else "/tmp")
    try:
        return Case(task, directory).run()
    except Error as problem:
        return {"case": task["case"], "error": str(problem)}
    finally:
        shutil.rmtree(directory, ignore_errors=True)


def main() -> None:
    libc.prctl(PR_SET_CHILD_SUBREAPER, 1)
    os.setsid()  # Ctrl-C is for the campaign, which then ends this process
    try:
        while line := _read_line():
            answer = run_case(json.loads(line))
            os.write(sys.stdout.fileno(), json.dumps(answer).encode() + b"\n")
    except (Abandoned, BrokenPipeError):
        pass
    finally:
        end_children(set())


def _read_line() -> bytes:
    """Byte by byte, so that nothing of the next line is taken."""
    line = b""
    while not line.endswith(b"\n"):
        byte = os.read(sys.stdin.fileno(), 1)
        if not byte:
            return b""
        line += byte
    return line


if __name__ == "__main__":
    main()
