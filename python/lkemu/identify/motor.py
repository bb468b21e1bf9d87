"""Parameters of motor files in SI units. `lk-emu motors` finds the files."""

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

WIRE_BITS = 16  # the field of wider encoders has their top 16 bits
DEG = math.pi / 180


class Unusable(StartError):
    """Invalid input: one line of text, exit status 2."""


def run_program(*words: str) -> str:
    """Runs lk-emu and returns its output. Raises Unusable with the last line of its errors."""
    done = subprocess.run([find_program(), *words], stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if done.returncode != 0:
        messages = done.stderr.strip().splitlines() or [f"status {done.returncode}"]
        raise Unusable(messages[-1].removeprefix("lk-emu: "))
    return done.stdout


def is_path(name: str) -> bool:
    return "/" in name or name.endswith(".toml")


def merged(paths: List[str]) -> Dict[str, Any]:
    """Merges a valid motor file with the files that it extends. `paths` begins with the motor file itself."""
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
    """Known parameters: Nm, kg·m², rad. Values are at the rotor; names with `out` are at the output."""

    name: str
    path: str
    data: Dict[str, Any]

    def number(self, section: str, key: str, unit: float = 1.0) -> float:
        return float(self.data[section][key]) * unit

    def texture(self, section: str, key: str, unit: float = 1.0) -> float:
        """Returns 0 for a number that the file leaves to the rule of [stator]."""
        return float(self.data[section].get(key, 0.0)) * unit

    @property
    def model(self) -> str:
        return str(self.data["model"])

    @property
    def series(self) -> str:
        return str(self.data["series"])

    @property
    def reports_current(self) -> bool:
        """False for MS drives, which report a share of the voltage instead."""
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
        """Angle of the rotor until the output follows, rad."""
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
        return self.texture("mechanics", "tau_cogging_mNm", 1e-3)

    @cached_property
    def supply_V(self) -> float:
        return self.number("supply", "v_source_V")

    @cached_property
    def resistance(self) -> float:
        """Resistance of a phase, its switch and half the supply, ohm."""
        return (
            self.number("motor", "R_s_ohm")
            + self.number("inverter", "R_on_mohm", 1e-3)
            + self.number("supply", "R_source_ohm") / 2
        )

    @cached_property
    def modulation(self) -> float:
        """Largest phase voltage over supply voltage (docs/internals/model.md §9)."""
        return (2 * self.number("inverter", "duty_max") - 1) / math.sqrt(3)

    def counts(self, generation: str, encoder_bits: str = "") -> int:
        """Counts of the encoder field; `encoder_bits` overrides motor and generation (docs/start/which-drive.md)."""
        later_firmware = self.series == "MF" and generation != "legacy"
        bits = WIRE_BITS if later_firmware else int(self.data["encoder"]["bits"])
        return 1 << min(WIRE_BITS, int(encoder_bits or bits))

    def span_turns(self, encoder_span: str = "") -> float:
        """Rotor turns that the encoder field spans; `encoder_span` overrides that of the file."""
        return self.N if (encoder_span or self.data["encoder_span"]) == "output_turn" else 1.0

    @cached_property
    def motion_period_s(self) -> float:
        return self.number("control", "motion_divider") / self.number("inverter", "f_pwm_kHz", 1e3)

    def gain_bytes(self) -> Dict[str, int]:
        return dict(self.data["factory"]["gains"])

    def loops(self, gains: "Dict[str, int] | None" = None) -> Dict[str, float]:
        """Converts gain bytes to angle_kp in 1/s, speed_kp in A·s/rad and speed_ki in A/rad.

        Source: docs/internals/model.md §11."""
        c, g = self.data["control"], gains or self.gain_bytes()
        kp = c["speed_bandwidth_rad_s"] * c["J_nominal_g_cm2"] * 1e-7 / self.k_t
        return {
            "angle_kp": c["angle_kp_per_byte_per_s"] * g["angle_kp"],
            "speed_kp": kp * g["speed_kp"] / c["ref_speed_kp_byte"],
            "speed_ki": kp * c["speed_integral_rate_per_s"] * g["speed_ki"] / c["ref_speed_ki_byte"],
        }

    @cached_property
    def no_load_rad_s(self) -> float:
        """No-load speed of the rotor at the file's supply, with dead time and friction (docs/internals/model.md)."""
        R = self.number("motor", "R_s_ohm") + self.number("inverter", "R_on_mohm", 1e-3)
        dead = 4 / math.pi * self.number("inverter", "t_dead_ns", 1e-9) * self.number("inverter", "f_pwm_kHz", 1e3)
        friction_A = (self.coulomb + self.coulomb_out / self.N) / self.k_t
        left_V = (self.modulation - dead) * self.supply_V - R * friction_A
        return left_V / (self.k_t / 1.5 + R * self.viscous / self.k_t)


def load_motor(name: str, option: str = "--motor") -> Motor:
    """Loads a motor by name or path. Raises Unusable."""
    try:
        listing = run_program("motors", name)
    except Unusable as problem:
        raise Unusable(f"{option}: {str(problem).removeprefix('motors: ')}") from None
    found = [re.fullmatch(r"  (?:file|extends) (.+)", line) for line in listing.splitlines()]
    paths = [one[1] for one in found if one]
    data = merged(paths)
    field = re.search(r"^  encoder +(\d+) bit; replies span a turn of the (\w+)$", listing, re.MULTILINE)
    assert field is not None
    data["encoder"]["bits"], data["encoder_span"] = int(field[1]), f"{field[2]}_turn"  # the label may say so
    return Motor(os.path.basename(paths[0]).removesuffix(".toml"), os.path.abspath(paths[0]), data)
