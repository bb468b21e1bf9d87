"""Tests Debian's pyserial as a host of lk-emu on RS-485; it opens the port as hosts of real drives do. Needs no CAN
bus. Prints transactions per second for information only.

usage: pyserial_hosts.py LK_EMU
"""

import errno
import fcntl
import os
import select
import subprocess
import termios
import time
import tty
import unittest

import serial

from support import PATIENCE_S, PROGRAM, TestCase, emulator


def packet(command: int, drive: int, data: bytes = b"") -> bytes:
    """Returns `3E CMD ID LEN HSUM data DSUM`."""
    header = bytes([0x3E, command, drive, len(data)])
    frame = header + bytes([sum(header) & 0xFF])
    return frame + data + bytes([sum(data) & 0xFF]) if data else frame


def read_packet(port: serial.Serial) -> bytes:
    """Returns a complete packet; b"" if none begins in time. Fails on a wrong checksum."""
    header = port.read(5)
    if len(header) < 5:
        return b""
    assert header[0] == 0x3E and sum(header[:4]) & 0xFF == header[4], header.hex(" ")
    if header[3] == 0:
        return header
    rest = port.read(header[3] + 1)
    assert sum(rest[:-1]) & 0xFF == rest[-1], (header + rest).hex(" ")
    return header + rest


def ask(port: serial.Serial, command: int, drive: int, data: bytes = b"") -> bytes:
    port.write(packet(command, drive, data))
    return read_packet(port)


class Rs485(TestCase):
    def setUp(self):
        super().setUp()
        self.link = os.path.join(self.directory, "arm")
        self.bus = "rs485:" + self.link

    def open(self, baud: int, path: str = "") -> serial.Serial:
        port = serial.Serial(path or self.link, baud, timeout=2)
        self.addCleanup(port.close)
        return port

    def test_a_host_talks_to_two_drives(self):
        with emulator("--bus", self.bus, "--ids", "1-2", "--baud", "1000000",
                      "--generation", "v236") as running:
            self.assertEqual(running.ready, f"lk-emu ready {self.bus}:1-2")
            port = self.open(1_000_000)
            for drive in (1, 2):
                state = ask(port, 0x9A, drive)
                self.assertEqual(state[:4], bytes([0x3E, 0x9A, drive, 7]))
                self.assertEqual(ask(port, 0x88, drive), packet(0x88, drive))
                speed = ask(port, 0xA2, drive, (36000).to_bytes(4, "little"))
                self.assertEqual(speed[:4], bytes([0x3E, 0xA2, drive, 7]))
            # The motor turns: the encoder value of state 2 changes.
            places = {ask(port, 0x9C, 1)[10:12] for _ in range(20)}
            self.assertGreater(len(places), 5)
            summary = running.stop()
            self.assertIn("26 queries, 26 replies", summary)
        self.assertFalse(os.path.lexists(self.link), "the link is gone with the program")

    def test_hosts_reconnect_and_noise_has_no_effect(self):
        with emulator("--bus", self.bus, "--ids", "1", "--baud", "2000000"):
            for _ in range(3):
                with serial.Serial(self.link, 2_000_000, timeout=2) as port:
                    self.assertEqual(len(ask(port, 0x9C, 1)), 13)
            port = self.open(2_000_000)
            noise = bytes((n * 37 + n // 251) & 0xFF for n in range(100_000))
            for _ in range(100):  # 10 MB
                port.write(noise)
            deadline = time.monotonic() + PATIENCE_S
            answer = b""
            while len(answer) != 13 and time.monotonic() < deadline:
                port.reset_input_buffer()
                port.write(packet(0x9C, 1))
                answer = port.read(13)  # spoiled while there is noise on the wire
            self.assertEqual(answer[:4], bytes([0x3E, 0x9C, 1, 7]))

    def test_terminal_with_icrnl_changes_carriage_returns(self):
        with emulator("--bus", self.bus, "--ids", "1", "--baud", "1000000"):
            port = self.open(1_000_000)
            attributes = termios.tcgetattr(port.fd)
            # ID 1, gains of the angle loop 13: 0x0D arrives as 0x0A if ICRNL is set.
            gains = bytes([13, 100, 50, 40, 50, 50])
            self.assertEqual(ask(port, 0x31, 1, gains), packet(0x31, 1, gains))
            attributes[0] |= termios.ICRNL
            termios.tcsetattr(port.fd, termios.TCSANOW, attributes)
            port.write(packet(0x30, 1))
            self.assertEqual(port.read(12)[5], 0x0A)

    def test_fresh_terminal_has_default_settings(self):
        with emulator("--bus", self.bus, "--ids", "1", "--baud", "1000000"):
            fd = os.open(self.link, os.O_RDWR | os.O_NOCTTY)
            self.addCleanup(os.close, fd)
            iflag, oflag, _, lflag = termios.tcgetattr(fd)[:4]
            self.assertTrue(iflag & termios.ICRNL and iflag & termios.IXON)
            self.assertTrue(oflag & termios.OPOST)
            self.assertTrue(lflag & termios.ECHO and lflag & termios.ICANON)

    def test_wrong_rate_gets_no_reply(self):
        with emulator("--bus", self.bus, "--ids", "1", "--baud", "1000000") as running:
            port = serial.Serial(self.link, 115_200, timeout=0.3)
            self.addCleanup(port.close)
            self.assertEqual(ask(port, 0x9C, 1), b"")
            port.baudrate = 1_000_000
            port.timeout = 2
            deadline = time.monotonic() + PATIENCE_S
            answer = b""
            while len(answer) != 13 and time.monotonic() < deadline:
                port.write(packet(0x9C, 1))
                answer = port.read(13)
            self.assertEqual(len(answer), 13)
            running.stop()
            self.assertIn("the host is at 115200 bit/s and the drives are at 1000000", running.errors)

    def test_wrong_stop_bits_or_parity_get_no_reply(self):
        for settings, words in (({"stopbits": 2}, "two stop bits"), ({"parity": "O"}, "odd parity")):
            with emulator("--bus", self.bus, "--ids", "1", "--baud", "1000000") as running:
                port = self.open(1_000_000)
                port.timeout = 0.2
                port.apply_settings(settings)
                self.assertEqual(ask(port, 0x9C, 1), b"")
                port.apply_settings({"stopbits": 1, "parity": "N"})
                port.timeout = PATIENCE_S
                self.assertEqual(len(ask(port, 0x9C, 1)), 13)
                port.close()
                running.stop()
                self.assertIn(f"the host has {words}", running.errors)

    def test_new_host_does_not_read_bytes_of_the_last_one(self):
        with emulator("--bus", self.bus, "--ids", "1", "--baud", "1000000"):
            for _ in range(6):
                port = os.open(self.link, os.O_RDWR | os.O_NOCTTY)
                tty.setraw(port, termios.TCSANOW)  # like a host in C that discards nothing
                attributes = termios.tcgetattr(port)
                attributes[4] = attributes[5] = termios.B1000000
                termios.tcsetattr(port, termios.TCSANOW, attributes)
                os.write(port, packet(0x9C, 1))
                readable, _, _ = select.select([port], [], [], PATIENCE_S)
                self.assertTrue(readable)
                self.assertEqual(os.read(port, 4), bytes([0x3E, 0x9C, 1, 7]))
                os.close(port)  # with nine unread bytes of the reply
                time.sleep(0.05)

    def open_when_free(self, baud):
        """Opens the port. After one host has left, the program admits the next after a short time; root always."""
        deadline = time.monotonic() + PATIENCE_S
        while True:
            try:
                return self.open(baud)
            except serial.SerialException as problem:
                if problem.errno != errno.EBUSY or time.monotonic() > deadline:
                    raise

    def test_exclusive_host_frees_the_port_when_it_closes(self):
        with emulator("--bus", self.bus, "--ids", "1", "--baud", "1000000"):
            for _ in range(3):
                port = self.open_when_free(1_000_000)
                fcntl.ioctl(port.fd, termios.TIOCEXCL)  # as libserialport does
                self.assertEqual(len(ask(port, 0x9C, 1)), 13)
                port.close()

    def test_noise_of_a_closed_host_does_not_occupy_the_line(self):
        with emulator("--bus", self.bus, "--ids", "1", "--baud", "9600") as running:  # 1 MB takes 1042 s
            with serial.Serial(self.link, 9600) as noisy:
                noisy.write(bytes([0x55]) * 1_000_000)
            port = self.open(9600)
            begin = time.monotonic()
            answer = b""
            while answer[:4] != bytes([0x3E, 0x9C, 1, 7]):
                self.assertLess(time.monotonic() - begin, PATIENCE_S)
                port.reset_input_buffer()
                port.timeout = 0.1
                port.write(packet(0x9C, 1))
                answer = port.read(13)
            running.stop()

    def test_without_a_rate_any_host_rate_works(self):
        with emulator("--bus", self.bus, "--ids", "1", "--baud", "0"):
            for baud in (9600, 4_000_000):
                self.assertEqual(len(ask(self.open(baud), 0x9C, 1)), 13)

    def test_twelve_drives_on_four_buses_answer_all_queries(self):
        paths = [os.path.join(self.directory, f"leg{n}") for n in range(4)]
        arguments = []
        for path in paths:
            arguments += ["--bus", "rs485:" + path, "--ids", "1-3"]
        with emulator(*arguments, "--baud", "2000000", "--motor", "mg4005") as running:
            ports = [self.open(2_000_000, path) for path in paths]
            cycles = 200
            begin = time.monotonic()
            for _ in range(cycles):
                for drive in (1, 2, 3):
                    for port in ports:
                        port.write(packet(0xA1, drive, (20).to_bytes(2, "little")))
                    for port in ports:
                        answer = read_packet(port)
                        self.assertEqual(answer[:4], bytes([0x3E, 0xA1, drive, 7]))
            rate = cycles / (time.monotonic() - begin)
            print(f"12 drives on four buses at 2 Mbit/s: {rate:.0f} cycles a second", flush=True)
            summary = running.stop()
            self.assertEqual(summary.count(f"{3 * cycles} queries, {3 * cycles} replies"), 4, summary)

    def test_serial_port_is_used_directly(self):
        wire, port = os.openpty()  # the emulator's port, and the other end of its line
        self.addCleanup(os.close, wire)
        self.addCleanup(os.close, port)
        with emulator("--bus", "rs485:" + os.ttyname(port), "--ids", "1", "--baud", "1000000"):
            iflag, oflag, _, lflag = termios.tcgetattr(port)[:4]
            self.assertEqual((iflag, oflag, lflag), (0, 0, 0))
            os.write(wire, packet(0x9C, 1))
            answer = b""
            while len(answer) < 13 and select.select([wire], [], [], PATIENCE_S)[0]:
                answer += os.read(wire, 64)
            self.assertEqual((len(answer), answer[:4]), (13, bytes([0x3E, 0x9C, 1, 7])))
        self.assertTrue(os.path.exists(os.ttyname(port)))

    def lk_emu(self, *arguments: str) -> str:
        done = subprocess.run([PROGRAM, *arguments], capture_output=True, text=True,
                              timeout=PATIENCE_S, check=False)
        self.assertEqual(done.returncode, 0, done)
        return done.stdout

    def test_recording_can_be_replayed_and_decoded(self):
        recording = os.path.join(self.directory, "recording")
        with emulator("--bus", self.bus, "--ids", "1-2", "--baud", "1000000", "--generation", "v235",
                      "--record", recording) as running:
            port = self.open(1_000_000)
            for drive in (1, 2):
                ask(port, 0xA4, drive, (18000).to_bytes(8, "little") + (36000).to_bytes(4, "little"))
                for _ in range(20):
                    ask(port, 0x9C, drive)
            port.write(packet(0x9A, 1)[:2])  # a packet in pieces, and garbage
            port.write(packet(0x9A, 1)[2:])
            self.assertEqual(len(read_packet(port)), 13)
            port.write(b"\x00\xff")
            ask(port, 0x12, 2)
            running.stop()
        with open(os.path.join(recording, "frames.log"), encoding="ascii") as file:
            log = file.read()
        self.assertIn(f" {self.bus} rs485#3E12020052 T\n", log)
        self.assertIn("identical", self.lk_emu("replay", recording))
        words = self.lk_emu("decode", os.path.join(recording, "frames.log"), "--generation", "v235")
        self.assertIn("position 2, multi-turn, max speed", words)
        self.assertIn("angle 180", words)
        self.assertIn("read product info", words)

    def test_scenario_sends_on_can_and_rs485(self):
        scenario = os.path.join(self.directory, "both.toml")
        with open(scenario, "w", encoding="ascii") as file:
            file.write(f"""
about = "One arm on CAN, one on RS-485: the same words move both."
robot = "robot.toml"
duration_s = 1

[[send]]
bus = "vcan0"
at_s = 0.1
id = 1
command = "speed"
speed_dps = 90

[[send]]
bus = "{self.bus}"
at_s = 0.1
id = 1
command = "speed"
speed_dps = 90

[[send]]
bus = "{self.bus}"
at_s = 0.9
frame = "rs485#3E9C0100DB"

[[expect]]
says = "it turns"
bus = "vcan0"
id = 1
signal = "true_speed_dps"
at_s = 0.8
min = 20
max = 200

[[expect]]
says = "and so does the other"
bus = "{self.bus}"
id = 1
signal = "true_speed_dps"
at_s = 0.8
min = 20
max = 200

[[expect]]
says = "which answers"
bus = "{self.bus}"
id = 1
reply = {{ command = "state_2", count = 1 }}
""")
        with open(os.path.join(self.directory, "robot.toml"), "w", encoding="ascii") as file:
            file.write(f"""
[[bus]]
interface = "vcan0"
[[bus.drive]]
id = 1
quirks = {{ current_loop = "fast" }}

[[bus]]
interface = "{self.bus}"
[[bus.drive]]
id = 1
quirks = {{ current_loop = "fast" }}
""")
        self.assertIn("passed", self.lk_emu("run", scenario))
        self.assertFalse(os.path.lexists(self.link), "a run makes no terminal")

    # Hosts modelled on published ones for real drives (docs/start/which-drive.md).

    def test_all_line_faults_at_once_do_not_end_the_program(self):
        robot = os.path.join(self.directory, "robot.toml")
        kinds = ("echo", "cr_to_lf", "late_release", "checksum_bad", "byte_lost", "byte_gap",
                 "torn_reply", "duplicate_id", "no_termination", "babbling", "boot_garbage",
                 "wrong_id", "wrong_dlc", "corrupt", "reorder", "adapter_overrun",
                 "adapter_batch")
        whole = ("echo", "cr_to_lf", "late_release", "no_termination", "adapter_overrun", "adapter_batch")
        with open(robot, "w", encoding="ascii") as file:
            file.write(f'[[bus]]\ninterface = "{self.bus}"\nbitrate = 1000000\n'
                       '[[bus.drive]]\nids = "1-2"\n')
            for kind in kinds:
                drives = "" if kind in whole else 'ids = "1-2"\n'
                file.write(f'[[bus.event]]\nat_s = 0\n{drives}fault = "{kind}"\n')
        with emulator("--config", robot) as running:
            port = self.open(1_000_000)
            port.timeout = 0.005
            for n in range(200):
                port.write(packet(0x9C, 1 + n % 3))  # the third drive is absent
                try:
                    port.read(30)
                except serial.SerialException as problem:  # raised by pyserial when a read finds no data
                    self.assertIn("returned no data", str(problem))
            self.assertIsNone(running.process.poll())
            running.stop()

    def test_icrnl_of_a_host_is_reported(self):
        with emulator("--bus", self.bus, "--ids", "1", "--baud", "1000000") as running:
            port = self.open(1_000_000)
            attributes = termios.tcgetattr(port.fd)
            attributes[0] |= termios.ICRNL
            termios.tcsetattr(port.fd, termios.TCSANOW, attributes)
            gains = bytes([13, 100, 50, 40, 50, 50])
            port.write(packet(0x31, 1, gains))
            answer = port.read(12)
            self.assertEqual(answer[5:11], bytes([10]) + gains[1:])
            self.assertNotEqual(sum(answer[5:11]) & 0xFF, answer[11])
            running.stop()
        self.assertIn("tty-not-raw: ICRNL is set", running.errors)
        self.assertEqual(running.errors.count("tty-not-raw: "), 2)  # on opening and at the end

    def test_raw_port_is_not_reported(self):
        with emulator("--bus", self.bus, "--ids", "1", "--baud", "1000000") as running:
            port = self.open(1_000_000)
            for _ in range(50):
                self.assertEqual(len(ask(port, 0x9C, 1)), 13)
            running.stop()
        for kind in ("tty-not-raw", "talks-over-reply", "can-padding"):
            self.assertNotIn(kind, running.errors)

    def test_host_of_the_oldest_manual_reads_the_voltage(self):
        with emulator("--bus", self.bus, "--ids", "1"):
            port = self.open(115_200)
            port.write(packet(0x9A, 1))
            data = port.read(13)[5:12]
            self.assertEqual(len(data), 7)
            volts = int.from_bytes(data[2:4], "little") / 10
            self.assertTrue(20 < volts < 30, volts)  # the supply is 24 V

    def test_host_that_skips_motion_replies_is_reported(self):
        with emulator("--bus", self.bus, "--ids", "1", "--baud", "460800",
                      "--generation", "v235") as running:
            port = self.open(460_800)
            for n in range(20):
                port.write(packet(0xA1, 1, n.to_bytes(2, "little")))
                port.write(packet(0xA2, 1, (100 * n).to_bytes(4, "little")))
                port.reset_input_buffer()
                time.sleep(0.02)  # period of the host
            running.stop()
        self.assertIn("talks-over-reply: ", running.errors)

    def test_connect_sequence_of_the_pc_tool_is_answered(self):
        with emulator("--bus", self.bus, "--ids", "1", "--motor", "mg5010", "--generation", "v235"):
            port = self.open(115_200)
            lengths = [len(ask(port, command, 1)) for command in (0x1F, 0x12, 0x16, 0x14, 0x10)]
            self.assertEqual(lengths, [8, 64, 6 + 108, 6 + 104, 5])

    def test_can_payload_lengths_are_reported(self):
        with emulator("--bus", self.bus, "--ids", "1", "--baud", "2000000", "--generation", "v236",
                      "--motor", "mg4005") as running:
            port = self.open(2_000_000)
            port.timeout = 0.1
            self.assertEqual(ask(port, 0x8C, 1, bytes([0x10, 0, 0, 0, 0, 0, 0])), b"")
            self.assertEqual(ask(port, 0x95, 1), packet(0x95, 1))
            running.stop()
        self.assertIn("can-padding: 0x8C with LEN 7", running.errors)
        self.assertIn("zero-without-payload: ", running.errors)

    def test_three_drives_behind_a_ch348_answer_all_queries(self):
        robot = os.path.join(self.directory, "robot.toml")
        for adapter in ("none", "ch348"):
            with open(robot, "w", encoding="ascii") as file:
                file.write(f'[[bus]]\ninterface = "{self.bus}"\nbitrate = 2000000\n'
                           f'adapter = "{adapter}"\n[[bus.drive]]\nids = "1-3"\nmotor = "mg4005"\n')
            with emulator("--config", robot):
                port = self.open(2_000_000)
                cycles = 200
                begin = time.monotonic()
                for _ in range(cycles):
                    for drive in (1, 2, 3):
                        self.assertEqual(len(ask(port, 0x9C, drive)), 13)
                rate = cycles / (time.monotonic() - begin)
                print(f"three drives at 2 Mbit/s, adapter {adapter}: {rate:.0f} cycles a second",
                      flush=True)
                port.close()

    def test_invalid_buses_are_refused_with_the_reason(self):
        with open(self.link, "w", encoding="ascii") as file:
            file.write("mine")
        self.assertIn("already exists", self.refused("--bus", self.bus, "--ids", "1"))
        with open(self.link, encoding="ascii") as file:
            self.assertEqual(file.read(), "mine")
        self.assertIn("is not a bit rate of RS-485 drives",
                      self.refused("--bus", self.bus, "--ids", "1", "--baud", "500000"))
        self.assertIn("needs a path", self.refused("--bus", "rs485:", "--ids", "1"))
        robot = os.path.join(self.directory, "robot.toml")
        with open(robot, "w", encoding="ascii") as file:
            file.write('[[bus]]\ninterface = "rs485:/tmp/x"\nbitrate = 460800\n'
                       "[[bus.drive]]\nid = 1\nsettings.broadcast_mode = true\n")
        self.assertIn("needs 1, 2 or 4 Mbit/s", self.refused("--config", robot, "--check"))

    def test_second_program_on_a_path_is_refused(self):
        with emulator("--bus", self.bus, "--ids", "1"):
            self.assertNotEqual(self.refused("--bus", self.bus, "--ids", "1"), "")
            self.assertTrue(os.path.islink(self.link))

    def test_link_left_by_a_killed_program_is_replaced(self):
        with emulator("--bus", self.bus, "--ids", "1") as running:
            running.process.kill()
            running.process.communicate()
        self.assertTrue(os.path.islink(self.link))
        with emulator("--bus", self.bus, "--ids", "1", "--baud", "1000000"):
            self.assertEqual(len(ask(self.open(1_000_000), 0x9C, 1)), 13)

    def test_ms4015_identifies_itself_as_in_the_log(self):
        with emulator("--bus", self.bus, "--ids", "1", "--baud", "1000000", "--motor", "ms4015",
                      "--generation", "seen"):
            answer = ask(self.open(1_000_000), 0x12, 1)
            log = ("3E 12 01 3A 8B 44 53 34 30 52 37" + " 00" * 14 + " 4D 53 34 30 31 35" +
                   " 00" * 14 + " 35 37 35 30 30 32 73 18 78 03 4A 4B 2C 01 C8 00 EB 00 9C")
            self.assertEqual(answer.hex(" ").upper(), log)


if __name__ == "__main__":
    unittest.main()
