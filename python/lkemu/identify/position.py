"""Position loop gain: fits an emulated drive with the identified parameters to the moves of the log."""

from __future__ import annotations

import csv
import json
import math
import os
import struct
import subprocess
import tempfile
from dataclasses import dataclass
from typing import Any, Dict, List, Optional, Tuple

import numpy as np
from scipy.optimize import least_squares

from ..program import find_program
from .balance import BalanceFit
from .estimate import Estimate
from .loops import constant_set_points
from .motor import DEG
from .timing import Timing
from .track import POSITION, Track

MOST_MOVES_S, LEAST_MOVE_RAD = 6.0, 0.1  # Longest part of the log that is emulated; least travel in it (assumed).
# Longest sample interval in units of 1/Kp, and largest rms error of an accepted emulation (assumed).
LONGEST_STEP, FARTHEST_RAD = 1.6, 0.01
UNSEEN = 0.035  # Relative error of Kp beyond the fit: twice the rms of nine simulated motors.
UNKNOWN_GAIN = 1.0  # Prior deviation of the logarithm of a gain: a factor of e either way.
BOOT_S, RATE_HZ, T_95 = 0.3, 2000, 1.96
DELAY_MS = 0.2  # Prior deviation of the delay (assumed).
ANGLE_KP, SPEED_KP, SPEED_KI, J, FRICTION, DELAY = range(6)  # Logarithms of factors; DELAY in ms.
STEP = 0.01


@dataclass
class PositionFit:
    kp: Estimate  # 1/s
    time: np.ndarray
    logged: np.ndarray  # rad from the start of the moves
    emulated: np.ndarray


def moves_of(track: Track) -> Optional[Tuple[int, int, float]]:
    """Longest part without a gap under position commands: (first, last, offset of the multi-turn angle)."""
    best, zeros, begin, end = None, [], 0, -1
    for index, first, last in constant_set_points(track, POSITION):
        if first != end or not zeros:
            zeros, begin = [], first
        end = last
        zeros.append(track.set_points.value[index] - track.angle[last - 1])
        if track.time[last - 1] - track.time[begin] > MOST_MOVES_S:
            zeros = []  # the next part begins here
        elif best is None or last - begin > best[1] - best[0]:
            best = (begin, last, float(np.median(zeros)))
    if best is None or np.ptp(track.angle[best[0] : best[1]]) < LEAST_MOVE_RAD:
        return None
    return best


class Emulation:
    """Repeats the moves of the log with an emulated drive."""

    def __init__(self, track: Track, timing: Timing, balance: BalanceFit, moves: Tuple[int, int, float], folder: str) -> None:
        motor, k = track.motor, track.motor.k_t
        self.track, self.folder, self.moves = track, folder, moves
        self.time = timing.time[moves[0] : moves[1]]
        self.logged = track.angle[moves[0] : moves[1]] - track.angle[moves[0]]
        self.delay_s = balance.delay_s + balance.lag_s - 1 / motor.number("control", "current_bandwidth_rad_s")
        self.set_points, self.at = track.set_points, timing.set_points
        m = {key: float(value) for key, value in motor.data["mechanics"].items()}
        excess = motor.static / max(motor.coulomb, 1e-9)
        coulomb = max(balance.coulomb.value * k - motor.coulomb_out / motor.N / motor.efficiency, 0.0)
        m["J_g_cm2"] = max(balance.inertia.value * k - motor.J_out / motor.N**2, 1e-8) * 1e7
        m["tau_coulomb_mNm"], m["tau_static_mNm"] = coulomb * 1e3, excess * coulomb * 1e3
        m["B_uNm_s_rad"] = max(balance.viscous.value * k, 0.0) * 1e6
        m["tau_cogging_mNm"], ahead = 0.0, 0.0
        for one in balance.cogging:
            if one.order != motor.pole_pairs and one.amplitude.is_usable:
                # Cogging is A·sin(n·θ + phase) in the log and A·sin(n·θ) in the emulation: the start angle is shifted.
                m["tau_cogging_mNm"], m["cogging_per_turn"] = one.amplitude.value * k * 1e3, one.order
                ahead = one.phase / one.order
                break
        self.mechanics = m
        self.control = dict(motor.data["control"])
        self.loop = ['quirks.current_loop = "fast"'] if motor.data["series"] in ("MF", "MH") else []
        self.boot = math.remainder(track.angle[moves[0]] + ahead, 2 * math.pi) / DEG
        self.start_deg = self._play([])[0]

    def _play(self, lines: List[str], by: "np.ndarray | None" = None) -> Any:
        """Runs lk-emu with these frames. Returns the start angle as in 0x92, and (times, true angles)."""
        by = np.zeros(6) if by is None else np.clip(by, -3, 3)
        m, c, track = dict(self.mechanics), dict(self.control), self.track
        m["J_g_cm2"] *= math.exp(by[J])
        for key in ("tau_coulomb_mNm", "tau_static_mNm"):
            m[key] *= math.exp(by[FRICTION])
        c["angle_kp_per_byte_per_s"] *= math.exp(by[ANGLE_KP])
        c["speed_bandwidth_rad_s"] *= math.exp(by[SPEED_KP])
        c["speed_integral_rate_per_s"] *= math.exp(by[SPEED_KI] - by[SPEED_KP])
        settings = {key: value for key, value in (track.gains or {}).items()}
        gains = {key.replace("iq_", "current_"): value for key, value in settings.items()}
        keys: Dict[str, Any] = {f"profile.mechanics.{key}": value for key, value in m.items()}
        keys.update({f"profile.control.{key}": value for key, value in c.items()})
        keys.update({f"profile.encoder.{key}": 0 for key in ("noise_deg", "inl_1_deg", "inl_2_deg")})
        keys.update({"profile.current_sensor.noise_A": 0, "profile.current_sensor.offset_a_A": 0, "profile.current_sensor.offset_b_A": 0,
                     "profile.motor.torque_ripple": 0, "profile.slow_sensor.v_noise_V": 0, "boot_angle_deg": self.boot})
        keys.update({f"settings.gains.{key}": value for key, value in gains.items()})
        robot = ["bitrate = 0", "[[bus]]", 'interface = "log"', "[[bus.drive]]", "id = 1", "reply_time_us = 0",
                 f"motor = {json.dumps(track.motor.path)}", 'generation = "legacy"', 'specimen = "nominal"', *self.loop,
                 *(f"{key} = {json.dumps(value)}" for key, value in keys.items())]  # fmt: skip
        duration = BOOT_S + (self.time[-1] - self.time[0] if lines else 0) + 0.01
        scenario = ["robot = \"robot.toml\"", f"duration_s = {duration:.3f}"]
        scenario += ["[[send]]", 'play = "moves.log"', f"from_s = {lines[0][1:lines[0].index(')')]}"] if lines else []
        scenario += ["[[expect]]", 'says = "the drive runs"', "id = 1", 'signal = "temperature_C"', "min = -100"]
        for name, text in (("robot.toml", robot), ("moves.toml", scenario), ("moves.log", lines)):
            with open(os.path.join(self.folder, name), "w", encoding="utf-8") as file:
                file.write("\n".join(text) + "\n")
        out = os.path.join(self.folder, "moves.csv")
        words = ["run", os.path.join(self.folder, "moves.toml"), "--csv", out, "--signals", "angle_deg,true_rotor_deg"]
        done = subprocess.run([find_program(), *words, "--rate", str(RATE_HZ), "--quiet"], capture_output=True, text=True)
        if done.returncode not in (0, 3):
            raise RuntimeError(done.stderr.strip())
        with open(out, encoding="ascii") as file:
            rows = list(csv.reader(file))[1:]
        booted = rows[int((BOOT_S - 0.01) * RATE_HZ)]
        return float(booted[1]), np.array([[float(row[0]), float(row[2]) * DEG] for row in rows if row[2]]).T

    def run(self, by: np.ndarray) -> np.ndarray:
        """Emulated angle relative to the start, at each sample."""
        first, set_points = self.moves[0], self.set_points
        delay = self.delay_s + float(np.clip(by[DELAY], -3, 3)) * 1e-3
        zero = self.time[0] - BOOT_S
        n = max(int(np.searchsorted(self.at, self.time[0], side="right")) - 1, 0)
        lines = []
        while n < len(self.at) and self.at[n] + delay <= self.time[-1]:
            way = set_points.value[n] - self.moves[2] - self.track.angle[first]
            target_cdeg = round(100 * (self.start_deg + way / DEG))
            frame = struct.pack("<BxHi", 0xA4, round(set_points.limit[n] / DEG), target_cdeg)
            lines.append(f"({max(BOOT_S, self.at[n] + delay - zero):.6f}) log 141#{frame.hex().upper()}")
            n += 1
        _, (time, angle) = self._play(lines, by)
        made = np.interp(self.time - zero, time, angle)
        return made - np.interp(BOOT_S, time, angle)


def correlation_length(residuals: np.ndarray) -> float:
    """Number of correlated residuals that count as one independent residual."""
    length, squares = 1.0, float(residuals @ residuals)
    for lag in range(1, len(residuals) // 4):
        rho = float(residuals[:-lag] @ residuals[lag:]) / squares
        if rho < 0.05:
            break
        length += 2 * rho
    return length


def fit_position_loop(track: Track, timing: Timing, balance: BalanceFit, speed_kp: Optional[Estimate],
                      speed_ki: Optional[Estimate]) -> Optional[PositionFit]:  # fmt: skip
    moves = moves_of(track)
    loops = track.motor.loops(track.gains)
    # Gravity on an arm causes a position error, which looks like a smaller gain.
    if moves is None or balance.gravity or min(loops.values()) <= 0:
        return None
    if balance.inertia.letter == "U" or balance.coulomb.letter == "U":
        return None
    expected, deviation = np.zeros(6), np.full(6, UNKNOWN_GAIN)
    deviation[DELAY] = DELAY_MS
    for which, prior, one in ((SPEED_KP, speed_kp, loops["speed_kp"]), (SPEED_KI, speed_ki, loops["speed_ki"]),
                              (J, balance.inertia, balance.inertia.value), (FRICTION, balance.coulomb, balance.coulomb.value)):  # fmt: skip
        if prior is not None and prior.letter != "U":
            expected[which] = math.log(prior.value / one)
            deviation[which] = max(prior.half_width / prior.value / T_95, 1e-3)
    with tempfile.TemporaryDirectory() as folder:
        try:
            emulation = Emulation(track, timing, balance, moves, folder)
            noise, at = 1e-3, expected.copy()

            def residuals(by: np.ndarray) -> np.ndarray:
                return np.concatenate(((emulation.run(by) - emulation.logged) / noise, (by - expected) / deviation))

            for _ in range(2):  # the first fit gives the noise for the second
                found = least_squares(residuals, at, method="lm", diff_step=STEP, x_scale=np.full(6, 0.3), max_nfev=40,
                                      ftol=1e-3, xtol=1e-3)  # fmt: skip
                at = found.x
                rest = found.fun[: len(emulation.time)]
                noise *= math.sqrt(float(np.mean(rest**2)) * correlation_length(rest))
            emulated = emulation.run(at)
        except RuntimeError:
            return None  # lk-emu rejects the parameters
    jacobian = found.jac.copy()
    jacobian[: len(emulation.time)] /= math.sqrt(float(np.mean(rest**2)) * correlation_length(rest))
    covariance = np.linalg.inv(jacobian.T @ jacobian)
    kp = loops["angle_kp"] * math.exp(at[ANGLE_KP])
    width = kp * math.hypot(UNSEEN, T_95 * math.sqrt(covariance[ANGLE_KP, ANGLE_KP]))
    fit = PositionFit(Estimate(kp, width), emulation.time - emulation.time[0], emulation.logged, emulated)
    rms = float(np.sqrt(np.mean((emulated - emulation.logged) ** 2)))
    return fit if kp * track.step_s <= LONGEST_STEP and rms <= FARTHEST_RAD else None
