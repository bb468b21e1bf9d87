"""Pictures of the dashboard's pages. The clock is stepped, so each shows one instant, however slow the machine is."""

import hashlib
import io
import math
import time

import can
from bench import free_ports, position_command
from dashboard import Browser, Page
from PIL import Image
from selenium.webdriver.common.action_chains import ActionChains

import lkemu

SIZE = (1280, 720)
REPORT_SIZE = (1440, 1000)
PORT = 29536  # of the documents, since it is visible
PERIOD_S = 0.01
VIEWS = ("bus", "scope", "traffic", "bench")
# Elements of a view without their texts and values, each kind once; plots and drawings count as one element.
STRUCTURE = """
  const kinds = new Set();
  for (const node of document.querySelectorAll(`#view-${arguments[0]} *`)) {
    if (node.closest('.uplot, svg')?.contains(node.parentElement)) continue;
    kinds.add(`${node.parentElement.className}>${node.localName}#${node.id}.${node.getAttribute('class') ?? ''}`);
  }
  return [...kinds].sort().join('\\n');"""


class Robot:
    """Eight drives, their page, and a host that moves some of the drives: sines and steps."""

    def __init__(self, program, port=None):
        (http, free) = free_ports(2)
        self.emulator = lkemu.Emulator(bus=f"slcan-tcp:{port or free}", ids="1-8", program=program, clock="stepped",
                                       arguments=["--http", f"127.0.0.1:{http}", "--http-write"]).start()
        self.drives, self.clock = self.emulator.drives, self.emulator.clock
        self.bus = lkemu.SteppedBus(can.Bus(**self.emulator.can_args), self.clock)
        self.browser = Browser()
        self.page = Page(self.browser, http, SIZE)
        self.moving = ()
        self.run(0.1)

    def send(self, drive, data, wait_s=PERIOD_S):
        self.bus.send(can.Message(arbitration_id=0x140 + drive, data=data, is_extended_id=False))
        self.run(wait_s)

    def run(self, seconds):
        """Advances in real time at most, so that the page draws the way, too."""
        for _ in range(round(seconds / PERIOD_S)):
            began_s, now_s = time.monotonic(), self.clock.time_s
            for drive in self.moving:
                angle_deg = 90 * math.sin(now_s * (0.6 + 0.1 * drive)) if drive % 2 else math.copysign(60, math.sin(now_s * 1.5 + drive))
                self.send(drive, position_command(angle_deg, 3000), 0)
            self.clock.advance(PERIOD_S)
            while self.bus.recv(0):
                pass
            time.sleep(max(0, began_s + PERIOD_S - time.monotonic()))

    def reload(self, theme, language):
        self.page.run("localStorage.setItem('lk-emu-theme', arguments[0]); localStorage.setItem('lk-emu-lang', arguments[1])",
                      theme, language)
        self.page.driver.refresh()
        self.page.until(lambda: self.page.all(".card"))

    def picture(self):
        wait_for_status(self.page, self.clock.time_s)
        self.page.run("document.querySelector('.notes').replaceChildren()")
        return shot(self.page)

    def structures(self):
        """Returns {view: hash of its structure}."""
        found = {}
        for view in VIEWS:
            self.page.go(view)
            self.page.drawn()
            found[view] = hashlib.sha256(self.page.run(STRUCTURE, view).encode()).hexdigest()[:16]
        return found

    def close(self):
        self.browser.close()
        self.bus.shutdown()
        self.emulator.stop()


def wait_for_status(page, time_s):
    """Waits until the page shows the drives' state at this time."""
    page.until(lambda: abs(page.run("return import('/store.js').then(({store}) => store.status.clock.time_s)") - time_s) < PERIOD_S / 2)


def shot(page):
    page.drawn()
    picture = Image.open(io.BytesIO(page.driver.get_screenshot_as_png())).convert("RGB")
    return picture.quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)


def place_of(page, time_s):
    """Returns a place in the uppermost plot: element and offsets from its middle."""
    view = page.scope("s.view")
    over = page.one(".u-over")
    share = (time_s - view["from_s"]) / (view["to_s"] - view["from_s"])
    return over, int((share - 0.5) * over.size["width"]), 0


def put_cursor(page, time_s):
    """Clicks as a user does."""
    ActionChains(page.driver).move_to_element_with_offset(*place_of(page, time_s)).click().perform()


def step(robot):
    """Shows a step of drive 1, with cursors at its beginning and its peak."""
    page = robot.page
    page.go(f"scope?drive={robot.emulator.bus}/1")
    page.until(lambda: page.scope("s.captures.length > 0"))
    robot.moving = ()
    robot.send(1, bytes([0x31, 0, 250, 100, 50, 40, 50, 50]))  # 2.5 times the delivered gain makes a step overshoot
    robot.send(1, position_command(0, 0))
    robot.run(2)
    began_s = robot.clock.time_s
    robot.send(1, position_command(120, 0))
    robot.run(1)
    page.until(lambda: page.scope("s.captures[0].samples.last_s") > began_s + 0.9)
    peak_s = page.scope("""(() => {
      const {capture: {samples}, column} = s.traces.find((one) => one.signal === 'angle_deg');
      let peak = samples.begin;
      for (let n = samples.begin; n < samples.end; ++n) if (samples.values[column][n] > samples.values[column][peak]) peak = n;
      return samples.times[peak];
    })()""")
    page.click(".scope-controls", "Pause")
    hand = ActionChains(page.driver).move_to_element_with_offset(*place_of(page, began_s - 0.15)).click_and_hold()
    hand.move_to_element_with_offset(*place_of(page, began_s + 0.35)).release().perform()
    page.until(lambda: page.scope("s.view.to_s - s.view.from_s < 1"))
    put_cursor(page, began_s)
    put_cursor(page, peak_s)
    page.run("document.activeElement.blur()")


def pages(program):
    """Yields each page's name and picture."""
    robot = Robot(program, PORT)
    page = robot.page
    try:
        robot.reload("dark", "en")
        robot.drives[7].cut()
        robot.drives[4].temperature_stuck(value_C=140)
        robot.moving = (1, 2, 3, 4, 5, 6)
        robot.run(6)
        yield "bus", robot.picture()
        page.go("traffic")
        robot.run(1)
        robot.moving = ()
        for drive, command in [(1, 0x92), (2, 0x9C), (4, 0x9A), (1, 0x7E), (5, 0x9D), (4, 0x9C), (6, 0x30)]:
            robot.send(drive, bytes([command]).ljust(8, b"\0"))
        robot.send(3, b"\x9c")  # one byte causes advice
        yield "traffic", robot.picture()
        page.go("bench")
        page.for_drives(2)
        robot.run(0.5)
        yield "bench", robot.picture()
        step(robot)
        yield "scope", robot.picture()
        page.click(".scope-controls", "Resume")
        robot.moving = (1, 2, 3, 4, 5, 6)
        robot.reload("light", "zh")
        page.go("bus")
        robot.run(6)
        yield "bus-zh", robot.picture()
    finally:
        robot.close()


def report(page_file):
    """Returns a picture of a report."""
    browser = Browser()
    try:
        browser.command("Emulation.setDeviceMetricsOverride", width=REPORT_SIZE[0], height=REPORT_SIZE[1], deviceScaleFactor=1,
                        mobile=False)
        browser.command("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
        browser.driver.get(f"file://{page_file}")
        return Image.open(io.BytesIO(browser.driver.get_screenshot_as_png())).convert("RGB").quantize(256)
    finally:
        browser.close()
