"""LKEMU says which program; without Chromium, its driver and Selenium there is nothing to test with
(Debian: chromium, chromium-driver, python3-selenium, python3-pil)."""

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
def bench():
    from dashboard import Bench
    bench = Bench(PROGRAM, "1-4", "--http-write")
    yield bench
    bench.close()


@pytest.fixture(scope="session")
def browser(bench):
    from dashboard import Page
    page = Page(bench.http)
    yield page
    page.close()


@pytest.fixture
def page(bench, browser, request, tmp_path):
    """Complaints of the browser are those of this test; a failure leaves a picture of the page."""
    browser.complaints()
    browser.be_at_rest()
    bench.tell("move")
    failed = request.session.testsfailed
    yield browser
    if request.session.testsfailed > failed:
        browser.driver.save_screenshot(str(tmp_path / "page.png"))
        print(f"the page: {tmp_path}/page.png, its complaints: {browser.complaints()}")
