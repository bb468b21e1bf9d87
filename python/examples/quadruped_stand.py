"""A dog of twelve LK-TECH motors on one CAN bus stands up from where it lies, and keeps standing.

    CAN_INTERFACE=socketcan CAN_CHANNEL=vcan0 python3 quadruped_stand.py --seconds 10

By default the drives hold positions (0xA4). With --torques this program computes springs and dampers from each reply,
and commands torques (0xA1). Exit status 0: the joint angles show that the dog stood all the time. 1: a joint was pushed
away. 3: a drive failed. Others: a bug of this program.
"""

import argparse
import sys

from lk_joints import JointError, Joints, Rounds, bus_and_time
from quadruped import PERIOD_S, joints, stand_up, worst

NOTICED = 3
BOOT_S = 0.2
PUSHED_DEG = 10.0
TORQUE_PERIOD_S = 0.005
STIFFNESS_NM_DEG = 1.75
DAMPING_NMS_DEG = 0.03


def keep(dog, rounds, targets, seconds):
    """Holds positions. Returns the largest error and its joint."""
    largest = (0.0, "")
    for _ in range(round(seconds / PERIOD_S)):
        rounds.next()
        dog.move(targets, PERIOD_S)
        if rounds.count % 10 == 0:
            largest = max(largest, worst(targets, dog.angles(), dog.joints))
    return largest


def keep_by_torques(dog, rounds, targets, seconds):
    largest = (0.0, "")
    seen = [(angle, 0.0) for angle in dog.angles()]
    for _ in range(round(seconds / TORQUE_PERIOD_S)):
        rounds.next()
        springs = [
            STIFFNESS_NM_DEG * (target - angle) - DAMPING_NMS_DEG * speed for target, (angle, speed) in zip(targets, seen)
        ]
        replies = dog.push(springs)
        seen = [reply or before for reply, before in zip(replies, seen)]
        largest = max(largest, worst(targets, [angle for angle, _ in seen], dog.joints))
    return largest


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=5.0, help="how long it stands (5)")
    parser.add_argument("--torques", action="store_true", help="hold the joints from here")
    given = parser.parse_args()
    bus, now, sleep = bus_and_time()
    dog = Joints(bus, joints(), now, sleep)
    try:
        sleep(BOOT_S)
        dog.start()
        targets = stand_up(dog, Rounds(PERIOD_S, now, sleep))
        print(f"up, {worst(targets, dog.angles(), dog.joints)[0]:.2f} degrees off", flush=True)
        if given.torques:
            error, name = keep_by_torques(dog, Rounds(TORQUE_PERIOD_S, now, sleep), targets, given.seconds)
        else:
            error, name = keep(dog, Rounds(PERIOD_S, now, sleep), targets, given.seconds)
        print(f"stood for {given.seconds:g} s, at most {error:.2f} degrees off, {name}")
        return 1 if error > PUSHED_DEG else 0
    except JointError as problem:
        print(f"error: {type(problem).__name__}: {problem}")
        return NOTICED
    finally:
        print(f"{dog.lost} replies lost or late")
        bus.shutdown()


if __name__ == "__main__":
    sys.exit(main())
