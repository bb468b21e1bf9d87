"""The robot on the dashboard with lk-emu-body; LKEMU_BODY names the program."""

import io
import math
import os
import pathlib

import pytest
from bench import Bench
from dashboard import Page
from PIL import Image, ImageChops
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


def picture_of(page):
    page.run("document.dispatchEvent(new Event('theme'))")  # draws again
    page.drawn()
    return Image.open(io.BytesIO(page.one("#robot canvas").screenshot_as_png)).convert("RGB")


@pytest.mark.parametrize("robot", ROBOTS)
def test_robot_fits_its_panel(browser, robot):
    """Hiding the robot and its shadow shows which pixels it covers."""
    bench = Bench(BODY, [None], "--config", str(PENDULUM.with_name(f"{robot}.toml")))
    page = Page(browser, bench.http, (1920, 1080))
    try:
        page.until(lambda: page.all("#robot .robot-replay") and inspect(page, "r.frames[1]") > 3)
        page.one("#robot input[type=range]").send_keys(Keys.HOME)  # stands still
        page.until(lambda: inspect(page, "r.cursor") is not None)
        inspect(page, "(r.scene.world.sun.castShadow = false)")
        for size in [(1920, 1080), (1000, 500), (768, 1024), (390, 844)]:
            page.resize(size)
            whole = picture_of(page)
            inspect(page, "(r.scene.robot.visible = false)")
            without = picture_of(page)
            inspect(page, "(r.scene.robot.visible = true)")
            left, top, right, bottom = ImageChops.difference(whole, without).point(lambda value: 255 * (value > 24)).getbbox()
            assert min(left, top, whole.width - right, whole.height - bottom) > 2, f"{size}: it is cut off"
            assert max((right - left) / whole.width, (bottom - top) / whole.height) > 0.4, f"{size}: it is small"
        before = inspect(page, "r.camera")
        page.one("#robot canvas").send_keys("+")
        chosen = inspect(page, "r.camera")
        page.resize((1440, 900))
        page.drawn()
        assert inspect(page, "r.camera") == chosen != before, "a view of the user stays"
    finally:
        page.close()
        bench.close()


PYRAMID = """<mujoco><asset><mesh name="pyramid" vertex="-.2 -.2 0  .2 -.2 0  .2 .2 0  -.2 .2 0  0 0 .4"/></asset>
  <worldbody><body name="arm" pos="0 0 .5"><joint name="shoulder" axis="0 0 1"/>
  <geom type="mesh" mesh="pyramid" mass="1" rgba="1 0 1 1"/></body></worldbody></mujoco>"""


def test_mesh_is_drawn_by_its_triangles(browser, tmp_path):
    """A pyramid does not cover the upper corners of its box."""
    (tmp_path / "pyramid.xml").write_text(PYRAMID)
    config = tmp_path / "pyramid.toml"
    config.write_text(PENDULUM.read_text().replace('model = "pendulum"', 'model = "pyramid.xml"'))
    bench = Bench(BODY, [None], "--config", str(config))
    page = Page(browser, bench.http, (1024, 600))
    try:
        page.until(lambda: page.all("#robot .robot-replay") and inspect(page, "r.frames[1]") > 3)
        picture = picture_of(page)

        def is_magenta(*point):
            x, y, _ = inspect(page, f"r.project({list(point)})")
            red, green, blue = picture.getpixel((round((x + 1) / 2 * picture.width), round((1 - y) / 2 * picture.height)))
            return min(red, blue) > green + 40

        assert is_magenta(0, 0, 0.86) and is_magenta(0.17, 0.17, 0.51), "tip and foot"
        assert not is_magenta(0.19, 0.19, 0.88) and not is_magenta(-0.19, -0.19, 0.88), "corners of the box"
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


def test_slider_turns_the_joint_while_its_drive_is_off(page, bench):
    bench.position(1, 0, 300)
    page.click("#robot", "sliders")
    row, slider = page.one(".robot-joints div"), page.one(".robot-joints input")
    page.until(lambda: not slider.is_enabled())
    assert "drive 1 is on" in row.get_attribute("title")
    bench.ask(1, 0x80)  # off
    page.until(slider.is_enabled)
    assert row.get_attribute("title") == ""
    held = ActionChains(page.driver, duration=30).move_to_element(slider).click_and_hold().move_by_offset(round(slider.size["width"] / 4), 0)
    held.perform()
    wanted = float(slider.get_attribute("value"))
    assert wanted > 40
    shown = lambda: math.degrees(abs(tilt_angle(page)))
    page.until(lambda: abs(shown() - wanted) < 15)
    ActionChains(page.driver).release().perform()
    page.until(lambda: shown() < wanted - 30)  # it falls
    page.click("#robot", "sliders")
    assert page.all(".robot-joints") == []
    bench.ask(1, 0x88)  # on


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
