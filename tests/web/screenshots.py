"""The pictures of docs/dashboard.md and README.md: python3 screenshots.py LK-EMU DIRECTORY"""

import pathlib
import sys

from dashboard import Bench, Page, nap

SIZE = (1440, 900)


def theme(page, name):
    page.run("localStorage.setItem('lk-emu-theme', arguments[0])", name)
    page.driver.refresh()
    page.until(lambda: page.all(".card"))


def break_something(page, drive, kind, **parameters):
    page.go("bench")
    page.for_drives(drive)
    page.choose("#fault-kind", kind)
    for key, value in parameters.items():
        page.fill(f'#fault-parameters [data-key="{key}"]', value)
    page.click("#view-bench", "Break it")


def main():
    program, directory = sys.argv[1], pathlib.Path(sys.argv[2])
    directory.mkdir(parents=True, exist_ok=True)
    bench = Bench(program, "1-8", "--http-write")
    page = Page(bench.http, SIZE)

    def shoot(name):
        nap(1)  # for numbers and pictures to be those of now
        page.driver.save_screenshot(str(directory / f"{name}.png"))

    try:
        theme(page, "dark")
        bench.tell("move 1,2,3,4,5,6")
        break_something(page, 7, "cut")
        break_something(page, 4, "temperature_stuck", value_C=140)
        break_something(page, 2, "jam", percent=60, for_s=0.2, every_s=4)
        page.go("scope?drive=vcan0/2")
        page.click(".scope-controls", "current")
        page.go("traffic")
        nap(6)
        page.go("bus")
        shoot("bus")
        page.go("scope")
        page.click(".scope-controls", "Pause")
        page.click(".scope-controls", "A")
        page.click(".scope-controls", "B")
        shoot("scope")
        page.click(".scope-controls", "Go on")
        page.go("traffic")
        page.click("#view-traffic", "Pause")
        shoot("traffic")
        page.go("bench")
        page.for_drives(2)
        shoot("bench")
        theme(page, "light")
        page.go("bus")
        shoot("bus-light")
    finally:
        page.close()
        bench.close()


if __name__ == "__main__":
    main()
