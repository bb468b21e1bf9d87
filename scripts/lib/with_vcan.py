"""with-vcan: run a command on a real SocketCAN bus (the outside; vcan_guest.py is the inside).

Two ways lead to the bus: a private network namespace of the running kernel where that offers vcan,
else user-mode Linux, a kernel that is an ordinary process. docs/with-vcan.md describes both.
"""

import collections
import fcntl
import marshal
import os
import select
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import termios
import threading
import time
import tty

USAGE = """\
usage: with-vcan [--timeout SECONDS] [COMMAND [ARGUMENT...]]

Runs COMMAND (default: an interactive shell) where the CAN interfaces vcan0, vcan1 and the pair
vxcan0-vxcan1 are up: in a private network namespace if the running kernel offers vcan, else in
user-mode Linux. Directory, environment, streams and exit status are passed through.

  --timeout SECONDS   end everything after that time, with status 124 (default: no limit)
  WITH_VCAN=uml       (environment) take user-mode Linux in any case; 'kernel': the running kernel

Status: the command's own, 128+N if signal N killed it; 124 time limit, 125 no bus, 126 the command
is not executable, 127 it does not exist."""

MEMORY_MB = 512
BOOT_LIMIT_S = 60.0
PIECE = 3000  # bytes of standard input on their way at a time
GRACE_S = 1.0  # between passing a signal on and ending what is still there
GUEST = os.path.join(os.path.dirname(os.path.realpath(__file__)), "vcan_guest.py")
ISOLATE = ["unshare", "--net", "--pid", "--fork", "--kill-child", "--mount-proc"]
CONTROL, STDIN, STDOUT, STDERR, TERMINAL = range(5)


class Failure(Exception):
    """No bus; the text is one line for the user."""


def say(text):
    print(f"with-vcan: {text}", file=sys.stderr, flush=True)


def parse(arguments):
    limit = None
    while arguments and arguments[0].startswith("-"):
        option = arguments.pop(0)
        if option in ("-h", "--help"):
            print(USAGE)
            sys.exit(0)
        elif option == "--":
            break
        elif option == "--timeout" or option.startswith("--timeout="):
            text = option[10:] if "=" in option else arguments.pop(0) if arguments else ""
            try:
                limit = float(text)
            except ValueError:
                limit = 0.0
            if not 0 < limit < 1e9:
                say("--timeout wants a number of seconds above 0")
                sys.exit(125)
        else:
            say(f"unknown option {option} (--help lists them)")
            sys.exit(125)
    return limit, arguments


# --- the running kernel ----------------------------------------------------------------------


class KernelBus:
    """Namespaces of the running kernel: network for the bus, PID so that everything ends."""

    def __init__(self, streams):
        self.streams = streams
        self.prefix = None
        # As root, or as root of a user namespace where the distribution allows those.
        for prefix in (ISOLATE, [*ISOLATE, "--map-root-user"]):
            if self.offers_vcan(prefix):
                self.prefix = prefix
                break

    @staticmethod
    def offers_vcan(prefix):
        with open(GUEST, encoding="utf-8") as guest:
            links = guest.read().split('LINKS = b"""')[1].split('"""')[0]
        path = "/usr/sbin:/sbin:" + os.environ.get("PATH", os.defpath)
        try:
            probe = subprocess.run(
                [*prefix, "ip", "-batch", "-"],
                input=links.encode(),
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                env={**os.environ, "PATH": path},
                check=False,
            )
        except OSError:
            return False
        return probe.returncode == 0

    def begin(self, command):
        self.control, theirs = socket.socketpair()
        on_terminal = self.streams.raw
        argv = [*self.prefix, sys.executable, "-ISB", GUEST, "kernel", str(theirs.fileno())]
        argv += ["tty" if on_terminal else "-", *command]
        # Without a terminal in front, signals reach the command through us alone and only once.
        self.process = subprocess.Popen(
            argv, pass_fds=[theirs.fileno()], start_new_session=not on_terminal
        )
        theirs.close()

    def ready(self):
        pass

    def complaint(self):
        return "the command's namespace went away"

    def end(self):
        self.process.kill()  # --kill-child takes the namespace's process 1 along, that all others
        self.process.wait()


# --- user-mode Linux -------------------------------------------------------------------------


class UmlBus:
    """A kernel in a process, on the host's own file system, with serial lines for streams."""

    def __init__(self, streams):
        self.streams = streams
        self.kernel = shutil.which("linux.uml", path=os.environ.get("PATH", "") + ":/usr/bin")
        if self.kernel is None:
            raise Failure(
                "this kernel lends no vcan here and user-mode-linux is not installed; "
                "'scripts/packages' installs it (or be root on a kernel with vcan)"
            )
        self.log = collections.deque(maxlen=50)
        self.pumps = []

    @staticmethod
    def memory_directory():
        """Where the machine's memory file lives (it is unlinked at once, and mapped executable)."""
        places = ["/dev/shm", tempfile.gettempdir(), "/var/tmp"]
        for place in places:
            try:
                state = os.statvfs(place)
            except OSError:
                continue
            free = state.f_bavail * state.f_frsize
            if not state.f_flag & os.ST_NOEXEC and free > (MEMORY_MB + 64) << 20:
                if os.access(place, os.W_OK | os.X_OK):
                    return place
        raise Failure(f"none of {', '.join(places)} has {MEMORY_MB} MB free and allows execution")

    def begin(self, command):
        memory = self.memory_directory()
        self.private = tempfile.mkdtemp(prefix="with-vcan.", dir="/tmp")
        shutil.copy(GUEST, os.path.join(self.private, "init.py"))
        self.lines, theirs = zip(*(socket.socketpair() for _ in range(5)))
        self.control = self.lines[CONTROL]
        console, console_end = os.pipe()
        argv = [self.kernel, f"mem={MEMORY_MB}M", f"uml_dir={self.private}", "umid=uml"]
        argv += ["rootfstype=hostfs", "rootflags=/", "rw", "quiet"]
        argv += ["con=null", "con0=null,fd:1", "ssl=null"]
        argv += [f"ssl{number}=fd:{end.fileno()}" for number, end in enumerate(theirs)]
        # Two boot-time benchmarks of RAID checksums take longer than all the rest of the boot.
        argv += ["initcall_blacklist=raid6_select_algo,calibrate_xor_blocks"]
        argv += [f"init={sys.executable}", "--", "-ISB", f"{self.private}/init.py", "uml"]
        self.process = subprocess.Popen(
            argv,
            stdin=subprocess.DEVNULL,
            stdout=console_end,
            stderr=console_end,
            pass_fds=[end.fileno() for end in theirs],
            start_new_session=True,
            env={**os.environ, "TMPDIR": memory},
        )
        os.close(console_end)
        for end in theirs:
            end.close()
        threading.Thread(target=self.keep_log, args=(console,), daemon=True).start()
        self.spec = marshal.dumps(
            {
                "argv": [os.fsencode(word) for word in command],
                "env": dict(os.environb),
                "cwd": os.getcwdb(),
                "host": os.uname().nodename.encode(),
                "umask": current_umask(),
                "terminals": self.streams.terminals,
                "merged": self.streams.merged,
                "size": self.streams.size(),
            }
        )

    def keep_log(self, console):
        with open(console, encoding="utf-8", errors="replace") as lines:
            for line in lines:
                self.log.append(line.strip())

    def ready(self):
        shutil.rmtree(self.private, ignore_errors=True)
        self.streams.go_raw()
        threading.Thread(target=self.pump_in, daemon=True).start()
        for number in (STDOUT, STDERR, TERMINAL):
            pump = threading.Thread(target=self.pump_out, args=(number,), daemon=True)
            pump.start()
            self.pumps.append(pump)

    def send(self, data):
        """In acknowledged pieces (vcan_guest.pieces tells why); nothing is the end."""
        line = self.lines[STDIN]
        for start in range(0, len(data), PIECE):
            piece = data[start : start + PIECE]
            line.sendall(len(piece).to_bytes(2, "big") + piece)
            if not line.recv(1):
                raise EOFError
        if not data:
            line.sendall(bytes(2))

    def pump_in(self):
        try:
            self.send(self.spec)
            self.send(b"")
            while True:
                data = b"" if self.streams.stdin_ignored else os.read(0, 65536)
                self.send(data)
                if not data:
                    return
        except (OSError, EOFError):
            pass

    def pump_out(self, number):
        fd = number - 1 if number != TERMINAL else self.streams.terminal_fd()
        broken = False
        while True:
            try:
                data = self.lines[number].recv(65536)
            except OSError:
                return
            if not data:
                return
            try:
                while data and not broken:
                    data = data[os.write(fd, data) :]
            except OSError:  # whoever read it has gone: let the command know
                broken = True
                self.control.sendall(b"close %d\n" % number)

    def complaint(self):
        words = ("panic", "error", "fail", "cannot", "denied", "not permitted")
        lines = [line for line in self.log if line and "[<" not in line]
        telling = [line for line in lines if any(word in line.lower() for word in words)]
        return f"user-mode Linux ended early: {(telling or lines or ['it said nothing'])[-1]}"

    def end(self):
        try:
            os.killpg(self.process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        self.process.wait()
        shutil.rmtree(self.private, ignore_errors=True)

    def drained(self):
        return not any(pump.is_alive() for pump in self.pumps)


def current_umask():
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


class Streams:
    """What our standard streams are, and the terminal's settings."""

    def __init__(self):
        self.terminals = {fd for fd in (0, 1, 2) if os.isatty(fd)}
        self.stdin_ignored = False
        if 0 in self.terminals and os.tcgetpgrp(0) != os.getpgrp():
            self.terminals.discard(0)  # in the background: the terminal's input is not ours
            self.stdin_ignored = True
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
        self.signal = 0  # that ended us, if one did
        self.status = None  # what we end with, once something other than the command decided it
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
        """Pass a signal on and give the command a moment."""
        self.status = status
        self.tell(f"signal {number}\n")
        self.deadline = time.monotonic() + GRACE_S

    def on_signal(self, number):
        """True: end now."""
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
        return False  # on a terminal the kernel has already given it to the command

    def on_message(self, words):
        """The final status, or None while there is none."""
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
        """The command has ended; what it wrote may still be on its way to a slow reader."""
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
        raise Failure(f"WITH_VCAN is '{choice}', but can only be 'uml' or 'kernel'")
    if choice != "uml":
        bus = KernelBus(streams)
        if bus.prefix is not None:
            return bus
        if choice == "kernel":
            raise Failure("the running kernel lends no vcan to this user (WITH_VCAN=kernel)")
    return UmlBus(streams)


def shell():
    return os.environ.get("SHELL") or "/bin/sh"


def main():
    for fd in (0, 1, 2):  # a closed stream must not become one of our sockets
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
    if supervisor and status == 128 + supervisor.signal:  # a calling shell has to see the signal
        signal.set_wakeup_fd(-1)
        signal.signal(status - 128, signal.SIG_DFL)
        os.kill(os.getpid(), status - 128)
    os._exit(status)


if __name__ == "__main__":
    main()
