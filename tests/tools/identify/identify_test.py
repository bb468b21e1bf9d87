#!/usr/bin/python3
"""Tests `python3 -m lkemu.identify` on logs of a motor that is simulated here.

The emulator is not used, so that an error common to emulator and identify is found.

usage: identify_test.py LK_EMU [Quick | Thorough | Long]
"""

import contextlib
import io
import math
import os
import random
import struct
import subprocess
import sys
import tempfile
import tomllib
import unittest
from unittest import mock

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
sys.path.insert(0, os.path.join(ROOT, "python"))
os.environ["LKEMU"] = os.path.abspath(sys.argv.pop(1))

from lkemu.identify import __main__ as command  # noqa: E402
from lkemu.errors import StartError  # noqa: E402
from lkemu.identify import plan  # noqa: E402
from lkemu.identify.motor import load_motor  # noqa: E402

DEG = math.pi / 180
A_PER_LSB = 33 / 4096  # MF, v235
COUNTS = 65536
MOVE_DPS = 573


class Motor:
    """Motor with torques over k_t, at the rotor. The current lags commands. Reported speeds are means over 1 ms."""

    J, friction, cogging, order = 9e-4, 0.16, 0.03, 24
    STEP_S = 0.25e-3

    def __init__(self, lag_s=0.0):
        self.angle, self.speed, self.current, self.integral, self.lag = 0.3, 0.0, 0.0, 0.0, lag_s
        self.order_of, self.recent = ("torque", 0.0), [0.3] * 5

    def step(self):
        what, value = self.order_of
        if what in ("speed", "position"):
            wanted = value if what == "speed" else max(-MOVE_DPS, min(MOVE_DPS, 40 * (value - self.angle / DEG)))
            error = wanted * DEG - self.speed
            self.integral += 8 * error * self.STEP_S
            wanted = max(-8.0, min(8.0, 0.12 * error + self.integral))
        else:
            wanted, self.integral = value, 0.0
        self.current += (wanted - self.current) * (1 - math.exp(-self.STEP_S / self.lag) if self.lag else 1.0)
        push = self.current - self.cogging * math.sin(self.order * self.angle + 0.7)
        if self.speed == 0 and abs(push) <= self.friction:
            speed = 0.0
        else:
            speed = self.speed + (push - math.copysign(self.friction, self.speed or push)) / self.J * self.STEP_S
            speed = 0.0 if speed * self.speed < 0 else speed
        self.angle += (self.speed + speed) / 2 * self.STEP_S
        self.speed = speed
        self.recent = [*self.recent[1:], self.angle]

    def state(self, opcode, noise):
        counts = round((self.angle / (2 * math.pi) * COUNTS) + noise(0.2)) % COUNTS
        speed = (self.recent[-1] - self.recent[0]) / (4 * self.STEP_S) / DEG + noise(2.0)
        iq = round((self.current + noise(0.05)) / A_PER_LSB)
        return struct.pack("<BbhhH", opcode, 30, iq, round(speed), counts)


def record(steps, rate_Hz=200, seed=1, lag_s=0.0):
    """Simulates a host that commands these steps; returns [(seconds, frame, is_query)]."""
    draw, motor, now, frames = random.Random(seed), Motor(lag_s), 1.0, []
    for what, value, seconds in steps:
        for _ in range(max(1, round(seconds * rate_Hz))):
            period = (1 + draw.uniform(-0.15, 0.15)) / rate_Hz
            ask = struct.pack("<Bxxxi", 0xA2, round(value * 100))
            if what == "torque":
                ask = struct.pack("<BxxxhH", 0xA1, round(value / A_PER_LSB), 0)
                value = round(value / A_PER_LSB) * A_PER_LSB
            if what == "position":
                ask = struct.pack("<BxHi", 0xA4, MOVE_DPS, round(value * 100))
            frames.append((now, ask.hex().upper(), True))
            frames.append((now + 0.34e-3, motor.state(ask[0], lambda sd: draw.gauss(0, sd)).hex().upper(), False))
            steps_until_next = round(period / motor.STEP_S)
            motor.step()  # the reply has the state before the command acts
            motor.order_of = (what, value)
            for _ in range(steps_until_next - 1):
                motor.step()
            now += round(period / motor.STEP_S) * motor.STEP_S
    return frames


def log_of(frames, query_early_s=0.0, reply_late_s=0.0, seed=5, shift_s=0.0):
    draw, lines = random.Random(seed), []
    for at, data, is_query in frames:
        off = -draw.uniform(0, query_early_s) if is_query else draw.uniform(0, reply_late_s)
        lines.append(f"({at + off + shift_s:.6f}) can0 141#{data}")
    return "\n".join(lines) + "\n"


def planned():
    return [step for step in plan.plan_steps(plan.plan_limits(load_motor("mf7015"))) if step[0] != "position"]


class Logs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.frames = record(planned())

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def identify(self, text, *options):
        """Runs identify; returns (status, standard output, standard error, table [identified])."""
        log, made = self.path("a.log"), self.path("made.toml")
        with open(log, "w", encoding="ascii") as file:
            file.write(text)
        out, err = io.StringIO(), io.StringIO()
        words = ["identify", log, "--motor", "mf7015", "--generation", "v235", "-o", made, *options]
        status = 0
        with mock.patch.object(sys, "argv", words), contextlib.redirect_stdout(out):
            try:
                command.main()
            except StartError as problem:
                status, err = 2, io.StringIO(f"{problem}\n")
            except SystemExit as ended:
                status = ended.code
        found = {}
        if status != 2 and os.path.exists(made):
            with open(made, "rb") as file:
                found = tomllib.load(file)["identified"]
            os.unlink(made)
        return status, out.getvalue(), err.getvalue(), found

    def assertInside(self, three, true):
        self.assertLessEqual(three[1], true)
        self.assertGreaterEqual(three[2], true)

    def assertWithin(self, three, share):
        self.assertLessEqual((three[2] - three[1]) / 2, share * three[0])


class Quick(Logs):
    def test_finds_the_numbers_of_a_clean_log(self):
        status, out, _, found = self.identify(log_of(self.frames))
        self.assertEqual(status, 0)
        self.assertIn("--generation v235, as given", out)
        self.assertInside(found["inertia_A_s2_rad"], Motor.J)
        self.assertWithin(found["inertia_A_s2_rad"], 0.05)
        # The motor file has more friction at low speed than this simulation.
        self.assertAlmostEqual(found["coulomb_A"][0], Motor.friction, delta=0.02 * Motor.friction)
        self.assertEqual(found["cogging_order"], Motor.order)

    def test_unusable_input_is_one_line(self):
        for text, reason in (("", "has no frame"), ("no frame\n", "no candump frame in "), (log_of(self.frames[:100]), "200 replies")):
            status, _, err, _ = self.identify(text)
            self.assertEqual((status, err.count("\n")), (2, 1), err)
            self.assertIn(reason, err)


class Thorough(Logs):
    def test_interval_covers_inertia_despite_stamp_errors(self):
        for early, late in ((1e-3, 1e-3), (2e-3, 2e-3)):
            with self.subTest(early=early, late=late):
                _, out, _, found = self.identify(log_of(self.frames, early, late))
                self.assertIn("Time stamp errors", out)
                if "inertia_A_s2_rad" in found:
                    self.assertInside(found["inertia_A_s2_rad"], Motor.J)

    def test_small_stamp_errors_keep_inertia_within_5_percent(self):
        _, _, _, found = self.identify(log_of(self.frames, 0.3e-3, 0.3e-3))
        self.assertWithin(found["inertia_A_s2_rad"], 0.05)
        self.assertInside(found["inertia_A_s2_rad"], Motor.J)

    def test_grades_do_not_depend_on_a_microsecond(self):
        def letters(shift_s):
            out = self.identify(log_of(self.frames, shift_s=shift_s))[1]
            return [line[2] for line in out.splitlines()[1:14]]

        at_zero = letters(0.0)
        self.assertEqual(letters(1e-6), at_zero)
        self.assertEqual(letters(-1e-6), at_zero)

    def test_interval_covers_inertia_despite_late_replies(self):
        """3 ms late, and later than the next query: the reply then looks like the reply to that query."""
        for late_s in (3e-3, 5.5e-3):
            late = sorted((at + (0 if is_query else late_s), data, is_query) for at, data, is_query in self.frames)
            with self.subTest(late_s=late_s):
                _, out, _, found = self.identify(log_of(late))
                self.assertNotRegex(out, "acts -")
                if "inertia_A_s2_rad" in found:
                    self.assertInside(found["inertia_A_s2_rad"], Motor.J)

    def test_refuses_commands_that_act_before_their_stamps(self):
        # Each query gets the reply to the next query, as if replies were paired with the wrong queries.
        queries = [one for one in self.frames if one[2]]
        replies = [one for one in self.frames if not one[2]][1:]
        mixed = []
        for query, reply in zip(queries, replies):
            mixed += [query, (query[0] + 0.3e-3, reply[1], False)]
        _, out, _, found = self.identify(log_of(mixed))
        self.assertNotIn("inertia_A_s2_rad", found)
        self.assertIn("which is impossible", out)

    def test_slow_current_loop_does_not_bias_the_inertia(self):
        _, _, _, found = self.identify(log_of(record(planned(), lag_s=5e-3)))
        if "inertia_A_s2_rad" in found:
            self.assertInside(found["inertia_A_s2_rad"], Motor.J)
        self.assertInside(found["current_lag_s"], 5e-3)

    def test_one_speed_gives_no_cogging(self):
        _, out, _, found = self.identify(log_of(record([("torque", 0, 1), ("speed", 200, 25)])))
        self.assertNotIn("cogging_A", found)
        self.assertIn("at one speed only", out)

    def test_normal_work_gives_friction_and_cogging(self):
        moves = [("position", 0.0 if n % 2 else 720.0, 1.7) for n in range(24)]
        _, _, _, found = self.identify(log_of(record(moves, rate_Hz=83)))
        self.assertAlmostEqual(found["coulomb_A"][0], Motor.friction, delta=0.05 * Motor.friction)
        self.assertEqual(found["cogging_order"], Motor.order)
        self.assertFalse("inertia_A_s2_rad" in found and self.is_usable(found["inertia_A_s2_rad"]))

    def is_usable(self, three):
        return (three[2] - three[1]) / 2 <= 0.15 * three[0]

    def test_reports_weak_pulses(self):
        weak = [(what, value * 0.45 if what == "torque" else value, seconds) for what, value, seconds in planned()]
        _, out, _, _ = self.identify(log_of(record(weak)))
        self.assertIn("--motor ./my_motor.toml", out)

    def test_marks_a_guessed_generation(self):
        with mock.patch.object(sys, "argv", ["identify", self.path("a.log"), "--motor", "mf7015"]):
            with open(self.path("a.log"), "w", encoding="ascii") as file:
                file.write(log_of(self.frames[:2000]))
            out = io.StringIO()
            with contextlib.redirect_stdout(out):
                command.main()
        self.assertIn("a guess", out.getvalue().splitlines()[0])

    def test_report_is_reproducible(self):
        pages = []
        for name in ("one.html", "two.html"):
            self.identify(log_of(self.frames), "--report", self.path(name))
            with open(self.path(name), encoding="utf-8") as file:
                pages.append(file.read())
        self.assertEqual(pages[0], pages[1])
        self.assertIn("<svg", pages[0])
        self.assertNotIn("clip-path", pages[0][pages[0].index("<svg") :])  # names of clip paths differ between runs

    def test_report_has_the_style_of_the_dashboard(self):
        """Its pictures have no colours of paper and ink of their own, so that they are readable in dark, too."""
        self.identify(log_of(self.frames), "--report", self.path("page.html"))
        with open(self.path("page.html"), encoding="utf-8") as file:
            page = file.read()
        with open(os.path.join(ROOT, "web", "style.css"), encoding="utf-8") as file:
            self.assertIn(file.read(), page)
        self.assertIn("@media (prefers-color-scheme: light), print", page)
        picture = page[page.index("<svg") :]
        self.assertIn("fill: var(--panel, #ffffff)", picture)
        self.assertNotRegex(picture, "(fill|stroke): #(ffffff|222222|8c8c8c|000000)")

    def test_expect_reports_changed_values(self):
        then = self.path("then.toml")
        with open(then, "w", encoding="ascii") as file:
            file.write(f"[identified]\ncoulomb_A = [{Motor.friction / 1.4}, {Motor.friction / 1.42}, {Motor.friction / 1.38}]\n")
        status, out, _, _ = self.identify(log_of(self.frames), "--expect", then)
        self.assertEqual(status, 1)
        self.assertRegex(out, r"drive 1: Coulomb friction is (39|4\d) % more than in ")


class Long(Logs):
    def test_memory_is_at_most_three_times_the_log(self):
        """Memory beyond that of Python and its libraries."""
        log, megabytes, shift_s = self.path("long.log"), 40, 0.0
        with open(log, "w", encoding="ascii") as file:
            while file.tell() < megabytes << 20:
                file.write(log_of(self.frames, 20e-6, 20e-6, seed=file.tell(), shift_s=shift_s))
                shift_s += 40
        script = (
            "import sys\n"
            "from lkemu.identify import __main__ as command, logs, motor_file, quantities, report\n"
            "def peak(): return int(open('/proc/self/status').read().split('VmHWM:')[1].split()[0]) << 10\n"
            "before = peak()\n"
            "command.main()\n"
            "print(peak() - before, file=sys.stderr)\n"
        )
        words = [sys.executable, "-c", script, log, "--motor", "mf7015", "--generation", "v235"]
        environment = {**os.environ, "PYTHONPATH": os.path.join(ROOT, "python")}
        done = subprocess.run(words, capture_output=True, text=True, env=environment, check=True)
        self.assertIn("inertia at the rotor", done.stdout)
        share = int(done.stderr) / os.path.getsize(log)
        print(f"{share:.2f} times the log")
        self.assertLessEqual(share, 3)


if __name__ == "__main__":
    unittest.main()
