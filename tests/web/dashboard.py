"""The dashboard in a browser."""

import json
import math
import time

from selenium import webdriver
from selenium.common.exceptions import NoSuchElementException, StaleElementReferenceException
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import Select, WebDriverWait

PATIENCE_S = 40  # for a busy machine; only failing tests wait this long


class Browser:
    """Chromium, with one page at a time."""

    def __init__(self):
        options = webdriver.ChromeOptions()
        options.binary_location = "/usr/bin/chromium"
        for word in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars", "--lang=en",
                     "--disable-features=BackForwardCache"):
            options.add_argument(word)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.driver = webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)
        self.driver.set_script_timeout(PATIENCE_S)
        self.page = None

    def leave(self):
        """Closes the current page, with its storage and the browser's messages about it."""
        if self.page is None:
            return
        self.driver.get("about:blank")
        self.command("Storage.clearDataForOrigin", origin=self.page.origin, storageTypes="local_storage")
        if self.page.script:
            self.command("Page.removeScriptToEvaluateOnNewDocument", identifier=self.page.script)
        self.driver.get_log("browser")
        self.page = None

    def command(self, name, **parameters):
        return self.driver.execute_cdp_cmd(name, parameters)

    def close(self):
        self.driver.quit()


class Page:
    """The page as users see and click it."""

    def __init__(self, browser, port, size=(1440, 900), query="", before=""):
        """`before` is a script that runs before the page's own."""
        self.browser = browser
        self.origin = f"http://127.0.0.1:{port}"
        self.address = f"{self.origin}/{query}"
        self.size = size
        self.before = before
        self.open()

    @property
    def driver(self):
        assert self.browser.page is self, "the browser shows another page"
        return self.browser.driver

    def is_open(self):
        return self.browser.page is self

    def open(self):
        """Loads the page again in place of the current one."""
        self.browser.leave()
        self.browser.page = self
        self.resize(self.size)
        self.script = None
        if self.before:
            self.script = self.browser.command("Page.addScriptToEvaluateOnNewDocument", source=self.before)["identifier"]
        self.driver.get(self.address)
        self.until(lambda: self.all(".card"))

    def close(self):
        if self.is_open():
            self.browser.leave()

    def resize(self, size):
        """Sets the size of the page, not that of the window with its frame."""
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {
            "width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False})

    def be_at_rest(self):
        """Resets the state that a failed test may leave: filters of the traffic view, a paused scope."""
        self.run("""
          const traffic = document.querySelector('#view-traffic');
          for (const field of traffic.querySelectorAll('input')) {
            if (field.type === 'checkbox') {
              if (field.checked) field.click();
            } else if (field.value) {
              field.value = '';
              field.dispatchEvent(new Event('input'));
            }
          }
          for (const pressed of document.querySelectorAll('#view-traffic [aria-pressed=true], .scope-controls .main[aria-pressed=true]')) pressed.click();
          document.querySelector('.notes').replaceChildren();""")

    def until(self, holds):
        """Waits until `holds`; retries while elements are missing or being replaced."""
        missing = (NoSuchElementException, StaleElementReferenceException)
        return WebDriverWait(self.driver, PATIENCE_S, 0.05, missing).until(lambda _: holds())

    def drawn(self):
        """Waits until the page is laid out and its size observers have run."""
        self.driver.execute_async_script(
            "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def draws(self, frames=20):
        """Returns how many draws the page requests in each of `frames` animation frames."""
        return self.driver.execute_async_script("""
          const [frames, done] = arguments;
          const plain = window.requestAnimationFrame;
          const counts = new Map();
          window.requestAnimationFrame = (draw) => plain((at) => {
            counts.set(at, (counts.get(at) ?? 0) + 1);
            draw(at);
          });
          const watch = () => {
            if (counts.size <= frames) return plain(watch);
            window.requestAnimationFrame = plain;
            done([...counts.values()].slice(0, frames));  // the last frame may not be over
          };
          plain(watch);""", frames)

    def go(self, view):
        self.run("location.hash = arguments[0]", f"#{view}")
        self.until(lambda: self.one(f"#view-{view.split('?')[0]}").is_displayed())

    def one(self, css):
        return self.driver.find_element(By.CSS_SELECTOR, css)

    def all(self, css):
        return self.driver.find_elements(By.CSS_SELECTOR, css)

    def run(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def text(self, css):
        return self.run("return document.querySelector(arguments[0])?.textContent ?? ''", css)

    def button(self, within, name):
        """Returns a button by its text or its label for screen readers."""
        found = [b for b in self.all(f"{within} button")
                 if name in (b.text, b.get_attribute("aria-label"))]
        if not found:
            raise NoSuchElementException(f"no button {name} in {within}")
        return found[0]

    def click(self, within, name):
        button = self.button(within, name)
        self.run("arguments[0].scrollIntoView({block: 'center'})", button)
        button.click()

    def mouse(self, what, element, shift_px=0, count=1):
        """Sends Pressed, Released or Moved at or beside the middle of `element`; pauses in between are possible."""
        box = self.run("return arguments[0].getBoundingClientRect().toJSON()", element)
        self.driver.execute_cdp_cmd("Input.dispatchMouseEvent", {
            "type": f"mouse{what}", "x": box["x"] + box["width"] / 2 + shift_px, "y": box["y"] + box["height"] / 2,
            "button": "none" if what == "Moved" else "left", "buttons": int(what == "Pressed"), "clickCount": count})

    def choose(self, css, value):
        Select(self.one(css)).select_by_value(value)

    def fill(self, css, value):
        field = self.one(css)
        field.clear()
        field.send_keys(str(value))

    def for_drives(self, *drives):
        """Selects these drives for the bench."""
        self.for_drives_in("none", *(f"drive {drive}" for drive in drives))

    def for_drives_in(self, *names):
        """Clicks buttons by name, in the language of the page."""
        for name in names:
            self.click("#view-bench", name)

    def field(self, drive, name):
        """Returns a number of a drive's card; NaN if there is none yet."""
        number = self.run("""
          for (const row of document.querySelectorAll(`[data-drive$="/${arguments[0]}"] .fields div`)) {
            if (row.querySelector('dt').textContent === arguments[1]) {
              return Number(row.querySelector('dd').textContent.replace('\\u2212', '-'));
            }
          }""", drive, name)
        return math.nan if number is None else number

    def dial_deg(self, drive, part="shaft"):
        """Returns the angle of a part of the dial; NaN before it is drawn."""
        turn = self.run("""return document.querySelector(
          `[data-drive$="/${arguments[0]}"] .dial .${arguments[1]}`).style.transform""", drive, part)
        return float(turn[len("rotate("):-len("deg)")]) if turn else math.nan

    def reported(self, drive):
        """Returns a drive of the first bus, as the control interface reports it."""
        return self.run("""return fetch('/api/v1/drives').then((answer) => answer.json())
          .then(([{bus}]) => fetch(`/api/v1/drives/${encodeURIComponent(bus)}/${arguments[0]}`)).then((answer) => answer.json())""", drive)

    def state(self, drive):
        return self.text(f'[data-drive$="/{drive}"] .chip')

    def errors(self, drive):
        return self.text(f'[data-drive$="/{drive}"] .errors')

    def scope(self, expression):
        """Evaluates an expression on the scope's state; `s` is its inspect()."""
        return self.driver.execute_async_script(
            "const done = arguments[0]; import('/scope.js').then(({inspect}) => {"
            f"const s = inspect(); done({expression});}})")

    def heap_bytes(self):
        self.driver.execute_cdp_cmd("HeapProfiler.collectGarbage", {})
        self.driver.execute_cdp_cmd("Performance.enable", {})
        metrics = self.driver.execute_cdp_cmd("Performance.getMetrics", {})["metrics"]
        return {one["name"]: one["value"] for one in metrics}

    def complaints(self):
        """Returns the browser's errors for the page."""
        return [entry["message"] for entry in self.driver.get_log("browser")
                if entry["level"] == "SEVERE"]

    def requested_hosts(self):
        names = json.loads(self.run(
            "return JSON.stringify(performance.getEntriesByType('resource').map((e) => e.name))"))
        return {name.split("/")[2] for name in names if "//" in name}


def settle(page, holds):
    """Waits until `holds`."""
    page.until(holds)


def nap(seconds):
    """Sleeps, for tests that measure time."""
    time.sleep(seconds)
