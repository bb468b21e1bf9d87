#!/usr/bin/python3
"""lk-emu plot, through the real program: what is in its SVG and PNG files, and what it refuses.

usage: plot_test.py LK_EMU SCENARIO   (with four drives)
"""

import math
import os
import random
import re
import resource
import struct
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree
import zlib

PROGRAM, SCENARIO = map(os.path.abspath, sys.argv[1:3])
SVG = "{http://www.w3.org/2000/svg}"

# The layout of the picture (docs/plot.md): 1100 wide, panels from 80 to 1020, 190 high, 224 apart, the first at 96.
LEFT, RIGHT, FIRST, HIGH, APART = 80, 1020, 96, 190, 224
BLUE, VERMILLION = (0x00, 0x72, 0xB2), (0xD5, 0x5E, 0x00)


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


def properties(element):
    """What an element looks like: of its style, which Cairo 1.16 writes, or of attributes, which 1.18 does."""
    found = dict(element.attrib)
    found.update(part.split(":", 1) for part in element.get("style", "").replace(" ", "").split(";") if ":" in part)
    return found


def colour_of(text):
    """Three bytes out of rgb(0%,44.7%,69.8%)."""
    parts = re.findall(r"([\d.]+)%", text)
    return tuple(round(float(part) * 2.55) for part in parts)


def lines(root, colour, panel, dashed=False, broad=False):
    """Points of the lines of this colour in a panel, as the paths in the file have them."""
    found = []
    top = FIRST + APART * panel
    for path in root.iter(SVG + "path"):
        look = properties(path)
        if look.get("fill") != "none" or colour_of(look.get("stroke", "")) != colour:
            continue
        if (look.get("stroke-dasharray", "none") != "none") != dashed or (float(look["stroke-width"]) > 2) != broad:
            continue
        numbers = [float(number) for number in re.findall(r"-?[\d.]+", path.get("d"))]
        points = list(zip(numbers[::2], numbers[1::2]))
        if all(top <= y <= top + HIGH for _, y in points):
            found.append(points)
    return found


class Lines(Plot):
    def test_points_are_where_the_axes_put_them(self):
        root = self.svg("time_s,1.angle_deg\n0,-50\n1,0\n3,100\n4,50\n")
        (points,) = lines(root, BLUE, 0)
        # Times fill the panel; values from -50 to 100 have 6 % of 150 as a margin: -59 to 109.
        expected = [(0, -50), (1, 0), (3, 100), (4, 50)]
        self.assertEqual(len(points), len(expected))
        for (x, y), (time, value) in zip(points, expected):
            self.assertAlmostEqual(x, LEFT + (RIGHT - LEFT) * time / 4, delta=1 / 16)
            self.assertAlmostEqual(y, FIRST + HIGH - HIGH * (value + 59) / 168, delta=1 / 16)

    def test_the_true_is_broad_and_the_reference_dashed(self):
        root = self.svg("time_s,1.true_rotor_dps,1.speed_dps,1.speed_ref_dps\n0,0,1,2\n1,100,101,102\n")
        self.assertEqual(len(lines(root, BLUE, 0, broad=True)), 1)
        self.assertEqual(len(lines(root, BLUE, 0)), 1)
        darker = tuple(round(value / 2) for value in BLUE)
        self.assertEqual(len(lines(root, darker, 0, dashed=True)), 1)

    def test_every_drive_has_its_colour(self):
        root = self.svg("time_s,1.iq_A,7.iq_A\n0,1,2\n1,1,2\n")
        (first,), (second,) = lines(root, BLUE, 0), lines(root, VERMILLION, 0)
        self.assertGreater(first[0][1], second[0][1])
        only = self.svg("time_s,1.iq_A,7.iq_A\n0,1,2\n1,1,2\n", "--ids", "7")
        self.assertEqual((len(lines(only, BLUE, 0)), len(lines(only, VERMILLION, 0))), (1, 0))

    def test_a_spike_among_a_hundred_thousand_rows_is_seen(self):
        rows = ["time_s,1.iq_A"] + [f"{n / 1000},{10 if n == 54321 else 0}" for n in range(100_000)]
        root = self.svg("\n".join(rows) + "\n")
        (points,) = lines(root, BLUE, 0)
        x, y = min(points, key=lambda point: point[1])
        self.assertAlmostEqual(y, FIRST + HIGH * 0.06 / 1.12, delta=1 / 16)
        self.assertAlmostEqual(x, LEFT + (RIGHT - LEFT) * 54.321 / 99.999, delta=1 / 16)
        self.assertLess(os.path.getsize(self.path("run.svg")), 150_000)

    def test_gaps_break_lines_and_lone_points_are_dots(self):
        root = self.svg("time_s,1.iq_A\n0,1\n1,1\n2,nan\n3,1\n4,\n5,1\n6,1\n")
        found = lines(root, BLUE, 0)
        self.assertEqual(len(found), 3)
        dots = [path for path in root.iter(SVG + "path") if properties(path).get("stroke-linecap") == "round"]
        self.assertEqual(len(dots), 1)
        middle = (LEFT + RIGHT) / 2
        self.assertEqual({x for x, _ in found[1]}, {middle})

    def test_a_single_row_is_a_dot_in_the_middle(self):
        (points,) = lines(self.svg("time_s,1.iq_A\n7,3\n"), BLUE, 0)
        self.assertEqual(set(points), {((LEFT + RIGHT) / 2, FIRST + HIGH / 2)})


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
        for name in ("one.svg", "two.svg", "one.png", "two.png"):
            self.run_program("plot", "run.csv", "-o", name, LC_ALL="C.UTF-8" if "one" in name else "de_DE.UTF-8")
        self.assertEqual(self.read("one.svg"), self.read("two.svg"))
        self.assertEqual(self.read("one.png"), self.read("two.png"))
        root = xml.etree.ElementTree.fromstring(self.read("one.svg"))
        for panel in range(4):
            for colour in (BLUE, VERMILLION, (0x00, 0x9E, 0x73), (0xCC, 0x79, 0xA7)):
                self.assertTrue(lines(root, colour, panel), (panel, colour))

    def test_a_png_is_twice_as_large_and_shows_the_line(self):
        self.put("run.csv", "time_s,1.iq_A\n0,0\n1,1\n")
        self.run_program("plot", "run.csv", "-o", "run.png")
        png = self.read("run.png")
        self.assertEqual(png[:8], b"\x89PNG\r\n\x1a\n")
        chunks, at = {}, 8
        while at < len(png):
            length, kind = struct.unpack(">I4s", png[at:at + 8])
            data = png[at + 8:at + 8 + length]
            self.assertEqual(zlib.crc32(kind + data), struct.unpack(">I", png[at + 8 + length:at + 12 + length])[0])
            chunks[kind] = chunks.get(kind, b"") + data
            at += 12 + length
        width, height, depth, colour_type = struct.unpack(">IIBB", chunks[b"IHDR"][:10])
        self.assertEqual((width, height), (2200, 2 * (62 + APART + 52 + 3 * 22)))
        self.assertEqual((depth, colour_type), (8, 2))  # RGB
        self.assertEqual(len(zlib.decompress(chunks[b"IDAT"])), height * (1 + 3 * width))

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

    def test_words_are_chinese_where_a_font_has_them(self):
        self.put("run.csv", "time_s,1.iq_A\n0,1\n")
        ran = self.run_program("plot", "run.csv", "--lang", "zh")
        text = self.read("run.svg").decode()
        if ran.stderr:
            self.assertRegex(ran.stderr, r"\Alk-emu: no font here has .* English.*\n\Z")
            self.assertIn("drive 1", text)
        else:
            self.assertIn("驱动器 1", text)


class Refusals(Plot):
    def test_of_options(self):
        self.put("run.csv", "time_s,1.iq_A\n0,1\n")
        self.assertIn("FILE is required", self.refused())
        self.assertEqual(self.refused("none.csv"), "plot: cannot read none.csv: No such file or directory")
        self.assertEqual(self.refused("."), "plot: . is a directory")
        self.assertEqual(self.refused("run.csv", "-o", "run.pdf"),
                         "--output: run.pdf ends neither in .svg nor in .png")
        self.assertEqual(self.refused("run.csv", "-o", "run"), "--output: run ends neither in .svg nor in .png")
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
                xml.etree.ElementTree.fromstring(self.read("run.svg"))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
