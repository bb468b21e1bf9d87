"""Client of the shaft port: puts the drives of lk-emu on the joints of a simulator (docs/guides/your-simulator.md).

    with Shafts("unix:/tmp/shafts", time="simulator") as shafts:
        joint = shafts.joints[0]                     # "vcan0:1", and the armature to add
        while True:
            torque = shafts.exchange([State(angle_rad, speed_rad_s, inertia_kg_m2, torque_Nm)])[0]
            ...                                      # one step of shafts.step_s under torque.torque_Nm

lk_shafts.h defines the messages. Not thread-safe.
"""

from __future__ import annotations

import socket
import struct
from types import TracebackType
from typing import Dict, Iterable, List, NamedTuple, Optional, Sequence, Type, Union

from .errors import Ended, Refused, StartError

VERSION = 1
NOT_COUPLED, SIMULATOR, DRIVE = 0, 1, 2
_OFFER, _ACCEPT, _STATES, _TORQUES, _END = 1, 2, 3, 4, 5
_TIMES = {"simulator": 1, "drives": 2}
_TORQUE_UNTOLD = 1
_HEAD = struct.Struct("<4sIIIIIQ")
_OFFERED = struct.Struct("<64sdd")
_ACCEPTED = struct.Struct("<II")
_STATE = struct.Struct("<4d")
_TORQUE = struct.Struct("<5d")
_MOST_BYTES = 1 << 24


class Joint(NamedTuple):
    """A shaft that lk-emu offers."""

    name: str  # bus and ID, "vcan0:1"
    armature_kg_m2: float  # of the drive, to be added to the joint
    angle_rad: float  # of the output shaft, now


class State(NamedTuple):
    """State of a joint at the beginning of a step. For joints owned by DRIVE only the last two fields count."""

    angle_rad: float = 0.0
    speed_rad_s: float = 0.0
    inertia_kg_m2: float = 0.0  # on the shaft, including the armature; 0: unknown. For DRIVE: of the load
    torque_Nm: float = 0.0  # sum of the torques on this inertia, without the drive's


class Torque(NamedTuple):
    """Output of a drive in a step."""

    torque_Nm: float  # on the joint, mean of the step
    torque_slope_Nm_s: float  # about the middle of the step
    armature_kg_m2: float  # to be added to the joint
    angle_rad: float  # output shaft, at the step's end
    speed_rad_s: float


class Shafts:
    """A connection. `place` is the argument of lk-emu --shafts: "unix:/tmp/shafts", "tcp:29600".

    `time`: who owns the clock. "simulator": lk-emu does one step per `exchange` and stops its clock in between.
    "drives": the clock of lk-emu keeps running; a late simulator gets the mean of several steps (`steps`).
    `step_s`: None, as offered (1 ms), or 50 us to 10 ms, a whole number of PWM periods of each drive.
    `owners`: SIMULATOR (default), DRIVE or NOT_COUPLED, by name of the joint.
    `torque_untold`: the simulator does not send torques; lk-emu estimates those on a joint, except the drive's.
    Raises StartError if lk-emu does not listen, Refused with lk-emu's reason.
    """

    def __init__(
        self,
        place: str,
        time: str = "simulator",
        step_s: Optional[float] = None,
        owners: Optional[Dict[str, int]] = None,
        torque_untold: bool = False,
        limit_s: float = 10.0,
    ) -> None:
        if time not in _TIMES:
            raise ValueError(f'time is "simulator" or "drives", not {time!r}')
        self._socket = _connect(place, limit_s)
        head = self._read_head(_OFFER)
        offers = _OFFERED.iter_unpack(self._read(_OFFERED.size * head[4]))
        self.joints: List[Joint] = [Joint(n.split(b"\0")[0].decode(), a, q) for n, a, q in offers]
        owners = owners or {}
        unknown = set(owners) - {joint.name for joint in self.joints}
        if unknown:
            raise ValueError(f"no joint {sorted(unknown)[0]}: there are {', '.join(j.name for j in self.joints)}")
        step_ns = head[6] if step_s is None else round(step_s * 1e9)
        self.step_s = step_ns * 1e-9
        self.steps = 1  # number of steps that the last torques average
        self.number = 0  # steps that lk-emu has done so far
        flags = _TORQUE_UNTOLD if torque_untold else 0
        records = b"".join(_ACCEPTED.pack(owners.get(joint.name, SIMULATOR), flags) for joint in self.joints)
        self._send(_ACCEPT, records, _TIMES[time], step_ns)

    def exchange(self, states: Sequence[Union[State, Iterable[float]]]) -> List[Torque]:
        """Sends the states of the joints, in the order of `joints`; returns the drives' output in the next step.

        Raises Ended if lk-emu has closed the connection, Refused with its reason.
        """
        if len(states) != len(self.joints):
            raise ValueError(f"{len(states)} states for {len(self.joints)} joints")
        self._send(_STATES, b"".join(_STATE.pack(*state) for state in states), 0, self.number)
        head = self._read_head(_TORQUES)
        self.steps, self.number = head[5], head[6]
        return [Torque(*record) for record in _TORQUE.iter_unpack(self._read(_TORQUE.size * head[4]))]

    def close(self) -> None:
        self._socket.close()

    def __enter__(self) -> "Shafts":
        return self

    def __exit__(
        self,
        kind: Optional[Type[BaseException]],
        problem: Optional[BaseException],
        trace: Optional[TracebackType],
    ) -> None:
        self.close()

    def _send(self, kind: int, records: bytes, what: int, number: int) -> None:
        size = _HEAD.size + len(records)
        try:
            self._socket.sendall(_HEAD.pack(b"LKSH", VERSION, kind, size, len(self.joints), what, number) + records)
        except (BrokenPipeError, ConnectionResetError):
            pass  # lk-emu's reason may still be in the receive buffer

    def _read_head(self, kind: int) -> tuple[bytes, int, int, int, int, int, int]:
        head = _HEAD.unpack(self._read(_HEAD.size))
        if head[0] != b"LKSH" or head[1] != VERSION or head[3] > _MOST_BYTES:
            raise Ended("the port does not use version 1 of the shaft protocol")
        if head[2] == _END:
            raise Refused("lk-emu", self._read(head[3] - _HEAD.size)[: head[5]].decode(errors="replace"))
        if head[2] != kind:
            raise Ended(f"lk-emu sent a message of kind {head[2]} in place of {kind}")
        return head

    def _read(self, size: int) -> bytes:
        parts: List[bytes] = []
        while size > 0:
            try:
                part = self._socket.recv(size)
            except socket.timeout:
                raise Ended("lk-emu has not answered in time") from None
            except ConnectionResetError:
                part = b""
            if not part:
                raise Ended("lk-emu closed the connection")
            parts.append(part)
            size -= len(part)
        return b"".join(parts)


def _connect(place: str, limit_s: float) -> socket.socket:
    scheme, _, rest = place.partition(":")
    try:
        if scheme == "unix":
            found = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            found.settimeout(limit_s)
            found.connect(rest)
        elif scheme == "tcp":
            host, _, port = rest.rpartition(":")
            found = socket.create_connection((host.strip("[]") or "127.0.0.1", int(port)), limit_s)
            found.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        else:
            raise StartError(f'"{place}" is not unix:PATH or tcp:[ADDR:]PORT')
    except OSError as problem:
        raise StartError(f"{place}: {problem.strerror or problem}") from None
    return found
