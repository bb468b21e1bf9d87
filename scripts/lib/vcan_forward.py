"""TCP connections carried over one line, for `with-vcan --forward`: `Outside` listens, `Inside` connects.

A frame is kind, connection, length and bytes; `OPEN` brings the port inside. Of each connection one piece is on its way in
either direction: the next is read when the other end has passed the last one on (`DONE`), so that a program that does not read
holds up nobody else. Inside answers every frame with `READ`, and outside sends nothing more before that: vcan_guest.pieces
tells what a line of user-mode Linux does otherwise.
"""

import collections
import errno
import os
import select
import socket

OPEN, DATA, DONE, END, BREAK, READ = b"odnebr"
HEAD = 7  # bytes: kind, connection, length
ADDRESS = "127.0.0.1"  # at both ends
CONNECTIONS = 250  # at a time; more wait in the kernel's queue
NO_ROOM = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)
FULL_MS = 1000  # without a connection that closes, until there may be room again


class Connection:
    def __init__(self, sock):
        sock.setblocking(False)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.socket = sock
        self.pending = b""  # for the socket
        self.under_way = False  # a piece that the other end has not passed on yet
        self.all_sent = self.all_received = False

    def reads(self):
        return not self.under_way and not self.all_sent

    def events(self):
        return (select.POLLIN if self.reads() else 0) | (select.POLLOUT if self.pending else 0)


class Tunnel:
    """What both ends have in common. `line` is a file descriptor; `piece` the largest number of bytes in a frame."""

    def __init__(self, line, piece):
        self.line, self.piece = line, piece
        self.received = b""
        self.connections = {}
        self.listeners = {}
        self.full = False  # the last accept() found no room, and who waits is told of over and over: listeners have to wait

    def send(self, kind, number, payload=b""):
        raise NotImplementedError

    def run(self):
        """Until the line ends."""
        try:
            while self.step():
                pass
        except ConnectionError:  # the line's: those of connections are looked after
            pass

    def step(self):
        poll = select.poll()
        poll.register(self.line, select.POLLIN)
        for fd in self.listeners if len(self.connections) < CONNECTIONS and not self.full else ():
            poll.register(fd, select.POLLIN)
        watched = {}
        for number, connection in self.connections.items():
            if events := connection.events():  # without any, poll() would tell of its end over and over
                watched[connection.socket.fileno()] = number, connection
                poll.register(connection.socket.fileno(), events)
        happened = poll.poll(FULL_MS if self.full else None)
        if not happened:
            self.full = False
        for fd, events in happened:
            if fd in watched:
                self.attend(*watched[fd], events)
            elif fd in self.listeners:
                self.accept(fd)
            else:
                data = os.read(self.line, 65536)
                if not data:
                    return False
                self.take(data)
        return True

    def accept(self, fd):
        raise NotImplementedError

    def take(self, data):
        """Bytes from the line."""
        self.received += data
        while len(self.received) >= HEAD:
            kind, number = self.received[0], int.from_bytes(self.received[1:5], "big")
            end = HEAD + int.from_bytes(self.received[5:HEAD], "big")
            if len(self.received) < end:
                return
            payload, self.received = self.received[HEAD:end], self.received[end:]
            self.on_frame(kind, number, payload)

    def on_frame(self, kind, number, payload):
        connection = self.connections.get(number)
        if connection is None:  # broken off here meanwhile
            return
        if kind == DATA:
            connection.pending = payload
            self.pass_on(number, connection)
        elif kind == DONE:
            connection.under_way = False
        elif kind == END:
            connection.all_received = True
            self.end_if_over(number, connection)
        elif kind == BREAK:
            self.close(number)

    def attend(self, number, connection, events):
        """poll() tells something of a connection."""
        if connection.pending and number in self.connections:
            self.pass_on(number, connection)
        if events & ~select.POLLOUT and connection.reads() and number in self.connections:
            self.read(number, connection)

    def read(self, number, connection):
        try:
            data = connection.socket.recv(self.piece)
        except BlockingIOError:
            return
        except OSError:
            self.break_off(number)
            return
        if data:
            connection.under_way = True
            self.send(DATA, number, data)
        else:
            connection.all_sent = True
            self.send(END, number)
            self.end_if_over(number, connection)

    def pass_on(self, number, connection):
        try:
            sent = connection.socket.send(connection.pending)
        except BlockingIOError:
            return
        except OSError:
            self.break_off(number)
            return
        connection.pending = connection.pending[sent:]
        if not connection.pending:
            self.send(DONE, number)

    def end_if_over(self, number, connection):
        """What one end will send no more, the other has been told of behind all that it sent."""
        if not connection.all_received:
            return
        if connection.all_sent:
            self.close(number)
            return
        try:
            connection.socket.shutdown(socket.SHUT_WR)
        except OSError:
            self.break_off(number)

    def break_off(self, number):
        self.send(BREAK, number)
        self.close(number)

    def close(self, number):
        self.connections.pop(number).socket.close()
        self.full = False


def write(line, kind, number, payload):
    data = bytes([kind]) + number.to_bytes(4, "big") + len(payload).to_bytes(2, "big") + payload
    while data:
        data = data[os.write(line, data) :]


class Inside(Tunnel):
    def __init__(self, line):
        super().__init__(line, 32768)

    def send(self, kind, number, payload=b""):
        write(self.line, kind, number, payload)

    def on_frame(self, kind, number, payload):
        self.send(READ, 0)
        if kind == OPEN:
            try:
                sock = socket.socket()
            except OSError:  # no more descriptors
                self.send(BREAK, number)
                return
            self.connections[number] = Connection(sock)
            sock.connect_ex((ADDRESS, int.from_bytes(payload, "big")))  # poll() tells how that ends
        else:
            super().on_frame(kind, number, payload)


class Outside(Tunnel):
    """`listeners`: sockets and the ports inside."""

    def __init__(self, line, listeners):
        super().__init__(line, 3000)
        self.listeners = {sock.fileno(): (port, sock) for sock, port in listeners}
        self.frames = collections.deque()  # that wait until the last one has been read
        self.unread = False
        self.last_number = 0

    def accept(self, fd):
        port, listener = self.listeners[fd]
        try:
            sock, _ = listener.accept()
        except OSError as problem:  # it went away while it waited, or there is no room for it
            self.full = problem.errno in NO_ROOM
            return
        self.last_number += 1
        self.send(OPEN, self.last_number, port.to_bytes(2, "big"))
        self.connections[self.last_number] = Connection(sock)

    def send(self, kind, number, payload=b""):
        self.frames.append((kind, number, payload))
        self.send_next()

    def send_next(self):
        if self.frames and not self.unread:
            self.unread = True
            write(self.line, *self.frames.popleft())

    def on_frame(self, kind, number, payload):
        if kind == READ:
            self.unread = False
            self.send_next()
        else:
            super().on_frame(kind, number, payload)


def listen(port):
    """Raises OSError."""
    sock = socket.socket()
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    sock.bind((ADDRESS, port))
    sock.listen(64)
    sock.setblocking(False)
    return sock
