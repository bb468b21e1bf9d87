"""Samples, plots and controls of the scope, on its own pages, since the tests leave it in any state."""

import pytest
from bench import Bench
from conftest import PROGRAM
from dashboard import Page


def samples(page, script):
    """Runs a script on `Samples` with one column; `put(from, to)` adds samples every ms: 0, but 7 at 1.5 s."""
    return page.driver.execute_async_script(f"""
      const done = arguments[0];
      import('/samples.js').then(({{Samples}}) => {{
        const s = new Samples(1);
        const put = (from, to, row = (n) => [n === 1500 ? 7 : 0]) => {{ for (let n = from; n < to; ++n) s.push(n / 1000, row(n)); }};
        const most = (from_s, to_s) => Math.max(...s.view(from_s, to_s, 50, [0])[1]);
        {script}
      }});""")


@pytest.mark.parametrize("from_s", [0, 0.3])
def test_peak_after_the_first_drawing_is_drawn(scope, from_s):
    """The plot extends 0.8 s beyond the samples, as for a bus that is behind another."""
    assert samples(scope, f"put(0, 1200); const before = most(0, 2); put(1200, 2500); done([before, most({from_s}, {from_s} + 2)])") == [0, 7]


def test_missing_value_hides_no_peak(scope):
    assert samples(scope, "put(0, 2000, (n) => [n === 1500 ? 7 : n > 1500 && n < 1503 ? null : 0]); done(most(0, 2))") == 7


def test_samples_are_adopted_column_by_column(scope):
    """With more columns fewer samples fit; those in view are kept."""
    taken = samples(scope, """put(0, 2000);
      const take = (keepFrom) => {
        s.keepFrom = keepFrom;
        const other = new Samples(2);
        other.capacity = 1000;
        other.adopt(s, [-1, 0]);
        return [other.first_s, other.last_s, String(other.at(0, 1.2)), other.at(1, 1.5)];
      };
      done([take(Infinity), take(0.7)]);""")
    assert taken == [[1, 1.999, "NaN", 7], [0.7, 1.699, "NaN", 7]]


def test_each_drive_has_its_own_samples(scope, bench):
    """For any order of selection."""
    for drive, angle in ((1, 10), (2, 70)):
        bench.ask(drive, 0x88)
        bench.position(drive, angle)
    scope.until(lambda: abs(bench.angle_deg(1) - 10) < 0.5 and abs(bench.angle_deg(2) - 70) < 0.5)
    seen = scope.driver.execute_async_script("""
      const [bus, done] = arguments;
      import('/capture.js').then(({Capture}) => {
        const capture = new Capture(bus, [2, 1], ['speed_dps', 'angle_deg'], 100);
        capture.record(true);
        const look = setInterval(() => {
          if (!capture.samples.length) return;
          clearInterval(look);
          capture.close();
          done([1, 2].map((id) => capture.samples.at(capture.column(id, 'angle_deg'), capture.samples.last_s)));
        }, 20);
      });""", bench.bus)
    assert seen == pytest.approx([10, 70], abs=1)


@pytest.fixture
def first_s(scope):
    """Returns the start of the recording, which is later if it was discarded."""
    scope.until(lambda: scope.scope("s.captures[0].samples.last_s - s.captures[0].samples.first_s > 0.5"))
    return scope.scope("s.captures[0].samples.first_s")


def test_stopped_clock_keeps_the_samples(scope, first_s):
    mode = """return fetch('/api/v1/clock', {method: 'PUT', headers: {'Content-Type': 'application/json'},
      body: JSON.stringify({mode: arguments[0]})}).then((answer) => answer.status)"""
    for name in ("x0.5", "stepped"):
        assert scope.run(mode, name) == 200
        scope.until(lambda name=name: scope.text("#clock-mode") == name)
        scope.click(".scope-controls", "drive 2")
        assert scope.scope("s.captures[0].samples.first_s") == first_s
    assert scope.run(mode, "x3") == 200
    scope.until(lambda: scope.scope("s.captures[0].pace") == 3)
    assert scope.scope("s.captures[0].samples.first_s") == first_s
    assert scope.run(mode, "realtime") == 200
    scope.until(lambda: scope.scope("s.captures[0].pace") == 1)


def test_signals_can_change_while_paused(scope, first_s):
    scope.click(".scope-controls", "Pause")
    view = scope.scope("s.view")
    for times in range(2):  # away and back
        scope.click(".scope-controls", "position")
        assert scope.scope("[s.view, s.captures[0].samples.first_s]") == [view, first_s]
    scope.click(".scope-controls", "supply")
    assert scope.scope("[s.view, s.captures[0].samples.first_s]") == [view, first_s]
    now = scope.scope("s.captures[0].samples.last_s")
    last = "s.captures[0].samples.at(s.traces.find((one) => one.signal === 'true_voltage_V').column, s.captures[0].samples.last_s)"
    scope.until(lambda: scope.scope("s.captures[0].samples.last_s") > now)
    assert scope.scope(last) == pytest.approx(24, abs=0.2)
    scope.click(".scope-controls", "supply")
    scope.click(".scope-controls", "Resume")


def test_width_change_does_not_end_a_pause(scope):
    scope.click(".scope-controls", "Pause")
    before = scope.scope("s.view")
    scope.choose('[aria-label="seconds in view"]', "2")
    view = scope.scope("s.view")
    assert view["to_s"] - view["from_s"] == pytest.approx(2)
    assert view["to_s"] + view["from_s"] == pytest.approx(before["to_s"] + before["from_s"])
    scope.click(".scope-controls", "Resume")


def test_keys_work_after_a_click_on_a_button(scope):
    scope.click(".scope-controls", "Pause")
    button = scope.button(".scope-controls", "Resume")
    button.send_keys("ab")
    cursors = scope.scope("s.cursors")
    assert cursors["A"] < cursors["B"]
    scope.click(".scope-controls", "clear cursors")
    button.send_keys(" ")  # pressed once
    scope.until(lambda: scope.button(".scope-controls", "Pause"))


def rest(page):
    """Waits until the plot has moved by about a hundred pixels below the pointer."""
    before = page.scope("s.view.to_s")
    page.until(lambda: page.scope("s.view.to_s") > before + 0.4)


def click(page, element, count=1, tremor_px=0):
    """Clicks like a user: moves there first, and holds the button for a while."""
    page.mouse("Moved", element, count=0)
    page.mouse("Pressed", element, count=count)
    if not page.scope("s.held"):
        rest(page)
    if tremor_px:
        page.mouse("Moved", element, tremor_px, count=0)
    page.mouse("Released", element, tremor_px, count=count)


@pytest.mark.parametrize("tremor_px", [0, 2])
def test_click_on_a_running_scope_changes_nothing(scope, tremor_px):
    width = scope.scope("s.view.to_s - s.view.from_s")
    for _ in range(3):
        click(scope, scope.one(".u-over"), tremor_px=tremor_px)
        scope.drawn()
        assert not scope.scope("s.held")
        assert scope.scope("s.view.to_s - s.view.from_s") == pytest.approx(width)
        assert scope.scope("s.cursors") == {"A": None, "B": None}


def test_double_click_pauses_and_resumes(scope):
    """Marks the second click explicitly, since the time between clicks depends on the machine."""
    for name in ("Resume", "Pause"):
        width = scope.scope("s.view.to_s - s.view.from_s")
        for count in (1, 2):
            click(scope, scope.one(".u-over"), count)
        scope.until(lambda name=name: scope.button(".scope-controls", name))
        assert scope.scope("s.cursors") == {"A": None, "B": None}
        assert scope.scope("s.view.to_s - s.view.from_s") == pytest.approx(width)


def test_drag_selects_the_part_that_was_visible(scope):
    """Drags over a tenth of the plot while its axis moves."""
    over = scope.one(".u-over")
    width_s, width_px = scope.scope("s.view.to_s - s.view.from_s"), over.size["width"]
    part_px = width_px // 10
    scope.mouse("Moved", over, count=0)
    scope.mouse("Pressed", over)
    scope.mouse("Moved", over, part_px // 2, count=0)
    rest(scope)
    scope.mouse("Moved", over, -part_px, count=0)
    shown = [float(node.value_of_css_property("width")[:-2]) for node in scope.all(".u-select")]
    assert shown == pytest.approx([part_px] * len(shown), abs=1), "in all pictures"
    scope.mouse("Released", over, -part_px)
    assert scope.scope("s.held")
    assert scope.scope("s.view.to_s - s.view.from_s") == pytest.approx(width_s / 10, rel=0.02)
    assert scope.scope("s.cursors") == {"A": None, "B": None}
    scope.click(".scope-controls", "Resume")
    scope.choose('[aria-label="seconds in view"]', "5")


def test_clicks_on_a_paused_scope_set_cursors(scope):
    """Also right after a drag."""
    over = scope.one(".u-over")
    scope.mouse("Moved", over, count=0)
    scope.mouse("Pressed", over)
    scope.mouse("Moved", over, 300, count=0)
    scope.mouse("Released", over, 300)
    view = scope.scope("s.view")
    for shift_px in (100, -200):
        scope.mouse("Moved", over, shift_px, count=0)
        scope.mouse("Pressed", over, shift_px)
        scope.mouse("Released", over, shift_px)
    assert scope.scope("s.view") | {"marks": []} == view
    cursors = scope.scope("s.cursors")
    per_px = (view["to_s"] - view["from_s"]) / over.size["width"]
    assert (cursors["A"] - cursors["B"]) / per_px == pytest.approx(300, abs=2)
    scope.click(".scope-controls", "clear cursors")
    scope.click(".scope-controls", "Resume")
    scope.choose('[aria-label="seconds in view"]', "5")


def pressed(page):
    return [button.text for button in page.all('.scope-controls [aria-label="drives"] [aria-pressed=true]')]


def test_all_drives_button_toggles(scope):
    scope.click(".scope-controls", "drive 2")
    scope.click(".scope-controls", "drive 2")
    before = pressed(scope)
    scope.click(".scope-controls", "all drives")
    assert pressed(scope) == ["1", "2", "3", "4", "all drives"]
    scope.click(".scope-controls", "all drives")
    assert pressed(scope) == before


def test_link_of_a_card_shows_only_its_drive(scope, bench):
    scope.click(".scope-controls", "all drives")
    scope.go("bus")
    scope.one('[data-drive$="/3"] a[href^="#scope"]').click()
    scope.until(lambda: scope.one("#view-scope").is_displayed())
    assert pressed(scope) == ["3"]
    assert {label.split()[0] for label in scope.scope("s.traces.map((one) => one.label)")} == {"3"}
    scope.go(f"scope?drive={bench.bus}/1")


@pytest.mark.parametrize("values", [[48, 48 + 1e-14], [360, 360 + 1e-13], [48, 48], [0, 1e-300], [1e9, 1e9 + 1e-6], [-3, 5]])
def test_values_a_rounding_error_apart_have_an_axis(scope, values):
    ticks = scope.driver.execute_async_script("""
      const [values, done] = arguments;
      import('/panels.js').then(({range}) => {
        const holder = document.body.appendChild(document.createElement('div'));
        new uPlot({width: 300, height: 400, scales: {x: {time: false}, y: {range}}, series: [{}, {}],
                   hooks: {draw: [(u) => { done(u.axes[1]._splits.length); holder.remove(); }]}},
                  [[0, 1], values], holder);
      }).catch((error) => done(String(error)));""", values)
    assert 2 <= ticks <= 20


@pytest.mark.parametrize("drive", ["vcan7/1", "BUS/31", "BUS"])
def test_address_of_an_unknown_drive_is_reported(scope, bench, drive):
    drive = drive.replace("BUS", bench.bus)
    before = scope.scope("s.traces.map((one) => one.label)")
    scope.go(f"scope?drive={drive}&time_s=x")
    scope.until(lambda: f"there is no drive {drive}" in [note.text for note in scope.all(".note")])
    assert scope.scope("s.traces.map((one) => one.label)") == before
    address = scope.run("return location.hash") + "&"
    assert f"drive={drive}&" not in address and "time_s" not in address
    scope.until(lambda: scope.button(".scope-controls", "Pause"))
    assert scope.complaints() == []


def test_stream_that_does_not_open_is_reported(bench, browser):
    page = Page(browser, bench.http, query="#scope", before="""
      const Plain = window.WebSocket;
      window.WebSocket = function (address, ...rest) { return new Plain(address.replace('/telemetry', '/nothing'), ...rest); };""")
    try:
        page.until(lambda: f"no samples of {bench.bus}" in page.text("#scope-info"))
    finally:
        page.close()


@pytest.fixture(scope="module")
def two_buses(browser):
    bench = Bench(PROGRAM, ["1,2", "1-3"])
    page = Page(browser, bench.http, query="#scope")
    yield page
    page.close()
    bench.close()


def test_all_buses_together_respect_the_rate_limit(two_buses):
    page = two_buses
    page.until(lambda: page.scope("s.captures.length === 2 && s.captures.every((one) => one.samples.length > 10)"))
    page.click(".scope-controls", "all drives")
    page.choose('[aria-label="samples per second"]', "20000")
    columns = 5 * len(page.scope("s.captures[0].signals"))
    rates = page.scope("s.captures.map((one) => one.rate_Hz)")
    assert rates[0] == rates[1] == pytest.approx(190_000 / columns)
    page.until(lambda: page.scope("s.captures.every((one) => one.waitsFrom_ms === null)"))
    page.until(lambda: f"limited to {rates[0]:.4g} Hz" in page.text("#scope-info"))
    assert page.complaints() == []
