"""The two buses of with-vcan, `KernelBus` and `UmlBus`, with the same interface.

`begin(command)` starts the inside (vcan_guest.py), which communicates over the socket `control`. `ready()` is called
once the bus is up. `end()` leaves no process and no file.
"""

import collections
import marshal
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading

MEMORY_MB = 512
PIECE = 3000  # bytes of unacknowledged standard input
GUEST = os.path.join(os.path.dirname(os.path.realpath(__file__)), "vcan_guest.py")
ISOLATE = ["unshare", "--net", "--pid", "--fork", "--kill-child", "--mount-proc"]
PROBE = b"link add vcan0 type vcan\nlink add vxcan0 type vxcan peer name vxcan1\n"
CONTROL, STDIN, STDOUT, STDERR, TERMINAL = range(5)  # serial lines, as in vcan_guest.py


class Failure(Exception):
    """No bus; the text is one line for the user."""


def environment():
    """Returns our initial environment byte for byte (Python itself may add LC_CTYPE)."""
    with open("/proc/self/environ", "rb") as file:
        return dict(item.split(b"=", 1) for item in file.read().split(b"\0") if b"=" in item)


def working_directory():
    try:
        return os.getcwdb()
    except FileNotFoundError:
        raise Failure("the working directory has been deleted") from None


def current_umask():
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


# --- the running kernel ----------------------------------------------------------------------


class KernelBus:
    """Namespaces of the running kernel: network for the bus, PID so that all processes end with it."""

    def __init__(self, streams):
        self.streams = streams
        self.prefix = None
        # As root, or as root of a user namespace if the distribution allows those.
        for prefix in (ISOLATE, [*ISOLATE, "--map-root-user"]):
            if self.offers_vcan(prefix):
                self.prefix = prefix
                break

    @staticmethod
    def offers_vcan(prefix):
        path = "/usr/sbin:/sbin:" + os.environ.get("PATH", os.defpath)
        try:
            probe = subprocess.run(
                [*prefix, "ip", "-batch", "-"],
                input=PROBE,
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
        # Without a terminal, signals reach the command only through us, and only once.
        self.process = subprocess.Popen(
            argv,
            pass_fds=[theirs.fileno()],
            start_new_session=not on_terminal,
            env=environment(),
        )
        theirs.close()

    def ready(self):
        pass

    def complaint(self):
        return "the command's namespace has ended"

    def end(self):
        self.process.kill()  # --kill-child also kills the namespace's process 1, which ends all others
        self.process.wait()


# --- user-mode Linux -------------------------------------------------------------------------


class UmlBus:
    """A kernel in a process, on the host's own file system, with serial lines as streams."""

    def __init__(self, streams):
        self.streams = streams
        self.kernel = shutil.which("linux.uml", path=os.environ.get("PATH", "") + ":/usr/bin")
        if self.kernel is None:
            raise Failure(
                "this user cannot use vcan of the running kernel, and user-mode-linux is not installed: "
                "apt-get install user-mode-linux iproute2, or run as root on a kernel with vcan"
            )
        self.log = collections.deque(maxlen=50)
        self.pumps = []

    @staticmethod
    def memory_directory():
        """Returns a directory for the machine's memory file, which is unlinked at once and mapped executable."""
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
        # Skips two boot-time benchmarks of RAID checksums, which take longer than the rest of the boot.
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
                "env": environment(),
                "cwd": working_directory(),
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
        """Sends the data in acknowledged pieces (see vcan_guest.pieces); empty data marks the end."""
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
            except OSError:  # the reader has exited: tell the command
                broken = True
                self.control.sendall(b"close %d\n" % number)

    def complaint(self):
        words = ("panic", "error", "fail", "cannot", "denied", "not permitted")
        lines = [line for line in self.log if line and "[<" not in line]
        telling = [line for line in lines if any(word in line.lower() for word in words)]
        return f"user-mode Linux ended early: {(telling or lines or ['no output'])[-1]}"

    def end(self):
        try:
            os.killpg(self.process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        self.process.wait()
        shutil.rmtree(self.private, ignore_errors=True)

    def drained(self):
        return not any(pump.is_alive() for pump in self.pumps)
