"""Reads the tables [host] and [detect] of a plan, and hashes all inputs of a campaign."""

from __future__ import annotations

import contextlib
import hashlib
import modulefinder
import pathlib
import shlex
from typing import Any, List, Mapping, Tuple

import regex

from .plan import Detection, Host, Plan
from .plan_text import PlanText, is_number, is_whole
from .program import Program

HOST_KEYS = {"command", "python", "bus", "clock", "timeout_s", "memory_MB", "output_MB", "runs", "passive"}
REALTIME_RUNS = 2  # minimum to notice that the outcome of a case varies


def read_detection(text: PlanText, table: Mapping[str, Any]) -> Detection:
    drive = table.get("drive", "any")
    errors = [] if drive == "none" else [drive] if isinstance(drive, str) else list(drive)
    host, lines, statuses = [], [], []
    for rule in table.get("host", ()):
        if len(rule) > 1 and ("says" in rule or "exit_status" in rule):
            raise text.error("detect.host", f"{' and '.join(rule)} exclude each other; write a [[detect.host]] for each")
        if "says" in rule:
            try:
                regex.compile(rule["says"])
            except regex.error as problem:
                raise text.error("detect.host.says", f'"{rule["says"]}" is not a regular expression: {problem}') from None
            lines.append(rule["says"])
        elif "exit_status" in rule:
            if not (is_whole(rule["exit_status"]) and 0 <= rule["exit_status"] <= 255):
                raise text.error("detect.host.exit_status", "must be a whole number from 0 to 255")
            statuses.append(rule["exit_status"])
        elif "reply" in rule or "answered" in rule:
            host.append(rule)
        else:
            raise text.error("detect.host", "needs one of reply, answered, says and exit_status")
    return Detection(tuple(errors), tuple(host), tuple(lines), tuple(statuses))


def read_host(text: PlanText, table: Mapping[str, Any]) -> Host:
    command, python = table.get("command"), table.get("python")
    try:
        words = shlex.split(command) if isinstance(command, str) else list(command or ())
    except ValueError as problem:
        raise text.error("host.command", str(problem)) from None
    if python is not None and "command" in table:
        raise text.error("host.python", "does not go together with command")
    if python is not None and not (isinstance(python, str) and python):
        raise text.error("host.python", "must be the name of a file or a module")
    if python is None and not words:
        raise text.error("host.command", "missing, or empty")
    clock = table.get("clock", "realtime" if python is None else "stepped")
    if clock not in ("realtime", "stepped"):
        raise text.error("host.clock", "must be realtime or stepped")
    if python is not None and clock != "stepped":
        raise text.error("host.clock", "must be stepped for host.python")
    bus = table.get("bus", "slcan-tcp")
    if python is not None and str(bus).startswith("rs485"):
        raise text.error("host.bus", "must be a CAN bus for host.python")
    runs = table.get("runs", 1 if clock == "stepped" else REALTIME_RUNS)
    if not (is_whole(runs) and 1 <= runs <= 1000):
        raise text.error("host.runs", "must be a whole number from 1 to 1000")
    if clock == "stepped" and runs > 1:
        raise text.error("host.runs", 'must be 1 unless clock = "realtime": a stepped host does the same in each run')
    limits = {}
    for key, least, most in (("timeout_s", 0.1, 1e5), ("memory_MB", 50, 1e6), ("output_MB", 0.001, 1e4)):
        limits[key] = table.get(key, getattr(Host, key))
        if not (is_number(limits[key]) and least <= limits[key] <= most):
            raise text.error(f"host.{key}", f"must be a number from {least:g} to {most:g}")
    return Host(tuple(words), python or "", bus, clock == "stepped", runs=runs,
                passive=read_passive(text, table.get("passive")), **limits)  # fmt: skip


def read_passive(text: PlanText, passive: Any) -> Tuple[str, str]:
    if passive is None:
        return "", ""
    name, sign, value = passive.partition("=") if isinstance(passive, str) else ("", "", "")
    if not (sign and name.isidentifier()):
        raise text.error("host.passive", 'must be an environment variable and its value, like "NO_STOP=1"')
    return name, value


def plan_hash(plan: Plan, program: Program) -> str:
    """Returns a hexadecimal hash of the plan, the version of lk-emu and all files that affect results."""
    total = hashlib.sha256(f"{program.version()}\0{plan.inputs}\0{plan.text}".encode())
    for file in host_files(plan):
        total.update(f"{file.name}\0".encode() + hashlib.sha256(file.read_bytes()).digest())
    return total.hexdigest()[:16]


def host_files(plan: Plan) -> List[pathlib.Path]:
    """Lists the files in the plan's directory that the host uses.

    These are words of `command`, the module of `python`, and the modules that they import.
    """
    if plan.host is None:
        return []
    directory = plan.file.absolute().parent
    words = [*plan.host.command, plan.host.python, plan.host.python.replace(".", "/") + ".py"]
    files = {file.resolve() for file in (directory / word for word in words if word) if file.is_file()}
    for file in list(files):
        if file.suffix == ".py":
            finder = modulefinder.ModuleFinder([str(file.parent), str(directory)])
            with contextlib.suppress(SyntaxError):  # the host reports it when it runs
                finder.run_script(str(file))
            files.update(pathlib.Path(one.__file__).resolve() for one in finder.modules.values() if one.__file__)
    return sorted(files)
