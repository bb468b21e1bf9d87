"""Loads the module of `host.python` and runs each case in a forked child process:

    python3 -m lkemu.campaign.host_functions SOCKET FILE|MODULE

Interpreter and libraries start once. A child exits with its case, so a case cannot change the memory of another one.
"""

from __future__ import annotations

import contextlib
import importlib
import inspect
import json
import os
import random
import socket
import sys
import threading
import traceback
from typing import Any, Callable, Dict, NoReturn, Optional

from ..attached import attach
from .host_processes import end_with_parent

FUNCTION = "run_case"
# Libraries of buses, loaded before the fork to save time.
LIBRARIES = ("lkemu.stepped_bus", *(f"can.interfaces.{name}" for name in ("slcan", "socketcan", "socketcand", "udp_multicast")))


def load(python: str) -> Callable[..., Any]:
    """Returns `run_case` of a file, or of a module in the working directory. Raises ImportError."""
    directory, name = os.path.split(python)
    sys.path.insert(0, os.path.abspath(directory))
    module = importlib.import_module(name.removesuffix(".py"))
    function = getattr(module, FUNCTION, None)
    if not callable(function):
        raise ImportError(f"{python} has no function {FUNCTION}(bus, clock)")
    parameters = list(inspect.signature(function).parameters.values())
    if len(parameters) < 2:
        raise ImportError(f"{FUNCTION} of {python} takes {len(parameters)} parameters; it must take bus and clock")
    for library in LIBRARIES:
        with contextlib.suppress(ImportError):  # missing packages of interfaces that the plan does not use
            importlib.import_module(library)
    if threading.active_count() > 1:
        raise ImportError(f"{python} starts threads when it is loaded; start them in {FUNCTION}, or use host.command")
    return function


def try_load(python: str) -> "tuple[Optional[Callable[..., Any]], str]":
    try:
        return load(python), ""
    except BaseException as problem:
        return None, f"{python}: {''.join(traceback.format_exception_only(problem)).strip().splitlines()[-1]}"


def parse_setting(text: str) -> Any:
    """Converts the value of a dimension host.NAME to int, float or str."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            pass
    return text


def run_child(function: Callable[..., Any], task: Dict[str, Any], out: int) -> NoReturn:
    """Runs the case and exits as a program would.

    The exit status is 1 after a traceback, else the function's return value or the argument of sys.exit().
    """
    status = 1
    try:
        end_with_parent()
        os.setsid()
        for descriptor in (1, 2):
            os.dup2(out, descriptor)
        os.close(out)
        os.environ.update(task["environment"])
        random.seed(int(os.environ["LKEMU_CASE"]))
        attached = attach()
        bus = attached.open()
        try:
            returned = function(bus, attached.clock, **{name: parse_setting(text) for name, text in task["settings"].items()})
        finally:
            bus.shutdown()
        sys.exit(returned)
    except SystemExit as ended:
        if isinstance(ended.code, str):
            print(ended.code, file=sys.stderr)
        status = ended.code & 0xFF if isinstance(ended.code, int) else int(ended.code is not None)
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


def main() -> None:
    tasks = socket.socket(fileno=int(sys.argv[1]))
    os.set_inheritable(tasks.fileno(), False)
    function, problem = try_load(sys.argv[2])
    tasks.sendall(json.dumps({"problem": problem}).encode() + b"\n")
    while function is not None:
        line, (out, *_), _, _ = receive(tasks)
        child = os.fork()
        if child == 0:
            tasks.close()
            run_child(function, json.loads(line), out)
        os.close(out)
        _, status, usage = os.wait4(child, 0)
        tasks.sendall(json.dumps({"status": status, "memory_kB": usage.ru_maxrss}).encode() + b"\n")


def receive(tasks: socket.socket) -> "tuple[bytes, list[int], int, Any]":
    line, descriptors, flags, address = socket.recv_fds(tasks, 1 << 16, 1)
    if not line:
        sys.exit(0)
    while not line.endswith(b"\n"):
        line += tasks.recv(1 << 16)
    return line, descriptors, flags, address


if __name__ == "__main__":
    main()
