"""An arm of LK-TECH motors on one CAN bus draws a square with the tip of its tool, at 100 Hz.

    CAN_INTERFACE=socketcan CAN_CHANNEL=vcan0 python3 arm_square.py two     configs/buses/two_joint_arm.toml
    CAN_INTERFACE=socketcan CAN_CHANNEL=vcan0 python3 arm_square.py six     configs/buses/six_joint_arm.toml

Prints the largest distance of the tip from the square's sides, computed from the angles that the drives report.
Exit status 0: the distance is within --tolerance, or Ctrl-C ended --forever. 1: the distance is too large.
3: a drive failed. Others: a bug of this program.
"""

import argparse
import math
import sys

from lk_joints import Joint, JointError, Joints, Rounds, bus_and_time, smooth

NOTICED = 3
BOOT_S = 0.2
PERIOD_S = 0.01
SETTLE_S = 0.5


def two_links(first_m, second_m, forward_m, down_m):
    """Returns the angles in degrees (0 = straight down) of two links in a plane for this end; the second bends forwards."""
    away_m = math.hypot(forward_m, down_m)
    bend = math.acos((away_m**2 - first_m**2 - second_m**2) / (2 * first_m * second_m))
    inner = math.atan2(second_m * math.sin(bend), first_m + second_m * math.cos(bend))
    return math.degrees(math.atan2(forward_m, down_m) - inner), math.degrees(bend)


def end_of(first_m, second_m, first_deg, bend_deg):
    first, second = math.radians(first_deg), math.radians(first_deg + bend_deg)
    return first_m * math.sin(first) + second_m * math.sin(second), first_m * math.cos(first) + second_m * math.cos(second)


class TwoJointArm:
    """Points are (forward, down) from the shoulder, in metres."""

    joints = [Joint("shoulder", 1, 10), Joint("elbow", 2, 10)]
    corners = [(0.35, 0.35), (0.35, 0.15), (0.15, 0.15), (0.15, 0.35)]
    UPPER_M, FOREARM_M = 0.3, 0.3

    def angles(self, tip):
        return two_links(self.UPPER_M, self.FOREARM_M, *tip)

    def tip(self, angles):
        return end_of(self.UPPER_M, self.FOREARM_M, *angles)


class SixJointArm:
    """Points are (forward, left) in metres, on a table 0.52 m below the shoulder. The tool points down and does not turn."""

    joints = [
        Joint("base", 1, 9),
        Joint("shoulder", 2, 6),
        Joint("elbow", 3, 10, direction=-1),
        Joint("forearm", 4, 10),
        Joint("wrist", 5, 10, direction=-1),
        Joint("flange", 6, 10),
    ]
    corners = [(0.4, 0.1), (0.4, -0.1), (0.2, -0.1), (0.2, 0.1)]
    UPPER_M, FOREARM_M, TOOL_M = 0.3, 0.3, 0.16
    TABLE_M = 0.52

    def angles(self, tip):
        around = math.degrees(math.atan2(tip[1], tip[0]))
        shoulder, elbow = two_links(self.UPPER_M, self.FOREARM_M, math.hypot(*tip), self.TABLE_M - self.TOOL_M)
        return around, shoulder, elbow, 0.0, -shoulder - elbow, -around

    def tip(self, angles):
        """Returns the tip's position by the angles of base, shoulder, elbow and wrist."""
        around, shoulder, elbow, _, wrist, _ = angles
        forward_m, _ = end_of(self.UPPER_M, self.FOREARM_M, shoulder, elbow)
        forward_m += self.TOOL_M * math.sin(math.radians(shoulder + elbow + wrist))
        return forward_m * math.cos(math.radians(around)), forward_m * math.sin(math.radians(around))


def between(first, second, share):
    return [a + (b - a) * share for a, b in zip(first, second)]


def off_m(point, first, second):
    """Returns the distance of a point from the segment between two others."""
    along = [b - a for a, b in zip(first, second)]
    length2 = sum(d * d for d in along)
    share = sum((p - a) * d for p, a, d in zip(point, first, along)) / length2
    return math.dist(point, between(first, second, max(0.0, min(1.0, share))))


class Drawing:
    def __init__(self, arm, robot, rounds):
        self.arm, self.robot, self.rounds = arm, robot, rounds
        self.at_deg = robot.start()

    def to(self, path, seconds, watch=None):
        """Follows `path`, which maps 0..1 to joint angles; calls `watch` with the tip after each round."""
        count = max(1, round(seconds / PERIOD_S))
        for number in range(1, count + 1):
            self.rounds.next()
            self.at_deg = path(smooth(number / count))
            self.robot.move(self.at_deg, PERIOD_S)
            if watch:
                watch(self.arm.tip(self.robot.angles()))

    def square(self, side_s):
        """Draws the square; returns the tip's distance from the sides in metres, by round."""
        corners = self.arm.corners
        began_deg, first_deg = self.at_deg, self.arm.angles(corners[0])
        self.to(lambda share: between(began_deg, first_deg, share), 2.0)
        self.to(lambda _: first_deg, SETTLE_S)
        off = []
        for first, second in zip(corners, corners[1:] + corners[:1]):
            self.to(
                lambda share: self.arm.angles(between(first, second, share)),
                side_s,
                lambda tip: off.append(off_m(tip, first, second)),
            )
        return off


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("arm", choices=["two", "six"])
    parser.add_argument("--side-s", type=float, default=2.0, help="time for a side of 20 cm (2)")
    parser.add_argument("--tolerance-mm", type=float, default=3.0, help="what is a square (3)")
    parser.add_argument("--forever", action="store_true", help="one square after the other, until Ctrl-C")
    given = parser.parse_args()
    arm = TwoJointArm() if given.arm == "two" else SixJointArm()
    bus, now, sleep = bus_and_time()
    robot = Joints(bus, arm.joints, now, sleep)
    try:
        sleep(BOOT_S)
        drawing = Drawing(arm, robot, Rounds(PERIOD_S, now, sleep))
        while True:
            off = drawing.square(given.side_s)
            mean_mm = 1000 * math.sqrt(sum(d * d for d in off) / len(off))
            print(f"square drawn: at most {1000 * max(off):.2f} mm off its sides, {mean_mm:.2f} mm rms", flush=True)
            if not given.forever:
                return 0 if 1000 * max(off) <= given.tolerance_mm else 1
    except KeyboardInterrupt:
        return 0 if given.forever else 130
    except JointError as problem:
        print(f"error: {type(problem).__name__}: {problem}")
        return NOTICED
    finally:
        print(f"{robot.lost} replies lost or late")
        bus.shutdown()


if __name__ == "__main__":
    sys.exit(main())
