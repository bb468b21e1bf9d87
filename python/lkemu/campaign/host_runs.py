"""Cases with a host program: computed by workers (host_worker.py), judged here."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import tomllib
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import Any, Dict, Iterable, Iterator, List, Optional, Set, Tuple

from ..command import printable
from ..errors import Error, StartError
from .host_bus import KINDS
from .judge import HostEnd, Result, judge, judge_host
from .outcomes import OUTCOMES
from .plan import Plan
from .program import Program
from .sampling import Case
from .values import value_text


class Worker:
    """A process that runs one case after the other. All that a case starts ends with it."""

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
        if not line:
            raise Error(f"case {task['case']}: the process that ran it was ended from outside; --resume runs it again")
        return dict(json.loads(line))

    def end(self) -> None:
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()


class HostRuns:
    def __init__(self, plan: Plan, program: Program, jobs: int) -> None:
        assert plan.host is not None
        self._plan, self._program, self._jobs, self._host = plan, program, jobs, plan.host
        self._directory = str(plan.file.absolute().parent)
        self._lock = threading.Lock()
        self._references: Dict[str, "Future[Dict[str, Any]]"] = {}
        self._workers: Dict[int, Worker] = {}  # by thread

    def check(self, first: Tuple[int, Case]) -> None:
        """The host must live through a case without a fault. Raises StartError."""
        if self._host.bus not in KINDS:
            raise StartError(f'{self._plan.file}: host.bus: "{self._host.bus}" is not one of {", ".join(KINDS)}')
        name = self._host.command[0]
        path = os.path.join(self._directory, name) if "/" in name else shutil.which(name)
        if path is None or not os.access(path, os.X_OK):
            raise StartError(f"{self._plan.file}: host.command: there is no program {name}")
        number, values = first
        try:
            run = self._run(number, values, fault=False)
        finally:
            self._end_workers()
        end = self._end_of(run)
        if end.kind != HostEnd.EXITED:
            raise StartError(f"{self._plan.file}: host: even without a fault the command of case {number} ends like this: {end.note}"
                             + (f"; {end.said}" if end.said else ""))  # fmt: skip

    def run(self, cases: Iterable[Tuple[int, Case]], pile: int) -> Iterator[List[Result]]:
        """Results in any order. `pile` is for cases that share beginnings; these do not."""
        del pile
        pool = ThreadPoolExecutor(self._jobs)
        open_: Set["Future[Result]"] = set()
        try:
            for number, values in cases:
                if len(open_) >= 2 * self._jobs:
                    done, open_ = wait(open_, return_when=FIRST_COMPLETED)
                    yield [one.result() for one in done]
                open_.add(pool.submit(self._case, number, values))
            while open_:
                done, open_ = wait(open_, return_when=FIRST_COMPLETED)
                yield [one.result() for one in done]
        finally:
            for one in open_:
                one.cancel()
            self._end_workers()
            pool.shutdown()

    def _end_workers(self) -> None:
        with self._lock:
            workers, self._workers = self._workers, {}
        for worker in workers.values():
            worker.end()

    def _case(self, number: int, values: Case) -> Result:
        reference = None
        if self._plan.kind_of(values) is not None:
            reference = self._reference(number, values)
        results = []
        for _ in range(self._host.runs):
            results.append(self._judged(number, values, self._run(number, values), reference))
        worst = max(results, key=lambda one: list(OUTCOMES).index(one.outcome))
        worst.runs = len(results)
        worst.flips = sum(one.outcome != worst.outcome for one in results)
        worst.wall_s = sum(one.wall_s for one in results)
        return worst

    def _reference(self, number: int, values: Case) -> Dict[str, Any]:
        """The run without the fault, shared by all cases that differ in nothing else."""
        key = json.dumps([self._plan.request(0, values, fault=False), self._host_values(values)], sort_keys=True)
        with self._lock:
            reference = self._references.get(key)
            mine = reference is None
            if reference is None:
                reference = self._references[key] = Future()
        if mine:
            try:
                reference.set_result(self._run(number, values, fault=False))
            except BaseException as problem:
                reference.set_exception(problem)
        return reference.result()

    def _host_values(self, values: Case) -> Dict[str, str]:
        return {
            dimension.name.partition(".")[2]: value_text(value)
            for dimension, value in zip(self._plan.dimensions, values)
            if dimension.name.startswith("host.") and value is not None
        }

    def _run(self, number: int, values: Case, fault: bool = True) -> Dict[str, Any]:
        text = self._program.scenario_text(self._plan.request(number, values, fault=fault))
        scenario = tomllib.loads(text)
        host = self._host
        task = {
            "case": number, "program": self._program.path, "scenario": text, "robot": scenario.get("robot", ""),
            **{key: scenario.get(key) for key in ("seed", "bitrate", "generation")},
            "command": list(host.command), "bus": host.bus, "stepped": host.stepped, "timeout_s": host.timeout_s,
            "directory": self._directory, "host_values": self._host_values(values), "lines": list(self._plan.detection.lines),
            "exit_status": list(self._plan.detection.exit_status),
        }  # fmt: skip
        with self._lock:
            worker = self._workers.get(threading.get_ident())
            if worker is None:
                worker = self._workers[threading.get_ident()] = Worker()
        run = worker.run(task)
        if "error" in run:
            raise StartError(f"case {number}: {run['error']}")
        return run

    # What was seen of a run, as `lk-emu run --cases` says it

    def _seen(self, run: Dict[str, Any], planned: int) -> Dict[str, Any]:
        """`planned`: so many faults are the scenario's own."""
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
        }
        faults = verdict["faults"][planned:]
        if faults:
            seen["fault"] = {"state": "", "command": "", "began_at_ns": _ns(faults[0]["began_at_s"]),
                             "first_effect_at_ns": _ns(faults[0]["first_effect_at_s"])}  # fmt: skip
        return seen

    def _end_of(self, run: Dict[str, Any]) -> HostEnd:
        status = run["status"]
        if run["end"] == "timeout":
            end = HostEnd(HostEnd.HUNG, "did not end in time")
        elif run["end"] == "signal":
            end = HostEnd(HostEnd.DIED, f"killed by {signal.Signals(status).name}")
        else:
            known = status == 0 or status in self._plan.detection.exit_status
            end = HostEnd(HostEnd.EXITED if known else HostEnd.DIED, f"exit status {status}")
        if end.kind == HostEnd.EXITED:
            end.notices = run["notices"]
        else:
            lines = run["output"].rstrip().splitlines()
            end.said = printable(lines[-1]) if lines else ""
        return end

    def _judged(self, number: int, values: Case, run: Dict[str, Any], reference: Optional[Dict[str, Any]]) -> Result:
        result = Result(number, values, real_time=not self._host.stepped, wall_s=run["wall_s"])
        without = None if reference is None else self._seen(reference, 0)
        planned = 0 if reference is None else len(reference["verdict"]["faults"])
        judge(self._plan, result, self._seen(run, planned), without)
        judge_host(self._plan, result, self._end_of(run), None if reference is None else self._end_of(reference))
        return result


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
