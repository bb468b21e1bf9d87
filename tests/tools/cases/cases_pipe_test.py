#!/usr/bin/python3
"""Tests `lk-emu run --cases -` on a pipe: exit statuses, live results, and memory independent of the number of cases.

usage: cases_pipe_test.py LK_EMU
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import unittest

PROGRAM = os.path.abspath(sys.argv[1])
ROBOT = '[[bus]]\ninterface = "vcan0"\n[[bus.drive]]\nid = 1\nmotor = "mf7015"\n'
SCENARIO = 'robot = "robot.toml"\nduration_s = 0.001\n[[expect]]\nid = 1\nsignal = "alive"\nmin = 1\n'


def peak_memory(process):
    """Returns bytes. Pre: the process has ended, but was not waited for."""
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return usage.ru_maxrss * 1024


class Cases(unittest.TestCase):
    def setUp(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.folder = pathlib.Path(directory.name)
        (self.folder / "robot.toml").write_text(ROBOT)
        (self.folder / "tiny.toml").write_text(SCENARIO)

    def start(self, *arguments):
        return subprocess.Popen([PROGRAM, "run", "--cases", "-", *arguments], cwd=self.folder, stdin=subprocess.PIPE,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def run_cases(self, text, *arguments):
        with self.start(*arguments) as process:
            out, err = process.communicate(text)
        return process.returncode, out, err

    def peak_of(self, requests, *arguments):
        """Returns the peak memory for these cases; each case must have a result."""
        numbers = []
        with self.start(*arguments) as process:
            reader = threading.Thread(target=lambda: numbers.extend(json.loads(line)["case"] for line in process.stdout))
            reader.start()
            count = 0
            for request in requests:
                process.stdin.write(json.dumps(request) + "\n")
                count += 1
            process.stdin.close()
            reader.join()
            self.assertEqual(process.stderr.read(), "")
            memory = peak_memory(process)
        self.assertEqual(sorted(numbers), list(range(count)))
        return memory

    def test_exit_status_depends_on_results(self):
        good = json.dumps({"case": 1, "scenario": "tiny.toml"}) + "\n"
        status, out, err = self.run_cases(good)
        self.assertEqual((status, json.loads(out)["case"], err), (0, 1, ""))
        status, out, err = self.run_cases(good + '{"case": 2, "scenario": "none.toml"}\n')
        self.assertEqual((status, len(out.splitlines()), err), (1, 2, ""))
        status, out, err = self.run_cases("{\n")
        self.assertEqual((status, out, err.count("\n")), (2, "", 1))
        self.assertTrue(err.startswith("lk-emu: --cases: standard input:1: byte 2: not JSON: "), err)
        status, _, err = self.run_cases('{"\\u0007": 1, "\\u0007": 2}\n')
        self.assertEqual((status, err), (2, "lk-emu: --cases: standard input:1: ?: is given twice\n"))
        for jobs in ("0", "1025", "x", "-1"):
            self.assertEqual(self.run_cases("", f"--jobs={jobs}")[0], 2, jobs)

    def test_blank_line_flushes_results_before_the_input_ends(self):
        with self.start() as process:
            process.stdin.write('{"case": 1, "scenario": "tiny.toml"}\n\n')
            process.stdin.flush()
            self.assertEqual(json.loads(process.stdout.readline())["case"], 1)
            process.stdin.close()
            self.assertEqual(process.stdout.read(), "")
            self.assertEqual(process.wait(), 0)

    def test_memory_does_not_grow_with_the_number_of_cases(self):
        def requests(count):
            for number in range(count):
                yield {"case": number, "scenario": "tiny.toml", "seed": number // 16, "bitrate": 250_000 if number % 2 else 500_000}

        few, many = self.peak_of(requests(2000)), self.peak_of(requests(20_000))
        self.assertLess(many, few + 2_000_000)  # 100 bytes for each additional case

    def test_memory_does_not_grow_with_the_number_of_scenarios(self):
        def requests(count):
            for number in range(count):
                name = f"{number}.toml"
                (self.folder / name).write_text(SCENARIO)
                yield {"case": number, "scenario": name}

        few, many = self.peak_of(requests(300), "--check"), self.peak_of(requests(3000), "--check")
        self.assertLess(many, few + 2_000_000)

    def test_endless_line_is_refused_in_bounded_memory(self):
        with self.start() as process:
            with self.assertRaises(BrokenPipeError):
                while True:
                    process.stdin.write("x" * 65_536)
            self.assertEqual(process.stderr.read(), "lk-emu: --cases: standard input:1: is longer than 1 MB\n")
            self.assertLess(peak_memory(process), 100_000_000)
        self.assertEqual(process.returncode, 2)

    def test_long_lines_share_a_bounded_queue(self):
        """A line of 0.9 MB takes about 100 MB when parsed. A queue of 128 such lines would use up all memory."""
        detect = ",".join(["{}"] * 300_000)
        memory = []
        for count in (1, 8):
            with self.start() as process:
                threading.Thread(target=process.stdout.read).start()
                for number in range(count):
                    process.stdin.write(f'{{"case": {number}, "scenario": "tiny.toml", "detect": [{detect}]}}\n')
                process.stdin.close()
                process.stderr.read()
                memory.append(peak_memory(process))
            self.assertEqual(process.returncode, 1)
        self.assertLess(memory[1], 2.5 * memory[0])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
