"""The page as a whole: its connections, keyboard, screen sizes, advice."""

import socket

import pytest
from bench import Bench
from conftest import PROGRAM
from dashboard import Page
from selenium.webdriver.common.keys import Keys

ADVICE = """
  const plainFetch = window.fetch;
  window.fetch = (address, ...rest) => String(address).endsWith('/advice')
    ? Promise.resolve(new Response(JSON.stringify([{kind: 'wrong-length', drive: 2, bus: 'BUS', count: 3, first_s: 1.5,
        frame: '142#9A', what: 'a frame of 1 byte', todo: 'send <b>8</b> bytes', what_zh: '', todo_zh: ''}])))
    : plainFetch(address, ...rest);
  const plainParse = JSON.parse;
  JSON.parse = (text) => {
    const said = plainParse(text);
    for (const frame of said?.frames ?? []) if (frame.command === '9D') frame.advice = 'wrong-length';
    return said;
  };"""


@pytest.fixture(scope="module")
def advised(bench, browser):
    page = Page(browser, bench.http, before=ADVICE.replace("BUS", bench.bus))
    yield page
    page.close()


def test_advice_is_shown_and_rows_are_marked(advised, bench):
    advised.until(lambda: advised.one("#advice").is_displayed())
    assert "1" in advised.text("#advice summary")
    advised.one("#advice summary").click()
    text = advised.one("[data-advice]").text
    assert "Drive 2" in text and "a frame of 1 byte" in text and "3 times" in text
    assert "send <b>8</b> bytes" in text, "words are words, not elements"
    advised.go("traffic")
    advised.until(lambda: "frames" in advised.text("#traffic-info"))
    bench.ask(2, 0x9D)
    bench.ask(2, 0x9A)
    advised.until(lambda: len(advised.all("#view-traffic tr.advised")) == 2)  # a query and its reply
    advised.until(lambda: len(advised.all("#view-traffic tbody tr")) >= 4)
    box = advised.one("#view-traffic input[type=checkbox]")
    box.click()
    advised.until(lambda: len(advised.all("#view-traffic tbody tr")) == 2)


def test_policy_blocks_other_hosts(page):
    """The policy of the page blocks connections elsewhere, whatever a script does."""
    with socket.create_server(("127.0.0.1", 0)) as elsewhere:
        elsewhere.settimeout(0.5)
        port = elsewhere.getsockname()[1]
        outcome = page.driver.execute_async_script("""
          const [port, done] = arguments;
          const seen = [];
          document.addEventListener('securitypolicyviolation', (event) => {
            if (seen.push(event.effectiveDirective) === 2) done(seen);
          });
          const image = new Image();
          image.src = `http://127.0.0.1:${port}/x.png`;
          fetch(`http://127.0.0.1:${port}/`).then(() => done(['came through']), () => {});""", port)
        assert sorted(outcome) == ["connect-src", "img-src"]
        with pytest.raises(TimeoutError):
            elsewhere.accept()
    page.complaints()  # discards the errors of this attempt


def test_keys_control_the_scope(page, bench):
    page.go(f"scope?drive={bench.bus}/1")
    page.until(lambda: page.scope("s.traces.length > 0 && s.captures[0].samples.length > 100"))
    plots = page.one(".plots")
    plots.send_keys(" ")
    page.until(lambda: page.button(".scope-controls", "Resume"))
    before = page.scope("s.view")
    plots.send_keys("+")
    zoomed = page.scope("s.view")
    assert zoomed["to_s"] - zoomed["from_s"] == pytest.approx((before["to_s"] - before["from_s"]) / 2)
    plots.send_keys("ab")
    cursors = page.scope("s.cursors")
    assert zoomed["from_s"] < cursors["A"] < cursors["B"] < zoomed["to_s"]
    plots.send_keys(Keys.ESCAPE)
    assert page.scope("s.cursors") == {"A": None, "B": None}
    plots.send_keys(Keys.ARROW_LEFT)
    assert page.scope("s.view")["from_s"] < zoomed["from_s"]
    plots.send_keys(" ")
    page.until(lambda: page.button(".scope-controls", "Pause"))


def test_tab_reaches_every_control(page):
    """Tab visits all controls in the order of the page, with a visible focus."""
    page.go("bus")
    page.run("document.activeElement.blur(); window.scrollTo(0, 0)")
    reached = []
    for _ in range(30):
        page.driver.switch_to.active_element.send_keys(Keys.TAB)
        reached.append(page.run("const a = document.activeElement;"
                                "return [a.textContent.trim(), getComputedStyle(a).outlineStyle]"))
    names = [name for name, _ in reached]
    for name in ("Bus", "Scope", "Traffic", "Bench", "◐", "scope", "bench", "traffic"):
        assert name in names
    assert names.index("Bus") < names.index("◐") < names.index("scope")
    assert all(outline != "none" for name, outline in reached if name in ("Bus", "◐", "scope"))


def test_skip_link_leads_to_the_content_of_the_view(page):
    page.go("bench")
    page.run("document.querySelector('.skip').focus()")
    page.driver.switch_to.active_element.send_keys(Keys.ENTER)
    assert page.run("return document.activeElement.id") == "main"
    assert page.run("return location.hash").split("?")[0] == "#bench"
    assert page.one("#view-bench").is_displayed()


def test_unknown_view_in_the_address_shows_the_bus(page):
    page.go("bench")
    page.run("location.hash = '#constructor'")
    page.until(lambda: page.one("#view-bus").is_displayed())
    assert page.complaints() == []


@pytest.mark.parametrize("size", [(1024, 768), (800, 1280), (1440, 900)])
def test_page_fits_on_the_screen(page, size):
    page.resize(size)
    try:
        for view in ("bus", "scope", "traffic", "bench"):
            page.go(view)
            page.drawn()
            wide, high = page.run("return [document.documentElement.scrollWidth, document.documentElement.scrollHeight]")
            assert (wide, high) <= size, view
            cut = page.run("""return [...document.querySelectorAll(`#view-${arguments[0]} button, #view-${arguments[0]} input`)]
              .filter((node) => node.offsetParent && node.getBoundingClientRect().right > innerWidth + 1 && !node.closest('.frames, .scroll'))
              .map((node) => node.outerHTML.slice(0, 80))""", view)
            assert cut == [], view
    finally:
        page.resize((1440, 900))


TOKEN = "a-token-of-this-test"


def test_wrong_token_is_reported_and_asked_for_again(browser, tmp_path):
    file = tmp_path / "token"
    file.write_text(TOKEN)
    file.chmod(0o600)
    bench = Bench(PROGRAM, ["1"], "--http-token", str(file))
    page = Page(browser, bench.http, before=f"sessionStorage.setItem('lk-emu-token', new URLSearchParams(location.search).get('token') ?? '{TOKEN}')")
    try:
        asks = lambda: page.run("return [document.querySelector('dialog').open, !document.querySelector('dialog .wrong').hidden]")
        for kept, shown in (("", [True, False]), ("wrong", [True, True])):
            page.driver.get(f"{page.address}?token={kept}")
            page.until(lambda: asks() == shown)
        for token, shown in (("wrong-again", [True, True]), (TOKEN, [False, True])):
            page.fill("dialog input", token)
            page.click("dialog", "Enter")
            page.until(lambda: asks() == shown)
            assert page.one("dialog input").get_attribute("value") in ("", TOKEN)
        page.until(lambda: page.all(".card"))
    finally:
        page.close()
        bench.close()


# Simulates a changing program: `news` sets its pid for later polls, and how many requests of /drives fail.
UNSTEADY = """
  const plainFetch = window.fetch;
  window.news = [];
  window.missing = 2;
  window.fetch = async (address, ...rest) => {
    const path = String(address);
    if (path.endsWith('/drives') && window.missing > 0) {
      --window.missing;
      throw new TypeError('no answer');
    }
    const answer = await plainFetch(address, ...rest);
    if (!path.endsWith('/status')) return answer;
    const status = await answer.json();
    Object.assign(window, window.news.shift());
    return new Response(JSON.stringify({...status, pid: window.pid ?? status.pid}));
  };"""


@pytest.fixture(scope="module")
def unsteady(bench, browser):
    page = Page(browser, bench.http, before=UNSTEADY)
    page.run("""window.rebuilt = 0;
      new MutationObserver(() => ++window.rebuilt).observe(document.querySelector('#view-bench'), {childList: true});""")
    yield page
    page.close()


def test_missing_first_answer_is_requested_again(unsteady):
    """Otherwise there would be no cards, for which Page waits."""
    assert unsteady.run("return window.missing") == 0
    assert len(unsteady.all(".card")) == 4


def test_missing_answer_of_a_new_program_is_requested_again(unsteady):
    unsteady.run("window.rebuilt = 0; window.news.push({pid: -1, missing: 1})")
    unsteady.until(lambda: unsteady.run("return window.rebuilt") == 1)
    assert unsteady.run("return window.missing") == 0
    unsteady.until(lambda: not unsteady.one("#lost").is_displayed())


def test_panels_of_ended_programs_are_freed(unsteady):
    def nodes():
        return unsteady.heap_bytes()["Nodes"]

    def follow(pids):
        unsteady.run("window.rebuilt = 0; window.news.push(...arguments[0])", [{"pid": pid} for pid in pids])
        unsteady.until(lambda: unsteady.run("return window.rebuilt") == len(pids))

    unsteady.go("bench")
    bench = unsteady.run("return document.querySelectorAll('#view-bench *').length")
    follow([-2, -3])
    before = nodes()
    follow(range(-11, -3))
    # Each leaked bench has nodes, including text nodes. The last benches are freed by timers.
    unsteady.until(lambda: nodes() - before < bench)
