"""PLANTED_REPORT says which program writes the pages; without Chromium, its driver and Selenium there is nothing to
look at them with (Debian: chromium, chromium-driver, python3-selenium)."""

import importlib.util
import os
import shutil
import subprocess

import pytest

MISSING = [package for package, there in {
    "chromium": shutil.which("chromium"), "chromium-driver": shutil.which("chromedriver"),
    "python3-selenium": importlib.util.find_spec("selenium")}.items() if not there]
if MISSING:
    collect_ignore_glob = ["test_*.py"]


def pytest_terminal_summary(terminalreporter):
    if MISSING:
        terminalreporter.write_line(f"skipped: the tests of the page need {', '.join(MISSING)}")


@pytest.fixture(scope="session")
def pages(tmp_path_factory):
    """A directory with many.html, few.html and nasty.html."""
    directory = tmp_path_factory.mktemp("pages")
    subprocess.run([os.environ["PLANTED_REPORT"], str(directory)], check=True)
    return directory


@pytest.fixture(scope="session")
def browser():
    from page import Page
    page = Page()
    yield page
    page.close()


@pytest.fixture
def many(browser, pages):
    browser.show(pages / "many.html")
    return browser
