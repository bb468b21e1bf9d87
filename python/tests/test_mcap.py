"""Tests of MCAP files, with an independent reader."""

import io
import json
import os
import random
import stat
import sys

import pytest
from mcap_reader import Mcap

from lkemu import mcap
from lkemu.errors import StartError
from lkemu.mcap_writer import McapWriter

CONTENTS = {
    "recording.json": '{"version":"0.2.0"}',
    "motors/mf7015.toml": 'name = "mf7015"\n',
    "directives.jsonl": '{"time_ns":0,"after_frames":0,"bus":"vcan0","directive":{"mark":"关"}}\n{"time_ns":9000,"after_frames":2,"bus":"vcan0","end":true}\n',
    "frames.log": "(0000000000.001000) vcan0 141#9C00000000000000 T\n(0000000000.001338) vcan0 141#9C19030068013290 R\n",
}
# Output of lk-emu decode --json for these frames; unused keys are omitted.
DECODED = [
    {"type": "frame", "line": 1, "role": "query", "drive": 1, "values": {}},
    {"type": "frame", "line": 2, "role": "reply", "drive": 1, "values": {"temperature_C": 25, "speed_dps": 360, "error_words": ["stall"]}},
    {"type": "summary"},
]


def written(writer):
    file = io.BytesIO()
    writer.write(file)
    return Mcap(file.getvalue())  # asserts every checksum, index and count


def test_messages_are_found_by_topic_and_time():
    chance = random.Random(1)
    sent = {f"/vcan0/{id}": [] for id in range(1, 4)}
    writer = McapWriter("lk-emu 0.2.0")
    writer.attach("robot.toml", "application/toml", b"seed = 1\n")
    writer.attach("empty", "application/json", b"")
    for n in range(30_000):
        topic = chance.choice(list(sent))
        value = {"n": n, "speed_dps": chance.random(), "words": ["ü"] * (n % 3)}
        time_ns = n * 1000 - chance.randrange(min(n, 5) + 1) * 1000  # not always in order
        sent[topic].append((time_ns, value))
        writer.message(topic, "lk_emu.Reply", time_ns, value)
    read = written(writer)
    assert read.complete and len(read.chunks) > 1 and read.library == "lk-emu 0.2.0"
    for topic, messages in sent.items():
        assert [(time_ns, json.loads(data)) for time_ns, data in read.of(topic)] == messages
    assert read.attachments == {"robot.toml": b"seed = 1\n", "empty": b""}
    ((name, encoding, text),) = read.schemas.values()
    assert (name, encoding) == ("lk_emu.Reply", "jsonschema")
    assert json.loads(text)["properties"]["speed_dps"] == {"type": "number"}
    assert {encoding for _, _, encoding in read.channels.values()} == {"json"}


def test_file_without_messages_is_complete():
    assert written(McapWriter("")).complete


def test_the_schema_has_the_properties_of_all_messages():
    writer = McapWriter("")
    writer.message("/a", "A", 0, {"end": True})
    writer.message("/a", "A", 1, {"bus": "vcan0", "directive": {"id": 1}, "data": [1]})
    ((_, _, text),) = written(writer).schemas.values()
    assert json.loads(text) == {"type": "object", "properties": {
        "bus": {"type": "string"}, "data": {"type": "array", "items": {"type": "number"}},
        "directive": {"type": "object", "properties": {"id": {"type": "number"}}}, "end": {"type": "boolean"}}}  # fmt: skip


@pytest.mark.parametrize("text, id, data", [
    ("141#9C00 T", 0x141, [0x9C, 0]),
    ("12345678#01 T", 0x12345678, [1]),
    ("20000004#0001 R", 4, [0, 1]),  # an error frame
    ("141#R R", 0x141, []),
    ("141##0 T", 0x141, []),
    ("rs485#3E9A0100D9 T", None, [0x3E, 0x9A, 1, 0, 0xD9]),
])  # fmt: skip
def test_frames_of_every_kind(text, id, data):
    line = f"(0000000001.000250) rs485:/tmp/my arm {text}"
    time_ns, bus, frame = mcap.read_line(line)
    assert (time_ns, bus, frame.get("id"), frame["data"], frame["line"]) == (1_000_250_000, "rs485:/tmp/my arm", id, data, line)
    assert frame["from"] == ("host" if text[-1] == "T" else "drive")


@pytest.fixture
def recording(tmp_path, monkeypatch):
    """A recording of one query with its reply, and a stub for lk-emu decode."""
    monkeypatch.chdir(tmp_path)
    for name, text in CONTENTS.items():
        (tmp_path / "recording" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "recording" / name).write_text(text)
    decode = tmp_path / "lk-emu"
    decode.write_text(f"#!{sys.executable}\nimport sys\nassert sys.argv[1:-1] == ['decode', '--json', '--lang', 'en']\n" + "".join(
        f"print({json.dumps(line)!r})\n" for line in DECODED))  # fmt: skip
    decode.chmod(decode.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("LKEMU", str(decode))
    return tmp_path / "recording"


def refusal(*arguments):
    with pytest.raises(StartError) as problem:
        mcap.main(list(arguments))
    return str(problem.value)


def test_a_recording(recording, capsys):
    mcap.main(["recording/"])
    assert capsys.readouterr().out == "recording.mcap: 2 frames\n"
    read = Mcap((recording.parent / "recording.mcap").read_bytes())
    assert [(time_ns, json.loads(data)) for time_ns, data in read.of("/vcan0/1")] == [(1_338_000, {"temperature_C": 25, "speed_dps": 360})]
    assert [(time_ns, json.loads(data)["from"]) for time_ns, data in read.of("/vcan0/frames")] == [(1_000_000, "host"), (1_338_000, "drive")]
    assert [json.loads(data) for _, data in read.of("/directives")] == [json.loads(line) for line in CONTENTS["directives.jsonl"].splitlines()]
    assert {name: data.decode() for name, data in read.attachments.items()} == {name: CONTENTS[name] for name in ("recording.json", "motors/mf7015.toml")}
    first = (recording.parent / "recording.mcap").read_bytes()
    mcap.main(["recording", "-o", "again.mcap"])
    assert (recording.parent / "again.mcap").read_bytes() == first


def test_truncated_last_line_is_skipped(recording, capsys):
    with open(recording / "frames.log", "a", encoding="utf-8") as file:
        file.write("(0000000000.002000) vcan0 141#9C")
    with open(recording / "directives.jsonl", "a", encoding="utf-8") as file:
        file.write('{"time_ns":')
    mcap.main(["recording"])
    assert capsys.readouterr().out == "recording.mcap: 2 frames\n"


def test_invalid_recordings_are_refused(recording):
    assert refusal("none") == "mcap: cannot read none/directives.jsonl: No such file or directory"
    assert refusal("recording", "-o", "no/a.mcap") == "--output: cannot write no/a.mcap: No such file or directory"
    os.rename(recording / "directives.jsonl", "kept")
    (recording / "directives.jsonl").write_text('{"time_ns":0}\n[]\n')
    assert refusal("recording") == "mcap: recording/directives.jsonl:2: not as lk-emu writes it"
    os.rename("kept", recording / "directives.jsonl")
    (recording / "frames.log").write_text(CONTENTS["frames.log"] + "noise\n")
    assert refusal("recording") == "mcap: recording/frames.log:3: is not a frame of candump"
    (recording.parent / "lk-emu").write_text("#!/bin/sh\necho 'lk-emu: no such motor' >&2\nexit 2\n")
    (recording / "frames.log").write_text("")
    assert refusal("recording") == "no such motor"
    assert sorted(os.listdir()) == ["lk-emu", "recording"]


@pytest.mark.parametrize("name, text, reason", [
    ("directives.jsonl", '{"time_ns":-1}\n', "directives.jsonl:1: not as lk-emu writes it"),
    ("directives.jsonl", '{"time_ns":1e30}\n', "directives.jsonl:1: not as lk-emu writes it"),
    ("directives.jsonl", '{"time_ns":36893488147419103232}\n', "directives.jsonl:1: not as lk-emu writes it"),
    ("directives.jsonl", '{"time_ns":"1"}\n', "directives.jsonl:1: not as lk-emu writes it"),
    ("directives.jsonl", "[" * 100_000 + "\n", "directives.jsonl:1: not as lk-emu writes it"),
    ("directives.jsonl", "x" * (2 << 20), "directives.jsonl:1: is longer than 1 MiB"),
    ("frames.log", "(9000000000000.000000) vcan0 141#9C T\n", "frames.log:1: not as lk-emu writes it"),
    ("recording.json", "x" * (17 << 20), "recording.json: is larger than 16 MiB, so lk-emu did not write it"),
], ids=range(8))  # fmt: skip
def test_damaged_and_huge_files_give_one_error_line(recording, name, text, reason):
    (recording / name).write_text(text)
    assert refusal("recording") == f"mcap: recording/{reason}"


@pytest.mark.parametrize("name", ["directives.jsonl", "frames.log", "robot.toml"])
def test_pipe_is_refused(recording, name):
    (recording / name).unlink(missing_ok=True)
    os.mkfifo(recording / name)
    assert refusal("recording") == f"mcap: recording/{name}: is not a regular file"


def test_a_directive_may_have_an_empty_value(recording, capsys):
    (recording / "directives.jsonl").write_text('{"time_ns":0,"x":null}\n')
    mcap.main(["recording"])
    assert capsys.readouterr().out == "recording.mcap: 2 frames\n"
