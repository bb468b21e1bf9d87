#!/usr/bin/python3
"""Tests the dissector on captures of an lk-emu bus. It must distinguish and pair queries and replies as the recording
does, and its values must equal the codec's.

usage: capture_test.py LK_EMU FRAME_VALUES DISSECTOR SCRATCH
"""

import json
import pathlib
import subprocess
import sys

import capture_host
from tshark import dissect, write_pcap

# Generation and series of each run, as arguments for the codec and the dissector.
RUNS = {
    "legacy": ("legacy MF", ["generation:legacy", "series:MF, MH"]),
    "v236": ("v236 MG", ["generation:v236", "series:MG"]),
    "apart": ("legacy MF", ["generation:legacy", "series:MF, MH", "reply_base:0x180 + ID"]),
}


def codec(program, format_words, frames):
    lines = [f"{direction} {format_words} {text.replace('18', '14', 1) if text.startswith('18') else text}\n"
             for direction, text in frames]
    run = subprocess.run([program], input="".join(lines), capture_output=True, text=True, check=True)
    return [json.loads(line) for line in run.stdout.splitlines()]


def pairs(frames):
    """Returns for each frame the number of its query, 0 for a query: the host waited for every reply."""
    answers, last = [], 0
    for number, (_, direction, _) in enumerate(frames, 1):
        last = number if direction == "query" else last
        answers.append(0 if direction == "query" else last)
    return answers


def check(name, frames, frame_values, dissector, scratch):
    format_words, preferences = RUNS[name]
    capture = scratch / f"{name}.pcap"
    write_pcap(capture, [(at_s, int(text[:3], 16), bytes.fromhex(text[4:])) for at_s, _, text in frames])
    said = dissect(capture, dissector, preferences)
    assert len(said) == len(frames), (name, len(said), len(frames))
    unknown = [text.startswith("141#30") and name == "v236" for _, _, text in frames]
    told = iter(codec(frame_values, format_words,
                      [(direction, text) for (_, direction, text), skip in zip(frames, unknown) if not skip]))
    for number, ((at_s, direction, text), answers, skip, one) in enumerate(zip(frames, pairs(frames), unknown, said), 1):
        where = (name, number, direction, text, vars(one))
        assert (one.kind, one.reply_to) == (direction, answers), where
        several = text.startswith("28")
        assert one.drive == (0 if several else int(text[1:3], 16) % 0x40), where
        answered = [other for other, to in enumerate(pairs(frames), 1) if to == number]
        assert one.replies == answered, where
        if direction == "reply":
            waited_s = at_s - frames[answers - 1][0]
            assert abs(one.response_time_s - waited_s) < 1e-6, where  # doubles of seconds since 1970
        if skip:
            assert one.experts == {"unknown_command"} and not one.values, where
            continue
        expected = next(told)
        assert one.values.keys() == expected.keys(), (where, expected)
        for key, value in expected.items():
            assert abs(one.values[key] - value) <= 1e-14 * abs(value), (where, key, value)
        errors = any(value for key, value in expected.items() if key.startswith("error_"))
        unanswered = direction == "query" and not answered
        assert one.experts == {*(["errors"] if errors else []), *(["unanswered"] if unanswered else [])}, where
    return said


def main(program, frame_values, dissector, scratch):
    scratch = pathlib.Path(scratch)
    scratch.mkdir(parents=True, exist_ok=True)
    runs = capture_host.runs(program)
    said = {name: check(name, runs[name], frame_values, dissector, scratch) for name in RUNS}

    # The intended special cases occur: an error, an absent drive, a query to several drives.
    experts = [one.experts for one in said["legacy"]]
    assert experts.count({"errors"}) == 1 and experts.count({"unanswered"}) == 1, experts
    assert any(one.values.get("error_under_voltage") for one in said["legacy"] if one.drive == 2)
    assert abs(next(one.values["voltage"] for one in said["v236"] if "voltage" in one.values) - 48) < 0.5
    count = sum(len(frames) for frames in runs.values())
    print(f"{count} frames of a bus: good")


if __name__ == "__main__":
    main(*sys.argv[1:])
