"""What a new process pays: seconds to import nscd and to solve a case once, compiled kernels on
disk.

Usage: python first_solve.py CASE.npz; prints one line of JSON."""

import json
import sys
import time

started = time.perf_counter(), time.process_time()

import numpy as np  # noqa: E402

from nscd import Contacts, Snapshot, solve  # noqa: E402

imported = time.perf_counter(), time.process_time()
with np.load(sys.argv[1]) as file:
    a = {name: file[name] for name in file.files}
snapshot = Snapshot(**{name: a[name] for name in ("position", "velocity", "radius", "mass")})
contacts = Contacts(
    **{name: a[name] for name in ("first", "second", "is_wall", "normal", "gap", "point")}
)
before = time.perf_counter(), time.process_time()
answer = solve(snapshot, contacts, left_velocity=a["left_velocity"], tolerance=1e-10)
after = time.perf_counter(), time.process_time()
spent = {"residual": answer.residual}
for clock, name in enumerate(("wall", "cpu")):
    spent[f"import_{name}_s"] = imported[clock] - started[clock]
    spent[f"solve_{name}_s"] = after[clock] - before[clock]
print(json.dumps(spent))
