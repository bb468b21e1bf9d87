"""Steps of a test run: one line each, with wall and CPU time. The output of a step is shown only when it fails."""

import resource
import shutil
import subprocess
import sys
import time

LAST_LINES = 60


class Failed(Exception):
    """A step failed; the text is one line for the user."""


def cpu_s():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


class Steps:
    def __init__(self):
        self.start = time.monotonic()

    def seconds(self):
        return time.monotonic() - self.start

    def run(self, name, command, may_fail=False):
        """Runs the command; a terminal shows the latest line of its output meanwhile. Returns all lines."""
        command = [str(part) for part in command]
        start, cpu = time.monotonic(), cpu_s()
        lines = []
        try:
            with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                  text=True, errors="replace") as process:
                for line in process.stdout:
                    lines.append(line)
                    show_progress(f"{name}: {line.strip()}")
        except FileNotFoundError:
            raise Failed(f"{command[0]} is not installed; scripts/packages build run test installs it") from None
        show_progress("")
        print(f"{name:20} {time.monotonic() - start:6.0f} s   CPU {cpu_s() - cpu:6.0f} s", flush=True)
        if process.returncode and not may_fail:
            sys.stdout.write("".join(lines[-LAST_LINES:]))
            raise Failed(f"{name} failed; to repeat it: {' '.join(command)}")
        return lines


def show_progress(text):
    if sys.stdout.isatty():
        print(f"\r\x1b[K{text[:shutil.get_terminal_size().columns - 1]}", end="", flush=True)
