"""Draws a CSV file of `lk-emu run` or `lk-emu replay` as SVG or PNG: the command `lk-emu plot`.

Also runs as `python3 -m lkemu.plot`. The format is in docs/reference/formats.md.
"""

from __future__ import annotations

import io
import logging
import math
import os
import re
import warnings
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

# Absolute imports, so that a copy of this file runs.
from lkemu import command
from lkemu.command import StartError, printable
from lkemu.run_csv import LARGEST, Column, RunCsv, drives_of

with command.libraries("plot", __name__):
    import matplotlib
    import numpy as np
    from matplotlib import font_manager
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch
    from matplotlib.ticker import MaxNLocator, ScalarFormatter

# Colours of Okabe and Ito, "Color Universal Design" (2008), without black and yellow.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
ANY_DRIVE = "#4d4d4d"
WIDTH_px, PANEL_px, MISSING_px = 1100, 224, 22
DPI = 96  # resolution of the sizes above; a PNG has twice as many pixels
MOST_POINTS = 4096  # longer lines are thinned out

Drive = Tuple[str, int]  # bus, ID
SOLID, BROAD, DASHED, DOTTED, DASH_DOTTED = "solid", "broad", "dashed", "dotted", "dash-dotted"
STYLES: Dict[str, Dict[str, Any]] = {
    SOLID: {"linewidth": 1},
    BROAD: {"linewidth": 3.8, "alpha": 0.3},
    DASHED: {"linewidth": 1, "linestyle": (0, (4.5, 3))},
    DOTTED: {"linewidth": 1, "linestyle": (0, (1.2, 2))},
    DASH_DOTTED: {"linewidth": 1, "linestyle": (0, (7, 2.2, 1.5, 2.2))},
}


class Words(NamedTuple):
    en: str
    zh: str


class Quantity(NamedTuple):
    """A signal that a panel shows if it is in the file."""

    signal: str
    label: Words
    style: str
    right: bool = False  # On the right axis.
    instead_of: str = ""  # Shown only if this signal is not in the file.
    begins_with: str = ""  # Signal with the initial value, for a quantity whose zero is arbitrary.


class Subject(NamedTuple):
    """A panel. The spans are the least ranges of its axes, so that noise does not fill the panel (assumed)."""

    name: Words
    left: Words
    left_span: float
    right: Words
    right_span: float
    quantities: Sequence[Quantity]


NONE = Words("", "")
# fmt: off
SUBJECTS = (
    Subject(Words("Position", "位置"), Words("position, °", "位置，°"), 1, NONE, 0, (
        Quantity("true_rotor_deg", Words("true, from the first one measured", "真实值（从首个测量值起）"), BROAD, begins_with="angle_deg"),
        Quantity("true_angle_deg", Words("true, output shaft", "真实值（输出轴）"), BROAD, instead_of="true_rotor_deg"),
        Quantity("angle_deg", Words("measured", "测量值"), SOLID),
        Quantity("angle_ref_deg", Words("reference", "给定"), DASHED),
    )),
    Subject(Words("Speed", "转速"), Words("speed, °/s", "转速，°/s"), 10, NONE, 0, (
        Quantity("true_rotor_dps", Words("true", "真实值"), BROAD),
        Quantity("true_speed_dps", Words("true, output shaft", "真实值（输出轴）"), BROAD, instead_of="true_rotor_dps"),
        Quantity("speed_dps", Words("measured", "测量值"), SOLID),
        Quantity("speed_ref_dps", Words("reference", "给定"), DASHED),
    )),
    Subject(Words("Current", "电流"), Words("current, A", "电流，A"), 0.5, NONE, 0, (
        Quantity("true_iq_A", Words("iq, true", "iq 真实值"), BROAD),
        Quantity("true_id_A", Words("id, true", "id 真实值"), DOTTED),
        Quantity("iq_A", Words("iq, measured", "iq 测量值"), SOLID),
        Quantity("iq_ref_A", Words("iq, reference", "iq 给定"), DASHED),
    )),
    Subject(Words("Temperature and voltage", "温度与电压"), Words("temperature, °C", "温度，°C"), 4, Words("voltage, V", "电压，V"), 2, (
        Quantity("winding_C", Words("winding, true", "绕组真实值"), BROAD),
        Quantity("temperature_C", Words("motor", "电机温度"), SOLID),
        Quantity("driver_temperature_C", Words("power stage", "驱动温度"), DOTTED),
        Quantity("voltage_V", Words("voltage (right)", "电压（右轴）"), DASH_DOTTED, right=True),
        Quantity("true_voltage_V", Words("voltage, true (right)", "电压真实值（右轴）"), DASH_DOTTED, right=True, instead_of="voltage_V"),
    )),
)
# fmt: on
logging.getLogger("matplotlib").setLevel(logging.CRITICAL)  # no log lines about cache and fonts
DRIVE, TIME = Words("drive", "驱动器"), Words("time, s", "时间，s")
NOT_IN_FILE, NO_ROWS, NOT_SHOWN = Words("not in the file", "文件中没有"), Words("no rows", "没有数据行"), Words("not shown", "未显示")
# Font files of the packages fonts-noto-cjk, fonts-wqy-microhei and fonts-wqy-zenhei.
CHINESE_FONT = re.compile(r"(noto|source).*sans.*(cjk|sc).*regular|wqy-(microhei|zenhei)", re.IGNORECASE)


class Line:
    """Points of a quantity of one drive, thinned out beyond MOST_POINTS."""

    def __init__(self, quantity: Quantity, colour: int, column: int, begins_with: Optional[int]) -> None:
        self.quantity, self.colour = quantity, colour
        self._column, self._begins_with, self._shift = column, begins_with, 0.0
        self._width_s = 1e-9  # length of a time bin; times in files have a resolution of 1 ns
        self.times, self.values = np.empty(0), np.empty(0)

    def add(self, rows: Any) -> None:
        """Adds rows of the file; the first column of the matrix is the time."""
        values = rows[:, self._column]
        if self._begins_with is not None:
            distances = rows[:, self._begins_with] - values
            known = distances[np.isfinite(distances)]
            if known.size:
                self._shift, self._begins_with = known[0], None
        self.times = np.append(self.times, rows[:, 0])
        self.values = np.append(self.values, values + self._shift)
        if self.times.size > MOST_POINTS:
            self._thin()

    def _thin(self) -> None:
        """Keeps the smallest value, the largest value and one gap of each time bin."""
        times, values = self.times, self.values
        while (times[-1] - times[0]) / self._width_s >= MOST_POINTS / 2:
            self._width_s *= 2
        stretch = np.floor((times - times[0]) / self._width_s)
        order = np.lexsort((values, stretch))  # a gap (NaN) sorts to the end of its bin
        first = np.flatnonzero(np.diff(stretch[order], prepend=-1))
        gaps = np.isnan(values[order])
        last = np.append(first[1:], order.size) - 1
        counts = np.add.reduceat(~gaps, first, dtype=int)
        largest = np.maximum(first, first + counts - 1)
        kept = np.unique(np.concatenate((order[first], order[largest], order[last[gaps[last]]])))
        self.times, self.values = times[kept], values[kept]


class Run(NamedTuple):
    """Contents of a file, ready to draw."""

    drives: List[Drive]
    left_out: List[Drive]
    panels: List[Tuple[Subject, List[Line]]]
    rows: int
    first_s: float
    last_s: float


def read_run(csv: RunCsv, bus: str = "", ids: Sequence[int] = ()) -> Run:
    """Reads all rows in constant memory. Raises StartError."""
    drives, left_out = choose_drives(csv.columns, bus, ids)
    panels = lines_of(csv.columns, drives)
    count, first_s, last_s = 0, 0.0, 0.0
    for rows in matrices(csv):
        first_s = first_s if count else float(rows[0, 0])
        count, last_s = count + len(rows), float(rows[-1, 0])
        for _, lines in panels:
            for line in lines:
                line.add(rows)
    return Run(drives, left_out, panels, count, first_s, last_s)


def lines_of(columns: List[Column], drives: List[Drive]) -> List[Tuple[Subject, List[Line]]]:
    """Returns the panels and their empty lines; a panel without lines has no signal in the file."""
    signals = {column.signal for column in columns}
    place = {column: number + 1 for number, column in enumerate(columns)}
    panels = []
    for subject in SUBJECTS:
        lines = []
        for quantity in subject.quantities:
            if quantity.signal not in signals or quantity.instead_of in signals:
                continue
            for colour, drive in enumerate(drives):
                column = place.get(Column(*drive, quantity.signal))
                if column is not None:
                    lines.append(Line(quantity, colour, column, place.get(Column(*drive, quantity.begins_with))))
        panels.append((subject, lines))
    return panels


def matrices(csv: RunCsv, rows: int = 8192) -> Iterator[Any]:
    """Yields the rows of the file in blocks, as matrices; gaps are NaN."""
    piece: List[List[float]] = []
    for row in csv.rows():
        piece.append(row)
        if len(piece) == rows:
            yield clamped(piece)
            piece = []
    if piece:
        yield clamped(piece)


def clamped(piece: List[List[float]]) -> Any:
    matrix = np.array(piece)
    return np.where(np.isfinite(matrix), np.clip(matrix, -LARGEST, LARGEST), np.nan)


def choose_drives(columns: List[Column], bus: str, ids: Sequence[int]) -> Tuple[List[Drive], List[Drive]]:
    """Returns the drives to show, and those left out for lack of colours. Raises StartError."""
    if bus and all(column.bus != bus for column in columns):
        raise StartError(f"--bus: the file has no bus {bus}")
    drives = [(b, id) for b, id in drives_of(columns) if bus in ("", b) and (not ids or id in ids)]
    for id in ids:
        if all(id != drive[1] for drive in drives):
            raise StartError(f"--ids: the file has no drive {id}")
    if ids and len(drives) > len(COLOURS):
        raise StartError(f"--ids: {len(drives)} drives; one picture has colours for {len(COLOURS)}")
    return drives[: len(COLOURS)], drives[len(COLOURS) :]


def drive_name(drive: Drive, lang: str) -> str:
    bus, id = drive
    return f"{bus} {getattr(DRIVE, lang)} {id}".strip()


def limits(values: Any, least_span: float, share: float) -> Tuple[float, float]:
    """Limits of an axis. Values with a range below `least_span` are drawn at this share of its height."""
    low, high = float(values.min()), float(values.max())
    spare = max(least_span, 1e-7 * max(abs(low), abs(high))) - (high - low)
    spare = max(spare, 0.0)
    margin = 0.06 * (high - low + spare)
    return low - spare * share - margin, high + spare * (1 - share) + margin


def chinese_font() -> Optional[str]:
    """Path of an installed font with Chinese characters."""
    return min((file for file in font_manager.findSystemFonts() if CHINESE_FONT.search(os.path.basename(file))), default=None)


def set_up(lang: str) -> None:
    """Sets all options of matplotlib, so that pictures do not depend on the user's settings."""
    matplotlib.rcdefaults()
    families = ["DejaVu Sans"]  # comes with matplotlib
    font = chinese_font() if lang == "zh" else None
    if font:
        font_manager.fontManager.addfont(font)
        families.append(font_manager.FontProperties(fname=font).get_name())
    matplotlib.rcParams.update({
        "font.family": [*families, "sans-serif"], "font.sans-serif": ["Verdana"], "font.size": 9, "text.parse_math": False, "text.color": "#222222", "axes.edgecolor": "#8c8c8c",
        "axes.labelcolor": "#222222", "xtick.color": "#8c8c8c", "ytick.color": "#8c8c8c", "xtick.labelcolor": "#222222",
        "ytick.labelcolor": "#222222", "grid.color": "#e0e0e0", "legend.frameon": False, "legend.fontsize": 9,
        "svg.fonttype": "none", "svg.hashsalt": "lk-emu", "path.simplify_threshold": 0.5,  # pixels; drops invisible detail
    })  # fmt: skip


def rendered(figure: Figure, title: str, kind: str) -> bytes:
    """Renders as "svg" or "png"; reproducible to the byte for one version of matplotlib."""
    data = io.BytesIO()
    metadata = {"Title": title, "Date": None, "Creator": None} if kind == "svg" else {"Title": title, "Software": None}
    figure.savefig(data, format=kind, dpi=DPI if kind == "svg" else 2 * DPI, metadata=metadata)
    return compacted(data.getvalue()) if kind == "svg" else data.getvalue()


def compacted(svg: bytes) -> bytes:
    """Shrinks paths: one line each with two decimals. Matplotlib writes one line per point with six decimals."""
    return re.sub(rb' d="[^"]*"', lambda path: re.sub(rb"(\.\d\d)\d+", rb"\1", path[0].replace(b"\n", b" ")), svg)


class Picture:
    """Figure of a run."""

    def __init__(self, run: Run, title: str, lang: str) -> None:
        set_up(lang)
        drives, left_out, panels = run.drives, run.left_out, run.panels
        self.lang, self.one_drive = lang, len(drives) == 1
        shown = [(subject, lines) for subject, lines in panels if any(has_values(line) for line in lines)]
        self.missing = [self._missing(subject, lines) for subject, lines in panels if (subject, lines) not in shown]
        names = [drive_name(drive, lang) for drive in drives]
        columns = max(1, min(6, 130 // (8 + max(map(len, names), default=1))))
        head_px = 40 + 20 * math.ceil(len(names) / columns) + (18 if left_out else 0)
        height_px = head_px + PANEL_px * len(shown) + (42 if shown else 0) + MISSING_px * len(self.missing)
        self.figure = Figure(figsize=(WIDTH_px / DPI, height_px / DPI), dpi=DPI, layout="constrained")
        self.figure.get_layout_engine().set(w_pad=8 / DPI, h_pad=3 / DPI, hspace=0)
        grid = self.figure.add_gridspec(len(shown) + 2, 1, height_ratios=[head_px, *[PANEL_px] * len(shown), MISSING_px * len(self.missing) + 1])
        self._head(self.figure.add_subplot(grid[0]), title, names, columns, left_out)
        first = None
        for number, (subject, lines) in enumerate(shown):
            axes = self.figure.add_subplot(grid[number + 1], sharex=first)
            first = first or axes
            self._panel(axes, subject, lines)
            axes.tick_params(labelbottom=number == len(shown) - 1)
        if first is not None:
            axes.set_xlabel(self._word(TIME))
            low, high = run.first_s, run.last_s
            spare = 0.0 if high - low > max(1e-9, 1e-7 * max(abs(low), abs(high))) else 0.5  # s, around a single time
            first.set_xlim(low - spare, high + spare)
            set_ticks(first.xaxis, 10)
            self.figure.align_ylabels()
        foot = self.figure.add_subplot(grid[-1])
        foot.axis("off")
        foot.text(0, 0, "\n".join(self.missing), va="bottom", linespacing=1.6)

    def _word(self, words: Words) -> str:
        return str(getattr(words, self.lang))

    def _missing(self, subject: Subject, lines: List[Line]) -> str:
        if lines:
            return f"{self._word(subject.name)}: {self._word(NO_ROWS)}"
        signals = ", ".join(quantity.signal for quantity in subject.quantities if not quantity.instead_of)
        return f"{self._word(subject.name)}: {self._word(NOT_IN_FILE)} ({signals})"

    def _head(self, axes: Any, title: str, names: List[str], columns: int, left_out: List[Drive]) -> None:
        axes.axis("off")
        axes.text(0, 0.92, shortened(title, 80), size=13 if len(title) <= 50 else 9, va="top")
        if left_out:
            others = ", ".join(drive_name(drive, self.lang) for drive in left_out)
            axes.text(0, 0, shortened(f"{self._word(NOT_SHOWN)}: {others}", 90), size=8, va="bottom")
        patches = [Patch(facecolor=colour) for colour in COLOURS]
        axes.legend(patches[: len(names)], [f" {shortened(name, 60)}" for name in names], ncols=columns, loc="lower left",
                    bbox_to_anchor=(0, 0.25 if left_out else 0), borderaxespad=0, borderpad=0, handlelength=1.5, columnspacing=2)  # fmt: skip

    def _panel(self, axes: Any, subject: Subject, lines: List[Line]) -> None:
        axes.grid(True, axis="x", clip_on=False)  # see _line
        axes.set_axisbelow(True)
        right = axes.twinx() if any(line.quantity.right for line in lines) else None
        for side, on_right, span, title in ((axes, False, subject.left_span, subject.left), (right, True, subject.right_span, subject.right)):
            own = [line for line in lines if line.quantity.right == on_right and has_values(line)]
            for line in own:
                self._line(side, line)
            if own:
                # Avoid overlap: nearly constant values are high on the right axis and low on the left.
                share = (0.75 if on_right else 0.25) if right and len(own) < len(lines) else 0.5
                side.set_ylim(*limits(line_values(own), span, share))
                side.set_ylabel(self._word(title))
                set_ticks(side.yaxis, 7)
                if side is axes or not axes.lines:
                    side.grid(True, axis="y", clip_on=False)
            elif side is not None:
                side.set_yticks([])
        keys = {line.quantity: Line2D([], [], color=self._colour(line.quantity, None), **STYLES[line.quantity.style]) for line in lines}
        axes.legend(keys.values(), [self._word(quantity.label) for quantity in keys], ncols=len(keys), loc="lower left",
                    bbox_to_anchor=(0, 1), borderaxespad=0.2, borderpad=0.2, handlelength=3, columnspacing=2)  # fmt: skip

    def _line(self, axes: Any, line: Line) -> None:
        """Draws the line without a clip path, whose name in the SVG would differ between runs."""
        style = STYLES[line.quantity.style]
        colour = self._colour(line.quantity, line.colour)
        axes.plot(line.times, line.values, color=colour, clip_on=False, in_layout=False, **style)
        gap = np.isnan(np.concatenate(([np.nan], line.values, [np.nan])))
        alone = gap[:-2] & ~gap[1:-1] & gap[2:]
        axes.plot(line.times[alone], line.values[alone], ".", color=colour, clip_on=False, in_layout=False, alpha=style.get("alpha"))

    def _colour(self, quantity: Quantity, number: Optional[int]) -> str:
        """Colour of a drive, or of a legend key (`number` is None). With one drive, the right axis has its own."""
        if self.one_drive:
            number = 1 if quantity.right else 0
        colour = ANY_DRIVE if number is None else COLOURS[number]
        if quantity.style != DASHED:
            return colour
        # A reference is half as bright, to stand out from the measured line.
        return "#" + "".join(f"{int(colour[n : n + 2], 16) // 2:02x}" for n in (1, 3, 5))


def has_values(line: Line) -> bool:
    return bool(np.isfinite(line.values).any())


def line_values(lines: List[Line]) -> Any:
    values = np.concatenate([line.values for line in lines])
    return values[np.isfinite(values)]


def set_ticks(axis: Any, most: int) -> None:
    """Sets ticks at round values, with equal decimals, or with an exponent for long numbers."""
    axis.set_major_locator(MaxNLocator(most, steps=(1, 2, 5, 10)))
    low, high = axis.get_view_interval()
    if max(abs(low), abs(high)) < 1e7 and high - low > 1e-5:
        formatter = ScalarFormatter(useOffset=False)
        formatter.set_scientific(False)
    else:
        formatter = number_text
    axis.set_major_formatter(formatter)


def number_text(value: float, _: object = None) -> str:
    return f"{value:.10g}".replace("-", "\N{MINUS SIGN}")


def shortened(text: str, length: int) -> str:
    return text if len(text) <= length else text[: length - 1] + "…"


def output_file(csv: str, output: Optional[str]) -> str:
    """Output path: `output`, or the input with the suffix .svg. Raises StartError."""
    if output is None:
        output = os.path.splitext(csv)[0] + ".svg"
        if output == csv:
            raise StartError("plot: needs -o FILE, or it would draw over its input")
    elif not output.endswith((".svg", ".png")):
        raise StartError(f"--output: {output} does not end in .svg or .png")
    return output


def chosen_language(given: Optional[str]) -> str:
    """Value of --lang, or the language of the locale if a font for it is installed. Raises StartError."""
    if given is None:
        locale = next(filter(None, map(os.environ.get, ("LC_ALL", "LC_MESSAGES", "LANG"))), "")
        return "zh" if re.split("[_.@]", locale)[0] == "zh" and chinese_font() else "en"
    if given not in Words._fields:
        raise StartError(f'--lang: "{given}" is neither en nor zh')
    if given == "zh" and not chinese_font():
        raise StartError("--lang: zh needs a font with Chinese characters: apt install fonts-noto-cjk, or take --lang en")
    return given


def summary(path: str, run: Run) -> str:
    count, rows = len(run.drives), run.rows
    text = f"{path}: {count} drive{'s' * (count != 1)}, {rows} row{'s' * (rows != 1)}"
    if rows:
        text += f", {run.first_s:.12g} to {run.last_s:.12g} s"
    if run.left_out:
        text += "; not shown, see --ids: " + ", ".join(drive_name(drive, "en") for drive in run.left_out)
    return printable(text)


def main(arguments: Optional[List[str]] = None) -> None:
    parser = command.Parser(prog="lk-emu plot", description="Draw a CSV file of lk-emu run or lk-emu replay as SVG or PNG")
    parser.add_argument("file", metavar="FILE", help="CSV file from --csv")
    parser.add_argument("-o", "--output", metavar="FILE", help="picture to write, .svg or .png (default: .svg beside the CSV file)")
    parser.add_argument("--bus", default="", help="drives of this bus only")
    parser.add_argument("--ids", metavar="LIST", help="drives to draw (default: the first six): 1-4 or 1,3,7-9")
    parser.add_argument("--lang", help="language of the output: en or zh (default: the locale's)")
    given = parser.parse_args(arguments)
    warnings.simplefilter("ignore")  # e.g. about glyphs that no font has
    # Check all options before reading the file, which may be long.
    path = output_file(given.file, given.output)
    ids = command.parse_ids(given.ids) if given.ids else []
    lang = chosen_language(given.lang)
    run = read_run(RunCsv(given.file, "plot"), given.bus, ids)
    title = printable(os.path.splitext(os.path.basename(given.file))[0])
    figure = Picture(run, title, lang).figure
    with command.output_file(path, "--output") as file:
        file.write(rendered(figure, title, path[-3:]))
    print(summary(path, run))


if __name__ == "__main__":
    command.run(main)
