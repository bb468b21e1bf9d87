"""One running lk-emu."""

from __future__ import annotations

import os
import shutil
import signal
import tempfile
from typing import Any, Dict, Iterator, List, Optional, Sequence, Set, Tuple, Union, overload
from urllib.parse import urlencode

from .buses import Claim, can_args, claim_any_bus, claim_free_bus, runtime_directory
from .client import BASE, Client
from .clock import Clock
from .drive import Drive, Targets, When, chosen
from .errors import Ended, Error, NoEffect, StartError
from .faults import Evidence, Fault, Kind
from .options import AUTO, Buses, Ids, Options, Quirks, ids_text
from .program import Process, find_program
from .telemetry import Telemetry

SOCKET_PATH_LIMIT = 100  # the kernel's limit is 107


class Drives:
    """`drives[1]`, or `drives["vcan1", 1]` if several buses have that ID; iterating yields the drives."""

    def __init__(self, drives: Sequence[Drive]) -> None:
        self._drives = list(drives)

    def __getitem__(self, key: Union[int, Tuple[str, int]]) -> Drive:
        bus, id = key if isinstance(key, tuple) else (None, key)
        found = [drive for drive in self._drives if drive.id == id and bus in (None, drive.bus)]
        if len(found) > 1:
            on = " and ".join(drive.bus for drive in found)
            raise KeyError(f'drive {id} is on {on}: say drives["{found[0].bus}", {id}]')
        if not found:
            raise KeyError(f"there is no drive {id}" + (f" on {bus}" if bus else ""))
        return found[0]

    def __iter__(self) -> Iterator[Drive]:
        return iter(self._drives)

    def __len__(self) -> int:
        return len(self._drives)


class Emulator:
    """Virtual drives on a CAN bus that run within a `with` block.

    `bus`: interface, or a URI (docs/guides/buses.md).
        None or "free": a free interface, created if needed and permitted.
        "auto": as "free", or slcan over TCP if no interface is available.
        None with `config`: the buses of the file.
        {"vcan0": "1-4", "vcan1": "1,2"}: several buses with their IDs.
    `ids`: "1-4" (default), "1,3", 3 or [1, 3].
    `config`, `motor`, `generation`, `seed`, `bitrate` (bit/s), `rom`, `scenario`, `record` (directory), `log_level`: as
        lk-emu's options.
    `boot_angle_deg`: rotor angle of every drive at the start; None: drawn from the seed.
    `quirks`: {"pid_commands": True, "state_1": "centivolt"}, for all drives.
    `clock`: "realtime", "stepped", "x10".
    `program`: path of lk-emu; default: $LKEMU, else the program of this build, else the one in PATH.
    `create_bus`: create missing interfaces; None: if needed and permitted.
    `log_dir`: directory for lk-emu's output.
    `arguments`: more arguments for lk-emu.
    `timeout_s`: time limit of each request. `start_timeout_s`: time limit until the drives answer.
    """

    def __init__(
        self,
        bus: Buses = None,
        ids: Optional[Ids] = None,
        config: Union[str, "os.PathLike[str]", None] = None,
        motor: Union[str, "os.PathLike[str]", None] = None,
        clock: str = "realtime",
        bitrate: Optional[int] = None,
        seed: Optional[int] = None,
        rom: Union[str, "os.PathLike[str]"] = ":memory:",
        record: Union[str, "os.PathLike[str]", None] = None,
        program: Optional[str] = None,
        scenario: Union[str, "os.PathLike[str]", None] = None,
        create_bus: Optional[bool] = None,
        log_level: Optional[str] = None,
        log_dir: Union[str, "os.PathLike[str]", None] = None,
        arguments: Sequence[str] = (),
        timeout_s: float = 10.0,
        start_timeout_s: float = 30.0,
        generation: Optional[str] = None,
        quirks: Optional[Quirks] = None,
        boot_angle_deg: Optional[float] = None,
    ) -> None:
        def path(given: Union[str, "os.PathLike[str]", None]) -> Optional[str]:
            return None if given is None else os.fspath(given)

        self.options = Options(
            bus, ids, path(config), path(motor), clock, bitrate, seed, os.fspath(rom), path(record), path(scenario),
            create_bus, log_level, tuple(arguments), generation, quirks, boot_angle_deg,
        )  # fmt: skip
        self._program = program
        self._log_dir = path(log_dir)
        self._timeout_s = timeout_s
        self._start_timeout_s = start_timeout_s
        self._directory: Optional[str] = None  # of the control socket
        self._process: Optional[Process] = None
        self._client: Optional[Client] = None
        self._kinds: Optional[Dict[str, Kind]] = None
        self._optional: Set[Tuple[str, str]] = set()  # bus and name of faults that need not take effect
        self._out = self._err = ""  # output of a process that has ended
        self._last_faults: Optional[List[Evidence]] = None  # of a process that we have stopped
        self.buses: List[str] = []
        self.drives = Drives([])

    # --- start and end ---

    def start(self) -> "Emulator":
        """Starts lk-emu and waits until its drives can answer. Raises StartError."""
        if self._process is not None:
            raise StartError("an Emulator starts only once: make another one")
        program = find_program(self._program)
        claim = None
        if self.options.wants_free_bus:
            find = claim_any_bus if self.options.bus == AUTO else claim_free_bus
            claim = find(self.options.create_bus)
        try:
            self._launch(program, claim)
        except BaseException:
            self.stop()
            raise
        finally:
            if claim is not None:
                os.close(claim.lock)  # lk-emu holds the lock as well
        return self

    def _launch(self, program: str, claim: Optional[Claim]) -> None:
        self._directory = tempfile.mkdtemp(prefix="lk-emu-")
        if len(self._directory) > SOCKET_PATH_LIMIT - len("/control"):
            os.rmdir(self._directory)
            self._directory = tempfile.mkdtemp(prefix="py-", dir=runtime_directory())
        control = os.path.join(self._directory, "control")
        free, create = (claim.bus, claim.create) if claim is not None else (None, False)
        command = [program, *self.options.arguments_for(free, create, control)]
        if self._log_dir is not None:
            os.makedirs(self._log_dir, exist_ok=True)
        keep_open = [claim.lock] if claim is not None else []
        self._process = Process(command, self._log_dir or self._directory, keep_open)
        self._process.wait_ready(self._start_timeout_s)
        self._client = Client(control, self._timeout_s, self._gone)
        buses = self.status()["buses"]
        self.buses = [bus["bus"] for bus in buses]
        self.drives = Drives([Drive(self, bus["bus"], id) for bus in buses for id in bus["ids"]])

    def stop(self) -> Optional[int]:
        """Ends lk-emu (SIGTERM, then SIGKILL); returns its exit status, None if it never ran. May be called twice."""
        if self._client is not None:
            if self._last_faults is None and self.exit_status is None:
                try:
                    self._last_faults = self.faults()
                except Error:
                    pass  # lk-emu must end in any case
            self._client.close()
        status = None
        if self._process is not None:
            status = self._process.stop()
            self._out, self._err = self._process.out(), self._process.err()
        if self._directory is not None:
            shutil.rmtree(self._directory, ignore_errors=True)
            self._directory = None
        return status

    def __enter__(self) -> "Emulator":
        return self.start()

    def __exit__(self, kind: object, *_: object) -> None:
        status = self.stop()
        if status and kind is None:
            raise Ended(self.how_it_ended())

    @property
    def exit_status(self) -> Optional[int]:
        """Exit status of lk-emu; -N if signal N killed it, None while it runs."""
        return None if self._process is None else self._process.status

    @property
    def died(self) -> bool:
        """Whether lk-emu ended without a request from here."""
        return self.exit_status is not None and (self._last_faults is None or self.exit_status != 0)

    @property
    def pid(self) -> int:
        if self._process is None:
            raise Error("lk-emu was not started")
        return self._process.pid

    @property
    def control(self) -> str:
        """Path of lk-emu's control socket."""
        return self.client.path

    @property
    def log(self) -> str:
        """lk-emu's standard error."""
        return self._err if self._process is None or self._directory is None else self._process.err()

    @property
    def output(self) -> str:
        """lk-emu's standard output: the ready line and, after the end, a summary."""
        return self._out if self._process is None or self._directory is None else self._process.out()

    @property
    def client(self) -> Client:
        """The control interface, for requests without a method here: `client.get("/signals")`."""
        if self._client is None:
            raise Error("lk-emu was not started")
        return self._client

    def _gone(self, what: str) -> Exception:
        if self._process is not None and self._process.ended_within(1.0):
            return Ended(self.how_it_ended())
        return Error(what)

    def how_it_ended(self) -> str:
        """Returns the exit status in words, and the last log lines."""
        status = self.exit_status or 0
        how = f"status {status}"
        if status < 0:
            try:
                how = signal.Signals(-status).name
            except ValueError:
                how = f"signal {-status}"
        last = [line for line in self.log.splitlines() if line.strip()][-3:]
        return f"lk-emu ended ({how})" + "".join(f"\n  {line}" for line in last)

    # --- queries ---

    def status(self) -> Dict[str, Any]:
        """Returns version, clock, buses with their counters, recording, scenario."""
        return dict(self.client.get("/status"))

    def advice(self) -> List[Dict[str, Any]]:
        """Returns the mistakes of hosts so far, one entry for each kind and drive (docs/guides/host-mistakes.md)."""
        return [dict(row) for row in self.client.get("/advice")]

    @property
    def bus(self) -> str:
        """The first interface, for `can.Bus(channel=emu.bus, …)`."""
        if not self.buses:
            raise Error("lk-emu was not started")
        return self.buses[0]

    @property
    def can_args(self) -> Dict[str, Any]:
        """Arguments that connect python-can to `bus` of any kind: `can.Bus(**emu.can_args)`."""
        return can_args(self.bus)

    @property
    def clock(self) -> Clock:
        return Clock(self.client)

    def drive(self, id: int, bus: Optional[str] = None) -> Drive:
        return self.drives[id if bus is None else (bus, id)]

    def targets(self, ids: Optional[Sequence[int]] = None, bus: Optional[str] = None) -> Targets:
        """Returns several drives of a bus, e.g. `emu.targets([1, 2]).power.cycle()`. Default: all drives."""
        if ids is not None and not ids:
            raise ValueError("ids is empty: leave it out for all drives")
        on = bus or self.bus
        return Targets(self, on, [drive.id for drive in self.drives if drive.bus == on] if ids is None else ids)

    def telemetry(
        self,
        signals: Union[str, Sequence[str]],
        ids: Optional[Ids] = None,
        rate_Hz: float = 100.0,
        bus: Optional[str] = None,
        timeout_s: Optional[float] = None,
    ) -> Telemetry:
        """Streams signals at `rate_Hz`, in the drives' time: `for time_s, drives in emu.telemetry(…)`.

        `drives["body"]` has the signals of the body.
        """
        words = signals if isinstance(signals, str) else ",".join(signals)
        query = {"signals": words, "bus": bus or self.bus, "rate_Hz": f"{rate_Hz:g}"}
        if ids is not None:
            query["ids"] = ids_text(ids)
        target = f"{BASE}/telemetry?{urlencode(query, safe=',')}"
        return Telemetry(self.control, target, self._timeout_s if timeout_s is None else timeout_s)

    @overload
    def body(self, signal: str, /) -> float: ...

    @overload
    def body(self, *signals: str) -> Dict[str, float]: ...

    def body(self, *signals: str) -> Union[float, Dict[str, float]]:
        """Returns the value of one signal of the body; a dict for several or all. Raises Refused without a body."""
        return chosen(self.client.get("/body")["signals"], signals)

    # --- commands ---

    def directive(self, **words: Any) -> Dict[str, Any]:
        """Sends a directive with the keys of docs/reference/events.md. Omits None and empty values. Raises Refused."""
        said = {key: value for key, value in words.items() if value is not None and value != []}
        if "ids" in said:
            said["ids"] = ids_text(said["ids"])
        said.setdefault("bus", self.bus)
        return dict(self.client.post("/directives", said))

    def mark(self, text: str, bus: Optional[str] = None) -> float:
        """Writes a note into log and recording; returns the time in seconds."""
        return float(self.directive(bus=bus, mark=text)["time_s"])

    def record(self, directory: Union[str, "os.PathLike[str]"]) -> None:
        """Starts a recording into this directory (docs/reference/formats.md)."""
        self.client.post("/recording", {"directory": os.path.abspath(directory)})

    def stop_recording(self) -> None:
        self.client.request("DELETE", "/recording")

    def scenario(self, file: Union[str, "os.PathLike[str]", None] = None, toml: Optional[str] = None) -> Any:
        """Starts a scenario from a file or a text; without either, returns the verdict so far."""
        if file is None and toml is None:
            return self.client.get("/scenario")
        words = {"file": os.path.abspath(file)} if file is not None else {"toml": toml}
        return self.client.post("/scenario", words)

    def stop_scenario(self) -> None:
        self.client.request("DELETE", "/scenario")

    # --- faults ---

    def fault_kinds(self) -> Dict[str, Kind]:
        if self._kinds is None:
            kinds = [Kind.from_json(row) for row in self.client.get("/faults/kinds")]
            self._kinds = {kind.word: kind for kind in kinds}
        return self._kinds

    def fault(self, kind: str, bus: Optional[str] = None, **more: Any) -> Fault:
        """Sets a fault of the whole bus, such as error_frames; `Targets.fault` explains the parameters."""
        return Targets(self, bus or self.bus, []).fault(kind, **more)

    def set_fault(
        self,
        bus: str,
        ids: Sequence[int],
        words: Dict[str, Any],
        at_s: Optional[float],
        when: Optional[When],
        optional: bool,
    ) -> Fault:
        answer = self.directive(bus=bus, ids=list(ids), fault=words, at_s=at_s, when=when and dict(when))
        name = str(answer["faults"][0])
        if optional:
            self._optional.add((bus, name))
        return Fault(self, bus, name, str(words["kind"]), optional)

    def clear(self, which: str = "all", bus: Optional[str] = None) -> None:
        """Ends the fault with this name, all faults of this kind, or all faults; on one bus, or on all buses."""
        for one in self.buses if bus is None else [bus]:
            self.directive(bus=one, clear=which)

    def faults(self) -> List[Evidence]:
        """Returns the evidence of every fault that was set; after `stop`, its state at the end."""
        if self._last_faults is not None:
            return self._last_faults
        return self.clock.faults()

    def idle_faults(self) -> List[Evidence]:
        """Returns the faults that have not taken effect, without the `optional` ones."""
        return [fault for fault in self.faults() if not fault.fired and (fault.bus, fault.name) not in self._optional]

    def check_faults(self) -> None:
        """Raises NoEffect if a fault has not taken effect, because the test has then not tested it."""
        idle = self.idle_faults()
        if idle:
            raise NoEffect("\n".join(map(str, idle)))
