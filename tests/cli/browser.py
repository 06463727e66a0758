"""A page opened in a real browser from a file:// address."""

import contextlib
import shutil

from playwright.sync_api import sync_playwright

BROWSER = next(
    (
        path
        for name in ("chromium", "chromium-browser", "google-chrome")
        if (path := shutil.which(name))
    ),
    None,
)
QUIET = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


@contextlib.contextmanager
def opened(address, width):
    """The page, on a screen so many pixels wide; it must load offline and without complaint, with
    all its pictures, and not scroll sideways."""
    assert address.startswith("file://")
    complaints = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=BROWSER, args=QUIET)
        page = browser.new_page(viewport={"width": width, "height": 844})
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on(
            "request",
            lambda request: (
                None
                if request.url.startswith(("file:", "data:"))
                else complaints.append(request.url)
            ),
        )
        page.goto(address)
        yield page
        assert (
            page.evaluate("[...document.images].filter(i => !i.complete || !i.naturalWidth).length")
            == 0
        )
        # on a phone only the tables scroll sideways, not the page
        assert page.evaluate("document.documentElement.scrollWidth") <= page.viewport_size["width"]
        browser.close()
    assert complaints == []
