"""Size, axes and names of the scope's plots, and its toolbar and drawer, on a separate page."""

import pytest


PLOTS = """
  const box = (css) => document.querySelector(css).getBoundingClientRect();
  const below = innerHeight - box('body > header').height;
  const plots = [...document.querySelectorAll('.panel-plot .uplot')].map((one) => one.getBoundingClientRect());
  const inside = box('.plots');
  const drawn = plots.reduce((sum, {top, bottom}) => sum + Math.max(0, Math.min(bottom, inside.bottom) - Math.max(top, inside.top)), 0);
  const tools = [...document.querySelector('.tools').children].filter((one) => one.offsetParent).map((one) => one.getBoundingClientRect());
  return {share: drawn / below, rows: new Set(tools.map(({top, height}) => Math.round(top + height / 2))).size, names: tools.length};"""
WIDE = [(1920, 1080), (1440, 900), (1280, 720)]


@pytest.fixture
def sized(scope):
    yield lambda size: (scope.resize(size), scope.drawn())
    scope.resize((1440, 900))


@pytest.mark.parametrize("size", WIDE, ids=lambda size: str(size[0]))
def test_plots_use_the_height(scope, sized, size):
    """With the drawer open and closed."""
    sized(size)
    for is_open in (True, False):
        assert scope.one("#scope-drawer").is_displayed() == is_open
        found = scope.run(PLOTS)
        assert found["share"] >= 0.8
        assert found["rows"] == 1
        scope.click(".scope-controls", "Controls")


def test_phone_has_one_button_for_the_controls(scope, sized):
    sized((390, 844))
    names = lambda: [one.text for one in scope.all(".scope-controls :is(button, select, input, summary)") if one.is_displayed()]
    assert names() == ["Pause", "Controls"]
    assert scope.run(PLOTS)["share"] >= 0.8
    scope.click(".scope-controls", "Controls")
    assert {"CSV", "FFT", "position", "all drives"} <= set(names())
    assert scope.run(PLOTS)["share"] > 0.1, "plots stay visible"
    scope.click(".scope-controls", "Controls")
    assert names() == ["Pause", "Controls"]


UNITS = {"deg": "angle, °", "dps": "speed, °/s", "A": "current, A", "V": "voltage, V", "C": "temperature, °C", "Nm": "torque, Nm", "duty": "duty"}
SIGNALS = ["angle_deg", "speed_dps", "iq_A", "voltage_V", "true_voltage_V", "temperature_C", "true_torque_Nm", "duty_a", "alive"]


@pytest.mark.parametrize("size", [*WIDE, (768, 1024), (390, 844)], ids=lambda size: str(size[0]))
def test_each_axis_has_a_name_and_three_numbers(scope, sized, bench, size):
    """Also in the smallest plots, and for signals that are constant, since the drives do not move."""
    bench.move()
    scope.go(f"scope?drive={bench.bus}/1&signals={','.join(SIGNALS)}&spectra=true")
    sized(size)
    try:
        scope.until(lambda: len(scope.scope("s.axes")) == 8 and all(one["values"] for one in scope.scope("s.axes")))
        plots = scope.scope("s.axes")
        for plot in plots:
            shown = [text for text in plot["values"] if text]
            assert len(set(shown)) == len(shown) >= 3, plot
        assert [len(set(plot["times"])) >= 3 for plot in plots] == [True] * 8
        assert [plot["time_name"] for plot in plots] == [None] * 7 + ["time, s"]
        names = [one.text for one in scope.all(".plot-legend .axis-name")]
        assert names == [UNITS.get(plot["unit"], "state") for plot in plots]
        assert [one.text for one in scope.all(".panel-side .axis-name")] == names
        assert all(plot["frequency"][0] == "frequency, Hz" and len(set(plot["frequency"][1])) >= 3 for plot in plots)
    finally:
        scope.go(f"scope?drive={bench.bus}/1&signals=angle_ref_deg,angle_deg,speed_dps,iq_A&spectra=false")


@pytest.mark.parametrize("least, most, step", [(0, 1, 2), (-0.06, 0.06, 0.1), (25.844, 26.156, 0.5), (-1e9, 1e9, 1e9), (0.1, 0.3, 0.1), (3599.99, 3600.02, 0.05), (0, 1e-12, 1)])
def test_range_has_three_round_ticks(scope, least, most, step):
    ticks = scope.driver.execute_async_script("""
      const [least, most, step, done] = arguments;
      import('/panels.js').then(({ticksOf}) => done(ticksOf(least, most, step))).catch((error) => done(String(error)));""", least, most, step)
    assert 3 <= len(ticks) <= 6
    slack = (most - least) * 1e-6
    assert least - slack <= ticks[0] and ticks[-1] <= most + slack
    by = ticks[1] - ticks[0]
    assert by <= step * (1 + 1e-6)
    assert ticks == pytest.approx([ticks[0] + n * by for n in range(len(ticks))], abs=slack)
    digits = f"{by:.3e}".split("e")[0]
    assert digits in {"1.000", "1.500", "2.000", "2.500", "3.000", "4.000", "5.000", "7.500"}


def test_names_of_traces_cover_no_curve(scope, sized, bench):
    """With more names than fit in a line."""
    sized((390, 844))
    scope.go(f"scope?drive={','.join(f'{bench.bus}/{n}' for n in range(1, 5))}")
    scope.until(lambda: scope.scope("s.traces.length === 16"))
    scope.drawn()
    over = scope.run("""return [...document.querySelectorAll('.panel-plot')].map((one) => one.querySelector('.plot-legend').getBoundingClientRect().bottom
      - one.querySelector('.u-over').getBoundingClientRect().top)""")
    assert max(over) <= 0
    scope.go(f"scope?drive={bench.bus}/1")
