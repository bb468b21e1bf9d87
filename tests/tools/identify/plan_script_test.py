"""Tests the script of --plan against a simulated motor, without a bus and in simulated time."""

import re
import runpy
import struct
import subprocess
import sys
import tempfile
import types
import unittest
from pathlib import Path
from unittest import mock

LK_EMU = sys.argv.pop(1)


class Motor:
    """Answers 0x92, 0xA1, 0xA2, 0xA4, 0x9C and others like an MF drive. Time advances when the script sleeps."""

    def __init__(self, runs_away=False):
        self.now, self.speed_dps, self.angle_deg, self.sent, self.replies = 100.0, 0.0, 0.0, [], []
        self.runs_away = runs_away

    def send(self, message):
        data = bytes(message.data)
        self.sent.append(data)
        command = data[0]
        if command == 0xA1:
            iq = struct.unpack_from("<h", data, 4)[0]
            self.speed_dps = self.speed_dps + 4 * iq if iq else self.speed_dps * 0.5
        elif command == 0xA2:
            self.speed_dps = struct.unpack_from("<i", data, 4)[0] / 100
        elif command == 0xA4:
            target = struct.unpack_from("<i", data, 4)[0] / 100
            self.speed_dps, self.angle_deg = 0.0, target
        if self.runs_away and command in (0xA1, 0xA2):
            self.speed_dps = 3000.0
        if command == 0x92:
            self.replies.append(data[:1] + round(self.angle_deg * 100).to_bytes(7, "little", signed=True))
        elif command in (0x80, 0x81):
            self.speed_dps = 0.0
            self.replies.append(data)
        else:
            counts = round(self.angle_deg / 360 * 65536) % 65536
            self.replies.append(struct.pack("<BbhhH", command, 25, 0, int(self.speed_dps), counts))

    def recv(self, timeout):
        if not self.replies:
            self.now += timeout
            return None
        return types.SimpleNamespace(arbitration_id=0x141, data=self.replies.pop(0), is_error_frame=False)

    def sleep(self, seconds):
        self.now += seconds + 1e-6
        self.angle_deg += self.speed_dps * seconds

    def __enter__(self):
        return self

    def __exit__(self, *_):
        return False


class Rotor(Motor):
    """Accelerates like the bare rotor of an mg4005 without friction while a torque is commanded."""

    DPS_PER_A_S, A_PER_LSB = 250_000, 0.016

    def __init__(self):
        super().__init__()
        self.current, self.fastest_dps = 0.0, 0.0

    def send(self, message):
        speed, data = self.speed_dps, bytes(message.data)
        super().send(message)
        self.current = 0.0
        if data[0] == 0xA1:
            self.speed_dps, self.current = speed, struct.unpack_from("<h", data, 4)[0] * self.A_PER_LSB

    def sleep(self, seconds):
        self.now += seconds + 1e-6  # its angle does not matter
        friction = min(abs(self.speed_dps), 12_000 * seconds) if not self.current else 0
        self.speed_dps += self.current * self.DPS_PER_A_S * seconds - (friction if self.speed_dps > 0 else -friction)
        self.fastest_dps = max(self.fastest_dps, abs(self.speed_dps))


class Socket(Motor):
    """Bus that delivers own frames, with kernel time stamps."""

    def __init__(self, same_machine=False):
        super().__init__()
        self.echoes, self.same_machine = [], same_machine

    def send(self, message):
        super().send(message)
        self.echoes.append(bytes(message.data))

    def recv(self, timeout):
        if self.echoes:
            return types.SimpleNamespace(arbitration_id=0x141, data=self.echoes.pop(0), is_error_frame=False, is_rx=False,
                                         timestamp=self.now + 0.25)
        message = super().recv(timeout)
        if message is not None:
            message.is_rx, message.timestamp = not self.same_machine, self.now + 0.2503
        return message


class PlanScript(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.script = Path(self.folder.name) / "excite.py"
        subprocess.run([LK_EMU, "identify", "--plan", self.script, "--id", "1", "--motor", "mf7015"], check=True,
                       stdout=subprocess.DEVNULL)

    def run_script(self, motor, *options, answer=""):
        fake = types.ModuleType("can")
        fake.Message = lambda arbitration_id, data, is_extended_id: types.SimpleNamespace(data=data)
        fake.Bus = lambda **_: motor
        log = Path(self.folder.name) / "my.log"
        arguments = [str(self.script), "--log", str(log), *options]
        with mock.patch.dict(sys.modules, {"can": fake}), mock.patch("time.sleep", motor.sleep), \
                mock.patch("time.monotonic", lambda: motor.now), mock.patch("time.time", lambda: motor.now), \
                mock.patch.object(sys, "argv", arguments), mock.patch("sys.stdin.readline", lambda: answer), \
                mock.patch("sys.stderr"), mock.patch("sys.stdout"):
            runpy.run_path(str(self.script), run_name="__main__")
        return log.read_text()

    def test_runs_for_half_a_minute_and_logs_it(self):
        motor = Motor()
        log = self.run_script(motor, "--yes")
        self.assertAlmostEqual(motor.now - 100, 30, delta=3)
        self.assertIn(") can0 141#A1", log)
        self.assertEqual([motor.sent[-2][0], motor.sent[-1][0]], [0x81, 0x80])
        for command in (0x9A, 0xA1, 0xA2, 0xA4):
            self.assertTrue(any(data[0] == command for data in motor.sent), hex(command))

    def test_logs_the_stamps_of_the_kernel(self):
        for same_machine in (False, True):  # replies of an emulator on vcan are not marked as received
            with self.subTest(same_machine=same_machine):
                motor = Socket(same_machine)
                lines = self.run_script(motor, "--yes").splitlines()
                self.assertEqual(len(lines), 2 * (len(motor.sent) - len((0x81, 0x80))))
                self.assertEqual(lines[0], "(100.250000) can0 141#9200000000000000")
                self.assertEqual(lines[1].split()[0], "(100.250300)")

    def test_late_echo_is_not_a_reply(self):
        motor, late, kept = Socket(), [], []
        receive = motor.recv

        def recv(timeout):
            if late and len(motor.sent) > 300:
                return late.pop()
            message = receive(timeout)
            if len(motor.sent) == 300 and not kept and message is not None and not message.is_rx:
                kept.append(message)  # delivered after the next query
                late.append(message)
                return None
            return message

        motor.recv = recv
        lines = self.run_script(motor, "--yes").splitlines()
        self.assertEqual((len(kept), late), (1, []))
        self.assertEqual(len(lines), 2 * (len(motor.sent) - len((0x81, 0x80))))

    def test_stays_below_the_announced_speed(self):
        output = subprocess.run([LK_EMU, "identify", "--plan", self.script, "--id", "1", "--motor", "mg4005"], check=True,
                                capture_output=True, text=True).stdout
        most = float(re.search(r"and (\d+) dps at its rotor", output)[1])
        motor = Rotor()
        self.run_script(motor, "--yes")
        self.assertGreater(motor.fastest_dps, 0.5 * most)
        self.assertLessEqual(motor.fastest_dps, most)

    def test_does_not_move_without_confirmation(self):
        for answer in ("", "\n", "no\n"):
            motor = Motor()
            with self.assertRaisesRegex(SystemExit, "nothing was moved"):
                self.run_script(motor, answer=answer)
            self.assertEqual(motor.sent, [])

    def test_moves_after_confirmation(self):
        motor = Motor()
        self.run_script(motor, answer="y\n")
        self.assertTrue(motor.sent)

    def test_frees_a_shaft_that_runs_away(self):
        motor = Motor(runs_away=True)
        with self.assertRaisesRegex(SystemExit, "stopped"):
            self.run_script(motor, "--yes")
        self.assertEqual([motor.sent[-2][0], motor.sent[-1][0]], [0x81, 0x80])

    def test_late_reply_is_ignored(self):
        motor = Motor()
        motor.replies.append(bytes([0x9C, 25, 0, 0, 0xFF, 0x7F, 0, 0]))  # late reply to an earlier host
        self.run_script(motor, "--yes")
        self.assertTrue(any(data[0] == 0xA4 for data in motor.sent))

    def test_frees_the_shaft_after_send_errors(self):
        motor = Motor()
        send = motor.send

        def failing(message):
            if bytes(message.data)[0] == 0x81:
                raise OSError("no buffer space")
            if len(motor.sent) > 500 and bytes(message.data)[0] != 0x80:
                raise OSError("the bus is off")
            send(message)

        motor.send = failing
        with self.assertRaisesRegex(OSError, "the bus is off"):
            self.run_script(motor, "--yes")
        self.assertEqual(motor.sent[-1][0], 0x80)

    def test_quotes_the_motor_name(self):
        odd = Path(self.folder.name) / "a\"b.toml"
        odd.write_text('extends = "mf7015"\n')
        subprocess.run([LK_EMU, "identify", "--plan", self.script, "--id", "1", "--motor", odd], check=True,
                       stdout=subprocess.DEVNULL)
        self.run_script(Motor(), "--yes")

    def test_reports_a_missing_drive(self):
        motor = Motor()
        motor.send = lambda message: None
        with self.assertRaisesRegex(SystemExit, "drive 1 does not answer"):
            self.run_script(motor, "--yes")


if __name__ == "__main__":
    unittest.main()
