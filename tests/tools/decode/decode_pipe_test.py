#!/usr/bin/python3
"""Tests `lk-emu decode` on a pipe, as after candump: live output, end by EOF, SIGINT or a closed output.

usage: decode_pipe_test.py LK_EMU
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
import unittest

PROGRAM = os.path.abspath(sys.argv[1])
QUERY = " (1795303992.440000)  can0  141   [8]  9C 00 00 00 00 00 00 00\n"
REPLY = " (1795303992.440338)  can0  141   [8]  9C 19 02 00 03 00 21 08\n"


def start(*arguments, **kwargs):
    return subprocess.Popen([PROGRAM, "decode", *arguments], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True, bufsize=1, **kwargs)


class Pipe(unittest.TestCase):
    def test_each_line_is_decoded_at_once(self):
        with start("--json") as decode:
            decode.stdin.write(QUERY)
            self.assertEqual(json.loads(decode.stdout.readline())["role"], "query")
            decode.stdin.write(REPLY[:20])  # a pipe may split lines anywhere
            decode.stdin.flush()
            decode.stdin.write(REPLY[20:])
            reply = json.loads(decode.stdout.readline())
            self.assertEqual((reply["role"], reply["values"]["speed_dps"]), ("reply", 3))
            decode.stdin.write("no frame\n")
            self.assertEqual(json.loads(decode.stdout.readline())["type"], "bad_line")
            decode.stdin.write(QUERY.rstrip("\n"))  # the last line may lack a line end
            decode.stdin.close()
            last, summary = map(json.loads, decode.stdout)
            self.assertEqual((last["role"], summary["type"]), ("query", "summary"))
            self.assertEqual((summary["frames"], summary["bad_lines"]), (3, 1))
            self.assertEqual((decode.wait(), decode.stderr.read()), (0, ""))

    def test_sigint_prints_the_summary(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            with start("--lang", "en") as decode:
                decode.stdin.write(QUERY)
                self.assertIn("assumed: firmware legacy", decode.stdout.readline())
                self.assertIn("9C read state 2", decode.stdout.readline())
                decode.send_signal(number)
                self.assertIn("can0: 1 frame in 0.000000 s\n", decode.stdout.readlines())
                self.assertEqual(decode.wait(), 0)

    def test_guessing_prints_its_result_at_the_end(self):
        with start("--guess", "--lang", "en") as guess:
            guess.stdin.write(QUERY.replace("9C", "9A"))
            guess.stdin.write(REPLY.replace("9C 19 02 00 03 00 21 08", "9A 24 08 13 00 00 00 00"))
            guess.stdin.close()  # all input is read before the end is seen
            said = guess.stdout.read()
            self.assertIn("drive 1: v235 or v236", said)
            self.assertIn("  lk-emu --bus vcan0 --ids 1 --generation v235\n", said)
            self.assertEqual((guess.wait(), guess.stderr.read()), (0, ""))

    def test_closed_output_ends_it(self):
        with start() as decode:
            decode.stdout.close()
            try:
                while decode.poll() is None:
                    decode.stdin.write(QUERY * 100)
                decode.stdin.close()
            except BrokenPipeError:
                pass
            self.assertEqual((decode.wait(), decode.stderr.read()), (0, ""))

    def test_language_and_colour_options_work(self):
        words = {"zh_CN.UTF-8": "读取状态 2", "C.UTF-8": "read state 2"}
        for locale, word in words.items():
            ran = subprocess.run([PROGRAM, "decode"], input=QUERY, capture_output=True, text=True, check=True,
                                 env={**os.environ, "LC_ALL": locale})
            self.assertIn(word, ran.stdout)
            self.assertNotIn("\x1b", ran.stdout)

    def test_terminal_gets_colours_unless_disabled(self):
        for environment, coloured in (({}, True), ({"NO_COLOR": "1"}, False), ({"TERM": "dumb"}, False)):
            ours, theirs = os.openpty()
            environment = {**{k: v for k, v in os.environ.items() if k != "NO_COLOR"}, "TERM": "xterm", **environment}
            subprocess.run([PROGRAM, "decode"], input=QUERY.encode(), stdout=theirs, check=True, env=environment)
            os.close(theirs)
            self.assertEqual(b"\x1b[" in os.read(ours, 65536), coloured, environment)
            os.close(ours)


class Files(unittest.TestCase):
    def run_on(self, text, *arguments):
        with tempfile.NamedTemporaryFile("wb", suffix=".log") as file:
            file.write(text)
            file.flush()
            return subprocess.run([PROGRAM, "decode", file.name, *arguments], capture_output=True, check=False)

    def test_log_is_read_completely(self):
        ran = self.run_on((QUERY + REPLY).encode() * 1000, "--json", "--generation", "v236", "--motor", "mg4005")
        self.assertEqual((ran.returncode, ran.stderr), (0, b""))
        summary = json.loads(ran.stdout.splitlines()[-1])
        self.assertEqual((summary["frames"], summary["generation_assumed"], summary["motor"]), (2000, False, "mg4005"))

    def test_other_files_are_refused(self):
        for text in (b"hello\n" * 3, bytes(range(256)) * 1000, b"\0" * 100000, b"(" * 3000000):
            for arguments in ([], ["--guess"]):
                ran = self.run_on(text, *arguments)
                self.assertEqual(ran.returncode, 2)
                self.assertRegex(ran.stderr, rb"no candump frame in .+; line 1")
                self.assertNotRegex(ran.stdout + ran.stderr, rb"[\x00-\x09\x0b-\x1f]")

    def test_drive_on_rs485_names_its_motor(self):
        # A real MS4015 (docs/reference/rs485.md), and a drive named ../x, whose 58 bytes have a sum that ends in 35.
        for motor, total, said in (("4D5334303135", "9C", " --motor ms4015"), ("2E2E2F780000", "35", "")):
            ran = self.run_on(("(1.000000) u rs485#3E12010051\n"
                               "(1.000900) u rs485#3E12013A8B4453343052370000000000000000000000000000" + motor +
                               "0000000000000000000000000000353735303032731878034A4B2C01C800EB00" + total + "\n").encode(),
                              "--guess", "--json")
            self.assertEqual(ran.returncode, 0)
            drive, summary = (json.loads(line) for line in ran.stdout.splitlines())
            self.assertEqual(drive.get("motor"), said.removeprefix(" --motor ") or None)
            self.assertTrue(summary["commands"][0].endswith(said), summary)
            self.assertEqual("--motor" in summary["commands"][0], said != "")

    def test_empty_log_is_refused(self):
        for text in (b"", b"\n\n"):
            for arguments in ([], ["--guess"], ["--json"]):
                ran = self.run_on(text, *arguments)
                self.assertEqual(ran.returncode, 2)
                self.assertRegex(ran.stderr, rb"decode: .*\.log has no frame")

    def test_mistakes_are_reported(self):
        for arguments, said in ((["/no/such/file"], "cannot read /no/such/file"), (["/"], "/ is not a recording"),
                                (["--motor", "mf7051"], "did you mean mf7015?"),
                                (["--generation", "v237"], "not one of legacy, late-legacy, v235, v236, v236b"),
                                (["--guess", "--generation", "v235"], " excludes --g"),
                                (["--guess", "--motor", "mg4005"], " excludes --"),
                                (["--lang", "fr"], "neither en nor zh")):
            ran = subprocess.run([PROGRAM, "decode", *arguments], capture_output=True, text=True, check=False,
                                 stdin=subprocess.DEVNULL)
            self.assertEqual(ran.returncode, 2, arguments)
            self.assertIn(said, ran.stderr)

    def test_full_disk_is_reported(self):
        with open("/dev/full", "wb") as full:
            ran = subprocess.run([PROGRAM, "decode"], input=QUERY, stdout=full, stderr=subprocess.PIPE, text=True,
                                 check=False)
        self.assertEqual(ran.returncode, 1)
        self.assertIn("standard output: No space left on device", ran.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
