"""lk-emu campaign as a program, and plans for it."""

import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

LK_EMU = Path(sys.argv.pop(1)).resolve()
SHORT_MOVE = Path(__file__).resolve().parent.parent / "run" / "short_move.toml"

KINDS = '''fault.kind = ["silent", "jam", "drop", "kick"]
fault.id = 1
fault.at_s = { from = 0, to = 0.9 }
fault.for_s = [0.05, 0.3]
fault.jam.percent = { from = 20, to = 100 }
fault.kick.impulse_Nms = { from = 0.05, to = 1 }
'''
DETECT = '''
[detect]
drive = "any"
[[detect.host]]
id = 1
answered = { within_s = 0.02 }
'''


def plan(cases=200, dimensions=KINDS + "supply_V = [20, 24]\n", sampling="random", rest=""):
    count = f"cases = {cases}\n" if cases else ""
    return (f'scenario = "{SHORT_MOVE}"\nsampling = "{sampling}"\n{count}{rest}[dimension]\n{dimensions}{DETECT}')


class InADirectory(unittest.TestCase):
    """Each test has a directory of its own, in which the program runs."""

    def setUp(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.directory = Path(directory.name)

    def write(self, name, text):
        (self.directory / name).write_text(text)
        return name

    def files(self):
        """Names and bytes of all that is there."""
        return {str(file.relative_to(self.directory)): file.read_bytes()
                for file in sorted(self.directory.rglob("*")) if file.is_file()}

    def begin(self, *words):
        process = subprocess.Popen([LK_EMU, *words], cwd=self.directory, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.stderr.close)
        return process

    def run_it(self, *words):
        return subprocess.run([LK_EMU, *words], cwd=self.directory, capture_output=True, text=True, check=False)

    def campaign(self, *words, status=0):
        done = self.run_it("campaign", *words)
        self.assertEqual(done.returncode, status, (words, done.stdout[-500:], done.stderr))
        return done

    def refused(self, *words, says=".", out=""):
        """In one line, with status 2, and nothing is written."""
        before = self.files()
        done = self.campaign(*words, status=2)
        self.assertEqual(done.stderr.count("\n"), 1, (words, done.stderr))
        self.assertTrue(done.stderr.startswith("lk-emu: "), done.stderr)
        self.assertRegex(done.stderr, says)
        self.assertRegex(done.stdout, rf"\A{out}\Z", words)
        self.assertEqual(self.files(), before, words)

    def export(self, store):
        return self.campaign("export", store).stdout

    def state_of(self, store):
        """Changes when something has been put into the store."""
        parts = [self.directory / (store + end) for end in ("", "-journal", "-wal")]
        return [(os.stat(part).st_size, os.stat(part).st_mtime_ns) for part in parts if part.exists()]

    def wait_for_changes(self, process, store, changes):
        """False: it has ended before."""
        before = None
        while process.poll() is None:
            try:
                now = self.state_of(store)
            except FileNotFoundError:  # gone between two looks
                continue
            if now and now != before:
                before = now
                if changes == 0:
                    return True
                changes -= 1
        return False
