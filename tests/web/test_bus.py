"""The bus view: problems are visible, unknown values are hidden, and the screen is used well."""

import re

import pytest
from conftest import PROGRAM
from bench import Bench
from dashboard import Page, settle

TELL = """return fetch('/api/v1/directives', {method: 'POST', headers: {'Content-Type': 'application/json'},
    body: JSON.stringify(arguments[0])}).then((answer) => answer.status)"""


def card(page, drive):
    return f'[data-drive$="/{drive}"]'


def border(page, drive):
    return page.one(card(page, drive)).value_of_css_property("border-top-color")


def colour(page, name):
    """Returns a colour of the style sheet in the browser's computed form."""
    return page.run("""const node = document.body.appendChild(document.createElement('i'));
      node.style.color = `var(${arguments[0]})`;
      const said = getComputedStyle(node).color;
      node.remove();
      return said;""", name).replace("rgb(", "rgba(").replace(")", ", 1)")


@pytest.fixture
def healed(page):
    page.go("bus")
    yield page
    page.run(TELL, {"clear": "all"})
    for drive in (2, 3):
        page.run(TELL, {"id": drive, "power": "on"})


@pytest.mark.parametrize("fault", ["jam", "phase_open"])
def test_card_shows_injected_faults(healed, bench, fault):
    page = healed
    words = fault.replace("_", " ")
    assert page.run(TELL, {"id": 2, "fault": fault}) == 200
    settle(page, lambda: page.text(f"{card(page, 2)} .faults") == f"injected: {words}")
    assert border(page, 2) == colour(page, "--warn")
    assert page.text(f"{card(page, 1)} .faults") == ""
    assert page.run(TELL, {"clear": "all"}) == 200
    settle(page, lambda: not page.one(f"{card(page, 2)} .faults").is_displayed())
    assert border(page, 2) != colour(page, "--warn")


def test_card_shows_that_a_fault_is_armed(healed):
    page = healed
    assert page.run(TELL, {"ids": "2", "fault": {"kind": "drop", "every_s": 1000, "for_s": 0.01}}) == 200
    settle(page, lambda: page.text(f"{card(page, 2)} .faults") == "injected: drop (paused)")


def test_card_with_an_error_is_red(healed):
    page = healed
    assert page.run(TELL, {"id": 2, "fault": {"kind": "temperature_stuck", "value_C": 140}}) == 200
    settle(page, lambda: page.errors(2) == "motor temperature")
    assert border(page, 2) == colour(page, "--bad")
    assert border(page, 1) == colour(page, "--line")
    assert page.run(TELL, {"id": 2, "power": "cycle"}) == 200


def test_reply_rate_excludes_suppressed_replies(healed, bench):
    """A silent drive receives, obeys and counts its replies."""
    page = healed
    assert page.run(TELL, {"id": 3, "fault": "silent"}) == 200
    bench.move(1, 3)
    settle(page, lambda: page.field(1, "replies") > 5)
    settle(page, lambda: page.field(3, "replies") == 0)
    given = lambda: page.reported(3)["counters"]["replies"]
    before = given()
    settle(page, lambda: given() > before and page.field(1, "replies") > 5)
    assert page.field(3, "replies") == 0
    bench.move()


def test_drive_without_power_shows_no_measurements(healed):
    page = healed
    assert page.run(TELL, {"id": 2, "power": "off"}) == 200
    settle(page, lambda: page.state(2) == "no power")
    shown = lambda: page.run("return [...document.querySelectorAll(arguments[0])].map((one) => one.textContent)",
                             f"{card(page, 2)} .fields dd:not(.unit)")
    settle(page, lambda: shown()[:-1] == ["–"] * 6)


def test_silent_host_is_reported(healed, bench):
    page = healed
    bench.ask(1, 0x9A)
    settle(page, lambda: page.text("#host-silent").startswith("No frame from a host since"))
    bench.ask(1, 0x9A)
    settle(page, lambda: any(note.text.startswith("A host sends again after") for note in page.all(".note")))


def test_card_shows_the_angle_as_a_number(healed, bench):
    page = healed
    bench.ask(1, 0x88)
    bench.position(1, 450)
    settle(page, lambda: abs(bench.angle_deg(1) - 450) < 0.5)
    settle(page, lambda: abs(page.field(1, "rotor") - bench.angle_deg(1)) < 0.2)
    shaft = lambda: float(re.fullmatch("shaft (.*)°", page.text(f"{card(page, 1)} .shaft-deg"))[1].replace("\u2212", "-"))
    truth = lambda: page.reported(1)["signals"]["true_angle_deg"]
    settle(page, lambda: abs(shaft() - truth()) < 0.2)
    # At power-up the drive loses its turns; the names and the tooltip tell the two angles apart.
    assert page.run(TELL, {"id": 1, "power": "cycle", "off_s": 0.5}) == 200
    settle(page, lambda: abs(page.field(1, "rotor") - 90) < 20)
    assert abs(shaft() - 450) < 20
    assert "lost" in page.one(f"{card(page, 1)} .fields .angle").get_attribute("title")
    page.go("bench")
    page.for_drives(1)
    rows = lambda: dict(page.run("return [...document.querySelectorAll('.shaft-panel .fields div')].map((row) => [row.children[0].textContent, row.children[1].textContent])"))
    settle(page, lambda: abs(float(rows()["shaft"]) - 450) < 20 and abs(float(rows()["rotor"]) - 90) < 20)


@pytest.mark.parametrize("size", [(1920, 1080), (2560, 1440)])
def test_few_drives_use_a_wide_screen(page, size):
    page.go("bus")
    page.resize(size)
    try:
        def reach():
            page.drawn()
            return page.run("""
              const boxes = [...document.querySelectorAll('.card')].map((card) => card.getBoundingClientRect());
              return [Math.max(...boxes.map((box) => box.right)), Math.max(...boxes.map((box) => box.bottom))];""")
        settle(page, lambda: reach()[0] > 0.8 * size[0] and 0.6 * size[1] < reach()[1] <= size[1])
    finally:
        page.resize((1440, 900))


def test_long_numbers_stay_in_their_card(page):
    page.go("bus")
    spilling = page.run("""
      const number = document.querySelector('.card .fields dd');
      const before = number.textContent;
      number.firstChild.nodeValue = '\u221212345.6';
      const card = number.closest('.card').getBoundingClientRect();
      const right = Math.max(...[...number.closest('.card').querySelectorAll('.chip, dd, .unit, footer')].map((one) => one.getBoundingClientRect().right));
      number.firstChild.nodeValue = before;
      return right - (card.right - 8);""")
    assert spilling <= 0


@pytest.fixture(scope="module")
def two():
    bench = Bench(PROGRAM, ["1,2", "1-3"])
    yield bench
    bench.close()


def test_drives_are_grouped_by_bus(two, browser):
    page = Page(browser, two.http)
    groups = page.run("""return [...document.querySelectorAll('.bus-group')].map((group) =>
      [group.querySelector('h2').textContent, [...group.querySelectorAll('.card')].map((card) => card.dataset.drive)])""")
    first, second = two.buses
    assert groups == [[first, [f"{first}/1", f"{first}/2"]], [second, [f"{second}/1", f"{second}/2", f"{second}/3"]]]
    page.until(lambda: "3 drives" in page.text(f'[data-bus="{second}"] header'))


# Every number of every drive is window.extreme, every drive has all errors and replies at an absurd rate.
EXTREMES = """
  window.extreme = 0;
  const plainFetch = window.fetch;
  let replies = 0;
  window.fetch = async (address, ...rest) => {
    const answer = await plainFetch(address, ...rest);
    if (!String(address).endsWith('/drives')) return answer;
    const drives = await answer.json();
    replies += Math.abs(window.extreme);
    for (const drive of drives) {
      for (const name of Object.keys(drive.signals)) drive.signals[name] = window.extreme;
      drive.counters.sent = replies;
      if (window.extreme) drive.errors = ['under_voltage', 'motor_temperature'];
    }
    return new Response(JSON.stringify(drives));
  };
  const plainParse = JSON.parse;
  JSON.parse = (text) => {
    const message = plainParse(text);
    for (const sample of Array.isArray(message) ? message : [message]) {
      if (sample?.rows) sample.rows = sample.rows.map(([id, ...row]) => [id, ...row.map(() => window.extreme)]);
    }
    return message;
  };"""

# Returns pairs of texts of the page that overlap by more than a pixel, as far as no ancestor hides them, and texts outside the page.
OVERLAPS = """
  const texts = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const node = walker.currentNode;
    if (!node.data.trim() || !node.parentElement.checkVisibility({visibilityProperty: true}) || node.parentElement.closest('.skip, .robot')) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    for (const box of range.getClientRects()) {
      let {left, right, top, bottom} = box;
      for (let one = node.parentElement; !one.matches('main, body'); one = one.parentElement) {
        if (getComputedStyle(one).overflow === 'visible') continue;
        const around = one.getBoundingClientRect();
        [left, right, top, bottom] = [Math.max(left, around.left), Math.min(right, around.right), Math.max(top, around.top), Math.min(bottom, around.bottom)];
      }
      if (right - left > 1 && bottom - top > 1) texts.push({node, left, right, top, bottom, text: node.data});
    }
  }
  const found = texts.filter(({left, right}) => left < 0 || right > innerWidth).map(({text}) => [text, 'outside']);
  texts.sort((a, b) => a.top - b.top);
  for (let n = 0; n < texts.length; ++n) {
    for (let m = n + 1; m < texts.length && texts[m].top < texts[n].bottom - 1; ++m) {
      const [a, b] = [texts[n], texts[m]];
      const overlap = (from, to) => Math.min(a[to], b[to]) - Math.max(a[from], b[from]) > 1;
      const high = Math.min(a.bottom - a.top, b.bottom - b.top);  // line boxes of dense lines touch; glyphs do not
      if (a.node !== b.node && overlap('left', 'right') && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 0.3 * high) found.push([a.text, b.text]);
    }
  }
  return [texts.length, found];"""


@pytest.fixture(scope="module")
def crowd():
    bench = Bench(PROGRAM, ["1-32"])
    yield bench
    bench.close()


@pytest.mark.parametrize("drives", [4, 32])
@pytest.mark.parametrize("language", ["en", "zh"])
def test_no_text_overlaps_at_any_width(crowd, bench, browser, drives, language):
    page = Page(browser, {4: bench, 32: crowd}[drives].http, query=f"?lang={language}", before=EXTREMES)
    speed = lambda: page.text(".card .figures dd")
    for extreme, shown in [(-549.3, "\u2212549.3"), (-12345678.9, "\u22121.2e+7"), (1e300, "1e+300")]:
        page.run("window.extreme = arguments[0]", extreme)
        page.until(lambda: speed() == shown)
        for width in (360, 390, 500, 768, 1024, 1280, 1440, 1920, 2560):
            page.resize((width, 900))
            page.drawn()
            count, found = page.run(OVERLAPS)
            assert count > 15 * drives and found == [], (width, extreme)
    page.close()


def test_label_of_a_usual_value_is_not_cut(page):
    page.go("bus")
    for width in (360, 768, 1440, 2560):
        page.resize((width, 900))
        page.drawn()
        assert page.run("return [...document.querySelectorAll('.card dt')].filter((one) => one.scrollWidth > one.clientWidth).length") == 0, width
    page.resize((1440, 900))


# The first window.drives drives of those that run.
SOME = """
  const plainFetch = window.fetch;
  window.fetch = async (address, ...rest) => {
    const answer = await plainFetch(address, ...rest);
    return String(address).endsWith('/drives') ? new Response(JSON.stringify((await answer.json()).slice(0, DRIVES))) : answer;
  };"""


@pytest.mark.parametrize("drives", [1, 2, 4, 5, 7, 12, 23, 32])
def test_cards_fill_the_grid(crowd, browser, drives):
    """Gaps beside cards, to the next or to the edge, are at most 24 px; so are those between rows."""
    page = Page(browser, crowd.http, (1920, 1080), before=SOME.replace("DRIVES", str(drives)))
    page.drawn()
    boxes = page.run("return [...document.querySelectorAll('.card')].map((card) => card.getBoundingClientRect().toJSON())")
    rows = {}
    for box in boxes:
        rows.setdefault(round(box["top"]), []).append(box)
    gaps = []
    for row in rows.values():
        edges = [0, *(edge for box in row for edge in (box["left"], box["right"])), 1920]
        gaps += [right - left for left, right in zip(edges[::2], edges[1::2])]
    tops = sorted(rows)
    gaps += [below - rows[above][0]["bottom"] for above, below in zip(tops, tops[1:])]
    assert len(boxes) == drives and 0 < max(gaps) <= 24
    page.close()


def test_card_has_curves_of_speed_and_current(page, bench):
    """After five seconds the curve has its whole width, from 0 to 100; older values are dropped."""
    page.open()
    bench.move(1)
    points = lambda n: [tuple(map(float, point.split(","))) for point in (page.run(
        "return document.querySelectorAll('.card .spark polyline')[arguments[0]].getAttribute('points')", n) or "").split()]
    settle(page, lambda: points(0) and points(0)[0][0] < 5)
    for n in (0, 1):
        xs, ys = zip(*points(n))
        assert 0 <= xs[0] and xs[-1] == 100 and list(xs) == sorted(xs) and len(xs) > 10
        assert 0 <= min(ys) and max(ys) <= 20 and max(ys) - min(ys) == pytest.approx(20), "drive 1 moves: the curve has its whole height"
    bench.move()


def test_line_leads_to_drives_that_need_attention(healed):
    page = healed
    assert not page.one("#attention").is_displayed()
    for drive in (2, 3):
        assert page.run(TELL, {"id": drive, "power": "off"}) == 200
    settle(page, lambda: page.text("#attention") == "2 of 4 drives need attention")
    seen = []
    for _ in range(3):
        page.one("#attention").click()
        seen.append(page.run("return document.activeElement.dataset.drive.split('/').at(-1)"))
    assert seen == ["2", "3", "2"]


def test_drive_selectors_are_grouped_by_bus_with_short_names(two, browser):
    page = Page(browser, two.http)
    for view in ("scope", "traffic", "bench"):
        groups = page.run("""return [...document.querySelectorAll(`#view-${arguments[0]} .of-bus`)].map((group) => {
          const name = group.querySelector('span');
          return [name.title, name.textContent.length <= 16, [...group.querySelectorAll('button')].map((one) => [one.textContent, one.title])];
        })""", view)
        assert groups == [[bus, True, [[str(n), f"drive {bus} {n}"] for n in ids]] for bus, ids in zip(two.buses, ((1, 2), (1, 2, 3)))], view
    page.close()
