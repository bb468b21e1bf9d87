"""The robot on the dashboard with lk-emu-body; LKEMU_BODY names the program."""

import io
import math
import os
import pathlib

import pytest
from bench import Bench
from dashboard import Page
from PIL import Image
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

BODY = os.environ.get("LKEMU_BODY")
pytestmark = pytest.mark.skipif(not BODY, reason="without LKEMU_BODY there is no robot")
PENDULUM = pathlib.Path(__file__).resolve().parents[2] / "configs" / "buses" / "pendulum.toml"


@pytest.fixture(scope="module")
def bench():
    bench = Bench(BODY, [None], "--config", str(PENDULUM), "--http-write")
    yield bench
    bench.close()


@pytest.fixture(scope="module")
def page(bench, browser):
    page = Page(browser, bench.http, (1024, 600))
    page.until(lambda: page.all("#robot .robot-replay"))
    yield page
    assert page.complaints() == []
    page.close()


def inspect(page, expression):
    return page.driver.execute_async_script(
        "const done = arguments[0]; import('/robot.js').then(({inspectRobot}) => {"
        f"const r = inspectRobot(); done({expression});}})")


def arm_pose(page):
    """Returns the position of the arm's hinge (x, y, z), and the arm's angle about y, from its quaternion."""
    *hinge, w, _, y, _ = inspect(page, "[0, 1, 2, 3, 4, 5, 6].map((n) => r.record.frame(r.frames[1] - 1).poses[n])")
    return hinge, 2 * math.atan2(y, w)


def tilt_angle(page):
    return arm_pose(page)[1]


def rod_on_screen(page):
    """Returns the screen position of the rod's middle; the rod is 0.3 m long, at an angle about y."""
    (x, y, z), angle = arm_pose(page)
    return inspect(page, f"r.project({[x - 0.15 * math.sin(angle), y, z - 0.15 * math.cos(angle)]})")[:2]


def wait_for_rest(page, bench):
    """Waits until the drive has arrived, the page shows it, and the camera is still."""
    def is_at_rest():
        before = rod_on_screen(page)
        page.drawn()
        still = math.dist(before, rod_on_screen(page)) < 0.001
        return still and abs(math.remainder(tilt_angle(page) + math.radians(bench.angle_deg(1)), math.tau)) < 0.01
    page.until(is_at_rest)


ROBOTS = ["pendulum", "two_joint_arm", "six_joint_arm", "quadruped_on_the_ground"]
LEAST_PX = 30  # of a joint's marker


@pytest.mark.parametrize("theme", ["dark", "light"])
@pytest.mark.parametrize("robot", ROBOTS)
def test_every_joint_is_visible(browser, robot, theme):
    """A joint is visible if hiding its marker changes the picture, and what it hid was of the marker's colour."""
    bench = Bench(BODY, [None], "--config", str(PENDULUM.with_name(f"{robot}.toml")))
    page = Page(browser, bench.http, (1280, 720), before=f"localStorage.setItem('lk-emu-theme', '{theme}')")
    try:
        page.until(lambda: page.all("#robot .robot-replay") and inspect(page, "r.frames[1]") > 3)
        page.click("#robot", "errors")  # all joints have the colour of good
        page.one("#robot input[type=range]").send_keys(Keys.HOME)  # stands still
        page.until(lambda: inspect(page, "r.cursor") is not None)

        def picture():
            page.run("document.dispatchEvent(new Event('theme'))")  # draws again
            page.drawn()
            return Image.open(io.BytesIO(page.one("#robot canvas").screenshot_as_png)).convert("RGB")

        whole = picture()
        for n in range(inspect(page, "r.scene.joints.length")):
            inspect(page, f"(r.scene.joints[{n}].visible = false)")
            without = picture()
            inspect(page, f"(r.scene.joints[{n}].visible = true)")
            marker = [one for one, other in zip(whole.getdata(), without.getdata())
                      if max(abs(a - b) for a, b in zip(one, other)) > 24]
            greenish = [colour for colour in marker if colour[1] > colour[0] + 20]
            assert len(greenish) >= LEAST_PX, f"joint {n}: {len(marker)} pixels, {len(greenish)} of its colour"
    finally:
        page.close()
        bench.close()


def test_body_moves_with_its_drive(page, bench):
    page.until(lambda: inspect(page, "r.frames[1]") > 3)
    before = tilt_angle(page)
    bench.position(1, 400, 300)
    page.until(lambda: abs(tilt_angle(page) - before) > 0.1)


def test_program_accepts_a_push_by_mouse(page, bench):
    """Tests of the directive cover the resulting motion."""
    page.run("""
      window.pushed = [];
      const plain = window.fetch;
      window.fetch = async (...asked) => {
        const answer = await plain(...asked);
        if (String(asked[0]).endsWith('/directives')) window.pushed.push([JSON.parse(asked[1].body).push.body, answer.status]);
        return answer;
      };""")
    wait_for_rest(page, bench)
    x, y = rod_on_screen(page)
    canvas = page.one("#robot canvas")
    ActionChains(page.driver, duration=50).move_to_element_with_offset(
        canvas, round(x * canvas.size["width"] / 2), round(-y * canvas.size["height"] / 2)).click_and_hold().move_by_offset(60, 0).perform()
    page.until(lambda: ["arm", 200] in page.run("return window.pushed"))
    ActionChains(page.driver).release().perform()
    assert {status for _, status in page.run("return window.pushed")} == {200}


def test_joint_and_card_are_linked(page):
    """The pendulum has one joint; its marker is at the origin of its body."""
    card = page.one(".card")
    joint = page.run("return fetch('/api/v1/body').then((answer) => answer.json()).then(({joints}) => joints[0].name)")
    assert page.text(".card .model") == joint
    lit = lambda: "lit" in card.get_attribute("class").split()
    size = lambda: inspect(page, "r.scene.joints[0].scale.x")
    (x, y, z), _ = arm_pose(page)
    at = inspect(page, f"r.project({[x, y, z]})")
    canvas = page.one("#robot canvas")
    hand = lambda: ActionChains(page.driver, duration=30)
    on_joint = lambda: hand().move_to_element_with_offset(canvas, round(at[0] * canvas.size["width"] / 2), round(-at[1] * canvas.size["height"] / 2))
    hand().move_to_element(page.one("h1")).perform()
    page.until(lambda: not lit() and size() == 1)
    hand().move_to_element(card).perform()
    page.until(lambda: lit() and size() > 1)
    on_joint().perform()
    page.until(lambda: lit() and size() > 1)
    assert joint in canvas.get_attribute("title")
    on_joint().click().perform()
    hand().move_to_element(page.one("h1")).perform()
    page.drawn()
    assert lit() and size() > 1, "a click keeps it"
    hand().move_to_element(page.one(".card h2")).click().perform()
    hand().move_to_element(page.one("h1")).perform()
    page.until(lambda: not lit() and size() == 1)
