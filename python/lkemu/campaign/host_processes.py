"""Finds, measures and kills the processes of a case, which are descendants of this process."""

from __future__ import annotations

import ctypes
import os
import select
import signal
from dataclasses import dataclass
from typing import Collection, Iterator, List

from ..errors import StartError

PR_SET_PDEATHSIG, PR_SET_CHILD_SUBREAPER = 1, 36
CLONE_NEWUSER, CLONE_NEWNET = 0x10000000, 0x40000000
TICKS = os.sysconf("SC_CLK_TCK")
PAGE = os.sysconf("SC_PAGE_SIZE")

libc = ctypes.CDLL(None, use_errno=True)


def adopt_orphans() -> None:
    """Makes this process the parent of descendants whose own parent exits."""
    libc.prctl(PR_SET_CHILD_SUBREAPER, 1)


def end_with_parent(by: int = signal.SIGKILL) -> None:
    libc.prctl(PR_SET_PDEATHSIG, by)
    signal.pthread_sigmask(signal.SIG_SETMASK, [])


def children_of(parent: int) -> List[int]:
    """Searches all of /proc if the kernel lacks CONFIG_PROC_CHILDREN."""
    try:
        found: List[str] = []
        for thread in os.listdir(f"/proc/{parent}/task"):
            with open(f"/proc/{parent}/task/{thread}/children", encoding="ascii") as file:
                found += file.read().split()
        return [int(pid) for pid in found]
    except OSError:
        return [int(name) for name in os.listdir("/proc") if name.isdecimal() and _stat(int(name))[1:2] == [str(parent)]]


def descendants(parent: int, excluded: Collection[int]) -> Iterator[int]:
    """Yields all descendants except those in `excluded`. Yields children of `excluded` processes too."""
    for pid in children_of(parent):
        if pid not in excluded:
            yield pid
        yield from descendants(pid, excluded)


def end_descendants(excluded: Collection[int] = ()) -> None:
    """Kills descendants until there are none. Includes orphans that become children of this process meanwhile."""
    while found := list(descendants(os.getpid(), excluded)):
        for pid in found:
            try:
                ended = os.pidfd_open(pid)
            except ProcessLookupError:
                continue
            try:
                signal.pidfd_send_signal(ended, signal.SIGKILL)
                select.select([ended], [], [])
                os.waitpid(pid, 0)
            except (ProcessLookupError, ChildProcessError):
                pass  # reaped by its own parent
            finally:
                os.close(ended)


@dataclass
class Usage:
    processor_s: float = 0.0  # including children that have exited
    memory: int = 0  # resident bytes
    is_running: bool = False  # running, runnable, or waiting for a disk

    def add(self, pid: int) -> None:
        fields = _stat(pid)
        if len(fields) > 21:
            self.processor_s += sum(map(int, fields[11:15])) / TICKS
            self.memory += int(fields[21]) * PAGE
            self.is_running = self.is_running or fields[0] in "RD"


def usage_of(pids: Iterator[int]) -> Usage:
    usage = Usage()
    for pid in pids:
        usage.add(pid)
    return usage


def _stat(pid: int) -> List[str]:
    """Returns the fields of /proc/PID/stat after the name: state, parent, …"""
    try:
        with open(f"/proc/{pid}/stat", encoding="ascii", errors="replace") as file:
            return file.read().rpartition(")")[2].split()
    except OSError:
        return []


def enter_own_network() -> None:
    if libc.unshare(CLONE_NEWNET) == 0:
        return
    user, group = os.geteuid(), os.getegid()
    if libc.unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0:
        raise StartError(f"cannot create a network namespace: {os.strerror(ctypes.get_errno())}; run the campaign under scripts/with-vcan, or set "
                         'bus = "slcan-tcp"')  # fmt: skip
    for file, text in (("setgroups", "deny"), ("uid_map", f"0 {user} 1\n"), ("gid_map", f"0 {group} 1\n")):
        with open(f"/proc/self/{file}", "w", encoding="ascii") as out:
            out.write(text)
