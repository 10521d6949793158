"""One browser for all tests of a module: the machine's own Chromium without a window."""

import os
import shutil

import pytest

ARGUMENTS = (
    "--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist", "--disable-dev-shm-usage",
)  # fmt: skip
"""Without a display and without a graphics card."""
LONG = 120_000.0
"""How long anything in a browser may take on a busy machine [ms]."""


def chromium():
    """The program, or None."""
    return os.environ.get("FTQP_CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")


@pytest.fixture(scope="module")
def browser():
    sync_api = pytest.importorskip("playwright.sync_api", reason='needs playwright (pip install -e ".[dev]")')
    if chromium() is None:
        pytest.skip("needs Chromium: apt install chromium, or FTQP_CHROMIUM=/path/to/it")
    with sync_api.sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=chromium(), args=list(ARGUMENTS))
        yield running
        running.close()


@pytest.fixture(scope="module")
def opened(browser):
    """Opens an address in a window of its own; closes what is still open at the end."""
    contexts = []

    def opens(address, *, offline=False, size=(1000, 480)):
        context = browser.new_context(offline=offline, viewport={"width": size[0], "height": size[1]})
        context.set_default_timeout(LONG)
        contexts.append(context)
        tab = context.new_page()
        tab.goto(address)
        return tab

    yield opens
    for context in contexts:
        context.close()
