#!/usr/bin/python3
"""Checks that all commands of docs/start/tour.md work as printed.

usage: scripts/with-vcan tests/tour/replay.py DIRECTORY_OF_LK_EMU [--cast FILE]

Types the commands of the tour into one shell and compares their output with the document. --cast writes the session as
an asciicast for asciinema.
"""

import json
import os
import pathlib
import selectors
import subprocess
import sys
import tempfile
import time

import session

ROOT = pathlib.Path(__file__).resolve().parents[2]
PATIENCE_S = 180  # time-out for a command with wrong output; longer than any command takes on a busy machine
END = "\x1e"  # marks the end of a command's output


class Shell:
    def __init__(self, programs, directory):
        for name in ("configs", "python"):
            (directory / name).symlink_to(ROOT / name)
        environment = {"PATH": f"{programs}:/usr/sbin:/usr/bin:/sbin:/bin", "HOME": str(directory), "LANG": "C.UTF-8",
                       "XDG_RUNTIME_DIR": str(directory), "PYTHONDONTWRITEBYTECODE": "1"}
        self.process = subprocess.Popen(["bash", "--noprofile", "--norc"], cwd=directory, env=environment,
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.out = selectors.DefaultSelector()
        self.out.register(self.process.stdout, selectors.EVENT_READ)

    def type(self, command, expected):
        """Returns the output, including that of background commands, once it is `expected` or at the time-out."""
        self.process.stdin.write(f"{command}\nprintf '{END}'\n".encode())
        self.process.stdin.flush()
        printed, ended, give_up = "", False, time.monotonic() + PATIENCE_S
        while not (ended and expected.fullmatch(printed)):
            if not self.out.select(max(0.0, give_up - time.monotonic())):
                return printed
            piece = os.read(self.process.stdout.fileno(), 65536).decode()
            ended = ended or END in piece
            printed += piece.replace(END, "")
            if not piece:
                return printed
        return printed

    def close(self):
        self.process.stdin.close()
        self.process.wait()


def write_cast(path, seen):
    """Writes an asciicast, version 2 (docs.asciinema.org), typed at a constant pace."""
    at, events = 0.5, []
    for command, printed in seen:
        for key in f"$ {command}\r\n":
            events.append((at, key))
            at += 0.03
        at += 0.3
        if printed:
            events.append((at, printed.replace("\n", "\r\n")))
        at += 1.2
    with open(path, "w", encoding="utf-8") as cast:
        cast.write(json.dumps({"version": 2, "width": 120, "height": 36, "title": "lk-emu in five minutes"}) + "\n")
        for when, text in events:
            cast.write(json.dumps([round(when, 2), "o", text], ensure_ascii=False) + "\n")


def main(programs, cast=None):
    typed = session.commands((ROOT / "docs/start/tour.md").read_text(encoding="utf-8"))
    seen = []
    with tempfile.TemporaryDirectory() as directory:
        shell = Shell(pathlib.Path(programs).resolve(), pathlib.Path(directory))
        for command, lines in typed:
            expected = session.pattern(lines)
            printed = shell.type(command, expected)
            print(f"$ {command}\n{printed}", end="", flush=True)
            if not expected.fullmatch(printed):
                sys.exit("\nThe tour says that this is printed:\n" + "\n".join(lines))
            seen.append((command, printed))
        shell.close()
    if cast:
        write_cast(cast, seen)


if __name__ == "__main__":
    main(sys.argv[1], *sys.argv[3:4])
