"""Measures the cost of the dashboard: python3 measure.py LK-EMU [DRIVES [SECONDS [HEAP_MINUTES]]]

Prints milliseconds of the page's own thread per animation frame, by purpose, and kB/s that the page receives. Frames per
second depend on this machine, which draws without a GPU. The page itself can only reduce script time. At 60 Hz a frame
has 16.7 ms. With HEAP_MINUTES, prints how much the heap grows in this time on the Bus page, after garbage collection."""

import pathlib
import sys

from bench import Bench
from dashboard import Browser, Page, nap

PARTS = {"script": "ScriptDuration", "style": "RecalcStyleDuration", "layout": "LayoutDuration", "all": "TaskDuration"}
RECEIVED = """window.received = 0;
  const ask = window.fetch;
  window.fetch = async (...wanted) => {
    const answer = await ask(...wanted);
    answer.clone().arrayBuffer().then((bytes) => { received += bytes.byteLength; });
    return answer;
  };
  window.WebSocket = class extends WebSocket {
    constructor(...wanted) {
      super(...wanted);
      this.addEventListener('message', ({data}) => { received += data.length; });
    }
  };"""
PAGE_BYTES = """return performance.getEntriesByType('navigation').concat(performance.getEntriesByType('resource'))
  .filter((one) => !one.name.includes('/api/')).reduce((sum, one) => sum + one.encodedBodySize, 0)"""
COUNT = """window.counted = 0;
  const count = () => { ++window.counted; window.counting = requestAnimationFrame(count); };
  cancelAnimationFrame(window.counting); count();"""


def measure(page, seconds):
    def now():
        metrics = page.driver.execute_cdp_cmd("Performance.getMetrics", {})["metrics"]
        return {one["name"]: one["value"] for one in metrics}

    page.run(COUNT)
    before, (frames, bytes) = now(), page.run("return [counted, received]")
    nap(seconds)
    after, (frames, bytes) = now(), [new - old for new, old in zip(page.run("return [counted, received]"), (frames, bytes))]
    passed_s = after["Timestamp"] - before["Timestamp"]
    costs = {name: 1000 * (after[key] - before[key]) / max(1, frames) for name, key in PARTS.items()}
    return frames / passed_s, costs, bytes / passed_s / 1000


def heap_kB(page):
    page.browser.command("HeapProfiler.collectGarbage")
    return page.browser.command("Runtime.getHeapUsage")["usedSize"] / 1000


def measure_robot(browser, bench, drives, report):
    """Measures a robot with one joint and contact per drive, up to 12; reports its own script time apart from three.js
    and WebGL."""
    joints = min(12, drives)
    stub = (pathlib.Path(__file__).resolve().parent / "robot_stub.js").read_text()
    page = Page(browser, bench.http, before=RECEIVED + f"window.robotLegs = {joints}; window.robotBus = '{bench.bus}';" + stub)
    try:
        page.driver.execute_cdp_cmd("Performance.enable", {"timeDomain": "threadTicks"})
        page.until(lambda: page.all("#robot .robot-replay"))
        report(f"bus with a robot, {joints} joints", page)
        drawn, work_ms = page.driver.execute_async_script(
            "const done = arguments[0]; import('/robot.js').then(({inspectRobot: r}) => done([r().drawn, r().work_ms]))")
        print(f"  {drawn} pictures of the robot, ours without WebGL {work_ms / max(1, drawn):.2f} ms each, of the wall")
    finally:
        page.close()


def main():
    program = sys.argv[1]
    drives = int(sys.argv[2]) if len(sys.argv) > 2 else 32
    seconds = float(sys.argv[3]) if len(sys.argv) > 3 else 8
    bench = Bench(program, [f"1-{drives}"], "--http-write")
    browser = Browser()
    page = Page(browser, bench.http, before=RECEIVED)
    print(f"page: {page.run(PAGE_BYTES) / 1000:.0f} kB")
    page.driver.execute_cdp_cmd("Performance.enable", {"timeDomain": "threadTicks"})  # processor time, not real time
    bench.move(*range(1, drives + 1))

    def report(what, page=page):
        nap(6)  # to fill the plot
        rate_Hz, costs, received_kB_s = measure(page, seconds)
        print(f"{what:42} {rate_Hz:5.1f} frames/s, ms each: "
              + ", ".join(f"{name} {cost:.2f}" for name, cost in costs.items()) + f"; {received_kB_s:.0f} kB/s", flush=True)

    try:
        report(f"bus, {drives} drives")
        page.go(f"scope?drive={bench.bus}/1")
        report("scope, 1 drive, 4 signals")
        page.click(".scope-controls", "FFT")
        page.choose('.scope-controls [aria-label="trigger"] [aria-label="trigger"]', "normal")
        page.fill('.scope-controls [aria-label="trigger"] [aria-label="level"]', "1e9\t")  # so that the plot moves
        report("the same, spectra and a trigger that waits")
        page.click(".scope-controls", "FFT")
        page.choose('.scope-controls [aria-label="trigger"] [aria-label="trigger"]', "off")
        page.click(".scope-controls", "all drives")
        report(f"scope, {drives} drives, 4 signals")
        print("  " + page.text("#scope-info"))
        page.go("traffic")
        report("traffic")
        print(f"simulated against real time: {page.text('#clock-ratio')}")
        page.go("bus")
        if len(sys.argv) > 4:
            before_kB = heap_kB(page)
            nap(60 * float(sys.argv[4]))
            print(f"heap: {heap_kB(page) - before_kB:+.0f} kB in {sys.argv[4]} minutes")
        measure_robot(browser, bench, drives, report)
    finally:
        browser.close()
        bench.close()


if __name__ == "__main__":
    main()
