"""Forwards the control requests of a stepped host to lk-emu, until the simulated time limit of the host."""

from __future__ import annotations

import re
import socket
from selectors import EVENT_READ, BaseSelector
from typing import Callable

TIME = re.compile(rb'"time_s": ?([0-9.e+-]+)')


class Relay:
    """Calls `before_request` before it forwards a request, which may advance the clock.

    The callback reads the host's output, so that its lines get the time at which they were printed.
    """

    def __init__(
        self, path: str, control: str, selector: BaseSelector, before_request: Callable[[], None], end_s: float
    ) -> None:
        self.path = path
        self.requests = 0
        self.is_over = False  # simulated time has reached `end_s`; the host gets no more answers
        self._control, self._selector, self._before_request, self._end_s = control, selector, before_request, end_s
        listener = socket.socket(socket.AF_UNIX)
        listener.bind(path)
        listener.listen()
        selector.register(listener, EVENT_READ, lambda: self._accept(listener))

    def _accept(self, listener: socket.socket) -> None:
        host = listener.accept()[0]
        emulator = socket.socket(socket.AF_UNIX)
        emulator.connect(self._control)
        self._selector.register(host, EVENT_READ, lambda: self._forward(host, emulator, is_request=True))
        self._selector.register(emulator, EVENT_READ, lambda: self._forward(emulator, host, is_request=False))

    def _forward(self, source: socket.socket, to: socket.socket, is_request: bool) -> None:
        try:
            data = source.recv(1 << 16)
            if is_request:
                self.requests += 1
                self._before_request()
            elif any(float(time_s) >= self._end_s for time_s in TIME.findall(data)):
                self.is_over = True
            if self.is_over:
                return
            if data:
                to.sendall(data)
                return
        except OSError:
            pass
        for one in (source, to):
            self._selector.unregister(one)
            one.close()
