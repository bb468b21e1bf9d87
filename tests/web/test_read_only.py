"""Without --http-write the page looks and does not touch."""

import os

import pytest
from dashboard import Bench, Page


@pytest.fixture(scope="module")
def bench():
    bench = Bench(os.environ.get("LKEMU", "lk-emu"), "1")
    yield bench
    bench.close()


@pytest.fixture(scope="module")
def page(bench):
    page = Page(bench.http)
    yield page
    page.close()


def test_controls_are_dead_and_say_why(page):
    page.go("bench")
    assert "--http-write" in page.text("#bench-hint")
    page.until(lambda: page.text("#access") == "only looking")
    assert not page.button("#view-bench", "Power off").is_enabled()
    assert not page.button("#view-bench", "Break it").is_enabled()


def test_the_program_refuses_whatever_the_page_does(page, bench):
    status = page.run("""return fetch('/api/v1/directives', {method: 'POST',
      headers: {'Content-Type': 'application/json'}, body: '{"power": "off"}'}).then((answer) => answer.status)""")
    assert status == 403
    assert bench.ask(1, 0x9A) is not None
