"""Legend, manual value ranges, spectra and layouts of the scope, on a separate page."""

import cmath
import json
import math
import random

import pytest
from selenium.webdriver.common.keys import Keys


def module(page, name, script, *arguments):
    """Runs a script; `m` is the module, `given` the arguments."""
    return page.driver.execute_async_script(f"""
      const given = [...arguments];
      const done = given.pop();
      import('/{name}').then((m) => done((() => {{ {script} }})())).catch((error) => done(String(error)));""", *arguments)


# --- spectra

def test_transform_equals_its_definition(scope):
    source = random.Random(7)
    x = [complex(source.uniform(-1, 1), source.uniform(-1, 1)) for _ in range(16)]
    re, im = module(scope, "fft.js", """
      const [re, im] = given.map((list) => Float64Array.from(list));
      m.fft(re, im);
      return [[...re], [...im]];""", [z.real for z in x], [z.imag for z in x])
    for k in range(16):
        wanted = sum(z * cmath.exp(-2j * cmath.pi * k * n / 16) for n, z in enumerate(x))
        assert complex(re[k], im[k]) == pytest.approx(wanted, abs=1e-12)


@pytest.mark.parametrize("frequency_Hz", [50, 50.3, 123.456])
@pytest.mark.parametrize("count", [1000, 1024, 1500])
def test_sine_has_a_line_of_its_amplitude(scope, frequency_Hz, count):
    """A sine of 3 on an offset of 10. The logarithm of a padded Hann line is not a parabola. Between lines the
    interpolated amplitude is therefore wrong by up to 0.5 %, and the frequency by up to 1/20 of 1/T."""
    values = [10 + 3 * math.sin(2 * math.pi * frequency_Hz * n / 1000) for n in range(count)]
    peak = module(scope, "fft.js", "return m.peakOf(m.spectrum(Float64Array.from(given[0]), 1000));", values)
    assert peak["frequency_Hz"] == pytest.approx(frequency_Hz, abs=0.05 * 1000 / count)
    assert peak["amplitude"] == pytest.approx(3, rel=0.005)


def test_flat_spectrum_has_no_peak(scope):
    assert module(scope, "fft.js", "return m.peakOf(m.spectrum(new Float64Array(100).fill(24), 1000));") is None
    assert module(scope, "fft.js", "return m.spectrum(new Float64Array(7), 1000);") is None


def test_fewer_columns_lose_no_line(scope):
    highest = module(scope, "fft.js", """
      const lines = new Float64Array(5000);
      lines[1234] = 2;
      const columns = m.columnsOf({step_Hz: 0.1, lines}, 0, 500, 100);
      return [Math.max(...columns), columns.indexOf(2)];""")
    assert highest == [2, 24]  # 123.4 Hz, in columns of 5 Hz


def piece(page, samples):
    """Returns rate, first and last time of the newest samples [time, value] without a gap."""
    return page.driver.execute_async_script("""
      const [list, done] = arguments;
      Promise.all([import('/samples.js'), import('/scope_spectra.js')]).then(([{Samples}, {piece}]) => {
        const samples = new Samples(1);
        for (const [time_s, value] of list) samples.push(time_s, [value]);
        const found = piece({capture: {samples}, column: 0}, {from_s: 0, to_s: 99}, 1000);
        done(found && [found.values.length, found.rate_Hz, found.from_s, found.to_s]);
      }).catch((error) => done(String(error)));""", samples)


def test_spectrum_uses_samples_without_a_gap(scope):
    gap = [[n / 10, 1] for n in range(100) if not 40 <= n < 50]
    assert piece(scope, gap) == pytest.approx([50, 10, 5, 9.9])
    missing = [[n / 10, None if n == 60 else 1] for n in range(100)]
    assert piece(scope, missing) == pytest.approx([39, 10, 6.1, 9.9])
    assert piece(scope, gap[:5]) is None


def test_each_plot_gets_a_spectrum(scope):
    assert scope.scope("s.layout.spectra") is False
    scope.click(".scope-controls", "FFT")
    scope.until(lambda: scope.all(".panel-side canvas"))
    scope.until(lambda: set(scope.scope("s.peaks")) == set(scope.scope("s.traces.map((one) => one.label)")))
    assert "Hann" in scope.text(".spectrum-span")
    scope.click(".scope-controls", "FFT")
    scope.until(lambda: not scope.all(".panel-side canvas"))


# --- manual value ranges

def values(page, unit):
    scale = next(one for one in page.scope("s.values") if one["unit"] == unit)
    return scale["min"], scale["max"]


def press(page, *keys):
    page.run("document.querySelector('.panel-plot').focus()")
    page.driver.switch_to.active_element.send_keys(*keys)


def wheel(page, css, delta, times=1, **keys):
    page.run("""
      const [css, deltaY, times, keys] = arguments;
      const node = document.querySelectorAll(css)[css === '.u-axis' ? 1 : 0];
      const box = node.getBoundingClientRect();
      for (let n = 0; n < times; ++n) node.dispatchEvent(new WheelEvent('wheel', {bubbles: true, cancelable: true, deltaY,
        clientX: box.left + box.width / 2, clientY: box.top + box.height / 2, ...keys}));""", css, delta, times, keys)


def test_wheel_next_to_a_plot_zooms_its_values(scope):
    """Zooms by 0.8 about the pointer in the middle; the other plots and the time axis do not change."""
    scope.click(".scope-controls", "Pause")
    scope.drawn()
    before, other, view = values(scope, "deg"), values(scope, "dps"), scope.scope("s.view")
    for css, keys in ((".u-axis", {}), (".u-over", {"ctrlKey": True})):
        low, high = values(scope, "deg")
        wheel(scope, css, -100, **keys)
        scope.drawn()
        now = values(scope, "deg")
        assert now[1] - now[0] == pytest.approx(0.8 * (high - low))
        assert sum(now) == pytest.approx(sum((low, high)), abs=0.03 * (high - low))  # a pixel or two
    assert values(scope, "dps") == other
    assert scope.scope("s.view") == view
    scope.run("document.querySelectorAll('.u-axis')[1].dispatchEvent(new MouseEvent('dblclick', {bubbles: true}))")
    scope.drawn()
    assert values(scope, "deg") == pytest.approx(before)
    assert scope.scope("s.held"), "two clicks beside the picture pause nothing"
    scope.click(".scope-controls", "Resume")


def test_keys_move_and_zoom_the_values_of_the_focused_plot(scope):
    scope.click(".scope-controls", "Pause")
    scope.drawn()
    low, high = before = values(scope, "deg")
    press(scope, Keys.ARROW_UP)
    scope.drawn()
    assert values(scope, "deg") == pytest.approx((low + 0.1 * (high - low), high + 0.1 * (high - low)))
    scope.until(lambda: scope.button(".plot-legend", "auto").is_displayed())
    press(scope, Keys.SHIFT, Keys.ARROW_DOWN)
    scope.drawn()
    now = values(scope, "deg")
    assert now[1] - now[0] == pytest.approx((high - low) / 0.8)
    scope.button(".plot-legend", "auto").click()
    scope.drawn()
    assert values(scope, "deg") == pytest.approx(before)
    scope.click(".scope-controls", "Resume")


def test_zoom_of_values_is_limited(scope):
    """uPlot could not compute ticks of an axis with indistinguishable values."""
    wheel(scope, ".u-axis", -100, times=150)
    scope.drawn()
    low, high = values(scope, "deg")
    assert high - low > 0
    wheel(scope, ".u-axis", 100, times=300)
    scope.drawn()
    low, high = values(scope, "deg")
    assert math.isfinite(high - low)
    scope.button(".plot-legend", "auto").click()
    assert scope.complaints() == []


# --- the legend

def test_click_on_the_legend_toggles_a_trace(scope):
    legend = scope.button(".plot-legend", "1 angle_deg")
    for shown in (False, True):
        legend.click()
        assert legend.get_attribute("aria-pressed") == str(shown).lower()
        assert scope.scope("s.traces.find((one) => one.signal === 'angle_deg').shown") is shown
        row = scope.one('[data-trace="1 angle_deg"] button')
        assert row.get_attribute("aria-pressed") == str(shown).lower()
        assert not scope.scope("s.held")
    row.click()
    assert legend.get_attribute("aria-pressed") == "false"
    row.click()


def test_hidden_traces_do_not_scale_the_axis(scope, bench):
    """A trace of thousands of °/s next to a constant one."""
    scope.click(".scope-controls", "Pause")
    low, high = values(scope, "deg")
    for name in ("1 angle_deg", "1 angle_ref_deg"):
        scope.button(".plot-legend", name).click()
    scope.drawn()
    assert values(scope, "deg") == (0, 1)  # no visible trace
    for name in ("1 angle_deg", "1 angle_ref_deg"):
        scope.button(".plot-legend", name).click()
    scope.drawn()
    assert values(scope, "deg") == pytest.approx((low, high))
    scope.click(".scope-controls", "Resume")


def test_legend_shows_the_value_below_the_pointer(scope):
    scope.click(".scope-controls", "Pause")
    scope.mouse("Moved", scope.one(".u-over"), 50, count=0)
    over = scope.one(".u-over")
    view = scope.scope("s.view")
    time_s = view["from_s"] + (view["to_s"] - view["from_s"]) * (0.5 + 50 / over.size["width"])
    column = "s.traces.find((one) => one.signal === 'angle_deg')"
    wanted = scope.scope(f"{column}.capture.samples.at({column}.column, {time_s})")
    scope.until(lambda: scope.run("""return [...document.querySelectorAll('.plot-legend button')]
      .find((one) => one.textContent.startsWith('1 angle_deg')).querySelector('.value').textContent"""))
    text = scope.run("""return [...document.querySelectorAll('.plot-legend button')]
      .find((one) => one.textContent.startsWith('1 angle_deg')).querySelector('.value').textContent""")
    assert float(text.replace("\u2212", "-")) == pytest.approx(wanted, abs=0.05)
    scope.click(".scope-controls", "Resume")


# --- layouts

def open_layouts(page):
    page.run("document.querySelectorAll('.folded details').forEach((one) => { one.open = true; })")


def test_layout_restores_the_choice(scope, bench):
    open_layouts(scope)
    scope.click(".scope-controls", "position")
    scope.click(".scope-controls", "supply")
    scope.choose('[aria-label="samples per second"]', "2000")
    scope.choose('[aria-label="seconds in view"]', "2")
    scope.button(".plot-legend", "1 true_voltage_V").click()
    wanted = scope.scope("s.layout")
    assert wanted["hidden"] == [f"{bench.bus}/1 true_voltage_V"]
    scope.fill('[aria-label="name of the layout"]', "Mine")
    scope.click(".scope-controls", "Save")
    scope.click(".scope-controls", "position")
    scope.click(".scope-controls", "supply")
    scope.choose('[aria-label="samples per second"]', "1000")
    scope.choose('[aria-label="seconds in view"]', "5")
    scope.click(".scope-controls", "drive 2")
    scope.click(".scope-controls", "Load")
    assert scope.scope("s.layout") == wanted
    scope.driver.refresh()
    scope.until(lambda: scope.scope("s.traces.length > 0"))
    open_layouts(scope)
    scope.choose('[aria-label="layout"]', "Mine")
    assert scope.scope("s.layout") == wanted
    scope.click(".scope-controls", "Remove")
    assert [one.text for one in scope.all('[aria-label="layout"] option')] == ["–"]


def layouts(page, script, *arguments):
    return module(page, "scope_layouts.js", script, *arguments)


def test_saved_layouts_are_read_unchanged(scope):
    layout = scope.scope("s.layout")
    assert layouts(scope, "return m.parse(m.print({Mine: given[0]}));", layout) == {"Mine": layout}


@pytest.mark.parametrize("change, wrong", [
    ({"rate_Hz": 1e9}, "rate_Hz"), ({"width_s": "5"}, "width_s"), ({"signals": "iq_A"}, "signals"), ({"ranges": {"A": [2, 1]}}, "ranges"),
    ({"trigger": {"mode": "often"}}, "mode"), ({"trigger": {"before": 2}}, "before"), ({"trigger": {"command": "xyz"}}, "command"),
    ({"drives": None}, "drives")])
def test_file_with_a_mistake_is_refused(scope, change, wrong):
    layout = scope.scope("s.layout") | change
    said = layouts(scope, "try { return m.parse(given[0]); } catch (problem) { return problem.message; }",
                   json.dumps({"lk_emu_scope_layouts": 1, "layouts": {"Mine": layout}}))
    assert wrong in said and "Mine" in said


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"lk_emu_scope_layouts": 2, "layouts": {}}', '{"lk_emu_scope_layouts": 1, "layouts": [1]}'])
def test_file_of_another_format_is_refused(scope, text):
    assert isinstance(layouts(scope, "try { return m.parse(given[0]); } catch (problem) { return problem.message; }", text), str)


def test_page_imports_a_file(scope, bench, tmp_path):
    open_layouts(scope)
    layout = scope.scope("s.layout") | {"width_s": 0.5, "drives": [f"{bench.bus}/3", "vcan7/1"]}
    good, bad = tmp_path / "good.json", tmp_path / "bad.json"
    good.write_text(json.dumps({"lk_emu_scope_layouts": 1, "layouts": {"Third": layout}}))
    bad.write_text("{")
    scope.run("""window.said = [];  // notes go by themselves
      new MutationObserver((changes) => changes.forEach((one) => one.addedNodes.forEach((node) => window.said.push(node.textContent))))
        .observe(document.querySelector('#notes'), {childList: true});""")
    field = scope.one('.scope-controls input[type="file"]')
    field.send_keys(str(bad))
    scope.until(lambda: scope.run("return window.said.some((text) => text.startsWith('bad.json: '))"))
    field.send_keys(str(good))
    scope.until(lambda: any(option.text == "Third" for option in scope.all('[aria-label="layout"] option')))
    scope.choose('[aria-label="layout"]', "Third")
    assert scope.scope("s.layout")["drives"] == [f"{bench.bus}/3"]
    assert scope.scope("s.view.to_s - s.view.from_s") == pytest.approx(0.5)
    assert scope.run("return window.said.some((text) => text.includes('not all drives'))")
    assert scope.complaints() == []
