#!/usr/bin/env python3
"""Runs the hosts of python/examples with the delivered robots that have a body. The hosts advance a stepped clock.

    hosts_test.py LK-EMU-BODY
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "python"))

import lkemu  # noqa: E402

KNEES = (3, 6, 9, 12)
WEIGHT_N = 17.14 * 9.81
# Events for the dog in some tests, while its host computes torques from replies to keep it standing.
LATE = '[[bus.event]]\nat_s = 2.5\nfault = { kind = "delay", delay_ms = 15 }\n'
BLOW = "".join(  # to the left, at all four hips: front and hind roll drives are mounted in opposite directions
    f'[[bus.event]]\nat_s = 3\nids = "{ids}"\nfault = {{ kind = "kick", impulse_Nms = {impulse} }}\n'
    for ids, impulse in (("1,4", 0.2), ("7,10", -0.2))
)
PUSH = '[[bus.event]]\nat_s = 2.5\npush = { body = "trunk", force_N = [0, 150, 0], for_s = 0.1 }\n'
STEP_M = 0.03
STEP = f"[[bus.event]]\nat_s = 0\nfloor = {{ step_m = {STEP_M}, step_at_x_m = 0.5 }}\n"


def run(program, robot, host, *words, events=""):
    """Returns the host's exit status and output, and the state at its end: (angle, torque) of the joints by ID, and the
    signals of the body."""
    with tempfile.TemporaryDirectory() as directory:
        config = Path(directory) / f"{robot}.toml"
        config.write_text((ROOT / f"configs/buses/{robot}.toml").read_text() + events)
        with lkemu.Emulator(bus="auto", config=config, program=program, clock="stepped") as emulator:
            environment = {
                **os.environ,
                "PYTHONPATH": str(ROOT / "python"),
                "LKEMU_BUS": emulator.buses[0],
                "LKEMU_CONTROL": emulator.control,
            }
            done = subprocess.run(
                [sys.executable, "-B", ROOT / "python/examples" / host, *words],
                env=environment, capture_output=True, text=True, timeout=600,
            )  # fmt: skip
            joints = {drive.id: drive.telemetry("joint_deg", "joint_Nm") for drive in emulator.drives}
            body = emulator.body()
    print(f"{host} {' '.join(words)}: {done.returncode}\n{done.stdout}{done.stderr}", flush=True)
    return done.returncode, done.stdout, joints, body


def check(what, ok):
    if not ok:
        sys.exit(f"not so: {what}")
    print(f"ok: {what}", flush=True)


def stands(status, body):
    """Returns whether the host succeeded and the dog stands on its feet; a dog off balance may lie or be in the air."""
    on_feet = body["body.fallen"] == 0 and body["body.trunk.z_m"] > 0.3 and body["body.contact_N"] > 0.5 * WEIGHT_N
    return status == 0 and on_feet


def main():
    program = sys.argv[1]
    status, said, _, _ = run(program, "pendulum", "pendulum_weigh.py")
    weighed_Nm = float(re.search(r"level it takes ([\d.]+) Nm", said)[1]) if status == 0 else 0
    # By hand (pendulum.xml): 1.62 Nm. The gear has 87 % efficiency in both directions, so the mean is (1/0.87 + 0.87)/2
    # times 1.62 Nm.
    check(f"the pendulum is weighed: {weighed_Nm} Nm", abs(weighed_Nm / (1.62 * 1.0097) - 1) < 0.02)
    for robot, arm in (("two_joint_arm", "two"), ("six_joint_arm", "six")):
        status, _, _, _ = run(program, robot, "arm_square.py", arm)
        check(f"the arm of {arm} joints draws its square", status == 0)
    dog = "quadruped_on_the_ground"
    status, _, joints, body = run(program, dog, "quadruped_stand.py", "--seconds", "3", events=PUSH)
    check("the dog stands up, and stands through a push", status == 0)
    # By hand: each foot carries about a quarter of 17.14 kg, below its hip, at 0.25 m*sin(36.9 deg) from the knee.
    carried_Nm = sum(abs(joints[id]["joint_Nm"]) for id in KNEES)
    check(f"on its feet: its knees carry {carried_Nm:.1f} Nm", abs(carried_Nm / (WEIGHT_N * 0.15) - 1) < 0.15)
    # The hips are 5 cm above the trunk's centre and 2*0.25 m*cos(36.9 deg) above the centres of the feet (radius 2 cm).
    height_m, weight_N = body["body.trunk.z_m"], body["body.contact_N"]
    check(f"its trunk is {height_m:.3f} m above the floor", abs(height_m - (0.4 + 0.02 - 0.05)) < 0.02)
    check(f"the floor carries {weight_N:.0f} N", abs(weight_N / WEIGHT_N - 1) < 0.05)
    check("it has not fallen", body["body.fallen"] == 0)
    status, _, joints, body = run(program, dog, "quadruped_walk.py", "--seconds", "6", events=STEP)
    check("it trots, and stands on its feet afterwards", stands(status, body))
    gone_m, up_m = body["body.trunk.x_m"], body["body.trunk.z_m"] - height_m
    check(f"up a step: {gone_m:.2f} m ahead, {up_m:.3f} m up", gone_m > 0.8 and abs(up_m - STEP_M) < 0.01)
    by_torques = ("quadruped_stand.py", "--torques", "--seconds", "3")
    for what, events, falls in (
        ("it stands by torques from its host", "", False),
        ("it stands through a blow", BLOW, False),
        ("it stands with late replies", LATE, False),
        ("it does not stand through a blow with late replies", LATE + BLOW, True),
    ):
        status, _, _, body = run(program, dog, *by_torques, events=events)
        check(what, stands(status, body) != falls)


if __name__ == "__main__":
    main()
