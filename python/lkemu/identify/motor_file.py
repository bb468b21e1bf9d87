"""Writes the motor file of --output, and reads its table [identified] for --expect."""

from __future__ import annotations

import math
import re
import tomllib
from typing import List

from ..command import printable
from .estimate import Estimate
from .motor import Unusable
from .quantities import QUANTITIES, Drive, Expected


def toml_string(text: str) -> str:
    return '"' + printable(text).replace("\\", "\\\\").replace('"', '\\"') + '"'


class Section:
    def __init__(self, drive: Drive, name: str) -> None:
        self.drive, self.name, self.lines = drive, name, ""

    def add(self, key: str, value: float, origin: str) -> None:
        """`origin`: key of the quantity from which the value is computed."""
        found, quantity = self.drive.values[origin], next(one for one in QUANTITIES if one.key == origin)
        assert found is not None
        off = abs(found.half_width / found.value) * 100
        self.lines += f"{key:<26} = {value:<11.5g} # {found.letter}: ±{off:.2g} %, from {quantity.how}\n"

    def add_line(self, line: str) -> None:
        self.lines += line + "\n"

    def text(self) -> str:
        return f"\n[{self.name}]\n{self.lines}" if self.lines else ""


def efficiency_of(drive: Drive) -> float:
    return 1 - drive.number("gear_loss") if drive.is_usable("gear_loss") else drive.track.motor.efficiency


def mechanics(drive: Drive, k_t: float) -> Section:
    motor, section = drive.track.motor, Section(drive, "mechanics")
    if drive.is_usable("inertia_A_s2_rad"):
        J = drive.number("inertia_A_s2_rad") * k_t - motor.J_out / motor.N**2
        section.add("J_g_cm2", max(J * 1e7, 0.1), "inertia_A_s2_rad")
    if drive.is_usable("coulomb_A"):
        tau = max(drive.number("coulomb_A") * k_t - motor.coulomb_out / motor.N / efficiency_of(drive), 0.0)
        excess = motor.static / motor.coulomb if motor.coulomb > 0 else 1.0
        section.add("tau_coulomb_mNm", tau * 1e3, "coulomb_A")
        origin = f"ratio to tau_coulomb_mNm as in {printable(motor.name)}"
        section.add_line(f"{'tau_static_mNm':<26} = {excess * tau * 1e3:<11.5g} # {origin}")
    if drive.is_usable("viscous_A_s_rad"):
        section.add("B_uNm_s_rad", drive.number("viscous_A_s_rad") * k_t * 1e6, "viscous_A_s_rad")
    cogging = drive.cogging()
    if drive.is_usable("cogging_A") and cogging:
        section.add("tau_cogging_mNm", drive.number("cogging_A") * k_t * 1e3, "cogging_A")
        section.add_line(f"{'cogging_per_turn':<26} = {cogging.order}")
    if drive.is_usable("gear_loss"):
        section.add("gear_efficiency", efficiency_of(drive), "gear_loss")
    return section


def control(drive: Drive, k_t: float) -> Section:
    base, section = drive.track.motor.data["control"], Section(drive, "control")
    gains = drive.track.gains or drive.track.motor.gain_bytes()
    if not drive.track.gains:
        section.add_line("# The log does not contain the gains: these values assume the factory gains.")
    J_nominal, bandwidth = base["J_nominal_g_cm2"] * 1e-7, base["speed_bandwidth_rad_s"]
    if drive.is_usable("speed_kp_A_s_rad") and gains["speed_kp"] > 0:
        bandwidth = drive.number("speed_kp_A_s_rad") * k_t / J_nominal * base["ref_speed_kp_byte"] / gains["speed_kp"]
        section.add("speed_bandwidth_rad_s", bandwidth, "speed_kp_A_s_rad")
    if drive.is_usable("speed_ki_A_rad") and gains["speed_ki"] > 0:
        rate = drive.number("speed_ki_A_rad") * k_t / J_nominal / bandwidth * base["ref_speed_ki_byte"] / gains["speed_ki"]
        section.add("speed_integral_rate_per_s", rate, "speed_ki_A_rad")
    if drive.is_usable("angle_kp_per_s") and gains["angle_kp"] > 0:
        section.add("angle_kp_per_byte_per_s", drive.number("angle_kp_per_s") / gains["angle_kp"], "angle_kp_per_s")
    if drive.is_usable("current_lag_s"):
        section.add("current_bandwidth_rad_s", 1 / drive.number("current_lag_s"), "current_lag_s")
    return section


def windings(drive: Drive) -> Section:
    motor, section = drive.track.motor, Section(drive, "motor")
    if drive.is_usable("R_ohm"):
        rest = motor.resistance - motor.number("motor", "R_s_ohm")
        section.add("R_s_ohm", drive.number("R_ohm") - rest, "R_ohm")
    if drive.is_usable("k_t_Nm_A"):
        section.add("psi_f_Wb", drive.number("k_t_Nm_A") / 1.5 / motor.pole_pairs, "k_t_Nm_A")
    return section


def load_lines(drive: Drive, k_t: float) -> str:
    if not drive.is_usable("gravity_A"):
        return ""
    found, eta = drive.values["gravity_A"], efficiency_of(drive)  # the estimate is the mean of lifting and lowering
    assert found is not None
    torque = found.value * k_t * drive.track.motor.N * 2 / (1 / eta + eta)
    off = found.half_width / found.value * 100
    return (
        "#\n# The load on the shaft belongs in the robot file:\n"
        f"#   load = {{ tau_gravity_Nm = {torque:.4g} }}  # {found.letter}: ±{off:.2g} %\n"
    )


def motor_text(drive: Drive, base: str, logs: List[str]) -> str:
    """Text of the motor file; `base` is its value of `extends`."""
    motor, own_k_t = drive.track.motor, drive.is_usable("k_t_Nm_A")
    k_t = drive.number("k_t_Nm_A") if own_k_t else motor.k_t
    of = "the torque constant of the log" if own_k_t else f"the torque constant of {motor.name}, because the log does not show it"
    text = (
        f"# {printable(motor.model)}, identified from a log of drive {drive.track.id}.\n"
        "# Grades by the 95 % interval: A within 5 %, B within 15 %.\n"
        f"# Torques in Nm use {of}: {k_t:.4g} Nm/A.\n"
        f"# Firmware: {drive.track.options()}\n"
        "# The inertia is that of the rotor and everything attached to it.\n"
    )
    text += load_lines(drive, k_t)
    missing = [one for one in QUANTITIES if not drive.is_usable(one.key)]
    if missing:
        text += "#\n# Unknown, with the experiment that measures it:\n"
        text += "".join(f"#   {one.label}: {one.experiment}\n" for one in missing)
    text += f"\nextends = {toml_string(base)}\nmodel = {toml_string(motor.model + ', identified')}\n"
    if motor.data["series"] in ("MF", "MH"):
        text += 'current_loop = "fast"  # the loops of [control] in every generation\n'
    text += windings(drive).text() + mechanics(drive, k_t).text() + control(drive, k_t).text()
    text += "\n[identified]  # value and 95 % interval, for lk-emu identify --expect\n"
    text += f"logs = [{', '.join(toml_string(log) for log in logs)}]\ndrive = {drive.track.id}\n"
    cogging = drive.cogging()
    if cogging:
        text += f"cogging_order = {cogging.order}\n"
    for one in QUANTITIES:
        found = drive.values[one.key]
        if found is not None and found.letter != "U":
            text += f"{one.key} = [{found.value:.6g}, {found.low:.6g}, {found.high:.6g}]\n"
    return text


def line_of(text: str, key: str) -> int:
    at = re.search(rf"^\s*{re.escape(key)}\s*=", text, re.MULTILINE)
    return text.count("\n", 0, at.start()) + 1 if at else 0


def expected_values(text: str, file: str) -> List[Expected]:
    """Reads the table [identified]. Raises Unusable."""
    try:
        table = tomllib.loads(text).get("identified")
    except tomllib.TOMLDecodeError as problem:
        at = re.search(r"\(at line (\d+)", str(problem))
        raise Unusable(f"{file}:{at[1] if at else 1}: {printable(str(problem))}") from None
    if not isinstance(table, dict):
        raise Unusable(f"{file}: identified: is missing; lk-emu identify -o writes it")
    values = []
    for quantity in QUANTITIES:
        three = table.get(quantity.key)
        if three is None:
            continue
        where = f"{file}:{line_of(text, quantity.key)}: identified.{quantity.key}"
        if not isinstance(three, list) or len(three) != 3:
            raise Unusable(f"{where}: is not [value, low, high]")
        numbers = [float(one) if isinstance(one, (int, float)) else math.nan for one in three]
        value, low, high = numbers
        if not (math.isfinite(high - low) and low <= value <= high):
            raise Unusable(f"{where}: is not [value, low, high] in that order")
        order = table.get("cogging_order", 0) if quantity.key == "cogging_A" else 0
        values.append(Expected(quantity, Estimate(value, (high - low) / 2), int(order)))
    return values
