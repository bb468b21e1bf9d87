#!/usr/bin/python3
"""Recordings as MCAP beside a host, read by a reader of the tests' own: whole ones, and one that is killed.

usage: mcap_hosts.py LK_EMU
"""

import json
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

import can

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from mcap_reader import Mcap  # noqa: E402

PATIENCE_S = 20.0
QUERIES = 3000  # of a chunk there are 1 MB: more than one


class Recorded:
    """lk-emu that records into `file`; `said` is what the host had answers to."""

    def __init__(self, program, file, *options):
        self.program, self.file, self.said = program, file, []
        self.control = file.with_suffix(".sock")
        self.terminal = file.with_suffix(".tty")
        self.bus = f"slcan-pty:{self.terminal}"
        self.process = subprocess.Popen([program, "--bus", self.bus, "--ids", "1,2", "--rom", ":memory:", "--control", str(self.control),
                                         "--record", str(file), *options], stdout=subprocess.PIPE, text=True)
        assert self.process.stdout.readline() == f"lk-emu ready {self.bus}:1-2\n"

    def talk(self, count):
        with can.Bus(interface="slcan", channel=str(self.terminal), sleep_after_open=0) as bus:
            for n in range(count):
                drive = 1 + n % 2
                bus.send(can.Message(arbitration_id=0x140 + drive, data=bytes([0x9C]).ljust(8, b"\0"), is_extended_id=False))
                reply = bus.recv(PATIENCE_S)
                assert reply is not None and reply.arbitration_id == 0x140 + drive
                self.said.append((drive, bytes(reply.data)))

    def mark(self, text):
        subprocess.run([self.program, "ctl", "--socket", str(self.control), "mark", text], check=True, stdout=subprocess.DEVNULL)

    def end(self, how):
        self.process.send_signal(how)
        return self.process.wait()


def check_frames(read, recorded):
    """Each reply that the host heard, behind its query, in order; and what the manual reads in it."""
    bus, said = recorded.bus, recorded.said
    frames = [json.loads(data) for _, data in read.of(f"/{bus}/frames")]
    assert [(one["from"], one["id"] - 0x140, bytes(one["data"])) for one in frames if one["from"] == "drive"] == [
        ("drive", drive, data) for drive, data in said]
    assert sum(one["from"] == "host" for one in frames) == len(said)
    for log_time, data in read.of(f"/{bus}/frames"):
        one = json.loads(data)
        text = (f"({log_time // 10**9:010d}.{log_time % 10**9 // 1000:06d}) {bus} "
                f"{one['id']:03X}#{bytes(one['data']).hex().upper()} {'TR'[one['from'] == 'drive']}")
        assert one["line"] == text, (one["line"], text)
    for drive in (1, 2):
        values = [json.loads(data) for _, data in read.of(f"/{bus}/{drive}")]
        # 0x9C: DATA[1] is the temperature, DATA[4..5] the speed in dps, little-endian.
        wanted = [(data[1], int.from_bytes(data[4:6], "little", signed=True)) for number, data in said if number == drive]
        assert [(one["temperature_C"], one["speed_dps"]) for one in values] == wanted


def whole(program, directory):
    file = directory / "whole.mcap"
    recorded = Recorded(program, file)
    recorded.talk(QUERIES)
    recorded.mark("half of it")
    recorded.talk(10)
    assert recorded.end(signal.SIGTERM) == 0
    read = Mcap(file.read_bytes())
    assert read.complete and len(read.chunks) > 1, len(read.chunks)
    assert read.library.startswith("lk-emu ")
    check_frames(read, recorded)
    directives = [json.loads(data) for _, data in read.of("/directives")]
    assert [one.get("directive", {}).get("mark") for one in directives] == ["half of it", None], directives
    assert directives[0]["after_frames"] == QUERIES and directives[-1]["end"] is True
    assert json.loads(read.attachments["recording.json"])["replayable"] is True
    for _, encoding, text in read.schemas.values():
        assert encoding == "jsonschema" and json.loads(text)["type"] == "object"
    assert {encoding for _, _, encoding in read.channels.values()} == {"json"}
    return file


def killed(program, directory):
    """What the host had an answer to is there after the gathering of 10 ms, in sums that are right at any instant."""
    file = directory / "killed.mcap"
    recorded = Recorded(program, file)
    deadline = time.monotonic() + PATIENCE_S
    for _ in range(20):
        recorded.talk(50)
        while len(Mcap(file.read_bytes()).of(f"/{recorded.bus}/frames")) < 2 * len(recorded.said):
            assert time.monotonic() < deadline, "frames do not reach the file"
    assert recorded.end(signal.SIGKILL) == -signal.SIGKILL
    read = Mcap(file.read_bytes())
    assert not read.complete
    check_frames(read, recorded)


def refused(program, directory, file):
    """One line, status 2; the file that is there stays."""
    taken = subprocess.run([program, "--bus", f"slcan-pty:{directory}/refused", "--ids", "1", "--rom", ":memory:", "--record", str(file)], capture_output=True, text=True, check=False)
    assert taken.returncode == 2 and "is there already" in taken.stderr, taken.stderr
    assert Mcap(file.read_bytes()).complete
    done = subprocess.run([program, "replay", str(file)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1), done
    assert f"{file}: MCAP files cannot be replayed; record with --record DIR" in done.stderr, done.stderr


def main(program):
    with tempfile.TemporaryDirectory() as name:
        directory = pathlib.Path(name)
        file = whole(program, directory)
        killed(program, directory)
        refused(program, directory, file)
    print("recordings as MCAP: good")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
