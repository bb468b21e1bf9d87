"""A recording of the real lk-emu as MCAP: what the host heard, and what the manual reads in it."""

import json
import os
import sys

import can
import pytest

from lkemu import SteppedBus, mcap

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "../tests"))
from mcap_reader import Mcap  # noqa: E402

ROBOT = """
[[bus]]
interface = "vcan0"
[[bus.drive]]
id = 1
motor = "mf7015"
[[bus.drive]]
id = 2
motor = "mg4005"
generation = "v236"
"""


@pytest.fixture
def heard(lkemu_start, tmp_path):
    """The bus, and (drive, data) of each reply of two drives of different generations to both reads of the state; recorded in `recording`."""
    (tmp_path / "robot.toml").write_text(ROBOT)
    robot = lkemu_start(config=str(tmp_path / "robot.toml"), ids=None, clock="stepped", record=str(tmp_path / "recording"))
    replies = []
    with can.Bus(**robot.can_args) as wire:
        host = SteppedBus(wire, robot.clock)
        for n in range(100):
            id, command = 1 + n % 2, (0x9A, 0x9C)[n // 2 % 2]
            host.send(can.Message(arbitration_id=0x140 + id, data=[command] + [0] * 7, is_extended_id=False))
            replies.append((id, bytes(host.recv(1).data)))
    robot.mark("half-way")
    robot.stop()
    return robot.bus, replies


def test_each_drive_is_read_by_its_own_firmware(heard, tmp_path):
    bus, replies = heard
    mcap.main([str(tmp_path / "recording")])
    read = Mcap((tmp_path / "recording.mcap").read_bytes())
    assert read.complete
    frames = [json.loads(data) for _, data in read.of(f"/{bus}/frames")]
    assert [(one["id"] - 0x140, bytes(one["data"])) for one in frames if one["from"] == "drive"] == replies
    assert sum(one["from"] == "host" for one in frames) == len(replies)
    for id in (1, 2):
        values = [json.loads(data) for _, data in read.of(f"/{bus}/{id}")]
        data = [data for drive, data in replies if drive == id]
        assert len(values) == len(data) == 50
        for value, reply in zip(values, data):
            assert value["temperature_C"] == reply[1]
            if reply[0] == 0x9C:  # speed in DATA[4..5], dps, little-endian
                assert value["speed_dps"] == int.from_bytes(reply[4:6], "little", signed=True)
            elif id == 1:  # legacy: voltage in DATA[3..4], 0.1 V
                assert value["voltage_V"] == pytest.approx(int.from_bytes(reply[3:5], "little") / 10)
            else:  # v236: voltage in DATA[2..3], 0.01 V
                assert value["voltage_V"] == pytest.approx(int.from_bytes(reply[2:4], "little") / 100)
    directives = [json.loads(data) for _, data in read.of("/directives")]
    assert {"mark": "half-way"} in [one.get("directive") for one in directives] and directives[-1]["end"] is True
    assert json.loads(read.attachments["recording.json"])["replayable"] is True
