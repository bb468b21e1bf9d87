"""Runs cases without a host program by `lk-emu run --cases`, and judges them."""

from __future__ import annotations

import json
import threading
from collections import OrderedDict
from dataclasses import dataclass, field
from typing import Any, Dict, Iterable, Iterator, List, Optional, Tuple

from ..errors import Error
from .judge import Result, judge
from .plan import Plan
from .program import Program
from .sampling import Case

REFERENCE = 1 << 52  # added to the number of a case: its run without the fault
MAX_GROUPS = 256  # references kept for later cases


@dataclass
class Group:
    """Cases that differ only in the fault. They share a reference, the run without the fault."""

    reference: Optional[Any] = None  # None: not computed yet
    unjudged: int = 0  # number of cases
    waiting: List[int] = field(default_factory=list)  # cases computed before the reference


class ScenarioRuns:
    """Runs and judges cases. One thread feeds requests to the program, another one takes the results."""

    def __init__(self, plan: Plan, program: Program, jobs: int) -> None:
        self._plan, self._program, self.jobs = plan, program, jobs
        self._lock = threading.Lock()
        self._values: Dict[int, Tuple[Case, str]] = {}  # by case: values and key of the group
        self._seen: Dict[int, Any] = {}  # by case: answer of the program
        self._groups: "OrderedDict[str, Group]" = OrderedDict()
        self._group_of: Dict[int, str] = {}  # by number of the reference

    def run(self, cases: Iterable[Tuple[int, Case]], batch_size: int) -> Iterator[List[Result]]:
        """Yields results in any order. `batch_size`: number of cases that one thread computes together."""
        for seen in self._program.run(self._requests(cases, batch_size), self.jobs):
            number = seen["case"]
            if "error" in seen:
                raise Error(f"case {number % REFERENCE}: {seen['error']}")
            with self._lock:
                ready = self._take_reference(number, seen) if number >= REFERENCE else self._take_case(number, seen)
                results = [self._judged(one) for one in ready]
            if results:
                yield results

    def _requests(self, cases: Iterable[Tuple[int, Case]], batch_size: int) -> Iterator[Optional[Dict[str, Any]]]:
        in_batch = 0
        for number, values in cases:
            request = self._plan.request(number, values)
            key, without = "", None
            if "fault" in request:
                without = self._plan.request(number + REFERENCE, values, fault=False)
                key = json.dumps({name: value for name, value in without.items() if name != "case"}, sort_keys=True)
            with self._lock:
                self._values[number] = values, key
                if key in self._groups:
                    self._groups.move_to_end(key)
                    without = None
                elif key:
                    self._groups[key] = Group()
                    self._group_of[number + REFERENCE] = key
                    self._drop_old_groups()
                if key:
                    self._groups[key].unjudged += 1
            if without is not None:
                yield without
            yield request
            in_batch += 1
            if in_batch == batch_size:
                in_batch = 0
                yield None

    def _drop_old_groups(self) -> None:
        for key in list(self._groups)[: len(self._groups) - MAX_GROUPS]:
            if self._groups[key].unjudged == 0:
                del self._groups[key]

    def _take_reference(self, number: int, seen: Any) -> List[int]:
        group = self._groups[self._group_of.pop(number)]
        group.reference = seen
        ready, group.waiting = group.waiting, []
        return ready

    def _take_case(self, number: int, seen: Any) -> List[int]:
        self._seen[number] = seen
        key = self._values[number][1]
        if not key or self._groups[key].reference is not None:
            return [number]
        self._groups[key].waiting.append(number)
        return []

    def _judged(self, number: int) -> Result:
        values, key = self._values.pop(number)
        reference = None
        if key:
            reference = self._groups[key].reference
            self._groups[key].unjudged -= 1
        result = Result(number, values)
        judge(self._plan, result, self._seen.pop(number), reference)
        return result
