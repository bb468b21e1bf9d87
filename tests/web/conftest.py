"""LKEMU names the program. Without Chromium, its driver and Selenium no test runs (Debian: chromium, chromium-driver,
python3-selenium, python3-pil)."""

import importlib.util
import os
import shutil

import pytest

PROGRAM = os.environ.get("LKEMU", "lk-emu")

MISSING = [package for package, there in {
    "chromium": shutil.which("chromium"), "chromium-driver": shutil.which("chromedriver"),
    "python3-selenium": importlib.util.find_spec("selenium"), "python3-pil": importlib.util.find_spec("PIL")}.items() if not there]
if MISSING:
    collect_ignore_glob = ["test_*.py"]


def pytest_terminal_summary(terminalreporter):
    if MISSING:
        terminalreporter.write_line(f"skipped: the dashboard's tests need {', '.join(MISSING)}")


@pytest.fixture(scope="session")
def bench(tmp_path_factory):
    from bench import Bench
    # A motor without cogging: a free shaft stays where a test turns it.
    motor = tmp_path_factory.mktemp("motors") / "mf7015"
    motor.write_text('extends = "mf7015"\n[mechanics]\ntau_cogging_mNm = 0\n', "utf-8")
    bench = Bench(PROGRAM, ["1-4"], "--http-write", "--motor", str(motor))
    yield bench
    bench.close()


@pytest.fixture(scope="session")
def browser():
    from dashboard import Browser
    browser = Browser()
    yield browser
    browser.close()


@pytest.fixture(scope="session")
def main_page(bench, browser):
    from dashboard import Page
    return Page(browser, bench.http)


@pytest.fixture(scope="module")
def scope(bench, browser):
    """The scope on a page of its own, with 600 samples of drive 1."""
    from dashboard import Page
    page = Page(browser, bench.http, query=f"#scope?drive={bench.bus}/1")
    page.until(lambda: page.scope("s.traces.length > 0 && s.captures[0].samples.length > 600"))
    yield page
    page.close()


@pytest.fixture
def page(bench, main_page, request, tmp_path):
    """The page; collects the browser's complaints for this test, and saves a picture on failure."""
    if not main_page.is_open():
        main_page.open()
    main_page.complaints()
    main_page.be_at_rest()
    bench.move()
    failed = request.session.testsfailed
    yield main_page
    if request.session.testsfailed > failed:
        main_page.driver.save_screenshot(str(tmp_path / "page.png"))
        print(f"the page: {tmp_path}/page.png, its complaints: {main_page.complaints()}")
