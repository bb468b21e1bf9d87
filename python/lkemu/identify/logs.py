"""Reads the tracks of the drives of a log from the output stream of `lk-emu decode --json`."""

from __future__ import annotations

import json
import subprocess
import tempfile
from array import array
from collections import defaultdict
from typing import IO, Any, Dict, Iterator, List, Optional, Tuple

import numpy as np

from ..command import printable
from ..program import find_program
from .motor import DEG, Motor, Unusable, run_program
from .track import NOTHING, POSITION, SPEED, TORQUE, SetPoints, Track, joined

FEWEST_SAMPLES = 200  # replies with speed and angle: ten seconds at 20 Hz (assumed)
MAX_PENDING = 64  # pending queries per drive
STOPS = {"80", "81", "88", "A0", "18", "07"}
# Motion command: kind of set point, key of its value, and unit.
MOTION = {"torque": (TORQUE, "iq_A", 1.0), "speed": (SPEED, "speed_dps", DEG)}


def monotone(log: str) -> "tuple[IO[bytes], array[float], int]":
    """Returns the log with monotone stamps, the original stamps by line, and the number of stamps that went back.

    Monotone stamps are needed to pair replies with queries. If no stamp went back, the stamps by line are empty."""
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
            messages = errors.read().decode(errors="replace").strip().splitlines() or ["decode failed"]
            reason = messages[-1].removeprefix("lk-emu: ").removeprefix("decode: ")
            raise Unusable(f"identify: {printable(name)}: {reason}")


class Builder:
    """Collects samples and set points of one drive from the frames of one log."""

    def __init__(self, id: int) -> None:
        self.id = id
        self.rows = {name: array(code) for name, code in zip(("time", "reply", "iq", "speed", "counts"), "ddffH")}
        columns = zip(("time", "what", "value", "limit", "absolute"), "dbdfb")
        self.set_points = {name: array(code) for name, code in columns}
        self.gains: Optional[Dict[str, int]] = None
        self.volts, self.states, self.queries, self.replies, self.ambiguous = 0.0, 0, 0, 0, 0
        self.latest: Optional[Tuple[int, float, float]] = None  # last set point if absolute
        self.pending: List[Tuple[float, float]] = []  # pending queries: time of decode, stamp of the log

    def add_query(self, frame: Dict[str, Any], at: float) -> None:
        self.queries += 1
        self.pending.append((frame["time_s"], at))
        del self.pending[:-MAX_PENDING]
        self.note_gains(frame)
        values, name = frame.get("values", {}), frame.get("name", "")
        what, key, unit = MOTION.get(name, (NOTHING, "", 1.0))
        if what:
            value = values.get(key, values.get(str(self.id)))  # commands for several drives have values by ID
            if value is not None:
                self.add_set_point(at, what, value * unit)
        elif name.startswith("position"):
            if frame["drive"] == 0 and str(self.id) not in values:
                return
            absolute = frame["drive"] == 0 or ("angle_deg" in values and "multi-turn" in name)
            angle = values.get("angle_deg", values.get(str(self.id), 0.0)) * DEG
            self.add_set_point(at, POSITION, angle, values.get("max_speed_dps", 0.0) * DEG, absolute)
        elif frame.get("command") in STOPS:
            self.add_set_point(at, NOTHING, 0.0)

    def take_query(self, at: float) -> Optional[float]:
        """Takes the query that decode has at this time, and returns its stamp. Drops older queries as unanswered."""
        for n, (decoded_at, stamped) in enumerate(self.pending):
            if abs(decoded_at - at) < 1.5e-6:
                del self.pending[: n + 1]
                return stamped
        return None

    def add_set_point(self, at: float, what: int, value: float, limit: float = 0.0, absolute: bool = True) -> None:
        """Adds a set point. A repeated one is ignored unless it is an increment."""
        if absolute and (what, value, limit) == self.latest:
            return
        self.latest = (what, value, limit) if absolute else None
        for name, one in zip(self.set_points, (at, what, value, limit, absolute)):
            self.set_points[name].append(one)

    def note_gains(self, frame: Dict[str, Any]) -> None:
        values = frame.get("values", {})
        if "speed_kp" in values and "angle_kp" in values:
            self.gains = {key: int(value) for key, value in values.items() if key.endswith(("_kp", "_ki"))}

    def add_reply(self, frame: Dict[str, Any], at: float) -> None:
        self.replies += 1
        values = frame.get("values", {})
        self.note_gains(frame)
        if "voltage_V" in values:
            self.volts += values["voltage_V"]
            self.states += 1
        self.ambiguous += frame.get("choices", 0) > 1
        queried = self.take_query(frame["time_s"] - frame["latency_ms"] / 1e3) if "latency_ms" in frame else None
        if queried is None or "iq_A" not in values or "encoder_counts" not in values:
            return
        if self.rows["time"] and queried <= self.rows["time"][-1]:
            return
        for name, one in zip(self.rows, (queried, at, values["iq_A"], values["speed_dps"] * DEG, values["encoder_counts"])):
            self.rows[name].append(one)


def unwrapped(time: np.ndarray, speed: np.ndarray, counts: np.ndarray, span_counts: int, span_turns: float) -> np.ndarray:
    """Unwraps the angles of the encoder field. Each step is the closest to the reported speed times the interval."""
    span = 2 * np.pi * span_turns
    within = counts / span_counts * span
    expected = (speed[1:] + speed[:-1]) / 2 * np.diff(time)
    steps = expected + np.remainder(np.diff(within) - expected + span / 2, span) - span / 2
    return within[:1].sum() + np.concatenate(([0.0], np.cumsum(steps)))


Place = Tuple[str, int]  # interface and ID of a drive


def fill(builders: Dict[Place, Builder], log: str, motor: str, generation: str) -> int:
    """Passes each frame of the log to its drives; returns the number of stamps that went back."""
    file, stamps, back = monotone(log)
    start = None
    with file:
        for frame in decoded(file, log, motor, generation):
            place = (frame.get("interface"), frame.get("drive"))
            if frame["type"] != "frame" or (place not in builders and place[1] != 0):
                continue
            if "time_s" not in frame:
                raise Unusable(f"identify: {printable(log)}: has no time stamps; candump -L writes them")
            at = stamps[frame["line"] - 1] if stamps else frame["time_s"]
            start = at if start is None else start
            if frame["role"] == "query":
                for one in [place] if place in builders else [key for key in builders if key[0] == place[0]]:
                    builders[one].add_query(frame, at - start)
            elif frame["role"] == "reply" and place in builders:
                builders[place].add_reply(frame, at - start)
    return back


def read_log(log: str, motor_name: str, motor: Motor, generation: Optional[str], id: Optional[int]) -> List[Track]:
    """Returns the drives of a candump log that have at least FEWEST_SAMPLES samples."""
    guessed = [json.loads(line) for line in run_guess(log).splitlines()]
    drives = [one for one in guessed if one["type"] == "drive" and one["drive"] and id in (None, one["drive"])]
    by_generation: Dict[str, Dict[Place, Dict[str, Any]]] = defaultdict(dict)
    for one in drives:
        by_generation[generation or one.get("nearest", "legacy")][one["interface"], one["drive"]] = one
    tracks = []
    for firmware, wanted in by_generation.items():
        builders = {place: Builder(place[1]) for place in wanted}
        back = fill(builders, log, motor_name, firmware)
        for place, one in builders.items():
            if len(one.rows["time"]) < FEWEST_SAMPLES:
                continue
            rows, set_points = as_arrays(one.rows), as_arrays(one.set_points)
            quirks = wanted[place].get("quirks", {})
            span = motor.span_turns(quirks.get("encoder_span", ""))
            span_counts = motor.counts(firmware, quirks.get("encoder_bits", ""))
            angle = unwrapped(rows["time"], rows["speed"], rows.pop("counts"), span_counts, span)
            tracks.append(
                Track(
                    interface=place[0], id=place[1], motor=motor, generation=firmware, generation_given=generation is not None,
                    fits=wanted[place].get("fits", []), span_turns=span, span_counts=span_counts, angle=angle,
                    set_points=SetPoints(**set_points), gains=one.gains,
                    supply_V=one.volts / one.states if one.states else 0.0, queries=one.queries,
                    unanswered=one.queries - min(one.replies, one.queries), ambiguous=one.ambiguous, backwards=back, **rows,
                )
            )  # fmt: skip
    return tracks


def as_arrays(columns: "Dict[str, array[Any]]") -> Dict[str, np.ndarray]:
    """Views of the columns as numpy arrays, without a copy."""
    return {name: np.frombuffer(values, values.typecode) if values else np.zeros(0) for name, values in columns.items()}


def run_guess(log: str) -> str:
    try:
        return run_program("decode", log, "--guess", "--json")
    except Unusable as problem:
        reason = str(problem).removeprefix("decode: ")
        raise Unusable(f"identify: {reason if log in reason else f'{printable(log)}: {reason}'}") from None


def read_tracks(logs: List[str], motor_name: str, motor: Motor, generation: Optional[str], id: Optional[int]) -> List[Track]:
    found: Dict[Any, Track] = {}
    for log in logs:
        for track in read_log(log, motor_name, motor, generation, id):
            place = (track.interface, track.id)
            found[place] = joined(found[place], track) if place in found else track
    return [found[place] for place in sorted(found)]
