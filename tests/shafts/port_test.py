"""Tests the shaft port of the running program: lock step, real time, both owners, lost and misbehaving simulators.

usage: port_test.py LK_EMU
"""

import contextlib
import os
import pathlib
import random
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest

PROGRAM = sys.argv.pop(1) if len(sys.argv) > 1 else "lk-emu"
ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "python"))
from lkemu.client import Client  # noqa: E402
from lkemu.errors import Ended, Refused  # noqa: E402
from lkemu.shafts import DRIVE, NOT_COUPLED, Shafts, State  # noqa: E402

PATIENCE_S = 60
SPEED_90 = b"t1418A200000028230000\r"  # 90.00 deg/s of the rotor
NAN = float("nan")


class Program:
    def __init__(self, directory: str, *arguments: str, ids: str = "1-2") -> None:
        self.place = f"unix:{directory}/shafts"
        self.control = f"{directory}/control"
        self.can = f"{directory}/can"
        self.process = subprocess.Popen(
            [PROGRAM, "--bus", f"slcan-pty:{self.can}", "--ids", ids, "--motor", "mf7015", "--rom", ":memory:",
             "--control", self.control, "--shafts", self.place, *arguments],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        assert "ready" in self.process.stdout.readline(), self.process.communicate()

    def until_logged(self, text: str) -> None:
        """Waits for a log line; `stop` then returns only later lines."""
        while text not in self.process.stderr.readline():
            assert self.process.poll() is None

    def stop(self) -> str:
        """Stops the program; returns its log."""
        self.process.send_signal(signal.SIGTERM)
        _, errors = self.process.communicate(timeout=PATIENCE_S)
        assert self.process.returncode == 0, errors
        return errors

    def advance(self, by_s: float) -> None:
        client = Client(self.control, PATIENCE_S, RuntimeError)
        try:
            client.post("/clock/advance", {"by_s": by_s})
        finally:
            client.close()

    def clock(self) -> dict:
        client = Client(self.control, PATIENCE_S, RuntimeError)
        try:
            return client.get("/clock")
        finally:
            client.close()

    def time_s(self) -> float:
        return self.clock()["time_s"]


@contextlib.contextmanager
def program(*arguments: str, ids: str = "1-2"):
    with tempfile.TemporaryDirectory() as directory:
        running = Program(directory, *arguments, ids=ids)
        try:
            yield running
        finally:
            if running.process.poll() is None:
                running.process.kill()
                running.process.communicate()


def say(can, line: bytes, answer: bytes) -> None:
    """Sends a line to slcan and waits for its answer."""
    can.write(line)
    heard = b""
    while answer not in heard:
        heard += can.read(1)


def eventually(holds) -> None:
    end = time.monotonic() + PATIENCE_S
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.02)


class FreeJoint:
    """An inertia and a torque, integrated by formula."""

    def __init__(self, inertia: float, torque: float = 0.0) -> None:
        self.inertia, self.torque = inertia, torque
        self.angle = self.speed = self.armature = 0.0

    def state(self) -> State:
        return State(self.angle, self.speed, self.inertia + self.armature, self.torque)

    def step(self, given, h: float) -> None:
        self.armature = given.armature_kg_m2
        acceleration = (given.torque_Nm + self.torque) / (self.inertia + self.armature)
        self.angle += h * (self.speed + h * acceleration / 2)
        self.speed += h * acceleration


def run(shafts: Shafts, joints, steps: int):
    for joint, offered in zip(joints, shafts.joints):
        joint.armature = offered.armature_kg_m2
    trace = []
    for _ in range(steps):
        for joint, given in zip(joints, shafts.exchange([joint.state() for joint in joints])):
            joint.step(given, shafts.step_s * shafts.steps)
            trace.append((joint.angle, given.torque_Nm))
    return trace


class LockStep(unittest.TestCase):
    def test_joint_turns_at_the_commanded_speed(self) -> None:
        with program("--clock", "stepped", "--quirk", "current_loop=fast", ids="1") as running, \
                open(running.can, "r+b", buffering=0) as can, Shafts(running.place) as shafts:
            self.assertEqual(shafts.joints[0].name, f"slcan-pty:{running.can}:1")
            self.assertEqual(shafts.step_s, 1e-3)
            joint = FreeJoint(0.01)
            run(shafts, [joint], 10)
            say(can, b"O\r" + SPEED_90, b"z\r")
            run(shafts, [joint], 500)
            start = joint.angle
            run(shafts, [joint], 1000)  # a mean over its cogs
            self.assertAlmostEqual(joint.angle - start, 1.5707963, delta=0.05, msg="90 deg/s, without a gear")
            self.assertAlmostEqual(running.time_s(), 1.51, places=9, msg="a step for each exchange")

    def test_three_runs_are_bit_identical(self) -> None:
        traces = []
        for _ in range(3):
            with program("--clock", "stepped") as running, Shafts(running.place) as shafts:
                traces.append(run(shafts, [FreeJoint(0.01, 0.2), FreeJoint(0.002, -0.1)], 300))
        self.assertEqual(traces[0], traces[1])
        self.assertEqual(traces[0], traces[2])
        self.assertGreater(abs(traces[0][-1][0]), 0.01)

    def test_drive_moves_a_joint_that_it_owns(self) -> None:
        with program(ids="1") as running:
            name = f"slcan-pty:{running.can}:1"
            with Shafts(running.place, owners={name: DRIVE}) as shafts:
                begin = shafts.joints[0].angle_rad
                for _ in range(200):
                    given = shafts.exchange([State(NAN, NAN, 0.01, 0.5)])[0]
                inertia = 0.01 + given.armature_kg_m2
                self.assertLess(given.speed_rad_s, 0.5 * 0.2 / inertia, "friction takes some")
                self.assertGreater(given.speed_rad_s, 0.5 * 0.5 * 0.2 / inertia)
                self.assertAlmostEqual(given.angle_rad - begin, given.speed_rad_s * 0.1, delta=0.2 * given.speed_rad_s * 0.1)

    def test_uncoupled_joint_keeps_its_load(self) -> None:
        with program() as running:
            with Shafts(running.place, owners={f"slcan-pty:{running.can}:2": NOT_COUPLED}) as shafts:
                run(shafts, [FreeJoint(0.01), FreeJoint(0.01)], 10)
                self.assertEqual(shafts.exchange([State(0, 0, 0.1, 0), State(NAN, NAN, NAN, NAN)])[1], (0,) * 5)

    def test_simulator_owns_the_clock(self) -> None:
        with program() as running, Shafts(running.place) as shafts:
            run(shafts, [FreeJoint(0.01), FreeJoint(0.01)], 5)
            with self.assertRaisesRegex(Refused, "the simulator at --shafts owns the clock"):
                running.advance(1.0)
            self.assertAlmostEqual(running.time_s() * 1e3, round(running.time_s() * 1e3), places=6)

    def test_second_simulator_is_refused(self) -> None:
        with program() as running, Shafts(running.place) as shafts:
            with self.assertRaisesRegex((Refused, Ended), "another simulator is connected"):
                Shafts(running.place)
            run(shafts, [FreeJoint(0.01), FreeJoint(0.01)], 5)


class RealTime(unittest.TestCase):
    def test_clock_keeps_running_with_a_late_simulator(self) -> None:
        with program() as running, Shafts(running.place, time="drives") as shafts:
            joints = [FreeJoint(0.01, 0.05), FreeJoint(0.01)]
            run(shafts, joints, 50)
            before = running.time_s()
            eventually(lambda: running.time_s() > before + 0.2)
            run(shafts, joints, 1)
            missed = shafts.number
            run(shafts, joints, 2)
            self.assertGreater(shafts.number, missed)
            log = running.stop()
            self.assertEqual(log.count("is late"), 1, log)
            self.assertNotIn("error", log)

    def test_stepped_clock_waits_for_the_simulator(self) -> None:
        with program("--clock", "stepped") as running, Shafts(running.place, time="drives") as shafts:
            joints = [FreeJoint(0.01), FreeJoint(0.01)]
            for joint, offered in zip(joints, shafts.joints):
                joint.armature = offered.armature_kg_m2

            def advance_once_coupled() -> None:
                running.until_logged("a simulator has 2 of 2 joints")
                running.advance(0.02)

            advance = threading.Thread(target=advance_once_coupled)
            advance.start()
            run(shafts, joints, 20)
            advance.join(PATIENCE_S)
            self.assertAlmostEqual(running.time_s(), 0.02, places=9)


class Lost(unittest.TestCase):
    def test_drives_keep_running_without_the_simulator(self) -> None:
        with program() as running:
            with Shafts(running.place) as shafts:
                run(shafts, [FreeJoint(0.01), FreeJoint(0.01)], 50)
            eventually(lambda: running.time_s() > 0.2)
            log = running.stop()
            self.assertIn("shafts: the simulator has gone: the drives keep running without it", log)

    def test_stop_pauses_time_until_one_connects(self) -> None:
        with program("--shafts-lost", "stop") as running:
            with Shafts(running.place) as shafts:
                run(shafts, [FreeJoint(0.01), FreeJoint(0.01)], 50)
            eventually(lambda: running.clock()["mode"] == "stepped")
            stands = running.time_s()
            with Shafts(running.place, time="drives") as shafts:
                run(shafts, [FreeJoint(0.01), FreeJoint(0.01)], 50)
                self.assertGreaterEqual(running.time_s(), stands + 0.04)
                self.assertEqual(running.clock()["mode"], "realtime")
            self.assertIn("has gone: time is stopped until one connects", running.stop())

    def test_stop_pauses_time_before_the_first_one(self) -> None:
        with program("--shafts-lost", "stop") as running:
            self.assertEqual(running.clock()["mode"], "stepped")
            stands = running.time_s()
            self.assertLess(stands, 0.01)
            time.sleep(0.1)
            self.assertEqual(running.time_s(), stands)
            with Shafts(running.place, time="drives") as shafts:
                run(shafts, [FreeJoint(0.01), FreeJoint(0.01)], 50)
                self.assertEqual(running.clock()["mode"], "realtime")
            self.assertIn("time is stopped until a simulator connects", running.stop())

    def test_scenario_without_a_simulator_does_not_pass(self) -> None:
        with tempfile.TemporaryDirectory() as directory:
            scenario = pathlib.Path(directory) / "nothing.toml"
            scenario.write_text('duration_s = 0.1\n[[expect]]\nid = 1\nsignal = "alive"\nmin = 0\n')
            with program("--shafts-lost", "stop", "--scenario", str(scenario)) as running:
                time.sleep(0.5)
                self.assertIsNone(running.process.poll(), "it waits for a simulator")
                running.process.send_signal(signal.SIGTERM)
                running.process.communicate(timeout=PATIENCE_S)
                self.assertEqual(running.process.returncode, 3)

    def test_simulator_that_ends_within_a_message_is_reported(self) -> None:
        with program() as running:
            shafts = Shafts(running.place)
            run(shafts, [FreeJoint(0.01), FreeJoint(0.01)], 5)
            shafts._socket.sendall(struct.pack("<4sIIIIIQ", b"LKSH", 1, 3, 96, 2, 0, 5) + b"\0" * 20)
            shafts.close()
            eventually(lambda: running.time_s() > 0.1)
            self.assertIn("has gone", running.stop())


class Nonsense(unittest.TestCase):
    def refused(self, state: State, reason: str) -> None:
        with program() as running:
            with Shafts(running.place) as shafts:
                joints = [FreeJoint(0.01), FreeJoint(0.01)]
                run(shafts, joints, 5)
                with self.assertRaisesRegex(Refused, reason):
                    shafts.exchange([joints[0].state(), state])
            log = running.stop()
            self.assertRegex(log, reason)
            self.assertEqual(log.count("[error]") + log.count("error "), 1, log)

    def test_nan_is_refused_with_joint_and_field(self) -> None:
        self.refused(State(NAN, 0, 0.1, 0), r":2: angle_rad is nan")

    def test_inertia_below_the_armature_is_refused(self) -> None:
        self.refused(State(0, 0, 1e-6, 0), r":2: inertia_kg_m2 is 1e-06, below the drive's armature")

    def test_host_is_served_despite_a_thousand_bad_simulators(self) -> None:
        dice = random.Random(1)
        with program() as running, open(running.can, "r+b", buffering=0) as can:
            can.write(b"O\r")
            for n in range(1000):
                with socket.socket(socket.AF_UNIX) as one:
                    one.connect(running.place[5:])
                    with contextlib.suppress(OSError):
                        self.misbehave(dice, one)
                if n % 50 == 0:
                    can.write(b"t14189A00000000000000\r")
            end = time.monotonic() + PATIENCE_S
            heard = b""
            os.set_blocking(can.fileno(), False)
            while heard.count(b"t14189A") < 20 and time.monotonic() < end:
                heard += can.read(65536) or b""
                time.sleep(0.02)
            self.assertGreaterEqual(heard.count(b"t14189A"), 20)
            with Shafts(running.place) as shafts:
                run(shafts, [FreeJoint(0.01), FreeJoint(0.01)], 10)
            log = running.stop()
            self.assertIn("shafts: further messages of this kind are suppressed for a while", log)
            self.assertLess(len(log), 20_000, "while it was not read")

    def misbehave(self, dice: random.Random, one: socket.socket) -> None:
        way = dice.randrange(6)
        accept = struct.pack("<4sIIIIIQ", b"LKSH", 1, 2, 48, 2, 1, 0) + struct.pack("<4I", 1, 0, 1, 0)
        states = struct.pack("<4sIIIIIQ", b"LKSH", 1, 3, 96, 2, 0, 0) + struct.pack("<8d", 0, 0, 0.1, 0, 0, 0, 0.1, 0)
        if way == 0:
            one.sendall(dice.randbytes(dice.randrange(1, 300)))
        elif way == 1:
            one.sendall(states)  # before ACCEPT
        elif way == 2:
            one.sendall(accept + accept)
        elif way == 3:
            one.sendall(accept + states + states)  # one more than expected
        elif way == 4:
            one.sendall(accept[: dice.randrange(len(accept))])
        else:
            broken = bytearray(accept + states)
            for _ in range(3):
                broken[dice.randrange(len(broken))] ^= 1 << dice.randrange(8)
            one.sendall(broken)
        one.settimeout(0.02)
        one.recv(4096)


class Options(unittest.TestCase):
    def test_invalid_address_gives_one_line_and_status_2(self) -> None:
        for arguments, said in (
            (["--shafts", "udp:1"], '--shafts: "udp:1" is not unix:PATH or tcp:[ADDR:]PORT'),
            (["--shafts", "unix:"], "--shafts: unix: needs a path"),
            (["--shafts", "tcp:70000"], '--shafts: "tcp:70000" needs a port'),
            (["--shafts", "tcp:host:1"], '--shafts: "host" is not an IP address'),
            (["--shafts", "unix:/nowhere/at/all"], "/nowhere/at/all"),
            (["--shafts-lost", "stop"], "--shafts-lost: belongs to --shafts"),
            (["--shafts", "tcp:0", "--shafts-lost", "x"], '--shafts-lost: "x" is neither free nor stop'),
            (["--shafts", "tcp:0", "--record", "/tmp/x"], "--record: not possible with --shafts"),
        ):
            with tempfile.TemporaryDirectory() as directory:
                done = subprocess.run([PROGRAM, "--bus", f"slcan-pty:{directory}/can", "--ids", "1", "--rom", ":memory:",
                                       "--control", "none", *arguments], capture_output=True, text=True, timeout=PATIENCE_S,
                                      check=False)
            self.assertEqual(done.returncode, 2, done)
            self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
            self.assertIn(said, done.stderr)


if __name__ == "__main__":
    unittest.main()
