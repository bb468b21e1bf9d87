"""Runs the program on a bus of any kind, for hosts in Python."""

import contextlib
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import unittest

PROGRAM = sys.argv.pop(1) if len(sys.argv) > 1 else "lk-emu"
PATIENCE_S = 20


def free_port() -> int:
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        return sock.getsockname()[1]


class Emulator:
    def __init__(self, *arguments: str, control: str = "none"):
        self.control = control
        self.process = subprocess.Popen(
            [PROGRAM, "--rom", ":memory:", "--control", control, *arguments],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.ready = self.process.stdout.readline().strip()
        assert self.ready.startswith("lk-emu ready"), self.process.communicate()

    def stop(self) -> str:
        """Stops the program; returns the summary. `errors` contains the log."""
        self.process.send_signal(signal.SIGTERM)
        out, self.errors = self.process.communicate(timeout=PATIENCE_S)
        assert self.process.returncode == 0, self.errors
        return out

    def advance(self, time: str) -> None:
        done = subprocess.run([PROGRAM, "ctl", "--socket", self.control, "advance", time],
                              capture_output=True, text=True, timeout=PATIENCE_S, check=False)
        assert done.returncode == 0, done


@contextlib.contextmanager
def emulator(*arguments: str, control: str = "none"):
    running = Emulator(*arguments, control=control)
    try:
        yield running
    finally:
        if running.process.poll() is None:
            running.process.kill()
            running.process.communicate()


class TestCase(unittest.TestCase):
    def setUp(self):
        own = tempfile.TemporaryDirectory()
        self.addCleanup(own.cleanup)
        self.directory = own.name

    def path(self, name: str) -> str:
        return os.path.join(self.directory, name)

    def run_program(self, *arguments: str) -> str:
        done = subprocess.run([PROGRAM, *arguments], capture_output=True, text=True,
                              timeout=PATIENCE_S, check=False)
        self.assertEqual(done.returncode, 0, done)
        return done.stdout

    def refused(self, *arguments: str) -> str:
        done = subprocess.run([PROGRAM, *arguments], capture_output=True, text=True,
                              timeout=PATIENCE_S, check=False)
        self.assertEqual(done.returncode, 2, done)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        return done.stderr


def count(summary: str, what: str) -> int:
    """Returns the number at the end of a line of the summary; 0 without such a line."""
    found = re.search(re.escape(what) + r"\s+(\d+)$", summary, re.MULTILINE)
    return int(found[1]) if found else 0
