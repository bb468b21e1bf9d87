"""The robot dog of configs/buses/quadruped_on_the_ground.toml for a host: twelve joints on one bus, legs, standing up.

Legs lf, rf, lh, rh, each with roll, pitch, knee; 0 = hanging straight down. Foot positions are relative to the hip's roll axis,
in metres: x forward, y left, z up.
"""

import math

from lk_joints import Joint, smooth

LEGS = ["lf", "rf", "lh", "rh"]
SEGMENT_M = 0.25  # thigh and shank
OFFSET_M = 0.08  # from the roll axis out to the leg
STANCE_M = 0.40  # height of the hip above the foot's centre
RISE_S = 1.5
PERIOD_S = 0.01


def side(leg):
    return 1 if leg[0] == "l" else -1


def joints():
    """Returns the joints. Roll drives face the ends of the trunk, pitch and knee drives its sides, so half of them are
    reversed. The dog is switched on lying down, limp."""
    table = []
    for number, leg in enumerate(LEGS):
        motor = 1 + 3 * number
        table.append(
            Joint(f"{leg}_roll", motor, 8, -17 * side(leg), 1 if leg[1] == "f" else -1, Nm_per_A=1.11, limit_Nm=12)
        )
        table.append(Joint(f"{leg}_pitch", motor + 1, 6, -77, side(leg), Nm_per_A=1.15, limit_Nm=25))
        table.append(Joint(f"{leg}_knee", motor + 2, 6, 164, side(leg), Nm_per_A=1.15, limit_Nm=25))
    return table


def leg_angles(leg, x_m, y_m, z_m):
    """Returns roll, pitch, knee in degrees for a foot position, knee backwards; the nearest within reach."""
    out_m = OFFSET_M * side(leg)
    down_m = math.sqrt(max(0.01**2, y_m**2 + z_m**2 - out_m**2))
    roll = math.atan2(y_m, -z_m) - math.atan2(out_m, down_m)
    knee = 2 * math.acos(min(1.0, math.hypot(x_m, down_m) / (2 * SEGMENT_M)))
    pitch = math.atan2(x_m, down_m) - knee / 2
    return [math.degrees(angle) for angle in (roll, pitch, knee)]


def stance(height_m=STANCE_M):
    """Returns all joint angles with the feet below the hips."""
    return [angle for leg in LEGS for angle in leg_angles(leg, 0.0, OFFSET_M * side(leg), -height_m)]


def stand_up(dog, rounds):
    """Stands up in RISE_S from any pose. Returns the final targets."""
    began_deg, ends_deg = dog.angles(), stance()
    began_s = None
    while True:
        at_s = rounds.next()
        began_s = at_s if began_s is None else began_s
        share = smooth((at_s - began_s) / RISE_S)
        targets = [began + (end - began) * share for began, end in zip(began_deg, ends_deg)]
        dog.move(targets, PERIOD_S)
        if share == 1:
            return targets


def worst(targets_deg, angles_deg, joints):
    """Returns the largest joint error in degrees and the joint's name."""
    return max((abs(target - angle), joint.name) for target, angle, joint in zip(targets_deg, angles_deg, joints))
