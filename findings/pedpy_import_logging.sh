#!/usr/bin/env bash
# PedPy 1.5.1, import (pedpy/preprocessing/trajectory_outlier_detection.py calls logging.basicConfig).
# One would guess: importing a library leaves the logging of the program alone.
# What happens: the import gives the root logger a handler and the level INFO. A program that has a handler on its
#   own logger sees each of its lines twice, and one that calls logging.basicConfig(filename=..., level=DEBUG) after
#   the import gets no file and no DEBUG: the call does nothing any more.
# Who is hurt: whoever logs a batch of analyses to a file: the file is never made.
set -euo pipefail
t=$(mktemp -d); trap 'rm -rf "$t"' EXIT
python3 -m venv "$t/v"; "$t/v/bin/pip" install -q --no-compile --disable-pip-version-check pedpy==1.5.1
cd "$t"
cat > own.py <<'E'
import logging, sys
log = logging.getLogger("study")
log.addHandler(logging.StreamHandler(sys.stderr))
log.setLevel(logging.INFO)
if "pedpy" in sys.argv:
    import pedpy
log.info("run 7 done")
logging.basicConfig(filename=sys.argv[1] + ".log", level=logging.DEBUG)
logging.debug("kept")
E
"$t/v/bin/python" own.py without 2> without.txt; "$t/v/bin/python" own.py with pedpy 2> with.txt
"$t/v/bin/python" - <<'E'
import importlib.metadata, pathlib, sys
print("PedPy", importlib.metadata.version("pedpy"))
lines = {n: pathlib.Path(f"{n}.txt").read_text().count("run 7 done") for n in ("without", "with")}
files = {n: pathlib.Path(f"{n}.log").exists() for n in ("without", "with")}
print("times that one line of the program is shown:", lines)
print("the log file asked for is there:", files)
holds = lines == {"without": 1, "with": 2} and files == {"without": True, "with": False}
sys.exit(0 if holds else "the behaviour has changed")
E
