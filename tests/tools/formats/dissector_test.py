#!/usr/bin/python3
"""Tests the dissector on hand-written captures: pairing, errors, values.

usage: dissector_test.py DISSECTOR SCRATCH PAIR_FRAMES
"""

import pathlib
import random
import shutil
import subprocess
import sys
import unittest

from tshark import dissect, tshark, write_pcap, write_pcapng

PAIR_FRAMES = sys.argv.pop()
SCRATCH = pathlib.Path(sys.argv.pop())
DISSECTOR = sys.argv.pop()


def frames(*texts):
    """Returns frames 300 us apart, or at the time in ms before '@'."""
    at_s, found = 0.0, []
    for text in texts:
        when, _, frame = text.rpartition("@")
        at_s = float(when) / 1000 if when else at_s + 0.0003
        identifier, data = frame.split("#")
        found.append((at_s, int(identifier, 16), bytes.fromhex(data)))
    return found


def said(*texts, **settings):
    capture = SCRATCH / "hand.pcap"
    write_pcap(capture, frames(*texts))
    return dissect(capture, DISSECTOR, **settings)


STATE_2 = "141#9C1964000CFE3412"  # 25 °C, 100 · 33/2048 A, −500 °/s, 0x1234
ASK_2 = "141#9C00000000000000"


def conversation(draw, length):
    """Draws frames of three drives and a host, with repeated queries and lost replies."""
    asked, at_s = {drive: [] for drive in (1, 2, 3)}, 0.0
    for _ in range(length):
        at_s += draw.choice([0.00012, 0.00034, 0.002])
        if draw.random() < 0.02:
            at_s += 0.15  # longer than any reply time
            asked = {drive: [] for drive in asked}
        drive = draw.choice([1, 1, 2, 3])
        waiting = asked[drive]
        if waiting and draw.random() < 0.6:
            query = waiting.pop(0)
            if draw.random() < 0.15:
                continue  # lost reply
            data = query if query[0] in (0x31, 0x80) else bytes([query[0], draw.randint(2, 60), *draw.randbytes(6)])
        else:
            data = bytes([draw.choice([0x9A, 0x9C, 0x9C, 0x9C, 0x92, 0xA2, 0x31, 0x80]), 0, 0, 0, *draw.randbytes(4)])
            waiting.append(data)
        yield at_s, 0x140 + drive, data


class Dissector(unittest.TestCase):
    def test_pairs_equal_those_of_the_log_pairing(self):
        # docs/reference/formats.md gives the rules; emulator/monitor/frames/log_pairing.cpp also implements them, with
        # look-ahead.
        frames = list(conversation(random.Random(7), 3000))
        capture = SCRATCH / "drawn.pcap"
        write_pcap(capture, frames)
        lines = "".join(f"{at_s:.9f} {identifier:03X}#{data.hex()}\n" for at_s, identifier, data in frames)
        run = subprocess.run([PAIR_FRAMES], input=lines, capture_output=True, text=True, check=True)
        expected = run.stdout.split()
        self.assertGreater(min(expected.count("0"), len(expected) - expected.count("0")), 1000)
        self.assertGreater(expected.count("orphan"), 10)
        found = ["orphan" if "orphan" in one.experts else str(one.reply_to) for one in dissect(capture, DISSECTOR)]
        for number, (one, other) in enumerate(zip(found, expected, strict=True), 1):
            self.assertEqual(one, other, f"frame {number}: {lines.splitlines()[max(0, number - 12):number + 4]}")

    def test_query_and_reply_are_paired(self):
        query, reply = said("0@141#9A00000000000000", "0.338@141#9A1900F000000009")
        self.assertEqual((query.kind, query.drive, query.command, query.command_name), ("query", 1, "0x9a", "read state 1"))
        self.assertEqual((query.replies, query.values, query.experts), ([2], {}, set()))
        self.assertEqual((reply.kind, reply.reply_to, reply.response_time_s), ("reply", 1, 0.000338))
        self.assertEqual({name: value for name, value in reply.values.items() if value}, {
            "temperature": 25, "voltage": 24, "error_under_voltage": 1, "error_motor_temperature": 1})
        self.assertEqual(reply.experts, {"errors"})

    def test_echo_is_a_reply_and_the_next_frame_a_query(self):
        self.assertEqual([one.kind for one in said(*["141#8000000000000000"] * 5)],
                         ["query", "reply", "query", "reply", "query"])

    def test_replies_of_a_burst_belong_to_its_queries_in_order(self):
        burst = said(ASK_2, ASK_2, ASK_2, STATE_2, STATE_2, STATE_2)
        self.assertEqual([one.reply_to for one in burst], [0, 0, 0, 1, 2, 3])
        self.assertEqual([one.replies for one in burst[:3]], [[4], [5], [6]])

    def test_reply_after_a_lost_one_belongs_to_the_last_query(self):
        lost = said(ASK_2, ASK_2, STATE_2, ASK_2, STATE_2)
        self.assertEqual([one.reply_to for one in lost], [0, 0, 2, 0, 4])
        self.assertEqual([one.experts for one in lost], [{"unanswered"}, set(), set(), set(), set()])

    def test_drives_do_not_answer_for_each_other(self):
        others = said(ASK_2, "142#9C00000000000000", "142#9C1964000CFE3412", STATE_2)
        self.assertEqual([(one.drive, one.kind, one.reply_to) for one in others],
                         [(1, "query", 0), (2, "query", 0), (2, "reply", 2), (1, "reply", 1)])

    def test_late_reply_is_an_orphan(self):
        query, late = said("0@" + ASK_2, "101@" + STATE_2)
        self.assertEqual((query.experts, late.kind, late.experts), ({"unanswered"}, "reply", {"orphan"}))

    def test_one_pass_reports_no_unanswered_queries(self):
        self.assertEqual([one.experts for one in said(ASK_2, two_passes=False)], [set()])

    def test_query_to_several_drives_has_several_replies(self):
        several = said("280#E803000018FC0000", "141#A11964000CFE3412", "143#A11964000CFE3412", ASK_2, STATE_2)
        self.assertEqual(several[0].values, {"iq_target_1": 16, "iq_target_2": 0, "iq_target_3": -16, "iq_target_4": 0})
        self.assertEqual((several[0].kind, several[0].replies, several[0].experts), ("query", [2, 3], set()))
        self.assertEqual([one.reply_to for one in several], [0, 1, 1, 0, 4])

    def test_query_to_several_drives_ends_earlier_queries(self):
        lost = said("280#E803000018FC0000", "280#E803000018FC0000", "141#A11964000CFE3412", "280#E803000018FC0000",
                    "141#A11964000CFE3412")
        self.assertEqual([one.reply_to for one in lost], [0, 0, 2, 0, 4])

    def test_each_slot_has_its_command(self):
        slots = said("288#9C009A0000000000", "142#9A1900F000000000", "141#9C1964000CFE3412", "143#9C1964000CFE3412",
                     preferences=["generation:v236"])
        self.assertEqual([one.reply_to for one in slots], [0, 1, 1, 0])
        self.assertEqual(slots[3].experts, {"orphan"})  # no query to drive 3

    def test_query_that_equals_a_reply_is_a_query(self):
        # Direction 1, towards 180°: this equals a reply of a drive at 1 °C.
        self.assertEqual([one.kind for one in said("141#A501000050460000", "141#A51964000CFE3412")], ["query", "reply"])

    def test_unanswerable_frames_are_recognised(self):
        foreign = said("141#8C10000000000000", "141#FF00000000000000", "141#9C", "123#9C00000000000000",
                       "281#0100020003000400")
        self.assertEqual([one.experts for one in foreign],
                         [{"unknown_command"}, {"unknown_command"}, {"wrong_length"}, set(), {"unknown_command"}])
        self.assertEqual([one.ours for one in foreign], [True, True, True, False, True])

    def test_values_depend_on_the_generation(self):
        def voltage(generation, frame):
            return said("141#9A00000000000000", frame, preferences=[f"generation:{generation}"])[1].values["voltage"]
        # docs/reference/protocol.md §10.7, and the frame of §5
        self.assertEqual(voltage("v236", "141#9A24081300000000"), 48.72)
        self.assertEqual(voltage("v235", "141#9A1F540900000000"), 23.88)
        self.assertEqual(voltage("legacy", "141#9A1900F000000000"), 24.0)
        self.assertEqual(voltage("late-legacy", "141#9A1900F000000000"), 24.0)
        wide = said("141#9400000000000000", "141#94000000D6590000", preferences=["generation:late-legacy"])[1]
        self.assertEqual(wide.values["single_turn_angle"], 229.98)
        brake = said("141#8C10000000000000", "141#8C01000000000000", preferences=["generation:v236"])
        self.assertEqual([one.values for one in brake], [{"action": 16}, {"coil": 1}])

    def test_values_depend_on_the_series(self):
        def effort(series, generation="v236"):
            values = said(ASK_2, STATE_2, preferences=[f"generation:{generation}", f"series:{series}"])[1].values
            return values.get("iq"), values.get("power")
        # 100 of 33/4096 A, 66/4096 A, 0.1 %; 33/2048 A for all in legacy
        self.assertEqual([effort("MF, MH"), effort("MG"), effort("MS"), effort("MG", "legacy")],
                         [(0.8056640625, None), (1.611328125, None), (None, 10), (1.611328125, None)])

    def test_description_in_the_capture_sets_generation_and_series(self):
        capture = SCRATCH / "described.pcapng"
        talk = [(ASK_2, STATE_2), (ASK_2.replace("141", "142"), STATE_2.replace("141", "142")),
                (ASK_2.replace("141", "143"), STATE_2.replace("141", "143"))]
        conversation = [frame for pair in talk for frame in frames(*pair)]
        buses = [("vcan0", "LK-TECH drives: 1 v236 MG, 2 legacy MF"), ("vcan1", "LK-TECH drives: 1 v235 MS"), ("can0", "")]
        write_pcapng(capture, buses, [(bus, 0.01 * n + at_s, identifier, data) for bus in range(3)
                                      for n, (at_s, identifier, data) in enumerate(conversation, 10 * bus)])
        replies = [one for one in dissect(capture, DISSECTOR, ["generation:late-legacy", "series:MF, MH"]) if one.kind == "reply"]
        # 100 of 66/4096 A, 33/2048 A; without a description 33/4096 A by the preferences; MS has ‰.
        self.assertEqual([one.values.get("iq") for one in replies],
                         [1.611328125, 1.611328125, 0.8056640625, None, 0.8056640625, 0.8056640625] + [0.8056640625] * 3)
        self.assertEqual(replies[3].values["power"], 10)
        # 0x91 is a command of the second drive only, 0x8C of the first.
        asked = [(0, 0.001 * n, 0x140 + drive, bytes([command, 0, 0, 0, 0, 0, 0, 0]))
                 for n, (drive, command) in enumerate([(1, 0x91), (2, 0x91), (1, 0x8C), (2, 0x8C)])]
        write_pcapng(capture, buses, asked)
        self.assertEqual(["unknown_command" in one.experts for one in dissect(capture, DISSECTOR)],
                         [True, False, False, True])

    def test_parameters_are_decoded(self):
        values = [one.values for one in said("141#C020000000000000", "141#C0200000A08C0000", "141#C10A640032000000",
                                             preferences=["generation:v236"])]
        self.assertEqual(values, [{"read_parameter": 0x20}, {"parameter": 0x20, "register_max_speed": 360},
                                  {"parameter": 0x0A, "angle_kp": 100, "angle_ki": 50, "angle_kd": 0}])

    def test_extreme_numbers_are_decoded(self):
        ends = said("141#9200000000000000", "141#92FFFFFFFFFFFFFF", "141#9200000000000000", "141#9200000000000080",
                    "141#A200000000000080", "141#A280000080000080")
        self.assertEqual([one.values for one in ends[1::2]], [
            {"multi_turn_angle": -0.01}, {"multi_turn_angle": -360287970189640},  # −2^55, to 15 digits
            {"temperature": -128, "iq": 0, "speed": 128, "encoder": 0x8000}])
        self.assertEqual(ends[4].values, {"speed_target": -21474836.48})

    def test_reply_base_sets_identifiers_of_replies(self):
        apart = said("141#9C00000000000000", "181#9C0064000CFE3412", "141#9C00000000000000", "181#8000000000000000",
                     preferences=["reply_base:0x180 + ID"])
        self.assertEqual([(one.kind, one.drive, one.reply_to) for one in apart],
                         [("query", 1, 0), ("reply", 1, 1), ("query", 1, 0), ("reply", 1, 0)])
        self.assertEqual(apart[3].experts, {"orphan"})
        self.assertFalse(said("181#8000000000000000")[0].ours)

    def test_packet_list_describes_frames(self):
        said("141#A2000000A08C0000", "141#A21964000CFE3412", "141#9B00000000000000", "141#9B1900F000000008")
        lines = tshark(SCRATCH / "hand.pcap", DISSECTOR, arguments=["-T", "fields", "-e", "_ws.col.Info"]).splitlines()
        self.assertEqual(lines, [
            "Drive 1 ← speed: Target speed 360°/s",
            "Drive 1 → speed: Temperature 25 °C, Torque current 1.611 A, Speed -500°/s, Encoder 4660",
            "Drive 1 ← clear errors",
            "Drive 1 → clear errors: Temperature 25 °C, Voltage 24 V, ERROR: Motor over-temperature"])

    def test_fields_can_be_filtered(self):
        said(ASK_2, STATE_2)
        found = tshark(SCRATCH / "hand.pcap", DISSECTOR,
                       arguments=["-Y", "lk.motor.iq > 1.6 && lk.motor.speed < 0", "-T", "fields", "-e", "frame.number"])
        self.assertEqual(found.split(), ["2"])

    def test_remote_extended_error_and_fd_frames_are_ignored(self):
        capture = SCRATCH / "flags.pcap"
        eight = bytes(8)
        write_pcap(capture, [(0, 0x80000141, eight), (0.1, 0x20000141, eight), (0.2, 0x40000141, b""), (0.3, 0x141, eight, 0x04),
                             (0.4, 0x141, eight)])
        self.assertEqual([one.ours for one in dissect(capture, DISSECTOR)], [False] * 4 + [True])


if __name__ == "__main__":
    if shutil.which("tshark") is None:
        print("tshark is missing: scripts/packages installs it", file=sys.stderr)
        sys.exit(1)
    SCRATCH.mkdir(parents=True, exist_ok=True)
    unittest.main()
