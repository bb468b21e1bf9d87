"""The joints of a robot: LK-TECH motors on one CAN bus, commanded in rounds, with python-can.

Angles are in degrees, at the joint; frames have rotor angles. Works with real and virtual drives.
"""

import json
import os
import struct
import time
from dataclasses import dataclass
from pathlib import Path

import can

REPLY_LIMIT_S = 0.003  # time limit of a round, in addition to its frames
WIRE_S = 0.00026  # one frame and its reply at 1 Mbit/s
SILENT_ROUNDS = 20  # a drive is waited for afterwards
PAUSE_LIMIT_S = 10.0  # time limit of this wait
LATE_POLLS = 10  # in which other drives answer; a drive counts as lost afterwards
SLIP_S = 0.1  # rounds that are later than this are left out
SETTLE_S = 0.1  # after a pause, late replies arrive
RETRIES = 20  # for queries that need an answer
CATCH_UP_DPS = 20  # of the joint, in addition to the targets' speed
COUNTS = 65536  # of the encoder field; for motors whose field spans a turn of the rotor

STATE_1, CLEAR_ERRORS, ANGLE = 0x9A, 0x9B, 0x92
OFF, RUN, TORQUE, MOVE = 0x80, 0x88, 0xA1, 0xA4
A_PER_LSB = 66 / 4096  # of iq, for MG motors with newer firmware
ERRORS = ["under-voltage", "over-voltage", "hot driver", "hot motor", "over-current", "short circuit", "stall", "lost input"]


class JointError(Exception):
    """The robot cannot continue."""


class NoReply(JointError):
    """A drive stopped answering."""


class DriveFault(JointError):
    """A drive switched itself off."""


def query(command):
    return bytes([command]) + bytes(7)


@dataclass(frozen=True)
class Joint:
    """`direction` is -1 if the motor is mounted the other way round. `boot_deg` is the joint's angle at power-on. It is
    needed because the drive knows its angle only within a turn of the rotor."""

    name: str
    motor: int
    gear: float
    boot_deg: float = 0.0
    direction: int = 1
    Nm_per_A: float = 0.0  # at the joint; only for torque control
    limit_Nm: float = 0.0


def bus_and_time():
    """Returns a bus with its `now` and `sleep`: python-can's own (selected by CAN_INTERFACE, CAN_CHANNEL or can.rc), or
    one with a stepped clock."""
    if not os.environ.get("LKEMU_CONTROL"):
        return can.Bus(), time.monotonic, time.sleep
    import lkemu

    attached = lkemu.attach()
    return attached.open(), attached.now, attached.sleep


def smooth(share):
    """Maps 0..1 to 0..1 with zero speed at the ends."""
    share = max(0.0, min(1.0, share))
    return share * share * (3 - 2 * share)


class Rounds:
    """`next()` waits for the beginning of the next round and returns the time since the first, without pauses."""

    def __init__(self, period_s, now, sleep):
        self.period_s, self.now, self.sleep = period_s, now, sleep
        self.began_s, self.count = now(), 0

    def next(self):
        ahead_s = self.began_s + self.count * self.period_s - self.now()
        if ahead_s < -SLIP_S:
            self.began_s -= ahead_s
        self.sleep(max(0.0, ahead_s))
        self.count += 1
        return (self.count - 1) * self.period_s


class Joints:
    """All joints of a robot. A round sends each drive one command and collects the replies that arrive in time."""

    def __init__(self, bus, joints, now=time.monotonic, sleep=time.sleep):
        self.bus, self.joints, self.now, self.sleep = bus, joints, now, sleep
        self.lost = 0  # late or missing replies
        self._silent = [0] * len(joints)
        self._offset_deg = [0.0] * len(joints)  # added to 0x92: whole turns of the rotor
        self._rotor_deg = [0.0] * len(joints)
        self._targets_deg = [0.0] * len(joints)
        self._looked_at = 0
        self._index = {0x140 + joint.motor: i for i, joint in enumerate(joints)}

    def start(self):
        """Enables the drives and reads the angles of the joints."""
        self._query_all(RUN)
        for joint, data in zip(self.joints, self._query_all(CLEAR_ERRORS)):
            self._raise_errors(joint, data[7])
        for i, (joint, data) in enumerate(zip(self.joints, self._query_all(ANGLE))):
            boot_deg = joint.direction * joint.gear * joint.boot_deg
            self._rotor_deg[i] = int.from_bytes(data[1:], "little", signed=True) / 100
            self._offset_deg[i] = round((boot_deg - self._rotor_deg[i]) / 360) * 360
        self._keep_turns()
        self._targets_deg = self.degrees()
        return self.degrees()

    def _keep_turns(self):
        """Keeps the turns of the rotors in the file LK_JOINTS_TURNS, if set. A host that starts again needs them, because
        the joints are no longer at `boot_deg`."""
        file = Path(os.environ.get("LK_JOINTS_TURNS", os.devnull))
        if kept := file.exists() and file.read_text("utf-8"):
            self._offset_deg = json.loads(kept)
        file.write_text(json.dumps(self._offset_deg), "utf-8")

    def angles(self):
        """Queries all drives for the angles of the joints; a missing reply leaves the previous angle."""
        for (i, _), data in self._round([(i, query(ANGLE)) for i in range(len(self.joints))]).items():
            self._rotor_deg[i] = int.from_bytes(data[1:], "little", signed=True) / 100
        return self.degrees()

    def degrees(self):
        """Returns the joint angles of the latest replies."""
        return [
            joint.direction * (rotor + offset) / joint.gear
            for joint, rotor, offset in zip(self.joints, self._rotor_deg, self._offset_deg)
        ]

    def move(self, targets_deg, within_s):
        """Sends 0xA4 to all joints. The speed is a little above that from the previous targets in `within_s`, so that
        small steps give a smooth motion."""
        frames = []
        for joint, target, before, offset in zip(self.joints, targets_deg, self._targets_deg, self._offset_deg):
            speed_dps = 1.1 * abs(target - before) / within_s + CATCH_UP_DPS
            rotor_dps = min(65535, round(speed_dps * joint.gear))
            rotor_deg = joint.direction * joint.gear * target - offset
            frames.append(struct.pack("<BxHi", MOVE, rotor_dps, round(rotor_deg * 100)))
        self._targets_deg = list(targets_deg)
        self._command(frames)

    def push(self, torques_Nm):
        """Sends 0xA1 to all joints. Returns each joint's angle in degrees and speed in degrees/s, measured just before
        the command. None for a joint whose reply was late."""
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
        """Sends each joint a frame, and one joint in turn an error query. Returns the frames' replies by joint."""
        asked = self._looked_at = (self._looked_at + 1) % len(self.joints)
        replies = self._round([*enumerate(frames), (asked, query(STATE_1))])
        state = replies.pop((asked, STATE_1), None)
        if state:
            self._raise_errors(self.joints[asked], state[7])
        return {i: data for (i, _), data in replies.items()}

    def _round(self, frames, limit_s=REPLY_LIMIT_S):
        """Sends frames (pairs of joint index and data) and returns the replies in time, by index and command. A late
        reply counts for the next round, because replies carry no sequence number."""
        for i, data in frames:
            self.bus.send(can.Message(arbitration_id=0x140 + self.joints[i].motor, data=data, is_extended_id=False))
        replies, missing = {}, {(i, data[0]) for i, data in frames}
        deadline = self.now() + limit_s + WIRE_S * len(frames)
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
        silent = {i for i, rounds in enumerate(self._silent) if rounds > SILENT_ROUNDS}
        if silent:
            self._wait_for(silent)
        return replies

    def _wait_for(self, silent):
        """Waits until these drives answer again, then discards late replies. Raises NoReply if they do not, or
        DriveFault if a drive has lost its turns, since its joint's angle is then unknown."""
        deadline, chances = self.now() + PAUSE_LIMIT_S, LATE_POLLS
        while silent:
            if self.now() > deadline or chances == 0:
                lost = self.joints[min(silent)]
                raise NoReply(f"{lost.name} (drive {lost.motor}) does not answer any more")
            for joint in self.joints:
                self.bus.send(can.Message(arbitration_id=0x140 + joint.motor, data=query(STATE_1), is_extended_id=False))
            heard = self._heard_for(SETTLE_S)
            silent = silent - heard
            chances -= 1 if heard else 0
        self._heard_for(SETTLE_S)
        self._silent = [0] * len(self.joints)
        for i, (joint, data) in enumerate(zip(self.joints, self._query_all(ANGLE))):
            rotor_deg = int.from_bytes(data[1:], "little", signed=True) / 100
            target_deg = joint.direction * joint.gear * self._targets_deg[i] - self._offset_deg[i]
            if min(abs(rotor_deg - target_deg), abs(rotor_deg - self._rotor_deg[i])) > 180:
                raise DriveFault(f"{joint.name} (drive {joint.motor}): has restarted, its turns are lost")

    def _heard_for(self, seconds):
        """Returns the indices of the joints whose drives answer in this time."""
        heard, end = set(), self.now() + seconds
        while (left := end - self.now()) > 0:
            message = self.bus.recv(left)
            if message and message.arbitration_id in self._index:
                heard.add(self._index[message.arbitration_id])
        return heard

    def _query_all(self, command):
        """Sends a query to all joints, again and more patiently to those that do not answer; returns all replies."""
        replies, limit_s = {}, REPLY_LIMIT_S
        for _ in range(1 + RETRIES):
            missing = [i for i in range(len(self.joints)) if (i, command) not in replies]
            if missing:
                replies.update(self._round([(i, query(command)) for i in missing], limit_s))
            limit_s = SETTLE_S
        for i, joint in enumerate(self.joints):
            if (i, command) not in replies:
                raise NoReply(f"{joint.name} (drive {joint.motor}) does not answer")
        return [replies[i, command] for i in range(len(self.joints))]

    def _raise_errors(self, joint, errors):
        if errors:
            names = ", ".join(name for bit, name in enumerate(ERRORS) if errors >> bit & 1)
            raise DriveFault(f"{joint.name} (drive {joint.motor}): {names}")
