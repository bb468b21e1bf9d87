"""The robot on the dashboard as lk-emu-body computes it; LKEMU_BODY says which program."""

import os
import pathlib

import pytest
from dashboard import Bench, Page
from selenium.webdriver.common.action_chains import ActionChains

BODY = os.environ.get("LKEMU_BODY")
pytestmark = pytest.mark.skipif(not BODY, reason="without LKEMU_BODY there is no robot")
PENDULUM = pathlib.Path(__file__).resolve().parents[2] / "configs" / "buses" / "pendulum.toml"


@pytest.fixture(scope="module")
def bench():
    bench = Bench(BODY, None, "--config", str(PENDULUM), "--http-write")
    yield bench
    bench.close()


@pytest.fixture(scope="module")
def page(bench):
    page = Page(bench.http, (1024, 600))
    page.until(lambda: page.all("#robot .robot-replay"))
    yield page
    assert page.complaints() == []
    page.close()


def inspect(page, expression):
    return page.driver.execute_async_script(
        "const done = arguments[0]; import('/robot.js').then(({inspectRobot}) => {"
        f"const r = inspectRobot(); done({expression});}})")


def tilt(page):
    """Of the arm, about y: twice the arc sine of its quaternion's y."""
    return inspect(page, "r.record.frame(r.frames[1] - 1)?.poses[5] ?? 0")


def test_the_body_moves_with_its_drive(page, bench):
    page.until(lambda: inspect(page, "r.frames[1]") > 3)
    before = tilt(page)
    page.run("""return fetch('/api/v1/frames', {method: 'POST', headers: {'Content-Type': 'application/json'},
                body: '{"id": 1, "command": "A4", "angle_deg": 400, "max_speed_dps": 300}'})""")
    page.until(lambda: abs(tilt(page) - before) > 0.1)


def test_a_push_of_the_mouse_moves_it(page, bench):
    bench.ask(1, 0x80)  # limp, so that it hangs
    page.until(lambda: abs(inspect(page, "r.record.frame(r.frames[1] - 1).time_s - r.record.frame(r.frames[1] - 5).time_s")) > 0)
    canvas = page.one("#robot canvas")
    x, y, _ = inspect(page, "r.project([...r.record.frame(r.frames[1] - 1).poses.slice(0, 2), 0.35])")
    before = tilt(page)
    hand = ActionChains(page.driver, duration=50).move_to_element_with_offset(
        canvas, round(x * canvas.size["width"] / 2), round(-y * canvas.size["height"] / 2))
    hand.click_and_hold().move_by_offset(120, 0).perform()
    page.until(lambda: abs(tilt(page) - before) > 0.1)
    ActionChains(page.driver).release().perform()
