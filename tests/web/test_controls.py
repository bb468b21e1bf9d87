"""Actions at the bench take effect on the bus; impossible ones are reported."""

import pytest
from dashboard import settle
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

TELL = """return fetch('/api/v1/directives', {method: 'POST', headers: {'Content-Type': 'application/json'},
    body: JSON.stringify(arguments[0])}).then((answer) => answer.status)"""


def load_of(page, drive):
    return page.reported(drive)["surroundings"]["load"]


def notes(page):
    return " ".join(note.text for note in page.all(".note"))


def test_power_and_supply_take_effect(page, bench):
    page.go("bench")
    page.for_drives(3)
    page.fill('[aria-label="supply, V"]', 18)
    page.click("#view-bench", "set the supply")
    settle(page, lambda: bench.voltage_V(3) == pytest.approx(18, abs=0.2))
    page.click("#view-bench", "Power off")
    settle(page, lambda: bench.ask(3, 0x9A) is None)
    page.go("bus")
    settle(page, lambda: page.state(3) == "no power")
    page.go("bench")
    page.click("#view-bench", "Power on")
    settle(page, lambda: bench.ask(3, 0x9A) is not None)


def test_bench_shows_the_present_values(page, bench):
    """Shows changes from any source."""
    page.go("bench")
    page.for_drives(3)
    supply = '[aria-label="supply, V"]'
    assert page.run(TELL, {"id": 3, "supply_V": 20}) == 200
    assert page.run(TELL, {"id": 3, "ambient_C": 33}) == 200
    assert page.run(TELL, {"id": 3, "load": {"tau_Nm": 0.05}}) == 200
    settle(page, lambda: page.one(supply).get_attribute("value") == "20")
    settle(page, lambda: "20 V, ambient 33 °C" in page.text("#supply-now"))
    settle(page, lambda: "torque 0.05 Nm" in page.text("#load-now"))
    page.fill(supply, 21)
    assert page.run(TELL, {"id": 3, "supply_V": 24}) == 200
    settle(page, lambda: "24 V" in page.text("#supply-now"))
    assert page.one(supply).get_attribute("value") == "21", "what somebody is writing stays"
    assert page.run(TELL, {"id": 3, "load": {"tau_Nm": 0}}) == 200
    page.for_drives(3)


def test_mouse_turns_the_shaft(page, bench):
    page.go("bench")
    page.for_drives(2)
    bench.ask(2, 0x80)  # a free shaft stays where it is turned
    before = bench.angle_deg(2)
    dial = page.one("#view-bench .dial")
    page.run("arguments[0].scrollIntoView({block: 'center'})", dial)
    far = dial.size["width"] * 0.4
    hand = ActionChains(page.driver, duration=100).move_to_element_with_offset(dial, 0, -int(far))
    hand.click_and_hold()
    # From 12 o'clock to 3 o'clock, clockwise.
    hand.move_by_offset(int(far * 0.7), int(far * 0.3)).move_by_offset(int(far) - int(far * 0.7), int(far) - int(far * 0.3))
    hand.release().perform()
    # Whole pixels: the hand is at most 2 degrees off.
    settle(page, lambda: abs(bench.angle_deg(2) - before - 90) < 4)
    turned = bench.angle_deg(2)
    dial.send_keys(Keys.ARROW_LEFT)
    settle(page, lambda: abs(bench.angle_deg(2) - turned + 1) < 0.5)
    bench.ask(2, 0x88)


def test_scenario_runs_and_shows_its_verdict(page, bench):
    """Starts away from the scenario's target: a jam of a drive that is already there would change nothing."""
    bench.ask(1, 0x88)
    bench.position(1, 0)
    settle(page, lambda: abs(bench.angle_deg(1)) < 1)
    page.go("bench")
    jammed = '#scenario option[value$="jammed_joint.toml"]'
    settle(page, lambda: page.all(jammed))
    page.choose("#scenario", page.one(jammed).get_attribute("value"))
    page.click("#view-bench", "Start scenario")
    # An earlier run may have left its text.
    settle(page, lambda: "running" in page.text("#scenario-state"))
    settle(page, lambda: "running" not in page.text("#scenario-state"))
    assert "jammed joint" in page.text("#scenario-state")
    assert any(word in page.text("#scenario-state") for word in ("passed", "failed"))


def test_empty_field_is_refused(page, bench):
    page.go("bench")
    page.for_drives(3)
    page.fill('[aria-label="supply, V"]', "")
    page.click("#view-bench", "set the supply")
    settle(page, lambda: "supply, V" in notes(page))
    page.fill('[aria-label="supply, V"]', 101)
    page.click("#view-bench", "set the supply")
    page.fill('[aria-label="off for, s"]', "")
    page.click("#view-bench", "Cycle")
    settle(page, lambda: "off for, s" in notes(page))
    assert "supply goes" not in notes(page) and "then on" not in notes(page)
    assert bench.voltage_V(3) == pytest.approx(24, abs=0.2)
    page.fill('[aria-label="off for, s"]', 0.5)
    page.for_drives(3)


def test_load_change_keeps_values_that_were_not_edited(page):
    page.go("bench")
    assert page.run(TELL, {"id": 2, "load": {"J_g_cm2": 2, "theta_max_deg": 400}}) == 200
    assert page.run(TELL, {"id": 3, "load": {"J_g_cm2": 3, "tau_Nm": 0.01}}) == 200
    page.for_drives(2, 3)
    page.fill('[data-key="tau_Nm"]', 0.05)
    page.click("#view-bench", "Set load")
    settle(page, lambda: load_of(page, 3)["tau_Nm"] == pytest.approx(0.05))
    second, third = load_of(page, 2), load_of(page, 3)
    assert (second["J_g_cm2"], second["tau_Nm"], second["theta_max_deg"]) == pytest.approx((2, 0.05, 400))
    assert third["J_g_cm2"] == pytest.approx(3)
    assert third["theta_max_deg"] > 1e6, "no stop came with the other drive's"
    page.fill('[data-key="theta_max_deg"]', 500)
    page.fill('[data-key="theta_max_deg"]', "")  # removes an end stop
    page.click("#view-bench", "Set load")
    settle(page, lambda: load_of(page, 2)["theta_max_deg"] > 1e6)
    page.fill('[data-key="J_g_cm2"]', "")
    page.click("#view-bench", "Set load")
    settle(page, lambda: "inertia" in notes(page))
    assert load_of(page, 2)["J_g_cm2"] == pytest.approx(2)
    for drive in (2, 3):
        assert page.run(TELL, {"id": drive, "load": {}}) == 200
    page.for_drives(2)


def test_last_chosen_scenario_is_started(page, tmp_path):
    page.go("bench")
    settle(page, lambda: page.all('#scenario option[value$="jammed_joint.toml"]'))
    own = tmp_path / "own.toml"
    own.write_text("")
    file = page.one("#view-bench input[type=file]")
    chosen = lambda: page.run("return [arguments[0].files.length, document.querySelector('#scenario').value]", file)
    jammed = page.one('#scenario option[value$="jammed_joint.toml"]').get_attribute("value")
    page.choose("#scenario", jammed)
    file.send_keys(str(own))
    settle(page, lambda: chosen() == [1, ""])
    page.choose("#scenario", jammed)
    settle(page, lambda: chosen() == [0, jammed])


def test_start_without_a_scenario_says_what_to_do(page):
    page.go("bench")
    page.choose("#scenario", "")
    page.run("document.querySelector('#view-bench input[type=file]').value = ''")
    page.click("#view-bench", "Start scenario")
    settle(page, lambda: notes(page) == "choose a scenario or a file first")
    assert page.complaints() == []


def test_pressed_button_keeps_the_focus(page):
    page.go("bench")
    page.for_drives(1)
    button = page.button("#view-bench", "drive 2")
    button.send_keys(Keys.SPACE)
    assert button.get_attribute("aria-pressed") == "true"
    assert page.driver.switch_to.active_element == button


def test_invalid_verdict_shows_the_reason(page, tmp_path):
    page.go("bench")
    own = tmp_path / "own.toml"
    # Drive 4 gets no frames, so its hang has no effect (docs/guides/scenarios.md).
    own.write_text('about = "nothing"\nduration_s = 0.3\n[[event]]\nat_s = 0.1\nid = 4\nfault = { kind = "hang", name = "unheard", for_s = 0.1 }\n'
                   '[[expect]]\nid = 1\nerror = "stall"\nset = false\nfrom_s = 0\nto_s = 0.1\n')
    page.one("#view-bench input[type=file]").send_keys(str(own))
    page.click("#view-bench", "Start scenario")
    # The verdict of an earlier scenario may still be there.
    settle(page, lambda: "unheard" in page.text(".scroll tr:has([data-state=invalid])"))
