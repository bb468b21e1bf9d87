"""Weighs a pendulum on an LK-TECH motor by the current that swings it slowly through level, up and down.

    CAN_INTERFACE=socketcan CAN_CHANNEL=vcan0 python3 pendulum_weigh.py     configs/buses/pendulum.toml

Friction opposes the motion in both directions. The mean of both torques is therefore free of friction, and half of
their difference is the friction. Exit status 0: measured. 3: a drive failed. Others: a bug of this program.
"""

import math
import struct
import sys

from lk_joints import A_PER_LSB, Joint, JointError, Joints, Rounds, bus_and_time, query

NOTICED = 3
BOOT_S = 0.2
PERIOD_S = 0.01
STATE_2 = 0x9C
SPEED_DPS = 20.0
LOW_DEG, LEVEL_DEG, HIGH_DEG, AROUND_DEG = 60.0, 90.0, 120.0, 5.0
# Vendor's table: 0.06201 Nm/A at the rotor, times the gear of 10.
PENDULUM = Joint("shoulder", 1, 10, Nm_per_A=0.62)


def current_A(bus, now):
    """Returns iq from the drive's state; None if the reply is late."""
    import can

    bus.send(can.Message(arbitration_id=0x140 + PENDULUM.motor, data=query(STATE_2), is_extended_id=False))
    end = now() + PERIOD_S / 2
    while (left := end - now()) > 0:
        message = bus.recv(left)
        if message and message.arbitration_id == 0x140 + PENDULUM.motor and message.data[0] == STATE_2:
            return struct.unpack_from("<h", message.data, 2)[0] * A_PER_LSB
    return None


class Swing:
    def __init__(self, robot, bus, now, sleep):
        self.robot, self.bus, self.now = robot, bus, now
        self.rounds = Rounds(PERIOD_S, now, sleep)
        self.at_deg = robot.start()[0]

    def to(self, end_deg):
        """Moves at constant speed. Returns the torques near level in Nm, scaled to the gravity torque at level."""
        began_deg, torques = self.at_deg, []
        count = max(1, round(abs(end_deg - began_deg) / SPEED_DPS / PERIOD_S))
        for number in range(1, count + 1):
            self.rounds.next()
            self.at_deg = began_deg + (end_deg - began_deg) * number / count
            self.robot.move([self.at_deg], PERIOD_S)
            if abs(self.at_deg - LEVEL_DEG) < AROUND_DEG and (iq := current_A(self.bus, self.now)) is not None:
                torques.append(iq * PENDULUM.Nm_per_A / math.sin(math.radians(self.at_deg)))
        return torques


def main():
    bus, now, sleep = bus_and_time()
    robot = Joints(bus, [PENDULUM], now, sleep)
    try:
        sleep(BOOT_S)
        swing = Swing(robot, bus, now, sleep)
        swing.to(LOW_DEG)
        ways = [swing.to(HIGH_DEG), swing.to(LOW_DEG)]
        swing.to(0)
        if not all(ways):
            print("error: no current was read near level")
            return NOTICED
        up_Nm, down_Nm = (sum(way) / len(way) for way in ways)
        print(f"level it takes {(up_Nm + down_Nm) / 2:.3f} Nm; friction {(up_Nm - down_Nm) / 2:.3f} Nm")
        return 0
    except JointError as problem:
        print(f"error: {type(problem).__name__}: {problem}")
        return NOTICED
    finally:
        print(f"{robot.lost} replies lost or late")
        bus.shutdown()


if __name__ == "__main__":
    sys.exit(main())
