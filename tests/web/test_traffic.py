"""Tests the dashboard's traffic view: decoded frames, several buses, links to and from frames."""

import pytest
from bench import Bench
from conftest import PROGRAM
from dashboard import Page, settle
from selenium.webdriver.common.keys import Keys

TABLE = "#view-traffic tbody"


def test_traffic_is_decoded_and_links_to_the_scope(page, bench):
    page.go("traffic")
    settle(page, lambda: "frames" in page.text("#traffic-info"))
    page.click("#view-traffic", "Clear")
    bench.position(1, -45, 500)
    bench.ask(4, 0x9A)
    bench.ask(1, 0x7E)  # unknown to all drives
    table = "#view-traffic tbody"
    for said in ("angle -45°, max speed 500 °/s", "voltage 2", "unknown command"):
        settle(page, lambda said=said: said in page.text(table))
    assert len(page.all(f"{table} tr.unknown")) == 1
    page.click("#view-traffic", "4")
    settle(page, lambda: len(page.all(f"{table} tr")) == 2)  # a query and its reply
    page.click("#view-traffic", "all")
    page.fill("#view-traffic input[type=text]", "A4")
    settle(page, lambda: page.run("return [...document.querySelectorAll(arguments[0])].map((cell) => cell.textContent)",
                                  f"{table} td.mono:not(.dim)") == ["A4", "A4"])
    when = float(page.text(f"{table} td"))
    link = page.all(f"{table} a")[0]
    page.click("#view-traffic", "Pause")  # moves the focus out of the field
    page.run("document.querySelector('#view-traffic .frames').dispatchEvent(new Event('scroll'))")
    page.drawn()
    link.click()  # the row under the pointer was not rebuilt
    settle(page, lambda: page.one("#view-scope").is_displayed())
    view = page.scope("s.view")
    assert view["from_s"] < when < view["to_s"]
    assert any(abs(mark["time_s"] - when) < 1e-6 for mark in view["marks"])
    page.click(".scope-controls", "Resume")
    page.go("traffic")
    page.click("#view-traffic", "Resume")
    page.fill("#view-traffic input[type=text]", "")


SIZES = pytest.mark.parametrize("size", [(390, 844), (768, 1024), (1280, 800), (1920, 1080)], ids=lambda size: str(size[0]))
CUT = """
  const cells = [...document.querySelectorAll('#view-traffic tbody td')].filter((cell) => cell.clientWidth);
  const frames = [...document.querySelectorAll('#view-traffic tbody td:nth-child(8)')].map((cell) => cell.getBoundingClientRect().right);
  const wide = ['.frames', 'main', 'html'].filter((css) => document.querySelector(css).scrollWidth > document.querySelector(css).clientWidth);
  const rows = [...document.querySelectorAll('#view-traffic tbody tr')].map((row) => row.getBoundingClientRect());
  const inside = (node) => [...node.cells].every((cell) => cell.getBoundingClientRect().bottom <= node.getBoundingClientRect().bottom + 0.5);
  return {cut: cells.filter((cell) => cell.scrollWidth > cell.clientWidth || getComputedStyle(cell).textOverflow === 'ellipsis').map((cell) => cell.textContent),
    right: Math.max(...frames), rows: frames.length, wide, heights: [...new Set(rows.map(({height}) => Math.round(height)))],
    overlaps: [...document.querySelectorAll('#view-traffic tbody tr')].filter((row) => !inside(row)).length};"""


@SIZES
def test_frames_are_shown_without_truncation(page, bench, size):
    page.go("traffic")
    page.resize(size)
    try:
        page.click("#view-traffic", "Clear")

        def all_are_seen():
            bench.position(1, -45.5, 500)  # the longest name of a frequent frame
            bench.ask(1, 0x30)  # the longest reply
            return len(page.all(f"{TABLE} tr")) >= 4

        settle(page, all_are_seen)
        page.click("#view-traffic", "Pause")
        page.drawn()
        found = page.run(CUT)
        assert found["rows"] >= 4 and found["cut"] == [] and found["wide"] == [] and found["overlaps"] == 0
        assert len(found["heights"]) == 1, "rows are as high as the scroll position assumes"
        assert found["right"] <= size[0], "the frame itself is on the screen"
        page.click("#view-traffic", "Resume")
    finally:
        page.resize((1440, 900))


def test_columns_are_as_wide_as_their_contents(page, bench):
    """They do not become narrower when the widest row goes."""
    page.go("traffic")
    page.resize((1920, 1080))
    try:
        page.click("#view-traffic", "Clear")
        settle(page, lambda: bench.position(1, -45.5, 500) and "A4" in page.text(TABLE))
        page.drawn()
        free = """return [...document.querySelectorAll('#view-traffic tbody tr')[0].cells].map((cell) => {
          const range = document.createRange();
          range.selectNodeContents(cell);
          return cell.offsetWidth && cell.offsetWidth - range.getBoundingClientRect().width;
        });"""
        time_, _, _, _, _, name, values, frame, scope = page.run(free)
        assert max(time_, name, frame, scope) < 40
        assert values > 100, "the values have the rest"
        widths = "return [...document.querySelectorAll('.frames th')].map((head) => head.offsetWidth)"
        before = page.run(widths)
        page.click("#view-traffic", "Clear")
        settle(page, lambda: bench.ask(2, 0x9C) and "9C" in page.text(TABLE))
        assert all(now >= then for now, then in zip(page.run(widths)[:6], before))
    finally:
        page.resize((1440, 900))


# --- RS-485


@pytest.fixture(scope="module")
def serial(browser, tmp_path_factory):
    bench = Bench(PROGRAM, ["1,2"], "--http-write", buses=[f"rs485:{tmp_path_factory.mktemp('bus')}/arm"])
    page = Page(browser, bench.http, query="#traffic")
    yield page
    page.close()
    bench.close()


JOG = """return fetch('/api/v1/frames', {method: 'POST', headers: {'Content-Type': 'application/json'},
  body: JSON.stringify({bus: arguments[0], id: 1, command: 'position_2', angle_deg: 20, max_speed_dps: 300})}).then((answer) => answer.status)"""


@SIZES
def test_frames_of_rs485_are_complete(serial, size):
    """The frame has 5 bytes of header, 12 bytes of data, and their sum."""
    bus = serial.run("return fetch('/api/v1/drives').then((answer) => answer.json())")[0]["bus"]
    serial.resize(size)

    def frames_are_seen():
        assert serial.run(JOG, bus) == 200
        serial.drawn()
        return {"rs485#3EA4010CEFD007000000000000307500007C"} < set(cells(serial, 8))

    settle(serial, frames_are_seen)
    found = serial.run(CUT)
    assert found["cut"] == [] and found["wide"] == [] and found["overlaps"] == 0
    assert found["right"] <= size[0]


def test_frames_from_the_page_need_no_host(browser, tmp_path, capfd):
    """No host has opened the terminal, so its settings mean nothing."""
    bench = Bench(PROGRAM, ["1"], "--http-write", buses=[f"rs485:{tmp_path}/arm"])
    page = Page(browser, bench.http)
    try:
        assert page.run(JOG, bench.bus) == 200
        settle(page, lambda: abs(page.reported(1)["signals"]["angle_deg"] - 20) < 1)
    finally:
        page.close()
        bench.close()
    logged = capfd.readouterr().err
    assert "the host is at" not in logged and "tty-not-raw" not in logged


# --- two buses with the same IDs


@pytest.fixture(scope="module")
def two():
    bench = Bench(PROGRAM, ["1,2", "1,2"])
    yield bench
    bench.close()


@pytest.fixture(scope="module")
def both(two, browser):
    page = Page(browser, two.http)
    yield page
    page.close()


def cells(page, column):
    return page.run("return [...document.querySelectorAll(arguments[0])].map((cell) => cell.textContent)",
                    f"{TABLE} td:nth-child({column})")


def paused(page):
    return page.run("return !!document.querySelector('#view-traffic .main[aria-pressed=true]')")


def to_the_frame(page, drive):
    page.go("bus")
    if not page.one("#advice").get_attribute("open"):
        page.one("#advice summary").click()

    def link():
        return next(a for item in page.all("[data-advice=wrong-length]") if f"Drive {drive}" in item.text
                    for a in item.find_elements("css selector", "a"))

    settle(page, lambda: any(f"Drive {drive}" in item.text for item in page.all("[data-advice=wrong-length]")))
    page.run("arguments[0].click()", link())
    settle(page, lambda: page.one("#view-traffic").is_displayed())


def test_missing_frame_is_not_replaced_by_another(both, two):
    two.send(0x141, b"\x9a")  # 1 byte instead of 8, before the traffic view was opened
    to_the_frame(both, f"{two.bus} 1")
    settle(both, lambda: "is not here" in " ".join(note.text for note in both.all(".note")))
    assert not paused(both)


def test_advice_links_to_its_frame_on_its_bus(both, two):
    second = two.buses[1]
    both.go(f"traffic?drive={two.bus}/1")
    both.click("#view-traffic", "all")

    def frame_is_seen():
        two.ask(1, 0x9C, bus=1)  # repeated: no event reports that the stream is open
        return second in cells(both, 3)

    settle(both, frame_is_seen)
    two.send(0x142, b"\x9a\0", bus=1)
    settle(both, lambda: "142#9A00" in cells(both, 8))
    two.move(1, 2)  # many later frames
    settle(both, lambda: int(both.text("#traffic-info").split(" of ")[1].split()[0]) > 200)
    two.move()
    to_the_frame(both, f"{second} 2")
    assert paused(both)
    both.drawn()
    top = both.run("""
      const under = document.querySelector('.frames thead').getBoundingClientRect().bottom;
      return [...document.querySelectorAll('.frames tbody tr')].find((row) => row.getBoundingClientRect().bottom > under + 2)
        .cells[7].textContent;""")
    assert top == "142#9A00"
    assert set(cells(both, 3)) == {second}, "its drive's frames, and not those of drive 2 on the other bus"
    both.click("#view-traffic", "Resume")
    both.click("#view-traffic", "all")


def test_drives_of_two_buses_are_distinguished(both, two):
    both.go("traffic")
    both.click("#view-traffic", "Clear")
    for bus in (0, 1):
        for drive in (1, 2):
            two.ask(drive, 0x9A, bus=bus)
    settle(both, lambda: len(cells(both, 3)) == 8)
    button = both.button("#view-traffic", f"drive {two.buses[1]} 1")
    button.send_keys(Keys.SPACE)
    settle(both, lambda: cells(both, 3) == [two.buses[1]] * 2)
    assert [way[-1] for way in cells(both, 4)] == ["1", "1"]
    assert both.driver.switch_to.active_element == button, "who has pressed a button is still at it"
    assert button.get_attribute("aria-pressed") == "true"
    button.send_keys(Keys.SPACE)
    settle(both, lambda: len(cells(both, 3)) == 8)


def told(page, bench, script):
    """Runs a script with the module that keeps frames, then removes its frames."""
    return page.driver.execute_async_script("""
      const [[first, second], done] = arguments;
      import('/traffic_frames.js').then((m) => {
        const frame = (time_s) => ({time_s, from: 'host', id: 1, frame: '141#9A', command: '9A', name: 'read state 1', values: ''});
        m.forget();""" + script + "});", bench.buses)


def test_frames_of_two_buses_are_sorted_by_time(both, two):
    seen = told(both, two, """
        m.keep(first, [frame(-5), frame(-1)]);
        m.keep(second, [frame(-6), frame(-3), frame(-2)]);
        m.tellLost(first, 3);
        m.tellLost(second, 4);
        m.tellLost(first, 5);
        const {shown} = m.kept;
        done([shown.map((one) => one.time_s), shown.map((one, n) => m.frameBefore(n)?.time_s ?? null), m.lostFrames()]);
        m.forget();""")
    assert seen == [[-6, -5, -3, -2, -1], [None, None, -6, -3, -5], 9]


def test_scroll_position_stays_when_old_frames_are_dropped(both, two):
    both.go("traffic")
    told(both, two, """
        m.keep(first, Array.from({length: 60000}, (_, n) => frame(n - 1e6)));
        done();""")
    rows = "return [...document.querySelectorAll('.frames tbody tr')].map((row) => row.cells[0].textContent)"
    two.ask(1, 0x9C)  # something to draw; the last 50,000 frames stay
    settle(both, lambda: "of 5000" in both.text("#traffic-info"))
    both.run("document.querySelector('.frames').scrollTop = 40000 * 24")
    settle(both, lambda: both.run(rows)[0].startswith("\u221295001"))
    read = both.run(rows)[0]
    before = both.run("return document.querySelector('.frames').scrollTop")
    both.driver.execute_async_script("""
      const [bus, done] = arguments;
      import('/traffic_frames.js').then((m) => {
        m.keep(bus, Array.from({length: 10001}, (_, n) => ({...m.kept.all[0], time_s: n / 1e5 - 100})));
        done();
      });""", two.bus)
    two.ask(1, 0x9C)
    settle(both, lambda: both.run("return document.querySelector('.frames').scrollTop") != before)
    settle(both, lambda: both.run(rows)[0] == read)
    first = both.run("return Number(document.querySelector('.frames tbody tr').ariaRowIndex)")
    assert first < 40000
    both.click("#view-traffic", "Clear")
