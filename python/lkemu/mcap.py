"""Writes a recording as an MCAP file, for Foxglove and PlotJuggler: `python3 -m lkemu.mcap RECORDING`.

The format is in docs/reference/formats.md.
"""

from __future__ import annotations

import json
import os
import subprocess
from typing import Any, Dict, Iterator, List, Optional, Tuple

from . import __version__, command
from .command import StartError
from .mcap_writer import McapWriter
from .program import find_program

ATTACHED = (".json", ".toml")
LARGEST_ATTACHMENT, LONGEST_LINE = 16 << 20, 1 << 20  # bytes; above anything that lk-emu writes (assumed)


def main(arguments: Optional[List[str]] = None) -> None:
    parser = command.Parser(prog="python3 -m lkemu.mcap", description="Write a recording as an MCAP file, for Foxglove and PlotJuggler")
    parser.add_argument("recording", metavar="RECORDING", help="the directory that lk-emu --record wrote")
    parser.add_argument("-o", "--output", metavar="FILE", help="the MCAP file (default: RECORDING.mcap)")
    given = parser.parse_args(arguments)
    output = given.output or os.path.normpath(given.recording) + ".mcap"
    writer = McapWriter(f"lk-emu {__version__}")
    attach_files(writer, given.recording)
    add_directives(writer, given.recording)
    frames = add_frames(writer, given.recording)
    with command.output_file(output, "--output") as file:
        writer.write(file)
    print(command.printable(f"{output}: {frames} frame{'s' * (frames != 1)}"))


def attach_files(writer: McapWriter, recording: str) -> None:
    """Attaches the files that describe the robot: configuration, motors, ROM."""
    for directory, directories, names in os.walk(recording):
        directories.sort()
        for name in sorted(names):
            path = os.path.join(directory, name)
            if name.endswith(ATTACHED):
                with open_file(path) as file:
                    kind = "application/json" if name.endswith(".json") else "application/toml"
                    data = file.read(LARGEST_ATTACHMENT + 1)
                if len(data) > LARGEST_ATTACHMENT:
                    raise StartError(f"mcap: {path}: is larger than {LARGEST_ATTACHMENT >> 20} MiB, so lk-emu did not write it")
                writer.attach(os.path.relpath(path, recording), kind, data)


def add_directives(writer: McapWriter, recording: str) -> None:
    path = os.path.join(recording, "directives.jsonl")
    for number, line in whole_lines(path):
        try:
            directive = json.loads(line)
            writer.message("/directives", "lk_emu.Directive", directive["time_ns"], directive)
        except (ValueError, KeyError, TypeError, RecursionError):
            raise StartError(f"mcap: {path}:{number}: not as lk-emu writes it") from None


def add_frames(writer: McapWriter, recording: str) -> int:
    """Adds each frame and its decoded values; returns the number of frames."""
    path = os.path.join(recording, "frames.log")
    decoded_frames = decoded(recording)
    count = 0
    for number, line in whole_lines(path):
        frame = next(decoded_frames, {})
        if frame.get("line") != number:
            raise StartError(f"mcap: {path}:{number}: is not a frame of candump")
        try:
            time_ns, bus, raw = read_line(line)
            writer.message(f"/{bus}/frames", "lk_emu.Frame", time_ns, raw)
        except ValueError:
            raise StartError(f"mcap: {path}:{number}: not as lk-emu writes it") from None
        values = {key: value for key, value in frame.get("values", {}).items() if isinstance(value, (int, float))}
        if values and frame["drive"]:
            topic, schema = (f"/{bus}/{frame['drive']}", "lk_emu.Reply") if raw["from"] == "drive" else (f"/{bus}/{frame['drive']}/command", "lk_emu.Command")
            writer.message(topic, schema, time_ns, values)
        count += 1
    for _ in decoded_frames:
        pass  # skips a truncated last line; raises if lk-emu decode failed
    return count


def decoded(recording: str) -> Iterator[Dict[str, Any]]:
    """Yields the frames of `lk-emu decode --json`. Raises StartError with its error message."""
    words = [find_program(), "decode", "--json", "--lang", "en", recording]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None and process.stderr is not None
        for line in process.stdout:
            message = json.loads(line)
            if message["type"] == "frame":
                yield message
        problem = process.stderr.read().strip()
    if process.returncode != 0:
        raise StartError(problem.removeprefix("lk-emu: ") or f"lk-emu decode ended with status {process.returncode}")


def read_line(line: str) -> Tuple[int, str, Dict[str, Any]]:
    """Parses a line such as "(0000000000.001000) vcan0 141#9C00000000000000 T" into time, bus and frame."""
    stamp, rest = line.split(" ", 1)
    bus, text, direction = rest.rsplit(" ", 2)
    seconds, fraction = stamp.strip("()").split(".")
    id, data = text.split("#", 1)
    frame: Dict[str, Any] = {"from": {"T": "host", "R": "drive"}.get(direction, "")}
    if id != "rs485":
        frame["id"] = int(id, 16) & 0x1FFFFFFF  # without the flag of an error frame
    frame["data"] = [] if data[:1] in ("R", "#") else list(bytes.fromhex(data))
    frame["line"] = line
    return int(seconds) * 10**9 + int(fraction.ljust(9, "0")), bus, frame


def whole_lines(path: str) -> Iterator[Tuple[int, str]]:
    """Yields numbered lines. Skips a last line without a newline: the recorder was killed while writing."""
    with open_file(path) as file:
        number = 0
        while line := file.readline(LONGEST_LINE):
            number += 1
            if line.endswith(b"\n"):
                yield number, line[:-1].decode(errors="replace")
            elif len(line) == LONGEST_LINE:
                raise StartError(f"mcap: {path}:{number}: is longer than {LONGEST_LINE >> 20} MiB")


def open_file(path: str) -> Any:
    try:
        if os.path.exists(path) and not os.path.isfile(path):
            raise StartError(f"mcap: {path}: is not a regular file")
        return open(path, "rb")
    except OSError as problem:
        raise StartError(f"mcap: cannot read {path}: {problem.strerror}") from None


if __name__ == "__main__":
    command.run(main)
