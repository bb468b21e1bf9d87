"""Tests the read-only page, without --http-write, with the maximum number of drives on a bus."""

import pytest
from bench import Bench
from conftest import PROGRAM
from dashboard import Page
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys


@pytest.fixture(scope="module")
def bench():
    bench = Bench(PROGRAM, ["1-32"])
    yield bench
    bench.close()


@pytest.fixture(scope="module")
def page(bench, browser):
    page = Page(browser, bench.http)
    yield page
    page.close()


def test_controls_are_disabled_and_show_why(page):
    page.go("bench")
    assert "--http-write" in page.text("#bench-hint")
    page.until(lambda: page.text("#access") == "read-only")
    assert not page.button("#view-bench", "Power off").is_enabled()
    assert not page.button("#view-bench", "Inject").is_enabled()


def test_locked_shaft_shows_one_note(page):
    page.go("bench")
    dial = page.one("#view-bench .dial")
    page.until(lambda: dial.get_attribute("aria-disabled") == "true")
    page.run("arguments[0].scrollIntoView({block: 'center'})", dial)
    hand = ActionChains(page.driver, duration=50).move_to_element_with_offset(dial, 0, -40).click_and_hold()
    for _ in range(4):
        hand.move_by_offset(10, 5)
    hand.release().perform()
    dial.send_keys(Keys.ARROW_LEFT, Keys.ARROW_LEFT)
    page.until(lambda: [note.text for note in page.all(".note")] == ["this page is read-only"])


def test_program_refuses_changes_by_the_page(page, bench):
    status = page.run("""return fetch('/api/v1/directives', {method: 'POST',
      headers: {'Content-Type': 'application/json'}, body: '{"power": "off"}'}).then((answer) => answer.status)""")
    assert status == 403
    assert bench.read(1, 0x9A)


def test_32_drives_fit_on_one_screen(page):
    page.go("bus")
    assert len(page.all(".card")) == 32
    page.until(lambda: page.field(1, "bus") > 20 and page.field(32, "bus") > 20)  # with numbers in them
    lowest, spilling = page.run("""
      const cards = [...document.querySelectorAll('.card')];
      const spills = (card) => [...card.querySelectorAll('dd, a, .chip, .unit')].some((node) =>
        node.getBoundingClientRect().right > card.getBoundingClientRect().right);
      return [Math.max(...cards.map((card) => card.getBoundingClientRect().bottom)), cards.filter(spills).map((card) => card.dataset.drive)]""")
    assert lowest <= 900
    assert spilling == []


def test_scope_shows_32_drives(page, bench):
    page.go(f"scope?drive={bench.bus}/1")
    page.click(".scope-controls", "all drives")
    page.until(lambda: page.scope("s.traces.length") == 32 * 4)
    page.until(lambda: page.scope("s.captures[0].samples.length > 1000"))
    # Every plot has as many points as its width needs, for all drives.
    shown = page.scope("""s.traces.map((one) => {
      const [times, values] = one.capture.samples.view(s.view.from_s, s.view.to_s, 160, [one.column]);
      return times.length === values.length && times.length > 0 && times.length <= 2 * 162;
    })""")
    assert shown == [True] * 128
    assert page.scope("s.captures[0].rate_Hz") == 1000
