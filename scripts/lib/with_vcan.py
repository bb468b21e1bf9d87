"""with-vcan: runs a command on a real SocketCAN bus (the outside; vcan_guest.py is the inside).

The bus is a private network namespace of the running kernel, if it supports vcan. Otherwise it is user-mode Linux, a
kernel that runs as an ordinary process. docs/guides/buses.md describes both.
"""

import signal

if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # no traceback, even this early
    signal.signal(signal.SIGINT, signal.SIG_DFL)

import fcntl
import os
import select
import socket
import struct
import sys
import termios
import time
import tty

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from vcan_buses import Failure, KernelBus, UmlBus

USAGE = """\
usage: with-vcan [--timeout SECONDS] [COMMAND [ARGUMENT...]]

Runs COMMAND (default: an interactive shell) where the CAN interfaces vcan0, vcan1 and the pair
vxcan0-vxcan1 are up: in a private network namespace if the running kernel offers vcan, else in
user-mode Linux. Directory, environment, streams and exit status are passed through.

  --timeout SECONDS   end everything after that time, with status 124 (default: no limit)
  WITH_VCAN=uml       (environment) take user-mode Linux in any case; 'kernel': the running kernel

Status: the command's own, 128+N if signal N killed it; 124 time limit, 125 no bus, 126 the command
is not executable, 127 it does not exist."""

BOOT_LIMIT_S = 60.0
GRACE_S = 1.0  # from passing a signal on to killing remaining processes


def say(text):
    print(f"with-vcan: {text}", file=sys.stderr, flush=True)


def refuse(text):
    say(text)
    sys.exit(125)


def seconds(text):
    try:
        limit = float(text)
    except ValueError:
        limit = 0.0
    if not 0 < limit < 1e9:
        refuse("--timeout wants a number of seconds above 0")
    return limit


def parse(arguments):
    """Returns the time limit in seconds or None, and the command."""
    limit = None
    while arguments and arguments[0].startswith("-"):
        option, equals, value = arguments.pop(0).partition("=")
        if option in ("-h", "--help"):
            print(USAGE)
            sys.exit(0)
        elif option == "--":
            break
        elif option != "--timeout":
            refuse(f"unknown option {option} (--help lists them)")
        if not equals:
            value = arguments.pop(0) if arguments else ""
        limit = seconds(value)
    return limit, arguments


def in_background():
    try:
        return os.tcgetpgrp(0) != os.getpgrp()
    except OSError:  # a terminal that is not our controlling terminal has no background
        return False


class Streams:
    """Types of our standard streams, and the terminal's settings."""

    def __init__(self):
        self.terminals = {fd for fd in (0, 1, 2) if os.isatty(fd)}
        self.stdin_ignored = False
        if 0 in self.terminals and in_background():
            self.terminals.discard(0)  # in the background we may not read the terminal
            self.stdin_ignored = True
        if 1 not in self.terminals:
            self.terminals.discard(0)  # in a pipeline the terminal keeps its line mode and Ctrl-C
        self.raw = 0 in self.terminals
        self.saved = termios.tcgetattr(0) if self.raw else None
        out, err = os.fstat(1), os.fstat(2)
        self.merged = (out.st_dev, out.st_ino) == (err.st_dev, err.st_ino)

    def terminal_fd(self):
        return next((fd for fd in (1, 2, 0) if fd in self.terminals), None)

    def size(self):
        if not self.terminals:
            return (24, 80)
        packed = fcntl.ioctl(self.terminal_fd(), termios.TIOCGWINSZ, bytes(8))
        return struct.unpack("HHHH", packed)[:2]

    def go_raw(self):
        if self.raw:
            tty.setraw(0, termios.TCSANOW)

    def restore(self):
        if self.saved is not None:
            signal.signal(signal.SIGTTOU, signal.SIG_IGN)
            termios.tcsetattr(0, termios.TCSANOW, self.saved)


# --- supervision -----------------------------------------------------------------------------


class Supervisor:
    """Waits for the end of the command, a signal or the time limit, whichever comes first."""

    def __init__(self, bus, streams, limit):
        self.bus, self.streams, self.limit = bus, streams, limit
        self.deadline = time.monotonic() + BOOT_LIMIT_S
        self.booted = False
        self.signal = 0  # signal that ended us, if any
        self.status = None  # our exit status, once it is not the command's
        self.wake, wake_end = socket.socketpair()
        wake_end.setblocking(False)
        self.wake_end = wake_end
        signal.set_wakeup_fd(wake_end.fileno())
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
            if signal.getsignal(number) != signal.SIG_IGN:
                signal.signal(number, lambda *_: None)
        if streams.terminals:
            signal.signal(signal.SIGWINCH, lambda *_: None)

    def tell(self, text):
        try:
            self.bus.control.sendall(text.encode())
        except OSError:
            pass

    def wind_up(self, number, status):
        """Passes a signal on and gives the command a moment to end."""
        self.status = status
        self.tell(f"signal {number}\n")
        self.deadline = time.monotonic() + GRACE_S

    def on_signal(self, number):
        """Returns whether to end now."""
        if number == signal.SIGWINCH:
            self.tell("size {} {}\n".format(*self.streams.size()))
            return False
        self.signal = number
        if not self.booted or self.status is not None:
            self.status = self.status or 128 + number
            return True
        keyboard = number in (signal.SIGINT, signal.SIGQUIT)
        if not (keyboard and self.streams.raw and isinstance(self.bus, KernelBus)):
            self.wind_up(number, 128 + number)
        return False  # on a terminal the kernel has already sent it to the command

    def on_message(self, words):
        """Returns the final status, or None if the command still runs."""
        if words[0] == "fail":
            raise Failure(" ".join(words[1:]))
        if words[0] == "ready":
            self.booted = True
            self.deadline = time.monotonic() + self.limit if self.limit else None
            self.bus.ready()
        elif words[0] == "exit":
            return int(words[1])
        return None

    def run(self):
        pending = b""
        while True:
            wait = None if self.deadline is None else max(0.0, self.deadline - time.monotonic())
            readable, _, _ = select.select([self.bus.control, self.wake], [], [], wait)
            if not readable:
                if not self.booted:
                    raise Failure(f"no bus within {BOOT_LIMIT_S:g} s: {self.bus.complaint()}")
                if self.status is not None:
                    return self.status
                self.streams.restore()
                say(f"time limit of {self.limit:g} s reached, ending everything")
                self.wind_up(signal.SIGTERM, 124)
            if self.wake in readable:
                if any([self.on_signal(number) for number in self.wake.recv(100)]):
                    return self.status
            if self.bus.control in readable:
                try:
                    data = self.bus.control.recv(4096)
                except ConnectionError:
                    data = b""
                if not data:
                    raise Failure(self.bus.complaint())
                *lines, pending = (pending + data).split(b"\n")
                for line in lines:
                    status = self.on_message(line.decode().split())
                    if status is not None:
                        return 124 if self.status == 124 else status

    def drain(self):
        """Waits until a slow reader has received the output of the ended command."""
        while not self.bus.drained():
            wait = 0.02 if self.deadline is None else self.deadline - time.monotonic()
            if wait <= 0:
                return
            readable, _, _ = select.select([self.wake], [], [], min(wait, 0.02))
            if readable and any(n != signal.SIGWINCH for n in self.wake.recv(100)):
                return


def open_bus(streams):
    choice = os.environ.get("WITH_VCAN", "")
    if choice not in ("", "uml", "kernel"):
        raise Failure(f"WITH_VCAN is '{choice}'; allowed: uml, kernel")
    if choice != "uml":
        bus = KernelBus(streams)
        if bus.prefix is not None:
            return bus
        if choice == "kernel":
            raise Failure("this user cannot use vcan of the running kernel (WITH_VCAN=kernel)")
    return UmlBus(streams)


def shell():
    return os.environ.get("SHELL") or "/bin/sh"


def main():
    for fd in (0, 1, 2):  # a closed stream's number must not go to one of our sockets
        try:
            os.fstat(fd)
        except OSError:
            os.open("/dev/null", os.O_RDWR)
    limit, command = parse(sys.argv[1:])
    streams = Streams()
    bus = supervisor = None
    try:
        bus = open_bus(streams)
        if not command:
            command = [shell()]
            if streams.raw:
                say("a shell with vcan0, vcan1 and vxcan0-vxcan1 up; 'exit' leaves it")
        supervisor = Supervisor(bus, streams, limit)
        bus.begin(command)
        status = supervisor.run()
    except Failure as failure:
        streams.restore()
        say(str(failure))
        status = 125
    finally:
        if hasattr(bus, "process"):
            bus.end()
    if isinstance(bus, UmlBus) and bus.pumps:
        supervisor.drain()
    streams.restore()
    if supervisor and status == 128 + supervisor.signal:  # the calling shell must see the signal
        signal.set_wakeup_fd(-1)
        signal.signal(status - 128, signal.SIG_DFL)
        os.kill(os.getpid(), status - 128)
    os._exit(status)


if __name__ == "__main__":
    main()
