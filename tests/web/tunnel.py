"""TCP connections through a pipe: a browser outside reaches an emulator inside with-vcan.

User-mode Linux has no network, and a browser is too heavy for it; its standard streams are all
there is. What goes through them: kind, connection, length, bytes.

    python3 tunnel.py PORT[,PORT…] -- COMMAND…

runs COMMAND inside with-vcan and listens outside at the ports at which it listens inside.
"""

import asyncio
import os
import pathlib
import struct
import sys

HEAD = struct.Struct("!cII")
PORT = struct.Struct("!H")
OPEN, DATA, CLOSE = b"o", b"d", b"c"
CHUNK = 32 * 1024
WITH_VCAN = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "with-vcan"


class Mux:
    """One end of the pipe, and the connections that end there."""

    def __init__(self, reader, writer):
        self.reader, self.writer = reader, writer
        self.connections = {}

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

    async def open(self, number, port):
        try:
            reader, self.connections[number] = await asyncio.open_connection("127.0.0.1", port)
            asyncio.create_task(self.pump(number, reader))
        except OSError:
            self.send(CLOSE, number)

    async def run(self):
        try:
            while True:
                kind, number, length = HEAD.unpack(await self.reader.readexactly(HEAD.size))
                payload = await self.reader.readexactly(length)
                if kind == OPEN:
                    await self.open(number, *PORT.unpack(payload))
                elif kind == CLOSE:
                    if connection := self.connections.pop(number, None):
                        connection.close()
                elif connection := self.connections.get(number):
                    connection.write(payload)
        except asyncio.IncompleteReadError:
            pass


async def standard_streams():
    loop = asyncio.get_running_loop()
    reader = asyncio.StreamReader()
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), os.fdopen(0, "rb"))
    transport, protocol = await loop.connect_write_pipe(asyncio.streams.FlowControlMixin,
                                                        os.fdopen(1, "wb"))
    return reader, asyncio.StreamWriter(transport, protocol, None, loop)


async def guest(command):
    """Inside: the command, whose output goes to standard error, and the connections to it."""
    process = await asyncio.create_subprocess_exec(
        *command, stdin=asyncio.subprocess.DEVNULL, stdout=sys.stderr.fileno())
    mux = Mux(*await standard_streams())
    await asyncio.wait({asyncio.create_task(mux.run()), asyncio.create_task(process.wait())},
                       return_when=asyncio.FIRST_COMPLETED)
    if process.returncode is None:
        process.terminate()
        await process.wait()
    return process.returncode


async def host(ports, command):
    """Outside: with-vcan with the guest in it, and listeners."""
    process = await asyncio.create_subprocess_exec(
        str(WITH_VCAN), "/usr/bin/python3", __file__, "--guest", "--", *command,
        stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE)
    mux = Mux(process.stdout, process.stdin)
    numbers = iter(range(1, 2**32))

    def listener(port):
        async def on_client(reader, writer):
            number = next(numbers)
            mux.connections[number] = writer
            mux.send(OPEN, number, PORT.pack(port))
            await mux.pump(number, reader)
        return asyncio.start_server(on_client, "127.0.0.1", port)

    servers = [await listener(port) for port in ports]
    try:
        await mux.run()
    finally:
        for server in servers:
            server.close()
        process.stdin.close()
    return await process.wait()


def main():
    where, dashes, *command = sys.argv[1:]
    assert dashes == "--", __doc__
    if where == "--guest":
        sys.exit(asyncio.run(guest(command)))
    sys.exit(asyncio.run(host([int(port) for port in where.split(",")], command)))


if __name__ == "__main__":
    main()
