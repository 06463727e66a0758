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
spent = {
    "import_wall_s": imported[0] - started[0],
    "import_cpu_s": imported[1] - started[1],
    "solve_wall_s": after[0] - before[0],
    "solve_cpu_s": after[1] - before[1],
    "residual": answer.residual,
}
print(json.dumps(spent))
