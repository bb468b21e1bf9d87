"""Table of all quantities that identify estimates; used by output, motor file, comparison and report."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Callable, Dict, List, Optional

import numpy as np

from .balance import BalanceFit, Cogging, TooRough, fit_balance
from .estimate import Estimate
from .loops import VoltageFit, fit_speed_loop, fit_voltage
from .motor import Motor
from .position import PositionFit, fit_position_loop
from .timing import Timing, timing
from .track import TORQUE, Track

FEWEST_AT_REST, REST_RAD_S = 50, 1.0  # samples for the noise; highest speed that counts as rest (assumed)


@dataclass
class Drive:
    """All estimates for one drive. Torques are in amperes, because a log has no torques."""

    track: Track
    timing: Timing
    balance: Optional[BalanceFit] = None
    too_rough: str = ""  # reason why the stamps do not allow a torque balance
    speed_kp: Optional[Estimate] = None
    speed_ki: Optional[Estimate] = None
    position: Optional[PositionFit] = None
    voltage: Optional[VoltageFit] = None

    def __post_init__(self) -> None:
        self.values: Dict[str, Optional[Estimate]] = {}

    def cogging(self) -> Optional[Cogging]:
        """Strongest order other than the pole pairs, at which offsets of the current sensors also act."""
        orders = self.balance.cogging if self.balance else []
        return next((one for one in orders if one.order != self.track.motor.pole_pairs), None)

    def is_usable(self, key: str) -> bool:
        value = self.values[key]
        return value is not None and value.is_usable

    def number(self, key: str) -> float:
        value = self.values[key]
        assert value is not None
        return value.value


@dataclass(frozen=True)
class Quantity:
    key: str  # key in the motor file; ends with the unit
    label: str
    unit: str
    how: str  # method
    experiment: str  # experiment that measures it
    found: Callable[[Drive], Optional[Estimate]]
    base: Callable[[Motor], float]  # value of the motor file with a free shaft; 0: unknown
    of_motor: bool = True  # False: depends on supply or load, so --expect ignores it


def current_noise(drive: Drive) -> Optional[Estimate]:
    """Standard deviation of iq at rest with torque 0."""
    track, set_points = drive.track, drive.track.set_points
    if len(set_points.time) == 0:
        return None
    now = set_points.at(track.time)
    free = (now >= 0) & (set_points.what[now] == TORQUE) & (np.abs(set_points.value[now]) < 1e-3)
    chosen = free & (np.abs(track.speed) <= REST_RAD_S)
    chosen[2:] &= free[:-2]
    chosen[:2] = False
    iq = track.iq[chosen]
    if len(iq) < FEWEST_AT_REST:
        return None
    steps = np.unique(np.abs(track.iq[track.iq != 0]))
    lsb = float(np.min(np.diff(np.concatenate(([0.0], steps))))) if len(steps) else 0.0
    real = math.sqrt(max(float(np.var(iq)) - lsb**2 / 12, 0.0))
    return Estimate(real, 1.96 * real / math.sqrt(2 * len(iq)))


def gear_loss(drive: Drive) -> Optional[Estimate]:
    """1 − η from (1 − η²)/(1 + η²), the ratio in the torque balance."""
    if drive.balance is None or drive.balance.gear_loss is None:
        return None
    x = min(max(drive.balance.gear_loss.value, 0.0), 0.99)
    eta = math.sqrt((1 - x) / (1 + x))
    return Estimate(1 - eta, drive.balance.gear_loss.half_width / ((1 + x) ** 2 * eta))


def of_balance(name: str) -> Callable[[Drive], Optional[Estimate]]:
    return lambda drive: getattr(drive.balance, name) if drive.balance else None


def of_voltage(name: str) -> Callable[[Drive], Optional[Estimate]]:
    return lambda drive: getattr(drive.voltage, name) if drive.voltage else None


def cogging(drive: Drive) -> Optional[Estimate]:
    found = drive.cogging()
    return found.amplitude if found else None


PLAN = "lk-emu identify --plan"
LIMIT = "iq over speed at the voltage limit"
LIMIT_RUN = "0xA1 with a large current from rest to full speed, shaft free"
QUANTITIES = (
    Quantity("inertia_A_s2_rad", "inertia at the rotor", "A·s²/rad", "torque balance", PLAN,
             of_balance("inertia"), lambda m: (m.J + m.J_out / m.N**2) / m.k_t),
    Quantity("coulomb_A", "Coulomb friction", "A", "torque balance", "steady speeds (0xA2) in both directions",
             of_balance("coulomb"), lambda m: (m.coulomb + m.coulomb_out / m.N / m.efficiency) / m.k_t),
    Quantity("viscous_A_s_rad", "viscous friction", "A·s/rad", "torque balance",
             "steady speeds (0xA2), the fastest at least ten times the slowest", of_balance("viscous"), lambda m: m.viscous / m.k_t),
    Quantity("cogging_A", "cogging", "A", "torque balance", "at least two slow, steady speeds (0xA2), a turn or more at each",
             cogging, lambda m: m.cogging / m.k_t),
    Quantity("gravity_A", "gravity of the load on the output", "A", "torque balance",
             "slow moves (0xA2, 0xA4) over 60 degrees of the output or more", of_balance("gravity"), lambda m: 0.0, False),
    Quantity("gear_loss", "gear loss", "", "gravity when lifting and lowering", "slow moves up and down with a load on an arm",
             gear_loss, lambda m: 1 - m.efficiency),
    Quantity("speed_kp_A_s_rad", "Kp of the speed loop", "A·s/rad", "response to cogging at steady speeds", PLAN,
             lambda d: d.speed_kp, lambda m: m.loops()["speed_kp"]),
    Quantity("speed_ki_A_rad", "Ki of the speed loop", "A/rad", "response to cogging at steady speeds",
             "steady speeds (0xA2) of 30 to 200 degrees per second", lambda d: d.speed_ki, lambda m: m.loops()["speed_ki"]),
    Quantity("angle_kp_per_s", "Kp of the position loop", "1/s", "comparison with emulated moves",
             "moves (0xA4) with rests between them, no arm, 200 exchanges per second",
             lambda d: d.position.kp if d.position else None, lambda m: m.loops()["angle_kp"]),
    # iq is computed from two measured phases: their noise times √(4/3), averaged over angles.
    Quantity("iq_noise_A", "noise of the reported current", "A", "iq at rest with torque 0",
             "0xA1 with torque 0 for two seconds, shaft at rest", current_noise,
             lambda m: m.texture("current_sensor", "noise_A") * math.sqrt(4 / 3)),
    Quantity("current_lag_s", "lag of the current loop", "s", "measured current after torque commands", PLAN,
             of_balance("lag"), lambda m: 1 / m.number("control", "current_bandwidth_rad_s")),
    Quantity("no_load_rad_s", "speed at the voltage limit", "rad/s", LIMIT, LIMIT_RUN, of_voltage("no_load"),
             lambda m: m.modulation * m.supply_V / (m.k_t / 1.5), False),
    Quantity("k_t_Nm_A", "torque constant", "Nm/A", LIMIT, LIMIT_RUN + ", with 0x9A among the queries", of_voltage("k_t"),
             lambda m: m.k_t),
    Quantity("R_ohm", "resistance of phase, switch, half the supply", "ohm", LIMIT,
             LIMIT_RUN + ", with 0x9A among the queries", of_voltage("resistance"), lambda m: m.resistance, False),
)  # fmt: skip


def identify(track: Track) -> Drive:
    drive = Drive(track, timing(track))
    if track.motor.reports_current:
        try:
            drive.balance = fit_balance(track, drive.timing)
        except TooRough as why:
            drive.too_rough = str(why)
        if drive.balance:
            drive.speed_kp, drive.speed_ki = fit_speed_loop(track, drive.timing, drive.balance)
            drive.position = fit_position_loop(track, drive.timing, drive.balance, drive.speed_kp, drive.speed_ki)
        drive.voltage = fit_voltage(track)
    reports = track.motor.reports_current
    drive.values = {one.key: one.found(drive) if reports else None for one in QUANTITIES}
    return drive


# --- comparison with an earlier motor file ---

LEAST_CHANGE = 0.1


@dataclass
class Expected:
    quantity: Quantity
    estimate: Estimate
    order: int = 0  # cogging order; 0 for other quantities


@dataclass
class Changes:
    lines: List[str]
    compared: int
    not_compared: List[str]


def changes(drive: Drive, expected: List[Expected], file: str) -> Changes:
    """Lists values whose intervals do not overlap and that differ by more than LEAST_CHANGE."""
    found, now_cogging = Changes([], 0, []), drive.cogging()
    for then in expected:
        if not then.quantity.of_motor:
            continue
        now = drive.values[then.quantity.key]
        if now is None or not now.is_usable or not then.estimate.is_usable:
            found.not_compared.append(then.quantity.label)
            continue
        found.compared += 1
        change = now.value / then.estimate.value - 1
        apart = now.low > then.estimate.high or now.high < then.estimate.low
        order = now_cogging.order if now_cogging else 0
        if then.order and order != then.order:
            found.lines.append(f"drive {drive.track.id}: cogging order is {order}, was {then.order} in {file}")
        elif apart and abs(change) > LEAST_CHANGE:
            found.lines.append(
                f"drive {drive.track.id}: {then.quantity.label} is {abs(change) * 100:.0f} % {'more' if change > 0 else 'less'}"
                f" than in {file} ({now.value:.4g} {then.quantity.unit}, was {then.estimate.value:.4g})"
            )
    return found
