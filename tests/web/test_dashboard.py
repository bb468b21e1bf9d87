"""The dashboard in a real browser with a real emulator: it shows the drives' values on the wire, and clicks take effect
there."""

import math
import os

import pytest
from dashboard import nap, settle


def test_cards_show_the_reported_values(page, bench):
    page.go("bus")
    assert len(page.all(".card")) == 4
    # 0x9A: temperature in whole °C, voltage in 0.1 V; sensor noise is smaller.
    for drive in (1, 4):
        settle(page, lambda drive=drive: page.field(drive, "motor") == pytest.approx(bench.read(drive, 0x9A)[1], abs=1))
        settle(page, lambda drive=drive: page.field(drive, "bus") == pytest.approx(bench.voltage_V(drive), abs=0.15))
    settle(page, lambda: page.state(1) == "running")
    assert page.errors(1) == "no errors"


def test_dial_shows_the_shaft_angle(page, bench):
    page.go("bus")
    bench.ask(1, 0x88)
    bench.position(1, 90)
    # A drive without gear: the multi-turn angle is the shaft's, relative to the encoder's zero.
    settle(page, lambda: abs(bench.angle_deg(1) - 90) < 0.5)
    settle(page, lambda: abs((page.dial_deg(1) - page.dial_deg(1, "zero") - 90 + 180) % 360 - 180) < 2)


def test_dial_shows_the_target_angle(page, bench):
    page.go("bus")
    aimless = lambda: page.run("""return document.querySelector('[data-drive$="/1"] .dial svg').matches('.aimless')""")
    bench.ask(1, 0x88)
    bench.position(1, 45)
    settle(page, lambda: not aimless() and abs(page.dial_deg(1, "target") - page.dial_deg(1, "zero") - 45) % 360 < 1)
    bench.ask(1, 0xA2, 0, 0, 0, 0)  # a speed of 0 is not a target
    settle(page, aimless)


def test_card_follows_state_and_replies(page, bench):
    page.go("bus")
    bench.ask(3, 0x80)
    settle(page, lambda: page.state(3) == "off")
    bench.ask(3, 0x88)
    settle(page, lambda: page.state(3) == "running")
    bench.move(3)
    settle(page, lambda: page.field(3, "replies") > 5 and page.field(4, "replies") == 0)
    bench.move()
    settle(page, lambda: page.field(3, "replies") == 0)


def test_clicked_fault_takes_effect_on_the_bus(page, bench):
    page.go("bench")
    page.for_drives(2)
    page.choose("#fault-kind", "hang")
    page.click("#view-bench", "Inject")
    settle(page, lambda: "active" in page.text('[data-fault="hang"]'))
    assert bench.ask(2, 0x9A) is None
    assert bench.read(1, 0x9A)
    settle(page, lambda: "nothing yet" not in page.text('[data-fault="hang"]'))
    page.click("#evidence", "clear hang")
    settle(page, lambda: "cleared" in page.text('[data-fault="hang"]'))
    assert bench.read(2, 0x9A)


def test_fault_uses_the_entered_parameters(page, bench):
    page.go("bench")
    page.for_drives(4)
    page.choose("#fault-kind", "sag")
    page.fill('#fault-parameters [data-key="to_V"]', 15)
    page.click("#view-bench", "Inject")
    settle(page, lambda: bench.voltage_V(4) == pytest.approx(15, abs=0.2))
    assert bench.voltage_V(1) == pytest.approx(24, abs=0.2)
    page.click("#view-bench", "Clear all")
    settle(page, lambda: bench.voltage_V(4) == pytest.approx(24, abs=0.2))


def measured_V(page, drive):
    """Returns the voltage while time stands and the bus is silent."""
    return page.reported(drive)["signals"]["voltage_V"]


def step(page, name):
    now = "return fetch('/api/v1/clock').then((answer) => answer.json()).then((clock) => clock.time_s)"
    before = page.run(now)
    page.click("#view-bench", name)
    settle(page, lambda: page.run(now) > before)
    settle(page, lambda: page.button("#view-bench", name).is_enabled())


@pytest.fixture
def time_stands(page):
    page.go("bench")
    page.click("#view-bench", "Stop the clock")
    settle(page, lambda: page.text("#clock-mode") == "stepped")
    settle(page, lambda: page.button("#view-bench", "+10 ms").is_enabled())
    yield
    page.click("#view-bench", "Real time")
    settle(page, lambda: page.text("#clock-mode") == "realtime")


def test_supply_sag_is_measured_and_ends(page, time_stands):
    page.for_drives(2)
    page.fill('[aria-label="sag to, V"]', 14)
    page.fill('[aria-label="for, s"]', 0.05)
    page.click("#view-bench", "Sag")
    settle(page, lambda: "sag to 14 V" in " ".join(note.text for note in page.all(".note")))
    step(page, "+10 ms")
    step(page, "+10 ms")
    assert measured_V(page, 2) == pytest.approx(14, abs=0.2)
    assert measured_V(page, 1) == pytest.approx(24, abs=0.2)
    step(page, "+100 ms")
    assert measured_V(page, 2) == pytest.approx(24, abs=0.2)


def test_power_cycle_ends_in_time(page, time_stands):
    page.for_drives(3)
    page.fill('[aria-label="off for, s"]', 0.05)
    page.click("#view-bench", "Cycle")
    settle(page, lambda: "off for 0.05 s" in " ".join(note.text for note in page.all(".note")))
    step(page, "+10 ms")
    settle(page, lambda: "off" in page.text("#supply-now"))
    step(page, "+1 s")
    settle(page, lambda: "off" not in page.text("#supply-now"))


def test_clock_factor_scales_time(page):
    page.go("bench")
    page.fill('#view-bench input[max="1000"]', 0.25)
    page.click("#view-bench", "Scale")
    settle(page, lambda: page.text("#clock-mode") == "x0.25")
    page.click("#view-bench", "Real time")
    settle(page, lambda: page.text("#clock-mode") == "realtime")


def test_scope_shows_the_overshoot_of_a_step(page, bench):
    bench.angle_gain(1, 250)
    bench.position(1, 0)
    settle(page, lambda: abs(bench.angle_deg(1)) < 0.2)
    page.go(f"scope?drive={bench.bus}/1")
    settle(page, lambda: page.scope("s.traces.length > 0 && s.captures[0].samples.length > 500"))
    began = page.scope("s.captures[0].samples.last_s")
    bench.position(1, 120)
    settle(page, lambda: abs(bench.angle_deg(1) - 120) < 0.2)
    bench.angle_gain(1, 100)
    now = page.scope("s.captures[0].samples.last_s")
    settle(page, lambda: page.scope("s.captures[0].samples.last_s") > now + 0.5)
    seen = page.scope(f"""(() => {{
      const {{samples}} = s.captures[0];
      const trace = (signal) => s.traces.find((one) => one.signal === signal).column;
      const first = samples.find({began});
      const gaps = Array.from(samples.times.subarray(first, samples.end)).map((t, n, all) => n ? t - all[n - 1] : 0.001);
      return {{most: samples.extremes(trace('angle_deg'), {began}, samples.last_s).max,
        ref: samples.extremes(trace('angle_ref_deg'), {began}, samples.last_s).max,
        start: samples.at(trace('angle_deg'), {began}),
        least_gap: Math.min(...gaps), most_gap: Math.max(...gaps), rate_Hz: s.captures[0].rate_Hz}};
    }})()""")
    assert seen["rate_Hz"] == 1000
    assert seen["least_gap"] == pytest.approx(0.001, abs=1e-6)
    assert seen["most_gap"] == pytest.approx(0.001, abs=1e-6), "no sample is missing"
    assert seen["ref"] == pytest.approx(120, abs=0.05)
    assert abs(seen["start"]) < 1
    assert 125 < seen["most"] < 180, "past the target by more than any noise"
    # The plot has this peak too, although it omits samples.
    drawn = page.scope("""(() => {
      const trace = s.traces.find((one) => one.signal === 'angle_deg');
      const [, values] = trace.capture.samples.view(s.view.from_s, s.view.to_s, 50, [trace.column]);
      return {drawn: Math.max(...values), kept: trace.capture.samples.extremes(trace.column, s.view.from_s, s.view.to_s).max,
        points: values.length};
    })()""")
    assert drawn["points"] <= 102
    assert drawn["drawn"] == drawn["kept"]


def test_cursors_show_differences(page, bench):
    page.go("scope")
    settle(page, lambda: page.scope("s.captures[0].samples.last_s - s.captures[0].samples.first_s > 5.5"))
    page.click(".scope-controls", "Pause")
    page.click(".scope-controls", "A")
    page.click(".scope-controls", "B")
    said = page.scope("""(() => {
      const trace = s.traces[0]; const {A, B} = s.cursors; const at = (t) => trace.capture.samples.at(trace.column, t);
      return [B - A, at(B) - at(A), trace.label];
    })()""")
    settle(page, lambda: "ms" in page.text(".values caption"))
    shown_ms = float(page.text(".values caption").split("=")[1].split("ms")[0])
    assert shown_ms == pytest.approx(said[0] * 1000, rel=1e-4)
    cells = page.run("""return [...document.querySelector(`[data-trace="${arguments[0]}"]`).cells].map((c) => c.textContent)""", said[2])
    assert float(cells[4].replace("\u2212", "-")) == pytest.approx(said[1], rel=1e-3, abs=1e-3)
    page.click(".scope-controls", "clear cursors")
    page.click(".scope-controls", "Resume")


def test_csv_contains_the_samples_in_view(page, bench):
    page.go("scope")
    settle(page, lambda: page.scope("s.captures[0].samples.length > 100"))
    page.click(".scope-controls", "Pause")
    page.run("""window.saved = null; const make = URL.createObjectURL;
      URL.createObjectURL = (blob) => { window.saved = blob; URL.createObjectURL = make; return make.call(URL, blob); };""")
    page.click(".scope-controls", "CSV")
    text = page.driver.execute_async_script("window.saved.text().then(arguments[0])")
    lines = text.strip().split("\n")
    assert lines[0].split(",")[:2] == ["time_s", "1.angle_ref_deg"]
    view = page.scope("s.view")
    times = [float(line.split(",")[0]) for line in lines[1:]]
    assert view["from_s"] <= times[0] and times[-1] <= view["to_s"] + 1e-6
    expected = page.scope("s.captures[0].samples.find(s.view.to_s + 1e-9) - s.captures[0].samples.find(s.view.from_s)")
    assert len(times) == expected
    page.click(".scope-controls", "Resume")


def test_stepped_clock_advances_by_steps(page, bench):
    page.go("bench")
    page.click("#view-bench", "Stop the clock")
    settle(page, lambda: page.text("#clock-mode") == "stepped")
    status = "return fetch('/api/v1/clock').then((r) => r.json()).then((c) => c.time_s)"
    before = page.run(status)
    assert page.run(status) == before
    settle(page, lambda: page.button("#view-bench", "+100 ms").is_enabled())
    page.click("#view-bench", "+100 ms")
    settle(page, lambda: page.run(status) == pytest.approx(before + 0.1, abs=1e-6))
    page.click("#view-bench", "Real time")
    settle(page, lambda: page.text("#clock-mode") == "realtime")


def test_lost_connection_is_shown_and_restored(page, bench):
    page.go("bus")
    assert not page.one("#lost").is_displayed()
    bench.stop()
    settle(page, lambda: page.one("#lost").is_displayed())
    assert "No answer" in page.text("#lost")
    bench.start()
    settle(page, lambda: not page.one("#lost").is_displayed())
    settle(page, lambda: not math.isnan(page.dial_deg(1)))  # the cards were rebuilt
    before = page.dial_deg(1)
    bench.ask(1, 0x88)
    bench.position(1, bench.angle_deg(1) + 120)
    settle(page, lambda: abs(page.dial_deg(1) - before) > 30)
    page.complaints()  # discards errors of the disconnection


def test_controls_that_need_the_program_are_disabled_when_it_has_ended(page, bench):
    enabled = """return [...document.querySelectorAll(`#view-${arguments[0]} :is(button, input, select)`)]
      .filter((one) => !one.matches(':disabled')).map((one) => one.getAttribute('aria-label') ?? one.textContent)"""
    page.go("bench")
    assert "drive 1" in page.run(enabled, "bench")
    page.fill('[aria-label="jog speed, °/s"]', 30)
    bench.stop()
    # A click before the page has noticed; the fieldset may already be disabled.
    page.run("""import('/choice.js').then(({command}) => command({command: 'stop'}))""")
    settle(page, lambda: any(note.text.startswith("No answer from lk-emu") for note in page.all(".note")))
    settle(page, lambda: page.run(enabled, "bench") == [])
    assert "disabled" in page.text("#lost")
    kept = page.run(enabled, "scope")
    assert not {"samples per second", "position", "trigger"} & set(kept)
    assert {"Pause", "CSV", "A"} <= set(kept), "what is recorded can be read"
    bench.start()
    settle(page, lambda: {"drive 1", "turn forth"} <= set(page.run(enabled, "bench")))
    assert "position" in page.run(enabled, "scope")
    page.complaints()  # discards errors of the disconnection


def restart(page, bench):
    bench.stop()
    settle(page, lambda: page.one("#lost").is_displayed())
    bench.start()
    settle(page, lambda: not page.one("#lost").is_displayed())


def test_scope_continues_after_a_restart(page, bench):
    page.go(f"scope?drive={bench.bus}/1")
    settle(page, lambda: page.scope("s.captures[0].samples.length > 100"))
    restart(page, bench)
    settle(page, lambda: page.scope("s.captures[0].samples.length > 100"))
    drawn = page.draws()
    assert drawn == [1] * len(drawn)
    seen = page.scope("s.captures[0].samples.last_s")
    settle(page, lambda: page.scope("s.captures[0].samples.last_s") > seen)
    page.complaints()  # discards errors of the disconnection


def test_traffic_continues_after_a_restart(page, bench):
    def frame_is_seen():
        bench.ask(4, 0x9C)  # repeated: no event reports that the stream is open
        return "read state 2" in page.text("#view-traffic tbody")

    page.go("traffic")
    page.click("#view-traffic", "Clear")
    settle(page, frame_is_seen)
    restart(page, bench)
    settle(page, lambda: not page.all("#view-traffic tbody tr"))
    settle(page, frame_is_seen)
    drawn = page.draws()
    assert drawn == [1] * len(drawn)
    page.complaints()  # discards errors of the disconnection


@pytest.mark.parametrize("view", ["bus", "scope", "traffic", "bench"])
def test_view_left_briefly_is_drawn_once_a_frame(page, view):
    page.go(view)
    page.driver.execute_async_script("""
      const [view, done] = arguments;
      import(`/${view}.js`).then(({show}) => {
        show(false);
        show(true);
        show(true);
        done();
      });""", view)
    drawn = page.draws()
    assert drawn == [1] * len(drawn)


def test_page_requests_no_other_host(page, bench):
    page.driver.refresh()
    page.until(lambda: page.all(".card"))
    assert page.requested_hosts() == {f"127.0.0.1:{bench.http}"}
    assert page.complaints() == []


def test_every_control_has_a_name(page, bench):
    for view in ("bus", "scope", "traffic", "bench"):
        page.go(view)
        nameless = page.run("""
          return [...document.querySelectorAll('button, input, select, a, [role=slider], [tabindex="0"]')].filter((node) =>
            node.offsetParent && !(node.textContent.trim() || node.getAttribute('aria-label') || node.labels?.length || node.title))
            .map((node) => node.outerHTML.slice(0, 120))""")
        assert nameless == []


def test_streaming_does_not_leak_memory(page, bench):
    """Long runs: LKEMU_SOAK_S=3600; pytest -s prints the figures during the run."""
    soak_s = float(os.environ.get("LKEMU_SOAK_S", "12"))
    bench.move(1, 2, 3, 4)
    page.go("traffic")
    page.go(f"scope?drive={bench.bus}/1")
    page.click(".scope-controls", "all drives")

    def look():
        browser = page.heap_bytes()
        return {"heap_MB": browser["JSHeapUsedSize"] / 1e6, "nodes": browser["Nodes"],
                "listeners": browser["JSEventListeners"], "emulator_MB": bench.memory_kB() / 1e3}

    nap(soak_s / 4)
    seen = [look()]
    for _ in range(12):
        nap(soak_s / 12)
        seen.append(look())
        print(f"{len(seen) - 1} of 12:", {key: round(value, 1) for key, value in seen[-1].items()}, flush=True)
    bench.move()
    before, after = seen[0], seen[-1]
    # The traffic view keeps at most 60,000 frames, about 25 MB, which a short run does not fill. The scope allocates
    # its memory at once.
    assert after["heap_MB"] - before["heap_MB"] < (10 if soak_s > 600 else 40)
    assert after["emulator_MB"] - before["emulator_MB"] < 5
    assert after["nodes"] <= before["nodes"] + 2000
    assert after["listeners"] <= before["listeners"] + 200
