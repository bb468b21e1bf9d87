"""Runs a robot, its dashboard and a host that moves it, until Ctrl-C. `lk-emu-body demo` runs this program.

    python3 demo.py [--no-browser] LK-EMU-BODY ROBOT HOST [WORD...]

ROBOT is an argument of --config; HOST is a file next to this one, with its arguments. Both use a private bus, slcan over TCP on
this machine. A host that ends is started again. Exit status: 0: ended by Ctrl-C or SIGTERM, 1: robot or host failed, 2: the
demo could not start.
"""

import argparse
import ctypes
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HTTP_PORT = 8474  # used by the first demo, if free
DEBIANS_PYTHON = "/usr/bin/python3"
ENDS = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
PATIENCE_S = 10.0  # time limit for a program to end
RESTART_S = 3.0  # so that the dashboard can report the end
QUICK_S = 10.0  # a host that ends sooner has failed
MAX_FAILURES = 3  # in a row
PR_SET_PDEATHSIG = 1


def find_python_can():
    """Re-executes this script with Debian's Python if this Python has no python-can."""
    for python in (sys.executable, DEBIANS_PYTHON):
        asked = [python, "-c", "from can import Bus; import serial"]
        if os.path.exists(python) and subprocess.run(asked, stderr=subprocess.DEVNULL).returncode == 0:
            if python != sys.executable:
                os.execv(python, [python, "-B", *sys.argv])
            return
    sys.stderr.write("lk-emu: demo: its host needs python-can: apt install python3-can\n")
    sys.exit(2)


def free_port(*wanted):
    """Returns a free port of this machine: one of these, or any."""
    for port in (*wanted, 0):
        with socket.socket() as tried:
            tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as lk-emu does
            try:
                tried.bind(("127.0.0.1", port))
                return tried.getsockname()[1]
            except OSError:
                continue
    sys.stderr.write("lk-emu: demo: no port is free\n")
    sys.exit(2)


def is_first(mark):
    """Returns whether this is the first running demo; `mark` is a socket that reserves this while it is open."""
    try:
        mark.bind("\0lk-emu-demo")
        return True
    except OSError:
        return False


def in_a_child():
    """Runs in a child before exec. Starts a new session, so that the terminal's Ctrl-C does not reach the child.
    Requests SIGTERM when the parent ends, and unblocks signals."""
    os.setsid()
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDS | {signal.SIGCHLD})


def start_robot(program, robot, http, bus):
    """Returns the process, or None if it did not start; the program has then printed the reason."""
    command = [program, "--config", robot, "--bus", f"slcan-tcp:{bus}", "--rom", ":memory:",
               "--http", f"127.0.0.1:{http}", "--http-write", "--log-level", "warn"]  # fmt: skip
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, preexec_fn=in_a_child)
    if process.stdout.readline().startswith("lk-emu ready"):
        return process
    process.wait()
    return None


def start_host(words, bus, turns):
    where = {
        "LK_JOINTS_TURNS": turns,  # a host that starts again knows the joints' angles by this file
        "CAN_INTERFACE": "slcan",
        "CAN_CHANNEL": f"socket://127.0.0.1:{bus}",
        "CAN_CONFIG": '{"sleep_after_open": 0}',  # otherwise python-can waits for an adapter
    }
    file = Path(__file__).resolve().parent / words[0]
    command = [sys.executable, "-B", "-u", file, *words[1:]]
    environment = {key: value for key, value in os.environ.items() if not key.startswith("LKEMU_")}
    return subprocess.Popen(command, env={**environment, **where}, preexec_fn=in_a_child)


def open_browser(address):
    """Opens the browser if there is a display and a user at the terminal."""
    display = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if display and sys.stdout.isatty() and shutil.which("xdg-open"):
        quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        subprocess.Popen(["xdg-open", address], start_new_session=True, **quiet)


def wait_for_the_end(robot, start):
    """Runs hosts, made by `start`, until a signal or the end of the robot; returns the last host. After MAX_FAILURES the
    robot keeps running for inspection."""
    host, began, failures = start(), time.monotonic(), 0
    while robot.poll() is None:
        if host.poll() is not None and failures < MAX_FAILURES:
            failures = failures + 1 if time.monotonic() - began < QUICK_S else 1
            then = f"it starts again in {RESTART_S:.0f} s" if failures < MAX_FAILURES else "Ctrl-C ends the demo"
            print(f"demo: the host has ended with status {host.returncode}; {then}", flush=True)
            if failures < MAX_FAILURES:
                if signal.sigtimedwait(ENDS, RESTART_S):
                    break
                host, began = start(), time.monotonic()
                continue
        if signal.sigwait(ENDS | {signal.SIGCHLD}) in ENDS:
            break
    return host


def end(process):
    """Ends a process; returns whether it was running and ended as requested."""
    ran = process.poll() is None
    process.terminate()
    try:
        return process.wait(PATIENCE_S) in (0, -signal.SIGTERM) and ran
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
        return False


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--no-browser", action="store_true", help="only print the dashboard's address")
    parser.add_argument("program", metavar="LK-EMU-BODY")
    parser.add_argument("robot", metavar="ROBOT")
    parser.add_argument("host", metavar="HOST", nargs=argparse.REMAINDER)
    given = parser.parse_args()
    signal.pthread_sigmask(signal.SIG_BLOCK, ENDS | {signal.SIGCHLD})
    find_python_can()
    mark = socket.socket(socket.AF_UNIX)
    http, bus = free_port(*([HTTP_PORT] if is_first(mark) else [])), free_port()
    robot = start_robot(given.program, given.robot, http, bus)
    if robot is None:
        return 2
    address = f"http://127.0.0.1:{http}/"
    print(f"demo: {address} shows the robot, and the mouse pushes it there; Ctrl-C ends the demo", flush=True)
    if not given.no_browser:
        open_browser(address)
    with tempfile.TemporaryDirectory() as directory:
        host = wait_for_the_end(robot, lambda: start_host(given.host, bus, os.path.join(directory, "turns")))
        ended_well = [end(host), end(robot)]
    print(robot.stdout.read(), end="", flush=True)
    return 0 if all(ended_well) else 1


if __name__ == "__main__":
    sys.exit(main())
