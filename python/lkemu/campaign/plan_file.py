"""Reads the file of a plan and checks it completely before the first case runs."""

from __future__ import annotations

import difflib
import os
import pathlib
import re
from typing import Any

from .plan import MAX_CASES, NO_FAULT, UNASKED, Host, Plan, PlanError
from .plan_dimensions import MAX_VALUE, DimensionReader
from .plan_host import HOST_KEYS, read_detection, read_host
from .plan_text import PlanText, is_number, is_whole
from .program import Program
from .sampling import Cases
from .values import Listed

SAMPLINGS = ("full", "random", "latin", "pairwise")
KEYS = {"about", "scenario", "sampling", "cases", "seed", "tolerant_time_s", "dimension", "exclude", "hazard", "detect", "host", "rates"}
MAX_COUNTED = 1_000_000  # case numbers; in larger plans excluded cases are not counted


def find_plan(called: str, program: Program) -> pathlib.Path:
    """Returns the path of a file, or of a shipped plan by its name. Raises PlanError."""
    file = pathlib.Path(called)
    if file.is_file() or "/" in called or called.endswith(".toml"):
        return file
    package = pathlib.Path(__file__).resolve().parents[2]
    bin_directory = pathlib.Path(program.path).resolve().parent
    directories = (package / "campaigns", package.parent / "configs/campaigns", package / "configs/campaigns",
                   bin_directory.parent / "share/lk-emu/campaigns")  # fmt: skip
    for directory in directories:
        if (directory / f"{called}.toml").is_file():
            return directory / f"{called}.toml"
    known = sorted({one.stem for directory in directories for one in directory.glob("*.toml")})
    near = difflib.get_close_matches(called, known, 1)
    raise PlanError(f'unknown campaign "{called}"' + (f"; did you mean {near[0]}?" if near else f"; shipped: {', '.join(known)}"))


def load_plan(called: str, program: Program) -> Plan:
    """Raises PlanError."""
    text = PlanText(find_plan(called, program))
    document = text.document
    text.check_keys(document, KEYS, "")
    plan = read_head(text, called)
    plan.faults = {row["kind"]: row for row in program.faults()}
    read_scenario(text, plan, program)
    reader = DimensionReader(text, plan, program)
    plan.dimensions = reader.read_dimensions(document.get("dimension"))
    plan.exclusions = [reader.read_exclusion(one) for one in document.get("exclude", [])]
    hazard = text.table("hazard", {"expectations", "advice"})
    plan.hazards = tuple(hazard.get("expectations", ()))
    for one in plan.hazards:
        if one not in plan.expectations:
            raise text.error("hazard.expectations", f'the scenario has no expectation that says "{one}"')
    plan.detection = read_detection(text, text.table("detect", {"drive", "host"}))
    if "host" in document:
        plan.host = read_host(text, text.table("host", HOST_KEYS))
        check_placeholders(text, plan.host, plan)
    if hazard.get("advice", False):
        if plan.host is None:
            raise text.error("hazard.advice", "needs [host]")
        plan.advice = UNASKED
    check_fault(text, plan)
    check_rates(text, document.get("rates", {}), plan)
    check_lists(text, plan)
    count_cases(text, plan)
    return plan


def read_head(text: PlanText, called: str) -> Plan:
    document = text.document
    sampling = document.get("sampling")
    if sampling not in SAMPLINGS:
        raise text.error("sampling", f"must be one of {', '.join(SAMPLINGS)}")
    cases = document.get("cases")
    if sampling in ("random", "latin") and cases is None:
        raise text.error("cases", "missing")
    if sampling in ("full", "pairwise") and cases is not None:
        raise text.error("cases", "only for sampling random and latin")
    if cases is not None and not (is_whole(cases) and 1 <= cases <= MAX_CASES):
        raise text.error("cases", f"must be a whole number from 1 to {MAX_CASES}")
    seed = document.get("seed", 1)
    if not (is_whole(seed) and 0 <= seed < 2**63):
        raise text.error("seed", "must be a whole number from 0 to 2^63 - 1")
    scenario = document.get("scenario")
    if not isinstance(scenario, str):
        raise text.error("scenario", "must be a text")
    if scenario.endswith(".toml") or "/" in scenario:
        scenario = os.path.abspath(text.file.parent / scenario)
    tolerant = document.get("tolerant_time_s")
    if tolerant is not None and not (is_number(tolerant) and 0 <= tolerant <= 1e8):
        raise text.error("tolerant_time_s", "must be a number from 0 to 1e8")
    return Plan(
        file=text.file,
        text=text.text,
        called=called,
        sampling=sampling,
        seed=seed,
        cases=cases or 0,
        scenario=scenario,
        about=str(document.get("about", "")),
        tolerant_time_ns=None if tolerant is None else round(tolerant * 1e9),
    )


def read_scenario(text: PlanText, plan: Plan, program: Program) -> None:
    """Fills in drives, expectations, duration and inputs, which lk-emu reads from the scenario."""
    (seen,) = program.check([{"case": 0, "scenario": plan.scenario}])
    if "error" in seen:
        raise text.error("scenario", seen["error"])
    plan.drives, plan.expectations, plan.duration_s = seen["drives"], seen["expect"], seen["duration_s"]
    plan.inputs = seen["inputs"]


def check_placeholders(text: PlanText, host: Host, plan: Plan) -> None:
    names = {dimension.name for dimension in plan.dimensions}
    for name in re.findall(r"\{(host\.[^{}]*)\}", " ".join(host.command)):
        if name not in names:
            raise text.error("host.command", f"no dimension has the name of {{{name}}}")


def check_fault(text: PlanText, plan: Plan) -> None:
    names = {dimension.name for dimension in plan.dimensions}
    if not plan.kinds:
        for name in names:
            if name.startswith("fault."):
                raise text.error("dimension", f"{name} needs fault.kind")
        return
    if "fault.at_s" not in names:
        raise text.error("dimension", "fault.kind needs fault.at_s")
    for dimension in plan.dimensions:
        parameter = dimension.fault_parameter
        if parameter is not None and parameter[0] not in plan.kinds:
            raise text.error("dimension", f"{dimension.name}: fault.kind is never {parameter[0]}")
    for kind in plan.kinds:
        if kind == NO_FAULT:
            continue
        row = plan.faults[kind]
        varied = [f"fault.{kind}.{one['name']}" in names for one in row["parameters"]]
        for one, is_varied in zip(row["parameters"], varied):
            if one["required"] and not is_varied:
                raise text.error("dimension", f"\"fault.{kind}.{one['name']}\" is required: give it a value, a list or a range")
        if row["needs_one"] and not any(varied):
            first = row["parameters"][0]["name"]
            raise text.error("dimension", f'"fault.{kind}.{first}" or another of its parameters is required')


def check_rates(text: PlanText, rates: Any, plan: Plan) -> None:
    """Checks failure rates. Only their ratios matter, so any unit will do. The report reads them from the text."""
    if not isinstance(rates, dict):
        raise text.error("rates", "must be a table")
    for kind, rate in rates.items():
        if kind not in plan.kinds:
            raise text.error(f"rates.{kind}", "is not a kind of fault of this plan")
        if not (is_number(rate) and 0 <= rate <= MAX_VALUE):
            raise text.error(f"rates.{kind}", "must be a number, 0 or more")
    missing = [kind for kind in plan.kinds if kind not in rates]
    if rates and missing:
        raise text.error("rates", f"missing: {', '.join(missing)}")


def check_lists(text: PlanText, plan: Plan) -> None:
    if plan.sampling in ("full", "pairwise"):
        for dimension in plan.dimensions:
            if not isinstance(dimension.values, Listed):
                raise text.error(
                    "dimension", f"{dimension.name}: sampling {plan.sampling} needs a list, or a step in the range"
                )


def count_cases(text: PlanText, plan: Plan) -> None:
    cases = Cases(plan)
    plan.numbers = plan.included = cases.numbers
    if plan.exclusions and plan.sampling in ("full", "latin") and cases.numbers <= MAX_COUNTED:
        plan.included = sum(cases.values(n) is not None for n in range(cases.numbers))
    if plan.included == 0:
        raise text.error("exclude", "excludes every case")
