"""Tests the joint's controller with a virtual drive, in cases that a test bench cannot easily produce.

    pytest python/examples                          with a CAN bus
    scripts/with-vcan pytest python/examples        without one
"""

import can
import pytest
from joint_controller import POLL_S, STALL_LIMIT_S, TOLERANCE_DEG, Joint, Stalled

from lkemu import SteppedBus

pytestmark = pytest.mark.lkemu(ids="1", seed=1)
HALF_WAY = {"signal": "angle_deg", "crosses": 45}


@pytest.fixture
def bus(lkemu):
    with can.Bus(**lkemu.can_args) as bus:
        yield bus


@pytest.fixture
def joint(bus):
    joint = Joint(bus, 1)
    joint.move_to(0)
    return joint


def test_reaches_the_target(joint, drives):
    joint.move_to(90)
    assert drives[1].telemetry("angle_deg") == pytest.approx(90, abs=2 * TOLERANCE_DEG)
    assert joint.homings == 1


def test_reports_a_stall(joint, drives):
    jam = drives[1].jam(percent=100, when=HALF_WAY)
    with pytest.raises(Stalled):
        joint.move_to(90)
    jam.clear()
    joint.move_to(90)


def test_reaches_the_target_despite_lost_replies(joint, drives):
    drives[1].drop(probability=0.1)
    joint.move_to(90)
    assert joint.retries > 0
    assert drives[1].telemetry("angle_deg") == pytest.approx(90, abs=2 * TOLERANCE_DEG)


def test_finds_its_reference_after_a_brown_out(joint, drives):
    drives[1].sag(to_V=3, s=1.0, when=HALF_WAY)
    joint.move_to(90)
    assert joint.homings == 2
    assert drives[1].telemetry("angle_deg") == pytest.approx(90, abs=2 * TOLERANCE_DEG)


# --- with a stepped clock: as fast as the machine allows, with equal results on all machines ---


@pytest.mark.lkemu(clock="stepped")
def test_reports_a_jam_within_the_time_limit(bus, drives, clock):
    clock.advance("100ms")  # the drive has booted
    joint = Joint(SteppedBus(bus, clock), 1, now=lambda: clock.time_s, sleep=clock.advance)
    joint.move_to(0)
    jam = drives[1].jam(percent=100, when=HALF_WAY)
    with pytest.raises(Stalled):
        joint.move_to(90)
    # A poll is the pause and two replies of at most 1 ms; one more reply passes before the stop is answered.
    assert clock.time_s - jam.evidence.began_at_s <= STALL_LIMIT_S + 2 * (POLL_S + 0.002) + 0.001


@pytest.mark.lkemu(clock="stepped")
def test_survives_five_seconds_without_replies(bus, drives, clock):
    clock.advance("100ms")
    joint = Joint(SteppedBus(bus, clock), 1, now=lambda: clock.time_s, sleep=clock.advance)
    drives[1].silent(for_s=5)
    joint.move_to(90)
    drives[1].silent(for_s=5, when=HALF_WAY)
    joint.move_to(0)
    assert drives[1].telemetry("angle_deg") == pytest.approx(0, abs=2 * TOLERANCE_DEG)
