"""Damaged links and files of the page explore by hand: python -m tests.explore --cases 3000 [--first 0]"""

import argparse
import sys
import tempfile
from collections import Counter
from pathlib import Path

from playwright.sync_api import sync_playwright

from analysis.scene.scene import read_scene
from analysis.studies.explore.page import write_explore
from tests.explore.mutants import cases
from tests.pages.browser import BROWSER, QUIET


def run():
    options = argparse.ArgumentParser(prog="python -m tests.explore", description=__doc__)
    options.add_argument("--cases", type=int, default=3000)
    options.add_argument("--first", type=int, default=0)
    args, ends, faults, complaints = options.parse_args(), Counter(), 0, []
    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        page = playwright.chromium.launch(executable_path=BROWSER, args=QUIET).new_page(
            reduced_motion="reduce"
        )
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(write_explore([read_scene("gate")], Path(name), "x").as_uri())
        page.locator("#live .now").get_by_text("beyond the door.").wait_for()
        for number, made, wrong in cases(
            page, Path(name), range(args.first, args.first + args.cases)
        ):
            ends["played" if made["played"] else "refused"] += 1
            if wrong:
                faults += 1
                sys.stdout.write(f"{number}: {wrong}\n")
    sys.stdout.write(f"{dict(ends)}, {faults} faults, {complaints}\n")
    raise SystemExit(bool(faults or complaints))


if __name__ == "__main__":
    run()
