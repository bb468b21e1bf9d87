"""A bus that lets time pass while its host waits."""

import lkemu


class Clock:
    def __init__(self):
        self.time_s = 0.0

    def advance(self, by):
        self.time_s += by


class Bus:
    """Has a frame at 2.5 ms of the clock."""

    channel_info = "a bus"

    def __init__(self, clock):
        self.clock, self.sent = clock, []

    def send(self, message):
        self.sent.append(message)

    def recv(self, timeout):
        assert timeout == 0, "waiting is not the bus's"
        if self.sent and self.clock.time_s >= 0.0025:
            return self.sent.pop()
        return None


def test_time_passes_until_the_frame_comes():
    clock = Clock()
    bus = lkemu.SteppedBus(Bus(clock), clock)
    bus.send("frame")
    assert bus.recv(0) is None and clock.time_s == 0
    assert bus.recv(1.0) == "frame"
    assert abs(clock.time_s - 0.003) < 1e-9


def test_time_passes_until_the_timeout():
    clock = Clock()
    bus = lkemu.SteppedBus(Bus(clock), clock, step="4ms")
    assert bus.recv(0.0101) is None
    assert abs(clock.time_s - 0.0101) < 1e-9


def test_what_a_subtraction_leaves_over_lets_time_pass():
    class Microseconds(Clock):  # as a stepped clock's readings are
        def advance(self, by):
            self.time_s = round(self.time_s + by, 6)

    clock = Microseconds()
    bus = lkemu.SteppedBus(Bus(clock), clock)
    deadline_s, turns = 0.1 + 0.2, 0  # not 0.3, which the clock knows
    while (left_s := deadline_s - clock.time_s) > 0:
        assert bus.recv(left_s) is None
        turns += 1
        assert turns < 3, "it would never end"


def test_without_a_timeout_it_waits_on_and_the_rest_is_the_bus():
    clock = Clock()
    bus = lkemu.SteppedBus(Bus(clock), clock, step=0.001)
    bus.send("frame")
    assert bus.recv() == "frame"
    assert bus.channel_info == "a bus"
    bus.send("another")
    assert next(iter(bus)) == "another"


def test_of_lines_that_are_no_frames_none_is_waited_for():
    class Port:
        in_waiting = 0

    class Slcan(Bus):
        """As python-can's: what has come is looked at line by line."""

        serialPortOrig = Port()

        def __init__(self, clock):
            super().__init__(clock)
            self._buffer = bytearray(b"\rz\rt1410\r")

        def recv(self, timeout):
            assert timeout == 0, "waiting is not the bus's"
            line, _, rest = self._buffer.partition(b"\r")
            self._buffer[:] = rest
            return "frame" if line.startswith(b"t") else None

    clock = Clock()
    assert lkemu.SteppedBus(Slcan(clock), clock).recv(1.0) == "frame"
    assert clock.time_s == 0
