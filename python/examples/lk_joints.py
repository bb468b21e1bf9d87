"""The joints of a robot: LK-TECH motors on one CAN bus, commanded in rounds, with python-can.

Angles are the joints', in degrees; frames have those of the rotor. Knows nothing of virtual drives.
"""

import os
import struct
import time
from dataclasses import dataclass

import can

REPLY_LIMIT_S = 0.003  # of a round, besides its frames
WIRE_S = 0.00026  # a frame and its reply at 1 Mbit/s
SILENT_ROUNDS = 20  # and then a drive is gone
RETRIES = 20  # of what has to be answered: a busy machine may be late by 0.1 s
CATCH_UP_DPS = 20  # of the joint, beyond what the targets take
COUNTS = 65536  # of the encoder field; here of motors where it spans a turn of the rotor

STATE_1, CLEAR_ERRORS, ANGLE = 0x9A, 0x9B, 0x92
OFF, RUN, TORQUE, MOVE = 0x80, 0x88, 0xA1, 0xA4
A_PER_LSB = 66 / 4096  # of iq, MG motors with newer firmware
ERRORS = ["under-voltage", "over-voltage", "hot driver", "hot motor", "over-current", "short circuit", "stall", "lost input"]


class JointError(Exception):
    """The robot cannot go on."""


class NoReply(JointError):
    """A drive does not answer."""


class DriveFault(JointError):
    """A drive has switched itself off."""


def query(command):
    return bytes([command]) + bytes(7)


@dataclass(frozen=True)
class Joint:
    """`direction` is -1 where the motor is mounted the other way round. `boot_deg` is where the joint is when power comes:
    the drive knows its angle within a turn of the rotor only."""

    name: str
    motor: int
    gear: float
    boot_deg: float = 0.0
    direction: int = 1
    Nm_per_A: float = 0.0  # at the joint; of joints that are given torques
    limit_Nm: float = 0.0


def bus_and_time():
    """A bus, and `now` and `sleep` that go with it: python-can's own (CAN_INTERFACE, CAN_CHANNEL or can.rc say which), or
    one whose time is stepped."""
    if not os.environ.get("LKEMU_CONTROL"):
        return can.Bus(), time.monotonic, time.sleep
    import lkemu

    attached = lkemu.attach()
    return attached.open(), attached.now, attached.sleep


def smooth(share):
    """From 0 to 1 without a jerk at the ends."""
    share = max(0.0, min(1.0, share))
    return share * share * (3 - 2 * share)


class Rounds:
    """`next()` waits for the beginning of the next round, and gives the time since the first."""

    def __init__(self, period_s, now, sleep):
        self.period_s, self.now, self.sleep = period_s, now, sleep
        self.began_s, self.count = now(), 0

    def next(self):
        self.sleep(max(0.0, self.began_s + self.count * self.period_s - self.now()))
        self.count += 1
        return (self.count - 1) * self.period_s


class Joints:
    """All joints of a robot. A round sends each drive one command and takes the replies that come in time."""

    def __init__(self, bus, joints, now=time.monotonic, sleep=time.sleep):
        self.bus, self.joints, self.now, self.sleep = bus, joints, now, sleep
        self.lost = 0  # replies that did not come in time
        self._silent = [0] * len(joints)
        self._offset_deg = [0.0] * len(joints)  # of 0x92, whole turns of the rotor
        self._rotor_deg = [0.0] * len(joints)
        self._targets_deg = [0.0] * len(joints)
        self._looked_at = 0
        self._index = {0x140 + joint.motor: i for i, joint in enumerate(joints)}

    def start(self):
        """Drives ready to move, and where the joints are."""
        self._surely(RUN)
        for joint, data in zip(self.joints, self._surely(CLEAR_ERRORS)):
            self._raise_errors(joint, data[7])
        for i, (joint, data) in enumerate(zip(self.joints, self._surely(ANGLE))):
            boot_deg = joint.direction * joint.gear * joint.boot_deg
            self._rotor_deg[i] = int.from_bytes(data[1:], "little", signed=True) / 100
            self._offset_deg[i] = round((boot_deg - self._rotor_deg[i]) / 360) * 360
        self._targets_deg = self.degrees()
        return self.degrees()

    def angles(self):
        """Where the joints are: asks all drives. Of one that does not answer, where it was."""
        for (i, _), data in self._round([(i, query(ANGLE)) for i in range(len(self.joints))]).items():
            self._rotor_deg[i] = int.from_bytes(data[1:], "little", signed=True) / 100
        return self.degrees()

    def degrees(self):
        """Where the joints were at the latest replies."""
        return [
            joint.direction * (rotor + offset) / joint.gear
            for joint, rotor, offset in zip(self.joints, self._rotor_deg, self._offset_deg)
        ]

    def move(self, targets_deg, within_s):
        """0xA4 to all of them: there, not much faster than takes so long from the targets before, so that targets in small
        steps make an even motion."""
        frames = []
        for joint, target, before, offset in zip(self.joints, targets_deg, self._targets_deg, self._offset_deg):
            speed_dps = 1.1 * abs(target - before) / within_s + CATCH_UP_DPS
            rotor_dps = min(65535, round(speed_dps * joint.gear))
            rotor_deg = joint.direction * joint.gear * target - offset
            frames.append(struct.pack("<BxHi", MOVE, rotor_dps, round(rotor_deg * 100)))
        self._targets_deg = list(targets_deg)
        self._command(frames)

    def push(self, torques_Nm):
        """0xA1 to all of them. Returns each joint's angle in degrees and speed in degrees/s, as its reply has them: of the
        instant before the command. None for a joint whose reply did not come in time."""
        frames = []
        for joint, torque in zip(self.joints, torques_Nm):
            torque = joint.direction * max(-joint.limit_Nm, min(joint.limit_Nm, torque))
            frames.append(struct.pack("<B3xh2x", TORQUE, round(torque / joint.Nm_per_A / A_PER_LSB)))
        seen = [None] * len(self.joints)
        for i, data in self._command(frames).items():
            joint = self.joints[i]
            _, _, speed, counts = struct.unpack("<xbhhH", data)
            self._rotor_deg[i] += (counts * 360 / COUNTS - self._rotor_deg[i] + 180) % 360 - 180
            angle = joint.direction * (self._rotor_deg[i] + self._offset_deg[i]) / joint.gear
            seen[i] = (angle, joint.direction * speed / joint.gear)
        return seen

    def off(self):
        self._command([query(OFF)] * len(self.joints))

    def _command(self, frames):
        """A frame to each of them, and to one in turn the question for its errors. The replies of the first by joint."""
        asked = self._looked_at = (self._looked_at + 1) % len(self.joints)
        replies = self._round([*enumerate(frames), (asked, query(STATE_1))])
        state = replies.pop((asked, STATE_1), None)
        if state:
            self._raise_errors(self.joints[asked], state[7])
        return {i: data for (i, _), data in replies.items()}

    def _round(self, frames):
        """Sends frames, pairs of a joint's index and data, and waits for the replies. Those that came in time, by index and
        command; one that is late is taken for that of the next round, for nothing in it tells."""
        for i, data in frames:
            self.bus.send(can.Message(arbitration_id=0x140 + self.joints[i].motor, data=data, is_extended_id=False))
        replies, missing = {}, {(i, data[0]) for i, data in frames}
        deadline = self.now() + REPLY_LIMIT_S + WIRE_S * len(frames)
        while missing and (left := deadline - self.now()) > 0:
            message = self.bus.recv(left)
            if message is None or len(message.data) != 8:
                continue
            key = (self._index.get(message.arbitration_id), message.data[0])
            if key in missing:
                replies[key] = bytes(message.data)
                missing.discard(key)
        self.lost += len(missing)
        for i in {i for i, _ in frames}:
            heard = any(joint == i for joint, _ in replies)
            self._silent[i] = 0 if heard else self._silent[i] + 1
            if self._silent[i] > SILENT_ROUNDS:
                raise NoReply(f"{self.joints[i].name} (drive {self.joints[i].motor}) does not answer any more")
        return replies

    def _surely(self, command):
        """The replies of all of them to a query, which those that do not answer are asked again."""
        replies = {}
        for _ in range(1 + RETRIES):
            missing = [i for i in range(len(self.joints)) if (i, command) not in replies]
            if missing:
                replies.update(self._round([(i, query(command)) for i in missing]))
        for i, joint in enumerate(self.joints):
            if (i, command) not in replies:
                raise NoReply(f"{joint.name} (drive {joint.motor}) does not answer")
        return [replies[i, command] for i in range(len(self.joints))]

    def _raise_errors(self, joint, errors):
        if errors:
            names = ", ".join(name for bit, name in enumerate(ERRORS) if errors >> bit & 1)
            raise DriveFault(f"{joint.name} (drive {joint.motor}): {names}")
