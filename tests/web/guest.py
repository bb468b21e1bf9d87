"""Inside with-vcan: lk-emu, and a host on vcan0 (on another bus where its name is said first) that does what it is told over TCP, line by line.

    python3 guest.py PORT LK-EMU ARGUMENT…

| line             | answer                                                                     |
|------------------|----------------------------------------------------------------------------|
| `141#9A0000…`    | the next frame with this identifier, or `none` when there is none in 0.5 s |
| `vcan1 141#9A00…`| the same on that bus                                                       |
| `move 1,2`       | these drives are kept busy from now on; `move` ends that                   |
| `stop`, `start`  | ends lk-emu, starts it again                                               |
| `rss`            | the memory that lk-emu has, kB                                             |
"""

import asyncio
import math
import socket
import struct
import subprocess
import sys
import time

FRAME = struct.Struct("=IB3x8s")
PATIENCE_S = 0.5
PERIOD_S = 0.01


def can_socket(bus="vcan0"):
    can = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    can.bind((bus,))
    return can


def position(drive, angle_deg, max_speed_dps=3000):
    return FRAME.pack(0x140 + drive, 8, struct.pack("<BxHi", 0xA4, max_speed_dps,
                                                    round(angle_deg * 100)))


class Guest:
    def __init__(self, program):
        self.program = program
        self.process = None
        self.moving = []

    async def start(self):
        self.process = subprocess.Popen(self.program, stdout=subprocess.PIPE)
        line = await asyncio.to_thread(self.process.stdout.readline)
        return line.decode().strip() or "lk-emu ended"

    def stop(self):
        self.process.terminate()
        self.process.stdout.read()
        return f"ended {self.process.wait()}"

    def ask(self, text):
        bus, _, frame = text.rpartition(" ")
        identifier, data = frame.split("#")
        data = bytes.fromhex(data)
        with can_socket(bus or "vcan0") as can:
            can.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER,
                           struct.pack("=II", int(identifier, 16), 0x7FF))
            can.settimeout(PATIENCE_S)
            can.send(FRAME.pack(int(identifier, 16), len(data), data.ljust(8, b"\0")))
            try:
                _, length, answer = FRAME.unpack(can.recv(16))
            except TimeoutError:
                return "none"
            return f"{identifier}#{answer[:length].hex().upper()}"

    async def move(self):
        """Sines for odd drives, steps for even ones; and what a host asks besides."""
        with can_socket() as can:
            can.setblocking(False)
            tick = 0
            while True:
                await asyncio.sleep(PERIOD_S)
                now = time.monotonic()
                for drive in self.moving:
                    angle = (90 * math.sin(now * (0.6 + 0.1 * drive)) if drive % 2
                             else math.copysign(60, math.sin(now * 1.5 + drive)))
                    try:
                        can.send(position(drive, angle))
                        if tick % 10 == drive % 10:
                            can.send(FRAME.pack(0x140 + drive, 8, b"\x9a".ljust(8, b"\0")))
                    except OSError:
                        pass  # the interface is full
                try:
                    while can.recv(16):
                        pass
                except BlockingIOError:
                    pass
                tick += 1

    async def answer(self, line):
        if line == "start":
            return await self.start()
        if line == "stop":
            return await asyncio.to_thread(self.stop)
        if line == "rss":
            with open(f"/proc/{self.process.pid}/status", encoding="ascii") as status:
                return next(row.split()[1] for row in status if row.startswith("VmRSS"))
        if line.startswith("move"):
            self.moving = [int(drive) for drive in line[4:].split(",") if drive.strip()]
            return "moving"
        return await asyncio.to_thread(self.ask, line)

    async def serve(self, reader, writer):
        while line := await reader.readline():
            writer.write((await self.answer(line.decode().strip()) + "\n").encode())
            await writer.drain()


async def main():
    guest = Guest(sys.argv[2:])
    server = await asyncio.start_server(guest.serve, "127.0.0.1", int(sys.argv[1]))
    print(await guest.start(), flush=True)
    mover = asyncio.create_task(guest.move())
    async with server:
        await mover


if __name__ == "__main__":
    asyncio.run(main())
