"""A dashboard in a browser, the emulator that it belongs to, and a host on the same bus."""

import contextlib
import json
import math
import pathlib
import socket
import struct
import subprocess
import sys
import time

from selenium import webdriver
from selenium.common.exceptions import NoSuchElementException, StaleElementReferenceException
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import Select, WebDriverWait

HERE = pathlib.Path(__file__).resolve().parent
WITH_VCAN = HERE.parents[1] / "scripts" / "with-vcan"
PATIENCE_S = 40  # of a machine that may be busy; nothing passes by waiting


def free_ports(count):
    with contextlib.ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(count)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]


class Bench:
    """lk-emu inside with-vcan, reachable from here; without `ids` the options say which drives there are."""

    def __init__(self, program, ids, *options):
        self.http, self.host = free_ports(2)
        self.process = subprocess.Popen(
            [str(WITH_VCAN), "--forward", str(self.http), "--forward", str(self.host),
             "/usr/bin/python3", str(HERE / "guest.py"), str(self.host), program,
             *(["--bus", "vcan0", "--ids", ids] if ids else []), "--rom", ":memory:", "--control", "none",
             "--http", f"127.0.0.1:{self.http}", *options], stdout=subprocess.PIPE)
        if not self.process.stdout.readline().startswith(b"lk-emu ready"):
            raise RuntimeError("lk-emu did not start")
        self.connection = socket.create_connection(("127.0.0.1", self.host))
        self.lines = self.connection.makefile("rw", newline="\n")

    def tell(self, line):
        self.lines.write(line + "\n")
        self.lines.flush()
        return self.lines.readline().strip()

    def ask(self, drive, *data):
        """DATA[0..7] of the reply; None: there is none."""
        answer = self.tell(f"{0x140 + drive:03X}#{bytes(data).ljust(8, bytes(1)).hex()}")
        return None if answer == "none" else bytes.fromhex(answer.split("#")[1])

    def read(self, drive, command):
        """Of a drive that answers, though perhaps late on a busy machine."""
        for _ in range(10):
            if data := self.ask(drive, command):
                return data
        raise AssertionError(f"drive {drive} does not answer {command:02X}")

    def position(self, drive, angle_deg, max_speed_dps=0):
        return self.ask(drive, *struct.pack("<BxHi", 0xA4, max_speed_dps, round(angle_deg * 100)))

    def angle_gain(self, drive, kp):
        """0x31, the other gains as delivered: twice and a half of this one, 100, makes a step overshoot."""
        return self.ask(drive, 0x31, 0, kp, 100, 50, 40, 50, 50)

    def angle_deg(self, drive):
        """0x92: 56 bits, signed, 0.01 degrees."""
        data = self.read(drive, 0x92)
        return int.from_bytes(data[1:8], "little", signed=True) / 100

    def voltage_V(self, drive):
        """0x9A of the oldest generation: DATA[3..4], 0.1 V."""
        return int.from_bytes(self.read(drive, 0x9A)[3:5], "little") / 10

    def close(self):
        self.connection.close()
        self.process.terminate()
        self.process.wait()


class Page:
    """What a person sees and clicks."""

    def __init__(self, port, size=(1440, 900), query="", before=""):
        """`before` is a script that the page finds done."""
        options = webdriver.ChromeOptions()
        options.binary_location = "/usr/bin/chromium"
        for word in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
                     "--hide-scrollbars", "--lang=en", "--window-size=%d,%d" % size):
            options.add_argument(word)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.driver = webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)
        self.driver.set_script_timeout(PATIENCE_S)
        self.resize(size)
        if before:
            self.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": before})
        self.address = f"http://127.0.0.1:{port}/{query}"
        self.driver.get(self.address)
        self.until(lambda: self.all(".card"))

    def close(self):
        self.driver.quit()

    def resize(self, size):
        """The window's frame would take its share."""
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {
            "width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False})

    def be_at_rest(self):
        """What a failed test left: a traffic view that filters, a scope that stands."""
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
        """What is not there yet, or is just being replaced, is looked for again."""
        missing = (NoSuchElementException, StaleElementReferenceException)
        return WebDriverWait(self.driver, PATIENCE_S, 0.1, missing).until(lambda _: holds())

    def drawn(self):
        """The page has been laid out, and what watches its sizes has followed."""
        self.driver.execute_async_script(
            "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def draws(self, frames=20):
        """How many drawings the page asks for in each of so many animation frames."""
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
        """By what is on it, or by what a screen reader calls it."""
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
        """Pressed, Released or Moved at the middle of `element`, or beside it: a hand that may rest meanwhile."""
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
        """The bench acts on these."""
        self.for_drives_in("none", *(f"drive {drive}" for drive in drives))

    def for_drives_in(self, *names):
        """Of buttons, in the language of the page."""
        for name in names:
            self.click("#view-bench", name)

    def field(self, drive, name):
        """A number of a drive's card; NaN before there is one."""
        number = self.run("""
          for (const row of document.querySelectorAll(`[data-drive="${arguments[0]}"] .fields div`)) {
            if (row.querySelector('dt').textContent === arguments[1]) {
              return Number(row.querySelector('dd').textContent.replace('\\u2212', '-'));
            }
          }""", f"vcan0/{drive}", name)
        return math.nan if number is None else number

    def dial_deg(self, drive, part="shaft"):
        """NaN before it is drawn for the first time."""
        turn = self.run("""return document.querySelector(
          `[data-drive="${arguments[0]}"] .dial .${arguments[1]}`).style.transform""", f"vcan0/{drive}", part)
        return float(turn[len("rotate("):-len("deg)")]) if turn else math.nan

    def state(self, drive):
        return self.text(f'[data-drive="vcan0/{drive}"] .chip')

    def errors(self, drive):
        return self.text(f'[data-drive="vcan0/{drive}"] .errors')

    def scope(self, expression):
        """Of what the scope keeps; `s` is its inspect()."""
        return self.driver.execute_async_script(
            "const done = arguments[0]; import('/scope.js').then(({inspect}) => {"
            f"const s = inspect(); done({expression});}})")

    def heap_bytes(self):
        self.driver.execute_cdp_cmd("HeapProfiler.collectGarbage", {})
        self.driver.execute_cdp_cmd("Performance.enable", {})
        metrics = self.driver.execute_cdp_cmd("Performance.getMetrics", {})["metrics"]
        return {one["name"]: one["value"] for one in metrics}

    def complaints(self):
        """What the browser found wrong with the page."""
        return [entry["message"] for entry in self.driver.get_log("browser")
                if entry["level"] == "SEVERE"]

    def requested_hosts(self):
        names = json.loads(self.run(
            "return JSON.stringify(performance.getEntriesByType('resource').map((e) => e.name))"))
        return {name.split("/")[2] for name in names if "//" in name}


def settle(page, holds):
    """The page, or the drive, gets there."""
    page.until(holds)


def nap(seconds):
    """Time that has to go by, where it is time that is measured."""
    time.sleep(seconds)
