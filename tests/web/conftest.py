import os
import shutil

import pytest

dashboard = pytest.importorskip("dashboard", reason="needs python3-selenium")

if not (shutil.which("chromium") and shutil.which("chromedriver")):
    pytest.skip("needs chromium and chromium-driver", allow_module_level=True)

PROGRAM = os.environ.get("LKEMU", "lk-emu")


@pytest.fixture(scope="session")
def bench():
    bench = dashboard.Bench(PROGRAM, "1-4", "--http-write")
    yield bench
    bench.close()


@pytest.fixture(scope="session")
def browser(bench):
    page = dashboard.Page(bench.http)
    yield page
    page.close()


@pytest.fixture
def page(browser):
    """Complaints of the browser are those of this test."""
    browser.complaints()
    yield browser
