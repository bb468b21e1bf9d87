"""A dog of twelve LK-TECH motors on one CAN bus stands up and trots: diagonal legs together, half a step apart.

    CAN_INTERFACE=socketcan CAN_CHANNEL=vcan0 python3 quadruped_walk.py --seconds 10 --speed 0.2

The feet follow a fixed path, since the bus does not report the trunk's attitude. Exit status 0: the joint angles show
that the dog walked, or Ctrl-C ended --forever. 3: a drive failed. Others: a bug of this program.
"""

import argparse
import itertools
import math
import sys

from lk_joints import JointError, Joints, Rounds, bus_and_time, smooth
from quadruped import LEGS, OFFSET_M, PERIOD_S, STANCE_M, joints, leg_angles, side, stance, stand_up, worst

NOTICED = 3
BOOT_S = 0.2
STEP_S = 0.5  # a full cycle of all four legs
LIFT_M = 0.05
EASE_S = 1.0  # from standing to full steps, and back
REST_S = 2.0
LATE = {"lf": 0.0, "rh": 0.0, "rf": 0.5, "lh": 0.5}  # phase, as a share of a step


def foot(leg, at_s, speed_m_s, ease):
    """Returns the foot's offset from the point below the hip: forward and up, in metres. The foot is on the ground half
    of the time."""
    share = (at_s / STEP_S + LATE[leg]) % 1.0
    half_m = speed_m_s * STEP_S / 4 * ease
    if share < 0.5:
        return half_m * (1 - 4 * share), 0.0
    swing = 2 * share - 1
    return half_m * (2 * smooth(swing) - 1), LIFT_M * ease * math.sin(math.pi * swing) ** 2


def walk(dog, rounds, seconds, speed_m_s):
    """Walks; returns the largest error and its joint."""
    largest = (0.0, "")
    for _ in range(round(seconds / PERIOD_S)):
        at_s = rounds.next()
        ease = min(1.0, at_s / EASE_S, max(0.0, (seconds - at_s) / EASE_S))
        targets = []
        for leg in LEGS:
            forward_m, up_m = foot(leg, at_s, speed_m_s, ease)
            targets += leg_angles(leg, forward_m, OFFSET_M * side(leg), up_m - STANCE_M)
        dog.move(targets, PERIOD_S)
        if rounds.count % 10 == 0:
            largest = max(largest, worst(targets, dog.angles(), dog.joints))
    return largest


def stand(dog, rounds, seconds):
    for _ in range(round(seconds / PERIOD_S)):
        rounds.next()
        dog.move(stance(), PERIOD_S)


def walk_to_and_fro(dog, rounds, seconds, speed_m_s):
    """Walks forwards and backwards for ever; `rounds()` makes new Rounds."""
    for direction in itertools.cycle((1, -1)):
        stand(dog, rounds(), REST_S)
        walk(dog, rounds(), seconds, direction * speed_m_s)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=10.0, help="how long it walks (10)")
    parser.add_argument("--speed", type=float, default=0.2, metavar="M_S", help="how fast, backwards below 0 (0.2)")
    parser.add_argument("--forever", action="store_true", help="there and back, so long each, with rests, until Ctrl-C")
    given = parser.parse_args()
    bus, now, sleep = bus_and_time()
    dog = Joints(bus, joints(), now, sleep)
    try:
        sleep(BOOT_S)
        dog.start()
        stand_up(dog, Rounds(PERIOD_S, now, sleep))
        print("up", flush=True)
        if given.forever:
            walk_to_and_fro(dog, lambda: Rounds(PERIOD_S, now, sleep), given.seconds, given.speed)
        error, name = walk(dog, Rounds(PERIOD_S, now, sleep), given.seconds, given.speed)
        print(f"walked for {given.seconds:g} s, joints at most {error:.1f} degrees behind, {name}")
        return 0
    except KeyboardInterrupt:
        return 0 if given.forever else 130
    except JointError as problem:
        print(f"error: {type(problem).__name__}: {problem}")
        return NOTICED
    finally:
        print(f"{dog.lost} replies lost or late")
        bus.shutdown()


if __name__ == "__main__":
    sys.exit(main())
