"""What a new process pays: wall seconds to import nscd and to solve a case once.

Usage: python first_solve.py CASE.npz; prints one line of JSON."""

import json
import sys
import time

started = time.perf_counter()

import numpy as np  # noqa: E402

from nscd import Contacts, Snapshot, solve  # noqa: E402

imported = time.perf_counter()
a = dict(np.load(sys.argv[1]))
snapshot = Snapshot(**{name: a[name] for name in ("position", "velocity", "radius", "mass")})
parts = ("first", "second", "is_wall", "normal", "gap", "point")
contacts = Contacts(**{name: a[name] for name in parts})
before = time.perf_counter()
solve(snapshot, contacts, left_velocity=a["left_velocity"], tolerance=1e-10)
after = time.perf_counter()
print(json.dumps({"import": imported - started, "solve": after - before}))
