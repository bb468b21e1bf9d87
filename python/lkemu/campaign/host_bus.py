"""The bus of one case with a host program."""

from __future__ import annotations

import json
import os
import socket
from typing import Dict, Optional

from ..buses import can_args
from ..errors import StartError

KINDS = ("vcan", "slcan-tcp", "slcan-pty", "socketcand", "udp-multicast", "rs485", "rs485-tcp")
GROUP = "239.74.163.2"  # as in the documents' example; packets stay on this machine


class HostBus:
    """`name`: bus for lk-emu; `channel`: as the host opens it; `port`: empty if the bus has none."""

    def __init__(self, kind: str, directory: str) -> None:
        self._socket: Optional[socket.socket] = None
        self.port = ""
        terminal = os.path.join(directory, "tty")
        self.channel = terminal
        if kind == "vcan":
            self.name = self.channel = "vcan0"
        elif kind in ("slcan-pty", "rs485"):
            self.name = f"{kind}:{terminal}"
        elif kind == "udp-multicast":
            self._reserve_port(socket.SOCK_DGRAM)
            self.name, self.channel = f"{kind}:{GROUP}:{self.port}", GROUP
        else:
            self._reserve_port(socket.SOCK_STREAM)
            self.name = f"{kind}:{self.port}"
            self.channel = "can0" if kind == "socketcand" else f"socket://127.0.0.1:{self.port}"

    def environment(self) -> Dict[str, str]:
        variables = {"LKEMU_BUS": self.name, "LKEMU_CHANNEL": self.channel}
        if not self.name.startswith("rs485"):
            config = can_args(self.name)
            variables["CAN_INTERFACE"] = config.pop("interface")
            variables["CAN_CHANNEL"] = config.pop("channel")
            variables["CAN_CONFIG"] = json.dumps(config)
        return variables

    def close(self) -> None:
        if self._socket is not None:
            self._socket.close()

    def _reserve_port(self, kind: int) -> None:
        """Sets `port` to a free port and reserves it with a bound socket.

        The socket does not listen, so lk-emu can bind the port too, with SO_REUSEADDR.
        """
        try:
            self._socket = socket.socket(socket.AF_INET, kind)
            self._socket.bind(("127.0.0.1", 0))
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        except OSError as problem:
            raise StartError(f"host: no free port: {problem.strerror}") from None
        self.port = str(self._socket.getsockname()[1])
