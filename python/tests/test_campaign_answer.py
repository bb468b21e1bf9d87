"""Evaluation, comparison and reports of campaigns, from given results."""

import json
import xml.etree.ElementTree as ElementTree

import pytest

pytest.importorskip("scipy")
pytest.importorskip("jinja2")

from lkemu.campaign import report
from lkemu.campaign.answer import answer_of, clopper_pearson, conclusion
from lkemu.campaign.compare import compare
from lkemu.campaign.judge import Result
from lkemu.campaign.outcomes import OUTCOMES
from lkemu.campaign.store import Head
from lkemu.campaign.thresholds import check_thresholds, parse_threshold
from lkemu.errors import StartError

PLAN = "[hazard]\nexpectations = []\n"
SECOND = 1_000_000_000


def head(plan=PLAN, sampling="random", cases=5):
    dimensions = ({"name": "fault.kind", "words": ["jam", "cut"], "harmless_is_most": False},
                  {"name": "fault.at_s", "from": 0.0, "to": 4.0, "harmless_is_most": False})  # fmt: skip
    return Head("0.2.0", "night", "a night", plan, "0" * 16, sampling, 1, cases, cases, "night.toml", None, dimensions)


def case(number, outcome, kind="jam", effect=SECOND, drive=None, host=None, violated=None):
    fired = outcome != "not fired"
    return Result(number, (kind, 1.0), outcome, SECOND, effect if fired else None, drive, host, violated,
                  "it stays" if violated is not None else "", state="running", command="A4")  # fmt: skip


def five():
    return [
        case(0, "detected by the drive", drive=SECOND + 100, violated=SECOND + 200),  # dangerous, in time
        case(1, "silently wrong", violated=2 * SECOND),  # dangerous
        case(2, "detected by the host", "cut", host=SECOND + 300),  # safe and detected
        case(3, "tolerated", "cut"),
        case(4, "not fired", "cut"),
    ]


def test_coverage_counts_dangerous_cases_only():
    answer = answer_of(head(), five())
    assert (answer.all.coverage.detected, answer.all.coverage.dangerous) == (1, 2)
    assert answer.all.coverage.share == 0.5
    assert (answer.all.safe_detected, answer.all.safe_undetected) == (1, 1)
    assert answer.kinds["cut"].coverage.share is None
    assert answer.missing == 0
    assert conclusion(answer) == (
        "2 of 5 cases were dangerous; 1 of these was detected in time, by the drive (50.0 %)."
    )


def test_constant_alarm_gains_no_coverage():
    quiet = [case(0, "silently wrong", violated=2 * SECOND), *(case(n, "tolerated") for n in range(1, 5))]
    loud = [quiet[0], *(case(n, "detected by the host", host=SECOND) for n in range(1, 5))]
    assert answer_of(head(), loud).all.coverage.share == answer_of(head(), quiet).all.coverage.share == 0


def test_coverage_has_bounds_unless_a_passive_host_ran():
    """2 cases are dangerous, 1 of them detected in time. 2 are detected without a hazard, 1 in time and 1 late."""
    cases = [*five()[:3], case(3, "late", host=2 * SECOND)]
    coverage = answer_of(head(plan=PLAN + "[host]\n", cases=4), cases).all.coverage
    assert (coverage.share, coverage.upper) == (1 / 3, 2 / 3)
    assert "from 0.3333 to 0.6667" in report.coverage_text(coverage)
    cases[2].passive, cases[3].passive = "dangerous", "safe"
    coverage = answer_of(head(plan=PLAN + "[host]\npassive = 'X=1'\n", cases=4), cases).all.coverage
    assert coverage.share == coverage.upper == 2 / 3


def test_report_names_uncounted_ends_of_hosts():
    dead = [case(n, "crash") for n in range(3)]
    dead[0].note = dead[1].note = "exit status 7"
    dead[2].note = "uncaught lkemu.errors.NoReply"
    answer = answer_of(head(cases=3), dead, {"lk-emu was killed from outside": 2})
    assert conclusion(answer).endswith("2 hosts exited with status 7, which [detect] does not count. "
                                       "1 host ended by an uncaught lkemu.errors.NoReply, which [detect] does not count.")  # fmt: skip
    for text in (report.text_report(answer, []), report.page(answer, [])):
        assert "exit_status = 7" in text and "lkemu\\.errors\\.NoReply" in text
        assert "2 cases without a result, because the machine failed (lk-emu was killed from outside)" in text


def test_plan_without_hazard_has_no_coverage():
    answer = answer_of(head(plan=""), five())
    assert "no [hazard]" in conclusion(answer)
    assert "coverage" not in report.text_report(answer, []).replace(conclusion(answer), "")
    with pytest.raises(StartError, match="no .hazard."):
        check_thresholds(answer, [parse_threshold("coverage>=0.9")])


def test_weighted_coverage_uses_failure_rates():
    """jam: 2 of 2 fired cases are dangerous, 1 is detected; the rate is 2. cut: 1 of 2 is dangerous; the rate is 1."""
    cases = [case(0, "detected by the drive", drive=SECOND, violated=2 * SECOND), case(1, "silently wrong", violated=SECOND),
             case(2, "silently wrong", "cut", violated=SECOND), case(3, "tolerated", "cut")]  # fmt: skip
    answer = answer_of(head(PLAN + "[rates]\njam = 2.0\ncut = 1.0\n", cases=4), cases)
    # λ_DD = 2 × 1/2; λ_D = 2 × 2/2 + 1 × 1/2.
    assert answer.weighted_coverage == pytest.approx(1 / 2.5)


def test_clopper_pearson_matches_closed_form():
    """Source: exact form of the rule of three. Without a hit in n trials, the upper limit is 1 - 0.025^(1/n)."""
    assert clopper_pearson(0, 10) == (0, pytest.approx(1 - 0.025**0.1))
    assert clopper_pearson(10, 10) == (pytest.approx(0.025**0.1), 1)
    assert clopper_pearson(0, 0) == (0, 1)
    assert answer_of(head(sampling="latin"), five()).all.coverage.interval is None


def test_latency_quantiles_are_nearest_ranks():
    answer = answer_of(head(cases=100), [case(n, "detected by the drive", drive=SECOND + n + 1) for n in range(100)])
    assert [answer.all.first.quantile_s(share) for share in (0.5, 0.99, 1)] == [50e-9, 99e-9, 100e-9]


@pytest.mark.parametrize(
    "text, measured, holds",
    [("coverage>=0.5", 0.5, True), ("coverage[jam]>=0.51", 0.5, False), ("silently_wrong<=0", 1, False),
     ("latency.worst_s<=1e-6", 3e-7, True), ("coverage[cut]>=0", None, False)],
)  # fmt: skip
def test_checks_requirements(text, measured, holds):
    (checked,) = check_thresholds(answer_of(head(), five()), [parse_threshold(text)])
    assert (checked.measured, checked.holds) == (measured, holds)


def test_requirement_fails_while_cases_are_missing():
    (checked,) = check_thresholds(answer_of(head(cases=6), five()), [parse_threshold("silently_wrong<=1")])
    assert not checked.holds and "1 cases are missing" in str(checked)


@pytest.mark.parametrize("text", ["coverage", "coverage>0.9", "covrage>=0.9", "coverage>=2", "late<=0.5", "coverage[jam]>=x", "latency.p50_s<=-1"])
def test_rejects_malformed_requirements(text):
    with pytest.raises(StartError, match="--require"):
        parse_threshold(text)


def test_rejects_requirement_of_unknown_kind():
    with pytest.raises(StartError, match="jam, cut"):
        check_thresholds(answer_of(head(), five()), [parse_threshold("late[hang]<=0")])


@pytest.mark.parametrize("before", [one for one in OUTCOMES.values() if one.in_time])
@pytest.mark.parametrize("now", [one for one in OUTCOMES.values() if not one.in_time and one.name != "not fired"])
def test_lost_detection_is_worse(before, now):
    comparison = compare(head(), [case(0, before.name)], head(), [case(0, now.name)])
    assert (comparison.worse, comparison.better) == (1, 0)
    assert comparison.cases == [(before.name, case(0, now.name))]
    assert compare(head(), [case(0, now.name)], head(), [case(0, before.name)]).better == 1


def test_detection_by_drive_instead_of_host_is_worse():
    assert compare(head(), [case(0, "detected by the host")], head(), [case(0, "detected by the drive")]).worse == 1


def test_compares_cases_of_equal_number():
    old = [case(0, "late"), case(1, "tolerated"), case(3, "not fired")]
    new = [case(1, "tolerated"), case(2, "late"), case(3, "late")]
    comparison = compare(head(), old, head(), new)
    assert (comparison.only_before, comparison.only_now, comparison.same, comparison.not_fired) == (1, 1, 1, 1)


def test_rejects_comparison_of_different_plans():
    with pytest.raises(StartError, match="seed was 1 and is 2"):
        other = Head(**{**vars(head()), "seed": 2})
        compare(head(), [], other, [])
    with pytest.raises(StartError, match="case 0 had fault.kind = jam and has cut"):
        compare(head(), [case(0, "late")], head(), [case(0, "late", "cut")])


def test_all_report_formats_show_the_results():
    answer = answer_of(head(), five())
    required = check_thresholds(answer, [parse_threshold("coverage>=0.9")])
    text = report.text_report(answer, required)
    assert "0.5000, 1 of 2 (95 %:" in text and "FAILS: coverage>=0.9: measured 0.5" in text
    assert "lk-emu campaign night.toml --case 1" in text
    page = report.page(answer, required)
    assert page.count("<details") == 1 and "width: 50.0%" in page
    suite = ElementTree.fromstring(report.junit(answer).encode())
    assert [suite[0].get(name) for name in ("tests", "failures", "errors", "skipped")] == ["2", "1", "0", "0"]
    data = json.loads(report.json_report(answer, required))
    assert data["all"]["coverage"]["share"] == 0.5 and data["residual"][0]["outcome"] == "silently_wrong"


def test_reports_escape_markup_and_control_characters():
    evil = case(1, "silently wrong", violated=SECOND)
    evil.note = "</script><b>\x1b[31m"
    answer = answer_of(head(), [evil])
    assert "<b>" not in report.page(answer, []).split("<h2>Failures")[1]
    assert "\x1b" not in report.text_report(answer, [])
    ElementTree.fromstring(report.junit(answer).encode())
