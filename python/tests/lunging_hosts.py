"""Hosts for the campaign no_lunge: correct ones, and some with one bug each. `kind` of run_case names the host."""

import math
import struct

from no_lunge_host import BRAKE, CLEAR, GEAR, MOVE, RELEASE, RUN, SPEED_DPS, STATE, Joint, Trouble, path_deg

SPEED = 0xA2
SET_ANGLE = 0x95
LOST_INPUT = 0x80  # error bit


class Slow(Joint):
    pause_s = 0.05


class Eager(Joint):
    pause_s = 0.005


class OneShot(Joint):
    """Sends each end of the path once, and then only reads."""

    def approach(self, goal_deg):
        end_deg = 90 if goal_deg > 75 else 60
        if end_deg == self.target_deg:
            self.angle()
        else:
            self.move(end_deg)


class BySpeed(Joint):
    """Closes the position loop itself."""

    speed_dps = 0

    def approach(self, goal_deg):
        self.turn(max(-SPEED_DPS, min(SPEED_DPS, 10 * (goal_deg - self.angle()))))

    def turn(self, speed_dps):
        self.speed_dps = speed_dps
        self.ask(SPEED, struct.pack("<3xi", round(100 * speed_dps * GEAR)))


class OldTarget(Joint):
    """Clears an error and goes on with the old target."""

    error_bits = 0x7F  # all but lost input

    def recover(self):
        old_deg = self.target_deg
        errors = self.ask(STATE)[7]
        if old_deg is None or not errors & self.error_bits:
            return super().recover()
        self.ask(CLEAR)
        self.check()
        self.ask(RUN)
        self.move(old_deg)


class AfterLostInput(OldTarget):
    """Takes an expired lost-input time-out for harmless."""

    error_bits = LOST_INPUT


class OverPowerCycle(Joint):
    """Goes on along its path if the drive answers again without an error."""

    def recover(self):
        if self.target_deg is None or self.ask(STATE)[7]:
            return super().recover()
        self.ask(RUN)
        self.ask(BRAKE, bytes([RELEASE]))
        self.move(path_deg(self.clock.time_s))


class ResumesByRun(Joint):
    """After a stop, 0x88 resumes the motion."""

    was_deg = None

    def stop(self):
        self.was_deg = self.target_deg
        super().stop()

    def start(self):
        if self.was_deg is None:
            return super().start()
        self.target_deg, self.was_deg = self.was_deg, None
        self.ask(RUN)
        self.ask(BRAKE, bytes([RELEASE]))


class FirstZero(Joint):
    """A variable without a value."""

    is_first = True

    def move(self, target_deg):
        super().move(0 if self.is_first else target_deg)
        self.is_first = False


class Backlog(Joint):
    """Sends its targets whether or not the drive answers."""

    def check(self):
        try:
            super().check()
        except Trouble as trouble:
            if "no reply" not in str(trouble):
                raise

    def move(self, target_deg):
        self.send(MOVE, self.payload(target_deg))
        self.target_deg = target_deg


class Wrapped(Joint):
    """Its drive has turned so far that targets no longer fit."""

    farthest_deg = 1e9
    offset_deg = None

    def angle(self):
        if self.offset_deg is None:
            self.ask(SET_ANGLE, struct.pack("<3xi", 2**31 - 5000))
            self.offset_deg = super().angle() - 60
        return super().angle() - self.offset_deg

    def payload(self, target_deg):
        wire = round(100 * (target_deg + self.offset_deg) * GEAR)
        return struct.pack("<xHI", 4 * SPEED_DPS * GEAR, wire % 2**32)


class Shifted(Joint):
    """Takes the next frame for the reply. Reads the state twelve times before each target."""

    def ask(self, command, payload=b""):
        self.send(command, payload)
        for step_s in 7 * [0.00015] + 19 * [0.001]:
            reply = self.bus.recv(0)
            if reply is not None:
                return bytes(reply.data)
            self.clock.advance(step_s)
        raise Trouble(f"no reply to {command:#x}")

    def check(self):
        for _ in range(12):
            self.ask(STATE)


class BrakeFirst(Joint):
    """Releases the brake before the drive has a target."""

    def start(self):
        self.switch_on()
        self.release_brake()
        self.move(self.angle())


class SpeedLeft(BySpeed):
    """Sends its last speed again before it reads the angle."""

    def recover(self):
        self.ask(CLEAR)
        self.ask(RUN)
        self.turn(math.copysign(SPEED_DPS, self.speed_dps))
        self.clock.advance(0.1)
        super().recover()


CORRECT = {"sample": Joint, "slow": Slow, "eager": Eager, "one_shot": OneShot, "by_speed": BySpeed}
BUGS = {"old_target": OldTarget, "after_lost_input": AfterLostInput, "over_power_cycle": OverPowerCycle, "resumes_by_run": ResumesByRun,
        "first_zero": FirstZero, "backlog": Backlog, "wrapped": Wrapped, "shifted": Shifted, "brake_first": BrakeFirst,
        "speed_left": SpeedLeft}  # fmt: skip


def run_case(bus, clock, recovery, kind):
    {**CORRECT, **BUGS}[kind](bus, clock, recovery).run()
