"""Shared by the commands of lk-emu that are written in Python, such as `lkemu.plot`."""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import os
import sys
import tempfile
from typing import BinaryIO, Callable, Iterator, List, NoReturn, Optional

from .errors import Error, StartError

# Libraries that a command needs from the start. Otherwise a campaign could run all night and then print no report.
LIBRARIES = {"campaign": ("jinja2", "regex", "scipy")}


def run(main: Callable[[], Optional[int]]) -> None:
    """Ends the process with the status that `main` returns, 0 for None. Prints one line on failure: status 2 for a
    StartError, 1 for other exceptions."""
    status = 0
    try:
        status = main() or 0
        sys.stdout.flush()
    except StartError as problem:
        status = tell(str(problem), 2)
    except (Error, OSError) as problem:
        status = 0 if isinstance(problem, BrokenPipeError) else tell(f"failed: {getattr(problem, 'strerror', None) or problem}", 1)
    except KeyboardInterrupt:
        status = 130
    sys.stderr.flush()
    os._exit(status)  # without flushing a closed standard output again


class Parser(argparse.ArgumentParser):
    """Reports wrong arguments as one line."""

    def error(self, message: str) -> NoReturn:
        raise StartError(f"{message} (see {self.prog} --help)")


def tell(problem: str, status: int) -> int:
    print(f"lk-emu: {printable(problem)}", file=sys.stderr)
    return status


@contextlib.contextmanager
def libraries(command: str, name: str) -> Iterator[None]:
    """Context for imports of libraries that only this command needs; `name` is the __name__ of its module.

    If a library is missing and the module runs as a program, ends it with one line that says how to install it.
    """
    try:
        yield
    except ImportError as problem:
        if name != "__main__":
            raise
        sys.exit(tell_missing(command, str(problem), [(problem.name or "").partition(".")[0]]))


def check_libraries(command: str) -> None:
    """Ends the process with one line if the command lacks libraries."""
    missing = [name for name in LIBRARIES.get(command, ()) if importlib.util.find_spec(name) is None]
    if missing:
        sys.exit(tell_missing(command, f"No module named {', '.join(map(repr, missing))}", missing))


def tell_missing(command: str, problem: str, missing: List[str]) -> int:
    packages = " ".join(f"python3-{name}" for name in missing)
    return tell(f"{command}: {sys.executable}: {problem}: apt install {packages}, or pip install 'lk-emu[{command}]'", 2)


def printable(text: str) -> str:
    """Returns the text on one line, with ? for control characters and invalid UTF-8."""
    return "".join(c if c.isprintable() else "?" for c in text)


@contextlib.contextmanager
def output_file(path: str, option: str) -> Iterator[BinaryIO]:
    """Yields a file that replaces `path` once it is written completely. Raises StartError."""
    part = ""
    try:
        with tempfile.NamedTemporaryFile(dir=os.path.dirname(path) or ".", suffix=".part", delete=False) as file:
            part = file.name
            yield file  # type: ignore[misc]
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(part, 0o666 & ~umask)
        os.replace(part, path)
        part = ""
    except OSError as problem:
        raise StartError(f"{option}: cannot write {path}: {problem.strerror}") from None
    finally:
        if part:
            os.unlink(part)


def parse_ids(text: str) -> List[int]:
    """Parses "1-4" or "1,3,7-9"; returns the sorted IDs. Raises StartError."""
    ids: List[int] = []
    for part in text.split(","):
        first, dash, last = part.partition("-")
        numbers = [first, last] if dash else [first, first]
        if not all(n.isascii() and n.isdigit() and 1 <= int(n) <= 32 for n in numbers):
            raise StartError(f'--ids: "{part}" is not an ID from 1 to 32 or a range of IDs, such as 1-4')
        if int(numbers[1]) < int(numbers[0]):
            raise StartError(f"--ids: the range {part} runs backwards")
        ids += range(int(numbers[0]), int(numbers[1]) + 1)
    if len(set(ids)) < len(ids):
        raise StartError(f"--ids: {text} has an ID twice")
    return sorted(ids)
