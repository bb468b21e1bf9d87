"""pytest plugin: virtual drives for tests; a test fails if one of its faults had no effect.

Fixtures: `lkemu` (a running `Emulator`), `drives`, `clock`, `lkemu_start` (starts more). The options are those of
`Emulator`. Set them by the marker `@pytest.mark.lkemu(ids="1-4", clock="stepped", …)` or in the ini file.
"""

from __future__ import annotations

import difflib
import inspect
import os
import shutil
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Tuple, Union

import pytest

from .clock import Clock
from .emulator import Drives, Emulator
from .errors import Ended, Error, StartError

LOG_LINES = 50  # of each output, in a report
SHOWN = ("angle_deg", "speed_dps", "iq_A", "voltage_V")  # of each drive, in a report
INI = {
    "program": "path of lk-emu; else $LKEMU, the build that the package is a part of, or the one in PATH",
    "bus": 'CAN interface or URI; "free": one that is not in use; "auto": slcan over TCP where there is none',
    "ids": "drives, e.g. 1-4",
    "config": "configuration file of lk-emu, from the ini file's directory, or the name of a shipped one",
    "motor": "motor of every drive, or a motor file, from the ini file's directory",
    "generation": "firmware of every drive",
    "clock": "realtime, stepped or x10",
    "seed": "seed of noise and boot angles",
    "bitrate": "modelled bit rate in bit/s",
}

FILES = {"config", "motor"}  # options that may be paths of files

_RUNS = pytest.StashKey[List["Run"]]()
_FAILED = pytest.StashKey[bool]()


class Run:
    """An emulator of a test, and the directory of its files."""

    def __init__(self, emulator: Emulator, logs: Path) -> None:
        self.emulator = emulator
        self.logs = logs
        self.judged = False

    @property
    def recording(self) -> str:
        """Directory of the recording; empty without one."""
        directory = self.emulator.options.record
        return directory if directory is not None and os.path.isdir(directory) else ""

    def judge(self) -> None:
        """Raises Ended or NoEffect; later calls do nothing."""
        if self.judged:
            return
        self.judged = True
        if self.emulator.died:
            raise Ended(self.emulator.how_it_ended())
        self.emulator.check_faults()


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("lkemu", "virtual LK-TECH drives")
    group.addoption("--lkemu-program", metavar="PATH", help="lk-emu to start")
    group.addoption("--lkemu-bus", metavar="BUS", help=INI["bus"] + " (over ini file and markers)")
    group.addoption("--lkemu-keep", action="store_true", help="keep recordings and logs of tests that pass, too")
    for name, about in INI.items():
        parser.addini(f"lkemu_{name}", f"lk-emu: {about}", default="")
    parser.addini("lkemu_record", "lk-emu: record every test", type="bool", default=True)


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "lkemu(**options): options of lkemu.Emulator for this test's virtual drives")


# --- fixtures ---


@pytest.fixture
def lkemu_start(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Callable[..., Emulator]]:
    """Starts an `Emulator` with the test's options, which arguments override; it ends with the test."""
    runs = request.node.stash.setdefault(_RUNS, [])

    def start(**more: Any) -> Emulator:
        place = tmp_path / ("lkemu" if not runs else f"lkemu-{len(runs) + 1}")
        options = {"log_dir": place, **options_of(request), **more}
        if isinstance(options["record"], bool):
            options["record"] = place / "recording" if options["record"] else None
        place.mkdir(exist_ok=True)
        emulator = Emulator(**options).start()
        runs.append(Run(emulator, place))
        return emulator

    yield start
    problems = [problem for run in reversed(runs) for problem in end(run, request)]
    if problems:
        pytest.fail("\n".join(problems), pytrace=False)


@pytest.fixture
def lkemu(lkemu_start: Callable[..., Emulator]) -> Emulator:
    """Virtual drives for this test: a running `lkemu.Emulator`."""
    try:
        return lkemu_start()
    except (StartError, ValueError) as problem:
        pytest.fail(str(problem), pytrace=False)


@pytest.fixture
def drives(lkemu: Emulator) -> Drives:
    """The drives of `lkemu`, by ID."""
    return lkemu.drives


@pytest.fixture
def clock(lkemu: Emulator) -> Clock:
    """The clock of `lkemu`."""
    return lkemu.clock


def seen_from(directory: Path, option: str, given: Union[str, "os.PathLike[str]"]) -> str:
    """Makes the path in an option absolute, relative to `directory`; does not change names that lk-emu knows."""
    text = os.fspath(given)
    is_path = "/" in text or text.endswith(".toml") or (option == "config" and (directory / text).is_file())
    return str(directory / text) if is_path else text


def check_marker(marker: pytest.Mark) -> None:
    """Fails the test with one sentence if the marker has arguments that `Emulator` lacks."""
    if marker.args:
        pytest.fail(f"@pytest.mark.lkemu({marker.args[0]!r}): takes keywords only, like ids=\"1-4\"", pytrace=False)
    known = list(inspect.signature(Emulator).parameters)
    for name in marker.kwargs:
        if name not in known:
            near = difflib.get_close_matches(name, known, 1)
            meant = f"did you mean {near[0]}?" if near else "there are: " + ", ".join(known)
            pytest.fail(f"@pytest.mark.lkemu({name}=…): unknown option; {meant}", pytrace=False)


def options_of(request: pytest.FixtureRequest) -> Dict[str, Any]:
    """Returns the options: the command line overrides the markers, which override the ini file."""
    config = request.config
    options: Dict[str, Any] = {"record": config.getini("lkemu_record")}
    for name in INI:
        text = str(config.getini(f"lkemu_{name}")).strip()
        if text:
            options[name] = int(text) if name in ("seed", "bitrate") else text
    of_ini = (config.inipath or config.rootpath / "ini").parent
    for name in FILES & options.keys():
        options[name] = seen_from(of_ini, name, options[name])
    for marker in reversed(list(request.node.iter_markers("lkemu"))):
        check_marker(marker)
        said = dict(marker.kwargs)
        for name in FILES & said.keys():
            if said[name] is not None:
                said[name] = seen_from(request.path.parent, name, said[name])
        options.update(said)
    for name in ("program", "bus"):
        said = config.getoption(f"--lkemu-{name}")
        if said:
            options[name] = said
    return options


def end(run: Run, request: pytest.FixtureRequest) -> List[str]:
    """Ends the run; returns its problems that were not yet reported."""
    problems = verdict(run)  # already reported, unless no test function was called (unittest methods)
    was_alive = run.emulator.exit_status is None
    if run.emulator.stop() and was_alive:
        problems.append(run.emulator.how_it_ended())
    if not request.config.getoption("--lkemu-keep") and not request.node.stash.get(_FAILED, False):
        shutil.rmtree(run.logs, ignore_errors=True)
    return problems


# --- verdicts and reports ---


@pytest.hookimpl(hookwrapper=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> Iterator[None]:
    outcome = yield
    runs = pyfuncitem.stash.get(_RUNS, [])
    if outcome.excinfo is not None:  # type: ignore[attr-defined]
        for run in runs:
            run.judged = True  # the test failed or was skipped, so its own message is reported
        return
    problems = [problem for run in runs for problem in verdict(run)]
    if problems:
        raise_instead(outcome, pytest.fail.Exception("\n".join(problems), pytrace=False))


def verdict(run: Run) -> List[str]:
    """Returns the problems of a run."""
    try:
        run.judge()
    except Error as problem:
        return [str(problem)]
    return []


def raise_instead(outcome: Any, problem: BaseException) -> None:
    if hasattr(outcome, "force_exception"):
        outcome.force_exception(problem)
    else:  # pluggy before 1.1 lets an exception pass
        raise problem


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Iterator[None]:
    outcome = yield
    report: pytest.TestReport = outcome.get_result()  # type: ignore[attr-defined]
    if not report.failed:
        return
    item.stash[_FAILED] = True
    for run in item.stash.get(_RUNS, []):
        run.judged = True
        report.sections += list(sections(run))


def sections(run: Run) -> Iterator[Tuple[str, str]]:
    """Yields the sections of a failed test's report, as titles and texts."""
    emulator = run.emulator
    if emulator.exit_status is None:
        try:
            yield "lk-emu: drives", "\n".join(summary(emulator))
            yield "lk-emu: faults", "\n".join(map(str, emulator.faults())) or "none was set"
        except Error as problem:
            yield "lk-emu: does not answer", str(problem)
    else:
        yield "lk-emu: has ended", emulator.how_it_ended()
    for title, text in (("output", emulator.output), ("log", emulator.log)):
        if text.strip():
            yield f"lk-emu: {title}", "\n".join(text.splitlines()[-LOG_LINES:])
    if run.recording:
        yield "lk-emu: recording", f"{run.recording}\nlk-emu replay {run.recording}"


def summary(emulator: Emulator) -> Iterator[str]:
    """Yields the time, the counters of each bus, and the state of each drive."""
    status = emulator.status()
    yield f"{status['clock']['mode']}, at {status['clock']['time_s']:.6f} s"
    for bus in status["buses"]:
        yield f"{bus['bus']}: " + ", ".join(counted(bus.get("counters", {})))
    for drive in emulator.drives:
        view = drive.view()
        errors = ", ".join(view["errors"]) or "no errors"
        signals = view["signals"]
        shown = ", ".join(f"{name} {signals[name]:.2f}" for name in SHOWN if name in signals)
        yield f"{drive.bus}:{drive.id} {view['state']}, {errors}, {shown}"


def counted(counters: Dict[str, Any]) -> Iterator[str]:
    """Yields the counters that are not zero, such as "12 queries"."""
    for name, count in counters.items():
        if isinstance(count, dict):
            yield from counted(count)
        elif count and isinstance(count, int):
            yield f"{count} {name.replace('_', ' ')}"
