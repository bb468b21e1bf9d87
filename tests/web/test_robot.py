"""The robot on the dashboard, with robot_stub.js instead of a program with a body, over the same interface. The
processor draws WebGL here, so the tests check pictures and their order, not speed."""

import io
import pathlib
import re

import pytest
from dashboard import Page
from PIL import Image
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

STUB = (pathlib.Path(__file__).resolve().parent / "robot_stub.js").read_text()
SIZE = (1024, 600)
NO_WEBGL = "HTMLCanvasElement.prototype.getContext = () => null;"


def stub(bench):
    """Returns a script for the page. The processor draws, so poses come less often than from a robot."""
    return f"window.robotBus = '{bench.bus}';" + STUB + "window.robot.rate_Hz = 10;"


class Robot:
    """A page with a robot."""

    def __init__(self, page):
        self.page = page

    def inspect(self, expression):
        return self.page.driver.execute_async_script(
            "const done = arguments[0]; import('/robot.js').then(({inspectRobot}) => {"
            f"const r = inspectRobot(); done({expression});}})")

    def stand(self, **how):
        """Sets the robot's state from the next pose on; waits until it is drawn."""
        self.page.driver.execute_async_script("""
          const [how, done] = arguments;
          Object.assign(window.robot, how);
          document.querySelector('#robot .robot-replay button:last-child').click();  // live
          import('/robot.js').then(({inspectRobot}) => {
            const frames = inspectRobot().frames[1];
            const watch = () => (inspectRobot().frames[1] > frames + 1 ? requestAnimationFrame(() => requestAnimationFrame(done)) : setTimeout(watch, 20));
            watch();
          });""", how)

    def picture(self):
        return Image.open(io.BytesIO(self.page.one("#robot canvas").screenshot_as_png)).convert("RGB")

    def place(self, point):
        """Returns the pixels of a world point in the picture."""
        x, y, _ = self.inspect(f"r.project({list(point)})")
        box = self.page.one("#robot canvas").size
        return (x + 1) / 2 * box["width"], (1 - y) / 2 * box["height"]

    def colour(self, point):
        return self.picture().getpixel(tuple(round(at) for at in self.place(point)))

    def hand(self, point):
        """Moves the mouse to a world point."""
        canvas = self.page.one("#robot canvas")
        x, y = self.place(point)
        return ActionChains(self.page.driver, duration=30).move_to_element_with_offset(
            canvas, round(x - canvas.size["width"] / 2), round(y - canvas.size["height"] / 2))

    def presses(self, *keys):
        self.page.one("#robot canvas").send_keys(*keys)


@pytest.fixture(scope="module")
def open_robot(bench, browser):
    page = Page(browser, bench.http, SIZE, before=stub(bench))
    page.until(lambda: page.all("#robot .robot-replay"))
    yield Robot(page)
    page.close()


@pytest.fixture
def robot(open_robot):
    """The robot in its home pose and view."""
    open_robot.page.run("location.hash = '#bus'; document.querySelector('#robot .row button:last-child').click()")  # reset view
    open_robot.stand(height_m=0.5, forward_m=0, swing=0, contacts=True)
    yield open_robot
    assert open_robot.page.complaints() == []


def test_cards_beside_the_robot_keep_their_texts(robot):
    assert robot.page.run("""return [...document.querySelectorAll('.card')].filter((card) => card.scrollWidth > card.clientWidth
      || card.getBoundingClientRect().right > innerWidth).length""") == 0


TRUNK = (0, 0, 0.55)  # on the upper side of the magenta box
BEHIND = (0, 1, 0.05)  # in the blue cylinder, which stands on the ground 1 m to the left


def is_magenta(colour):
    return colour[0] > 90 and colour[2] > 90 and colour[1] < min(colour[0], colour[2]) / 3


def is_blue(colour):
    return colour[2] > 60 and max(colour[:2]) < colour[2] / 3


def test_robot_is_drawn_at_its_position(robot):
    assert is_magenta(robot.colour(TRUNK))
    assert is_blue(robot.colour(BEHIND))
    # Next to it are only the board's two colours.
    assert not is_magenta(robot.colour((0, -0.5, 0))) and not is_blue(robot.colour((0, -0.5, 0)))


def test_floor_step_appears_and_disappears(robot):
    def is_yellow():
        red, green, blue = robot.colour((0.55, 0, 0.1))
        return min(red, green) > 60 and blue < min(red, green) / 3

    assert not is_yellow()
    robot.stand(step_m=0.1, shape_changes=1)
    robot.page.until(is_yellow)
    robot.stand(step_m=0, shape_changes=2)
    robot.page.until(lambda: not is_yellow())
    assert is_magenta(robot.colour(TRUNK)) and is_blue(robot.colour(BEHIND)), "all else stays"


def test_robot_follows_its_poses_and_the_camera_follows_it(robot):
    robot.stand(height_m=1.1)
    before = robot.inspect("r.camera")
    assert is_magenta(robot.colour((0, 0, 1.15)))
    robot.stand(height_m=1.1, forward_m=2)
    after = robot.inspect("r.camera")
    assert [a - b for a, b in zip(after, before)] == pytest.approx([2, 0, 0], abs=1e-4)
    assert is_magenta(robot.colour((2, 0, 1.15)))


def test_nearer_objects_hide_farther_ones(robot):
    """Level view from the right: the trunk at y = 0 hides the cylinder at y = 1; from the left it is behind it."""
    robot.stand(height_m=0.12)
    # The home view is 60 degrees to the right of ahead and 15 degrees up.
    step = 24  # key presses for half a turn, 7.5 degrees each
    robot.presses(Keys.ARROW_DOWN, *[Keys.ARROW_LEFT] * 4)
    robot.page.drawn()
    x, y, _ = robot.inspect("r.camera")
    assert x == pytest.approx(0, abs=0.1) and y < -0.5
    assert is_magenta(robot.colour((0.06, 0.93, 0.06))), "the trunk before the cylinder"
    robot.presses(*[Keys.ARROW_LEFT] * step)
    robot.page.drawn()
    assert robot.inspect("r.camera")[1] > 0.5
    assert is_blue(robot.colour((0.06, 1, 0.05))), "nothing before the cylinder"


def test_contact_arrows_are_proportional_to_forces(robot):
    """49 N of 98 N of weight gives half of 0.6 of the robot's reach, some 0.16 m; its colour is --zero, a blue."""
    def bluest(height):
        """Returns the bluest pixel near a point above the contact: an arrow is a few pixels wide."""
        picture = robot.picture()
        x, y = robot.place((0, -0.3, height))
        return max(blue - red for shift in range(-3, 4) for red, _, blue in [picture.getpixel((round(x) + shift, round(y)))])

    assert bluest(0.06) > 40 > bluest(0.4)
    robot.page.click("#robot", "contacts")
    robot.page.until(lambda: bluest(0.06) < 40)
    robot.page.click("#robot", "contacts")
    robot.page.until(lambda: bluest(0.06) > 40)


def test_joints_are_coloured_by_the_chosen_quantity(robot, bench):
    """The joint of drive 2 is at the right hip, in front of the leg in the home view."""
    hip = (0, -0.15 - 0.02, 0.5)

    def greenish():
        red, green, _ = robot.colour(hip)
        return green > red

    robot.page.click("#robot", "errors")
    robot.page.until(greenish)
    robot.page.run("""return fetch('/api/v1/directives', {method: 'POST', headers: {'Content-Type': 'application/json'},
                      body: '{"id": 2, "power": "off"}'})""")
    robot.page.until(lambda: robot.colour(hip)[0] > robot.colour(hip)[1] + 60)  # red: without power
    robot.page.run("""return fetch('/api/v1/directives', {method: 'POST', headers: {'Content-Type': 'application/json'},
                      body: '{"id": 2, "power": "on"}'})""")
    robot.page.until(greenish)
    robot.page.click("#robot", "temperature")
    robot.page.until(lambda: "100 °C" in robot.page.text(".robot-legend"))  # threshold of the motor's protection
    robot.page.click("#robot", "current")
    robot.page.until(lambda: " A" in robot.page.text(".robot-legend"))


def test_mouse_and_keys_turn_move_and_zoom_the_view(robot):
    home = robot.inspect("r.camera")
    far = robot.inspect("Math.hypot(...r.camera)")

    def back():
        robot.page.click("#robot", "reset view")
        return robot.inspect("r.camera") == pytest.approx(home, abs=1e-6)

    canvas = robot.page.one("#robot canvas")
    beside = ActionChains(robot.page.driver, duration=30).move_to_element_with_offset(
        canvas, -round(canvas.size["width"] * 0.4), -round(canvas.size["height"] * 0.3))
    beside.click_and_hold().move_by_offset(60, 0).release().perform()
    turned = robot.inspect("r.camera")
    assert turned[2] == pytest.approx(home[2], abs=1e-6) and turned[0] != pytest.approx(home[0], abs=0.05)
    assert back()
    robot.presses("+")
    assert robot.inspect("Math.hypot(...r.camera)") < far
    assert back()
    robot.presses(Keys.ARROW_UP)
    assert robot.inspect("r.camera")[2] > home[2]
    robot.presses("0")
    assert robot.inspect("r.camera") == pytest.approx(home, abs=1e-6)
    robot.presses(Keys.SHIFT + Keys.ARROW_RIGHT + Keys.NULL)
    assert robot.inspect("r.camera")[2] == pytest.approx(home[2], abs=1e-6) and not robot.inspect("r.camera") == pytest.approx(home, abs=1e-3)
    assert back()


def test_drag_at_the_robot_pushes_it_until_released(robot):
    robot.page.run("window.pushes.length = 0")
    home = robot.inspect("r.camera")
    robot.hand(TRUNK).click_and_hold().move_by_offset(0, -80).perform()
    robot.page.until(lambda: robot.page.run("return window.pushes.length") > 3)
    push = robot.page.run("return window.pushes.at(-1)")
    assert push["body"] == "trunk" and 0 < push["for_s"] <= 0.5
    force = push["force_N"]
    assert force[2] > 5 and abs(force[2]) > max(abs(force[0]), abs(force[1])) / 2, "upwards, as it was drawn"
    # The hand holds the upper side, 0.05 m above the centre of mass: torque = lever x force.
    lever_z = 0.05
    assert push["torque_Nm"][0] == pytest.approx(-lever_z * force[1], abs=0.15 * max(map(abs, force)))
    ActionChains(robot.page.driver, duration=30).release().perform()
    robot.page.drawn()
    count = robot.page.run("return window.pushes.length")
    robot.stand()
    assert robot.page.run("return window.pushes.length") <= count + 1, "one may have been on its way"
    assert robot.inspect("r.camera") == pytest.approx(home, abs=1e-6), "the view stays"


def test_last_minute_can_be_replayed(robot):
    robot.stand(height_m=0.5)
    robot.stand(height_m=1.1)
    robot.page.until(lambda: robot.inspect("r.frames[1] - r.frames[0]") > 60)
    before = robot.inspect("r.record.frame(r.frames[1] - 1).time_s")
    slider = robot.page.one("#robot input[type=range]")
    slider.send_keys(Keys.HOME)
    robot.page.until(lambda: robot.inspect("r.cursor") is not None)
    held = robot.inspect("r.time_s")
    assert held < before
    robot.page.until(lambda: robot.inspect("r.record.frame(r.frames[1] - 1).time_s") > before)  # recording continues
    assert robot.inspect("r.time_s") == held, "it stands still"
    first = robot.inspect("r.record.frame(r.cursor).poses[2]")
    assert first == pytest.approx(0.5, abs=0.7)
    robot.page.click("#robot", "play from here, or from the beginning")
    robot.page.until(lambda: robot.inspect("r.time_s") > held + 0.1)
    robot.page.click("#robot", "live")
    robot.page.until(lambda: is_magenta(robot.colour((0, 0, 1.15))))


def test_record_keeps_one_minute_in_order(robot):
    """Tests the module alone: old frames are dropped, the others keep their order."""
    seen = robot.page.driver.execute_async_script("""
      const done = arguments[0];
      import('/robot_record.js').then(({RobotRecord}) => {
        const record = new RobotRecord(1, 1, 3);
        const add = (n) => record.add({time_s: n / 60, poses: [[n, 0, 0, 1, 0, 0, 0]], contacts: Array.from({length: n % 40}, () => [n, 0, 0, 0, 0, 1])}, [n, 0, 0]);
        for (let n = 0; n < 4000; ++n) add(n);
        const of = (number) => { const one = record.frame(number); return [one.time_s * 60, one.poses[0], one.joints[0], one.contacts.length / 6]; };
        const seen = [record.begin, record.end, of(0), of(399), of(3999), of(9999)];
        record.add({time_s: 0, poses: [[7, 0, 0, 1, 0, 0, 0]], contacts: []}, [0, 0, 0]);
        done([...seen, record.end - record.begin, record.frame(0).poses[0]]);
      });""")
    begin, end, oldest, first, last, beyond, left, pose = seen
    assert (begin, end) == (400, 4000)
    assert oldest == pytest.approx([400, 400, 400, 0])  # 400 % 40
    assert first == pytest.approx([400, 400, 400, 0])
    assert last == beyond == pytest.approx([3999, 3999, 3999, 32])  # 39 contacts, of which 32 are kept
    assert (left, pose) == (1, 7), "time has gone back: what was is forgotten"


def test_hidden_view_receives_and_draws_nothing(robot):
    opened, closed = robot.page.run("return [window.robot.opened, window.robot.closed]")
    robot.page.go("bench")
    robot.page.until(lambda: robot.page.run("return window.robot.closed") == closed + 1)
    drawn = robot.inspect("r.drawn")
    assert robot.page.draws() == [1] * 20, "the shaft of the bench alone"
    assert robot.inspect("r.drawn") == drawn and robot.inspect("r.streams") == 0
    robot.page.go("bus")
    robot.page.until(lambda: robot.page.run("return window.robot.opened") == opened + 1)
    robot.page.until(lambda: robot.inspect("r.drawn") > drawn)


def test_hidden_tab_receives_no_poses(robot):
    closed = robot.page.run("return window.robot.closed")
    robot.page.run("""Object.defineProperty(document, 'hidden', {value: true, configurable: true});
                      document.dispatchEvent(new Event('visibilitychange'))""")
    assert robot.page.run("return window.robot.closed") == closed + 1
    robot.page.drawn()
    drawn = robot.inspect("r.drawn")
    robot.page.draws()
    assert robot.inspect("r.drawn") == drawn
    robot.page.run("delete document.hidden; document.dispatchEvent(new Event('visibilitychange'))")
    robot.page.until(lambda: robot.inspect("r.drawn") > drawn)


def test_still_robot_is_not_redrawn(robot):
    robot.page.one("#robot input[type=range]").send_keys(Keys.HOME)
    robot.page.until(lambda: robot.inspect("r.cursor") is not None)
    robot.page.drawn()
    drawn = robot.inspect("r.drawn")
    robot.page.draws()
    assert robot.inspect("r.drawn") == drawn


def test_robot_uses_the_colours_of_the_theme(robot):
    def background():
        return robot.picture().getpixel((10, 10))

    before = background()
    robot.page.one("#theme").click()
    robot.page.until(lambda: abs(sum(background()) - sum(before)) > 300)  # of 765: dark or light
    robot.page.one("#theme").click()
    robot.page.until(lambda: background() == before)


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_sky_and_floor_differ(robot, theme):
    robot.page.run("if (document.documentElement.dataset.theme !== arguments[0]) document.querySelector('#theme').click()", theme)
    robot.stand()
    picture = robot.picture()
    column = [picture.getpixel((5, y)) for y in range(picture.height - 30)]
    sky, floor = column[3], column[-60:]

    def apart(one, other):
        return max(abs(a - b) for a, b in zip(one, other))

    assert all(apart(sky, colour) > 15 for colour in floor)
    x, _ = robot.place((0, 0, 0))
    row = [picture.getpixel((round(x), y)) for y in range(picture.height // 2, picture.height)]
    assert any(apart(one, other) > 8 for one in row for other in row[:1]), "the floor has fields"
    robot.page.run("if (document.documentElement.dataset.theme === 'light') document.querySelector('#theme').click()")


def test_robot_throws_a_shadow_on_the_floor(robot):
    """The sun is in the direction (-2, -3, 5). A trunk at 0.5 m darkens the floor 0.2 m ahead and 0.3 m to the left."""
    robot.stand(contacts=False)
    shadowed = sum(robot.colour((0.2, 0.3, 0)))
    robot.stand(forward_m=0.6)
    assert shadowed < 0.85 * sum(robot.colour((0.2, 0.3, 0)))


def test_trail_follows_the_clicked_point(robot):
    def is_teal(point):
        red, green, blue = robot.colour(point)
        return min(green, blue) > red + 30

    robot.stand()
    robot.hand(TRUNK).click().perform()
    robot.stand(forward_m=1)
    middle = (0.5, 0, TRUNK[2])
    assert is_teal(middle)
    robot.page.until(lambda: "trail=0," in robot.page.run("return decodeURIComponent(location.hash)"))
    robot.page.click("#robot", "trail")
    robot.stand(forward_m=1)
    assert not is_teal(middle)


def test_program_without_a_body_loads_no_panel_and_no_three_js(page):
    page.go("bus")
    assert page.all("#robot") == []
    names = page.run("return performance.getEntriesByType('resource').map((one) => one.name)")
    assert not [name for name in names if "three" in name]


def test_missing_webgl_shows_one_line(bench, browser):
    page = Page(browser, bench.http, before=stub(bench) + NO_WEBGL)
    try:
        page.until(lambda: "no WebGL" in page.text("#robot"))
        assert len(page.all(".card")) == 4
        assert page.run("return window.robot.opened") == 0
    finally:
        page.close()


def test_robot_panel_is_chinese_on_a_chinese_page(bench, browser):
    page = Page(browser, bench.http, SIZE, query="?lang=zh", before=stub(bench))
    page.until(lambda: page.all("#robot .robot-replay"))
    page.until(lambda: "电流" in page.one("#robot").text)
    assert set(re.findall(r"[A-Za-z]{2,}", page.one("#robot").text)) <= {"Shift"}
    page.close()
