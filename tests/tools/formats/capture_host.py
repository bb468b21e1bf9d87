"""A host on slcan for several recorded runs of lk-emu. The recording marks this host's frames, which are the queries.
"""

import os
import socket
import subprocess
import tempfile

PATIENCE_S = 20.0
PLACE = (f"127.{64 + (os.getpid() >> 16)}.{os.getpid() >> 8 & 255}.{os.getpid() & 255}", 29536)  # unique to this process
BUS = "slcan-tcp:{}:{}".format(*PLACE)

ROBOTS = {
    # Drive 2 reports under-voltage from the start: its threshold exceeds the 24 V supply.
    "legacy": """
[[bus.drive]]
id = 1
[[bus.drive]]
id = 2
settings.protection.under_voltage = { enabled = true, threshold_V = 30, hysteresis_V = 1, delay_s = 0 }
[[bus.drive]]
id = 3
settings.broadcast_mode = true
""",
    "v236": """
[[bus.drive]]
id = 1
motor = "mg8016"
generation = "v236"
""",
    "apart": """
[[bus.drive]]
id = 1
quirks.reply_id_base = 0x180
""",
}

# Host frames of each run; drive 9 does not exist.
LEGACY = """
141#9A00000000000000 141#3000000000000000 141#3107060504030201 141#3300000000000000 141#3401020310270000
141#9000000000000000 141#91112233445566AA 141#9200000000000000 141#9400000000000000 141#9500000000000000
141#9B00000000000000 141#9C00000000000000 141#9D00000000000000 141#8800000000000000
141#A100000064000000 141#A2000000A08C0000 141#A200000060FAFFFF 141#A300000028230000 141#A4002C01D8DCFFFF
141#A501000050460000 141#A6012C0150460000 141#A7000000E8030000 141#A8002C0118FCFFFF 141#8100000000000000
141#8100000000000000 141#8000000000000000 142#9A00000000000000 149#9C00000000000000 280#64000000C8000000
141#1900000000000000 141#9C00000000000000
""".split()
V236 = """
141#9A00000000000000 141#9200000000000000 141#9400000000000000 141#8C01000000000000 141#8C10000000000000
141#C00A000000000000 141#C020000000000000 141#C120000000E1F505 141#C01E000000000000 141#9500000010270000
141#9200000000000000 141#A2006400A08C0000 141#9C00000000000000 141#9D00000000000000 141#3000000000000000
""".split()
APART = "141#9A00000000000000 141#8000000000000000 141#8000000000000000".split()

# Queries without a reply: an absent drive, and a command that the generation lacks.
SILENT = {"149#9C00000000000000", "141#3000000000000000@v236"}


class Host:
    def __init__(self):
        self.socket = socket.create_connection(PLACE, PATIENCE_S)
        self.lines = self.socket.makefile("rb")
        self.socket.sendall(b"O\r")

    def send(self, text):
        identifier, data = text.split("#")
        self.socket.sendall(f"t{identifier}8{data}\r".encode())

    def receive(self):
        """Receives until a frame arrives; skips acknowledgements before it."""
        line = b""
        while not (line.startswith(b"t") and line.endswith(b"\r")):
            byte = self.lines.read(1)
            assert byte, "lk-emu has gone"
            line = byte if line.endswith(b"\r") else line + byte


def frames_of(log):
    """Returns time, sender and text of each frame of a recording."""
    frames = []
    for line in log.splitlines():
        at, _, frame, mark = line.split()
        frames.append([float(at.strip("()")), {"T": "query", "R": "reply"}[mark], frame])
    return frames


def run(program, name, queries):
    with tempfile.TemporaryDirectory() as scratch:
        config, recording = f"{scratch}/{name}.toml", f"{scratch}/recording"
        with open(config, "w", encoding="utf-8") as file:
            file.write(f'[[bus]]\ninterface = "{BUS}"\n' + ROBOTS[name])
        emulator = subprocess.Popen([program, "--config", config, "--rom", ":memory:", "--control", "none", "--record", recording],
                                    stdout=subprocess.PIPE, text=True)
        try:
            assert emulator.stdout.readline().startswith(f"lk-emu ready {BUS}:")
            host = Host()
            for query in queries:
                host.send(query)
                if query not in SILENT and f"{query}@{name}" not in SILENT:
                    host.receive()
        finally:
            emulator.terminate()
            emulator.communicate()
        with open(f"{recording}/frames.log", encoding="ascii") as file:
            return frames_of(file.read())


def runs(program):
    return {name: run(program, name, queries) for name, queries in (("legacy", LEGACY), ("v236", V236), ("apart", APART))}
