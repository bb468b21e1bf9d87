"""Tests a program that another program has started with a bus."""

import lkemu
import pytest


@pytest.fixture
def stepped(fake):
    with lkemu.Emulator(bus="vcan0", program=fake, clock="stepped") as emulator:
        yield emulator


def test_attach_without_a_bus_names_the_missing_variable(monkeypatch):
    monkeypatch.delenv("LKEMU_BUS", raising=False)
    with pytest.raises(lkemu.StartError, match="LKEMU_BUS is not set"):
        lkemu.attach()


def test_real_time_bus_has_no_clock(monkeypatch):
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


def test_stepped_clock_gives_the_time_of_the_drives(stepped, monkeypatch):
    monkeypatch.setenv("LKEMU_BUS", "slcan-tcp:29536")
    monkeypatch.setenv("LKEMU_CONTROL", stepped.control)
    attached = lkemu.attach()
    assert attached.now() == 0
    attached.sleep(0.25)
    attached.sleep(0)
    assert attached.now() == stepped.clock.time_s == 0.25


def test_running_clock_is_not_advanced(stepped, monkeypatch):
    stepped.clock.mode = "realtime"
    monkeypatch.setenv("LKEMU_BUS", "vcan0")
    monkeypatch.setenv("LKEMU_CONTROL", stepped.control)
    assert lkemu.attach().clock is None
