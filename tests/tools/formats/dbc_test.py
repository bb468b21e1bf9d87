#!/usr/bin/python3
"""Tests the DBC files with a third-party reader, canmatrix. It must report no problems, and give the codec's values.

usage: dbc_test.py FRAME_VALUES FORMATS
"""

import json
import logging
import pathlib
import random
import re
import subprocess
import sys
import unittest

import canmatrix
import canmatrix.formats

FRAME_VALUES, FORMATS = sys.argv[1], pathlib.Path(sys.argv.pop())
sys.argv.pop()

GENERATIONS = {"legacy": "", "late-legacy": "-late-legacy", "v235": "-v235", "v236": "-v236", "v236b": "-v236b"}
# Commands of the generations, docs/reference/protocol.md §3 and §10.1, without those of MS drives only.
LEGACY = [0x19, *range(0x30, 0x35), 0x37, 0x38, 0x80, 0x81, 0x88, 0x90, 0x91, 0x92, 0x94, 0x95, *range(0x9A, 0x9E), *range(0xA1, 0xA9)]
V235 = [command for command in LEGACY if not 0x30 <= command <= 0x38]
V236 = sorted({*V235, 0x8C, 0xC0, 0xC1} - {0x91})
V236B = sorted([*V236, 0x07, 0x18, 0x40, 0x42, 0x44])
COMMANDS = {"legacy": LEGACY, "late-legacy": LEGACY, "v235": V235, "v236": V236, "v236b": V236B}
SEVERAL = {"legacy": [0x280], "late-legacy": [0x280], "v235": [0x280], "v236": [0x280, 0x281, 0x282, 0x288], "v236b": [0x280, 0x281, 0x282, 0x288]}
SETTINGS = [0x0A, 0x0B, 0x0C, 0x0D, 0xE0, 0xE2, 0xE4, 0xEA, 0xEC]
PARAMETERS = [0x0A, 0x0B, 0x0C, 0x1E, 0x20, 0x22, 0x24, 0x26]


class Words(logging.Handler):
    """Collects the reader's messages about a file."""

    def __init__(self):
        super().__init__(logging.WARNING)
        self.said = []

    def emit(self, record):
        self.said.append(record.getMessage())


def load(generation, direction):
    name = "lk-motor" + GENERATIONS[generation] + ("-queries" if direction == "query" else "") + ".dbc"
    words = Words()
    logging.getLogger().addHandler(words)
    try:
        matrix = canmatrix.formats.loadp_flat(str(FORMATS / name))
    finally:
        logging.getLogger().removeHandler(words)
    assert not words.said and not matrix.load_errors, (name, words.said, matrix.load_errors)
    return matrix


MATRICES = {(generation, direction): load(generation, direction)
            for generation in GENERATIONS for direction in ("query", "reply")}


def decode(matrix, identifier, data):
    """Returns the values of a frame in their units, without DATA[0]."""
    frame = matrix.frame_by_id(canmatrix.ArbitrationId(identifier, extended=False))
    values = {name: value.phys_value for name, value in frame.decode(data).items()}
    if identifier <= 0x160:
        assert values.pop("command") == data[0]
    return {name: float(value) for name, value in values.items()}


def codec(lines):
    run = subprocess.run([FRAME_VALUES], input="\n".join(lines) + "\n", capture_output=True, text=True, check=True)
    return [json.loads(line) for line in run.stdout.splitlines()]


class Dbc(unittest.TestCase):
    def test_hand_computed_frames_decode(self):
        no_errors = {f"error_{name}": 0 for name in (
            "under_voltage over_voltage driver_temperature motor_temperature over_current short_circuit stall lost_input").split()}
        cases = [
            # docs/reference/protocol.md §5, §10.7 and §7; 240 · 0.1 V, 4872 and 2388 · 0.01 V
            ("legacy", "reply", "141#9A1900F000000000", {"temperature": 25, "voltage": 24.0, **no_errors}),
            ("v236", "reply", "141#9A24081300000000",
             {"temperature": 36, "voltage": 48.72, "bus_current": 0, "bridge": 0, **no_errors}),
            ("v236", "reply", "141#9A1F540900001008",
             {"temperature": 31, "voltage": 23.88, "bus_current": 0, "bridge": 16, **no_errors, "error_motor_temperature": 1}),
            # 100 · 33/2048 A in a reply, 100 · 33/4096 A if the series sets the scale; −500 °/s, 0x1234 counts
            ("legacy", "reply", "160#A12364000CFE3412", {"temperature": 35, "iq": 1.611328125, "speed": -500, "encoder": 4660}),
            ("v235", "reply", "160#9C2364000CFE3412", {"temperature": 35, "iq": 0.8056640625, "speed": -500, "encoder": 4660}),
            # mixture of legacy and newer formats
            ("late-legacy", "reply", "141#9A1900F000000000", {"temperature": 25, "voltage": 24.0, **no_errors}),
            ("late-legacy", "reply", "141#94000000D6590000", {"single_turn_angle": 229.98}),
            ("late-legacy", "reply", "160#9C2364000CFE3412", {"temperature": 35, "iq": 0.8056640625, "speed": -500, "encoder": 4660}),
            # 192, −180 and −12 of 1/64 A
            ("legacy", "reply", "141#9D23C0004CFFF4FF", {"temperature": 35, "i_a": 3.0, "i_b": -2.8125, "i_c": -0.1875}),
            # −1; and −2^55 in 56 bits
            ("legacy", "reply", "141#92FFFFFFFFFFFFFF", {"multi_turn_angle": -0.01}),
            ("legacy", "reply", "141#9200000000000080", {"multi_turn_angle": -360287970189639.68}),
            ("legacy", "reply", "141#9400000000009F8C", {"single_turn_angle": 359.99}),
            # one turn of an output with a 1:10 gear
            ("v236", "reply", "141#940000003F7E0500", {"single_turn_angle": 3599.99}),
            ("legacy", "query", "141#A2000000A08C0000", {"speed_target": 360.0}),
            ("legacy", "query", "141#A6012C0150460000", {"direction": 1, "max_speed": 300, "single_turn_target": 180.0}),
            # −1000 · 16 mA
            ("legacy", "query", "280#E8030000000018FC", {"iq_target_1": 16.0, "iq_target_2": 0, "iq_target_3": 0, "iq_target_4": -16.0}),
            ("v236", "query", "141#C1240000409C0000", {"parameter": 0x24, "register_current_ramp": 40.0}),
            ("v236", "reply", "141#C00B640032000000", {"parameter": 0x0B, "speed_kp": 100, "speed_ki": 50, "speed_kd": 0}),
        ]
        for generation, direction, text, expected in cases:
            with self.subTest(text):
                identifier, data = text.split("#")
                self.assertEqual(decode(MATRICES[generation, direction], int(identifier, 16), bytes.fromhex(data)), expected)

    def test_every_command_decodes_as_in_the_codec(self):
        draw = random.Random(1)
        for (generation, direction), matrix in MATRICES.items():
            frames = []
            for command in COMMANDS[generation]:
                for _ in range(20):
                    data = bytearray([command, *draw.randbytes(7)])
                    if command in (0xC0, 0xC1):
                        data[1] = draw.choice(PARAMETERS)
                    if command in (0x40, 0x42):
                        data[1] = draw.choice([0x05, 0x05, 0xA0, 0xA4, 0xA8])
                        data[2] = draw.choice(SETTINGS) if data[1] == 0x05 else data[2]
                    if command == 0x44:
                        data[1:3] = [0x05, data[2] & 1 if direction == "reply" else 0xFA]
                    if direction == "reply" and command == 0x8C:
                        data[1] &= 1  # coil powered or not
                    if direction == "reply" and generation.startswith("v236") and command in (0x9A, 0x9B):
                        data[6] &= 0x10  # bridge on or off
                    if direction == "query" and command in (0xA1, 0xA2):
                        # within the limits, since the codec clamps
                        data[3 if command == 0xA2 else 5] = draw.choice([0, 1, 2] if command == 0xA2 else [0, 5, 0xFB])
                    frames.append((0x140 + draw.randint(1, 32), bytes(data)))
            if direction == "query":
                for identifier in SEVERAL[generation]:
                    frames += [(identifier, b"".join(draw.randint(-2000, 2000).to_bytes(2, "little", signed=True)
                                                     for _ in range(4))) for _ in range(20)]
            told = codec(f"{direction} {generation} MF {identifier:03X}#{data.hex()}" for identifier, data in frames)
            self.assertEqual(len(told), len(frames))
            for (identifier, data), expected in zip(frames, told):
                with self.subTest(f"{generation} {direction} {identifier:03X}#{data.hex()}"):
                    said = decode(matrix, identifier, data)
                    self.assertEqual(said.keys(), expected.keys())
                    for name, value in said.items():
                        self.assertAlmostEqual(value, expected[name], delta=1e-15 * abs(expected[name]), msg=name)

    def test_every_message_has_all_commands_by_name_and_nothing_else(self):
        for (generation, _), matrix in MATRICES.items():
            names = {frame.arbitration_id.id: frame for frame in matrix.frames}
            self.assertEqual(sorted(names), [*range(0x141, 0x161), *SEVERAL[generation]])
            for identifier in range(0x141, 0x161):
                known = names[identifier].signal_by_name("command").values
                self.assertEqual(sorted(known), COMMANDS[generation])
                self.assertEqual(known[0x9A], "read state 1")

    def test_document_names_all_signals(self):
        text = (pathlib.Path(__file__).parents[3] / "docs/reference/formats.md").read_text("utf-8").split("\n## Names\n")[1].split("\n## ")[0]
        named = {name for row in re.findall(r"^\| (`[^|]*) \|", text, re.M) for name in re.findall(r"`(\w+)`", row)}
        known = {signal.name for matrix in MATRICES.values() for frame in matrix.frames for signal in frame.signals}
        only_on_ms = {"power", "power_target", "register_max_power", "setting_max_power"}
        of_other_drives = {name for name in known if re.fullmatch(r".*_[2-4]", name)}
        self.assertEqual(named, known - of_other_drives - {"command"} | only_on_ms)

    def test_transmitters_and_receivers_are_correct(self):
        for (_, direction), matrix in MATRICES.items():
            drives = [f"Drive{number}" for number in range(1, 33)]
            self.assertEqual([node.name for node in matrix.ecus], ["Host", *drives])
            for number, drive in enumerate(drives, 1):
                frame = matrix.frame_by_id(canmatrix.ArbitrationId(0x140 + number, extended=False))
                ends = (["Host"], [drive]) if direction == "query" else ([drive], ["Host"])
                self.assertEqual((frame.transmitters, frame.signal_by_name("command").receivers), ends)

    def test_signals_have_units_limits_and_value_names(self):
        frame = MATRICES["v236", "reply"].frame_by_name("Drive7_Reply")
        self.assertEqual([frame.signal_by_name(name).unit for name in ("temperature", "voltage", "iq", "speed", "multi_turn_angle")],
                         ["degC", "V", "A", "deg/s", "deg"])
        self.assertEqual((frame.signal_by_name("iq").min, frame.signal_by_name("iq").max), (-16.5, 16.5))
        self.assertEqual(frame.signal_by_name("bridge").values, {0: "on", 16: "off"})
        self.assertEqual(frame.signal_by_name("error_stall").values, {0: "no", 1: "yes"})
        torque = MATRICES["legacy", "query"].frame_by_name("Drive1_Query").signal_by_name("iq_target")
        self.assertEqual((torque.min, torque.max), (-32, 32))

    def test_queries_can_be_encoded(self):
        # docs/reference/protocol.md §3, and the first conversation of the README
        frame = MATRICES["legacy", "query"].frame_by_name("Drive1_Query")
        for values, expected in [
            ({"command": "read state 1"}, "9A00000000000000"),
            ({"command": "speed", "speed_target": 360}, "A2000000A08C0000"),
            ({"command": 0xA4, "max_speed": 300, "angle_target": -90}, "A4002C01D8DCFFFF"),
        ]:
            raw = {name: frame.signal_by_name(name).phys2raw(value) for name, value in values.items()}
            self.assertEqual(frame.signals_to_bytes(raw).hex().upper(), expected)

    def test_text_suits_simple_readers(self):
        files = list(FORMATS.glob("*.dbc"))
        self.assertTrue(files)
        for file in files:
            text = file.read_bytes().decode("ascii")
            for name in re.findall(r"^ ?(?:BO_ \d+|SG_) (\S+)", text, re.M):
                self.assertLessEqual(len(name.rstrip(":")), 32, "names in DBC files have 32 characters at most")
            # One multiplexer number for simple readers, all numbers for those with extended multiplexing.
            for message, signal in re.findall(r"^SG_MUL_VAL_ (\d+) (\w+) ", text, re.M):
                self.assertRegex(text, rf"(?s)BO_ {message} [^\n]*\n(?: [^\n]*\n)*? SG_ {signal} m\d+M? :")


if __name__ == "__main__":
    unittest.main()
