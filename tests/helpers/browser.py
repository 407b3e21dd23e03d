"""A real browser for the tests: headless Chromium that opens a file or an address and tells what happened.

It needs Debian's packages chromium and chromium-driver (or whatever puts `chromium` and `chromedriver` on the
path) and the Python package selenium. The browser reaches no network: every host name is refused, and every
address that a page asks for is recorded.
"""

import json
import os
import shutil
from base64 import b64decode
from dataclasses import dataclass
from pathlib import Path

from sheets import Shown

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
PACKAGES = "install Debian's packages chromium and chromium-driver"
FLAGS = (
    "--headless=new",
    "--no-sandbox",  # the pages are our own, and a container seldom allows the sandbox
    "--disable-gpu",
    "--disable-quic",
    "--disable-dev-shm-usage",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-extensions",
    "--no-first-run",
    "--no-default-browser-check",
    "--hide-scrollbars",
    "--force-color-profile=srgb",
    # another name of this computer, as a rebinding site has it
    "--host-resolver-rules=MAP rebound.example 127.0.0.1 , MAP * ~NOTFOUND , EXCLUDE 127.0.0.1",
)

# Every visible element with a key: [key, what it shows, scale from the document's unit to the shown one].
_SHOWN = """
return Array.from(document.querySelectorAll('[data-key]')).map(
  e => [e.dataset.key, e.textContent.trim(), e.dataset.scale || '1', e.getClientRects().length > 0]);
"""
_TOP = "return arguments[0].getBoundingClientRect().top + window.scrollY"
# What sticks out at the right, for the message of a failed test.
_WIDE = """
return Array.from(document.querySelectorAll('body *:not(svg *)')).filter(
  e => e.getBoundingClientRect().right > arguments[0] + 0.5).slice(0, 5).map(
  e => e.tagName + ' ' + (e.className.baseVal ?? e.className) + ' ' + e.textContent.trim().slice(0, 60));
"""
# Text that is cut off, or scrolls inside a box of its own.
_HIDDEN = """
return Array.from(document.querySelectorAll('body *:not(svg *)')).filter(
  e => e.scrollWidth > e.clientWidth + 1 && getComputedStyle(e).overflowX !== 'visible' && e.clientWidth).map(
  e => e.tagName + ' ' + e.className + ' ' + e.textContent.trim().slice(0, 60));
"""


def missing():
    """What this machine lacks for a browser, as one sentence; None if it lacks nothing."""
    if not (any(map(shutil.which, BROWSERS)) and shutil.which("chromedriver")):
        return f"no Chromium with its driver on this machine: {PACKAGES}"
    try:
        import selenium  # noqa: F401
    except ImportError:
        return "no selenium in this environment: install the Python package selenium"
    return None


def on_ci():
    """Whether this is a machine that must have a browser."""
    return os.environ.get("CI", "").lower() in ("1", "true", "yes")


def session(folder):
    """A browser for tests, which are skipped where there is none; on CI they fail then."""
    import pytest

    lacking = missing()
    if lacking and on_ci():
        pytest.fail(f"CI needs a browser: {lacking}")
    if lacking:
        pytest.skip(lacking)
    return Browser(folder)


@dataclass(frozen=True)
class Visit:
    """What a page did while it was opened."""

    console: list[str]
    requests: list[str]


class Browser:
    """One session of Chromium; `folder` takes its profile."""

    def __init__(self, folder):
        from selenium import webdriver
        from selenium.webdriver.chrome.service import Service

        options = webdriver.ChromeOptions()
        options.binary_location = next(filter(None, map(shutil.which, BROWSERS)))
        for flag in (*FLAGS, f"--user-data-dir={folder}"):
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))
        self.driver.set_page_load_timeout(30)

    def close(self):
        self.driver.quit()

    def open(self, path):
        """Open a local file, or an address, at the present width; what it logged and asked for."""
        self.heard()  # forget what came before
        self.driver.get(path if str(path).startswith("http:") else Path(path).resolve().as_uri())
        return self.heard()

    def heard(self):
        """What was logged and asked for since the last time."""
        console = [f"{entry['level']}: {entry['message']}" for entry in self.driver.get_log("browser")]
        requests = []
        for entry in self.driver.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent":
                requests.append(message["params"]["request"]["url"])
        return Visit(console, requests)

    def resize(self, width, height=900):
        """Make the page exactly this wide, CSS pixels, as a telephone or a screen does."""
        self.width = width
        self.driver.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride",
            {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600},
        )

    def widths(self):
        """Width of the whole page, and of the window."""
        return tuple(
            self.driver.execute_script("return [document.documentElement.scrollWidth, window.innerWidth]")
        )

    def too_wide(self):
        """The first elements that stick out at the right, and those that hide or scroll what they hold."""
        return self.driver.execute_script(_WIDE, self.width) + self.driver.execute_script(_HIDDEN)

    def shown(self):
        """All elements that show a value of the document."""
        return [
            Shown(k, text, float(scale), seen) for k, text, scale, seen in self.driver.execute_script(_SHOWN)
        ]

    def document(self):
        """The embedded JSON document."""
        text = self.driver.execute_script("return document.getElementById('result').textContent")
        return json.loads(text)

    def text(self, selector="body"):
        """What a person reads in the first matching element."""
        return self.driver.find_element("css selector", selector).text

    def title(self):
        """Of the page."""
        return self.driver.title

    def tops(self, selector):
        """Distance of each matching element from the top of the page, pixels."""
        found = self.driver.find_elements("css selector", selector)
        return [self.driver.execute_script(_TOP, element) for element in found if element.is_displayed()]

    def print(self):
        """The page as it prints on A4, PDF."""
        answer = self.driver.execute_cdp_cmd(
            "Page.printToPDF", {"preferCSSPageSize": True, "paperWidth": 8.27, "paperHeight": 11.69}
        )
        return b64decode(answer["data"])
