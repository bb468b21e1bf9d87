"""Cases whose host is the scenario itself: computed by `lk-emu run --cases`, judged here."""

from __future__ import annotations

import json
from typing import Any, Dict, Iterable, Iterator, List, Optional, Tuple

from .judge import Result, judge
from .plan import Plan
from .program import Program, ProgramError
from .sampling import Case

REFERENCE = 1 << 52  # added to the number of a case: the same without its fault


def run_cases(
    plan: Plan, program: Program, cases: Iterable[Tuple[int, Case]], jobs: int, pile: int
) -> Iterator[List[Result]]:
    """Results in any order, in small lists. `pile`: cases that one thread sorts together."""
    waiting: Dict[int, Tuple[Case, str]] = {}  # cases under way
    seen_of: Dict[int, Any] = {}  # computed, waiting for their reference
    references: Dict[str, Optional[Any]] = {}  # by group; None: under way
    users: Dict[str, List[int]] = {}  # cases that wait for the reference of their group
    numbers: Dict[int, str] = {}  # of a reference: its group

    def requests() -> Iterator[Optional[Dict[str, Any]]]:
        in_pile = 0
        for number, values in cases:
            request = plan.request(number, values)
            has_fault = "fault" in request
            group = ""
            if has_fault:
                without = plan.request(number + REFERENCE, values, fault=False)
                group = json.dumps({key: value for key, value in without.items() if key != "case"}, sort_keys=True)
                if group not in references:
                    references[group] = None
                    numbers[number + REFERENCE] = group
                    yield without
            waiting[number] = (values, group)
            yield request
            in_pile += 1
            if in_pile == pile:
                in_pile = 0
                yield None

    def judged(number: int) -> Result:
        values, group = waiting.pop(number)
        result = Result(number, values)
        judge(plan, result, seen_of.pop(number), references[group] if group else None)
        return result

    for seen in program.run(requests(), jobs):
        number = seen["case"]
        if "error" in seen:
            raise ProgramError(f"case {number % REFERENCE}: {seen['error']}")
        if number >= REFERENCE:
            group = numbers.pop(number)
            references[group] = seen
            ready = users.pop(group, [])
        else:
            seen_of[number] = seen
            group = waiting[number][1]
            if group and references[group] is None:
                users.setdefault(group, []).append(number)
                continue
            ready = [number]
        if ready:
            yield [judged(one) for one in ready]
