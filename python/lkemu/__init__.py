"""Virtual LK-TECH servo drives for tests in Python.

    with lkemu.Emulator(ids="1-4") as emu:
        emu.drives[2].jam(percent=100, for_s=0.5)

docs/guides/tests.md describes the package; `lkemu.pytest_plugin` has fixtures.
"""

from typing import TYPE_CHECKING, Any

from .attached import Attached, attach
from .client import Client
from .clock import Clock
from .drive import Drive, Power, Targets
from .emulator import Drives, Emulator
from .errors import Ended, Error, NoEffect, NoReply, Refused, StartError
from .faults import Evidence, Fault, Kind
from .telemetry import Sample, Telemetry

if TYPE_CHECKING:
    from .stepped_bus import SteppedBus as SteppedBus

__version__ = "0.3.0"

__all__ = [
    "Attached",
    "Client",
    "Clock",
    "Drive",
    "Drives",
    "Emulator",
    "Ended",
    "Error",
    "Evidence",
    "Fault",
    "Kind",
    "NoEffect",
    "NoReply",
    "Power",
    "Refused",
    "Sample",
    "StartError",
    "Targets",
    "Telemetry",
    "attach",
]


def __getattr__(name: str) -> Any:
    """SteppedBus is a can.BusABC, so python-can is imported only on its first use."""
    if name != "SteppedBus":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from .stepped_bus import SteppedBus

    return SteppedBus
