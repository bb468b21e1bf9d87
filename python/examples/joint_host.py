"""The joint's controller as a program: moves to angles and back, and reports problems.

Uses any bus of python-can, selected by CAN_INTERFACE and CAN_CHANNEL or can.rc:

    CAN_INTERFACE=socketcan CAN_CHANNEL=vcan0 python3 joint_host.py 90 0

Also runs as the host of `lk-emu campaign`, which sets these variables, in real time or with a stepped clock.
Exit status 0: the joint reached all angles. 3: the controller noticed that it did not. Others: a bug of the controller.
"""

import argparse
import os
import sys
import time

import can
from joint_controller import SPEED_DPS, TOLERANCE_DEG, Joint, JointError

NOTICED = 3
BOOT_S = 0.2


def bus_and_time():
    """Returns a bus with its `now` and `sleep`."""
    if not os.environ.get("LKEMU_CONTROL"):
        return can.Bus(), time.monotonic, time.sleep
    import lkemu

    attached = lkemu.attach()
    return attached.open(), attached.now, attached.sleep


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("targets_deg", type=float, nargs="+", metavar="DEG")
    parser.add_argument("--motor", type=int, default=1)
    parser.add_argument("--speed", type=int, default=SPEED_DPS, metavar="DPS")
    given = parser.parse_args()
    bus, now, sleep = bus_and_time()
    joint = Joint(bus, given.motor, now=now, sleep=sleep)
    try:
        sleep(BOOT_S)
        for target_deg in given.targets_deg:
            reached_deg = joint.move_to(target_deg, given.speed)
            print(f"at {reached_deg:.2f} degrees, wanted {target_deg:.2f}")
            if abs(reached_deg - target_deg) > TOLERANCE_DEG:
                return 1
    except JointError as problem:
        print(f"error: {type(problem).__name__}: {problem}")
        return NOTICED
    finally:
        bus.shutdown()
        print(f"{joint.retries} retries, {joint.homings} homings")
    return 0


if __name__ == "__main__":
    sys.exit(main())
