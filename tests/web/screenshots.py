"""Makes the pictures of docs/guides/dashboard.md and README.md: python3 screenshots.py LK-EMU [DIRECTORY]

Needs python3-pil to shrink them, and a font with Chinese characters (fonts-wqy-microhei)."""

import io
import pathlib
import sys

from bench import Bench
from dashboard import Browser, Page, nap
from PIL import Image
from selenium.webdriver.common.action_chains import ActionChains

SIZE = (1280, 720)
PICTURES = pathlib.Path(__file__).resolve().parents[2] / "docs" / "pictures"


def reload(page, theme, language):
    page.run("localStorage.setItem('lk-emu-theme', arguments[0]); localStorage.setItem('lk-emu-lang', arguments[1])",
             theme, language)
    page.driver.refresh()
    page.until(lambda: page.all(".card"))


def inject_fault(page, drive, kind, **parameters):
    page.go("bench")
    page.for_drives(drive)
    page.choose("#fault-kind", kind)
    for key, value in parameters.items():
        page.fill(f'#fault-parameters [data-key="{key}"]', value)
    page.click("#view-bench", "Inject")


def place_of(page, time_s):
    """Returns a place in the uppermost plot: element and offsets from its middle."""
    view = page.scope("s.view")
    over = page.one(".u-over")
    share = (time_s - view["from_s"]) / (view["to_s"] - view["from_s"])
    return over, int((share - 0.5) * over.size["width"]), 0


def put_cursor(page, time_s):
    """Clicks as a user does."""
    ActionChains(page.driver).move_to_element_with_offset(*place_of(page, time_s)).click().perform()


def step(page, bench):
    """Makes a step of drive 1, with cursors at its beginning and its peak."""
    bench.move()
    bench.angle_gain(1, 250)
    bench.position(1, 0)
    page.until(lambda: abs(bench.angle_deg(1)) < 0.2)
    page.go(f"scope?drive={bench.bus}/1")
    page.choose('[aria-label="seconds in view"]', "10")
    page.until(lambda: page.scope("s.captures[0].samples.length > 1500"))
    last_s = "s.captures[0].samples.last_s"
    before = page.scope(last_s)
    bench.position(1, 120)
    page.until(lambda: page.scope(last_s) > before + 2)  # simulated time, which may be slow
    began, peak = page.scope("""(() => {
      const {capture, column} = s.traces.find((one) => one.signal === 'angle_deg');
      const ref = s.traces.find((one) => one.signal === 'angle_ref_deg').column;
      const {samples} = capture;
      let began = samples.end - 1;  // the last step is the one
      while (began > samples.begin && Math.abs(samples.values[ref][began] - samples.values[ref][began - 1]) < 50) --began;
      let peak = began;
      for (let n = began; samples.times[n] < samples.times[began] + 0.4; ++n) {
        if (samples.values[column][n] > samples.values[column][peak]) peak = n;
      }
      return [samples.times[began], samples.times[peak]];
    })()""")
    page.click(".scope-controls", "Pause")
    place = place_of(page, began - 0.15)
    hand = ActionChains(page.driver).move_to_element_with_offset(*place).click_and_hold()
    hand.move_to_element_with_offset(*place_of(page, began + 0.35)).release().perform()
    page.until(lambda: page.scope("s.view.to_s - s.view.from_s < 1"))
    put_cursor(page, began)
    put_cursor(page, peak)
    page.run("document.activeElement.blur()")


def main():
    program = sys.argv[1]
    directory = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else PICTURES
    directory.mkdir(parents=True, exist_ok=True)
    bench = Bench(program, ["1-8"], "--http-write", ports=[29536])  # the port of the documents, since it is visible
    browser = Browser()
    page = Page(browser, bench.http, SIZE)

    def shoot(name):
        nap(1)  # so that numbers and plots are current
        page.run("document.querySelector('.notes').replaceChildren()")
        picture = Image.open(io.BytesIO(page.driver.get_screenshot_as_png())).convert("RGB")
        picture.quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE).save(directory / f"{name}.png", optimize=True)

    try:
        reload(page, "dark", "en")
        inject_fault(page, 7, "cut")
        inject_fault(page, 4, "temperature_stuck", value_C=140)
        bench.move(1, 2, 3, 4, 5, 6)
        nap(3)
        page.go("bus")
        shoot("bus")
        page.go("traffic")
        nap(1)
        bench.move()
        for drive, command in [(1, 0x92), (2, 0x9C), (4, 0x9A), (1, 0x7E), (5, 0x9D), (4, 0x9C), (6, 0x30)]:
            bench.ask(drive, command)
        bench.send(0x143, b"\x9c")  # one byte causes advice
        nap(1)
        page.click("#view-traffic", "Pause")
        shoot("traffic")
        page.go("bench")
        page.for_drives(2)
        shoot("bench")
        step(page, bench)
        shoot("scope")
        bench.move(1, 2, 3, 4, 5, 6)
        reload(page, "light", "zh")
        page.go("bus")
        nap(2)
        shoot("bus-zh")
    finally:
        browser.close()
        bench.close()


if __name__ == "__main__":
    main()
