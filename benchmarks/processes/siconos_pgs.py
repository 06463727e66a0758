"""Siconos' projected Gauss–Seidel: 0 ≤ z ⟂ W z − v ≥ 0 from a .npz file; run by the Python that has
siconos.

Usage: python3 siconos_pgs.py GIVEN.npz TOLERANCE FOUND.npy; prints CPU seconds and iterations as
one line of JSON."""

import json
import sys
import time
import warnings

import numpy as np
import scipy.sparse as sparse
import siconos.numerics as numerics

given, tolerance, found = sys.argv[1:]
file = np.load(given)
approach = file["approach"]
size = len(approach)
# siconos' integers have 64 bits; giving it others makes it convert them
matrix = sparse.csc_matrix((size, size))
matrix.data = file["data"]
matrix.indices, matrix.indptr = file["indices"].astype(np.int64), file["indptr"].astype(np.int64)
answer, slack = np.zeros(size), np.zeros(size)
warnings.simplefilter("ignore")
started = time.process_time()
problem = numerics.LCP(matrix, -approach)
options = numerics.SolverOptions(numerics.SICONOS_LCP_PGS)
options.dparam[0] = float(tolerance)
options.iparam[0] = 10_000_000
numerics.linearComplementarity_driver(problem, answer, slack, options)
seconds = time.process_time() - started
np.save(found, answer)
print(json.dumps({"seconds": seconds, "iterations": int(options.iparam[1])}))
