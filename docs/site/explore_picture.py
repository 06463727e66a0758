"""The picture of the page that presses a crowd, after 2 s: python docs/site/explore_picture.py. It
needs what the tests need, and Chromium."""

import shutil
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

from analysis.scene.scene import read_scene
from analysis.studies.explore.page import write_explore

PICTURE = Path(__file__).resolve().parents[1] / "results" / "pictures" / "explore.png"
STEPS = 400
# Steps, and the picture of the last of them.
PRESS = """steps => { while (explore.run.step < steps) explore.advance();
    dispatchEvent(new Event("resize")); }"""


def main() -> None:
    """Draw it."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        page = write_explore([read_scene("arch")], Path(folder), "percussions explore arch")
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox"]
        )
        size = {"width": 1000, "height": 560}
        shown = browser.new_page(viewport=size, reduced_motion="reduce")
        shown.goto(page.as_uri())
        shown.locator("#live .film").wait_for()
        shown.evaluate(PRESS, STEPS)
        shown.locator("#live .glance").screenshot(path=PICTURE)
        browser.close()


if __name__ == "__main__":
    main()
