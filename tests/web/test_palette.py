"""Good, warning and bad differ for people with deuteranopia, in both themes of style.css."""

import itertools
import math
import pathlib
import re

import pytest

STYLE = pathlib.Path(__file__).resolve().parents[2] / "web" / "style.css"
LEAST = 20  # CIEDE2000

# Machado, Oliveira and Fernandes 2009, deuteranopia of severity 1, for linear RGB.
DEUTERANOPIA = ((0.367322, 0.860646, -0.227968), (0.280085, 0.672501, 0.047413), (-0.011820, 0.042940, 0.968881))
XYZ = ((0.4124564, 0.3575761, 0.1804375), (0.2126729, 0.7151522, 0.0721750), (0.0193339, 0.1191920, 0.9503041))  # sRGB, D65
WHITE = (0.95047, 1, 1.08883)


def times(matrix, vector):
    return [sum(a * b for a, b in zip(row, vector)) for row in matrix]


def seen(colour):
    """Returns a colour #rrggbb in CIELAB as people with deuteranopia see it."""
    parts = [int(colour[n:n + 2], 16) / 255 for n in (1, 3, 5)]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    xyz = times(XYZ, [min(1, max(0, part)) for part in times(DEUTERANOPIA, linear)])
    shares = [value / white for value, white in zip(xyz, WHITE)]
    x, y, z = (share ** (1 / 3) if share > 216 / 24389 else (24389 / 27 * share + 16) / 116 for share in shares)
    return 116 * y - 16, 500 * (x - y), 200 * (y - z)


def ciede2000(one, other):
    """Sharma, Wu and Dalal 2005."""
    (l1, a1, b1), (l2, a2, b2) = one, other
    mean = (math.hypot(a1, b1) + math.hypot(a2, b2)) / 2
    stretch = 1.5 - 0.5 * math.sqrt(mean ** 7 / (mean ** 7 + 25 ** 7))
    c1, c2 = math.hypot(a1 * stretch, b1), math.hypot(a2 * stretch, b2)
    h1, h2 = (math.degrees(math.atan2(b, a * stretch)) % 360 for a, b in ((a1, b1), (a2, b2)))
    turn = (h2 - h1 + 180) % 360 - 180
    c, l, h = (c1 + c2) / 2, (l1 + l2) / 2, h1 + turn / 2
    cosine = lambda factor, shift: math.cos(math.radians(factor * h + shift))
    t = 1 - 0.17 * cosine(1, -30) + 0.24 * cosine(2, 0) + 0.32 * cosine(3, 6) - 0.2 * cosine(4, -63)
    dl = (l2 - l1) / (1 + 0.015 * (l - 50) ** 2 / math.sqrt(20 + (l - 50) ** 2))
    dc = (c2 - c1) / (1 + 0.045 * c)
    dh = 2 * math.sqrt(c1 * c2) * math.sin(math.radians(turn / 2)) / (1 + 0.015 * c * t)
    blue = math.exp(-((h % 360 - 275) / 25) ** 2)
    rotation = -2 * math.sqrt(c ** 7 / (c ** 7 + 25 ** 7)) * math.sin(math.radians(60 * blue))
    return math.sqrt(dl ** 2 + dc ** 2 + dh ** 2 + rotation * dc * dh)


@pytest.mark.parametrize("one, other, difference", [  # from table 1 of the publication
    ((50, 2.6772, -79.7751), (50, 0, -82.7485), 2.0425), ((50, 2.5, 0), (73, 25, -18), 27.1492),
    ((60.2574, -34.0099, 36.2677), (60.4626, -34.1751, 39.4387), 1.2644), ((2.0776, 0.0795, -1.1350), (0.9033, -0.0636, -0.5514), 0.9082)])
def test_formula_gives_published_differences(one, other, difference):
    assert ciede2000(one, other) == pytest.approx(difference, abs=1e-4)


@pytest.mark.parametrize("theme", [':root', ':root[data-theme="light"]'])
def test_states_differ_under_deuteranopia(theme):
    rules = STYLE.read_text().split(f"\n{theme} {{")[1].split("}")[0]
    colours = {name: re.search(rf"--{name}: (#[0-9a-f]{{6}});", rules)[1] for name in ("good", "warn", "bad")}
    for (one, a), (other, b) in itertools.combinations(colours.items(), 2):
        assert ciede2000(seen(a), seen(b)) >= LEAST, f"{one} and {other}"
