"""A joint of a robot: one LK-TECH motor (legacy firmware) on SocketCAN, with python-can.

Moves to angles, repeats lost queries, reports when the joint is stuck, and finds its reference again after the drive has
lost power. Works with real and virtual drives.
"""

import struct
import time

import can

REPLY_LIMIT_S = 0.02
RETRIES = 5  # the drive counts as lost afterwards
RETURN_LIMIT_S = 7.0  # without replies, until the move fails
POLL_S = 0.005
STALL_LIMIT_S = 0.3  # without progress
MOVE_LIMIT_S = 10.0  # with progress, but without reaching the target
FARTHEST_DEG = 36000  # a larger reading is a corrupted reply
PROGRESS_DEG = 0.5
TOLERANCE_DEG = 0.2
SETTLED = 3  # consecutive readings
SPEED_DPS = 180

ANGLE, SINGLE_TURN_ANGLE, STATE_1, CLEAR_ERRORS = 0x92, 0x94, 0x9A, 0x9B
STOP, RUN, MOVE = 0x81, 0x88, 0xA4


class JointError(Exception):
    """The joint did not execute a command."""


class NoReply(JointError):
    """The drive does not answer."""


class Stalled(JointError):
    """An obstacle blocks the joint."""


class DriveFault(JointError):
    """The drive switched itself off."""


class Joint:
    """`bus` is a can.Bus; `now` and `sleep` may be those of a simulation."""

    def __init__(self, bus, motor, now=time.monotonic, sleep=time.sleep):
        self.bus, self.id, self.now, self.sleep = bus, 0x140 + motor, now, sleep
        self.zero_deg = None  # of the multi-turn angle; None: no reference yet
        self.homings = 0
        self.retries = 0

    def ask(self, command, payload=bytes(7)):
        """Returns the reply's data. Retries, so every command used here must be safe to repeat."""
        query = can.Message(arbitration_id=self.id, data=bytes([command]) + payload, is_extended_id=False)
        for _ in range(1 + RETRIES):
            self.bus.send(query)
            deadline = self.now() + REPLY_LIMIT_S
            while (left := deadline - self.now()) > 0:
                reply = self.bus.recv(left)
                if reply and reply.arbitration_id == self.id and len(reply.data) == 8 and reply.data[0] == command:
                    return bytes(reply.data)
            self.retries += 1
        raise NoReply(f"no reply to {command:#x}")

    def home(self):
        """Re-enables the drive and derives the reference from the encoder, which measures the angle within a turn."""
        errors = self.ask(CLEAR_ERRORS)[7]
        if errors:
            raise DriveFault(f"errors {errors:#x} stay")
        self.ask(RUN)
        (within_turn,) = struct.unpack_from("<H", self.ask(SINGLE_TURN_ANGLE), 6)
        self.zero_deg = self.angle() - ((within_turn / 100 + 180) % 360 - 180)
        self.homings += 1

    def angle(self):
        angle_deg = int.from_bytes(self.ask(ANGLE)[1:], "little", signed=True) / 100
        if abs(angle_deg) > FARTHEST_DEG:
            raise NoReply(f"{angle_deg:.2f} degrees is no angle of a joint")
        return angle_deg

    def move_to(self, target_deg, speed_dps=SPEED_DPS):
        """Returns the angle at which the joint has come to rest. Raises JointError."""
        moves, progress_deg, progress_s, settled = False, None, self.now(), 0
        limit_s = progress_s + MOVE_LIMIT_S
        while settled < SETTLED:
            if self.now() > limit_s:
                self.ask(STOP)
                raise Stalled(f"not at {target_deg:.2f} degrees after {MOVE_LIMIT_S:.0f} s")
            try:
                if not moves:
                    self.start(target_deg, speed_dps)
                    moves = True
                self.sleep(POLL_S)
                if self.ask(STATE_1)[7]:
                    raise NoReply("the drive has switched itself off")
                position_deg = self.angle() - self.zero_deg
            except NoReply:
                lost_s = self.now()
                self.return_to_service()
                limit_s += self.now() - lost_s
                moves, progress_deg, progress_s, settled = False, None, self.now(), 0
                continue
            settled = settled + 1 if abs(position_deg - target_deg) <= TOLERANCE_DEG else 0
            if progress_deg is None or settled or abs(position_deg - progress_deg) > PROGRESS_DEG:
                progress_deg, progress_s = position_deg, self.now()
            elif self.now() - progress_s > STALL_LIMIT_S:
                self.ask(STOP)
                raise Stalled(f"stuck at {position_deg:.2f} degrees on the way to {target_deg:.2f}")
        return position_deg

    def start(self, target_deg, speed_dps):
        if self.zero_deg is None:
            self.home()
        self.ask(MOVE, struct.pack("<xHi", speed_dps, round((target_deg + self.zero_deg) * 100)))

    def return_to_service(self):
        """Waits for a drive that has restarted. It has lost its turn count and its commands."""
        self.zero_deg = None
        limit = self.now() + RETURN_LIMIT_S
        while self.zero_deg is None:
            try:
                self.home()
            except (NoReply, DriveFault):
                if self.now() > limit:
                    raise
                self.sleep(POLL_S)
