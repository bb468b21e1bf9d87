"""Steps of a test run: one line each, with wall and CPU time; the output of a step is shown only when it fails."""

import os
import resource
import subprocess
import sys
import tempfile
import time

LAST_LINES = 60


class Failed(Exception):
    """A step failed; the text is one line for people."""


def cpu_s():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


class Steps:
    def __init__(self):
        self.start = time.monotonic()

    def seconds(self):
        return time.monotonic() - self.start

    def run(self, name, command, may_fail=False):
        """Runs the command. On a terminal its output is visible; elsewhere only its last lines, if it fails."""
        command = [str(part) for part in command]
        start, cpu = time.monotonic(), cpu_s()
        with tempfile.TemporaryFile("w+", errors="replace") as log:
            output = None if sys.stdout.isatty() else log
            try:
                status = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=output, stderr=output).returncode
            except FileNotFoundError:
                raise Failed(f"{command[0]} is not installed; scripts/packages build run test installs it") from None
            print(f"{name:20} {time.monotonic() - start:6.0f} s   CPU {cpu_s() - cpu:6.0f} s", flush=True)
            if status and not may_fail:
                log.seek(0)
                sys.stdout.write("".join(log.readlines()[-LAST_LINES:]))
                raise Failed(f"{name} failed; to repeat it: {' '.join(command)}")
