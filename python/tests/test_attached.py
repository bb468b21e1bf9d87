"""Tests a program that another program has started with a bus."""

import lkemu
import pytest


@pytest.fixture
def stepped(fake):
    with lkemu.Emulator(bus="vcan0", program=fake, clock="stepped") as emulator:
        yield emulator


def test_without_a_bus_one_line_says_what_is_missing(monkeypatch):
    monkeypatch.delenv("LKEMU_BUS", raising=False)
    with pytest.raises(lkemu.StartError, match="LKEMU_BUS is not set"):
        lkemu.attach()


def test_in_real_time_it_is_the_bus_alone(monkeypatch):
    monkeypatch.setenv("LKEMU_BUS", "udp-multicast:239.74.163.2:40001")
    monkeypatch.setenv("LKEMU_CONTROL", "")
    attached = lkemu.attach()
    assert attached.clock is None
    assert attached.can_args == {
        "interface": "udp_multicast", "channel": "239.74.163.2", "port": 40001, "hop_limit": 0,
    }  # fmt: skip
    before = attached.now()
    attached.sleep(0)
    assert attached.now() >= before


def test_with_a_stepped_clock_time_is_the_drives(stepped, monkeypatch):
    monkeypatch.setenv("LKEMU_BUS", "slcan-tcp:29536")
    monkeypatch.setenv("LKEMU_CONTROL", stepped.control)
    attached = lkemu.attach()
    assert attached.now() == 0
    attached.sleep(0.25)
    attached.sleep(0)
    assert attached.now() == stepped.clock.time_s == 0.25


def test_a_clock_that_goes_by_itself_is_not_moved(stepped, monkeypatch):
    stepped.clock.mode = "realtime"
    monkeypatch.setenv("LKEMU_BUS", "vcan0")
    monkeypatch.setenv("LKEMU_CONTROL", stepped.control)
    assert lkemu.attach().clock is None
