"""The address of the page keeps the state of each view, so that a reload or a saved link shows it again."""

import pytest


@pytest.fixture
def fresh(page):
    page.open()
    yield page
    page.open()


def reload(page):
    page.run("location.reload()")
    page.until(lambda: page.run("return document.readyState === 'complete' && document.querySelectorAll('.card').length") == 4)


def pressed(page, group):
    return page.run("return [...document.querySelectorAll(`${arguments[0]} button[aria-pressed=true]`)].map((one) => one.textContent)", group)


def test_reload_keeps_drives_signals_rate_and_width_of_the_scope(fresh, bench):
    fresh.go(f"scope?drive={bench.bus}/4")
    fresh.until(lambda: fresh.run("return location.hash") == f"#scope?drive={bench.bus}/4")
    fresh.click("#view-scope", "drive 2")
    fresh.click("#view-scope", "temperatures")
    fresh.choose('[aria-label="samples per second"]', "500")
    fresh.choose('[aria-label="seconds in view"]', "30")
    fresh.click("#view-scope", "FFT")
    before = fresh.scope("s.layout")
    fresh.until(lambda: "width_s=30" in fresh.run("return location.hash"))
    reload(fresh)
    fresh.until(lambda: fresh.scope("s.layout ?? null") == before)
    assert before["drives"] == [f"{bench.bus}/4", f"{bench.bus}/2"] and before["width_s"] == 30 and before["spectra"]


def test_address_of_a_paused_scope_returns_to_its_window(fresh, bench):
    fresh.go("scope")
    fresh.until(lambda: fresh.scope("s.captures[0].samples.length > 200"))
    fresh.click("#view-scope", "Pause")
    held = fresh.scope("s.view")
    fresh.until(lambda: "from_s=" in fresh.run("return location.hash"))
    address = fresh.run("return location.hash")
    fresh.click("#view-scope", "Resume")
    fresh.until(lambda: "from_s=" not in fresh.run("return location.hash"))
    fresh.go("bus")
    fresh.go(address[1:])
    fresh.until(lambda: fresh.scope("s.held"))
    again = fresh.scope("s.view")
    assert [again["from_s"], again["to_s"]] == pytest.approx([held["from_s"], held["to_s"]], abs=1e-5)


def test_reload_keeps_the_filter_of_the_traffic(fresh, bench):
    fresh.go("traffic")
    fresh.click("#view-traffic", "3")
    fresh.fill("#view-traffic input[type=text]", "9C, A4")
    fresh.fill("#view-traffic input[type=search]", "angle & more")
    fresh.one("#view-traffic input[type=checkbox]").click()
    fresh.choose("#view-traffic select", "drive")
    fresh.until(lambda: "from=drive" in fresh.run("return location.hash"))
    reload(fresh)
    fresh.until(lambda: pressed(fresh, "#view-traffic .picks") == ["3"])
    values = fresh.run("return [...document.querySelectorAll('#view-traffic :is(input, select)')].map((one) => one.type === 'checkbox' ? one.checked : one.value)")
    assert values == ["drive", "9C, A4", "angle & more", True]


def test_reload_keeps_the_drives_of_the_bench(fresh):
    fresh.go("bench")
    fresh.for_drives(2, 4)
    fresh.until(lambda: "drive=" in fresh.run("return location.hash"))
    reload(fresh)
    fresh.until(lambda: pressed(fresh, "#view-bench .picks") == ["2", "4"])


def test_back_returns_to_the_previous_view_with_its_state(fresh, bench):
    fresh.go("bench")
    fresh.for_drives(3)
    fresh.until(lambda: fresh.run("return location.hash") == f"#bench?drive={bench.bus}/3")
    fresh.go("traffic")
    fresh.driver.back()
    fresh.until(lambda: fresh.one("#view-bench").is_displayed())
    assert pressed(fresh, "#view-bench .picks") == ["3"]


@pytest.mark.parametrize("query", ["rate_Hz=x", "rate_Hz=1e9", "ranges=7", "width_s=-1", "trigger={}x", "signals=nonsense"])
def test_invalid_address_of_the_scope_is_reported(fresh, query):
    fresh.go(f"scope?{query}")
    fresh.until(lambda: fresh.all(".note"))
    fresh.until(lambda: query not in fresh.run("return location.hash"))
    assert fresh.complaints() == []
