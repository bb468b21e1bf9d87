"""Report of a campaign from given rows: conclusion, smallest cases, HTML page and JUnit."""

import html.parser
import json
import pathlib
import random
import xml.etree.ElementTree as ElementTree

import pytest

for library in ("jinja2", "regex", "scipy"):
    pytest.importorskip(library)

from lkemu.campaign import report
from lkemu.campaign.answer import answer_of, conclusion
from lkemu.campaign.compare import compare
from lkemu.campaign.judge import Result
from lkemu.campaign.merge import merge
from lkemu.campaign.store import Head, Store

SECOND = 1_000_000_000
PLAN = "[hazard]\nexpectations = []\n"
DIMENSIONS = (
    {"name": "fault.kind", "words": ["jam", "cut"], "harmless_is_most": False},
    {"name": "fault.at_s", "from": 0.0, "to": 4.0, "harmless_is_most": False},
    {"name": "fault.for_s", "from": 0.0, "to": 2.0, "harmless_is_most": False},
    {"name": "fault.jam.percent", "from": 0.0, "to": 100.0, "harmless_is_most": False},
    {"name": "supply_V", "from": 18.0, "to": 24.0, "harmless_is_most": True},
)  # fmt: skip


def head(cases, plan=PLAN, sampling="random"):
    return Head("0.2.0", "night", "a night", plan, "0" * 16, sampling, 1, cases, cases, "night.toml", None, DIMENSIONS)


def case(number, outcome, *values, **more):
    return Result(number, values or ("jam", 1.0, 1.0, 50.0, 24.0), outcome, SECOND, SECOND, **more)


def dominates(one, other):
    """True if no number of `one` is more harmful and at least one is less harmful than in `other`."""
    harms = [[-value if dimension["harmless_is_most"] else value for dimension, value in zip(DIMENSIONS, row.values) if not isinstance(value, (str, type(None)))]
             for row in (one, other)]  # fmt: skip
    return all(a <= b for a, b in zip(*harms)) and harms[0] != harms[1]


# Smallest cases


def random_results(count, seed):
    draw = random.Random(seed)
    rows = []
    for number in range(count):
        kind = draw.choice(("jam", "cut"))
        values = [kind, *(draw.choice((0.0, 0.5, 1.0, 1 + 2**-52)) for _ in range(2)), draw.choice((5.0, 50.0, 100.0)) if kind == "jam" else None]
        rows.append(case(number, draw.choice(("late", "silently wrong", "tolerated")), *values, draw.choice((18.0, 20.0, 24.0))))
    return rows


@pytest.mark.parametrize("seed", range(20))
def test_no_failing_case_dominates_a_smallest_one(seed):
    rows = random_results(60, seed)
    smallest = answer_of(head(60), rows).smallest
    assert {(kind, one.outcome) for kind, one in smallest} == {(row.values[0], row.outcome) for row in rows if row.outcome != "tolerated"}
    for kind, one in smallest:
        assert not [row for row in rows if (row.values[0], row.outcome) == (kind, one.outcome) and dominates(row, one)]


def test_smallest_compares_severity_first():
    rows = [case(0, "late", "jam", 0.0, 2.0, 100.0, 24.0), case(1, "late", "jam", 4.0, 0.1, 5.0, 18.0), case(2, "late", "jam", 4.0, 0.1, 5.0, 24.0)]
    assert [one.number for _, one in answer_of(head(3), rows).smallest] == [2], "24 V is the harmless end"


def test_merge_keeps_smallest_cases(tmp_path):
    rows = random_results(60, 1)
    for shard in range(3):
        store = Store.create(tmp_path / f"{shard}.db", head(60))
        store.put(row for row in rows if row.number % 3 == shard)
        store.note_shard(shard, 3)
        store.close()
    assert merge(tmp_path / "all.db", [tmp_path / f"{shard}.db" for shard in range(3)]).is_whole
    merged = Store.read(tmp_path / "all.db")
    smallest = answer_of(merged.head, merged).smallest
    merged.close()
    assert smallest == answer_of(head(60), rows).smallest
    text = report.text_report(answer_of(head(60), rows), [])
    data = json.loads(report.json_report(answer_of(head(60), rows), []))
    assert "smallest failing case of each kind and outcome:" in text
    assert [(one["kind"], one["case"]["number"]) for one in data["smallest"]] == [(kind, one.number) for kind, one in smallest]
    assert data["smallest"][0]["command"] == f"lk-emu campaign night.toml --case {smallest[0][1].number}"


# The conclusion


def test_report_starts_with_conclusion():
    """The host exits with status 1 in some cases, which the plan does not count as a detection."""
    rows = [case(n, "crash", note="exit status 1", violated_at_ns=2 * SECOND) for n in range(35)]
    rows += [case(n, "silently wrong", violated_at_ns=2 * SECOND) for n in range(35, 53)]
    rows += [case(n, "tolerated") for n in range(53, 200)]
    answer = answer_of(head(200, PLAN + "[host]\n"), rows)
    expected = "53 of 200 cases were dangerous; the host detected none in time. 35 hosts exited with status 1, which [detect] does not count."
    assert conclusion(answer) == expected
    assert report.text_report(answer, []).startswith(f"night: {expected}\n")
    assert json.loads(report.json_report(answer, []))["conclusion"] == expected


def test_conclusion_names_single_detector():
    rows = [case(0, "detected by the host", detected_by_host_ns=SECOND, violated_at_ns=2 * SECOND), case(1, "hang", note="did not end in time"),
            case(2, "detected by the host", detected_by_host_ns=SECOND)]  # fmt: skip
    assert conclusion(answer_of(head(3), rows)) == (
        "2 of 3 cases were dangerous; 1 of these was detected in time, by the host (50.0 %). 1 host did not end in time."
    )


def test_conclusion_counts_detections_by_drive_and_host():
    rows = [case(n, "detected by the host" if n < 2 else "detected by the drive", violated_at_ns=2 * SECOND) for n in range(3)]
    assert conclusion(answer_of(head(3), rows)) == "3 of 3 cases were dangerous; 3 of these were detected in time, 2 by the host and 1 by the drive (100.0 %)."
    assert "2 of these were detected in time, all by the host" in conclusion(answer_of(head(2), rows[:2]))


def test_report_shows_rates_or_their_absence():
    rows = [case(0, "silently wrong", violated_at_ns=2 * SECOND)]
    without = answer_of(head(1), rows)
    weighted = answer_of(head(1, PLAN + "[rates]\njam = 2.5\ncut = 1.0\n"), rows)
    assert "the plan has no failure rates" in report.text_report(without, []) and "the plan has no failure rates" in report.page(without, [])
    assert "weighted by the failure rates of the plan: 0" in report.text_report(weighted, [])
    line = next(line for line in report.text_report(weighted, []).splitlines() if line.startswith("jam "))
    assert "2.5" in line.split() and "<th>failure rate" in report.page(weighted, [])
    assert {one["kind"]: one["failure_rate"] for one in json.loads(report.json_report(weighted, []))["kinds"]} == {"jam": 2.5, "cut": 1.0}


# The page


class Page(html.parser.HTMLParser):
    """Parses a page: tables as lists of rows of texts, (tag, style) pairs, and links."""

    def __init__(self, text):
        super().__init__()
        self.tables, self.styles, self.links, self.in_table = [], [], [], False
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        if tag == "table":
            self.tables.append([])
            self.in_table = True
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self.tables[-1][-1].append("")
        for name, value in attributes:
            if name == "style":
                self.styles.append((tag, value))
            if name in ("src", "href"):
                self.links.append(value)

    def handle_endtag(self, tag):
        self.in_table = self.in_table and tag != "table"

    def handle_data(self, data):
        if self.in_table and self.tables[-1] and self.tables[-1][-1]:
            self.tables[-1][-1][-1] += data.strip()


def test_page_draws_shares_as_bars_and_intervals_as_lines():
    """No dangerous case of ten is detected. So the bar is empty and the interval is 0 to 1 - 0.025^(1/10) = 0.308."""
    answer = answer_of(head(10), [case(n, "silently wrong", violated_at_ns=2 * SECOND) for n in range(10)])
    page = Page(report.page(answer, []))
    assert [value for tag, value in page.styles if tag == "i"] == ["width: 0.0%"] * 2
    lines = [value for tag, value in page.styles if tag == "b"]
    assert len(lines) == 2 and all(line.startswith("left: 0.0%; width: 30.8") for line in lines)
    assert Page(report.page(answer_of(head(10, sampling="latin"), []), [])).styles == [], "no case: neither"


def test_page_needs_no_network_and_has_dashboard_style():
    text = report.page(answer_of(head(1), [case(0, "late")]), [])
    assert not Page(text).links and "@import" not in text and "url(" not in text
    style = (pathlib.Path(report.__file__).parents[3] / "web/style.css").read_text()
    assert style.strip() in text


def test_table_rows_have_all_columns():
    rows = random_results(60, 2)
    for plan in (PLAN, "", PLAN + "[rates]\njam = 1\ncut = 2\n"):
        for table in Page(report.page(answer_of(head(60, plan), rows), [])).tables:
            assert len({len(row) for row in table}) == 1


def test_page_shows_comparison():
    old = [case(0, "detected by the host"), case(1, "tolerated")]
    new = [case(0, "silently wrong", violated_at_ns=2 * SECOND), case(1, "tolerated")]
    text = report.page(answer_of(head(2), new), (), compare(head(2), old, head(2), new))
    tables = Page(text).tables
    assert ["detected by the host", "silently wrong", "1"] in tables[0] and tables[1][1][:2] == ["0", "detected by the host"]
    assert ": 1 worse, 0 better, 1 the same." in text


def test_junit_has_names_and_correct_counts():
    """Each kind has a test with name and class. The counts equal the numbers of tests."""
    rows = [case(0, "late"), case(1, "not fired", "cut", 1.0, 1.0, None, 24.0)]
    (suite,) = ElementTree.fromstring(report.junit(answer_of(head(2), rows)).encode())
    cases = suite.findall("testcase")
    assert [one.get("name") for one in cases] == ["fault jam", "fault cut"] and all(one.get("classname") == "night" for one in cases)
    for count, child in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
        assert int(suite.get(count)) == len(suite.findall(f"testcase/{child}"))
    assert int(suite.get("tests")) == len(cases) and all(one.get("message") for one in suite.findall("testcase/*"))


def test_page_draws_upper_bound_behind_lower_bound():
    """One case is dangerous and undetected. Another is detected in time, maybe dangerous. Coverage is 0 to 1 of 2."""
    rows = [case(0, "silently wrong", violated_at_ns=2 * SECOND), case(1, "detected by the host", detected_by_host_ns=SECOND)]
    text = report.page(answer_of(head(2, PLAN + "[host]\n", "full"), rows), [])
    assert [style for style in Page(text).styles if style[0] in "ui"] == [("u", "width: 50.0%"), ("i", "width: 0.0%")] * 2
    assert "0.000 to 0.500" in text


def test_coverage_text_of_late_detections_without_hazard():
    answer = answer_of(head(1, PLAN + "[host]\n"), [case(0, "late", detected_by_host_ns=SECOND)])
    assert "0, or no case was dangerous" in report.text_report(answer, []) and "0, or no case was dangerous" in report.page(answer, [])
