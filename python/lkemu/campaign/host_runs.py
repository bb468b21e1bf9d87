"""Runs cases with a host program in worker processes (host_worker.py) and judges them."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import tomllib
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import Any, Collection, Dict, Iterable, Iterator, List, Optional, Set, Tuple

from ..command import printable
from ..errors import Error, StartError
from .host_bus import KINDS
from .judge import DANGEROUS, EXCEPTION, SAFE, HostEnd, Result, is_safe_by_detection, judge, judge_host
from .outcomes import MACHINE_FAILED, NOT_FIRED, OUTCOMES
from .plan import Plan
from .program import Program
from .sampling import Case
from .values import value_text

EXCEPTION_STATUS = 1  # exit status of Python after an uncaught exception
SHELL_SIGNAL = 128  # offset of a shell's exit status after a signal


class MachineFailed(Exception):
    """A case has no result: a process that it needs was killed from outside or did not answer."""


class Worker:
    """A process that runs one case after the other. At its end it kills all processes of the case."""

    def __init__(self) -> None:
        self._process = subprocess.Popen([sys.executable, "-m", "lkemu.campaign.host_worker"], stdin=subprocess.PIPE,
                                         stdout=subprocess.PIPE)  # fmt: skip

    def run(self, task: Dict[str, Any]) -> Dict[str, Any]:
        assert self._process.stdin is not None and self._process.stdout is not None
        try:
            self._process.stdin.write(json.dumps(task).encode() + b"\n")
            self._process.stdin.flush()
            line = self._process.stdout.readline()
        except (BrokenPipeError, ValueError):
            line = b""
        if not line.endswith(b"\n"):
            return {"failed": "its worker was killed from outside"}
        return dict(json.loads(line))

    def end(self) -> None:
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.close()
        self._process.wait()


class HostRuns:
    def __init__(self, plan: Plan, program: Program, jobs: int) -> None:
        assert plan.host is not None
        self._plan, self._program, self.jobs, self._host = plan, program, jobs, plan.host
        self._directory = str(plan.file.absolute().parent)
        self._lock = threading.Lock()
        self._references: Dict[str, "Future[Dict[str, Any]]"] = {}
        self._workers: Dict[int, Worker] = {}  # by thread
        self._is_ending = False

    def check(self, first: Tuple[int, Case]) -> None:
        """Checks that the host survives a case without a fault. Raises StartError."""
        host = self._host
        what = "host.python" if host.python else "host.command"
        if host.bus not in KINDS:
            raise StartError(f'{self._plan.file}: host.bus: "{host.bus}" is not one of {", ".join(KINDS)}')
        if not host.python:
            name = host.command[0]
            path = os.path.join(self._directory, name) if "/" in name else shutil.which(name)
            if path is None or not os.access(path, os.X_OK):
                raise StartError(f"{self._plan.file}: host.command: program not found: {name}")
        number, values = first
        try:
            for passive in (False, True) if host.passive[0] else (False,):
                end = self._end_of(self._run(number, values, fault=False, passive=passive))
                if end.kind != HostEnd.EXITED:
                    key = "host.passive" if passive else "host"
                    raise StartError(f"{self._plan.file}: {key}: {what} of case {number} fails even without a fault: {end.note}"
                                     + (f"; {end.output}" if end.output else ""))  # fmt: skip
        except MachineFailed as problem:
            raise Error(f"case {number}: {problem}; run the campaign again") from None
        finally:
            self._end_workers()

    def run(self, cases: Iterable[Tuple[int, Case]], batch_size: int) -> Iterator[List[Result]]:
        """Yields results in any order. `batch_size` is unused, because these cases share no simulation."""
        del batch_size
        pool = ThreadPoolExecutor(self.jobs)
        pending: Set["Future[Result]"] = set()
        try:
            for number, values in cases:
                if len(pending) >= 2 * self.jobs:
                    done, pending = wait(pending, return_when=FIRST_COMPLETED)
                    yield [one.result() for one in done]
                pending.add(pool.submit(self._case, number, values))
            while pending:
                done, pending = wait(pending, return_when=FIRST_COMPLETED)
                yield [one.result() for one in done]
        finally:
            for one in pending:
                one.cancel()
            self._is_ending = True
            self._end_workers()
            pool.shutdown()

    def _end_workers(self) -> None:
        with self._lock:
            workers, self._workers = self._workers, {}
        for worker in workers.values():
            worker.end()

    def _case(self, number: int, values: Case) -> Result:
        try:
            return self._worst_result(number, values)
        except MachineFailed as problem:
            return Result(number, values, MACHINE_FAILED, note=str(problem))

    def _worst_result(self, number: int, values: Case) -> Result:
        reference = None
        if self._plan.has_fault(values):
            reference = self._reference(number, values)
        results = []
        for _ in range(self._host.runs):
            results.append(self._judged(number, values, self._run(number, values), reference))
        worst = max(results, key=lambda one: list(OUTCOMES).index(one.outcome))
        worst.runs = len(results)
        worst.flips = sum(one.outcome != worst.outcome for one in results)
        worst.wall_s = sum(one.wall_s for one in results)
        if self._host.passive[0] and is_safe_by_detection(worst):
            without = None if reference is None else self._reference(number, values, passive=True)
            runs = [self._judged(number, values, self._run(number, values, passive=True), without) for _ in range(self._host.runs)]
            worst.passive = DANGEROUS if any(one.violated_at_ns is not None for one in runs) else SAFE
        return worst

    def _reference(self, number: int, values: Case, passive: bool = False) -> Dict[str, Any]:
        """Returns the run without the fault. All cases that differ only in the fault share it."""
        key = json.dumps([self._plan.request(0, values, fault=False), self._host_values(values), passive], sort_keys=True)
        with self._lock:
            reference = self._references.get(key)
            is_first = reference is None
            if reference is None:
                reference = self._references[key] = Future()
        if is_first:
            try:
                reference.set_result(self._run(number, values, fault=False, passive=passive))
            except BaseException as problem:
                with self._lock:
                    del self._references[key]  # the next case tries again
                reference.set_exception(problem)
        return reference.result()

    def _host_values(self, values: Case) -> Dict[str, str]:
        return {
            dimension.name.partition(".")[2]: value_text(value)
            for dimension, value in zip(self._plan.dimensions, values)
            if dimension.name.startswith("host.") and value is not None
        }

    def _run(self, number: int, values: Case, fault: bool = True, passive: bool = False) -> Dict[str, Any]:
        """Runs a case, and repeats it once if SIGKILL or SIGTERM ended its host. Raises MachineFailed.

        If the same signal ends a busy host again at the same simulated instant, the host itself sent it.
        """
        task = self._task(number, values, fault, passive)
        run = self._attempt(task)
        known = self._plan.detection.exit_status
        name = external_signal(run, known)
        if name:
            first, run = run, self._attempt(task)
            again = external_signal(run, known)
            is_its_own = self._host.stepped and again == name and run["ended_ns"] == first["ended_ns"] and not run["was_idle"]
            if again and not is_its_own:
                run = {"failed": f"the host was killed from outside by {name}"}
        if "failed" in run:
            raise MachineFailed(run["failed"])
        return run

    def _task(self, number: int, values: Case, fault: bool, passive: bool) -> Dict[str, Any]:
        text = self._program.scenario_text(self._plan.request(number, values, fault=fault))
        scenario = tomllib.loads(text)
        host = self._host
        return {
            "case": number, "program": self._program.path, "scenario": text, "robot": scenario.get("robot", ""),
            **{key: scenario.get(key) for key in ("seed", "bitrate", "generation")},
            "command": list(host.command), "python": host.python, "bus": host.bus, "stepped": host.stepped, "timeout_s": host.timeout_s,
            "memory_MB": host.memory_MB, "output_MB": host.output_MB, "directory": self._directory,
            "host_values": self._host_values(values), "environment": dict([host.passive]) if passive else {},
            "lines": list(self._plan.detection.lines), "exit_status": list(self._plan.detection.exit_status),
        }  # fmt: skip

    def _attempt(self, task: Dict[str, Any]) -> Dict[str, Any]:
        """Returns a run, or the reason why the machine failed twice. Raises StartError."""
        run: Dict[str, Any] = {}
        for _ in range(2):
            with self._lock:
                if self._is_ending:
                    raise MachineFailed("the campaign is ending")
                worker = self._workers.get(threading.get_ident())
                if worker is None:
                    worker = self._workers[threading.get_ident()] = Worker()
            run = worker.run(task)
            if "error" in run:
                raise StartError(f"case {task['case']}: {run['error']}")
            if "failed" not in run:
                break
            with self._lock:
                self._workers.pop(threading.get_ident(), None)
            worker.end()
        return run

    # Conversion of runs to the format of `lk-emu run --cases`

    def _seen(self, run: Dict[str, Any], planned: int) -> Dict[str, Any]:
        """`planned`: number of faults in the scenario without the fault of the case."""
        verdict = run["verdict"]
        results = [_result(one) for one in verdict["expectations"]]
        own, rules = len(self._plan.expectations), len(self._plan.detection.host)
        drives = results[own : len(results) - rules]
        seen = {
            "expect": results[:own],
            "errors": [{"bus": "", "id": n, "error": "", "at_ns": one["at_ns"]} for n, one in enumerate(drives) if one["status"] == "passed"],
            "detect": results[len(results) - rules :],
            "replies": verdict["buses"][0]["replies_hash"],
            "invalid": verdict["invalid"],
            "unasked_deg": verdict["unasked_deg"],
            "advice": {one["kind"]: {"at_ns": _ns(one["at_s"]), "text": f"{one['kind']}: {one['what']}"} for one in reversed(verdict["advice"])},
        }
        faults = verdict["faults"][planned:]
        if faults:
            seen["fault"] = {"state": "", "command": "", "began_at_ns": _ns(faults[0]["began_at_s"]),
                             "first_effect_at_ns": _ns(faults[0]["first_effect_at_s"])}  # fmt: skip
        return seen

    def _end_of(self, run: Dict[str, Any]) -> HostEnd:
        status, lines = run["status"], run["output"].rstrip().splitlines()
        output = printable(lines[-1]) if lines else ""
        if run["end"] == "timeout":
            return HostEnd(HostEnd.HUNG, run["why"], output)
        if run["end"] == "limit":
            return HostEnd(HostEnd.DIED, run["why"], output)
        if run["end"] == "signal":
            return HostEnd(HostEnd.DIED, f"killed by {signal.Signals(status).name}", output)
        note = f"exit status {status}"
        is_exception = status == EXCEPTION_STATUS and run["exception"]
        if is_exception:
            note, output = EXCEPTION + printable(run["exception"].partition(":")[0]), printable(run["exception"])
        if status == 0 or status in self._plan.detection.exit_status or (is_exception and run["exception_is_known"]):
            return HostEnd(HostEnd.EXITED, note, notices=run["notices"])
        return HostEnd(HostEnd.DIED, note, output)

    def _judged(self, number: int, values: Case, run: Dict[str, Any], reference: Optional[Dict[str, Any]]) -> Result:
        result = Result(number, values, real_time=not self._host.stepped, wall_s=run["wall_s"])
        without = None if reference is None else self._seen(reference, 0)
        planned = 0 if reference is None else len(reference["verdict"]["faults"])
        judge(self._plan, result, self._seen(run, planned), without)
        judge_host(self._plan, result, self._end_of(run), None if reference is None else self._end_of(reference))
        began = result.fault_at_ns
        if result.real_time and result.outcome == NOT_FIRED and began is not None and result.first_effect_at_ns is None:
            result.note += f"; the fault affected nothing from {began / 1e9:g} s on: the host may have started later"
        return result


def external_signal(run: Dict[str, Any], known: Collection[int]) -> str:
    """Returns the name of the signal if SIGKILL or SIGTERM ended the host, else an empty text.

    A shell reports the signal of its program as an exit status above SHELL_SIGNAL.
    """
    status = run.get("status", 0)
    if run.get("end") == "exit" and status not in known:
        status -= SHELL_SIGNAL
    elif run.get("end") != "signal":
        return ""
    return signal.Signals(status).name if status in (signal.SIGKILL, signal.SIGTERM) else ""


def _ns(seconds: Optional[float]) -> Optional[int]:
    return None if seconds is None else round(seconds * 1e9)


def _result(one: Dict[str, Any]) -> Dict[str, Any]:
    at = _ns(one["decided_at_s"])
    result = {"says": one["says"] or one["expected"], "status": "passed" if one["status"] == "passed" else "failed"}
    if at is not None:
        result.update(at_ns=at, decided_at_ns=at)
    if one["margin"] is not None:
        result["margin"] = one["margin"]
    return result
