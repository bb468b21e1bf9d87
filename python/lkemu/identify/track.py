"""What a log tells of one drive over time, through `lk-emu decode --json`: what it was asked for, what it said of its shaft."""

from __future__ import annotations

import json
import subprocess
import tempfile
from array import array
from collections import defaultdict
from dataclasses import dataclass, field
from typing import Any, Dict, IO, Iterator, List, Optional, Tuple

import numpy as np

from ..command import printable
from ..program import find_program
from .motor import DEG, Motor, Unusable, run_program

FEWEST_SAMPLES = 200  # replies with the second state: ten seconds at 20 Hz (assumed)
GAP_STEPS = 5  # a gap is longer than so many usual steps (assumed)
BETWEEN_LOGS_S = 3600.0
MOST_WAITING = 64  # queries without a reply that are kept
NOTHING, TORQUE, SPEED, POSITION = range(4)  # what a drive follows
STOPS = {"80", "81", "88", "A0", "18", "07"}
# Which quantity of a motion command is the order, and what it makes the drive follow.
MOTION = {"torque": (TORQUE, "iq_A", 1.0), "speed": (SPEED, "speed_dps", DEG)}


@dataclass
class Orders:
    """What the drive follows from an instant on. Values in A, rad/s or rad of the multi-turn angle."""

    time: np.ndarray
    what: np.ndarray
    value: np.ndarray
    limit: np.ndarray  # rad/s on the way to a position; 0: none said
    absolute: np.ndarray  # else an increment, or a place on the circle

    def at(self, times: np.ndarray) -> np.ndarray:
        """The place of the order in force; -1: none yet."""
        return np.searchsorted(self.time, times, side="right") - 1


@dataclass
class Track:
    interface: str
    id: int
    motor: Motor
    generation: str
    generation_given: bool
    fits: List[str]  # generations that the log shows, where none was given
    span_turns: float  # of the encoder field
    time: np.ndarray  # of the samples: when the query was stamped
    reply: np.ndarray  # when their replies were
    iq: np.ndarray  # A
    speed: np.ndarray  # rad/s, as reported
    angle: np.ndarray  # rad of the rotor, over all turns
    orders: Orders
    gains: Optional[Dict[str, int]]
    supply_V: float  # the mean of what it reported; 0: nothing
    queries: int
    unanswered: int
    ambiguous: int  # replies that several queries could have
    backwards: int  # stamps before the one above them
    first: np.ndarray = field(default_factory=lambda: np.zeros(0, int))  # sample of each stretch without a gap

    def __post_init__(self) -> None:
        steps = np.diff(self.time)
        self.step_s = float(np.median(steps)) if len(steps) else 0.0
        self.first = np.concatenate(([0], np.flatnonzero(steps > GAP_STEPS * self.step_s) + 1))

    @property
    def stretch(self) -> np.ndarray:
        """The number of the stretch that each sample is of."""
        return np.searchsorted(self.first, np.arange(len(self.time)), side="right")

    def options(self) -> str:
        if self.generation_given:
            return f"--generation {self.generation}, as was said"
        if self.fits == [self.generation]:
            return f"--generation {self.generation}, as the log shows"
        if self.fits:
            return f"--generation {self.generation}, a guess: {' or '.join(self.fits)} fits"
        return f"--generation {self.generation}, a guess: nothing in the log fits quite"


def monotone(log: str) -> "tuple[IO[bytes], array[float], int]":
    """The log with stamps that do not go back, for the pairing, which goes by order; the stamps by line where some went
    back, and how many did."""
    stamps, back, latest = array("d"), 0, -1.0
    try:
        with open(log, "rb") as file:
            for line in file:
                try:
                    at = float(line[1 : line.index(b")")]) if line.lstrip().startswith(b"(") else latest
                except ValueError:
                    at = latest
                back += at < latest
                latest = max(latest, at)
                stamps.append(at)
            if not back:
                return open(log, "rb"), array("d"), 0
            file.seek(0)
            made, latest = tempfile.TemporaryFile(), -1.0
            for at, line in zip(stamps, file):
                latest = max(latest, at)
                made.write(b"(%.6f)%s" % (latest, line[line.find(b")") + 1 :]))
            made.seek(0)
            return made, stamps, back
    except OSError as problem:
        raise Unusable(f"identify: cannot read {printable(log)}: {problem.strerror}") from None


def decoded(log: IO[bytes], name: str, motor: str, generation: str) -> Iterator[Dict[str, Any]]:
    words = [find_program(), "decode", "-", "--json", "--motor", motor, "--generation", generation]
    with tempfile.TemporaryFile() as errors:
        with subprocess.Popen(words, stdin=log, stdout=subprocess.PIPE, stderr=errors) as popen:
            assert popen.stdout is not None
            for line in popen.stdout:
                yield json.loads(line)
        if popen.returncode != 0:
            errors.seek(0)
            said = errors.read().decode(errors="replace").strip().splitlines() or ["decode has failed"]
            raise Unusable(f"identify: {printable(name)}: {said[-1].removeprefix('lk-emu: ').removeprefix('decode: ')}")


class Builder:
    """One drive of one log, frame by frame."""

    def __init__(self, id: int) -> None:
        self.id = id
        self.rows = {name: array("d") for name in ("time", "reply", "iq", "speed", "counts")}
        self.orders = {name: array("d") for name in ("time", "what", "value", "limit", "absolute")}
        self.gains: Optional[Dict[str, int]] = None
        self.volts, self.states, self.queries, self.replies, self.ambiguous = 0.0, 0, 0, 0, 0
        self.waiting: List[Tuple[float, float]] = []  # time that decode has, and of the log

    def query(self, frame: Dict[str, Any], at: float) -> None:
        self.queries += 1
        self.waiting.append((frame["time_s"], at))
        del self.waiting[:-MOST_WAITING]
        self.note_gains(frame)
        values, name = frame.get("values", {}), frame.get("name", "")
        what, key, unit = MOTION.get(name, (NOTHING, "", 1.0))
        if what:
            value = values.get(key, values.get(str(self.id)))  # of a command for several drives, by ID
            if value is not None:
                self.order(at, what, value * unit)
        elif name.startswith("position"):
            if frame["drive"] == 0 and str(self.id) not in values:
                return
            absolute = frame["drive"] == 0 or ("angle_deg" in values and "multi-turn" in name)
            angle = values.get("angle_deg", values.get(str(self.id), 0.0)) * DEG
            self.order(at, POSITION, angle, values.get("max_speed_dps", 0.0) * DEG, absolute)
        elif frame.get("command") in STOPS:
            self.order(at, NOTHING, 0.0)

    def asked(self, at: float) -> Optional[float]:
        """When the query was stamped that decode has at this time; those before it have no reply."""
        for n, (decoded_at, stamped) in enumerate(self.waiting):
            if abs(decoded_at - at) < 1.5e-6:
                del self.waiting[: n + 1]
                return stamped
        return None

    def order(self, at: float, what: int, value: float, limit: float = 0.0, absolute: bool = True) -> None:
        for name, one in zip(self.orders, (at, what, value, limit, absolute)):
            self.orders[name].append(one)

    def note_gains(self, frame: Dict[str, Any]) -> None:
        values = frame.get("values", {})
        if "speed_kp" in values and "angle_kp" in values:
            self.gains = {key: int(value) for key, value in values.items() if key.endswith(("_kp", "_ki"))}

    def answer(self, frame: Dict[str, Any], at: float) -> None:
        self.replies += 1
        values = frame.get("values", {})
        self.note_gains(frame)
        if "voltage_V" in values:
            self.volts += values["voltage_V"]
            self.states += 1
        self.ambiguous += frame.get("choices", 0) > 1
        asked = self.asked(frame["time_s"] - frame["latency_ms"] / 1e3) if "latency_ms" in frame else None
        if asked is None or "iq_A" not in values or "encoder_counts" not in values:
            return
        if self.rows["time"] and asked <= self.rows["time"][-1]:
            return
        for name, one in zip(self.rows, (asked, at, values["iq_A"], values["speed_dps"] * DEG, values["encoder_counts"])):
            self.rows[name].append(one)


def unwrapped(time: np.ndarray, speed: np.ndarray, counts: np.ndarray, span_counts: int, span_turns: float) -> np.ndarray:
    """Angles that go on over turns of the encoder's span: the way that the reported speed says, or the short one."""
    span = 2 * np.pi * span_turns
    within = counts / span_counts * span
    expected = (speed[1:] + speed[:-1]) / 2 * np.diff(time)
    steps = expected + np.remainder(np.diff(within) - expected + span / 2, span) - span / 2
    return within[:1].sum() + np.concatenate(([0.0], np.cumsum(steps)))


def read_log(log: str, motor_name: str, motor: Motor, generation: Optional[str], id: Optional[int]) -> List[Track]:
    """The drives of a candump log that said enough of their shafts."""
    guessed = [json.loads(line) for line in run_guess(log).splitlines()]
    drives = [one for one in guessed if one["type"] == "drive" and one["drive"] and id in (None, one["drive"])]
    by_generation: Dict[str, List[Dict[str, Any]]] = defaultdict(list)
    for one in drives:
        by_generation[generation or one.get("nearest", "legacy")].append(one)
    tracks = []
    for spoken, ones in by_generation.items():
        wanted = {(one["interface"], one["drive"]): one for one in ones}
        built = {place: Builder(place[1]) for place in wanted}
        file, stamps, back = monotone(log)
        start = None
        with file:
            for frame in decoded(file, log, motor_name, spoken):
                place = (frame.get("interface"), frame.get("drive"))
                if frame["type"] != "frame" or (place not in wanted and place[1] != 0):
                    continue
                if "time_s" not in frame:
                    raise Unusable(f"identify: {printable(log)}: has no time stamps; candump -L writes them")
                at = stamps[frame["line"] - 1] if stamps else frame["time_s"]
                start = at if start is None else start
                if frame["role"] == "query":
                    for one in [place] if place in wanted else [key for key in wanted if key[0] == place[0]]:
                        built[one].query(frame, at - start)
                elif frame["role"] == "reply" and place in wanted:
                    built[place].answer(frame, at - start)
        for place, one in built.items():
            if len(one.rows["time"]) < FEWEST_SAMPLES:
                continue
            rows = {name: np.frombuffer(values) for name, values in one.rows.items()}
            span = motor.span_turns(wanted[place].get("quirks", {}).get("encoder_span", ""))
            angle = unwrapped(rows["time"], rows["speed"], rows.pop("counts"), motor.counts, span)
            orders = {name: np.frombuffer(values) if values else np.zeros(0) for name, values in one.orders.items()}
            tracks.append(
                Track(
                    interface=place[0], id=place[1], motor=motor, generation=spoken, generation_given=generation is not None,
                    fits=wanted[place].get("fits", []), span_turns=span, angle=angle, orders=Orders(**orders), gains=one.gains,
                    supply_V=one.volts / one.states if one.states else 0.0, queries=one.queries,
                    unanswered=one.queries - min(one.replies, one.queries), ambiguous=one.ambiguous, backwards=back, **rows,
                )
            )  # fmt: skip
    return tracks


def run_guess(log: str) -> str:
    try:
        return run_program("decode", log, "--guess", "--json")
    except Unusable as problem:
        said = str(problem).removeprefix("decode: ")
        raise Unusable(f"identify: {said if log in said else f'{printable(log)}: {said}'}") from None


def joined(track: Track, more: Track) -> Track:
    """What another log says of the same drive, after a gap in which nobody knows what it followed."""
    last = max(track.time[-1], track.orders.time[-1] if len(track.orders.time) else 0.0)
    shift = last + BETWEEN_LOGS_S
    gap = Orders(*(np.array([one]) for one in (last, NOTHING, 0.0, 0.0, 1.0)))
    moved = Orders(more.orders.time + shift, *(getattr(more.orders, key) for key in ("what", "value", "limit", "absolute")))

    def both(key: str, by: float = 0.0) -> np.ndarray:
        return np.concatenate((getattr(track, key), getattr(more, key) + by))

    orders = Orders(*(
        np.concatenate([getattr(one, key) for one in (track.orders, gap, moved)])
        for key in ("time", "what", "value", "limit", "absolute")
    ))  # fmt: skip
    return Track(
        interface=track.interface, id=track.id, motor=track.motor, generation=track.generation,
        generation_given=track.generation_given, fits=[one for one in track.fits if one in more.fits], span_turns=track.span_turns,
        time=both("time", shift),
        reply=both("reply", shift), iq=both("iq"), speed=both("speed"), angle=both("angle"),
        orders=orders, gains=more.gains or track.gains, supply_V=track.supply_V or more.supply_V,
        queries=track.queries + more.queries, unanswered=track.unanswered + more.unanswered,
        ambiguous=track.ambiguous + more.ambiguous, backwards=track.backwards + more.backwards,
    )  # fmt: skip


def read_tracks(logs: List[str], motor_name: str, motor: Motor, generation: Optional[str], id: Optional[int]) -> List[Track]:
    found: Dict[Any, Track] = {}
    for log in logs:
        for track in read_log(log, motor_name, motor, generation, id):
            place = (track.interface, track.id)
            found[place] = joined(found[place], track) if place in found else track
    return [found[place] for place in sorted(found)]
