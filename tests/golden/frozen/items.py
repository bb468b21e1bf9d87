"""Groups of tasks; each task returns texts by item name."""

from __future__ import annotations

import functools
import pathlib
import socket
import tempfile
import threading
import tomllib
from dataclasses import dataclass
from typing import Any, Callable

from . import sessions
from .hosts import free_port
from .program import HERE, Program, run
from .requests import REQUESTS, get_paths, streams
from .values import csv_text, json_lines_text, json_text, renamed

ROOT = HERE.parents[2]
CONFIGS = ROOT / "configs"
Texts = dict[str, str]

SIGNALS = (
    "angle_deg,speed_dps,encoder,iq_A,ia_A,ib_A,ic_A,power,voltage_V,bus_current_A,temperature_C,driver_temperature_C,"
    "errors,bridge_on,alive,true_angle_deg,true_speed_dps,true_rotor_deg,true_rotor_dps,joint_deg,joint_dps,joint_Nm,"
    "true_id_A,true_iq_A,true_torque_Nm,true_voltage_V,winding_C,housing_C,stage_C,iq_ref_A,speed_ref_dps,"
    "angle_ref_deg,duty_a,duty_b,duty_c"
)
# Scenarios whose frames are decoded, with generation and motor for decode.
DECODED_RUNS = {"joint_moves": ("legacy", "mg4010"), "mixed_boards": ("v236", "mg4005"), "lost_id": ("v236b", "mf7015"),
                "carriage_returns": ("v236", "mg4005"), "late_replies": ("v235", "mf7015")}
CAMPAIGNS = {"every_fault": "0/48", "quadruped": "0/8"}  # 200 and 50 cases


class Skipped(Exception):
    """Reason why this machine or program cannot record an item, a few words."""


@dataclass
class Task:
    """All items of a task begin with `name`."""

    name: str
    texts: Callable[[], Texts]


def run_tasks(program: str) -> list[Task]:
    scenarios = sorted(path.stem for path in (CONFIGS / "scenarios").glob("*.toml"))
    return [Task(f"run/{one}", functools.partial(run_scenario, program, one)) for one in scenarios]


def has_body(scenario: str) -> bool:
    """True if the robot of the scenario has a body."""
    path = CONFIGS / "scenarios" / f"{scenario}.toml"
    robot = tomllib.loads(path.read_text("utf-8"))["robot"]
    file = path.parent / robot if robot.endswith(".toml") else CONFIGS / "buses" / f"{robot}.toml"
    return "body" in tomllib.loads(file.read_text("utf-8"))


@functools.cache
def runs_bodies(program: str) -> bool:
    with tempfile.TemporaryDirectory(prefix="freeze") as directory:
        return run([program, "--config", "pendulum", "--check"], pathlib.Path(directory), (0, 2)).returncode == 0


def run_scenario(program: str, name: str) -> Texts:
    with tempfile.TemporaryDirectory(prefix="freeze") as directory:
        folder = pathlib.Path(directory)
        if has_body(name) and not runs_bodies(program):
            raise Skipped("needs lk-emu-body")
        command = [program, "run", name, "--quiet", "--candump", "frames", "--marks", "--csv", "signals"]
        done = run([*command, "--signals", SIGNALS], folder, (0, 1, 3))
        frames = (folder / "frames").read_text("utf-8")
        return {f"run/{name}/frames": f"exit status {done.returncode}\n{frames}",
                f"run/{name}/signals": (folder / "signals").read_text("utf-8")}


def session_tasks(program: str) -> list[Task]:
    return [Task(f"session/{one}", functools.partial(run_session, program, one))
            for one in sessions.CAN + sessions.RS485]


def run_session(program: str, name: str) -> Texts:
    if name == "socketcan" and "vcan0" not in [interface for _, interface in socket.if_nameindex()]:
        raise Skipped("needs the CAN interface vcan0")
    return {f"session/{name}/{what}": text for what, text in sessions.record(program, name).items()}


def trace_tasks(traces: str | None) -> list[Task]:
    return [Task("trace", functools.partial(run_traces, traces))] if traces else []


def run_traces(traces: str) -> Texts:
    """Returns one item per line. Omits the hash of a scenario, which covers wording."""
    with tempfile.TemporaryDirectory(prefix="freeze") as directory:
        folder = pathlib.Path(directory)
        run([traces, str(folder / "traces")], folder)
        lines = [line.split() for line in (folder / "traces").read_text("utf-8").splitlines()]
    texts = {}
    for words in lines:
        # "path FILE", "model lanes 3 HASH" and "life CAN 32 drives, …"; others are named by two words.
        named = {"path": 1, "model": 3, "life": 3}.get(words[0], 2)
        values = words[named:-1] if words[0] == "scenario" else words[named:]
        texts["trace/" + "_".join(words[:named])] = " ".join(values) + "\n"
    return texts


class DecodeLogs:
    """Records logs for decode, each session once."""

    def __init__(self, program: str) -> None:
        self._program = program
        self._lock = threading.Lock()
        self._sessions: dict[str, str] = {}

    def of_session(self, name: str) -> str:
        with self._lock:
            if name not in self._sessions:
                lines = sessions.record(self._program, name)["frames"].splitlines()
                # decode aborts on commands for several drives on RS-485, 02 80 to 02 82.
                decodable = [line for line in lines if "rs485#02" not in line]
                self._sessions[name] = "".join(line.replace(") ", ") bus ", 1) + "\n" for line in decodable)
            return self._sessions[name]

    def of_run(self, name: str) -> str:
        return run_scenario(self._program, name)[f"run/{name}/frames"].split("\n", 1)[1]


def decode_tasks(program: str) -> list[Task]:
    logs = DecodeLogs(program)
    inputs: dict[str, tuple[Callable[[], str], str, str]] = {}
    for name, (generation, motor) in DECODED_RUNS.items():
        inputs[name] = (functools.partial(logs.of_run, name), generation, motor)
    for generation in ("legacy", "late-legacy", "v235", "v236", "v236b"):
        for kind, name in (("can", "slcan-tcp"), ("rs485", "rs485-tcp")):
            inputs[f"{kind}_session_as_{generation}"] = (functools.partial(logs.of_session, name), generation, "mg4005")
    golden = functools.partial((HERE.parent / "resting_drive.log").read_text, "utf-8")
    inputs["resting_drive"] = (golden, "legacy", "mf7015")
    return [Task(f"decode/{name}", functools.partial(run_decode, program, name, *one)) for name, one in inputs.items()]


def run_decode(program: str, name: str, log: Callable[[], str], generation: str, motor: str) -> Texts:
    with tempfile.TemporaryDirectory(prefix="freeze") as directory:
        command = [program, "decode", "--json", "--generation", generation, "--motor", motor]
        done = run(command, pathlib.Path(directory), given=log())
    return {f"decode/{name}": json_lines_text(done.stdout)}


def http_tasks(program: str) -> list[Task]:
    return [Task("http", functools.partial(run_requests, program))]


def run_requests(program: str) -> Texts:
    """Sends REQUESTS to one program, then every GET, and reads both streams."""
    texts = {}
    with tempfile.TemporaryDirectory(prefix="freeze") as directory:
        folder = pathlib.Path(directory)
        bus = f"slcan-tcp:{free_port()}"
        with Program(program, folder, "can.toml", bus) as running:
            def add(name: str, status: int, answer: Any) -> None:
                texts[f"http/{name}"] = renamed(f"status {status}\n{json_text(answer)}", bus)

            for number, (name, method, path, body) in enumerate(REQUESTS, 1):
                add(f"{number:02}_{name}", *running.ask(method, path, body))
            for name, path in get_paths(bus):
                add(f"get_{name}", *running.ask("GET", path))
            for name, answer in streams(running):
                texts[f"http/{name}"] = renamed(json_text(answer), bus)
    return texts


def campaign_tasks(program: str) -> list[Task]:
    return [Task(f"campaign/{plan}", functools.partial(run_campaign, program, plan)) for plan in CAMPAIGNS]


def run_campaign(program: str, plan: str) -> Texts:
    with tempfile.TemporaryDirectory(prefix="freeze") as directory:
        folder = pathlib.Path(directory)
        run([program, "campaign", plan, "--shard", CAMPAIGNS[plan], "-o", "results.db", "-j", "1", "--quiet"], folder)
        return {f"campaign/{plan}": csv_text(run([program, "campaign", "export", "results.db"], folder).stdout)}


def groups(program: str, traces: str | None) -> dict[str, list[Task]]:
    return {"run": run_tasks(program), "session": session_tasks(program), "trace": trace_tasks(traces),
            "decode": decode_tasks(program), "http": http_tasks(program), "campaign": campaign_tasks(program)}
