"""What a new process pays: wall seconds to import nscd and to solve a case once.

Usage: python first_solve.py CASE; prints one line of JSON."""

import json
import pickle
import sys
import time
from pathlib import Path

started = time.perf_counter()

from nscd import solve  # noqa: E402

imported = time.perf_counter()
_, snapshot, _, contacts, left = pickle.loads(Path(sys.argv[1]).read_bytes())
before = time.perf_counter()
solve(snapshot, contacts, left_velocity=left, tolerance=1e-10)
after = time.perf_counter()
print(json.dumps({"import": imported - started, "solve": after - before}))
