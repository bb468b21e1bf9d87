"""The page in Chinese. Untranslated texts appear in English, and are listed here."""

import pathlib
import re

import pytest
from bench import Bench
from conftest import PROGRAM
from dashboard import Page

ROOT = pathlib.Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def chinese(bench, browser):
    page = Page(browser, bench.http, query="?lang=zh")
    yield page
    page.close()


def words(page, module, name):
    return page.driver.execute_async_script(
        f"const done = arguments[0]; import('/{module}').then((m) => done(m.{name}))")


def api(page, path):
    return page.run(f"return fetch('/api/v1{path}').then((answer) => answer.json())")


def test_both_dictionaries_have_equal_placeholders(page):
    english = words(page, "words_en.js", "kEnglish")
    chinese = words(page, "words_zh.js", "kChinese")
    assert set(chinese) <= set(english)
    print("not in Chinese:", *(set(english) - set(chinese)))
    for key, text in chinese.items():
        assert sorted(re.findall(r"\{\w+\}", text)) == sorted(re.findall(r"\{\w+\}", english[key])), key
        assert text.strip(), key


def test_dictionary_has_exactly_the_used_keys(page):
    english = words(page, "words_en.js", "kEnglish")
    sources = "".join(path.read_text() for path in (ROOT / "web").glob("*.js") if not path.name.startswith("words"))
    html = (ROOT / "web/index.html").read_text()
    used = set(re.findall(r"\bt\('(\w+)'", sources)) | set(re.findall(r'data-t(?:-label)?="(\w+)"', html))
    assert used - set(english) == set()
    # Keys may also be composed (`set_${name}`), stored in tables, or names of the program.
    beginnings = tuple(re.findall(r"\bt\(`(\w+_)\$\{", sources))
    others = set(re.findall(r"'(\w+)'", sources)) | {"stopped"}
    assert {key for key in english if not key.startswith(beginnings)} - used - others == set()


def test_translated_names_exist_in_the_program(page):
    names = words(page, "words_zh_names.js", "kChineseNames")
    kinds = api(page, "/faults/kinds")
    assert all(kind["about_zh"] for kind in kinds)
    program = {"fault_groups": {kind["group"] for kind in kinds},
               "signals": {signal["name"] for signal in api(page, "/signals")}}
    faults = words(page, "words_zh_faults.js", "kChineseFaults")
    assert set(faults["fault_names"]) == {kind["kind"] for kind in kinds}
    parameters = {one["name"] for kind in kinds for one in kind["parameters"]}
    assert set(faults["parameters"]) == parameters | {"probability", "for_s", "every_s", "times"}
    choices = {word for kind in kinds for one in kind["parameters"] for word in one.get("choices", [])}
    assert choices <= set(names["choices"])
    for group, known in program.items():
        assert set(names[group]) <= known
        print("not in Chinese:", *(known - set(names[group])))


def test_page_is_chinese(chinese, bench):
    english = words(chinese, "words_en.js", "kEnglish")
    behind = [english[key] for key in set(english) - set(words(chinese, "words_zh.js", "kChinese"))]
    assert chinese.run("return document.documentElement.lang") == "zh-CN"
    english_left = re.compile(r"\b(the|of|and|drive|scope|speed|Pause|Stop|Set)\b")
    for view in ("bus", "scope", "traffic", "bench"):
        chinese.go(view)
        chinese.until(lambda view=view: chinese.text(f"#view-{view}"))
        text = chinese.one(f"#view-{view}").text
        for names in chinese.all(f"#view-{view} select"):  # names of files and faults, as in ctl
            text = text.replace(names.text, "")
        for text_of_word in behind:
            text = text.replace(text_of_word, "")
        assert not english_left.search(text), english_left.search(text)
    chinese.choose("#fault-kind", "jam")
    assert "输出轴被夹住" in chinese.text(".about")
    assert "卡死 jam" in chinese.text("#fault-kind"), "what a scenario calls it stays to be read"
    assert "百分比" in chinese.text("#fault-parameters")
    chinese.for_drives_in("都不选", "驱动器 3")
    chinese.click("#view-bench", "注入")
    chinese.until(lambda: "卡死" in chinese.text('#evidence [data-fault="jam"]'))
    assert not re.search("[a-z]{3}", chinese.text('#evidence [data-fault="jam"]'))
    chinese.go("bus")
    chinese.until(lambda: chinese.text('[data-drive$="/3"] .faults') == "注入的故障：卡死")
    chinese.go("bench")
    chinese.click("#view-bench", "全部清除")
    chinese.go("traffic")

    def frame_is_seen():
        bench.ask(4, 0x9C)  # repeated: no event reports that the stream is open
        return "读取状态 2" in chinese.text("#view-traffic tbody")

    chinese.until(frame_is_seen)
    bench.position(4, -45, 500)
    chinese.until(lambda: "角度 -45°，最大速度 500 °/s" in chinese.text("#view-traffic tbody"))
    assert not re.search(r"\b[a-z]+_[A-Za-z]+\b", chinese.text("#view-traffic tbody")), "no keys of the program"
    chinese.fill("#view-traffic input[type=search]", "最大速度")
    chinese.until(lambda: set(chinese.run("return [...document.querySelectorAll('#view-traffic tbody tr')].map((row) => row.cells[4].textContent)")) == {"A4"})
    chinese.fill("#view-traffic input[type=search]", "")


def test_switch_changes_the_language_and_back(chinese):
    chinese.go("bench")
    chinese.one("#language").click()
    chinese.until(lambda: chinese.run("return document.documentElement.lang") == "en")
    chinese.until(lambda: "Inject a fault" in chinese.text("#view-bench"))
    assert chinese.run("return location.hash").split("?")[0] == "#bench"
    chinese.one("#language").click()
    chinese.until(lambda: chinese.run("return document.documentElement.lang") == "zh-CN")


def test_program_option_sets_the_language(browser):
    """For a browser that requests English, until the user chooses."""
    bench = Bench(PROGRAM, ["1"], "--lang", "zh")
    page = Page(browser, bench.http)
    try:
        language = lambda: page.run("return document.documentElement.lang")
        assert language() == "zh-CN"
        page.one("#language").click()
        page.until(lambda: language() == "en")
        page.driver.refresh()
        page.until(lambda: page.all(".card"))
        assert language() == "en", "as chosen"
    finally:
        page.close()
        bench.close()
