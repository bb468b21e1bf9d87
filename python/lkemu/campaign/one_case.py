"""Runs single cases (--case) and estimates the cost of a campaign (--dry-run)."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import tempfile
import time
from collections import Counter
from typing import Dict, List, Optional, Tuple

from ..errors import Error, StartError
from .engine import runs_of
from .judge import Result
from .outcomes import MACHINE_FAILED, NOT_FIRED
from .plan import Plan
from .program import Program
from .sampling import Case, Cases
from .values import Value, value_text

TRIAL_CASES = 64  # cases to estimate the duration
TRIAL_CASES_OF_KIND = 8  # cases to check if a kind of fault takes effect
MAX_TRIAL_S = 60.0  # limit for this check
MAX_SEARCHED = 100_000  # case numbers
MAX_SHOWN = 8  # values of a list


def values_of(plan: Plan, number: int, changes: List[str]) -> Case:
    """Returns the values of a case after the changes NAME=VALUE of --set. Raises StartError."""
    cases = Cases(plan)
    if not 0 <= number < cases.numbers:
        raise StartError(f"--case: {number} is not one of the {cases.numbers} of {plan.name}, from 0")
    values = cases.values(number)
    if values is None:
        raise StartError(f"--case: {number} is excluded")
    for change in changes:
        values = _changed(plan, values, change)
    kind = plan.kind_of(values)
    changed: List[Optional[Value]] = list(values)
    for n, dimension in enumerate(plan.dimensions):
        if not plan.counts(dimension, kind):
            changed[n] = None
        elif changed[n] is None:
            raise StartError(f"--set: this case also needs {dimension.name}")
    if plan.excludes(tuple(changed)):
        raise StartError("--set: the plan excludes this case")
    return tuple(changed)


def _changed(plan: Plan, values: Case, change: str) -> Case:
    name, sign, given = change.partition("=")
    place = next((n for n, dimension in enumerate(plan.dimensions) if dimension.name == name), None)
    if place is None or not sign:
        raise StartError(f'--set: "{change}" is not NAME=VALUE of a dimension of this plan')
    allowed = plan.dimensions[place].values
    value: Value = given
    if allowed.has_words:
        if given not in allowed.values:  # type: ignore[union-attr]
            raise StartError(f'--set: {name}: "{given}" is not one of {", ".join(map(str, allowed.values))}')
    else:
        try:
            value = float(given)
        except ValueError:
            value = float("nan")
        if not allowed.least <= value <= allowed.most:
            raise StartError(f"--set: {name} must be a number from {value_text(allowed.least)} to {value_text(allowed.most)}")
    return (*values[:place], value, *values[place + 1 :])


def run_one(plan: Plan, program: Program, number: int, values: Case) -> Result:
    ((result,),) = runs_of(plan, program, 1).run([(number, values)], 1)
    if result.outcome == MACHINE_FAILED:
        raise Error(f"case {number}: {result.note}; run it again")
    return result


def write_outputs(plan: Plan, program: Program, number: int, values: Case, given: argparse.Namespace) -> None:
    """Writes the files of --scenario, --csv and --candump."""
    with tempfile.TemporaryDirectory() as folder:
        scenario = given.scenario or os.path.join(folder, "case.toml")
        line = json.dumps(plan.request(number, values, watch=False))
        _run([program.path, "run", "--cases", "-", "--scenario", scenario], line)
        options = [word for name in ("csv", "signals", "rate", "candump")
                   for word in ([f"--{name}", str(getattr(given, name))] if getattr(given, name) is not None else [])]  # fmt: skip
        if options:
            print(_run([program.path, "run", scenario, *options], "", statuses=(0, 1)), end="")


def _run(command: List[str], text: str, statuses: Tuple[int, ...] = (0,)) -> str:
    done = subprocess.run(command, input=text, capture_output=True, text=True, check=False)
    if done.returncode not in statuses:
        raise StartError(done.stderr.strip().removeprefix("lk-emu: "))
    return done.stdout


def print_cost(plan: Plan, program: Program, jobs: int) -> None:
    print(f"{plan.name}: {plan.included} cases, sampling {plan.sampling}, scenario {os.path.basename(plan.scenario)}")
    if plan.included < plan.numbers:
        print(f"  {plan.numbers - plan.included} more are excluded")
    for dimension in plan.dimensions:
        print(f"  {dimension.name:<36} {_described(dimension.values)}")
    some = spread_cases(plan, TRIAL_CASES if plan.host is None else 1)
    began = time.monotonic()
    count = sum(len(results) for results in runs_of(plan, program, 1).run(some, len(some)))
    each_s = (time.monotonic() - began) / count
    print(f"about {1 / each_s:.3g} cases/s for each of {jobs} jobs ({count} tried): {_duration(each_s * plan.included / jobs)}")
    # With slow hosts, fewer cases of each kind are tried, or none.
    of_kind = min(TRIAL_CASES_OF_KIND, int(MAX_TRIAL_S * jobs / (each_s * len(plan.kinds)))) if plan.kinds else 0
    if plan.kinds and of_kind == 0:
        print(f"skipped: check whether each of {len(plan.kinds)} kinds of fault takes effect, which would take {_duration(each_s * len(plan.kinds) / jobs)}")
    idle = _idle_kinds(plan, program, jobs, of_kind)
    if idle:
        print(f"took no effect in up to {of_kind} cases each; remove them, or let them act longer: {', '.join(idle)}")


def spread_cases(plan: Plan, most: int) -> List[Tuple[int, Case]]:
    """Returns up to `most` cases, spread evenly over the campaign."""
    cases = Cases(plan)
    count = min(most, cases.numbers)
    some: List[Tuple[int, Case]] = []
    number = 0
    for n in range(count):
        number = max(number, cases.numbers * n // count)
        for number in range(number, min(number + MAX_SEARCHED, cases.numbers)):
            values = cases.values(number)
            if values is not None:
                some.append((number, values))
                number += 1
                break
    if not some:
        raise plan.error("exclude", "excludes all cases that were tried")
    return some


def _idle_kinds(plan: Plan, program: Program, jobs: int, of_kind: int) -> List[str]:
    """Returns the kinds of fault that took no effect in `of_kind` cases each."""
    if of_kind == 0:
        return []
    cases = Cases(plan)
    count: "Counter[str]" = Counter()
    tried: List[Tuple[int, Case]] = []
    for number in range(min(cases.numbers, MAX_SEARCHED)):
        values = cases.values(number)
        if values is None or not plan.has_fault(values):
            continue
        kind = str(plan.kind_of(values))
        if count[kind] == of_kind:
            continue
        count[kind] += 1
        tried.append((number, values))
        if len(tried) == of_kind * len(plan.kinds):
            break
    fired: Dict[str, bool] = dict.fromkeys(count, False)
    for results in runs_of(plan, program, jobs).run(tried, TRIAL_CASES_OF_KIND):
        for result in results:
            kind = plan.kind_of(result.values)
            assert kind is not None
            fired[kind] = fired[kind] or result.outcome != NOT_FIRED
    return [kind for kind, has_fired in fired.items() if not has_fired]


def _described(values: object) -> str:
    if hasattr(values, "values"):
        listed = values.values
        return f"{len(listed)}: {', '.join(value_text(value) for value in listed[:MAX_SHOWN])}" + (", …" if len(listed) > MAX_SHOWN else "")
    return f"{value_text(values.least)} to {value_text(values.most)}"  # type: ignore[attr-defined]


def _duration(seconds: float) -> str:
    for limit, unit, name in ((120, 1, "s"), (7200, 60, "min")):
        if seconds < limit:
            return f"{seconds / unit:.3g} {name}"
    return f"{seconds / 3600:.3g} h"
