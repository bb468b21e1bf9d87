"""Tests Emulator, drives, faults and clock with a test double of lk-emu."""

import os
import signal
import subprocess
import sys

import lkemu
import pytest


@pytest.fixture
def emu(fake):
    with lkemu.Emulator(bus="vcan0", program=fake) as emulator:
        yield emulator


def sent(emu):
    """Returns the last directive received."""
    return emu.client.get("/directives")[-1]


def test_program_ends_with_the_with_block(fake):
    with lkemu.Emulator(bus="vcan0", ids=[1, 3], program=fake) as emu:
        directory = os.path.dirname(emu.control)
        assert emu.exit_status is None and os.path.exists(emu.control)
        assert [drive.id for drive in emu.drives] == [1, 3] and emu.bus == "vcan0"
    assert emu.exit_status == 0
    assert "lk-emu stopped after" in emu.output and "one line of its log" in emu.log
    assert not os.path.exists(directory)


def test_logs_are_kept_in_log_dir(fake, tmp_path):
    with lkemu.Emulator(bus="vcan0", program=fake, log_dir=tmp_path / "logs"):
        pass
    assert "ready" in (tmp_path / "logs" / "lk-emu.out").read_text()
    assert "log" in (tmp_path / "logs" / "lk-emu.err").read_text()


def test_failed_start_gives_the_reason(fake):
    with pytest.raises(lkemu.StartError, match=r"^lk-emu: --refuse: there is no such option$"):
        lkemu.Emulator(bus="vcan0", program=fake, arguments=["--refuse"]).start()


def test_start_times_out(fake):
    emulator = lkemu.Emulator(bus="vcan0", program=fake, arguments=["--never-ready"], start_timeout_s=0.2)
    with pytest.raises(lkemu.StartError, match="not ready within 0.2 s"):
        emulator.start()
    assert emulator.exit_status is not None


def test_stop_kills_a_program_that_ignores_sigterm(fake, monkeypatch):
    monkeypatch.setattr("lkemu.program.STOP_TIMEOUT_S", 0.2)
    with pytest.raises(lkemu.Ended, match="SIGKILL"):
        with lkemu.Emulator(bus="vcan0", program=fake, arguments=["--stubborn"]):
            pass


def test_unexpected_end_is_reported_with_the_last_log_lines(fake):
    with pytest.raises(lkemu.Ended, match="status 3(.|\n)*the fake was told so"):
        with lkemu.Emulator(bus="vcan0", program=fake) as emu:
            emu.mark("die")
    assert emu.died


def test_unexpected_end_names_the_signal(fake):
    with pytest.raises(lkemu.Ended, match="SIGSEGV"):
        with lkemu.Emulator(bus="vcan0", program=fake) as emu:
            os.kill(emu.pid, signal.SIGSEGV)
            while True:  # until the signal is delivered
                emu.status()


def test_unstopped_program_ends_at_exit(fake):
    script = f"import lkemu; print(lkemu.Emulator(bus='vcan0', program={fake!r}).start().pid)"
    pid = int(subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True).stdout)
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_equal_ids_on_two_buses_need_the_bus_name(fake):
    with lkemu.Emulator(bus={"vcan0": "1-2", "vcan1": "2,3"}, program=fake) as emu:
        assert emu.drives[3].bus == "vcan1" and emu.drive(2, "vcan1").bus == "vcan1"
        with pytest.raises(KeyError, match="vcan0 and vcan1"):
            emu.drives[2]
        with pytest.raises(KeyError, match="no drive 7"):
            emu.drives[7]


def test_advice_lists_mistakes_of_hosts(emu):
    assert [(one["kind"], one["drive"], one["count"]) for one in emu.advice()] == [("wrong-length", 1, 2)]


# --- directives ---


def test_directives_contain_only_given_values(emu):
    drive = emu.drives[2]
    drive.power.cycle(off_s=0.2)
    assert sent(emu) == {"bus": "vcan0", "ids": "2", "power": "cycle", "off_s": 0.2}
    drive.power.off(when={"command": 0xA4})
    assert sent(emu) == {"bus": "vcan0", "ids": "2", "power": "off", "when": {"command": 0xA4}}
    drive.supply(20, ramp_s=0.5)
    assert sent(emu) == {"bus": "vcan0", "ids": "2", "supply_V": 20, "ramp_s": 0.5}
    drive.sag(8, 0.1)
    assert sent(emu) == {"bus": "vcan0", "ids": "2", "sag_to_V": 8, "sag_s": 0.1}
    drive.ambient(0)  # zero must not be omitted
    assert sent(emu) == {"bus": "vcan0", "ids": "2", "ambient_C": 0}
    drive.load(J_g_cm2=900, at_s=2)
    assert sent(emu) == {"bus": "vcan0", "ids": "2", "load": {"J_g_cm2": 900}, "at_s": 2}
    drive.turn(-5)
    assert sent(emu) == {"bus": "vcan0", "ids": "2", "turn_deg": -5}
    drive.settings(max_speed_dps=90)
    assert sent(emu) == {"bus": "vcan0", "ids": "2", "settings": {"max_speed_dps": 90}}
    emu.targets().power.on()
    assert sent(emu) == {"bus": "vcan0", "ids": "1,2,3,4", "power": "on"}
    emu.mark("here")
    assert sent(emu) == {"bus": "vcan0", "mark": "here"}


def test_refusal_has_place_and_reason(emu):
    with pytest.raises(lkemu.Refused) as refused:
        emu.drives[1].supply(500)
    assert (refused.value.where, refused.value.reason, refused.value.status) == ("supply_V", "must be 0 to 100", 400)
    assert emu.status()["version"]  # and lk-emu still runs


def test_request_after_a_missing_answer_reconnects(emu):
    with pytest.raises(lkemu.Error, match="did not answer within 0.2 s"):
        emu.client.post("/directives", {"bus": "vcan0", "mark": "hang"}, timeout_s=0.2)
    with pytest.raises(lkemu.Error, match="POST /directives"):
        emu.mark("hangup")
    assert emu.status()["version"]


def test_bus_name_may_contain_slashes(fake):
    with lkemu.Emulator(bus="slcan-pty:/tmp/left leg", program=fake) as emu:
        assert emu.drives[1].view()["bus"] == "slcan-pty:/tmp/left leg"


def test_drive_readings_have_their_values(emu):
    drive = emu.drives[1]
    assert drive.telemetry("angle_deg") == 12.5
    assert drive.telemetry("angle_deg", "speed_dps") == {"angle_deg": 12.5, "speed_dps": drive.telemetry()["speed_dps"]}
    with pytest.raises(lkemu.Refused, match="signals: there is no signal 'speed', did you mean speed_dps?"):
        drive.telemetry("speed")
    assert (drive.state, drive.alive, drive.errors, drive.counters) == ("running", True, [], {"replies": 7})


def test_body_signals_have_their_values(emu):
    assert emu.body("body.trunk.z_m") == 0.37
    assert emu.body() == {"body.fallen": 0, "body.trunk.z_m": 0.37}
    with pytest.raises(lkemu.Refused, match="signals: there is no signal 'body.trunk.z', did you mean body.trunk.z_m?"):
        emu.body("body.trunk.z")


# --- faults ---


def test_faults_are_methods(emu):
    jam = emu.drives[2].jam(50, for_s=0.2, when={"signal": "speed_dps", "above": 100})
    assert sent(emu) == {
        "bus": "vcan0",
        "ids": "2",
        "fault": {"kind": "jam", "percent": 50, "for_s": 0.2},
        "when": {"signal": "speed_dps", "above": 100},
    }
    assert jam.name == "jam" and jam.fired and jam.evidence.effects == 4
    emu.drives[1].current_offset(0.5, "b", probability=0.25)
    assert sent(emu)["fault"] == {"kind": "current_offset", "offset_A": 0.5, "channel": "b", "probability": 0.25}
    jam.clear()
    assert sent(emu) == {"bus": "vcan0", "clear": "jam"} and jam.evidence.state == "cleared"
    emu.fault("silent")
    assert "ids" not in sent(emu)


def test_unknown_faults_are_refused(emu):
    with pytest.raises(AttributeError, match="did you mean jam"):
        emu.drives[1].jamm()
    with pytest.raises(TypeError, match="it has: percent"):
        emu.drives[1].jam(1, 2)
    assert "jam" in dir(emu.drives[1]) and "power" in dir(emu.drives[1])
    assert "clamped" in emu.drives[1].jam.__doc__


def test_fault_without_effect_is_reported(emu):
    emu.drives[1].jam()
    emu.drives[3].silent(optional=True)
    emu.check_faults()
    emu.drives[2].silent(name="quiet", when={"error": "stall"})
    with pytest.raises(lkemu.NoEffect) as problem:
        emu.check_faults()
    assert str(problem.value).startswith('fault silent "quiet" on drive 2 never took effect: ')
    assert "has not begun" in str(problem.value) and "drive 3" not in str(problem.value)


def test_evidence_of_faults_is_kept_after_stop(emu):
    emu.drives[1].jam()
    emu.stop()
    assert [str(fault) for fault in emu.faults()] == [
        "fault jam on drive 1 took effect 4 times, first at 0.000000 s on drive 2 (active)"
    ]
    assert not emu.died


# --- time ---


def test_stepped_clock_advances_on_request(fake):
    with lkemu.Emulator(bus="vcan0", program=fake, clock="stepped") as emu:
        assert emu.clock.mode == "stepped"
        assert emu.clock.advance("250ms") == 0.25 and emu.clock.advance(0.25) == 0.5
        assert emu.clock.advance_to(2) == 2 and emu.clock.time_s == 2
        emu.clock.mode = "x10"
        with pytest.raises(lkemu.Refused, match="runs by itself"):
            emu.clock.advance(1)


@pytest.mark.parametrize(
    "text, value_s", [("10ms", 0.01), ("2 s", 2), ("0.5", 0.5), (3, 3), ("20us", 2e-5), ("1.5min", 90)]
)
def test_durations(text, value_s):
    assert lkemu.clock.seconds(text) == pytest.approx(value_s, rel=1e-12)


@pytest.mark.parametrize("text", ["", "ms", "10 parsecs", "1.2.3s"])
def test_invalid_durations_are_refused(text):
    with pytest.raises(ValueError, match="is not a duration"):
        lkemu.clock.seconds(text)


# --- telemetry ---


def test_telemetry_yields_samples_until_the_stream_ends(emu):
    with emu.telemetry(["angle_deg", "speed_dps"], ids="1-2", rate_Hz=100) as stream:
        assert (stream.bus, stream.ids, stream.signals, stream.rate_Hz) == ("vcan0", [1, 2], ("angle_deg", "speed_dps"), 100)
        samples = list(stream)
    assert [sample.time_s for sample in samples] == [0, 0.01, 0.02]
    assert samples[2].drives == {1: {"angle_deg": 2, "speed_dps": 10}, 2: {"angle_deg": -2, "speed_dps": 20}}


def test_telemetry_includes_the_body(emu):
    with emu.telemetry(["angle_deg", "body.trunk.z_m"]) as stream:
        assert (stream.signals, stream.body) == (("angle_deg",), ("body.trunk.z_m",))
        samples = list(stream)
    assert samples[2].drives["body"] == {"body.trunk.z_m": 0.5}
    assert samples[2].drives[1] == {"angle_deg": 2}


def test_refused_telemetry_raises(emu):
    with pytest.raises(lkemu.Refused, match="signals: no signal"):
        emu.telemetry("nonsense")


def test_telemetry_without_samples_times_out(emu):
    stream = emu.telemetry("angle_deg", rate_Hz=1)
    assert [next(stream).time_s for _ in range(3)] == [0, 0.01, 0.02]
    stream._socket._sock.settimeout(0.1)  # shorter than the time limit so far
    with pytest.raises(lkemu.Error, match="no sample"):
        next(stream)
    stream.close()
