#!/usr/bin/python3
"""Checks the generated tables of docs/internals/fidelity.md: `figures_page.py FIGURES PAGE`. `--write` updates them.

FIGURES is the report of `fidelity_test --gtest_output=json:FIGURES`. Ranges are those of record_range.hpp.
"""
import fnmatch
import json
import pathlib
import re
import sys

# Quantity, real value, (test, key) of each emulated value, digits, factor, unit.
TABLES = {
    "geared": [
        ("cruise: mean speed, dps", "−576.4", [("JointFigures.MatchTheLog", "cruise, mean of the speed, dps")], 1),
        ("cruise: speed deviation, dps", "21.7", [("GearedDrive.CruisesLikeTheLog", "deviation of the speed, dps")], 1),
        ("cruise: lag-1 autocorrelation", "−0.51", [("GearedDrive.CruisesLikeTheLog", "lag-1 autocorrelation")], 2),
        ("cruise: iq deviation, LSB", "8.0", [("GearedDrive.CruisesLikeTheLog", "deviation of iq, LSB")], 1),
        ("cruise: iq over speed, LSB per dps", "−0.24 to −0.17", [("GearedDrive.CruisesLikeTheLog", "iq over speed, LSB per dps")], 2),
        ("cruise: variance share of 28 a turn", "0.41", [("JointFigures.HaveTheSpectrumOfTheLog", "share of 28 a turn")], 2),
        *((f"{what}: speed deviation, dps", speed, [("GearedDrive.FollowsATargetLikeTheLog", f"from {start} dps, deviation of the speed, dps")], 1)
          for what, start, speed in (("joint 1 follows a target", 162, "18.2 to 22.1"), ("joint 3", 397, "16.4 to 18.8"))),
        *((f"{what}: iq deviation, LSB", iq, [("GearedDrive.FollowsATargetLikeTheLog", f"from {start} dps, deviation of iq, LSB")], 1)
          for what, start, iq in (("joint 1", 162, "6.4 to 7.9"), ("joint 3", 397, "6.4 to 8.2"))),
        *((f"{what}: lag-1 autocorrelation", lag, [("GearedDrive.FollowsATargetLikeTheLog", f"from {start} dps, lag-1 autocorrelation")], 2)
          for what, start, lag in (("joint 1", 162, "−0.39"), ("joint 3", 397, "−0.37"))),
        ("start: overshoot", "22 %", [("Seeds/Joint.OvershootsLikeTheLog/*", "overshoot")], 0, 100, " %"),
        ("start: 64 to 561 dps", "24 ms", [("JointStart.IsAsFastAsTheLog", "64 to 561 dps, ms")], 0, 1, " ms"),
        ("start: iq swing, LSB", "52, 67", [("JointStart.RingsLikeTheLog", "iq swing, LSB")], 0),
        ("stop: speed after one sample, dps", "18", [("JointStop.HasTheSpeedOfTheLogAfterOneSample", "speed after one sample, dps")], 0),
        ("stop: ringing", "12.0 Hz", [("JointStop.RingsLikeTheLog", "ringing, Hz")], 1, 1, " Hz"),
        ("hold: share of speed 0", "0.82 to 0.85", [("JointFigures.MatchTheLog", "hold, share of speed 0")], 2),
        ("hold: speed deviation, dps", "2.7 to 3.6", [("JointFigures.MatchTheLog", "hold, deviation of the speed, dps")], 1),
        ("hold: iq from sample to sample, LSB", "3.5 to 6", [("JointFigures.MatchTheLog", "hold, iq from sample to sample, LSB")], 1),
        ("MG4005 into a stop, speed Kp 30, 750 dps", "above 4.0 A", [("Hosts.PushesAgainstAnEndStopWithTheExpectedCurrent", "at speed Kp 30, A")], 1, 1, " A"),
        ("MG4005, 0 to 1500 dps", "at most 3.0 ms", [("NoRamp.StepTimeDependsOnTheSpeedGain", "0 to 1500 dps, ms")], 1, 1, " ms"),
    ],
    "direct": [
        ("573 dps: speed deviation, dps", "118 to 127", [("DirectDrive.HasTheTextureOfTheLog", "deviation of the speed, dps")], 0),
        ("573 dps: iq deviation, LSB", "11 to 15", [("DirectDrive.HasTheTextureOfTheLog", "deviation of iq, LSB")], 1),
        ("573 dps: iq over speed, LSB per dps", "−0.063 to −0.048", [("DirectDrive.HasTheTextureOfTheLog", "iq over speed, LSB per dps")], 3),
        ("573 dps: variance share of the slots", "0.57 to 0.68", [("DirectDrive.RipplesAtItsSlotsAndPoles", "share of the slots' order")], 2),
        ("573 dps: variance share of the poles", "0.03 to 0.15", [("DirectDrive.RipplesAtItsSlotsAndPoles", "share of the poles' order")], 2),
        *((f"0xA1: iq over command after {ms} ms", real, [("DirectDrive.FollowsATorqueLikeTheLog", f"after {ms} ms")], 2)
          for ms, real in ((3, "0.11 to 0.19"), (6, "0.09 to 0.25"), (10, "0.19 to 0.32"), (15, "0.33 to 0.40"), (20, "0.28 to 0.54"), (30, "0.36 to 0.52"))),
        ("start: overshoot, bare shaft", "66 %", [("DirectDrive.StartsLikeTheLog", "0 % load, overshoot")], 0, 100, " %"),
        ("start: overshoot, load of 0.4 rotors", "66 %", [("DirectDrive.StartsLikeTheLog", "40 % load, overshoot")], 0, 100, " %"),
        # The log has a sample every 2.5 ms; between them, interpolated.
        ("start: reaches 573 dps after", "7.7 ms", [("DirectDrive.StartsLikeTheLog", "0 % load, crossing, ms")], 1, 1, " ms"),
        ("start: first time above 573 dps", "7.9 ms", [("DirectDrive.StartsLikeTheLog", "0 % load, above the target, ms")], 1, 1, " ms"),
        ("speed of one count", "16.5 dps", [("DirectDrive.ReportsACountAsTheLogDoes", "largest speed of a count, dps")], 1, 1, " dps"),
        ("delay of the reported speed", "1.9 ms", [("DirectDrive.ReportsItsSpeedLate", "lag of the reported speed, ms")], 1, 1, " ms"),
        ("MS4015: largest power", "164 ‰", [("Ms4015.ChangesItsSpeedLikeTheLog", "largest power")], 0, 1000, " ‰"),
        ("MS4015: power at 720 dps", "94 to 120 ‰", [("Ms4015.ChangesItsSpeedLikeTheLog", "mean power")], 0, 1000, " ‰"),
        ("MS4015: speed deviation, dps", "57 to 79", [("Ms4015.ChangesItsSpeedLikeTheLog", "deviation of the speed, dps")], 0),
        ("MS4015: variance share of the slots", "0.57", [("Ms4015.ChangesItsSpeedLikeTheLog", "share of the slots' order")], 2),
        ("MS4015: variance share of the poles", "0.19", [("Ms4015.ChangesItsSpeedLikeTheLog", "share of the poles' order")], 2),
        ("18-bit encoder: delay of the reported speed", "1.0 ms", [("Telemetry.SpeedLagsTheEncoderByOneMillisecond", "lag of the reported speed, ms")], 1, 1, " ms"),
    ],
}


def read_figures(file):
    """Returns the lowest and highest value of each (test, key)."""
    report = json.loads(pathlib.Path(file).read_text("utf-8"))
    figures = {}
    for suite in report["testsuites"]:
        for test in suite["testsuite"]:
            for key, value in test.items():
                found = re.fullmatch(r"\S+ \((\S+) to (\S+)\)", str(value))
                if found:
                    figures[f"{suite['name']}.{test['name']}", key] = float(found[1]), float(found[2])
    return figures


def row(figures, quantity, real, sources, digits, factor=1, unit=""):
    ranges = [values for (test, key), values in figures.items() if any(fnmatch.fnmatchcase(test, name) and key == wanted for name, wanted in sources)]
    if not ranges:
        sys.exit(f"figures_page.py: no figure for '{quantity}'")
    ends = min(low for low, _ in ranges), max(high for _, high in ranges)
    low, high = (f"{factor * end:.{digits}f}".replace("-", "−") for end in ends)
    emulated = (low if low == high else f"{low} to {high}") + unit
    if apart(real, (low, high)):
        real, emulated = f"**{real}**", f"**{emulated}**"
    test = sources[0][0].split("/*")[0].removeprefix("Seeds/")
    return f"| {quantity} | {real} | {emulated} | `{test}` |\n"


def apart(real, emulated):
    """Returns True if the ranges are apart by over a tenth of the real value. Bounds, such as "at most", do not count."""
    if re.match(r"[a-z]", real):
        return False
    ends = [[float(number.replace("−", "-")) for number in numbers] for numbers in (re.findall(r"−?[\d.]+", real), emulated)]
    gap = max(min(ends[1]) - max(ends[0]), min(ends[0]) - max(ends[1]))
    return gap > 0.1 * abs(sum(ends[0]) / len(ends[0])) + 1e-9


def main():
    arguments = [word for word in sys.argv[1:] if word != "--write"]
    if len(arguments) != 2:
        sys.exit("usage: figures_page.py [--write] FIGURES PAGE")
    figures, page = read_figures(arguments[0]), pathlib.Path(arguments[1])
    before = text = page.read_text("utf-8")
    for name, rows in TABLES.items():
        table = "| quantity | real | emulated | test |\n|---|---|---|---|\n" + "".join(row(figures, *one) for one in rows)
        text, count = re.subn(f"(<!-- begin {name} -->\n).*?(<!-- end {name} -->)", lambda found, table=table: found[1] + table + found[2], text, flags=re.S)
        if count != 1:
            sys.exit(f"figures_page.py: {page} has no table '{name}'")
    if "--write" in sys.argv:
        page.write_text(text, "utf-8")
    elif text != before:
        sys.exit(f"figures_page.py: {page} is out of date; run figures_page.py --write {arguments[0]} {page}")


if __name__ == "__main__":
    main()
