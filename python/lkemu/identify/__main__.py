"""Command line of `lk-emu identify` (`python3 -m lkemu.identify`)."""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from typing import Any, List, Optional

from ..command import Parser, libraries, output_file, printable, run
from . import plan
from .motor import Unusable, is_path, load_motor, run_program

EPILOG = """
Example of an experiment, and of a comparison with it later:
  lk-emu identify --plan excite.py --motor mg4005 --id 1
  python3 excite.py --interface socketcan --channel can0 --log my_motor.log
  lk-emu identify my_motor.log --motor mg4005 -o my_motor.toml --report my_motor.html
  lk-emu identify may.log --motor mg4005 --expect my_motor.toml

Exit status: 0 done, 1 a value differs from --expect, 2 unusable input.
"""
LONGEST_TEXT = 1 << 20  # bytes of a motor file


def parse(words: List[str]) -> argparse.Namespace:
    parser = Parser("lk-emu identify", description="Estimate a motor's parameters from its logs, and write a motor file", epilog=EPILOG,
                    formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False)  # fmt: skip
    parser.add_argument("logs", nargs="*", metavar="LOG", help="log of candump -L of the motor at work, or of the script of --plan")
    parser.add_argument("--motor", default="mf7015", help="motor whose gear, encoder and torque constant are used: a name or a file "
                        "(default %(default)s)")  # fmt: skip
    parser.add_argument("--generation", help="firmware of the drives, one of legacy, late-legacy, v235, v236, v236b, seen "
                        "(default: as the log shows)")  # fmt: skip
    parser.add_argument("--id", type=int, help="only this drive (default: all in the log)")
    parser.add_argument("-o", "--output", metavar="FILE", help="motor file to write")
    parser.add_argument("--report", metavar="FILE", help="report with plots to write, one HTML file")
    parser.add_argument("--expect", metavar="FILE", help="earlier motor file to compare with; prints what has changed")
    parser.add_argument("--plan", metavar="FILE", help="write a Python script that moves drive --id for 30 s and logs it, instead of "
                        "reading a log")  # fmt: skip
    given = parser.parse_args(words)
    if given.id is not None and not 1 <= given.id <= 32:
        raise Unusable(f"identify: --id: {given.id} is not in the range 1..32")
    if not given.logs and given.plan is None:
        raise Unusable("identify: missing log; to make one, write a script with --plan FILE")
    if given.logs and given.plan is not None:
        raise Unusable("identify: give a log or --plan, not both")
    if given.plan is not None:
        for option in ("output", "report", "expect"):
            if getattr(given, option) is not None:
                raise Unusable(f"identify: --{option} needs a log and cannot be used with --plan")
    return given


def write_text(path: str, option: str, text: str) -> None:
    with output_file(path, option) as file:
        file.write(text.encode())


def read_text(path: str) -> str:
    try:
        if not os.path.isfile(path) and os.path.exists(path):
            raise Unusable(f"identify: {printable(path)} is not a regular file")
        with open(path, encoding="utf-8", errors="replace") as file:
            text = file.read(LONGEST_TEXT + 1)
    except OSError as problem:
        raise Unusable(f"identify: cannot read {printable(path)}: {problem.strerror}") from None
    if len(text) > LONGEST_TEXT:
        raise Unusable(f"identify: {printable(path)} is larger than {LONGEST_TEXT} bytes")
    return text


def same_file(a: Optional[str], b: Optional[str]) -> bool:
    if not a or not b:
        return False
    return a == b or (os.path.exists(a) and os.path.exists(b) and os.path.samefile(a, b))


def write_motor(path: str, text: str) -> None:
    """Writes `text` if it is a valid motor file. Raises Unusable otherwise."""
    with tempfile.TemporaryDirectory() as folder:
        tried = os.path.join(folder, "motor.toml")
        write_text(tried, "--output", text)
        try:
            run_program("motors", tried)
        except Unusable as problem:
            reason = str(problem).replace(tried, path)
            raise Unusable(f"identify: the estimates give an invalid motor file: {reason}") from None
    write_text(path, "--output", text)


def compare(found: Any, expected: int, file: str) -> int:
    if not found.compared:
        raise Unusable(f"identify: nothing to compare: the log gives no value of {printable(file)} within 15 %")
    for line in found.lines:
        print(line)
    if not found.lines:
        print(f"{found.compared} of {expected} values compared with {printable(file)}: no change")
    if found.not_compared:
        print(f"not compared: {', '.join(found.not_compared)}")
    return 1 if found.lines else 0


def read_logs(given: argparse.Namespace) -> int:
    with libraries("identify", __name__):
        from .logs import FEWEST_SAMPLES, read_tracks
        from .motor_file import expected_values, motor_text
        from .quantities import changes, identify
        from .report import report_html, table_text

    if same_file(given.output, given.expect) or same_file(given.output, given.motor):
        raise Unusable("identify: --output would overwrite the file of --expect or --motor")
    expected = expected_values(read_text(given.expect), given.expect) if given.expect else []
    motor = load_motor(given.motor)
    generation = given.generation
    if generation == "seen":
        generation = motor.data.get("seen_generation", "seen")
    for log in given.logs:
        if os.path.exists(log) and not os.path.isfile(log):
            raise Unusable(f"identify: {printable(log)} is not a regular file")
    drives = [identify(track) for track in read_tracks(given.logs, given.motor, motor, generation, given.id)]
    if not drives:
        which = f"drive {given.id} has" if given.id else "all drives have"
        needed = f"{FEWEST_SAMPLES} replies to 0x9C or motion commands"
        raise Unusable(f"identify: {which} too few samples: {needed} are needed")
    if len(drives) > 1 and (given.output or given.expect):
        raise Unusable(f"identify: the log has {len(drives)} drives; choose one with --id")
    for drive in drives:
        print(table_text(drive), end="")
    if given.report:
        write_text(given.report, "--report", report_html(drives, given.logs))
    if given.output:
        base = os.path.abspath(given.motor) if is_path(given.motor) else given.motor
        write_motor(given.output, motor_text(drives[0], base, given.logs))
    return compare(changes(drives[0], expected, printable(given.expect)), len(expected), given.expect) if given.expect else 0


def main() -> None:
    given = parse(sys.argv[1:])
    if given.plan is None:
        status = read_logs(given)
        if status:
            sys.stdout.flush()
            sys.exit(status)
        return
    script, summary = plan.write_plan(load_motor(given.motor), given.motor, given.id, given.generation)
    write_text(given.plan, "--plan", script)
    print(given.plan, summary)


if __name__ == "__main__":
    run(main)
