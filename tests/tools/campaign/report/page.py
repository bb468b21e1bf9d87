"""The page of an answer in a browser.

By hand, pictures of it: PLANTED_REPORT=… python3 page.py DIRECTORY, with the pages in it."""

import json
import pathlib
import sys

from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import Select


class Page:
    def __init__(self, size=(1200, 900)):
        options = webdriver.ChromeOptions()
        options.binary_location = "/usr/bin/chromium"
        for word in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars", "--lang=en"):
            options.add_argument(word)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver = webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)
        self.resize(*size)

    def close(self):
        self.driver.quit()

    def resize(self, width, height):
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {
            "width": width, "height": height, "deviceScaleFactor": 1, "mobile": False})

    def prefer(self, scheme):
        """What the system of the person prefers: light or dark."""
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {
            "features": [{"name": "prefers-color-scheme", "value": scheme}]})

    def show(self, path, query=""):
        """As if for the first time; what the browser had to say before is forgotten."""
        self.driver.get(path.as_uri())
        self.run("localStorage.clear()")
        self.driver.get_log("browser")
        self.driver.get_log("performance")
        self.driver.get(path.as_uri() + query)

    def run(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def drawn(self):
        """What follows the system's preferences has done so."""
        self.driver.execute_async_script("const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(done))")

    def one(self, css):
        return self.driver.find_element(By.CSS_SELECTOR, css)

    def all(self, css):
        return self.driver.find_elements(By.CSS_SELECTOR, css)

    def text(self, css):
        return self.run("return document.querySelector(arguments[0])?.textContent ?? null", css)

    def texts(self, css):
        return self.run("return [...document.querySelectorAll(arguments[0])].map((node) => node.textContent)", css)

    def click(self, css):
        self.run("document.querySelector(arguments[0]).click()", css)

    def choose(self, css, value):
        Select(self.one(css)).select_by_value(value)

    def column(self, name, table="#residual-cases"):
        """What a column of the drawn cases has."""
        return self.run("""
          const [name, table] = arguments;
          const heads = [...document.querySelectorAll(`${table} thead th`)];
          const n = heads.findIndex((head) => head.dataset.column === name);
          return [...document.querySelectorAll(`${table} tbody tr:not(.details)`)].map((row) => row.children[n].textContent);""", name, table)

    def complaints(self):
        """What the browser found wrong with the page."""
        return [entry["message"] for entry in self.driver.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")]

    def requests(self):
        """What the page asked for since it was shown."""
        import json
        events = [json.loads(entry["message"])["message"] for entry in self.driver.get_log("performance")]
        return [event["params"]["request"]["url"] for event in events if event["method"] == "Network.requestWillBeSent"]


def pictures(directory):
    page = Page()
    for name, size, scheme, query in (("dark", (1200, 900), "dark", ""), ("light", (1200, 900), "light", ""),
                                      ("chinese", (1200, 900), "light", "?lang=zh"), ("phone", (390, 844), "dark", "")):
        page.resize(*size)
        page.prefer(scheme)
        page.show(directory / "many.html", query)
        # All of it: main is what scrolls.
        page.run("document.body.style.height = 'auto'")
        height = page.run("return document.documentElement.scrollHeight")
        page.resize(size[0], height)
        page.driver.save_screenshot(str(directory / f"{name}.png"))
    page.close()


if __name__ == "__main__":
    pictures(pathlib.Path(sys.argv[1]).resolve())
