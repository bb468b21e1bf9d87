"""Finds a CAN bus that no other program uses and locks it while lk-emu runs on it."""

from __future__ import annotations

import fcntl
import glob
import os
import re
import socket
import stat
import struct
import tempfile
from typing import Any, Dict, List, NamedTuple, Optional, Set

from .client import Client
from .errors import Error, StartError

SIOCGIFFLAGS = 0x8913
IFF_UP = 1
CAP_NET_ADMIN = 12
MOST_BUSES = 64  # assumed: more than any test machine uses at a time
PATIENCE_S = 2.0
FIRST_PORT = 29536
HINT = "run under scripts/with-vcan, or make one: sudo ip link add {0} type vcan && sudo ip link set {0} up"


class Claim(NamedTuple):
    """A bus that we have locked. Pass `lock` on to lk-emu: the bus is taken until the last holder ends."""

    bus: str
    lock: int  # file descriptor
    create: bool  # the interface does not exist yet


def claim_free_bus(may_create: Optional[bool] = None) -> Claim:
    """Claims an unused vcanN that is up, or a name for a new one. `may_create`: None means if permissions allow."""
    check_can_support()
    interfaces = {name for _, name in socket.if_nameindex() if re.fullmatch(r"vcan\d+", name)}
    spoken_for = buses_in_use()
    for bus in sorted(interfaces, key=lambda name: int(name[4:])):
        if bus not in spoken_for and is_up(bus):
            lock = try_lock(bus)
            if lock is not None:
                return Claim(bus, lock, create=False)
    names = [f"vcan{n}" for n in range(MOST_BUSES) if f"vcan{n}" not in interfaces]
    if may_create is False or (may_create is None and not may_make_interfaces()):
        found = f"{len(interfaces)} of {len(interfaces)} in use or down" if interfaces else "there is no vcan interface"
        raise StartError(f"no free CAN bus ({found}), and no permission to make one; " + HINT.format(names[0]))
    for bus in names:
        lock = try_lock(bus) if bus not in spoken_for else None
        if lock is not None:
            return Claim(bus, lock, create=True)
    raise StartError(f"no free CAN bus: vcan0 to vcan{MOST_BUSES - 1} are all in use")


def claim_any_bus(may_create: Optional[bool] = None) -> Claim:
    """Claims a free CAN bus, or a local port for slcan if no CAN bus is available."""
    try:
        return claim_free_bus(may_create)
    except StartError:
        pass
    for port in range(FIRST_PORT, FIRST_PORT + MOST_BUSES):
        bus = f"slcan-tcp:{port}"
        lock = try_lock(bus)
        if lock is not None and port_is_free(port):
            return Claim(bus, lock, create=False)
        if lock is not None:
            os.close(lock)
    raise StartError(f"no free bus: ports {FIRST_PORT} to {FIRST_PORT + MOST_BUSES - 1} are all in use")


def port_is_free(port: int) -> bool:
    with socket.socket() as sock:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as lk-emu does
        try:
            sock.bind(("127.0.0.1", port))
        except OSError:
            return False
    return True


def can_args(bus: str) -> Dict[str, Any]:
    """Returns the arguments of python-can's can.Bus for a bus of this name (docs/guides/buses.md)."""
    scheme, colon, rest = bus.partition(":")
    if not colon:
        return {"interface": "socketcan", "channel": bus}
    if scheme == "slcan-pty":
        return {"interface": "slcan", "channel": rest, "sleep_after_open": 0.0}
    address, _, port = rest.rpartition(":")
    host = "127.0.0.1" if address in ("", "0.0.0.0", "localhost") else address
    if scheme == "slcan-tcp":
        port = port.removesuffix("?acks=no")
        return {"interface": "slcan", "channel": f"socket://{host}:{port}", "sleep_after_open": 0.0}
    if scheme == "udp-multicast" and "?" not in rest and re.fullmatch(r"[0-9.]+:[0-9]+", rest):
        return {"interface": "udp_multicast", "channel": address, "port": int(port), "hop_limit": 0}
    if scheme == "socketcand":
        return {"interface": "socketcand", "channel": "can0", "host": host.strip("[]"), "port": int(port)}
    raise Error(f"{bus}: docs/guides/buses.md says how to connect")


def check_can_support() -> None:
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except (OSError, AttributeError):
        raise StartError("this kernel has no CAN sockets: run under scripts/with-vcan") from None


def is_up(interface: str) -> bool:
    request = struct.pack("16sH14x", interface.encode(), 0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        try:
            answer = fcntl.ioctl(any_socket, SIOCGIFFLAGS, request)
        except OSError:
            return False
    return bool(struct.unpack("16sH14x", answer)[1] & IFF_UP)


def may_make_interfaces() -> bool:
    with open("/proc/self/status", encoding="ascii", errors="replace") as file:
        found = re.search(r"^CapEff:\s*([0-9a-f]+)", file.read(), re.MULTILINE)
    return found is not None and bool(int(found[1], 16) >> CAP_NET_ADMIN & 1)


# --- buses in use --------------------------------------------------------------------------------


def runtime_directory() -> str:
    """Returns the directory of lk-emu's control sockets, chosen as lk-emu does; creates it if needed."""
    above = os.environ.get("XDG_RUNTIME_DIR")
    path = os.path.join(above, "lk-emu") if above and os.path.isdir(above) else f"/tmp/lk-emu-{os.geteuid()}"
    try:
        os.mkdir(path, 0o700)
    except FileExistsError:
        pass
    except OSError as problem:
        raise StartError(f"{path}: {problem.strerror}") from None
    about = os.lstat(path)
    ours = stat.S_ISDIR(about.st_mode) and (about.st_uid == os.geteuid() or about.st_uid == owner_of_new_files(path))
    if not ours:
        raise StartError(f"{path} belongs to another user: remove it, or set XDG_RUNTIME_DIR")
    if about.st_mode & 0o077:
        raise StartError(f"{path} is open to others: chmod 700 {path}")
    return path


def owner_of_new_files(directory: str) -> int:
    """Returns the real user: inside user-mode Linux all processes are root, but files belong to the caller."""
    try:
        fd, name = tempfile.mkstemp(prefix=".lk-emu-", dir=directory)
    except OSError:
        return os.geteuid()
    os.unlink(name)
    owner = os.fstat(fd).st_uid
    os.close(fd)
    return owner


def network() -> str:
    """Returns an ID of the set of interfaces that this process sees: each container has its own vcan0."""
    return str(os.stat("/proc/self/ns/net").st_ino)


def try_lock(bus: str) -> Optional[int]:
    path = os.path.join(runtime_directory(), f"{bus}-{network()}.lock")
    lock = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(lock)
        return None
    return lock


def buses_in_use() -> Set[str]:
    """Returns the buses of every lk-emu that answers on its control socket and sees the same interfaces."""
    buses: Set[str] = set()
    for path in glob.glob(os.path.join(glob.escape(runtime_directory()), "*.sock")):
        buses.update(buses_behind(path))
    return buses


def buses_behind(path: str) -> List[str]:
    """Returns the buses of the lk-emu at a socket; none if in another network, the socket's name if busy."""
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as sock:
            sock.settimeout(PATIENCE_S)
            sock.connect(path)
            pid = struct.unpack("3i", sock.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, 12))[0]
    except OSError:
        return []
    if not sees_our_network(pid):
        return []
    client = Client(path, PATIENCE_S, Error)
    try:
        return [bus["bus"] for bus in client.get("/status")["buses"]]
    except (Error, KeyError, TypeError):
        return [os.path.basename(path).rsplit("-", 1)[0]]
    finally:
        client.close()


def sees_our_network(pid: int) -> bool:
    if pid == 0:  # in another PID namespace
        return False
    try:
        return str(os.stat(f"/proc/{pid}/ns/net").st_ino) == network()
    except OSError:
        return True  # no permission to look: assume so, rather than use one bus twice
