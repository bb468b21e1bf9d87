#!/usr/bin/env python3
"""`lk-emu-body demo`: starts robot, dashboard and host with one command, and ends all of them on Ctrl-C.

    demo_test.py LK-EMU LK-EMU-BODY
"""

import glob
import json
import os
import pty
import re
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.request
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "python"))

from lkemu.telemetry import Telemetry  # noqa: E402

BODY, PLAIN = os.path.abspath(sys.argv.pop()), os.path.abspath(sys.argv.pop())
LIMIT_S = 120
PATIENCE_S = 30  # time-out, in simulated time
KNEES = "/api/v1/telemetry?signals=joint_deg&ids=3,6,9,12&rate_Hz=20"
# Knee angle of the standing dog, by hand: 2*acos(0.40/0.50), with the foot 0.40 m below the hip and both segments
# 0.25 m long. The knee of the lying dog is at 164 degrees.
STANDS_DEG, NEARLY_DEG = 73.7, 5


def children(pid):
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def runs(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def end(process):
    """Ends the process, and prints its output if it failed."""
    if process.poll() is None:
        process.terminate()
        print(process.communicate(timeout=LIMIT_S)[0])


def answer_of(*command, **more):
    ran = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=LIMIT_S, **more)
    return ran.returncode, ran.stdout


class Demo(unittest.TestCase):
    def setUp(self):
        self.directory = tempfile.TemporaryDirectory()
        self.addCleanup(self.directory.cleanup)

    def start(self, program, robot):
        """Returns the process and the dashboard's address."""
        process = subprocess.Popen(
            [program, "demo", robot, "--no-browser"], stdout=subprocess.PIPE, text=True,
            env={**os.environ, "XDG_RUNTIME_DIR": self.directory.name},
        )  # fmt: skip
        self.addCleanup(end, process)
        line = process.stdout.readline()
        found = re.search(r"http://127\.0\.0\.1:\d+/", line)
        self.assertTrue(found, line)
        return process, found[0]

    def wait_until_it_stands(self):
        (control,) = glob.glob(os.path.join(self.directory.name, "lk-emu", "*.sock"))
        with Telemetry(control, KNEES, LIMIT_S) as knees:
            for sample in knees:
                if all(abs(drive["joint_deg"] - STANDS_DEG) < NEARLY_DEG for drive in sample.drives.values()):
                    return
                self.assertLess(sample.time_s, PATIENCE_S)
        self.fail("lk-emu has ended")

    def wait_for_frames(self, address):
        """Waits until a host sends, again if it has ended."""
        began = None
        for _ in range(10 * LIMIT_S):
            with urllib.request.urlopen(address + "api/v1/status", timeout=LIMIT_S) as answer:
                frames = json.load(answer)["buses"][0]["counters"]["frames"]
            began = frames if began is None else began
            if frames > began + 20:
                return
            time.sleep(0.1)
        self.fail("no host sends")

    def test_dog_walks_on_after_pauses_of_robot_and_host(self):
        process, address = self.start(BODY, "quadruped")
        self.assertEqual(process.stdout.readline(), "up\n")
        both = children(process.pid)
        for stopped in ([both[1]], [both[0]], both):
            for pid in stopped:
                os.kill(pid, signal.SIGSTOP)
            time.sleep(5)
            for pid in stopped:
                os.kill(pid, signal.SIGCONT)
            self.wait_for_frames(address)
            time.sleep(2)
        with urllib.request.urlopen(address + "api/v1/body", timeout=LIMIT_S) as answer:
            body = json.load(answer)
        (trunk,) = (pose for pose, part in zip(body["poses"], body["bodies"]) if part["free"])
        said = self.end_well(process)
        self.assertNotIn("the host has ended", said)
        self.assertGreater(trunk[2], 0.3, said)  # it stands; see hosts_test.py

    def end_well(self, process):
        below = children(process.pid)
        self.assertEqual(len(below), 2)
        process.send_signal(signal.SIGINT)
        said, _ = process.communicate(timeout=LIMIT_S)
        self.assertEqual(process.returncode, 0, said)
        self.assertEqual([pid for pid in below if runs(pid)], [])
        return said

    def test_dog_stands_up_and_ctrl_c_ends_all(self):
        process, address = self.start(BODY, "quadruped")
        with urllib.request.urlopen(address + "api/v1/status", timeout=LIMIT_S) as answer:
            status = json.load(answer)
        self.assertTrue(status["body"] and status["pages_may_write"])
        self.wait_until_it_stands()
        self.assertEqual(process.stdout.readline(), "up\n")
        said = self.end_well(process)
        self.assertIn("lk-emu stopped", said)
        self.assertNotIn("Traceback", said)

    def test_terminal_with_a_display_opens_a_browser(self):
        opener, opened = (os.path.join(self.directory.name, name) for name in ("xdg-open", "opened"))
        os.mkfifo(opened)
        with open(opener, "w", encoding="utf-8") as file:
            file.write(f'#!/bin/sh\necho "$1" >{opened}\n')
        os.chmod(opener, 0o755)
        terminal, its_end = pty.openpty()
        path = self.directory.name + os.pathsep + os.environ["PATH"]
        environment = {**os.environ, "XDG_RUNTIME_DIR": self.directory.name, "DISPLAY": ":7", "PATH": path}
        process = subprocess.Popen([BODY, "demo", "arm"], stdout=its_end, env=environment)
        self.addCleanup(end, process)
        reader = os.open(opened, os.O_RDWR)  # O_RDWR does not wait for the writer
        self.assertTrue(select.select([reader], [], [], LIMIT_S)[0])
        self.assertRegex(os.read(reader, 100), rb"^http://127\.0\.0\.1:\d+/\n$")
        os.close(reader)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(LIMIT_S), 0)
        self.assertIn(b"demo: http://127.0.0.1:", os.read(terminal, 65536))
        os.close(terminal)
        os.close(its_end)

    def test_two_demos_run_at_once_and_lk_emu_starts_lk_emu_body(self):
        first, one = self.start(BODY, "arm")
        second, other = self.start(PLAIN, "arm")
        self.assertNotEqual(one, other)
        for process in (first, second):
            self.end_well(process)

    def test_host_starts_again_until_it_fails_three_times_and_demo_ends_with_the_robot(self):
        process, address = self.start(BODY, "quadruped")
        self.assertEqual(process.stdout.readline(), "up\n")
        (robot, _) = children(process.pid)
        for then in ("starts again in 3 s", "starts again in 3 s", "Ctrl-C ends the demo"):
            # Killed while it stands up: a later end counts as a first failure.
            os.kill(children(process.pid)[1], signal.SIGKILL)
            self.assertIn(then, process.stdout.readline())
            self.assertTrue(runs(robot))
            if then.startswith("starts"):
                self.wait_for_frames(address)
        os.kill(robot, signal.SIGKILL)
        process.communicate(timeout=LIMIT_S)
        self.assertEqual(process.returncode, 1)

    def test_errors_are_one_line(self):
        without = {**os.environ, "PATH": self.directory.name}
        for words, environment, status, said in (
            (["cat"], None, 2, 'lk-emu: demo: unknown robot "cat", known are quadruped, arm\n'),
            (["arm"], without, 2, "lk-emu: demo: its host needs python3 and python-can: apt install python3-can\n"),
        ):
            self.assertEqual(answer_of(BODY, "demo", *words, env=environment), (status, said))

    def test_lk_emu_alone_names_the_missing_package(self):
        alone = os.path.join(self.directory.name, "bin")
        os.mkdir(alone)
        os.symlink(os.path.realpath(os.path.join(os.path.dirname(PLAIN), "../share")), os.path.join(self.directory.name, "share"))
        shutil.copy(PLAIN, alone)
        said = "lk-emu: demo: its robots have a body: this needs the package lk-emu-body\n"
        self.assertEqual(answer_of(os.path.join(alone, "lk-emu"), "demo", "quadruped"), (2, said))


if __name__ == "__main__":
    unittest.main()
