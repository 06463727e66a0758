"""`python -m nscd`: compile the kernels once and check them."""

from __future__ import annotations

import logging
import sys
import time

from nscd.kernels import compiled_wrongly


def main() -> int:
    """0 if every kernel compiled gives the right answer."""
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    started = time.perf_counter()
    wrong = compiled_wrongly()
    for line in wrong:
        logging.error(line)
    if not wrong:
        logging.info("kernels compiled and checked in %.1f s", time.perf_counter() - started)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
