#!/usr/bin/python3
"""Tests lkemu.identify on planted motors, with exact time stamps and with jitter.

usage: planted_test.py LK_EMU MOTORS LOGS [TEST]...   number of motors, and of logs with up to 3 ms of jitter
"""

import math
import os
import random
import statistics
import sys
import tempfile
import unittest

os.environ["LKEMU"] = os.path.abspath(sys.argv.pop(1))
import planted  # noqa: E402

from lkemu.identify.balance import TooRough, fit_balance  # noqa: E402
from lkemu.identify.quantities import identify  # noqa: E402
from lkemu.identify.timing import timing  # noqa: E402
from lkemu.identify.logs import read_tracks  # noqa: E402

MOTORS, LOGS = int(sys.argv.pop(1)), int(sys.argv.pop(1))
SMALL_JITTER_S, MOST_JITTER_S = 0.3e-3, 3e-3
FEWEST_FOR_A_MEDIAN = 10


def binomial(hits, tries):
    """Probability of at most `hits` successes in `tries` with a success probability of 95 %."""
    return sum(math.comb(tries, k) * 0.95**k * 0.05 ** (tries - k) for k in range(hits + 1))


class Found:
    """Errors of one quantity over all motors."""

    def __init__(self):
        self.errors, self.inside = [], 0

    def add(self, estimate, true):
        self.errors.append(abs(estimate.value / true - 1))
        self.inside += abs(estimate.value - true) <= estimate.half_width

    def __str__(self):
        return f"{len(self.errors)} usable, median error {statistics.median(self.errors):.2%}, {self.inside} inside the interval"


class PlantedMotors(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.motors, scripts = [], {}
        for seed in range(1, MOTORS + 1):
            motor = planted.Planted(seed)
            if motor.motor not in scripts:
                scripts[motor.motor] = planted.script_of(motor.motor)
            cls.motors.append((motor, planted.frames(motor, scripts[motor.motor])))

    def track(self, motor, text):
        with tempfile.NamedTemporaryFile("w", suffix=".log") as file:
            file.write(text)
            file.flush()
            return read_tracks([file.name], motor.motor, motor.base, "v235", None)[0]

    def assertCovers(self, found, key):
        tries = len(found.errors)
        self.assertGreaterEqual(binomial(found.inside, tries), 0.01, f"{key}: {found.inside} of {tries}")

    def test_intervals_cover_truth_in_logs_of_plans(self):
        found, orders = {}, 0
        for motor, frames in self.motors:
            drive = identify(self.track(motor, planted.log_text(frames, random.Random(motor.seed))))
            self.assertIsNotNone(drive.balance, motor.seed)
            self.assertLessEqual(drive.balance.held_out_ratio, 1.2, motor.seed)
            truth = motor.truth()
            orders += drive.cogging() is not None and drive.cogging().order == truth["cogging_order"]
            for key, true in truth.items():
                if key in drive.values and drive.is_usable(key):
                    found.setdefault(key, Found()).add(drive.values[key], true)
            # A log of a free shaft cannot determine these.
            for key in ("gravity_A", "k_t_Nm_A", "R_ohm"):
                self.assertFalse(drive.is_usable(key), f"{motor.seed}: {key}")
        for key, one in found.items():
            print(f"{key}: {one}")
        self.assertGreaterEqual(orders, math.floor(0.95 * MOTORS))
        for key, one in found.items():
            self.assertCovers(one, key)
            if len(one.errors) >= FEWEST_FOR_A_MEDIAN:
                self.assertLessEqual(statistics.median(one.errors), 0.05, key)
        for key in ("inertia_A_s2_rad", "coulomb_A", "cogging_A"):
            self.assertGreaterEqual(len(found[key].errors), math.floor(0.9 * MOTORS), key)

    def test_intervals_cover_inertia_despite_jitter(self):
        """Half of the logs have small jitter.

        Half of the adapters stamp queries early and replies late; the others have errors of both signs."""
        found, answered, small = Found(), 0, 0
        for number in range(LOGS):
            motor, frames = self.motors[number % MOTORS]
            draw = random.Random(number)
            jitter = draw.uniform(0, SMALL_JITTER_S) if number // MOTORS % 2 else draw.uniform(SMALL_JITTER_S, MOST_JITTER_S)
            off = (0.0 if draw.random() < 0.5 else -jitter, jitter)
            track = self.track(motor, planted.log_text(frames, draw, query_early_s=off, reply_late_s=off))
            try:
                inertia = fit_balance(track, timing(track)).inertia
            except TooRough:
                inertia = None
            if jitter <= SMALL_JITTER_S:
                small += 1
                answered += inertia is not None and inertia.letter == "A"
            if inertia is not None and inertia.is_usable:
                found.add(inertia, motor.truth()["inertia_A_s2_rad"])
        print(f"jitter: {found} of {LOGS}; within 5 % of {small} with small jitter: {answered}")
        self.assertCovers(found, "inertia")
        self.assertGreaterEqual(answered, 0.95 * small)

    def test_backlash_does_not_bias_the_inertia(self):
        for seed, backlash_arcmin in ((2, 30), (2, 10), (5, 30), (7, 10)):
            with self.subTest(seed=seed, backlash_arcmin=backlash_arcmin):
                motor = planted.Planted(seed)
                self.assertGreater(motor.base.N, 1)
                motor.drive["load"] = {"J_g_cm2": 0.5 * motor.profile["mechanics"]["J_g_cm2"] * motor.base.N**2}
                motor.profile["mechanics"]["backlash_arcmin"] = backlash_arcmin
                self.check_inertia(motor, planted.frames(motor, planted.script_of(motor.motor)))

    def test_slow_current_loop_does_not_bias_the_inertia(self):
        motor = planted.Planted(2)
        motor.profile["control"]["current_bandwidth_rad_s"] = 200
        self.check_inertia(motor, planted.frames(motor, planted.script_of(motor.motor)))

    def test_finds_gravity_and_gear_loss_of_an_arm(self):
        motor = planted.Planted(2)
        eta = motor.base.efficiency
        motor.drive["load"] = {"J_g_cm2": 200_000, "tau_gravity_Nm": 1.5}
        steps = [("position", 1200.0 if n % 2 == 0 else -1200.0, 3.5) for n in range(8)]
        frames = planted.frames(motor, planted.script_of(motor.motor), steps)
        drive = identify(self.track(motor, planted.log_text(frames, random.Random(1))))
        # Mean of the currents for lifting and lowering.
        gravity_A = 1.5 / motor.base.N * (1 / eta + eta) / 2 / motor.base.k_t
        self.assertAlmostEqual(drive.number("gravity_A"), gravity_A, delta=0.05 * gravity_A)
        self.assertAlmostEqual(drive.number("gear_loss"), 1 - eta, delta=0.05)

    def test_finds_windings_at_the_voltage_limit(self):
        motor = planted.Planted(1)
        self.assertEqual(motor.base.N, 1)
        windings = dict(motor.base.data["motor"])
        windings["R_s_ohm"] *= 1.3
        windings["psi_f_Wb"] *= 0.9
        motor.profile["motor"] = windings
        motor.profile["mechanics"]["J_g_cm2"] *= 60  # a wheel: slow acceleration
        steps = [("torque", 8.0 if n % 2 == 0 else -8.0, 4) for n in range(6)]
        frames = planted.frames(motor, planted.script_of(motor.motor), steps)
        drive = identify(self.track(motor, planted.log_text(frames, random.Random(1))))
        k_t = 0.9 * motor.base.k_t
        self.assertAlmostEqual(drive.number("k_t_Nm_A"), k_t, delta=0.05 * k_t)
        R = motor.base.resistance + windings["R_s_ohm"] / 1.3 * 0.3
        self.assertAlmostEqual(drive.number("R_ohm"), R, delta=0.05 * R)

    def check_inertia(self, motor, frames):
        """Asserts that grade A is within 5 % of the true inertia, and that grades A and B cover it."""
        inertia = identify(self.track(motor, planted.log_text(frames, random.Random(1)))).values["inertia_A_s2_rad"]
        true = motor.truth()["inertia_A_s2_rad"]
        print(f"inertia {inertia.value / true:.3f} ± {inertia.half_width / true:.3f} of the true one")
        if inertia.letter == "A":
            self.assertLessEqual(abs(inertia.value / true - 1), 0.05)
        if inertia.is_usable:
            self.assertLessEqual(abs(inertia.value - true), inertia.half_width)


if __name__ == "__main__":
    unittest.main()
