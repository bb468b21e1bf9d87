"""The package with the real lk-emu."""

import os
import subprocess
import sys
import time

import lkemu as package
import pytest

pytestmark = pytest.mark.lkemu(clock="stepped", seed=1)
BOOTED = "100ms"


def test_two_at_a_time_have_a_bus_each(lkemu, lkemu_start):
    other = lkemu_start(ids="7")
    assert lkemu.bus != other.bus
    assert [drive.id for drive in lkemu.drives] == [1, 2, 3, 4] and [drive.id for drive in other.drives] == [7]


def test_a_robot_of_two_buses(lkemu_start, tmp_path):
    left, right = f"slcan-pty:{tmp_path}/left", f"slcan-pty:{tmp_path}/right"
    robot = lkemu_start(bus={left: "1-2", right: "2,5"})
    assert robot.buses == [left, right]
    robot.drive(2, right).ambient(40)
    assert robot.drive(2, right).view()["bus"] == right, "slashes are in the name of the bus"
    robot.targets(bus=right).power.off()
    assert robot.drive(5).bus == right and len(robot.drives) == 4


def test_time_stands_until_it_is_moved(clock):
    assert clock.mode == "stepped"
    assert clock.advance("250ms") == pytest.approx(0.25, abs=1e-9)
    assert clock.advance_to(0.5) == pytest.approx(0.5, abs=1e-9)
    assert clock.time_s == pytest.approx(0.5, abs=1e-9)
    with pytest.raises(package.Refused, match="past"):
        clock.advance_to(0.1)
    clock.mode = "x10"
    assert clock.mode == "x10"
    with pytest.raises(package.Refused) as refused:
        clock.advance(1)
    assert refused.value.status == 409


def test_power(drives, clock):
    clock.advance(BOOTED)
    assert drives[2].alive
    drives[2].power.cycle(off_s=1)
    clock.advance("900ms")
    assert not drives[2].alive and drives[1].alive
    clock.advance("1s")
    assert drives[2].alive


def test_the_supply_moves_evenly(drives, clock):
    clock.advance(BOOTED)
    drives[3].supply(20, ramp_s=1)
    clock.advance("500ms")
    assert drives[3].telemetry()["true_voltage_V"] == pytest.approx(22, abs=0.1)  # half-way from 24 V
    clock.advance("1s")
    assert drives[3].telemetry("true_voltage_V") == pytest.approx(20, abs=0.1)


def test_settings(drives, clock):
    clock.advance(BOOTED)
    drives[1].settings(max_speed_dps=90)
    clock.advance(BOOTED)
    assert drives[1].registers["ram"]["max_speed_dps"] == drives[1].registers["rom"]["max_speed_dps"] == 90


def test_what_cannot_be_is_refused_in_words(lkemu, drives):
    with pytest.raises(package.Refused) as refused:
        drives[1].supply(500)
    assert refused.value.where == "supply_V" and refused.value.status == 400
    with pytest.raises(package.Refused, match="offset_A"):
        drives[1].fault("current_offset")
    with pytest.raises(package.Refused, match="no drive 9"):
        lkemu.targets([9]).power.off()
    with pytest.raises(package.Refused, match="signal"):
        lkemu.telemetry("nonsense")


def test_every_kind_of_fault_is_a_method(lkemu, drives):
    kinds = lkemu.fault_kinds()
    assert {"jam", "drop", "encoder_jump", "sag"} <= set(kinds)
    assert all(callable(getattr(drives[1], kind)) for kind in kinds)
    assert kinds["encoder_jump"].parameters == ("angle_deg",)


def test_the_course_of_a_fault(lkemu, drives, clock):
    waits = drives[1].jam(percent=50, when={"error": "stall"}, optional=True)
    later = drives[2].jam(50, at_s=0.3, for_s=0.2, name="left knee", optional=True)
    clock.advance("200ms")
    assert (waits.evidence.state, later.evidence.state) == ("armed", "armed")
    clock.advance("200ms")
    assert later.evidence.state == "active" and later.evidence.began_at_s == pytest.approx(0.3)
    clock.advance("200ms")
    assert later.evidence.state == "over" and later.evidence.parameters["percent"] == 50
    waits.clear()
    assert waits.evidence.state == "cleared" and waits.evidence.began_at_s is None
    again = drives[2].jam(50, name="left knee", optional=True)
    assert again.name not in (later.name, waits.name)
    lkemu.clear()
    assert all(fault.state in ("over", "cleared") for fault in lkemu.faults())


def test_telemetry_has_a_sample_for_each_period(lkemu, clock):
    with lkemu.telemetry(["true_rotor_deg", "alive"], ids="2-3", rate_Hz=100) as stream:
        clock.advance("1s")
        times = [next(stream) for _ in range(100)]
    assert stream.ids == [2, 3] and stream.signals == ("true_rotor_deg", "alive")
    steps = [after.time_s - before.time_s for before, after in zip(times, times[1:])]
    assert steps == pytest.approx([0.01] * 99, abs=1e-6)
    assert set(times[-1].drives) == {2, 3} and times[-1].drives[2]["alive"] == 1


def test_a_stream_ends_with_the_program(lkemu, clock):
    stream = lkemu.telemetry("speed_dps", rate_Hz=10)
    clock.advance("1s")
    for _ in range(10):
        next(stream)
    lkemu.stop()
    assert len(list(stream)) <= 1  # one sample, of the start, may arrive


@pytest.mark.lkemu(boot_angle_deg=-12.5)
def test_the_rotors_start_where_they_are_told(drives):
    count_deg = 360 / 2**14  # one encoder count: the encoder zero is quantised
    assert [drive.telemetry("true_rotor_deg") for drive in drives] == pytest.approx([-12.5] * 4, abs=count_deg)


def test_a_host_without_a_time_out_is_told_what_removed_its_reply(lkemu, drives, clock):
    can = pytest.importorskip("can")
    clock.advance(BOOTED)
    drives[2].hang()
    query = can.Message(arbitration_id=0x142, data=[0x9A, 0, 0, 0, 0, 0, 0, 0], is_extended_id=False)
    with package.SteppedBus(can.Bus(**lkemu.can_args), clock, patience="50ms") as bus:
        bus.send(query)
        with pytest.raises(package.NoReply, match="142#9A00000000000000: fault hang on drive 2 took effect 1 "):
            bus.recv()


def test_a_full_queue_is_an_exception(lkemu_start, tmp_path):
    can = pytest.importorskip("can")
    robot = tmp_path / "robot.toml"
    robot.write_text(f'[[bus]]\ninterface = "slcan-pty:{tmp_path}/can"\ntx_queue = 3\ntx_full = "refuse"\n'
                     "[[bus.drive]]\nid = 1\n")
    emulator = lkemu_start(config=robot)
    emulator.drives[1].power.off()
    emulator.clock.advance("3s")
    query = can.Message(arbitration_id=0x141, data=[0x9A, 0, 0, 0, 0, 0, 0, 0], is_extended_id=False)
    with package.SteppedBus(can.Bus(**emulator.can_args), emulator.clock) as bus:
        for _ in range(3):
            bus.send(query)
        with pytest.raises(can.CanOperationError, match="No buffer space available"):
            bus.send(query)
        emulator.clock.advance("1s")
        with pytest.raises(can.CanOperationError):
            bus.send(query)
        emulator.drives[1].power.on()
        emulator.clock.advance("1s")
        bus.send(query)


def test_a_mark_and_the_words_of_the_end(lkemu):
    lkemu.mark("here it begins")
    assert lkemu.stop() == 0
    assert "lk-emu stopped after" in lkemu.output


def runs(pid):
    """Returns whether a process runs; a zombie has an empty command line."""
    try:
        with open(f"/proc/{pid}/cmdline", "rb") as file:
            return file.read() != b""
    except OSError:
        return False


START = "import os, time, lkemu; print(lkemu.Emulator(bus='auto').start().pid, flush=True);"


def started(script):
    root = os.path.dirname(os.path.dirname(package.__file__))
    environment = {**os.environ, "PYTHONPATH": root}
    return subprocess.Popen([sys.executable, "-c", START + script], env=environment, stdout=subprocess.PIPE)


def wait_for_end(pid):
    patience = time.monotonic() + 20
    while runs(pid):
        assert time.monotonic() < patience, pid
        time.sleep(0.01)


@pytest.mark.parametrize("end", ["kill(os.getpid(), 9)", "kill(os.getpid(), 15)", "_exit(0)"])
def test_it_ends_with_its_parent_however_that_ends(end):
    with started(f"os.{end}") as parent:
        pid = int(parent.stdout.readline())
    wait_for_end(pid)


def test_it_ends_with_its_parent_although_a_forked_child_goes_on():
    with started("child = os.fork(); child or time.sleep(600); print(child, flush=True); os._exit(0)") as parent:
        pid, child = (int(parent.stdout.readline()) for _ in range(2))
        parent.wait()
        try:
            wait_for_end(pid)
        finally:
            os.kill(child, 9)
