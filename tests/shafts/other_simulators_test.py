"""Other people's simulators at the shaft port move an arm as lk-emu-body's own MuJoCo does: within 1e-3 rad over 2 s.

usage: other_simulators_test.py LK_EMU LK_EMU_BODY [MujocoWasm|Simbody]; status 77 where the simulator is not there.

MujocoWasm wants node, and @mujoco/mujoco of npm beside examples/shafts or below MUJOCO_WASM, its mujoco.js.
"""

import csv
import math
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

PROGRAM, BODY = sys.argv.pop(1), sys.argv.pop(1)
EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "examples/shafts"
PATIENCE_S = 200
SECONDS = 2
MOST_RAD = 1e-3


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
            (self.directory / file.name).write_text(file.read_text().replace("vcan0", self.bus))
        (self.directory / "of_two_drives.toml").write_text(
            (EXAMPLES / "reach.toml").read_text().replace("two_joints.toml", "two_drives.toml"))

    def of_body(self) -> "list[list[float]]":
        file = self.directory / "body.csv"
        subprocess.run([BODY, "run", self.directory / "reach.toml", "--csv", file, "--signals", "joint_deg", "--ids", "1-2",
                        "--rate", "1000"], check=True, stdout=subprocess.DEVNULL, timeout=PATIENCE_S)
        with file.open() as lines:
            return [[math.radians(float(value)) for value in row[1:]] for row in list(csv.reader(lines))[1:]]

    def of_simulator(self, *command: str, **environment: str) -> "list[list[float]]":
        shafts = self.directory / "shafts"
        with subprocess.Popen(
                [PROGRAM, "--config", self.directory / "two_drives.toml", "--rom", ":memory:", "--control", "none",
                 "--clock", "stepped", "--scenario", self.directory / "of_two_drives.toml", "--shafts", f"unix:{shafts}"],
                stdout=subprocess.PIPE, text=True) as process:
            try:
                self.assertIn("ready", process.stdout.readline())
                place = str(shafts) if command[0].endswith("simbody_arm") else f"unix:{shafts}"
                done = subprocess.run([part.replace("PLACE", place) for part in command], capture_output=True, text=True,
                                      env={**os.environ, **environment}, timeout=PATIENCE_S, check=False)
            finally:
                process.terminate()
        self.assertEqual(done.returncode, 0, done.stderr)
        return [[float(value) for value in row[1:]] for row in list(csv.reader(done.stdout.splitlines()))[1:]]

    def compare(self, simulator: "list[list[float]]") -> None:
        body = self.of_body()
        self.assertGreaterEqual(len(simulator), SECONDS * 1000)
        pairs = list(zip(body, simulator))
        travel = [max(row[n] for row in body) - min(row[n] for row in body) for n in range(2)]
        apart = [max(abs(one[n] - other[n]) for one, other in pairs) for n in range(2)]
        print(f"{self.id()}: travel {travel[0]:.3f} and {travel[1]:.3f} rad, apart {apart[0]:.2e} and {apart[1]:.2e} rad")
        self.assertGreater(min(travel), 0.3, "it has moved")
        self.assertLess(max(apart), MOST_RAD)


class MujocoWasm(Arm):
    def test_moves_as_the_body_does(self) -> None:
        engine = mujoco_wasm()
        self.compare(self.of_simulator("node", str(EXAMPLES / "mujoco.mjs"), "PLACE", str(EXAMPLES / "two_joints.xml"),
                                       str(SECONDS), "shoulder", "elbow", MUJOCO_WASM=engine))


class Simbody(Arm):
    def test_moves_as_the_body_does(self) -> None:
        self.compare(self.of_simulator(os.environ["SIMBODY_ARM"], "PLACE", str(SECONDS)))


if __name__ == "__main__":
    if "MujocoWasm" in sys.argv and (mujoco_wasm() is None or shutil.which("node") is None):
        print("skipped: no node, or no @mujoco/mujoco (npm install @mujoco/mujoco in examples/shafts)")
        sys.exit(77)
    unittest.main()
