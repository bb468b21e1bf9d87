"""Writes the script of --plan: 30 s of rest, speeds, torque pulses and moves, to be run on the real motor."""

from __future__ import annotations

import json
import os
import subprocess
from dataclasses import dataclass
from typing import List, Optional, Tuple

from ..command import printable
from ..program import find_program
from .motor import DEG, Motor, Unusable

REST_S, SPEED_S, MOVE_S = 1.5, 2.0, 0.5
SPEED_SHARES = (0.1, -0.1, 0.2, -0.2, 1.0, -1.0)
PULSES, PULSE_S, PULSE_SHARES = 130, (0.02, 0.04, 0.06), (1.0, 0.7)
MOVES_DEG = (90.0, 0.0, 180.0, 0.0, 90.0, -90.0, 0.0)
MOST_SPEED_DPS, TRAVEL_TURNS, RATE_HZ = 720.0, 20.0, 200.0
# Exchanges from excess speed to the end of the torque: a reply is one exchange old, and hosts jitter (assumed).
REACTION_STEPS = 2.5
PLACE = "# (identify inserts the constants of the plan here)\n"


@dataclass
class Limits:
    """Limits of the experiment, at the rotor."""

    current_A: float
    speed_dps: float  # highest steady speed
    dps_per_A_s: float  # highest acceleration per ampere

    @property
    def reach_dps(self) -> float:
        """Speed that a pulse adds before the script reacts to excess speed."""
        return self.dps_per_A_s * self.current_A * REACTION_STEPS / RATE_HZ

    @property
    def pulse_dps(self) -> float:
        """Speed at which pulses end. Overshoot stays below twice `speed_dps` unless `reach_dps` exceeds `speed_dps`."""
        return max(2 * self.speed_dps - self.reach_dps, self.speed_dps)

    @property
    def most_dps(self) -> float:
        return self.pulse_dps + self.reach_dps

    @property
    def late_dps(self) -> float:
        """Speed that the rotor gains while the host is 10 ms late."""
        return 0.01 * self.dps_per_A_s * self.current_A


def plan_limits(motor: Motor) -> Limits:
    """Current: three times the friction, at most half the sensor range. Speed: a twentieth of the no-load speed.

    All shares are assumed. The file has the inertia of the free rotor; a load reduces the acceleration."""
    inertia = motor.J + motor.J_out / motor.N**2
    dps_per_A_s = motor.k_t / inertia / DEG
    speed_dps = min(MOST_SPEED_DPS, motor.no_load_rad_s / DEG / 20)
    current_A = min(3 * (motor.coulomb + motor.coulomb_out / motor.N) / motor.k_t, motor.number("current_sensor", "range_A") / 2)
    return Limits(current_A, speed_dps, dps_per_A_s)


def plan_steps(limits: Limits) -> List[Tuple[str, float, float]]:
    """Returns (kind, value in A, dps or degrees, seconds).

    The signs of the pulses come in pairs with a pseudo-random order. At most two equal signs follow each other, so the
    shaft stays near its start."""
    steps = [("torque", 0.0, REST_S)]
    steps += [("speed", share * limits.speed_dps, SPEED_S) for share in SPEED_SHARES]
    steps.append(("torque", 0.0, MOVE_S))
    state, sign = 0xACE1, 1.0
    for n in range(PULSES):
        for _ in range(5):  # 16-bit Galois linear-feedback shift register
            state = state >> 1 ^ (0xB400 if state & 1 else 0)
        sign = -sign if n % 2 else (1.0 if state & 1 else -1.0)
        seconds = PULSE_S[(state >> 5) % len(PULSE_S)]
        steps.append(("torque", sign * PULSE_SHARES[state >> 3 & 1] * limits.current_A, seconds))
        steps.append(("torque", 0.0, seconds))
    return steps + [("position", move, MOVE_S) for move in MOVES_DEG]


def dialect(motor_name: str, generation: str) -> Tuple[float, List[int]]:
    """Returns A per LSB of 0xA1, and the initial queries that this generation supports."""
    frames = "(0.000000) can0 141#A1000000E8030000\n(1.000000) can0 141#3000000000000000\n(2.000000) can0 141#8C00000000000000\n"
    words = [find_program(), "decode", "-", "--json", "--motor", motor_name, "--generation", generation]
    done = subprocess.run(words, input=frames, capture_output=True, text=True)
    if done.returncode != 0:
        raise Unusable(done.stderr.strip().splitlines()[-1].removeprefix("lk-emu: "))
    read = [json.loads(line) for line in done.stdout.splitlines()]
    known = [int(one["command"], 16) for one in read[1:3] if "drawback" not in one]
    return read[0]["values"]["iq_A"] / 1000, [0x9A, *known]


def plan_script(motor: Motor, motor_name: str, id: int, generation: str, limits: Limits) -> str:
    lsb, queries = dialect(motor_name, generation)
    steps = "".join(f'    ("{what}", {value:.4g}, {seconds:.3g}),\n' for what, value, seconds in plan_steps(limits))
    constants = (
        f"MOTOR, DRIVE, GENERATION = {json.dumps(printable(motor_name))}, {id}, {json.dumps(generation)}\n"
        f"QUERY_ID, REPLY_ID = 0x140 + {id}, 0x140 + {id}\n"
        f"A_PER_LSB = {lsb!r}\n"
        f"COUNTS, ROTOR_TURNS = {motor.counts(generation)}, {motor.span_turns():g}  # span of the encoder field\n"
        f"FIRST_QUERIES = [{', '.join(f'0x{one:02X}' for one in queries)}]\n"
        f"RATE_HZ = {RATE_HZ:g}\n"
        f"SPEED_DPS = {limits.speed_dps:g}  # highest steady speed\n"
        f"PULSE_DPS = {limits.pulse_dps:.0f}  # torque pulses end at this speed\n"
        f"MOST_DPS = {limits.most_dps:.0f}  # highest speed if the host is on time; coasts above 1.25 times this\n"
        f"TRAVEL_TURNS = {TRAVEL_TURNS:g}  # rotor turns to either side\n"
        f"# kind, value in A or dps or degrees from the start, seconds\nSTEPS = [\n{steps}]\n"
    )
    with open(os.path.join(os.path.dirname(__file__), "excite.py.in"), encoding="utf-8") as file:
        return file.read().replace(PLACE, constants)


def write_plan(motor: Motor, motor_name: str, id: Optional[int], generation: Optional[str]) -> Tuple[str, str]:
    """Returns the script and its summary for the user."""
    if not motor.reports_current:
        raise Unusable(f"identify: {printable(motor_name)}: MS motors report no current and cannot be identified")
    if id is None:
        raise Unusable("identify: --plan needs --id, the drive to move")
    assumed = generation or "legacy"
    if assumed == "seen":
        assumed = motor.data.get("seen_generation") or "seen"
    limits = plan_limits(motor)
    script = plan_script(motor, motor_name, id, assumed, limits)
    summary = (
        f"moves drive {id} for 30 s, with up to {limits.current_A:.2f} A and {limits.most_dps:.0f} dps at its rotor, "
        f"{limits.late_dps:.0f} dps more if the host is 10 ms late. It asks before it moves.\nThe shaft must be free."
    )
    if generation is None:
        summary += (
            f"\nIt assumes generation {assumed}. With another generation its currents may be too small: "
            "set it with --generation."
        )
    return script, summary
