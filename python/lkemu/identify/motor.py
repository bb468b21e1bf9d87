"""Motor files, in SI, as `lk-emu motors` finds them."""

from __future__ import annotations

import math
import os
import re
import subprocess
import tomllib
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Dict, List

from ..errors import StartError
from ..program import find_program

WIRE_BITS = 16  # wider encoders show their top 16 bits
DEG = math.pi / 180


class Unusable(StartError):
    """Input that nothing can be made of: one line, exit status 2."""


def run_program(*words: str) -> str:
    """What lk-emu prints; its last line is the reason where it refuses."""
    done = subprocess.run([find_program(), *words], stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if done.returncode != 0:
        said = done.stderr.strip().splitlines() or [f"status {done.returncode}"]
        raise Unusable(said[-1].removeprefix("lk-emu: "))
    return done.stdout


def is_path(name: str) -> bool:
    return "/" in name or name.endswith(".toml")


def merged(paths: List[str]) -> Dict[str, Any]:
    """The tables of a motor file that `lk-emu motors` has found to be right, over those that it extends: they follow it."""
    data: Dict[str, Any] = {}

    def over(below: Dict[str, Any], above: Dict[str, Any]) -> None:
        for key, value in above.items():
            if isinstance(value, dict) and isinstance(below.get(key), dict):
                over(below[key], value)
            else:
                below[key] = value

    for path in reversed(paths):
        with open(path, "rb") as file:
            over(data, tomllib.load(file))
    return data


@dataclass
class Motor:
    """What is known beforehand. Torques in Nm, inertias in kg·m², angles in rad, at the rotor unless it says out."""

    name: str
    path: str
    data: Dict[str, Any]

    def number(self, section: str, key: str, unit: float = 1.0) -> float:
        return float(self.data[section][key]) * unit

    @property
    def model(self) -> str:
        return str(self.data["model"])

    @property
    def series(self) -> str:
        return str(self.data["series"])

    @property
    def reports_current(self) -> bool:
        """An MS drive reports a share of the voltage in its place."""
        return bool(self.data["control"]["has_current_loop"])

    @cached_property
    def pole_pairs(self) -> int:
        return int(self.data["motor"]["pole_pairs"])

    @cached_property
    def k_t(self) -> float:
        return 1.5 * self.pole_pairs * self.number("motor", "psi_f_Wb")

    @cached_property
    def N(self) -> float:
        return self.number("mechanics", "gear_ratio")

    @cached_property
    def efficiency(self) -> float:
        return self.number("mechanics", "gear_efficiency")

    @cached_property
    def J(self) -> float:
        return self.number("mechanics", "J_g_cm2", 1e-7)

    @cached_property
    def J_out(self) -> float:
        return self.number("mechanics", "J_out_g_cm2", 1e-7)

    @cached_property
    def backlash(self) -> float:
        """Of the rotor: how far it turns until the output follows."""
        return self.number("mechanics", "backlash_arcmin", DEG / 60) * self.N

    @cached_property
    def coulomb(self) -> float:
        return self.number("mechanics", "tau_coulomb_mNm", 1e-3)

    @cached_property
    def static(self) -> float:
        return self.number("mechanics", "tau_static_mNm", 1e-3)

    @cached_property
    def coulomb_out(self) -> float:
        return self.number("mechanics", "tau_coulomb_out_mNm", 1e-3)

    @cached_property
    def stribeck(self) -> float:
        return self.number("mechanics", "omega_stribeck_rad_s")

    @cached_property
    def viscous(self) -> float:
        return self.number("mechanics", "B_uNm_s_rad", 1e-6)

    @cached_property
    def cogging(self) -> float:
        return self.number("mechanics", "tau_cogging_mNm", 1e-3)

    @cached_property
    def supply_V(self) -> float:
        return self.number("supply", "v_source_V")

    @cached_property
    def resistance(self) -> float:
        """Of a phase, its switch and half the supply."""
        return (
            self.number("motor", "R_s_ohm")
            + self.number("inverter", "R_on_mohm", 1e-3)
            + self.number("supply", "R_source_ohm") / 2
        )

    @cached_property
    def modulation(self) -> float:
        """The largest voltage of a phase, over the supply's (docs/internals/model.md §9)."""
        return (2 * self.number("inverter", "duty_max") - 1) / math.sqrt(3)

    @cached_property
    def counts(self) -> int:
        """Of the encoder field."""
        return 1 << min(WIRE_BITS, int(self.data["encoder"]["bits"]))

    def span_turns(self, said: str = "") -> float:
        """How many turns of the rotor the encoder field spans; `said`: encoder_span, where it is known better."""
        return self.N if (said or self.data["encoder_span"]) == "output_turn" else 1.0

    @cached_property
    def motion_period_s(self) -> float:
        return self.number("control", "motion_divider") / self.number("inverter", "f_pwm_kHz", 1e3)

    def gain_bytes(self) -> Dict[str, int]:
        return dict(self.data["factory"]["gains"])

    def loops(self, gains: "Dict[str, int] | None" = None) -> Dict[str, float]:
        """The gains that bytes make: angle_kp 1/s, speed_kp A·s/rad, speed_ki A/rad (docs/internals/model.md §11)."""
        c, g = self.data["control"], gains or self.gain_bytes()
        kp = c["speed_bandwidth_rad_s"] * c["J_nominal_g_cm2"] * 1e-7 / self.k_t
        return {
            "angle_kp": c["angle_kp_per_byte_per_s"] * g["angle_kp"],
            "speed_kp": kp * g["speed_kp"] / c["ref_speed_kp_byte"],
            "speed_ki": kp * c["speed_integral_rate_per_s"] * g["speed_ki"] / c["ref_speed_ki_byte"],
        }

    @cached_property
    def no_load_rad_s(self) -> float:
        """Of the rotor, at the supply of the file: voltage less dead time and friction over the flux (model.md)."""
        R = self.number("motor", "R_s_ohm") + self.number("inverter", "R_on_mohm", 1e-3)
        dead = 4 / math.pi * self.number("inverter", "t_dead_ns", 1e-9) * self.number("inverter", "f_pwm_kHz", 1e3)
        friction_A = (self.coulomb + self.coulomb_out / self.N) / self.k_t
        left_V = (self.modulation - dead) * self.supply_V - R * friction_A
        return left_V / (self.k_t / 1.5 + R * self.viscous / self.k_t)


def load_motor(name: str, option: str = "--motor") -> Motor:
    """By its name or path; raises Unusable."""
    try:
        listing = run_program("motors", name)
    except Unusable as problem:
        raise Unusable(f"{option}: {str(problem).removeprefix('motors: ')}") from None
    found = [re.fullmatch(r"  (?:file|extends) (.+)", line) for line in listing.splitlines()]
    paths = [one[1] for one in found if one]
    return Motor(os.path.basename(paths[0]).removesuffix(".toml"), os.path.abspath(paths[0]), merged(paths))
