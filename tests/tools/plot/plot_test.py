#!/usr/bin/python3
"""lk-emu plot, through the real program: what is in its SVG files, and what it refuses.

usage: plot_test.py LK_EMU SCENARIO   (with four drives)
"""

import collections
import fractions
import math
import os
import random
import resource
import shutil
import struct
import subprocess
import sys
import tempfile
import unicodedata
import unittest
import xml.etree.ElementTree

PROGRAM, SCENARIO = map(os.path.abspath, sys.argv[1:3])
SVG = "{http://www.w3.org/2000/svg}"

# The layout of the picture (docs/plot.md): 1100 wide, panels from 80 to 1020, 190 high, 224 apart, the first at 96.
LEFT, RIGHT, FIRST, HIGH, APART = 80, 1020, 96, 190, 224
BLUE, VERMILLION, GREEN, PURPLE = "#0072b2", "#d55e00", "#009e73", "#cc79a7"
DARK_BLUE = "#003959"  # half of each byte of blue

# Characters that are not 0.64 em wide or a little less.
DEJAVU_em = {" ": 0.318, "(": 0.39, ")": 0.39, ",": 0.318, "-": 0.361, ".": 0.318, "+": 0.838, "\N{MINUS SIGN}": 0.838, "f": 0.352,
             "i": 0.278, "l": 0.278, "r": 0.411, "t": 0.392, "m": 0.974, "w": 0.818, "…": 1}


class Plot(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.directory = scratch.name

    def path(self, name):
        return os.path.join(self.directory, name)

    def put(self, name, text):
        with open(self.path(name), "wb") as file:
            file.write(text if isinstance(text, bytes) else text.encode())
        return self.path(name)

    def read(self, name):
        with open(self.path(name), "rb") as file:
            return file.read()

    def run_program(self, *arguments, status=0, **environment):
        ran = subprocess.run([PROGRAM, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                             errors="surrogateescape", timeout=120, cwd=self.directory,
                             env={**os.environ, "LC_ALL": "C.UTF-8", **environment})
        self.assertEqual(ran.returncode, status, (arguments, ran.stdout, ran.stderr))
        return ran

    def svg(self, text, *options):
        """The root of the SVG of a CSV file."""
        self.put("run.csv", text)
        self.run_program("plot", "run.csv", *options)
        return xml.etree.ElementTree.fromstring(self.read("run.svg"))

    def refused(self, *arguments):
        """What is said: one line."""
        ran = self.run_program("plot", *arguments, status=2)
        self.assertEqual(ran.stdout, "")
        self.assertRegex(ran.stderr, r"\Alk-emu: [^\n\x1b]+\n\Z")
        return ran.stderr[len("lk-emu: "):-1]


def of_class(element, name):
    return [child for child in element.iter() if child.get("class") == name]


Trace = collections.namedtuple("Trace", "colour width dashes opacity runs dots")


def trace_of(group):
    """A line with its points as numbers; all that belongs to it is in one group."""
    path, runs = group.find(SVG + "path"), []
    for run in "" if path is None else path.get("d")[1:].split("M"):
        runs.append([tuple(map(float, point.split(","))) for point in run.split(" ")])
    dots = [(float(dot.get("cx")), float(dot.get("cy"))) for dot in group.iter(SVG + "circle")]
    return Trace(group.get("stroke"), float(group.get("stroke-width")), group.get("stroke-dasharray"),
                 float(group.get("stroke-opacity", "1")), runs, dots)


def traces(root, panel=0):
    """The lines of one of the panels that are in the file, in the order of drawing."""
    return [trace_of(group) for group in of_class(of_class(root, "panel")[panel], "trace")]


def eighths(value):
    """To the nearest eighth of a pixel."""
    return float(fractions.Fraction(math.floor(value * 8 + fractions.Fraction(1, 2)), 8))


def share(part, whole, start, length):
    return eighths(start + fractions.Fraction(part) * length / fractions.Fraction(whole))


def width(text, size):
    """Of a text in DejaVu Sans, by the table of widths in its file (hmtx)."""
    return size * sum(1 if unicodedata.east_asian_width(c) in "WF" else DEJAVU_em.get(c, 0.64) for c in text)


class Lines(Plot):
    def test_points_are_where_the_axes_put_them(self):
        root = self.svg("time_s,1.angle_deg\n0,-50\n1,0\n3,100\n4,50\n")
        (trace,) = traces(root)
        # Times fill the panel; values from -50 to 100 have 6 % of 150 as a margin: -59 to 109.
        expected = [(share(time, 4, LEFT, RIGHT - LEFT), share(value + 59, 168, FIRST + HIGH, -HIGH))
                    for time, value in [(0, -50), (1, 0), (3, 100), (4, 50)]]
        self.assertEqual(trace.runs, [expected])
        # The bytes: 190 * 9 / 168 = 10.18 above 286 is 275.875, as few digits as it takes.
        self.assertIn(b'd="M80,275.875 315,219.25 785,106.125 1020,162.75"', self.read("run.svg"))

    def test_ticks_are_where_the_axes_put_them(self):
        root = self.svg("time_s,1.angle_deg\n0,-50\n4,100\n")
        # 168 / 7 = 24: the next of 1, 2, 5 times a power of ten is 50. 4 / 10 = 0.4: 0.5.
        values = [(value, share(value + 59, 168, FIRST + HIGH, -HIGH)) for value in (-50, 0, 50, 100)]
        times = [(n / 2, share(n, 8, LEFT, RIGHT - LEFT)) for n in range(9)]
        (labels,), (below,) = of_class(root, "values"), of_class(root, "times")
        self.assertEqual([(text.text, float(text.get("y")) - 4) for text in labels],
                         [(str(value).replace("-", "\N{MINUS SIGN}"), y) for value, y in values])
        self.assertEqual({text.get("x") for text in labels}, {str(LEFT - 9)})
        self.assertEqual(labels.get("text-anchor"), "end")
        self.assertEqual([(text.text, float(text.get("x"))) for text in below], [(f"{time:.1f}", x) for time, x in times])
        grid = "".join(f"M{x:g},{FIRST}V{FIRST + HIGH}" for _, x in times)
        grid += "".join(f"M{LEFT},{y:g}H{RIGHT}" for _, y in values)
        self.assertEqual([path.get("d") for path in of_class(root, "grid")], [grid])

    def test_two_axes_have_their_values_on_both_sides(self):
        root = self.svg("time_s,1.temperature_C,1.voltage_V\n0,20,24\n1,120,14\n")
        left, right = of_class(root, "values")
        # 20 to 120 and 6 % of 100: 14 to 126; 112 / 7 = 16: 20. 14 to 24 and 0.6: 13.4 to 24.6; 1.6: 2.
        self.assertEqual([text.text for text in left], ["20", "40", "60", "80", "100", "120"])
        self.assertEqual([text.text for text in right], ["14", "16", "18", "20", "22", "24"])
        self.assertEqual((left.get("text-anchor"), right.get("text-anchor")), ("end", "start"))
        # Both go from 6/112 of the height to its other end, in opposite directions, in colours of their own.
        low, high = share(6, 112, FIRST + HIGH, -HIGH), share(6, 112, FIRST, HIGH)
        self.assertEqual([(trace.colour, trace.runs) for trace in traces(root)],
                         [(BLUE, [[(LEFT, low), (RIGHT, high)]]), (VERMILLION, [[(LEFT, high), (RIGHT, low)]])])

    def test_the_true_is_broad_and_the_reference_dashed(self):
        root = self.svg("time_s,1.true_rotor_dps,1.speed_dps,1.speed_ref_dps\n0,0,1,2\n1,100,101,102\n")
        true, measured, reference = traces(root)
        self.assertEqual((true.colour, measured.colour, reference.colour), (BLUE, BLUE, DARK_BLUE))
        self.assertGreater(true.width, 3 * measured.width)
        self.assertLess(true.opacity, 0.5)
        self.assertEqual((measured.dashes, measured.opacity), (None, 1))
        self.assertIsNotNone(reference.dashes)
        (keys,) = of_class(root, "keys")
        self.assertEqual([text.text for text in keys.iter(SVG + "text")], ["true", "measured", "reference"])
        for key, trace in zip(keys.iter(SVG + "path"), (true, measured, reference)):
            self.assertEqual((key.get("stroke"), float(key.get("stroke-width")), key.get("stroke-dasharray")),
                             (trace.colour, trace.width, trace.dashes))

    def test_every_drive_has_its_colour(self):
        root = self.svg("time_s,1.iq_A,7.iq_A\n0,1,2\n1,1,2\n")
        first, second = traces(root)
        self.assertEqual((first.colour, second.colour), (BLUE, VERMILLION))
        self.assertGreater(first.runs[0][0][1], second.runs[0][0][1])
        (drives,) = of_class(root, "drives")
        self.assertEqual([(rect.get("fill"), text.text) for rect, text in zip(drives[::2], drives[1::2])],
                         [(BLUE, "drive 1"), (VERMILLION, "drive 7")])
        only = self.svg("time_s,1.iq_A,7.iq_A\n0,1,2\n1,1,2\n", "--ids", "7")
        self.assertEqual([trace.colour for trace in traces(only)], [BLUE])

    def test_a_spike_among_a_hundred_thousand_rows_is_seen(self):
        rows = ["time_s,1.iq_A"] + [f"{n / 1000},{10 if n == 54321 else 0}" for n in range(100_000)]
        root = self.svg("\n".join(rows) + "\n")
        (trace,) = traces(root)
        (points,) = trace.runs
        self.assertEqual(min(points, key=lambda point: point[1]),
                         (share(54321, 99999, LEFT, RIGHT - LEFT), share(6, 112, FIRST, HIGH)))
        self.assertLess(os.path.getsize(self.path("run.svg")), 150_000)

    def test_of_a_straight_line_the_ends_are_enough(self):
        root = self.svg("time_s,1.iq_A\n" + "".join(f"{n},{8 if n == 3 else 0}\n" for n in range(9)))
        # 0 to 8 A with 0.48 on either side; 940 px are 8 s.
        low, high = (share(value, "8.96", FIRST + HIGH, -HIGH) for value in ("0.48", "8.48"))
        corners = [(0, low), (2, low), (3, high), (4, low), (8, low)]
        self.assertEqual(traces(root)[0].runs, [[(LEFT + 117.5 * time, y) for time, y in corners]])
        # There and back along one line are two ways.
        root = self.svg("time_s,1.iq_A\n0,0\n1,8\n1.000001,-8\n2,0\n")
        (run,) = traces(root)[0].runs
        self.assertEqual([x for x, _ in run], [LEFT, (LEFT + RIGHT) / 2, (LEFT + RIGHT) / 2, RIGHT])

    def test_gaps_break_lines_and_lone_points_are_dots(self):
        (trace,) = traces(self.svg("time_s,1.iq_A\n0,1\n1,1\n2,nan\n3,1\n4,\n5,1\n6,1\n"))
        middle = FIRST + HIGH / 2
        x = [share(n, 6, LEFT, RIGHT - LEFT) for n in range(7)]
        self.assertEqual(trace.runs, [[(x[0], middle), (x[1], middle)], [(x[5], middle), (x[6], middle)]])
        self.assertEqual(trace.dots, [(x[3], middle)])

    def test_what_falls_on_one_point_is_a_dot(self):
        (single,) = traces(self.svg("time_s,1.iq_A\n7,3\n"))
        self.assertEqual((single.runs, single.dots), ([], [((LEFT + RIGHT) / 2, FIRST + HIGH / 2)]))
        # 1 µs of 10 s is 0.0001 pixels.
        (near,) = traces(self.svg("time_s,1.iq_A\n0,1\n1e-6,1\n2,nan\n10,nan\n"))
        self.assertEqual((near.runs, near.dots), ([], [(LEFT, FIRST + HIGH / 2)]))


class Words(Plot):
    def boxes(self, group, size=12):
        """Left and right end of each text of a row of a legend, by its row."""
        rows = collections.defaultdict(list)
        for text in group.iter(SVG + "text"):
            rows[text.get("y")].append((float(text.get("x")), float(text.get("x")) + width(text.text, size)))
        return rows

    def assert_apart(self, group):
        for row in self.boxes(group).values():
            self.assertLessEqual(row[-1][1], RIGHT)
            for (_, end), (begin, _) in zip(row, row[1:]):
                self.assertLess(end + 24, begin)  # what a sample of a line or a colour needs at least

    def test_many_drives_with_long_names_are_named_in_rows(self):
        signals = ("iq_A", "iq_ref_A", "true_iq_A", "true_id_A", "winding_C", "temperature_C", "driver_temperature_C", "voltage_V")
        for bus, language in (("interface-names", "en"), ("interface-names", "zh"), ("总线总线总", "zh"), ("v", "en")):
            columns = [f"{bus}.{drive}.{signal}" for drive in range(27, 33) for signal in signals]
            text = ",".join(["time_s", *columns]) + "\n" + "\n".join(f"{n}" + f",{n}" * len(columns) for n in (0, 1)) + "\n"
            root = self.svg(text, "--lang", language)
            (drives,) = of_class(root, "drives")
            self.assert_apart(drives)
            rows = len(self.boxes(drives))
            self.assertEqual(rows, 1 if bus == "v" else 2)
            for keys in of_class(root, "keys"):
                self.assert_apart(keys)
            # The panels begin below: the frame of the first is as far from the last row as it is from a single one.
            last = max(float(text.get("y")) for text in drives.iter(SVG + "text"))
            (frame, _) = of_class(root, "frame")
            self.assertTrue(frame.get("d").startswith(f"M{LEFT},{FIRST + 20 * (rows - 1)}H"), frame.get("d"))
            self.assertEqual(last, 54.5 + 20 * (rows - 1))

    def test_a_long_title_stays_in_the_picture(self):
        for length in (20, 90, 200):
            name = "m" * length
            self.put(name + ".csv", "time_s,1.iq_A\n0,1\n")
            self.run_program("plot", name + ".csv", "-o", "out.svg")
            root = xml.etree.ElementTree.fromstring(self.read("out.svg"))
            self.assertEqual(root.find(SVG + "title").text, name)
            shown = next(root.iter(SVG + "text"))
            size = float(shown.get("font-size"))
            self.assertGreaterEqual(size, 8)
            self.assertLessEqual(width(shown.text, size), RIGHT - LEFT)
            self.assertTrue(shown.text == name or (length == 200 and shown.text.endswith("m…")), shown.text)

    def test_long_numbers_stay_beside_the_axis_and_apart(self):
        for low, high in (("-1e18", "1e18"), ("-1e-9", "1e-9"), ("123456.001", "123456.002"), ("-9999999", "9999999")):
            root = self.svg(f"time_s,1.iq_A\n1000000.25,{low}\n1000001.5,{high}\n")
            (labels,), (below,) = of_class(root, "values"), of_class(root, "times")
            for text in labels:
                self.assertLess(width(text.text, float(labels.get("font-size"))), 52)
            row = [(float(text.get("x")), width(text.text, float(below.get("font-size"))) / 2) for text in below]
            for (x, half), (next_x, next_half) in zip(row, row[1:]):
                self.assertLess(x + half + 4, next_x - next_half)

    def test_the_language_is_chosen_and_named(self):
        for language, locale, tag, drive, axis in (("en", "zh_CN.UTF-8", "en", "drive 1", "current, A"),
                                                   ("zh", "C", "zh-Hans", "驱动器 1", "电流，A")):
            self.put("run.csv", "time_s,1.iq_A\n0,1\n")
            ran = self.run_program("plot", "run.csv", "--lang", language, LC_ALL=locale)
            self.assertEqual(ran.stderr, "")
            root = xml.etree.ElementTree.fromstring(self.read("run.svg"))
            self.assertEqual(root.get("{http://www.w3.org/XML/1998/namespace}lang"), tag)
            texts = [text.text for text in root.iter(SVG + "text")]
            self.assertIn(drive, texts)
            self.assertIn(axis, texts)
            # Fonts that have the characters, and what every viewer has.
            fonts = root.get("font-family")
            self.assertIn("CJK SC", fonts)
            self.assertTrue(fonts.endswith("sans-serif"))


class Files(Plot):
    def test_an_svg_says_what_it_is(self):
        self.put("<a & b>.csv", "time_s,vcan0.1.iq_A\n0,1\n")
        self.run_program("plot", "<a & b>.csv", "-o", "out.svg")
        root = xml.etree.ElementTree.fromstring(self.read("out.svg"))
        self.assertEqual(root.get("role"), "img")
        self.assertEqual(root.find(SVG + "title").text, "<a & b>")
        self.assertIn("vcan0 drive 1", root.find(SVG + "desc").text)
        # The head of 62, a panel with its keys, the foot of 52 and three lines of 22 about what is missing.
        self.assertEqual(root.get("viewBox").split()[2:], ["1100", str(62 + APART + 52 + 3 * 22)])

    def test_the_same_file_gives_the_same_bytes(self):
        self.run_program("run", SCENARIO, "--csv", "run.csv", "--signals",
                         "angle_deg,speed_dps,iq_A,iq_ref_A,temperature_C,voltage_V")
        for name, locale in (("one.svg", "C.UTF-8"), ("two.svg", "de_DE.UTF-8")):
            self.run_program("plot", "run.csv", "-o", name, LC_ALL=locale)
        self.assertEqual(self.read("one.svg"), self.read("two.svg"))
        root = xml.etree.ElementTree.fromstring(self.read("one.svg"))
        for panel in range(4):
            colours = {trace.colour for trace in traces(root, panel)}
            self.assertLessEqual({BLUE, VERMILLION, GREEN, PURPLE}, colours, panel)

    def test_the_way_to_a_png_leads_there(self):
        self.assertTrue(shutil.which("rsvg-convert"), "not installed: librsvg2-bin")
        self.put("run.csv", "time_s,1.iq_A\n0,0\n1,1\n")
        _, _, commands = self.refused("run.csv", "-o", "run.png").partition("for a PNG: ")
        commands = commands.removesuffix(" (Debian: librsvg2-bin)").split(" && ")
        self.assertEqual([command.split()[0] for command in commands], ["lk-emu", "rsvg-convert"])
        self.run_program(*commands[0].split()[1:])
        subprocess.run(commands[1].split(), cwd=self.directory, check=True, timeout=120)
        size = struct.unpack(">II", self.read("run.png")[16:24])
        self.assertEqual(size, (1100, 62 + APART + 52 + 3 * 22))

    def test_the_default_is_an_svg_beside_the_input(self):
        os.mkdir(self.path("sub"))
        self.put("sub/run.csv", "time_s,1.iq_A\n0,1\n0.5,1\n")
        said = self.run_program("plot", "sub/run.csv").stdout
        self.assertEqual(said, "sub/run.svg: 1 drive, 2 rows, 0 to 0.5 s\n")
        self.assertEqual(sorted(os.listdir(self.path("sub"))), ["run.csv", "run.svg"])

    def test_drives_left_out_are_named(self):
        header = "time_s" + "".join(f",{n}.iq_A" for n in range(1, 9))
        self.put("run.csv", header + "\n" + ",".join(["0"] * 9) + "\n")
        said = self.run_program("plot", "run.csv").stdout
        self.assertEqual(said, "run.svg: 6 drives, 1 row, 0 to 0 s; not shown, see --ids: drive 7, drive 8\n")

    def test_odd_names_are_no_way_into_the_picture(self):
        name = b"a\x1b[2J\xff\xc2\x9b".decode(errors="surrogateescape") + ".csv"
        self.put(name, b"time_s,\xff<b>\x1b.1.iq_A\n0,1\n")
        ran = self.run_program("plot", name, "-o", "out.svg")
        self.assertNotIn("\x1b", ran.stdout)
        root = xml.etree.ElementTree.fromstring(self.read("out.svg"))
        self.assertEqual(root.find(SVG + "title").text, "a?[2J???")
        self.assertIn("?<b>? drive 1", root.find(SVG + "desc").text)
        self.assertIn("?<b>? drive 1", [text.text for text in root.iter(SVG + "text")])

    def test_markup_is_text(self):
        title = """</title><script>x&amp;'"]]>""".replace("/", "")
        bus = """<a b="&'"/>"""
        self.put(title + ".csv", f"time_s,{bus}.1.iq_A\n0,1\n1,1\n")
        self.run_program("plot", title + ".csv", "-o", "out.svg")
        root = xml.etree.ElementTree.fromstring(self.read("out.svg"))
        texts = [text.text for text in root.iter(SVG + "text")]
        self.assertEqual(root.find(SVG + "title").text, title)
        self.assertEqual(texts[:2], [title, f"{bus} drive 1"])
        self.assertLessEqual({element.tag for element in root.iter()},
                             {SVG + tag for tag in ("svg", "title", "desc", "rect", "g", "path", "text", "circle")})


class Refusals(Plot):
    def test_of_options(self):
        self.put("run.csv", "time_s,1.iq_A\n0,1\n")
        self.assertIn("FILE is required", self.refused())
        self.assertEqual(self.refused("none.csv"), "plot: cannot read none.csv: No such file or directory")
        self.assertEqual(self.refused("."), "plot: .: is a directory")
        os.mkfifo(self.path("pipe.csv"))
        self.assertEqual(self.refused("pipe.csv"), "plot: pipe.csv: is not a regular file")
        os.unlink(self.path("pipe.csv"))
        self.assertEqual(self.refused("run.csv", "-o", "run.pdf"),
                         "--output: run.pdf does not end in .svg")
        self.assertEqual(self.refused("run.csv", "-o", "run"), "--output: run does not end in .svg")
        self.assertEqual(self.refused("run.csv", "-o", "x.png"),
                         "--output: x.png does not end in .svg; for a PNG: lk-emu plot run.csv -o run.svg && "
                         "rsvg-convert -o run.png run.svg (Debian: librsvg2-bin)")
        self.assertEqual(self.refused("run.csv", "-o", "no/run.svg"),
                         "--output: cannot write no/run.svg: No such file or directory")
        self.assertIn("neither en nor zh", self.refused("run.csv", "--lang", "de"))
        self.assertEqual(self.refused("run.csv", "--ids", "2"), "--ids: the file has no drive 2")
        self.assertEqual(self.refused("run.csv", "--bus", "vcan0"), "--bus: the file has no bus vcan0")
        self.assertIn("--ids:", self.refused("run.csv", "--ids", "1-"))
        os.rename(self.path("run.csv"), self.path("run.svg"))
        self.assertEqual(self.refused("run.svg"), "plot: needs -o FILE, or it would draw over its input")
        self.assertEqual(os.listdir(self.directory), ["run.svg"])

    def test_of_files_leave_nothing_behind(self):
        for text in (b"", b"\0", b"time_s,1.iq_A\n0\n", b"time_s,1.iq_A\n0,1\nx,1\n", b"a,b\n1,2\n", b"\x7fELF" * 999999):
            self.put("run.csv", text)
            self.assertIn("run.csv", self.refused("run.csv"))
            self.assertEqual(os.listdir(self.directory), ["run.csv"])
        self.put("run.csv", "time_s,1.iq_A\n")
        self.run_program("plot", "run.csv")  # no rows are a run, too
        self.assertEqual(self.read("run.svg")[:5], b"<?xml")

    def test_of_a_full_disk(self):
        self.put("run.csv", "time_s,1.iq_A\n0,1\n")
        ran = subprocess.run([PROGRAM, "plot", "run.csv"], cwd=self.directory, stderr=subprocess.PIPE, text=True,
                             preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000)), timeout=60)
        self.assertEqual(ran.returncode, 2)
        self.assertEqual(ran.stderr, "lk-emu: --output: cannot write run.svg: File too large\n")
        self.assertEqual(os.listdir(self.directory), ["run.csv"])

    def test_of_whatever_comes(self):
        """Damaged files are refused in a line or drawn; nothing else."""
        chance = random.Random(1)
        whole = b"time_s,1.iq_A,2.voltage_V\n" + b"".join(
            b"%r,%r,%r\n" % (n / 100, math.sin(n), n) for n in range(40))
        for _ in range(120):
            text = bytearray(whole)
            for _ in range(chance.randint(1, 4)):
                at = chance.randrange(len(text))
                what = chance.randrange(3)
                if what == 0:
                    text[at] = chance.randrange(256)
                elif what == 1:
                    del text[at:at + chance.randrange(20)]
                else:
                    text[at:at] = chance.choice([b"1e308", b"-", b",", b"\n", b"nan", b"-inf", b"\0", b"9" * 400])
            self.put("run.csv", bytes(text))
            ran = subprocess.run([PROGRAM, "plot", "run.csv"], cwd=self.directory, stdout=subprocess.DEVNULL,
                                 stderr=subprocess.PIPE, timeout=60)
            self.assertIn(ran.returncode, (0, 2), (bytes(text), ran.stderr))
            if ran.returncode == 2:
                self.assertRegex(ran.stderr, rb"\Alk-emu: plot: run.csv:\d+: [ -~]+\n\Z")
            else:
                self.assert_inside(xml.etree.ElementTree.fromstring(self.read("run.svg")))

    def assert_inside(self, root):
        for panel in range(len(of_class(root, "panel"))):
            top = FIRST + APART * panel
            for trace in traces(root, panel):
                for x, y in (point for run in (*trace.runs, trace.dots) for point in run):
                    self.assertTrue(LEFT <= x <= RIGHT and top <= y <= top + HIGH, (panel, x, y))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
