"""The inside of with-vcan: process 1 of a user-mode Linux or of a PID namespace.

Brings the CAN interfaces up, runs one command, and reports its exit status to the host. It imports few modules, because
start-up time counts here (each import is read through hostfs).

`vcan_guest.py uml`             the kernel starts it as init; streams are serial lines
`vcan_guest.py kernel FD TTY`   `unshare` starts it; streams are inherited, FD is the control socket

Control messages, one a line. Host to guest: `signal N`, `size ROWS COLUMNS`, `close STREAM`. Guest to host: `ready`,
`exit STATUS`, `fail REASON`. The line of standard input first carries a description of the command (a marshalled
dictionary).
"""

import _thread
import fcntl
import marshal
import os
import signal
import sys
import termios

LINKS = b"""link set lo up
link add vcan0 type vcan
link add vcan1 type vcan
link add vxcan0 type vxcan peer name vxcan1
link set vcan0 up
link set vcan1 up
link set vxcan0 up
link set vxcan1 up
"""
MODULES = (
    "net/can/can",
    "net/can/can-raw",
    "net/can/can-bcm",
    "net/can/can-gw",
    "drivers/net/can/dev/can-dev",
    "drivers/net/can/vcan",
    "drivers/net/can/vxcan",
)
SYSTEM_PATH = b"/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
SYS_FINIT_MODULE = {"x86_64": 313, "aarch64": 273}
POWER_OFF = 0x4321FEDC

# Serial lines of user-mode Linux; the host uses the same numbers.
CONTROL, STDIN, STDOUT, STDERR, TERMINAL = range(5)


class Failure(Exception):
    """The bus could not be set up; the text is one line for the user."""


def read_exactly(fd, size):
    data = b""
    while len(data) < size:
        chunk = os.read(fd, size - len(data))
        if not chunk:
            raise EOFError
        data += chunk
    return data


def write_all(fd, data):
    while data:
        data = data[os.write(fd, data) :]


def read_line(fd):
    line = b""
    while not line.endswith(b"\n"):
        line += read_exactly(fd, 1)
    return line.decode().split()


# --- the bus ---------------------------------------------------------------------------------


def bring_links_up():
    """Creates the interfaces and brings them up with one call of ip(8)."""
    read_end, write_end = os.pipe()
    os.write(write_end, LINKS)
    os.close(write_end)
    error_read, error_write = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.dup2(read_end, 0)
        os.dup2(error_write, 1)
        os.dup2(error_write, 2)
        try:
            os.execvpe("ip", ["ip", "-batch", "-"], {b"PATH": SYSTEM_PATH})
        except OSError:
            os.write(2, b"ip(8) is missing (package iproute2)\n")
        os._exit(127)
    os.close(read_end)
    os.close(error_write)
    complaint = os.read(error_read, 4096).decode(errors="replace").strip()
    os.close(error_read)
    if os.waitpid(pid, 0)[1] != 0:
        raise Failure("cannot create the interfaces: " + (complaint.splitlines() or ["?"])[0])


def load_modules(libc):
    machine = os.uname()
    base = f"/usr/lib/uml/modules/{machine.release}/kernel/"
    for name in MODULES:
        try:
            fd = os.open(base + name + ".ko", os.O_RDONLY)
        except OSError as error:
            raise Failure(f"no kernel module {error.filename}") from None
        if libc.syscall(SYS_FINIT_MODULE[machine.machine], fd, b"", 0) != 0:
            raise Failure(f"kernel module {name} does not load")
        os.close(fd)


def mount_system(libc):
    def mount(kind, where, options=None):
        os.makedirs(where, exist_ok=True)
        libc.mount(kind, os.fsencode(where), kind, 0, options)

    mount(b"proc", "/proc")
    mount(b"sysfs", "/sys")
    mount(b"tmpfs", "/run", b"mode=755")
    mount(b"tmpfs", "/dev/shm", b"mode=1777")
    mount(b"devpts", "/dev/pts", b"ptmxmode=666")
    for name, target in (("fd", ""), ("stdin", "/0"), ("stdout", "/1"), ("stderr", "/2")):
        os.symlink("/proc/self/fd" + target, "/dev/" + name)
    return mount


def uncover(mount, path):
    """Mounts a host directory back in place that lies under one of our own mounts."""
    if path.startswith((b"/run/", b"/dev/shm/")):
        mount(b"hostfs", path, path)


def give_runtime_directory(environment):
    """Creates a runtime directory for sockets of this machine alone. In a directory that machines share, each would
    take the others' sockets for those of dead programs."""
    path = environment.setdefault(b"XDG_RUNTIME_DIR", b"/run/user/0")
    if path.startswith(b"/run/") and not os.path.isdir(path):
        os.makedirs(path)
        os.chmod(path, 0o700)


# --- the command -----------------------------------------------------------------------------


def start(spec, streams, terminal, own_session, inherited=()):
    """Forks and executes the command with the three streams; returns its process id."""
    pid = os.fork()
    if pid != 0:
        return pid
    try:
        if own_session:
            os.setsid()
        if terminal is not None:
            fcntl.ioctl(terminal, termios.TIOCSCTTY, 0)
        for number, fd in enumerate(streams):
            if fd != number:
                os.dup2(fd, number)
        os.closerange(3, 1024)
        for number in (signal.SIGPIPE, signal.SIGXFSZ, signal.SIGINT, signal.SIGQUIT):
            signal.signal(number, signal.SIG_IGN if number in inherited else signal.SIG_DFL)
        if spec["cwd"] is not None:
            os.umask(spec["umask"])
            os.chdir(spec["cwd"])
        os.execvpe(spec["argv"][0], spec["argv"], spec["env"])
    except OSError as error:
        what = os.fsdecode(spec["cwd"] if error.filename == spec["cwd"] else spec["argv"][0])
        os.write(2, f"with-vcan: {what}: {error.strerror}\n".encode(errors="surrogateescape"))
        os._exit(127 if isinstance(error, FileNotFoundError) else 126)


def wait_for(pid):
    """Reaps all children (process 1 inherits every orphan) until `pid` ends; returns its status as a shell would."""
    while True:
        ended, status = os.wait()
        if ended == pid:
            code = os.waitstatus_to_exitcode(status)
            break
    try:
        os.kill(-1, signal.SIGKILL)  # from process 1: all other processes
    except ProcessLookupError:
        pass
    return code if code >= 0 else 128 - code


def obey(control, pid, own_session, on_size, on_close):
    """Executes the host's messages until the host disconnects."""
    while True:
        words = read_line(control)
        try:
            if words[0] == "signal":
                (os.killpg if own_session else os.kill)(pid, int(words[1]))
            elif words[0] == "size":
                on_size(int(words[1]), int(words[2]))
            elif words[0] == "close":
                on_close(int(words[1]))
        except OSError:
            pass


# --- streams over serial lines ---------------------------------------------------------------


def open_line(number):
    """Opens a serial line that passes every byte unchanged."""
    fd = os.open(f"/dev/ttyS{number}", os.O_RDWR | os.O_NOCTTY)
    mode = termios.tcgetattr(fd)
    mode[0] = mode[1] = mode[3] = 0
    mode[2] = (mode[2] & ~(termios.CSIZE | termios.PARENB)) | termios.CS8 | termios.CREAD
    mode[6][termios.VMIN], mode[6][termios.VTIME] = 1, 0
    termios.tcsetattr(fd, termios.TCSANOW, mode)
    return fd


def pieces(line):
    """Yields the pieces that the host sends, each a length and the bytes; length 0 is the end.

    Each piece is acknowledged before the host sends the next. If a slow reader ever blocks a serial line of user-mode
    Linux (beyond its buffer of 4 KB), the line does not resume.
    """
    while True:
        size = int.from_bytes(read_exactly(line, 2), "big")
        if size == 0:
            return
        yield read_exactly(line, size)
        os.write(line, b"+")


def pump_in(line, sink, close):
    broken = False
    for data in pieces(line):
        try:
            if not broken:
                write_all(sink, data)
        except OSError:  # no reader any more
            broken = True
    if close:
        os.close(sink)


class PumpOut:
    """Copies the command's output to a serial line until all writers have closed it."""

    def __init__(self, source, line):
        self.source, self.line, self.closed = source, line, False
        self.running = _thread.allocate_lock()
        self.running.acquire()
        _thread.start_new_thread(self.run, ())

    def run(self):
        try:
            while True:
                data = os.read(self.source, 65536)
                if not data or self.closed:
                    break
                write_all(self.line, data)
        except OSError:  # a pseudo-terminal ends with EIO
            pass
        os.close(self.source)
        self.running.release()

    def finish(self):
        self.running.acquire()
        termios.tcdrain(self.line)


def run_on_lines(control, stdin_line, spec):
    """Runs the command with pipes or a pseudo-terminal, like its streams outside; returns its status."""
    terminals = spec["terminals"]  # the outside terminals among 0, 1, 2
    master = slave = None
    if terminals:
        master, slave = os.openpty()
        resize(slave, *spec["size"])
        if 0 not in terminals:  # the terminal outside is not in raw mode and adds carriage returns itself
            mode = termios.tcgetattr(slave)
            mode[1] &= ~termios.OPOST
            termios.tcsetattr(slave, termios.TCSANOW, mode)
    sources = {}
    streams = [slave] * 3
    if 0 not in terminals:
        streams[0], sink = os.pipe()
    else:
        sink = master
    if 1 not in terminals:
        sources[STDOUT], streams[1] = os.pipe()
    if 2 not in terminals:
        if spec["merged"]:
            streams[2] = streams[1]
        else:
            sources[STDERR], streams[2] = os.pipe()
    if terminals:
        sources[TERMINAL] = master

    lines = {number: open_line(number) for number in (STDOUT, STDERR, TERMINAL)}
    pid = start(spec, streams, slave, True)
    for fd in {fd for fd in streams if fd is not None}:
        os.close(fd)
    pumps = {number: PumpOut(os.dup(fd), lines[number]) for number, fd in sources.items()}
    for number, fd in sources.items():
        if number != TERMINAL:
            os.close(fd)

    def close(number):
        pumps[number].closed = True

    _thread.start_new_thread(pump_in, (stdin_line, sink, 0 not in terminals))
    _thread.start_new_thread(
        obey_or_power_off, (control, pid, lambda *size: resize(master, *size), close)
    )
    status = wait_for(pid)
    for pump in pumps.values():
        pump.finish()
    return status


def resize(terminal, rows, columns):
    size = b"".join(n.to_bytes(2, sys.byteorder) for n in (rows, columns, 0, 0))
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, size)


def obey_or_power_off(control, pid, on_size, on_close):
    try:
        obey(control, pid, True, on_size, on_close)
    except (OSError, EOFError):  # the host has disconnected: power off
        power_off()


def power_off():
    import ctypes

    os.sync()
    ctypes.CDLL(None).reboot(POWER_OFF)


# --- the two ways in -------------------------------------------------------------------------


def uml():
    import ctypes

    libc = ctypes.CDLL(None)
    mount = mount_system(libc)
    control = open_line(CONTROL)
    try:
        load_modules(libc)
        bring_links_up()
        stdin_line = open_line(STDIN)
        write_all(control, b"ready\n")
        spec = marshal.loads(b"".join(pieces(stdin_line)))
        for path in (spec["cwd"], spec["env"].get(b"TMPDIR", b"")):
            uncover(mount, path)
        give_runtime_directory(spec["env"])
        libc.sethostname(spec["host"], len(spec["host"]))
        status = run_on_lines(control, stdin_line, spec)
        os.sync()
        write_all(control, b"exit %d\n" % status)
        read_exactly(control, 1)  # the host ends this machine
    except Failure as failure:
        write_all(control, f"fail {failure}\n".encode())
        termios.tcdrain(control)
    except EOFError:
        pass
    except Exception as error:  # the exit of init is a kernel panic; report the reason to the user instead
        write_all(control, f"fail inside user-mode Linux: {error!r}\n".encode())
        termios.tcdrain(control)
    power_off()


def kernel(control, on_terminal, argv):
    inherited = [
        number
        for number in (signal.SIGINT, signal.SIGQUIT)
        if signal.signal(number, signal.SIG_IGN) == signal.SIG_IGN
    ]
    try:
        bring_links_up()
    except Failure as failure:
        write_all(control, f"fail {failure}\n".encode())
        sys.exit(125)
    write_all(control, b"ready\n")
    with open("/proc/self/environ", "rb") as file:  # exact: without the variables that Python adds
        environment = dict(item.split(b"=", 1) for item in file.read().split(b"\0") if b"=" in item)
    spec = {"argv": argv, "env": environment, "cwd": None}
    pid = start(spec, (0, 1, 2), None, not on_terminal, inherited)

    def follow():
        try:
            obey(control, pid, not on_terminal, lambda *_: None, lambda *_: None)
        except (OSError, EOFError):
            os.kill(-1, signal.SIGKILL)
            os._exit(125)

    _thread.start_new_thread(follow, ())
    write_all(control, b"exit %d\n" % wait_for(pid))


if os.getpid() != 1:  # this program kills all other processes when the command ends
    sys.exit("vcan_guest.py is for with-vcan alone")
while os.open("/dev/null", os.O_RDWR) <= 2:  # open files must not get the number of a closed stream
    pass
if sys.argv[1] == "uml":
    uml()
else:
    socket_fd, on_tty, *words = sys.argv[2:]
    kernel(int(socket_fd), on_tty == "tty", [os.fsencode(word) for word in words])
