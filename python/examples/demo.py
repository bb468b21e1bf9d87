"""A robot, the dashboard that shows it and a host that moves it, until Ctrl-C: what `lk-emu-body demo` runs.

    python3 demo.py [--no-browser] LK-EMU-BODY ROBOT HOST [WORD...]

ROBOT is as --config has it; HOST a file beside this one, with its words. Both are on a bus of their own, slcan over TCP on this
machine. Exit status: 0 when it was ended by Ctrl-C or SIGTERM, 1 when robot or host had failed, 2 when it could not begin.
"""

import argparse
import ctypes
import os
import shutil
import signal
import socket
import subprocess
import sys
from pathlib import Path

HTTP_PORT, BUS_PORT = 8474, 29536  # where they are free
DEBIANS_PYTHON = "/usr/bin/python3"
ENDS = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
PATIENCE_S = 10.0  # with a program that is to end
PR_SET_PDEATHSIG = 1


def find_python_can():
    """Where this Python has no python-can, Debian's goes on with it."""
    for python in (sys.executable, DEBIANS_PYTHON):
        asked = [python, "-c", "from can import Bus; import serial"]
        if os.path.exists(python) and subprocess.run(asked, stderr=subprocess.DEVNULL).returncode == 0:
            if python != sys.executable:
                os.execv(python, [python, "-B", *sys.argv])
            return
    sys.stderr.write("lk-emu: demo: its host needs python-can: apt install python3-can\n")
    sys.exit(2)


def free_port(wanted):
    """On this machine: this one, or any."""
    for port in (wanted, 0):
        with socket.socket() as tried:
            tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as lk-emu will
            try:
                tried.bind(("127.0.0.1", port))
                return tried.getsockname()[1]
            except OSError:
                continue
    sys.stderr.write("lk-emu: demo: no port is free\n")
    sys.exit(2)


def in_a_child():
    """It gets no Ctrl-C of the terminal: who started it ends it, and it ends with that. Signals are as they were."""
    os.setsid()
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDS | {signal.SIGCHLD})


def start_robot(program, robot, http, bus):
    """None when it does not start, which it has said."""
    command = [program, "--config", robot, "--bus", f"slcan-tcp:{bus}", "--rom", ":memory:",
               "--http", f"127.0.0.1:{http}", "--http-write", "--log-level", "warn"]  # fmt: skip
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, preexec_fn=in_a_child)
    if process.stdout.readline().startswith("lk-emu ready"):
        return process
    process.wait()
    return None


def start_host(words, bus):
    where = {
        "CAN_INTERFACE": "slcan",
        "CAN_CHANNEL": f"socket://127.0.0.1:{bus}",
        "CAN_CONFIG": '{"sleep_after_open": 0}',  # it would wait for an adapter
    }
    file = Path(__file__).resolve().parent / words[0]
    command = [sys.executable, "-B", "-u", file, *words[1:]]
    environment = {key: value for key, value in os.environ.items() if not key.startswith("LKEMU_")}
    return subprocess.Popen(command, env={**environment, **where}, preexec_fn=in_a_child)


def open_browser(address):
    """Where a person would see it."""
    display = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if display and sys.stdout.isatty() and shutil.which("xdg-open"):
        quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        subprocess.Popen(["xdg-open", address], start_new_session=True, **quiet)


def wait_for_the_end(robot, host):
    """A signal, or the end of the robot. A host that has ended leaves the robot to be looked at."""
    told = False
    while robot.poll() is None:
        if host.poll() is not None and not told:
            told = True
            print(f"demo: the host has ended with status {host.returncode}; Ctrl-C ends the demo", flush=True)
        if signal.sigwait(ENDS | {signal.SIGCHLD}) in ENDS:
            return


def end(process):
    """Whether it ran, and has ended when it was told to."""
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
    http, bus = free_port(HTTP_PORT), free_port(BUS_PORT)
    robot = start_robot(given.program, given.robot, http, bus)
    if robot is None:
        return 2
    host = start_host(given.host, bus)
    address = f"http://127.0.0.1:{http}/"
    print(f"demo: {address} shows the robot, and the mouse pushes it there; Ctrl-C ends the demo", flush=True)
    if not given.no_browser:
        open_browser(address)
    wait_for_the_end(robot, host)
    ended_well = [end(host), end(robot)]
    print(robot.stdout.read(), end="", flush=True)
    return 0 if all(ended_well) else 1


if __name__ == "__main__":
    sys.exit(main())
