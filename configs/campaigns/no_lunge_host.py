"""The host of no_lunge.toml: moves a joint along a path, and after a fault starts again where the joint is.

Use it as a sample for your host. These rules keep the joint from a lunge.

After a start, error, lost reply or pause, read the angle before the next motion.

Discard old frames before a query, and compare DATA[0] of the reply with it.

Send no motion command before the last query is answered: unacknowledged frames wait in the send queue.

Switch the drive off (0x80) before 0x88, which may resume an old command.

Give the drive its target before the brake is released.
"""

import contextlib
import math
import struct

import can

GEAR = 6
BOOT_S = 0.3
REPLY_LIMIT_S = 0.01
MOST_FRAMES = 16  # of others, while waiting for a reply
RETRY_S = 0.05
BRAKE_S = 0.1
SPEED_DPS = 90  # of the output, along the path
PERIOD_S = 1.2  # of the path
STOP_FROM_S, STOP_TO_S = 1.2, 1.6
END_S = 2.6

OFF, STOP, RUN, BRAKE, ANGLE, STATE, CLEAR, MOVE = 0x80, 0x81, 0x88, 0x8C, 0x92, 0x9A, 0x9B, 0xA4
ENGAGE, RELEASE = 0, 1


class Trouble(Exception):
    """The drive does not answer, or has an error."""


def path_deg(time_s):
    """Returns where the output should be: between 60 and 90 degrees."""
    return 75 - 15 * math.cos(2 * math.pi * time_s / PERIOD_S)


class Joint:
    """`recovery`: "clear" sends 0x9B first after a fault, "off" 0x80, "stop" 0x81."""

    pause_s = 0.02  # after each cycle, which takes 2 ms
    farthest_deg = 120  # of the output: a larger reading is damaged

    def __init__(self, bus, clock, recovery):
        self.bus, self.clock, self.recovery = bus, clock, recovery
        self.target_deg = None  # of the output; None: not moving

    # Frames

    def send(self, command, payload=b""):
        data = bytes([command]) + payload.ljust(7, b"\0")
        self.bus.send(can.Message(arbitration_id=0x141, data=data, is_extended_id=False))

    def ask(self, command, payload=b""):
        """Returns the data of the reply. Raises Trouble."""
        while self.bus.recv(0):
            pass
        self.send(command, payload)
        for _ in range(MOST_FRAMES):
            reply = self.bus.recv(REPLY_LIMIT_S)
            if reply is None:
                break
            if reply.arbitration_id == 0x141 and len(reply.data) == 8 and reply.data[0] == command:
                return bytes(reply.data)
        raise Trouble(f"no reply to {command:#x}")

    def angle(self):
        """Returns the angle of the output. Raises Trouble."""
        angle_deg = int.from_bytes(self.ask(ANGLE)[1:], "little", signed=True) / 100 / GEAR
        if abs(angle_deg) > self.farthest_deg:
            raise Trouble(f"{angle_deg:.0f} degrees is not an angle of this joint")
        return angle_deg

    def payload(self, target_deg):
        """Returns the payload of MOVE."""
        return struct.pack("<xHi", 4 * SPEED_DPS * GEAR, round(100 * target_deg * GEAR))

    def move(self, target_deg):
        self.ask(MOVE, self.payload(target_deg))
        self.target_deg = target_deg

    def check(self):
        if self.ask(STATE)[7]:
            raise Trouble("the drive has switched itself off")

    # Sequences

    def switch_on(self):
        self.ask(CLEAR)
        self.check()
        self.ask(OFF)
        self.ask(RUN)

    def release_brake(self):
        self.ask(BRAKE, bytes([RELEASE]))
        self.clock.advance(BRAKE_S)

    def start(self):
        """Holds the joint where it is, then releases the brake. Reads the angle again, since that was a pause."""
        self.switch_on()
        self.move(self.angle())
        self.release_brake()
        self.angle()

    def approach(self, goal_deg):
        """Moves the target towards the goal, as far as the speed allows."""
        most_deg = SPEED_DPS * self.pause_s
        self.move(self.target_deg + max(-most_deg, min(most_deg, goal_deg - self.target_deg)))

    def stop(self):
        self.target_deg = None
        self.ask(BRAKE, bytes([ENGAGE]))
        self.ask(STOP)

    def recover(self):
        self.target_deg = None
        if self.recovery != "clear":
            self.ask(STOP if self.recovery == "stop" else OFF)
        self.start()

    def cycle(self, now_s):
        if STOP_FROM_S <= now_s < STOP_TO_S:
            if self.target_deg is not None:
                self.stop()
            self.check()
        elif self.target_deg is None:
            self.start()
        else:
            self.check()
            self.approach(path_deg(now_s))

    def run(self):
        """Ends if the adapter is gone: the drive's lost-input protection stops the joint."""
        try:
            self.follow_path()
        except (OSError, can.CanError) as problem:
            print(f"trouble: the adapter is gone: {problem}", flush=True)

    def follow_path(self):
        now_s = self.clock.advance_to(BOOT_S)
        troubled = False
        while now_s < END_S:
            wait_s = self.pause_s
            try:
                if troubled:
                    self.recover()
                    troubled = False
                else:
                    self.cycle(now_s)
            except Trouble as trouble:
                if not troubled:
                    print(f"trouble: {trouble}", flush=True)
                troubled, wait_s = True, RETRY_S
            now_s = self.clock.advance(wait_s)
        with contextlib.suppress(Trouble):
            self.stop()


def run_case(bus, clock, recovery):
    Joint(bus, clock, recovery).run()
