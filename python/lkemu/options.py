"""Options of lk-emu, and their conversion to a command line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import List, Mapping, Optional, Sequence, Tuple, Union

Ids = Union[str, int, Sequence[int]]
Buses = Union[str, Mapping[str, Ids], None]
Quirks = Mapping[str, Union[str, int, bool]]
FREE = "free"
AUTO = "auto"  # free, or slcan over TCP if no CAN bus is available


def ids_text(ids: Ids) -> str:
    """Formats "1-4", 3 or [1, 3] for the command line."""
    if isinstance(ids, (str, int)):
        return str(ids)
    return ",".join(str(id) for id in ids)


@dataclass(frozen=True)
class Options:
    """Options as described in `Emulator`."""

    bus: Buses = None
    ids: Optional[Ids] = None
    config: Optional[str] = None
    motor: Optional[str] = None
    clock: str = "realtime"
    bitrate: Optional[int] = None
    seed: Optional[int] = None
    rom: str = ":memory:"
    record: Optional[str] = None
    scenario: Optional[str] = None
    create_bus: Optional[bool] = None
    log_level: Optional[str] = None
    arguments: Tuple[str, ...] = ()
    generation: Optional[str] = None
    quirks: Optional[Quirks] = None
    boot_angle_deg: Optional[float] = None

    @property
    def wants_free_bus(self) -> bool:
        return self.bus in (FREE, AUTO) or (self.bus is None and self.config is None)

    def buses(self, free: Optional[str]) -> List[Tuple[str, Optional[str]]]:
        """Returns the interfaces and the drives on each; empty if the file lists them. `free`: a claimed bus."""
        ids = None if self.ids is None else ids_text(self.ids)
        if isinstance(self.bus, Mapping):
            if ids is not None:
                raise ValueError("ids: bus says it already")
            return [(bus, ids_text(on_it)) for bus, on_it in self.bus.items()]
        if ids is None and self.config is None:
            ids = "1-4"
        bus = free if self.wants_free_bus else self.bus
        if bus is None:
            if ids is not None:
                raise ValueError("ids: say of which bus of the configuration")
            return []
        return [(bus, ids)]

    def arguments_for(self, free: Optional[str], create: bool, control: str) -> List[str]:
        """Returns the arguments of lk-emu."""
        words = ["--control", control, "--rom", self.rom]
        # Options of all drives come before the first --bus.
        words += ["--generation", self.generation] if self.generation is not None else []
        for name, value in (self.quirks or {}).items():
            words += ["--quirk", f"{name}={str(value).lower() if isinstance(value, bool) else value}"]
        for bus, ids in self.buses(free):
            words += ["--bus", bus]
            words += ["--ids", ids] if ids is not None else []
        for option, value in (
            ("--config", self.config),
            ("--motor", self.motor),
            ("--clock", self.clock if self.clock != "realtime" else None),
            ("--bitrate", self.bitrate),
            ("--seed", self.seed),
            ("--boot-angle", self.boot_angle_deg),
            ("--record", self.record),
            ("--scenario", self.scenario),
            ("--log-level", self.log_level),
        ):
            words += [option, str(value)] if value is not None else []
        words += ["--create-bus"] if create or (self.create_bus and not self.wants_free_bus) else []
        return words + list(self.arguments)
