"""Streams signals of running drives."""

from __future__ import annotations

import json
import socket
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Tuple, Union

from .errors import Error
from .websocket import WebSocket


class Sample(NamedTuple):
    """Signals at one instant: `sample.drives[2]["speed_dps"]`, `sample.drives["body"]["body.trunk.z_m"]`."""

    time_s: float
    drives: Dict[Union[int, str], Dict[str, float]]


class Telemetry(Iterator[Sample]):
    """Iterates until it is closed or lk-emu ends. Raises `Error` if no sample arrives within the time limit."""

    def __init__(self, path: str, target: str, timeout_s: float) -> None:
        self._timeout_s = timeout_s
        try:
            self._socket = WebSocket(path, target, timeout_s)
        except (OSError, EOFError) as problem:
            raise Error(f"telemetry: {problem}") from None
        about = self._message()
        if about is None:
            raise Error("telemetry: lk-emu closed the stream at once")
        self.bus: str = about["bus"]
        self.ids: List[int] = about["ids"]
        self.signals: Tuple[str, ...] = tuple(about["signals"])
        self.body: Tuple[str, ...] = tuple(about.get("body", ()))
        self.rate_Hz: float = about["rate_Hz"]
        self.lost = 0  # samples that lk-emu dropped because the reader was too slow

    def __next__(self) -> Sample:
        message = self._message()
        if message is None:
            raise StopIteration
        self.lost = int(message.get("lost", 0))
        drives: Dict[Union[int, str], Dict[str, float]] = {
            int(row[0]): dict(zip(self.signals, row[1:])) for row in message["rows"]
        }
        if self.body:
            drives["body"] = dict(zip(self.body, message["body"]))
        return Sample(float(message["time_s"]), drives)

    def close(self) -> None:
        self._socket.close()

    def __enter__(self) -> "Telemetry":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _message(self) -> Optional[Dict[str, Any]]:
        try:
            text = self._socket.receive()
        except socket.timeout:
            raise Error(f"telemetry: no sample within {self._timeout_s:g} s; is the clock stopped?") from None
        return None if text is None else json.loads(text)
