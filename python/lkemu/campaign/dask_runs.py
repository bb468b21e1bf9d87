"""Runs batches of cases on the workers of a dask.distributed scheduler (docs/guides/campaigns-on-clusters.md)."""

from __future__ import annotations

import functools
import ipaddress
import itertools
import logging
import os
import time
import urllib.parse
import uuid
import warnings
from dataclasses import dataclass
from typing import Any, Iterable, Iterator, List, Set, Tuple, Union

from .. import __version__
from ..errors import Error, StartError
from .host_runs import HostRuns
from .judge import Result
from .plan import Plan, PlanError
from .plan_file import load_plan
from .plan_host import plan_hash
from .program import Program
from .sampling import Cases
from .scenario_runs import ScenarioRuns

CONNECT_S = 10
BATCHES_PER_THREAD = 3  # avoids idle threads
MIN_PENDING = 16  # pending batches make an adaptive cluster start workers
MAX_BATCH = 1024  # cases, which take seconds. The scheduler handles some 1000 batches/s.
MAX_HOST_BATCH = 16
RETRIES = 2  # of a batch, e.g. if its lk-emu was killed
POLL_S = 1.0  # between two reads of the number of threads


@dataclass(frozen=True)
class Job:
    """Identifies the plan, its files and the version; a worker must have the same ones."""

    plan: str  # an absolute path, or the name of a shipped plan
    input_hash: str
    package: str  # version of lkemu
    campaign: str  # unique, so that each campaign checks the worker's files again


Answer = Union[str, List[Result]]  # to a batch; a text is the reason why the worker cannot run it


def check_address(address: str) -> str:
    """Returns the address in the form that dask expects. Raises StartError.

    The address must be loopback or TLS, because workers execute any code that they receive.
    """
    scheme, _, place = address.rpartition("://")
    try:
        parts = urllib.parse.urlsplit(f"//{place}")
        host, port = parts.hostname or "", parts.port
    except ValueError:
        host, port = "", None
    if not port:
        raise StartError(f'--dask: "{address}" is not an address like 127.0.0.1:8786 or tls://HOST:8786')
    if scheme == "tls" or (scheme in ("", "tcp") and _is_loopback(host)):
        return f"{scheme or 'tcp'}://{place}"
    raise StartError(f"--dask: {address} is neither loopback nor tls://, and workers execute any code that they receive; "
                     "use TLS, or a tunnel (ssh -N -L 8786:localhost:8786 HOST) and --dask 127.0.0.1:8786")  # fmt: skip


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


class DaskRuns:
    """Runs batches on the workers of a scheduler. Dask handles retries and workers that join or leave."""

    def __init__(self, plan: Plan, program: Program, address: str) -> None:
        address = check_address(address)
        try:
            import distributed  # pylint: disable=import-outside-toplevel  # optional package; loading takes 1 s
        except ImportError as problem:
            raise StartError(f"--dask: {problem}: apt install python3-distributed, or pip install 'lk-emu[campaign-dask]'") from None
        for name in ("distributed", "asyncio"):
            logging.getLogger(name).setLevel(logging.CRITICAL)  # errors raise exceptions as well
        warnings.filterwarnings("ignore", module="distributed")
        self._as_completed, self._address = distributed.as_completed, address
        try:
            self._client = distributed.Client(address, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError, TypeError, RuntimeError) as problem:
            raise StartError(f"--dask: no scheduler answers at {address}: {_line(problem)}") from None
        called = os.path.abspath(plan.file) if os.path.exists(plan.called) else plan.called
        self._job = Job(called, plan_hash(plan, program), __version__, uuid.uuid4().hex)
        self.max_batch = MAX_BATCH if plan.host is None else MAX_HOST_BATCH
        self._counted_at = 0.0
        self.count_threads()
        self._check()

    def count_threads(self) -> int:
        """Updates `jobs`, the number of threads of all workers, and returns it."""
        if time.monotonic() - self._counted_at >= POLL_S:
            self.jobs = max(sum(self._client.nthreads().values()), 1)
            self._counted_at = time.monotonic()
        return self.jobs

    def _check(self) -> None:
        """Checks all current workers. Later ones check themselves before their first batch. Raises StartError."""
        answers = self._client.run(run_batch, self._job, [], on_error="return")
        for worker, answer in answers.items():
            if isinstance(answer, BaseException) and "No module named" in str(answer):  # dask wraps the ImportError
                raise StartError(f"--dask: worker {worker}: {_line(answer)}: install lk-emu there")
            _results_of(answer, f"worker {worker}")

    def run(self, numbers: Iterable[int], batch_size: int) -> Iterator[List[Result]]:
        """Yields results in any order. `batch_size`: cases per batch."""
        numbers = iter(numbers)
        batches = iter(lambda: list(itertools.islice(numbers, batch_size)), [])
        done = self._as_completed(loop=self._client.loop)
        pending: Set[Any] = set()
        try:
            while True:
                max_pending = max(BATCHES_PER_THREAD * self.count_threads(), MIN_PENDING)
                for batch in itertools.islice(batches, max(max_pending - len(pending), 0)):
                    future = self._client.submit(run_batch, self._job, batch, pure=False, retries=RETRIES)
                    pending.add(future)
                    done.add(future)
                if not pending:
                    return
                future = next(done)
                pending.discard(future)
                yield _results_of(future.exception() or future.result(), f"scheduler {self._address}")
        except OSError as problem:
            raise Error(f"scheduler {self._address}: {_line(problem)}; --resume goes on") from None
        finally:
            self._client.cancel(list(pending), force=True)

    def close(self) -> None:
        self._client.close(timeout=CONNECT_S)


def _line(problem: BaseException) -> str:
    return " ".join(str(problem).split()) or type(problem).__name__


def _results_of(answer: Any, source: str) -> List[Result]:
    if isinstance(answer, str):
        raise StartError(f"--dask: {answer}")
    if isinstance(answer, BaseException):
        raise Error(f"--dask: {source}: {_line(answer)}; --resume goes on")
    return list(answer)


# Functions that run on workers


@functools.lru_cache(maxsize=4)
def _plan_of(job: Job) -> Tuple[Plan, Program, Cases]:
    """Raises StartError or PlanError."""
    program = Program()
    plan = load_plan(job.plan, program)
    if job.package != __version__:
        raise StartError(f"has lkemu {__version__}, but the campaign has {job.package}")
    if plan_hash(plan, program) != job.input_hash:
        raise StartError(f"has another {job.plan}, other files that it names, or another lk-emu than the campaign (it has {program.version()})")
    return plan, program, Cases(plan)


def run_batch(job: Job, numbers: List[int]) -> Answer:
    """Returns results, or an error text if a retry cannot help. Dask retries after other exceptions."""
    import socket  # pylint: disable=import-outside-toplevel

    try:
        plan, program, cases = _plan_of(job)
        batch = [(number, values) for number in numbers for values in [cases.values(number)] if values is not None]
        if not batch:
            return []
        runs = ScenarioRuns(plan, program, 1) if plan.host is None else HostRuns(plan, program, 1)
        return [result for results in runs.run(batch, len(batch)) for result in results]
    except (StartError, PlanError) as problem:
        return f"worker {socket.gethostname()}:{os.getpid()}: {problem}"
