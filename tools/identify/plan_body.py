"""Moves an LK-TECH motor for half a minute and logs what it says, for `lk-emu identify`.

The shaft must be free to turn, as far to either side as TRAVEL_TURNS says. Needs python-can:
  python3 SCRIPT --interface socketcan --channel can0 --log my_motor.log
"""

import argparse
import signal
import struct
import sys
import time

import can

# (here stand the constants of the plan)


def exchange(bus, data, log):
    """One query and its reply, or None after 20 ms; both are logged as candump -L does."""
    bus.send(can.Message(arbitration_id=QUERY_ID, data=data, is_extended_id=False))
    log.write(f"({time.time():.6f}) can0 {QUERY_ID:03X}#{bytes(data).hex().upper()}\n")
    end = time.monotonic() + 0.02
    while (left := end - time.monotonic()) > 0:
        reply = bus.recv(left)
        if reply is None or reply.arbitration_id != REPLY_ID or reply.is_error_frame or len(reply.data) != 8:
            continue
        log.write(f"({time.time():.6f}) can0 {REPLY_ID:03X}#{reply.data.hex().upper()}\n")
        if reply.data[0] == data[0]:  # else it comes late, from a query before
            return bytes(reply.data)
    return None


def command(what, value, start_cdeg):
    if what == "torque":
        return struct.pack("<BxxxhH", 0xA1, round(value / A_PER_LSB), 0)
    if what == "speed":
        return struct.pack("<Bxxxi", 0xA2, round(value * 100))
    if what == "position":
        return struct.pack("<BxHi", 0xA4, round(SPEED_DPS), start_cdeg + round(value * 100))
    return bytes([0x9C, 0, 0, 0, 0, 0, 0, 0])


class Watch:
    """Where the rotor is, from the replies; ends the run where it should not be."""

    def __init__(self):
        self.speed_dps, self.turns, self.counts, self.lost = 0, 0.0, None, 0

    def take(self, reply):
        self.lost = 0 if reply is not None else self.lost + 1
        if self.lost > 10:
            sys.exit(f"drive {DRIVE} has stopped answering")
        if reply is None:
            return
        self.speed_dps, counts = struct.unpack_from("<hH", reply, 4)
        if self.counts is not None:
            step = (counts - self.counts + COUNTS // 2) % COUNTS - COUNTS // 2
            self.turns += step / COUNTS * ROTOR_TURNS
        self.counts = counts
        if abs(self.turns) > TRAVEL_TURNS:
            sys.exit(f"stopped {self.turns:.1f} turns of the rotor from the start")

    def limited(self, what, value):
        """A torque that would make it faster yet than it may be is none."""
        too_fast = what == "torque" and value * self.speed_dps > 0 and abs(self.speed_dps) > 2 * SPEED_DPS
        return 0 if too_fast else value


def coast(bus, log, watch):
    """The host was late, and a pulse too long: without torque until the rotor is slow again."""
    end = time.monotonic() + 5
    while abs(watch.speed_dps) > SPEED_DPS:
        if time.monotonic() > end:
            sys.exit(f"stopped at {watch.speed_dps} dps, which friction does not end")
        watch.take(exchange(bus, command("torque", 0, 0), log))
        time.sleep(1 / RATE_HZ)


def run(bus, log):
    reply = exchange(bus, bytes([0x92, 0, 0, 0, 0, 0, 0, 0]), log)
    if reply is None:
        sys.exit(f"drive {DRIVE} does not answer: is it powered, are its ID and the bus right?")
    start_cdeg = int.from_bytes(reply[1:8], "little", signed=True)
    for first in FIRST_QUERIES:
        exchange(bus, bytes([first, 0, 0, 0, 0, 0, 0, 0]), log)
    watch, next_at = Watch(), time.monotonic()
    for number, (what, value, seconds) in enumerate(STEPS):
        print(f"\rstep {number + 1} of {len(STEPS)}", end="", file=sys.stderr)
        for _ in range(max(1, round(seconds * RATE_HZ))):
            watch.take(exchange(bus, command(what, watch.limited(what, value), start_cdeg), log))
            if abs(watch.speed_dps) > 5 * SPEED_DPS:
                coast(bus, log, watch)
            next_at = max(next_at + 1 / RATE_HZ, time.monotonic())
            time.sleep(max(0.0, next_at - time.monotonic()))


def free(bus):
    """Stop and off, whatever has happened: one must not keep the other from being sent."""
    for last in (0x81, 0x80):
        try:
            bus.send(can.Message(arbitration_id=QUERY_ID, data=bytes([last] + 7 * [0]), is_extended_id=False))
        except Exception as problem:  # of any adapter
            print(f"0x{last:02X} could not be sent: {problem}", file=sys.stderr)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--interface", default="socketcan")
    parser.add_argument("--channel", default="can0")
    parser.add_argument("--bitrate", type=int, default=1000000)
    parser.add_argument("--log", default="my_motor.log")
    parser.add_argument("--yes", action="store_true", help="do not ask before it moves")
    given = parser.parse_args()
    seconds = sum(step[2] for step in STEPS)
    if not given.yes:
        print(f"Drive {DRIVE} ({MOTOR}) will turn for {seconds:.0f} s, up to {2 * SPEED_DPS:.0f} dps and "
              f"{TRAVEL_TURNS} turns to either side at its rotor. Go on? [y/N] ", end="", flush=True)
        if sys.stdin.readline().strip().lower() not in ("y", "yes"):
            sys.exit("nothing was moved")
    with can.Bus(interface=given.interface, channel=given.channel, bitrate=given.bitrate) as bus:
        with open(given.log, "w", encoding="ascii") as log:
            for ending in ("SIGTERM", "SIGHUP"):
                if hasattr(signal, ending):  # Windows has one of them
                    signal.signal(getattr(signal, ending), lambda *_: sys.exit("ended by a signal"))
            try:
                run(bus, log)
            finally:
                free(bus)
    print(f"\n{given.log} is written: lk-emu identify {given.log} --motor '{MOTOR}' -o my_motor.toml", file=sys.stderr)


if __name__ == "__main__":
    main()
