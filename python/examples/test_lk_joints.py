"""Tests joints and legs alone, on a bus with ideal drives."""

import math
import struct

import can
import pytest
from arm_square import SixJointArm, TwoJointArm, off_m
from lk_joints import A_PER_LSB, DriveFault, Joint, Joints, NoReply, Rounds
from quadruped import LEGS, OFFSET_M, SEGMENT_M, leg_angles, side

PITCH = Joint("pitch", 2, 6, boot_deg=-77, direction=-1, Nm_per_A=1.15, limit_Nm=25)
ROLL = Joint("roll", 1, 8, boot_deg=17, Nm_per_A=1.11, limit_Nm=12)


class IdealBus:
    """Drives that answer after `late_s` and only move on 0xA4. `rotor_deg` is the angle of 0x92."""

    def __init__(self, rotor_deg, late_s=0.0005):
        self.rotor_deg, self.late_s = dict(rotor_deg), late_s
        self.time_s, self.waiting = 0.0, []
        self.sent, self.errors, self.deaf, self.deaf_for = [], {}, set(), {}

    def now(self):
        return self.time_s

    def sleep(self, seconds):
        self.time_s += max(0.0, seconds)

    def send(self, message):
        id, data = message.arbitration_id - 0x140, bytes(message.data)
        self.sent.append((id, data))
        if id in self.deaf:
            return
        if self.deaf_for.get(id, 0) > 0:
            self.deaf_for[id] -= 1
            return
        reply = data[:1] + bytes(7)
        if data[0] == 0x92:
            reply = data[:1] + round(self.rotor_deg[id] * 100).to_bytes(7, "little", signed=True)
        elif data[0] in (0x9A, 0x9B):
            reply = data[:1] + bytes(6) + bytes([self.errors.get(id, 0)])
        elif data[0] in (0xA1, 0xA4):
            reply = struct.pack("<BbhhH", data[0], 30, 0, 60, round(self.rotor_deg[id] / 360 * 65536) % 65536)
        if data[0] == 0xA4:
            self.rotor_deg[id] = struct.unpack("<BxHi", data)[2] / 100
        message = can.Message(arbitration_id=0x140 + id, data=reply, is_extended_id=False)
        self.waiting.append((self.time_s + self.late_s, message))

    def recv(self, timeout):
        if self.waiting and self.waiting[0][0] <= self.time_s + timeout:
            at_s, message = self.waiting.pop(0)
            self.time_s = max(self.time_s, at_s)
            return message
        self.time_s += timeout
        return None


def joints_on(bus, joints=(ROLL, PITCH)):
    return Joints(bus, joints, now=bus.now, sleep=bus.sleep)


def test_start_derives_rotor_turns_from_the_boot_angle():
    # pitch: at power-on the rotor was at 6*77 = 462 degrees, reported as 102; since then it has turned by 10
    bus = IdealBus({1: 136.0, 2: 112.0})
    assert joints_on(bus).start() == pytest.approx([17, -472 / 6])


def test_host_that_starts_again_knows_the_turns(tmp_path, monkeypatch):
    monkeypatch.setenv("LK_JOINTS_TURNS", str(tmp_path / "turns"))
    bus = IdealBus({1: 136.0, 2: 102.0})
    joints_on(bus).start()
    bus.rotor_deg[2] += 6 * 90
    assert joints_on(bus).start() == pytest.approx([17, -77 - 90])


def test_move_sends_rotor_angles_with_the_joint_direction():
    bus = IdealBus({1: 136.0, 2: 102.0})
    robot = joints_on(bus)
    robot.start()
    robot.move([16.0, -75.0], within_s=0.1)
    sent = {id: struct.unpack("<BxHi", data) for id, data in bus.sent if data[0] == 0xA4}
    assert sent[1] == (0xA4, (11 + 20) * 8, 12800)  # a degree in 0.1 s plus 10 %, and 20 degrees/s to catch up
    assert sent[2] == (0xA4, (22 + 20) * 6, 45000 - 36000)
    assert robot.angles() == pytest.approx([16, -75])


def test_push_converts_torque_to_a_limited_current():
    bus = IdealBus({1: 136.0, 2: 102.0})
    robot = joints_on(bus)
    robot.start()
    seen = robot.push([1.11, 100.0])
    sent = {id: struct.unpack("<B3xh2x", data)[1] for id, data in bus.sent if data[0] == 0xA1}
    assert sent == {1: round(1 / A_PER_LSB), 2: -round(25 / 1.15 / A_PER_LSB)}
    assert seen == [pytest.approx((17, 60 / 8), abs=0.01), pytest.approx((-77, -60 / 6), abs=0.01)]


def test_angles_of_torque_replies_unwrap_the_encoder():
    bus = IdealBus({1: 170.0, 2: 102.0})
    robot = joints_on(bus)
    robot.start()
    for rotor_deg in (175.0, 185.0, 300.0, 400.0):
        bus.rotor_deg[1] = rotor_deg
        assert robot.push([0, 0])[0][0] == pytest.approx(rotor_deg / 8, abs=0.01)


def test_late_reply_counts_for_the_next_round():
    bus = IdealBus({1: 136.0, 2: 102.0})
    robot = joints_on(bus)
    robot.start()
    bus.late_s = 0.005
    assert robot.push([0, 0]) == [None, None]
    bus.rotor_deg[1] = 144.0
    assert robot.push([0, 0])[0][0] == pytest.approx(17, abs=0.01)
    assert robot.push([0, 0])[0][0] == pytest.approx(18, abs=0.01)


def test_lost_replies_are_queried_again_and_counted():
    bus = IdealBus({1: 136.0, 2: 102.0})
    bus.deaf_for = {2: 3}
    robot = joints_on(bus)
    robot.start()
    assert robot.lost == 3


def test_error_names_a_silent_drive():
    bus = IdealBus({1: 136.0, 2: 102.0})
    robot = joints_on(bus)
    robot.start()
    bus.deaf = {2}
    began_s = bus.time_s
    with pytest.raises(NoReply, match=r"pitch \(drive 2\) does not answer any more"):
        for _ in range(30):
            robot.move([0, 0], within_s=0.01)
    assert bus.time_s - began_s < 1.5


def test_late_replies_of_one_drive_are_waited_for():
    bus = IdealBus({1: 136.0, 2: 102.0})
    robot = joints_on(bus)
    robot.start()
    bus.deaf_for = {2: 35}
    for _ in range(60):
        robot.move([17, -77], within_s=0.01)
    assert robot.angles() == pytest.approx([17, -77])


def pause(bus, seconds, then=lambda: None):
    """Makes all drives silent for this time, and then calls `then`."""
    ends_s, plain = bus.time_s + seconds, bus.recv
    bus.deaf = set(bus.rotor_deg)

    def receive(timeout):
        if bus.deaf and bus.time_s > ends_s:
            bus.deaf = set()
            then()
        return plain(timeout)

    bus.recv = receive


def test_pause_of_all_drives_is_waited_for():
    bus = IdealBus({1: 136.0, 2: 102.0})
    robot = joints_on(bus)
    robot.start()
    pause(bus, 5)
    began_s, sent = bus.time_s, len(bus.sent)
    for _ in range(30):
        robot.move([17, -77], within_s=0.01)
    assert 5 < bus.time_s - began_s < 6
    assert len(bus.sent) - sent < 3 * 30 + 2 * 5 / 0.1 + 10, "no flood for the drives that are back"
    assert robot.angles() == pytest.approx([17, -77])


def test_drives_that_stay_silent_are_an_error():
    bus = IdealBus({1: 136.0, 2: 102.0})
    robot = joints_on(bus)
    robot.start()
    bus.deaf, began_s = {1, 2}, bus.time_s
    with pytest.raises(NoReply, match="roll .* does not answer any more"):
        for _ in range(30):
            robot.move([0, 0], within_s=0.01)
    assert 10 < bus.time_s - began_s < 11


def test_drives_that_restart_in_a_pause_are_an_error():
    bus = IdealBus({1: 136.0, 2: 102.0})
    robot = joints_on(bus)
    robot.start()
    robot.move([17, -177], within_s=0.01)
    robot.angles()
    pause(bus, 1, lambda: bus.rotor_deg.update({2: 342.0}))  # of 702: a turn less
    with pytest.raises(DriveFault, match=r"pitch \(drive 2\): has restarted"):
        for _ in range(30):
            robot.move([17, -177], within_s=0.01)


def test_rounds_leave_out_a_pause():
    bus = IdealBus({})
    rounds = Rounds(0.01, bus.now, bus.sleep)
    for number in range(3):
        rounds.next()
    bus.sleep(5)
    for number in range(3, 6):
        assert rounds.next() == pytest.approx(0.01 * number)
    assert bus.time_s == pytest.approx(5.02 + 2 * 0.01)


def test_error_names_a_faulted_drive_and_its_errors():
    bus = IdealBus({1: 136.0, 2: 102.0})
    robot = joints_on(bus)
    robot.start()
    bus.errors = {1: 0x41}
    with pytest.raises(DriveFault, match=r"roll \(drive 1\): under-voltage, stall"):
        for _ in range(2):
            robot.move([0, 0], within_s=0.01)


def test_rounds_keep_their_period():
    bus = IdealBus({})
    rounds = Rounds(0.01, bus.now, bus.sleep)
    for number in range(5):
        assert rounds.next() == pytest.approx(0.01 * number)
        assert bus.time_s == pytest.approx(0.01 * number)
        bus.sleep(0.004)


@pytest.mark.parametrize("leg", LEGS)
@pytest.mark.parametrize("place", [(0.0, 0.08, -0.4), (0.1, 0.15, -0.3), (-0.08, 0.02, -0.35)])
def test_leg_angles_reach_the_foot_position(leg, place):
    x_m, y_m, z_m = place[0], place[1] * side(leg), place[2]
    roll, pitch, knee = (math.radians(angle) for angle in leg_angles(leg, x_m, y_m, z_m))
    down_m = SEGMENT_M * (math.cos(pitch) + math.cos(pitch + knee))
    assert SEGMENT_M * (math.sin(pitch) + math.sin(pitch + knee)) == pytest.approx(x_m)
    assert OFFSET_M * side(leg) * math.cos(roll) + down_m * math.sin(roll) == pytest.approx(y_m)
    assert OFFSET_M * side(leg) * math.sin(roll) - down_m * math.cos(roll) == pytest.approx(z_m)
    assert knee > 0


@pytest.mark.parametrize("arm", [TwoJointArm(), SixJointArm()])
def test_arm_angles_reach_the_tip_position(arm):
    for corner in arm.corners:
        assert arm.tip(arm.angles(corner)) == pytest.approx(corner)


def test_off_m_measures_the_distance_from_a_side():
    assert off_m((0.05, 0.003), (0, 0), (0.2, 0)) == pytest.approx(0.003)
    assert off_m((0.203, 0.004), (0, 0), (0.2, 0)) == pytest.approx(0.005)
