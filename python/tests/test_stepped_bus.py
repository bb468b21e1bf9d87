"""Tests a bus that advances time while its host waits."""

from types import SimpleNamespace

import lkemu
import pytest
from lkemu.faults import Evidence

can = pytest.importorskip("can")


def frame(id=0x141, data=(0x9A, 0, 0, 0, 0, 0, 0, 0)):
    return can.Message(arbitration_id=id, data=data, is_extended_id=False)


class Clock:
    def __init__(self, *faults):
        self.time_s, self._faults, self.room = 0.0, faults, float("inf")

    def advance(self, by):
        self.time_s += by

    def faults(self):
        return list(self._faults)

    def tx_room(self, bus=None):
        return self.room


class Bus:
    """A bus whose frame arrives at 2.5 ms."""

    channel_info = "a bus"
    filters = None
    state = can.BusState.ACTIVE

    def __init__(self, clock):
        self.clock, self.sent, self.is_open, self.has_tasks = clock, [], True, True

    def set_filters(self, filters):
        self.filters = filters

    def send(self, message, timeout=None):
        self.sent.append(message)

    def recv(self, timeout):
        assert timeout == 0, "waiting is not the bus's"
        if self.sent and self.clock.time_s >= 0.0025:
            return self.sent.pop()
        return None

    def stop_all_periodic_tasks(self, remove_tasks=True):
        self.has_tasks = False

    def shutdown(self):
        self.is_open = False

    def selected(self):
        return "of this kind of bus alone"


class Silent(Bus):
    def recv(self, timeout):
        return None


def evidence(kind, ids, effects, first_on=""):
    first_effect_at_s = 0.25 if effects else None
    return Evidence("slcan-tcp:29536", kind, kind, ids, "active", 0.0, 0.1, first_effect_at_s, effects, first_on)


def test_send_raises_while_the_queue_is_full():
    clock = Clock()
    clock.room = 2
    inside = Bus(clock)
    bus = lkemu.SteppedBus(inside, clock)
    for _ in range(2):
        bus.send(frame())
    clock.room = 0
    with pytest.raises(can.CanOperationError, match="No buffer space available") as raised:
        bus.send(frame())
    assert raised.value.error_code == 105 and len(inside.sent) == 2
    clock.room = 1
    bus.send(frame())
    assert len(inside.sent) == 3


def test_recv_advances_time_to_the_frame():
    clock = Clock()
    bus = lkemu.SteppedBus(Bus(clock), clock)
    sent = frame()
    bus.send(sent)
    assert bus.recv(0) is None and clock.time_s == 0
    assert bus.recv(1.0) is sent
    assert abs(clock.time_s - 0.003) < 1e-9


def test_recv_advances_time_to_the_time_out():
    clock = Clock()
    bus = lkemu.SteppedBus(Bus(clock), clock, step="4ms")
    assert bus.recv(0.0101) is None
    assert abs(clock.time_s - 0.0101) < 1e-9


def test_rounding_remainder_still_advances_time():
    class Microseconds(Clock):  # like the readings of a stepped clock
        def advance(self, by):
            self.time_s = round(self.time_s + by, 6)

    clock = Microseconds()
    bus = lkemu.SteppedBus(Bus(clock), clock)
    deadline_s, turns = 0.1 + 0.2, 0  # differs from 0.3 and from every reading of the clock
    while (left_s := deadline_s - clock.time_s) > 0:
        assert bus.recv(left_s) is None
        turns += 1
        assert turns < 3, "it would never end"


def test_behaves_as_a_can_bus_and_closes_the_inner_bus():
    clock = Clock()
    inside = Bus(clock)
    inside.filters = [{"can_id": 0x141, "can_mask": 0x7FF}]
    with lkemu.SteppedBus(inside, clock, step=0.001) as bus:
        assert isinstance(bus, can.BusABC)
        assert bus.filters == [{"can_id": 0x141, "can_mask": 0x7FF}], "as they were"
        bus.set_filters(None)
        assert inside.filters is None
        assert bus.channel_info == str(bus) == "a bus" and bus.state == can.BusState.ACTIVE
        assert bus.selected() == "of this kind of bus alone"
        bus.send(frame())
        assert bus.recv().arbitration_id == 0x141
        bus.send(frame(0x142))
        assert next(iter(bus)).arbitration_id == 0x142
        assert inside.is_open
    assert not inside.is_open


def test_no_reply_names_the_fault_that_removed_the_frame():
    clock = Clock(
        evidence("jam", (1,), 3, "drive 1"),
        evidence("drop", (1,), 1, "drive 1, 141#9A00000000000000"),
        evidence("hang", (2,), 5, "drive 2, 142#9A00000000000000"),
        evidence("silent", (1,), 0),
    )
    bus = lkemu.SteppedBus(Silent(clock), clock, patience="2s")
    bus.send(frame())
    with pytest.raises(lkemu.NoReply) as told:
        bus.recv()
    assert abs(clock.time_s - 2) < 1e-6
    assert str(told.value) == (
        "no frame in 2 s of simulated time, waiting for the reply to 141#9A00000000000000: "
        "fault drop on drive 1 took effect 1 times, first at 0.250000 s on drive 1, 141#9A00000000000000 (active); "
        "fault jam on drive 1 took effect 3 times, first at 0.250000 s on drive 1 (active)"
    )


def test_no_reply_without_a_fault_describes_the_drive():
    clock = Clock()
    bus = lkemu.SteppedBus(Silent(clock), clock, patience=0.1)
    bus.send(frame(0x147))
    with pytest.raises(lkemu.NoReply, match="147#9A.*: no fault .* is this drive on the bus, with power?"):
        bus.recv()
    with pytest.raises(lkemu.NoReply, match="and none was sent$"):
        next(iter(lkemu.SteppedBus(Silent(clock), clock, patience=0.1)))


def test_call_with_a_time_out_is_never_cut_short():
    clock = Clock()
    bus = lkemu.SteppedBus(Silent(clock), clock, step="100ms", patience="2s")
    assert bus.recv(5) is None
    assert abs(clock.time_s - 5) < 1e-6
    assert bus.recv(0) is None


def test_repeated_queries_run_out_of_patience():
    clock = Clock()
    bus = lkemu.SteppedBus(Silent(clock), clock, patience="1s")
    with pytest.raises(lkemu.NoReply):
        for _ in range(1000):
            bus.send(frame())
            bus.recv(0.01)
    assert abs(clock.time_s - 1) < 0.02


def test_silence_before_a_query_does_not_count_as_waiting():
    clock = Clock()
    bus = lkemu.SteppedBus(Silent(clock), clock, step="100ms", patience="1s")
    assert bus.recv(5) is None
    bus.send(frame())
    assert bus.recv(0.5) is None, "it has waited 0.5 s for its reply"


def test_periodic_tasks_are_passed_to_the_inner_bus():
    clock = Clock()
    bus = lkemu.SteppedBus(Bus(clock), clock)
    bus.stop_all_periodic_tasks()
    assert not bus.bus.has_tasks


def test_received_frame_restarts_the_patience():
    clock = Clock()
    bus = lkemu.SteppedBus(Bus(clock), clock, step="100ms", patience="1s")
    for _ in range(3):
        assert bus.recv(0.9) is None
        bus.send(frame())
        assert bus.recv() is not None


def test_lines_without_a_frame_do_not_advance_time():
    class Slcan(Bus):
        """As in python-can: reads received lines one by one."""

        serialPortOrig = SimpleNamespace(in_waiting=0)

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
