"""Tests of `lk-emu plot`; needs matplotlib."""

import math
import os
import random
import re
import shutil
import struct
import subprocess
import sys
import xml.etree.ElementTree

import pytest

pytest.importorskip("matplotlib")
import numpy as np  # noqa: E402
from matplotlib.colors import to_hex  # noqa: E402

from lkemu import plot  # noqa: E402
from lkemu.errors import StartError  # noqa: E402
from lkemu.run_csv import RunCsv  # noqa: E402

BLUE, VERMILLION, DARK_BLUE = "#0072b2", "#d55e00", "#003959"  # half of each byte of blue
SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture
def figure(tmp_path, monkeypatch):
    """Function that draws the text of a CSV file and returns the figure."""
    monkeypatch.chdir(tmp_path)

    def draw(text, bus="", ids=(), title="run", lang="en"):
        (tmp_path / "run.csv").write_text(text)
        drawn = plot.Picture(plot.read_run(RunCsv("run.csv", "plot"), bus, ids), title, lang).figure
        drawn.draw_without_rendering()
        return drawn

    return draw


def panels(figure):
    return figure.axes[1:-1]  # between head and foot


def lines(axes):
    return [line for line in axes.lines if len(line.get_xdata())]


def tick_labels(axis):
    """Visible tick labels. Ticks outside the view are not shown, and twin axes have no time labels."""
    if not axis.get_visible():
        return []
    low, high = sorted(axis.get_view_interval())
    return [tick.label1 if tick.label1.get_visible() else tick.label2 for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high]


def texts(figure):
    found = []
    for axes in figure.axes:
        found += axes.texts + (axes.get_legend().get_texts() if axes.get_legend() else [])
        if axes.axison:
            found += [axis.label for axis in (axes.xaxis, axes.yaxis) if axis.get_visible()]
            found += [*tick_labels(axes.xaxis), *tick_labels(axes.yaxis)]
    return [text for text in found if text.get_visible() and text.get_text()]


def words(figure):
    return [text.get_text().strip() for text in texts(figure)]


def boxes_of(axes):
    return [text.get_window_extent() for text in axes.get_legend().get_texts()]


def assert_legible(figure):
    """Asserts that all text is inside the picture, and that legend entries and axis labels do not overlap."""
    width, height = figure.bbox.width, figure.bbox.height
    for text in texts(figure):
        box = text.get_window_extent()
        assert box.x0 >= 0 and box.x1 <= width and box.y0 >= 0 and box.y1 <= height, (text.get_text(), box)
    for axes in figure.axes:
        rows = [boxes_of(axes)] if axes.get_legend() else []
        if axes.axison:
            rows += [[label.get_window_extent() for label in tick_labels(axis) if label.get_visible()] for axis in (axes.xaxis, axes.yaxis)]
        for row in rows:
            assert not any(one.overlaps(other) for n, one in enumerate(row) for other in row[:n]), axes


def test_lines_have_the_points_of_the_file_and_axes_their_values(figure):
    (axes,) = panels(figure("time_s,1.angle_deg\n0,-50\n1,0\n3,100\n4,50\n"))
    (line,) = lines(axes)
    assert line.get_xydata().tolist() == [[0, -50], [1, 0], [3, 100], [4, 50]]
    # Times fill the panel. Values from -50 to 100 have a margin of 6 % of 150.
    assert axes.get_xlim() == (0, 4) and axes.get_ylim() == (-59, 109)
    assert (axes.get_ylabel(), axes.get_xlabel()) == ("position, °", "time, s")
    assert [label.get_text() for label in tick_labels(axes.yaxis)] == ["\N{MINUS SIGN}50", "0", "50", "100"]


def test_small_changes_do_not_fill_the_panel(figure):
    # The axis spans at least 0.5 A, here around 3 A, with a margin of 6 % at either end.
    (axes,) = panels(figure("time_s,1.iq_A\n0,3\n1,3\n"))
    assert axes.get_ylim() == pytest.approx((3 - 0.28, 3 + 0.28))
    # The axes span at least 4 °C and 2 V. The temperature is at a quarter of the height, the voltage at three quarters.
    left, right = panels(figure("time_s,1.temperature_C,1.voltage_V\n0,25,24\n1,25,24\n"))
    assert left.get_ylim() == pytest.approx((25 - 1 - 0.24, 25 + 3 + 0.24)) and right.get_ylim() == pytest.approx((24 - 1.5 - 0.12, 24 + 0.5 + 0.12))


def test_temperature_and_voltage_have_an_axis_each(figure):
    left, right = panels(figure("time_s,1.temperature_C,1.voltage_V\n0,20,24\n1,120,14\n"))
    assert (left.get_ylabel(), right.get_ylabel()) == ("temperature, °C", "voltage, V")
    assert (lines(left)[0].get_color(), lines(right)[0].get_color()) == (BLUE, VERMILLION)
    assert left.get_ylim() == (14, 126) and right.get_ylim() == pytest.approx((13.4, 24.6))


def test_true_line_is_broad_and_reference_is_dashed_and_darker(figure):
    (axes,) = panels(figure("time_s,1.true_rotor_dps,1.speed_dps,1.speed_ref_dps\n0,0,1,2\n1,100,101,102\n"))
    true, measured, reference = lines(axes)
    assert [to_hex(line.get_color()) for line in (true, measured, reference)] == [BLUE, BLUE, DARK_BLUE]
    assert true.get_linewidth() > 3 * measured.get_linewidth() and true.get_alpha() < 0.5
    assert not measured.is_dashed() and reference.is_dashed()
    keys = axes.get_legend()
    assert [text.get_text() for text in keys.get_texts()] == ["true", "measured", "reference"]
    assert [key.get_linewidth() for key in keys.get_lines()] == [line.get_linewidth() for line in (true, measured, reference)]


def test_rotor_angle_starts_at_the_first_measured_angle(figure):
    # The zero of the rotor angle is arbitrary: the rotor was at 32 when 10 was measured, so 43 is drawn as 21.
    (axes,) = panels(figure("time_s,1.angle_deg,1.true_rotor_deg\n0,10,32\n1,20,43\n"))
    assert lines(axes)[0].get_ydata().tolist() == [10, 21]


def test_every_drive_has_a_colour(figure):
    drawn = figure("time_s,1.iq_A,7.iq_A\n0,1,2\n1,1,2\n")
    assert [(line.get_color(), line.get_ydata()[0]) for line in lines(panels(drawn)[0])] == [(BLUE, 1), (VERMILLION, 2)]
    head = drawn.axes[0].get_legend()
    assert [(to_hex(patch.get_facecolor()), text.get_text().strip()) for patch, text in zip(head.get_patches(), head.get_texts())] == [
        (BLUE, "drive 1"), (VERMILLION, "drive 7")]  # fmt: skip
    assert [line.get_color() for line in lines(panels(figure("time_s,1.iq_A,7.iq_A\n0,1,2\n1,1,2\n", ids=[7]))[0])] == [BLUE]


def test_drives_are_chosen_by_bus_and_id(figure):
    text = "time_s,vcan0.1.iq_A,vcan0.2.iq_A,vcan1.1.iq_A\n0,1,2,3\n1,1,2,3\n"
    assert "vcan1 drive 1" in words(figure(text))
    assert [line.get_ydata()[0] for line in lines(panels(figure(text, bus="vcan1"))[0])] == [3]
    for bus, ids, problem in (("vcan2", (), "--bus: the file has no bus vcan2"), ("vcan1", (2,), "--ids: the file has no drive 2")):
        with pytest.raises(StartError, match=problem):
            figure(text, bus, ids)


def test_drives_without_a_colour_are_named(figure):
    header = "time_s" + "".join(f",{n}.iq_A" for n in range(1, 9)) + "\n" + "0,1,1,1,1,1,1,1,1\n1,1,1,1,1,1,1,1,1\n"
    drawn = figure(header)
    assert len(lines(panels(drawn)[0])) == 6 and "not shown: drive 7, drive 8" in words(drawn)
    with pytest.raises(StartError, match="--ids: 7 drives; one picture has colours for 6"):
        figure(header, ids=range(1, 8))


def test_missing_signals_are_named(figure):
    foot = figure("time_s,1.iq_A,1.some_future_signal\n0,1,2\n").axes[-1].texts[0].get_text()
    assert foot.splitlines()[0] == "Position: not in the file (true_rotor_deg, angle_deg, angle_ref_deg)"
    assert len(foot.splitlines()) == 3
    for text in ("time_s,1.iq_A\n", "time_s,1.iq_A\n0,nan\n"):
        drawn = figure(text)
        assert not panels(drawn) and "Current: no rows" in drawn.axes[-1].texts[0].get_text()


def test_signals_are_those_of_the_program():
    program = os.environ.get("LKEMU")
    if not program:
        pytest.skip("LKEMU names no program")
    known = subprocess.run([program, "__complete", "run", "--signals", ""], check=True, capture_output=True, text=True).stdout.split()
    for subject in plot.SUBJECTS:
        for quantity in subject.quantities:
            assert {quantity.signal, quantity.instead_of or quantity.signal, quantity.begins_with or quantity.signal} <= set(known)


def test_alternative_signal_replaces_a_missing_one(figure):
    (axes,) = panels(figure("time_s,1.true_angle_deg,1.angle_deg\n0,1,2\n"))
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["true, output shaft", "measured"]
    (axes,) = panels(figure("time_s,1.true_angle_deg,1.angle_deg,1.true_rotor_deg\n0,1,2,3\n"))
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["true, from the first one measured", "measured"]


def test_gaps_break_lines_and_lone_points_are_dots(figure):
    (axes,) = panels(figure("time_s,1.iq_A\n0,1\n1,1\n2,nan\n3,1\n4,\n5,1\n6,1\n"))
    line, dots = lines(axes)
    assert np.isnan(line.get_ydata()).tolist() == [False, False, True, False, True, False, False]
    assert dots.get_xydata().tolist() == [[3, 1]] and dots.get_marker() == "."
    # A gap survives thinning: 20 000 rows with values, one without, 20 000 with values.
    rows = "".join(f"{n},{'nan' if n == 20000 else n % 2}\n" for n in range(40001))
    (line, *dots) = lines(panels(figure("time_s,1.iq_A\n" + rows))[0])
    assert line.get_xdata()[np.isnan(line.get_ydata())].tolist() == [20000] and not dots


def test_single_time_is_centred(figure):
    (axes,) = panels(figure("time_s,1.iq_A\n7,3\n"))
    assert axes.get_xlim() == (6.5, 7.5)
    assert lines(axes)[-1].get_marker() == "."


def test_no_spike_is_lost_in_a_long_file(figure):
    values = {54321: 10, 77777: -3, 77778: 4}
    rows = "".join(f"{n / 1000},{values.get(n, 0)}\n" for n in range(100_000))
    drawn = figure("time_s,1.iq_A\n" + rows)
    (line,) = lines(panels(drawn)[0])
    found = {round(x * 1000): y for x, y in line.get_xydata() if y}
    assert found == values
    assert len(line.get_xdata()) < 4 * plot.MOST_POINTS
    assert line.get_xdata()[0] == 0 and np.all(np.diff(line.get_xdata()) > 0)
    assert len(plot.rendered(drawn, "run", "svg")) < 150_000


def test_a_noisy_svg_stays_small_and_keeps_its_spike(figure):
    chance = random.Random(1)
    values = [chance.gauss(0, 1) for _ in range(4000)]
    values[1234] = 30
    drawn = figure("time_s,1.iq_A\n" + "".join(f"{n / 1000},{value!r}\n" for n, value in enumerate(values)))
    svg = plot.rendered(drawn, "run", "svg").decode()
    longest = max(re.findall(r' d="([^"]*)"', svg), key=len)
    points = [tuple(map(float, point.split())) for point in re.split("[ML]", longest) if point.strip()]
    assert len(svg) < 20 * len(values) and svg.count("\n") < 1000
    x, y = min(points, key=lambda point: point[1])
    axes = panels(drawn)[0]
    spike = axes.transData.transform((1.234, 30)) * 72 / plot.DPI
    assert (x, float(svg.split('height="')[1].split("pt")[0]) - y) == pytest.approx(tuple(spike), abs=0.5)


def test_a_thinned_line_has_the_extremes_of_each_stretch(figure):
    chance = random.Random(1)
    values = [chance.gauss(0, 1) for _ in range(50_000)]
    (line,) = lines(panels(figure("time_s,1.iq_A\n" + "".join(f"{n},{value!r}\n" for n, value in enumerate(values))))[0])
    for begin in range(0, 50_000, 1000):
        shown = [y for x, y in line.get_xydata() if begin <= x < begin + 1000]
        assert (min(shown), max(shown)) == (min(values[begin : begin + 1000]), max(values[begin : begin + 1000]))


@pytest.mark.parametrize("low, high", [(-1e18, 1e18), (-1e-9, 1e-9), (123456.001, 123456.002), (-9999999, 9999999), (-1e308, 1e308)])
def test_long_numbers_are_legible(figure, low, high):
    assert_legible(figure(f"time_s,1.iq_A,1.voltage_V,1.temperature_C\n1000000.25,{low},{low},{low}\n1000001.5,{high},{high},{high}\n"))


@pytest.mark.parametrize("bus", ["interface-names.", "v.", "slcan-pty:/tmp/some/directory/of/a/terminal.", "_$x^2$."])
def test_many_drives_with_long_names_are_legible(figure, bus):
    signals = [quantity.signal for subject in plot.SUBJECTS for quantity in subject.quantities if not quantity.instead_of]
    columns = [f"{bus}{drive}.{signal}" for drive in range(25, 33) for signal in signals]
    drawn = figure(",".join(["time_s", *columns]) + "\n" + "".join(f"{n}" + f",{n}" * len(columns) + "\n" for n in (0, 1)), title="m" * 200)
    assert_legible(drawn)
    assert f"{bus[:-1]} drive 25" in words(drawn)


def test_chinese(figure, monkeypatch):
    (axes,) = panels(figure("time_s,1.iq_A\n0,1\n", lang="zh"))
    assert axes.get_ylabel() == "电流，A"
    monkeypatch.setattr(plot, "chinese_font", lambda: "a font")
    for given, locale, chosen in (("en", "zh_CN.UTF-8", "en"), ("zh", "C", "zh"), (None, "zh_CN.UTF-8", "zh"), (None, "de_DE", "en")):
        monkeypatch.setenv("LC_ALL", locale)
        assert plot.chosen_language(given) == chosen
    monkeypatch.setattr(plot, "chinese_font", lambda: None)
    monkeypatch.setenv("LC_ALL", "zh_CN.UTF-8")
    assert plot.chosen_language(None) == "en"
    with pytest.raises(StartError, match="--lang: zh needs a font with Chinese characters: apt install fonts-noto-cjk"):
        plot.chosen_language("zh")


# --- command line


def run(*arguments, **environment):
    """Runs python3 -m lkemu.plot in the working directory."""
    return subprocess.run([sys.executable, "-m", "lkemu.plot", *arguments], capture_output=True, text=True, errors="surrogateescape",
                          env={**os.environ, "LC_ALL": "C.UTF-8", **environment}, timeout=120)  # fmt: skip


def refused(*arguments):
    done = run(*arguments)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1), done
    return done.stderr.removeprefix("lk-emu: ").rstrip("\n")


@pytest.fixture
def csv(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "run.csv").write_text("time_s,1.iq_A\n0,1\n0.5,1\n")
    return tmp_path


def test_the_default_is_an_svg_beside_the_input(csv):
    (csv / "sub").mkdir()
    (csv / "run.csv").rename("sub/run.csv")
    done = run("sub/run.csv")
    assert (done.stdout, done.stderr) == ("sub/run.svg: 1 drive, 2 rows, 0 to 0.5 s\n", "")
    assert sorted(os.listdir("sub")) == ["run.csv", "run.svg"]
    root = xml.etree.ElementTree.parse("sub/run.svg").getroot()
    assert root.find(SVG + "title").text == "run" and root.get("width") == "825pt"  # 1100 px of 96 to the inch
    assert "drive 1" in [(text.text or "").strip() for text in root.iter(SVG + "text")]


def test_a_copy_runs(csv):
    shutil.copy(plot.__file__, "my_plot.py")
    package = os.path.dirname(os.path.dirname(plot.__file__))
    done = subprocess.run([sys.executable, "my_plot.py", "run.csv"], capture_output=True, text=True, env={**os.environ, "PYTHONPATH": package})
    assert (done.returncode, done.stdout) == (0, "run.svg: 1 drive, 2 rows, 0 to 0.5 s\n"), done.stderr


def test_a_png_is_2200_pixels_wide(csv):
    assert run("run.csv", "-o", "run.png").returncode == 0
    data = (csv / "run.png").read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n" and struct.unpack(">I", data[16:20]) == (2200,)


@pytest.mark.parametrize("kind", ["svg", "png"])
def test_the_same_file_gives_the_same_bytes(csv, kind):
    settings = csv / "settings"
    settings.mkdir()
    (settings / "matplotlibrc").write_text("axes.facecolor: red\nlines.linewidth: 9\n")
    run("run.csv", "-o", f"one.{kind}")
    run("run.csv", "-o", f"two.{kind}", LC_ALL="de_DE.UTF-8", MPLCONFIGDIR=str(settings), PYTHONHASHSEED="7", PADDING="x" * 5000)
    assert (csv / f"one.{kind}").read_bytes() == (csv / f"two.{kind}").read_bytes()
    if kind == "svg":
        assert b"clip" not in (csv / "one.svg").read_bytes()  # names of clip paths differ between runs


def test_names_cannot_inject_into_the_picture(csv):
    title, bus = """<script>x&amp;'"]]>$a_1$""", """<a b="&'">"""
    (csv / (title + ".csv")).write_text(f"time_s,{bus}.1.iq_A\n0,1\n1,1\n")
    run(title + ".csv", "-o", "out.svg")
    root = xml.etree.ElementTree.parse("out.svg").getroot()
    shown = [(text.text or "").strip() for text in root.iter(SVG + "text")]
    assert root.find(SVG + "title").text == title and shown[:2] == [title, f"{bus} drive 1"]
    odd = b"a\x1b[2J\xff.csv".decode(errors="surrogateescape")
    (csv / "run.csv").rename(odd)
    done = run(odd, "-o", "odd.svg")
    assert done.returncode == 0 and xml.etree.ElementTree.parse("odd.svg").getroot().find(SVG + "title").text == "a?[2J?"


def test_refuses(csv):
    assert refused() == "the following arguments are required: FILE (see lk-emu plot --help)"
    assert refused("none.csv") == "plot: cannot read none.csv: No such file or directory"
    assert refused("run.csv", "-o", "run.pdf") == "--output: run.pdf does not end in .svg or .png"
    assert refused("run.csv", "-o", "no/run.svg") == "--output: cannot write no/run.svg: No such file or directory"
    assert refused("run.csv", "--lang", "de") == '--lang: "de" is neither en nor zh'
    assert refused("run.csv", "--ids", "2") == "--ids: the file has no drive 2"
    (csv / "run.csv").rename("run.svg")
    assert refused("run.svg") == "plot: needs -o FILE, or it would draw over its input"
    assert os.listdir() == ["run.svg"]


def test_a_full_disk_leaves_nothing_behind(csv):
    import resource

    done = subprocess.run([sys.executable, "-B", "-m", "lkemu.plot", "run.csv"], capture_output=True, text=True, timeout=120,
                          preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000)))  # fmt: skip
    assert (done.returncode, done.stderr) == (2, "lk-emu: --output: cannot write run.svg: File too large\n")
    assert os.listdir() == ["run.csv"]


def test_a_missing_library_is_named(csv):
    (csv / "lib" / "matplotlib").mkdir(parents=True)
    (csv / "lib" / "matplotlib" / "__init__.py").write_text("raise ModuleNotFoundError(\"No module named 'matplotlib'\", name='matplotlib')")
    done = run("run.csv", PYTHONPATH=f"{csv}/lib:{os.environ['PYTHONPATH']}")
    assert done.returncode == 2
    assert done.stderr == (f"lk-emu: plot: {sys.executable}: No module named 'matplotlib': apt install python3-matplotlib, "
                           "or pip install 'lk-emu[plot]'\n")  # fmt: skip


def test_damaged_files_are_refused_or_drawn(figure):
    chance = random.Random(1)
    whole = b"time_s,1.iq_A,2.voltage_V\n" + b"".join(b"%r,%r,%r\n" % (n / 100, math.sin(n), n) for n in range(40))
    drawn = 0
    for _ in range(20):
        text = bytearray(whole)
        for _ in range(chance.randint(1, 4)):
            at = chance.randrange(len(text))
            what = chance.randrange(3)
            if what == 0:
                text[at] = chance.randrange(32, 127)
            elif what == 1:
                del text[at : at + chance.randrange(20)]
            else:
                text[at:at] = chance.choice([b"1e308", b"-", b",", b"\n", b"nan", b"-inf", b"\0", b"9" * 400])
        try:
            for axes in panels(figure(text.decode())):
                low, high = sorted(axes.get_ylim())
                assert all(low <= y <= high for line in lines(axes) for y in line.get_ydata() if not np.isnan(y))
            drawn += 1
        except StartError as problem:
            assert str(problem).startswith("plot: run.csv:")
    assert 0 < drawn < 20
