"""TCP connections through a pipe: a browser outside reaches an emulator inside with-vcan.

User-mode Linux has no network, and a browser is too heavy for it; its standard streams are all
there is. Frames are: kind, connection, length, bytes.

    python3 tunnel.py PORT -- COMMAND…       runs COMMAND inside with-vcan, listens at PORT outside
"""

import asyncio
import os
import pathlib
import struct
import sys

HEAD = struct.Struct("!cII")
OPEN, DATA, CLOSE = b"o", b"d", b"c"
CHUNK = 32 * 1024
WITH_VCAN = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "with-vcan"


class Mux:
    """One end of the pipe. `on_open` is called with the number of a connection the other end opens."""

    def __init__(self, reader, writer, on_open=None):
        self.reader, self.writer, self.on_open = reader, writer, on_open
        self.streams = {}

    def send(self, kind, number, payload=b""):
        self.writer.write(HEAD.pack(kind, number, len(payload)) + payload)

    async def pump(self, number, reader):
        """Everything of one connection into the pipe."""
        try:
            while data := await reader.read(CHUNK):
                self.send(DATA, number, data)
                await self.writer.drain()
        except OSError:
            pass
        self.send(CLOSE, number)

    async def run(self):
        try:
            while True:
                kind, number, length = HEAD.unpack(await self.reader.readexactly(HEAD.size))
                payload = await self.reader.readexactly(length)
                if kind == OPEN:
                    await self.on_open(number)
                elif kind == CLOSE:
                    if stream := self.streams.pop(number, None):
                        stream.close()
                elif stream := self.streams.get(number):
                    stream.write(payload)
        except asyncio.IncompleteReadError:
            pass


async def pipes(fd_in, fd_out):
    loop = asyncio.get_running_loop()
    reader = asyncio.StreamReader()
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), os.fdopen(fd_in, "rb"))
    transport, protocol = await loop.connect_write_pipe(
        asyncio.streams.FlowControlMixin, os.fdopen(fd_out, "wb"))
    return reader, asyncio.StreamWriter(transport, protocol, None, loop)


async def guest(port, command):
    """Inside: the command, whose output goes to standard error, and the connections to it."""
    process = await asyncio.create_subprocess_exec(
        *command, stdin=asyncio.subprocess.DEVNULL, stdout=sys.stderr.fileno())
    mux = Mux(*await pipes(0, 1))

    async def on_open(number):
        try:
            reader, mux.streams[number] = await asyncio.open_connection("127.0.0.1", port)
            asyncio.create_task(mux.pump(number, reader))
        except OSError:
            mux.send(CLOSE, number)

    mux.on_open = on_open
    await asyncio.wait({asyncio.create_task(mux.run()), asyncio.create_task(process.wait())},
                       return_when=asyncio.FIRST_COMPLETED)
    if process.returncode is None:
        process.terminate()
        await process.wait()
    return process.returncode


async def host(port, command, ready=None):
    """Outside: with-vcan with the guest in it, and a listener."""
    process = await asyncio.create_subprocess_exec(
        str(WITH_VCAN), "python3", __file__, "--guest", str(port), "--", *command,
        stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE)
    mux = Mux(process.stdout, process.stdin)
    numbers = iter(range(1, 2**32))

    async def on_client(reader, writer):
        number = next(numbers)
        mux.streams[number] = writer
        mux.send(OPEN, number)
        await mux.pump(number, reader)

    server = await asyncio.start_server(on_client, "127.0.0.1", port)
    if ready:
        ready()
    try:
        await mux.run()
    finally:
        server.close()
        process.stdin.close()
    return await process.wait()


def main():
    words = sys.argv[1:]
    end = host
    if words[0] == "--guest":
        end = guest
        words = words[1:]
    port, dashes, *command = words
    assert dashes == "--"
    sys.exit(asyncio.run(end(int(port), command)))


if __name__ == "__main__":
    main()
