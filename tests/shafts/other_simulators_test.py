"""Compares third-party simulators at the shaft port with lk-emu-body's own MuJoCo. An arm moves equally within 1e-3 rad
over 2 s. A leg stands on the floor with equal height and contact force.

usage: other_simulators_test.py LK_EMU LK_EMU_BODY [MujocoWasm|Simbody]; status 77 without the simulator.

MujocoWasm needs node, and npm's @mujoco/mujoco next to examples/shafts, or its mujoco.js at MUJOCO_WASM.
"""

import csv
import math
import os
import pathlib
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import unittest

PROGRAM, BODY = sys.argv.pop(1), sys.argv.pop(1)
EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "examples/shafts"
PATIENCE_S = 200
SECONDS = 2
MOST_RAD = 1e-3
STRETCHED_M = 0.33  # height of leg.xml's trunk at slide 0


def mujoco_wasm() -> "str | None":
    given = os.environ.get("MUJOCO_WASM")
    places = [pathlib.Path(given)] if given else [EXAMPLES / "node_modules/@mujoco/mujoco/mujoco.js"]
    return next((str(place) for place in places if place.is_file()), None)


class Arm(unittest.TestCase):
    def setUp(self) -> None:
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.directory = pathlib.Path(scratch.name)
        self.bus = f"slcan-pty:{self.directory}/can"
        for file in EXAMPLES.glob("*.[tx]*ml"):
            # Two bodies are compared: near a detent, small differences between them would grow.
            smooth = re.sub(r"^motor = .*", r"\g<0>\nprofile = {mechanics = {tau_cogging_mNm = 0}}", file.read_text(), flags=re.M)
            (self.directory / file.name).write_text(smooth.replace("vcan0", self.bus))
        for scenario, robot in (("reach", "two_joints"), ("crouch", "one_leg")):
            text = (EXAMPLES / f"{scenario}.toml").read_text()
            (self.directory / f"{scenario}_of_drives.toml").write_text(text.replace(f"{robot}.toml", "two_drives.toml"))

    def of_body(self, scenario: str, *words: str) -> "list[list[float]]":
        """Returns one row per millisecond with the signals in their order."""
        file = self.directory / "body.csv"
        subprocess.run([BODY, "run", self.directory / f"{scenario}.toml", "--csv", file, "--rate", "1000", *words], check=True,
                       stdout=subprocess.DEVNULL, timeout=PATIENCE_S)
        with file.open() as lines:
            return [[float(value) for value in row[1:]] for row in list(csv.reader(lines))[1:]]

    def of_simulator(self, scenario: str, *command: str, **environment: str) -> "list[dict[str, float]]":
        shafts = self.directory / "shafts"
        with subprocess.Popen(
                [PROGRAM, "--config", self.directory / "two_drives.toml", "--rom", ":memory:", "--control", "none",
                 "--clock", "stepped", "--scenario", self.directory / f"{scenario}_of_drives.toml", "--shafts",
                 f"unix:{shafts}"], stdout=subprocess.PIPE, text=True) as process:
            try:
                self.assertIn("ready", process.stdout.readline())
                place = str(shafts) if command[0].endswith("simbody_arm") else f"unix:{shafts}"
                done = subprocess.run([part.replace("PLACE", place) for part in command], capture_output=True, text=True,
                                      env={**os.environ, **environment}, timeout=PATIENCE_S, check=False)
            finally:
                process.terminate()
        self.assertEqual(done.returncode, 0, done.stderr)
        return [{name: float(value) for name, value in row.items()} for row in csv.DictReader(done.stdout.splitlines())]

    def compare(self, simulator: "list[dict[str, float]]") -> None:
        body = self.of_body("reach", "--signals", "joint_deg", "--ids", "1-2")
        self.assertGreaterEqual(len(simulator), SECONDS * 1000)
        pairs = [([math.radians(angle) for angle in one], [other["shoulder"], other["elbow"]])
                 for one, other in zip(body, simulator)]
        travel = [max(one[n] for one, _ in pairs) - min(one[n] for one, _ in pairs) for n in range(2)]
        apart = [max(abs(one[n] - other[n]) for one, other in pairs) for n in range(2)]
        print(f"{self.id()}: travel {travel[0]:.3f} and {travel[1]:.3f} rad, apart {apart[0]:.2e} and {apart[1]:.2e} rad")
        self.assertGreater(min(travel), 0.3, "it has moved")
        self.assertLess(max(apart), MOST_RAD)


class MujocoWasm(Arm):
    def run_it(self, scenario: str, model: str, seconds: int, *joints: str) -> "list[dict[str, float]]":
        return self.of_simulator(scenario, "node", str(EXAMPLES / "mujoco.mjs"), "PLACE", str(EXAMPLES / model), str(seconds),
                                 *joints, MUJOCO_WASM=mujoco_wasm())

    def test_moves_like_the_body_of_lk_emu(self) -> None:
        self.compare(self.run_it("reach", "two_joints.xml", SECONDS, "shoulder", "elbow"))

    def test_stands_like_the_body_of_lk_emu(self) -> None:
        # The drives' loops never settle completely, so take the mean of the last half second.
        rows = self.run_it("crouch", "leg.xml", 3, "hip", "knee")[-500:]
        other_m = STRETCHED_M + statistics.fmean(row["height"] for row in rows)
        other_N = statistics.fmean(row["contact_N"] for row in rows)
        height_m, contact_N = map(statistics.fmean, zip(
            *self.of_body("crouch", "--signals", "body.trunk.z_m,body.contact_N")[-500:]))
        print(f"{self.id()}: {height_m:.5f} and {other_m:.5f} m high, {contact_N:.4f} and {other_N:.4f} N")
        # By hand: hip and knee at 30 and 60 degrees, two links of 0.15 m, a foot of 0.02 m.
        self.assertAlmostEqual(height_m, 2 * 0.15 * math.cos(math.radians(30)) + 0.02, delta=0.01)
        self.assertAlmostEqual(contact_N, 1.3 * 9.81, delta=0.05)
        self.assertAlmostEqual(other_m, height_m, delta=1e-3)
        self.assertAlmostEqual(other_N, contact_N, delta=0.005 * contact_N)


class Simbody(Arm):
    def test_moves_like_the_body_of_lk_emu(self) -> None:
        self.compare(self.of_simulator("reach", os.environ["SIMBODY_ARM"], "PLACE", str(SECONDS)))


if __name__ == "__main__":
    if "MujocoWasm" in sys.argv and (mujoco_wasm() is None or shutil.which("node") is None):
        print("skipped: no node, or no @mujoco/mujoco (npm install @mujoco/mujoco in examples/shafts)")
        sys.exit(77)
    unittest.main()
