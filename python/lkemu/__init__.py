"""Virtual LK-TECH servo drives for tests in Python.

    with lkemu.Emulator(ids="1-4") as emu:
        emu.drives[2].jam(percent=100, for_s=0.5)

docs/python.md tells all of it; `lkemu.pytest_plugin` has fixtures.
"""

from .attached import Attached, attach
from .client import Client
from .clock import Clock
from .drive import Drive, Power, Targets
from .emulator import Drives, Emulator
from .errors import Ended, Error, NoEffect, Refused, StartError
from .faults import Evidence, Fault, Kind
from .stepped_bus import SteppedBus
from .telemetry import Sample, Telemetry

__version__ = "0.2.0"

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
    "Power",
    "Refused",
    "Sample",
    "StartError",
    "SteppedBus",
    "Targets",
    "Telemetry",
    "attach",
]
