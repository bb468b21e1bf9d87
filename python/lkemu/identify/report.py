"""Printed table, and HTML page of --report."""

from __future__ import annotations

import html
import importlib
import math
import re
from typing import Any, List, Sequence

import numpy as np

from ..command import printable
from ..page_style import page_style
from .balance import FEWEST_COMMANDED, BalanceFit
from .motor import Unusable
from .plan import dialect
from .quantities import QUANTITIES, Drive
from .windows import COULOMB, INERTIA, VISCOUS, WINDOW_S

SHOWN_S = 6.0  # part of the log in the pictures

STYLE = """
.qA { background: color-mix(in srgb, var(--good) 30%, transparent) }
.qB { background: color-mix(in srgb, var(--zero) 25%, transparent) }
.qC { background: color-mix(in srgb, var(--warn) 30%, transparent) }
.qU { color: var(--dim) }
"""
# Colours of pictures that follow the page; without a page, as given.
THEMED = {"#ffffff": "--panel", "#222222": "--text", "#8c8c8c": "--dim", "#999999": "--dim"}


def is_shown(drive: Drive, key: str) -> bool:
    found = drive.values[key]
    return found is not None and found.letter != "U"


def letter_of(drive: Drive, key: str) -> str:
    found = drive.values[key]
    return found.letter if found is not None else "U"


def stamp_note(drive: Drive) -> str:
    t = drive.timing
    return (
        f"Time stamp errors, rms: {t.query_s * 1e3:.2f} ms (queries), {t.reply_s * 1e3:.2f} ms (replies), "
        f"{t.sample_s * 1e3:.2f} ms (both combined)."
    )


def pulse_notes(drive: Drive, fit: BalanceFit) -> List[str]:
    if fit.commanded >= FEWEST_COMMANDED:
        return []
    if fit.weak_pulses:
        return [
            f"The torque pulses were too weak: {fit.weak_pulses} were commanded, but the shaft hardly moved. "
            "Plan again with the identified friction: lk-emu identify --plan excite.py --motor ./my_motor.toml"
            + ("" if drive.track.generation_given else f" --generation {drive.track.generation}")
            + f" --id {drive.track.id}"
        ]
    return [
        "Hardly any torque was commanded, so the current between the samples and the inertia are uncertain. "
        "For a better log, run a script of lk-emu identify --plan."
    ]


def generation_notes(drive: Drive) -> List[str]:
    """Warns about a guessed generation: a wrong one scales every value in amperes."""
    track = drive.track
    if track.generation_given or len(track.fits) < 2:
        return []
    scales = {one: dialect(track.motor.path, one)[0] for one in track.fits}
    own = scales.get(track.generation) or dialect(track.motor.path, track.generation)[0]
    factors = {one: scale / own for one, scale in scales.items()}
    others = [f"{factor:.2g} times as large for {one}" for one, factor in factors.items() if abs(factor - 1) > 0.05]
    if not others:
        return []
    return [
        "The generation is a guess. Other generations that scale currents differently also fit the log: "
        f"values in A would be {', '.join(others)}. Set the generation with --generation."
    ]


def notes(drive: Drive) -> List[str]:
    """Remarks on the quality of the values."""
    if not drive.track.motor.reports_current:
        return ["An MS drive reports no current, so its mechanics cannot be identified."]
    if drive.too_rough:
        return [stamp_note(drive), drive.too_rough]
    fit = drive.balance
    lines = generation_notes(drive)
    if fit is None:
        return [*lines, "The shaft hardly turned. Log the motor at work, or run a script of lk-emu identify --plan."]
    if not drive.voltage or not drive.voltage.k_t:
        lines.append(
            "Torques are in amperes, divided by k_t: a motor with twice the inertia, friction and k_t gives the same log. "
            "To find k_t, attach a known weight or inertia to the shaft, or run at the voltage limit."
        )
    ratio = f"{fit.held_out_ratio:.2f} times those of the fitted half"
    ratio += "" if fit.held_out_ratio <= 1.2 else ", so the log is too short or the motor changed during it"
    lines.append(
        f"{len(fit.time)} windows of {1e3 * max(WINDOW_S, 2 * drive.track.step_s):.0f} ms, "
        f"{fit.commanded} with a commanded torque; residuals {fit.rms_A:.3g} A rms. "
        f"Cross-validation: residuals of the held-out half are {ratio}."
    )
    is_small = abs(fit.autocorrelation) <= 0.2
    missing = "" if is_small else ", beyond ±0.2: the model lacks a torque on the shaft, e.g. of a load or a cable"
    lines.append(f"Autocorrelation of the residuals: {fit.autocorrelation:.2f}{missing}.")
    lines += pulse_notes(drive, fit)
    lines.append(stamp_note(drive))
    if fit.commanded >= FEWEST_COMMANDED:
        lag = f", and the current follows with a lag of {fit.lag_s * 1e3:.1f} ms" if fit.lag_s > 0.5e-3 else ""
        lines.append(f"A command acts {fit.delay_s * 1e3:.2f} ms after its time stamp{lag}.")
    lines += fit.notes
    ripples = []
    for one in fit.cogging:
        offsets = "; pole pairs, may be current sensor offsets" if one.order == drive.track.motor.pole_pairs else ""
        ripples.append(f"{one.order} times a turn ({one.amplitude.value:.2g} A{offsets})")
    if ripples:
        lines.append(f"Cogging: {', '.join(ripples)}.")
    if fit.one_speed:
        orders = ", ".join(str(one) for one in fit.one_speed[:5])
        lines.append(f"Ripples of {orders} periods a turn appear at one speed only, so they may not be cogging.")
    return lines


def table_text(drive: Drive) -> str:
    track, name = drive.track, printable(drive.track.motor.name)
    text = (
        f"drive {track.id} on {printable(track.interface)}: {track.options()}, {len(track.time)} replies, "
        f"every {track.step_s * 1e3:.1f} ms\n"
    )
    for one in QUANTITIES:
        found, base = drive.values[one.key], one.base(track.motor)
        if is_shown(drive, one.key) and found is not None:
            value = f"{found.value:.4g}  {found.low:.4g} .. {found.high:.4g}"
            rest = f"{one.unit:<8} ({name} {f'{base:.4g}' if base > 0 else '-'})"
        else:
            value, rest = "unknown", f"{'':<8} to measure it: {one.experiment}"
        text += f"  {letter_of(drive, one.key)}  {one.label:<46} {value:<34} {rest}".rstrip() + "\n"
    return text + "".join(f"  {line}\n" for line in notes(drive))


# --- the page ---


def picture_library() -> Any:
    try:
        library = importlib.import_module("lkemu.plot")
    except ImportError as problem:
        raise Unusable(f"identify: --report: {problem}: apt install python3-matplotlib, or pip install 'lk-emu[identify]'") from None
    library.set_up("en")
    return library


def panels(height: float, ratios: Sequence[float]) -> "tuple[Any, Any]":
    """Figure with stacked axes on one time axis."""
    figure = picture_library().Figure(figsize=(11, height), layout="constrained")
    return figure, figure.subplots(len(ratios), sharex=True, height_ratios=ratios)


def svg(figure: Any) -> str:
    for artist in figure.findobj(match=lambda one: one.get_clip_on()):
        artist.set_clip_on(False)  # names of clip paths differ between runs
    text = str(picture_library().rendered(figure, "", "svg").decode())
    text = re.sub(f"(?<=: )({'|'.join(THEMED)})", lambda found: f"var({THEMED[found[0]]}, {found[0]})", text)
    return text[text.index("<svg") :]


def balance_picture(drive: Drive, fit: BalanceFit) -> str:
    # Show the part of the log with the largest currents.
    starts = fit.time[:: max(1, len(fit.time) // 200)]
    begin = max(starts, key=lambda at: float(np.sum(fit.current[(fit.time >= at) & (fit.time <= at + SHOWN_S)] ** 2)))
    shown = (fit.time >= begin) & (fit.time <= begin + SHOWN_S)
    time, current, expected = fit.time[shown], fit.current[shown], fit.expected()[shown]
    base = np.zeros(fit.terms.shape[1])
    for term, key in ((INERTIA, "inertia_A_s2_rad"), (COULOMB, "coulomb_A"), (VISCOUS, "viscous_A_s_rad")):
        base[term] = next(one for one in QUANTITIES if one.key == key).base(drive.track.motor)
    figure, (currents, lower, speed) = panels(8, (3, 1, 1))
    currents.plot(time, fit.terms[shown] @ base, ":", color="0.6", label="predicted from the motor file, without cogging")
    currents.plot(time, current, lw=2.5, alpha=0.5, label="log")
    currents.plot(time, expected, lw=1, label="predicted from the estimates")
    currents.set(ylabel="iq, A", title=f"Drive {drive.track.id}: measured and predicted torque current")
    currents.legend()
    lower.plot(time, current - expected, color="tab:green")
    lower.set(ylabel="residual, A")
    speed.plot(time, fit.terms[shown, VISCOUS] * 180 / math.pi)
    speed.set(ylabel="speed, dps", xlabel="time, s")
    return svg(figure)


def moves_picture(drive: Drive) -> str:
    fit = drive.position
    assert fit is not None
    figure, (angle, lower) = panels(6, (3, 1))
    angle.plot(fit.time, fit.logged * 180 / math.pi, lw=2.5, alpha=0.5, label="log")
    angle.plot(fit.time, fit.emulated * 180 / math.pi, lw=1, label="emulated")
    angle.set(ylabel="angle, degrees", title=f"Drive {drive.track.id}: moves in the log and emulated")
    angle.legend()
    lower.plot(fit.time, (fit.logged - fit.emulated) * 180 / math.pi, color="tab:green")
    lower.set(ylabel="difference, degrees", xlabel="time, s")
    return svg(figure)


def drive_html(drive: Drive) -> str:
    track = drive.track
    text = (
        f"<h2>Drive {track.id} on {html.escape(track.interface)}</h2>\n<p>{html.escape(track.options())}, {len(track.time)} replies, "
        f"{track.unanswered} of {track.queries} queries unanswered.</p>\n<table><tr><th></th><th>value</th><th>95 % interval</th>"
        f"<th>grade</th><th>{html.escape(track.motor.name)}</th><th>method</th></tr>\n"
    )
    for one in QUANTITIES:
        found, shown, base = drive.values[one.key], is_shown(drive, one.key), one.base(track.motor)
        value = f"{found.value:.4g}" if shown and found else "unknown"
        interval = f"{found.low:.4g} to {found.high:.4g}" if shown and found else ""
        letter = letter_of(drive, one.key)
        how = one.how if shown else "to measure it: " + one.experiment
        text += (
            f"<tr><td>{html.escape(one.label)}{', ' + html.escape(one.unit) if one.unit else ''}</td><td>{value}</td><td>{interval}</td>"
            f'<td class="q{letter}">{letter}</td><td>{f"{base:.4g}" if base > 0 else "-"}</td><td>{html.escape(how)}</td></tr>\n'
        )
    text += "</table>\n<ul>\n" + "".join(f"<li>{html.escape(line)}</li>\n" for line in notes(drive)) + "</ul>\n"
    if drive.balance:
        text += balance_picture(drive, drive.balance)
    return text + (moves_picture(drive) if drive.position else "")


def report_html(drives: List[Drive], logs: List[str]) -> str:
    names = ", ".join(html.escape(printable(log)) for log in logs)
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">\n'
        f"<title>Identified motor parameters</title>\n<style>{page_style()}{STYLE}</style></head><body><main>\n"
        "<h1>Identified motor parameters</h1>\n"
        f"<p>{names}. Grades: A within 5 %, B within 15 %, C within 50 %, U: unknown.</p>\n"
        + "".join(drive_html(drive) for drive in drives)
        + "</main></body></html>\n"
    )
