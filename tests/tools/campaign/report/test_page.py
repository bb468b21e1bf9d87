"""What a person sees and does on the page of an answer."""

import json
import re

import pytest
from selenium.webdriver.support.ui import WebDriverWait

FIRST = "#residual-cases tbody tr"


@pytest.fixture(scope="session")
def answer(pages):
    return json.loads((pages / "many.json").read_text())


def rows(answer):
    """The residual cases, with names."""
    return [dict(zip(answer["residual"]["columns"], row)) for row in answer["residual"]["rows"]]


def sort_by(page, column):
    page.click(f'#residual-cases th[data-column="{column}"] button')


def search(page, words):
    page.run("""
      const field = document.querySelector('#residual-cases input[type=search]');
      field.value = arguments[0];
      field.dispatchEvent(new Event('input'));""", words)


def shown(page):
    return page.text("#residual-cases [role=status]")


def test_the_browser_has_nothing_to_say_and_nothing_is_fetched(browser, pages):
    for name in ("many", "few", "nasty"):
        for query in ("", "?lang=zh"):
            browser.show(pages / f"{name}.html", query)
            assert browser.all("#matrix-table tbody tr"), name
            # Pictures in the page itself are no requests to anybody.
            asked = [url for url in browser.requests() if not url.startswith("data:")]
            assert asked == [(pages / f"{name}.html").as_uri() + query], name
            assert browser.complaints() == [], name


def test_texts_are_texts(browser, pages):
    browser.show(pages / "nasty.html")
    assert browser.run("return window.ran") is None
    assert len(browser.all("img")) == 1  # the picture of the smallest case
    browser.click(f"{FIRST} button")
    assert "</script><script>window.ran = 1" in browser.text("#residual-cases .facts")
    assert browser.run("return window.ran") is None


def test_the_matrix_has_the_counts(many, answer):
    heads = many.texts("#matrix-table thead th")
    for kind in answer["kinds"]:
        cells = many.texts(f'#matrix-table tr[data-kind="{kind["kind"]}"] > *')
        assert cells[heads.index("cases")] == f'{kind["cases"]:,}'
        for outcome, count in kind["outcomes"].items():
            head = outcome.replace("detected_by_", "detected by the ").replace("_", " ")
            assert cells[heads.index(head)] == (f"{count:,}" if count else "·"), (kind["kind"], outcome)


def test_a_count_leads_to_its_cases(many, answer):
    silent = next(kind for kind in answer["kinds"] if kind["kind"] == "dip")["outcomes"]["silently_wrong"]
    many.click('#matrix-table tr[data-kind="dip"] button')  # it has no other failures
    assert shown(many) == f"1 to {silent} of {silent}"
    assert set(many.column("fault")) == {"dip"}


def test_cases_are_drawn_a_page_at_a_time(many, answer):
    count = len(answer["residual"]["rows"])
    assert count > 30_000
    assert len(many.all(FIRST)) == 50
    assert shown(many) == f"1 to 50 of {count:,}"
    many.run("[...document.querySelectorAll('#residual-cases .row button')].find((b) => b.textContent === 'Next').click()")
    assert shown(many) == f"51 to 100 of {count:,}"
    numbers = [int(text.split()[1]) for text in many.column("number")]
    assert numbers == [row["number"] for row in rows(answer)][50:100]


def test_sorting(many, answer):
    known = [row for row in rows(answer) if row["margin"] is not None]
    by_margin = sorted(known, key=lambda row: (row["margin"], row["number"]))
    sort_by(many, "margin")
    assert [int(text.split()[1]) for text in many.column("number")] == [row["number"] for row in by_margin[:50]]
    assert many.run("return document.querySelector('#residual-cases th[data-column=margin]').ariaSort") == "ascending"
    sort_by(many, "margin")
    assert float(many.column("margin")[0]) == by_margin[-1]["margin"]
    assert many.run("return document.querySelector('#residual-cases th[data-column=margin]').ariaSort") == "descending"
    sort_by(many, "outcome")
    assert set(many.column("outcome")) == {"late"}  # the least of them
    sort_by(many, "outcome")
    assert set(many.column("outcome")) == {"crash"}


def test_what_has_no_latency_comes_last_either_way(many):
    for _ in range(2):
        sort_by(many, "detected_after")
        assert "–" not in many.column("detected_after")
        latencies = [float(text) for text in many.column("detected_after")]
    assert latencies == sorted(latencies, reverse=True)


def test_searching(many, answer):
    crashed = [row for row in rows(answer) if row["kind"] == "jam" and row["outcome"] == "crash"]
    percent = crashed[0]["values"][2]
    wanted = [row["number"] for row in crashed if row["values"][2] == percent]
    search(many, f"fault.jam.percent={percent:g} CRASH")
    assert [int(text.split()[1]) for text in many.column("number")] == wanted
    assert shown(many) == f"1 to {len(wanted)} of {len(wanted)}"
    search(many, "nothing has this")
    assert many.all(FIRST) == []
    assert shown(many) == "no case fits"
    search(many, "")
    many.choose("#residual-cases select:nth-of-type(2)", "hang")
    assert set(many.column("outcome")) == {"hang"}


def test_details_have_the_command_that_runs_it_again(many):
    number = many.column("number")[0].split()[1]
    assert many.all(".details") == []
    many.click(f"{FIRST} button")
    assert many.text("#residual-cases .details code") == f"lk-emu campaign every_fault.toml --case {number}"
    assert many.run("return document.activeElement.ariaExpanded") == "true"  # the keyboard stays where it is
    many.click(f"{FIRST} button")
    assert many.all(".details") == []


def test_chinese_and_back(many):
    sort_by(many, "margin")
    search(many, "jam")
    numbers = many.column("number")
    many.click("#language")
    assert many.run("return document.documentElement.lang") == "zh-CN"
    assert many.text("#matrix h2") == "故障与结果"
    assert many.column("fault")[0] == "卡死 jam"
    assert many.column("number") == numbers  # what was chosen stays
    english = [text for text in many.texts("h2, h3, th button, label, nav a, dt") if not re.search(r"[\u4e00-\u9fff]|^lk-emu", text)]
    assert english == []
    many.click("#language")
    assert many.text("#matrix h2") == "Outcomes"
    assert many.column("number") == numbers


def test_the_theme_is_that_of_the_system_until_it_is_chosen(browser, pages):
    ground = "return getComputedStyle(document.body).backgroundColor"
    browser.prefer("light")
    browser.show(pages / "few.html")
    bright = browser.run(ground)
    browser.prefer("dark")
    browser.drawn()
    assert browser.run(ground) != bright
    browser.click("#theme")
    assert browser.run(ground) == bright
    # A browser writes its storage down in its own time, and a page is loaded by another process.
    WebDriverWait(browser.driver, 20).until(lambda driver: driver.refresh() or browser.run(ground) == bright)


def test_holes_are_told_to_those_who_do_not_see_them(many, answer):
    space = answer["space"]
    assert len(many.all("#space-table .hole .sr")) == space["holes"] > 0
    many.click("#only-holes")
    assert len(many.all("#space-table .hole .sr")) == space["holes"]


def test_an_interval_is_shown_where_there_is_one(browser, pages, answer):
    browser.show(pages / "few.html")
    assert "No claim" in browser.text("#coverage")
    assert "95 % interval" not in browser.texts("#coverage-table th")
    browser.show(pages / "many.html")
    lower, upper = answer["all"]["coverage"]["interval"]
    assert f"{lower:.4f} – {upper:.4f}" in browser.text("#coverage-table .all")


def test_since_last_time(many, answer):
    comparison = answer["comparison"]
    assert f"{comparison['worse']} cases worse" in many.text("#overview")
    assert [int(text.split()[1]) for text in many.column("number", "#worse-cases")] == [one["case"][0] for one in comparison["cases"]]
    assert set(many.column("outcome", "#worse-cases")) == {"silently wrong"}


def test_all_of_it_is_reached_by_keys(many):
    """What can be pressed is a button, a link or a field; what scrolls takes the focus."""
    assert many.run("return [...document.querySelectorAll('[onclick], [tabindex]')].filter((n) => n.tabIndex < 0 && n.id !== 'main').length") == 0
    assert many.run("return [...document.querySelectorAll('.broad')].every((n) => n.tabIndex === 0 && n.ariaLabel)")
    assert many.run("return [...document.querySelectorAll('input, select')].every((n) => n.ariaLabel || n.closest('label'))")


@pytest.mark.parametrize("size", [(1200, 900), (390, 844)])
def test_it_is_never_broader_than_the_window(many, size):
    many.resize(*size)
    assert many.run("return document.documentElement.scrollWidth") == size[0]
    assert many.run("return document.querySelector('#main').scrollWidth") <= size[0]
    # The header stays, and the sections scroll below it.
    assert many.run("return document.documentElement.scrollHeight") == size[1]
    many.resize(1200, 900)


def test_every_word_is_used_and_the_other_way_round():
    """Words that are put together from pieces are those of outcomes, states and who detects."""
    import pathlib
    page = pathlib.Path(__file__).resolve().parents[4] / "tools/campaign/report/page"
    words = (page / "words.js").read_text()
    keys = set(re.findall(r"^  (\w+): \[", words, re.MULTILINE))
    rest = "".join(path.read_text() for path in page.iterdir() if path.name != "words.js") + words.split("const kKeptLanguage")[1]
    used = set(re.findall(r"\bt\('(\w+)'", rest)) | set(re.findall(r'data-t(?:-label)?="(\w+)"', rest))
    assert used - keys == set()
    others = set(re.findall(r"'(\w+)'", rest)) | {"who_first", "who_drive", "who_host", "stopped", "running", "off", "unknown"}
    outcomes = {"not_fired", "no_effect", "tolerated", "detected_by_drive", "detected_by_host"}
    assert keys - used - others - outcomes == set()
