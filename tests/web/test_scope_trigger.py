"""The scope's trigger: pure functions in the page, and the program with a moving drive."""

import pytest
from selenium.webdriver.common.keys import Keys


def found(page, values, script):
    """Evaluates `at(holds, level, from_s)` on `values` at 0, 1, 2… seconds; null is a missing sample."""
    return page.driver.execute_async_script(f"""
      const [values, done] = arguments;
      Promise.all([import('/samples.js'), import('/trigger.js')]).then(([{{Samples}}, {{findChange}}]) => {{
        const samples = new Samples(1);
        values.forEach((value, n) => samples.push(n, [value]));
        const at = (holds, level = null, from_s = 0) => findChange(samples, 0, from_s, holds, level).at_s;
        done({script});
      }}).catch((error) => done(String(error)));""", values)


def test_level_crossing_is_interpolated(scope):
    """From 0 to 4 in a second: 1 after a quarter of it; back from 4 to −4: after three eighths."""
    values = [0, 0, 4, -4, 0]
    assert found(scope, values, "[at((v) => v >= 1, 1), at((v) => v <= 1, 1)]") == [1.25, 2.375]


def test_condition_true_from_the_start_is_no_change(scope):
    assert found(scope, [5, 6, 7], "at((v) => v >= 1, 1)") is None
    assert found(scope, [5, 0, 7], "at((v) => v >= 7, 7)") == 2


def test_change_before_arming_does_not_count(scope):
    assert found(scope, [0, 2, 0, 0, 2], "at((v) => v >= 2, 2, 1.5)") == 4
    assert found(scope, [0, 2, 2, 2, 2], "at((v) => v >= 2, 2, 1.5)") is None


def test_missing_value_is_skipped(scope):
    assert found(scope, [0, None, 4, 4], "at((v) => v >= 2, 2)") == 1  # half-way from 0 s to 2 s
    assert found(scope, [4, None, 4, 4], "at((v) => v >= 2, 2)") is None


def looks(page, mode, before, newest):
    """A trigger on the rising edges of 0, 1 at whole and half seconds, with a plot of 2 s. Returns the plot's start
    after each look, with samples up to `newest`; null: running."""
    return page.driver.execute_async_script("""
      const [mode, before, newest, done] = arguments;
      Promise.all([import('/samples.js'), import('/trigger.js')]).then(([{Samples}, {Trigger}]) => {
        const samples = new Samples(1);
        for (let n = 0; n < 400; ++n) samples.push(n / 100, [n % 100 < 50 ? 0 : 1]);
        const trigger = new Trigger();
        Object.assign(trigger.settings, {mode, before, level: 1});
        const capture = {samples, column: () => 0};
        done(newest.map((to_s) => {
          trigger.look(capture, 1, to_s, 2);
          const window = trigger.window(to_s, 2);
          return window && [Math.round(window.from_s * 1000) / 1000, trigger.done];
        }));
      }).catch((error) => done(String(error)));""", mode, before, newest)


def test_plot_is_shown_when_complete(scope):
    """The edge at 0.5 s with a quarter before it: from 0 s to 2 s. The next trigger is at 2.5 s."""
    assert looks(scope, "normal", 0.25, [1.9, 2.1, 3.9, 4.1]) == [None, [0, False], [0, False], [2, False]]


def test_single_mode_keeps_the_plot(scope):
    assert looks(scope, "single", 0.25, [1.9, 2.1, 4.1, 99]) == [None, [0, True], [0, True], [0, True]]


def test_automatic_mode_runs_without_triggers(scope):
    """The last edge is at 3.5 s. The plot runs again 4 s after the end of its window, twice its width."""
    shown = looks(scope, "auto", 0.25, [2.1, 4.1, 7.9, 8.1])
    assert shown == [[0, False], [2, False], [2, False], None]
    assert looks(scope, "normal", 0.25, [2.1, 4.1, 99])[-1] == [2, False]


def test_last_trigger_with_no_samples_after_it_is_shown(scope):
    """With the largest share before the trigger every edge is found once, and the last one, at 3.5 s, is shown."""
    assert looks(scope, "normal", 0.9, [4.1]) == [[1.7, False]]


def tell(page, **fields):
    """Sets the trigger's controls by name."""
    names = {"mode": "trigger", "kind": "trigger on", "signal": "signal of the trigger", "edge": "edge", "level": "level",
             "error": "which error", "command": "command byte, hexadecimal"}
    for key, value in fields.items():
        css = f'.scope-controls [aria-label="trigger"] [aria-label="{names[key]}"]'
        if key in ("level", "command"):
            page.one(css).send_keys(Keys.CONTROL, "a")
            page.one(css).send_keys(f"{value}", Keys.TAB)
        else:
            page.choose(css, value)


@pytest.fixture
def short(scope):
    scope.choose('[aria-label="seconds in view"]', "0.2")
    yield scope
    tell(scope, mode="off")
    scope.choose('[aria-label="seconds in view"]', "5")


def test_command_on_the_bus_triggers(short, bench):
    """At the program's time of the frame, with a quarter of 0.2 s before it."""
    tell(short, mode="single", kind="command", command="9c")

    def asked():
        bench.ask(1, 0x9C)
        return short.scope("s.held")
    short.until(asked)
    at, view = short.scope("[s.triggered_s, s.view]")
    assert view["to_s"] - view["from_s"] == pytest.approx(0.2)
    assert at - view["from_s"] == pytest.approx(0.05)
    assert [mark["name"] for mark in view["marks"]] == ["T"]
    short.until(lambda: "resume waits anew" in short.text("#trigger-state"))
    short.click(".scope-controls", "Resume")
    assert short.scope("s.triggered_s") is None


def test_other_command_does_not_trigger(short, bench):
    tell(short, mode="single", kind="command", command="0x9A")
    now = short.scope("s.captures[0].samples.last_s")
    for _ in range(5):
        bench.ask(1, 0x9C)
    short.until(lambda: short.scope("s.captures[0].samples.last_s") > now + 1)
    assert not short.scope("s.held")


def test_level_crossing_triggers(short, bench):
    """An angle on its way from 0° to 90° passes 45°, also without a trace for it."""
    bench.ask(1, 0x88)
    bench.position(1, 0)
    short.until(lambda: abs(bench.angle_deg(1)) < 1)
    tell(short, mode="single", kind="level", signal="angle_deg", edge="rising", level=45)
    bench.position(1, 90)
    short.until(lambda: short.scope("s.held"))
    at, samples = short.scope("""(() => {
      const {capture, column} = s.traces.find((one) => one.signal === 'angle_deg');
      return [s.triggered_s, [-0.001, 0.001].map((by) => capture.samples.at(column, s.triggered_s + by))];
    })()""")
    assert samples[0] < 45 <= samples[1], at


@pytest.fixture
def fed(short):
    yield short
    directive(short, supply_V=24)


def directive(page, **what):
    return page.run("""return fetch('/api/v1/directives', {method: 'POST', headers: {'Content-Type': 'application/json'},
      body: JSON.stringify(arguments[0])}).then((answer) => answer.status)""", {"id": 1} | what)


def test_error_bit_triggers(fed):
    """Under-voltage by a supply of 6.8 V, below the profile's 7 V; it is not among the selected signals."""
    tell(fed, mode="single", kind="error", error="under_voltage")
    assert directive(fed, supply_V=6.8) == 200
    fed.until(lambda: fed.scope("s.held"))
    before, after = fed.scope("""(() => {
      const [capture] = s.captures;
      return [-0.001, 0.001].map((by) => capture.samples.at(capture.column(1, 'errors'), s.triggered_s + by));
    })()""")
    assert [before, after] == [0, 1]
