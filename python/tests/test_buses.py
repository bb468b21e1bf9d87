"""Tests the choice of a free bus and of the program."""

import os
import socket

import lkemu
import pytest
from lkemu import buses, program
from lkemu.options import Options


@pytest.fixture
def world(monkeypatch, tmp_path):
    """Interfaces by name and whether they are up; a private runtime directory; no permission to make interfaces."""
    interfaces = {}
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setattr(buses, "check_can_support", lambda: None)
    monkeypatch.setattr(buses, "may_make_interfaces", lambda: False)
    monkeypatch.setattr(buses, "is_up", lambda name: interfaces[name])
    monkeypatch.setattr(socket, "if_nameindex", lambda: list(enumerate(interfaces)))
    return interfaces


def test_claims_the_first_unused_interface_that_is_up(world):
    world.update({"lo": True, "vcan10": True, "vcan0": False, "vcan2": True, "can0": True})
    first, second = buses.claim_free_bus(), buses.claim_free_bus()
    assert (first.bus, first.create, second.bus) == ("vcan2", False, "vcan10")
    with pytest.raises(lkemu.StartError, match="3 of 3 in use or down.*scripts/with-vcan"):
        buses.claim_free_bus()
    os.close(first.lock)
    assert buses.claim_free_bus().bus == "vcan2"


def test_missing_interface_is_reported(world):
    with pytest.raises(lkemu.StartError, match="there is no vcan interface.*scripts/with-vcan.*ip link add vcan0"):
        buses.claim_free_bus()


def test_auto_takes_a_port_without_an_interface(world, monkeypatch):
    monkeypatch.setattr(buses, "FIRST_PORT", 52000)  # not used by other tests
    first, second = buses.claim_any_bus(), buses.claim_any_bus()
    names = [first.bus, second.bus]
    assert len(set(names)) == 2 and all(name.startswith("slcan-tcp:520") for name in names)
    os.close(first.lock)
    assert buses.claim_any_bus().bus == first.bus
    world.update({"vcan3": True})
    assert buses.claim_any_bus().bus == "vcan3"


def test_port_in_use_is_not_taken(world, monkeypatch):
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        monkeypatch.setattr(buses, "FIRST_PORT", port)
        monkeypatch.setattr(buses, "MOST_BUSES", 1)
        with pytest.raises(lkemu.StartError, match="all in use"):
            buses.claim_any_bus()
    assert buses.claim_any_bus().bus == f"slcan-tcp:{port}"


def test_can_args_fit_every_kind_of_bus():
    slcan = {"interface": "slcan", "sleep_after_open": 0.0}
    assert buses.can_args("vcan0") == {"interface": "socketcan", "channel": "vcan0"}
    assert buses.can_args("slcan-tcp:29536") == {**slcan, "channel": "socket://127.0.0.1:29536"}
    assert buses.can_args("slcan-tcp:29536?acks=no") == buses.can_args("slcan-tcp:29536")
    assert buses.can_args("slcan-tcp:[::1]:7") == {**slcan, "channel": "socket://[::1]:7"}
    assert buses.can_args("slcan-pty:/tmp/tty") == {**slcan, "channel": "/tmp/tty"}
    assert buses.can_args("socketcand:0.0.0.0:7") == {
        "interface": "socketcand", "channel": "can0", "host": "127.0.0.1", "port": 7}
    for bus in ("rs485:/tmp/arm", "rs485-tcp:29485"):  # python-can has no RS-485 bus
        with pytest.raises(lkemu.Error, match="docs/guides/buses.md"):
            buses.can_args(bus)


def test_interface_is_created_if_permitted(world, monkeypatch):
    world.update({"vcan0": False, "vcan1": True})
    monkeypatch.setattr(buses, "may_make_interfaces", lambda: True)
    assert buses.claim_free_bus()[::2] == ("vcan1", False)
    assert buses.claim_free_bus()[::2] == ("vcan2", True)
    assert buses.claim_free_bus()[::2] == ("vcan3", True)
    with pytest.raises(lkemu.StartError):
        buses.claim_free_bus(may_create=False)


def test_buses_of_an_answering_program_are_in_use(world, fake, tmp_path):
    world.update({"vcan0": True, "vcan1": True, "vcan2": True})
    control = buses.runtime_directory() + "/vcan0-1.sock"
    with lkemu.Emulator(bus={"vcan0": "1", "vcan1": "1"}, program=fake, arguments=[]) as emu:
        os.symlink(emu.control, control)
        assert buses.claim_free_bus().bus == "vcan2"
    assert buses.claim_free_bus().bus == "vcan0"  # the socket file still exists, but without a listener


def test_bus_stays_claimed_while_the_program_runs(world, fake):
    world.update({"vcan5": True})
    with lkemu.Emulator(program=fake) as emu:
        assert emu.bus == "vcan5"
        with pytest.raises(lkemu.StartError, match="1 of 1 in use"):
            lkemu.Emulator(program=fake).start()
    with lkemu.Emulator(program=fake) as emu:
        assert emu.bus == "vcan5"


def test_runtime_directory_must_be_private(world):
    directory = buses.runtime_directory()
    assert os.stat(directory).st_mode & 0o777 == 0o700
    assert os.listdir(directory) == []
    os.chmod(directory, 0o750)
    with pytest.raises(lkemu.StartError, match="is open to others: chmod 700 "):
        buses.runtime_directory()
    os.rmdir(directory)
    os.mkdir(directory + "-of-others", 0o700)
    os.symlink(directory + "-of-others", directory)
    with pytest.raises(lkemu.StartError, match="belongs to another user"):
        buses.runtime_directory()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root gives a directory away")
def test_root_refuses_a_directory_of_another_user(world):
    os.chown(buses.runtime_directory(), 65534, -1)
    with pytest.raises(lkemu.StartError, match="belongs to another user"):
        buses.runtime_directory()


# --- the command line ---


@pytest.mark.parametrize(
    "options, line",
    [
        ({}, "--bus vcan7 --ids 1-4"),
        ({"ids": [1, 3]}, "--bus vcan7 --ids 1,3"),
        ({"bus": "can0", "ids": 5}, "--bus can0 --ids 5"),
        ({"config": "a.toml"}, "--config a.toml"),
        ({"config": "a.toml", "bus": "free"}, "--bus vcan7 --config a.toml"),
        ({"bus": {"vcan0": "1-4", "vcan1": [9]}}, "--bus vcan0 --ids 1-4 --bus vcan1 --ids 9"),
        ({"clock": "stepped", "seed": 0, "bitrate": 0}, "--bus vcan7 --ids 1-4 --clock stepped --bitrate 0 --seed 0"),
        ({"motor": "mg4005", "arguments": ("--wipe-rom",)}, "--bus vcan7 --ids 1-4 --motor mg4005 --wipe-rom"),
        ({"generation": "seen"}, "--generation seen --bus vcan7 --ids 1-4"),
        ({"boot_angle_deg": 0.0}, "--bus vcan7 --ids 1-4 --boot-angle 0.0"),
        (
            {"quirks": {"pid_commands": True, "state_1": "centivolt", "reply_id_base": 0x180}},
            "--quirk pid_commands=true --quirk state_1=centivolt --quirk reply_id_base=384 --bus vcan7 --ids 1-4",
        ),
        ({"bus": "vcan3", "create_bus": True}, "--bus vcan3 --ids 1-4 --create-bus"),
    ],
)
def test_options_become_a_command_line(options, line):
    words = Options(**options).arguments_for("vcan7", create=False, control="C")
    assert " ".join(words) == "--control C --rom :memory: " + line


def test_conflicting_options_are_refused():
    with pytest.raises(ValueError, match="which bus"):
        Options(config="a.toml", ids="1").buses(None)
    with pytest.raises(ValueError, match="says it already"):
        Options(bus={"vcan0": 1}, ids="1").buses(None)


# --- the program ---


def test_named_program_takes_precedence(monkeypatch, fake):
    monkeypatch.setenv("LKEMU", "/bin/true")
    assert program.find_program(fake) == fake
    assert program.find_program() == "/bin/true"
    monkeypatch.setenv("LKEMU", "/nonexistent/lk-emu")
    with pytest.raises(lkemu.StartError, match="LKEMU: there is no program /nonexistent/lk-emu"):
        program.find_program()


def test_program_of_the_build_precedes_the_one_in_path(monkeypatch, fake, tmp_path):
    monkeypatch.delenv("LKEMU", raising=False)
    monkeypatch.setenv("PATH", os.path.dirname(fake))
    package = tmp_path / "python" / "lkemu"
    monkeypatch.setattr(program, "__file__", str(package / "program.py"))
    assert program.find_program() == fake
    built = tmp_path / "build" / "release" / "emulator" / "lk-emu"
    built.parent.mkdir(parents=True)
    os.symlink("/bin/true", built)
    assert program.find_program() == str(built)


def test_missing_program_is_reported(monkeypatch, tmp_path):
    monkeypatch.delenv("LKEMU", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(program, "__file__", str(tmp_path / "a" / "b" / "c.py"))
    with pytest.raises(lkemu.StartError, match="not in PATH: install it, set LKEMU"):
        program.find_program()
