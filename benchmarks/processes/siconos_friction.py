"""Siconos' solvers of frictional contact in two dimensions on a .npz file; run by the Python that
has siconos.

Usage: python3 siconos_friction.py GIVEN.npz SOLVER TOLERANCE ITERATIONS FOUND.npy, SOLVER NSGS,
CPG, LEMKE or ENUM; prints CPU seconds as one line of JSON. GIVEN: rows (2k,3n) in CSR (data,
indices, indptr), inverse (3n,), velocity (2k,) and friction (k,); normal and tangential rows
alternate."""

import json
import sys
import time
import warnings

import numpy as np
import scipy.sparse as sparse
import siconos.numerics as numerics

given, solver, tolerance, iterations, found = sys.argv[1:]
file = np.load(given)
k = len(file["friction"])
rows = sparse.csr_matrix(
    (file["data"], file["indices"], file["indptr"]), shape=(2 * k, len(file["inverse"]))
)
delassus = (rows @ sparse.diags(file["inverse"]) @ rows.T).tobsr(blocksize=(2, 2))
warnings.simplefilter("ignore")
if solver == "NSGS":
    _, matrix = numerics.SBM_from_csparse(2, sparse.csc_matrix(delassus))
    wrapped = numerics.NumericsMatrix(matrix)
else:
    wrapped = delassus.toarray(order="F")
problem = numerics.FrictionContactProblem(2, k, wrapped, file["velocity"], file["friction"])
options = numerics.SolverOptions(getattr(numerics, f"SICONOS_FRICTION_2D_{solver}"))
options.dparam[numerics.SICONOS_DPARAM_TOL] = float(tolerance)
options.iparam[numerics.SICONOS_IPARAM_MAX_ITER] = int(iterations)
reaction, velocity = np.zeros(2 * k), np.zeros(2 * k)
started = time.process_time()
numerics.fc2d_driver(problem, reaction, velocity, options)
seconds = time.process_time() - started
np.save(found, reaction)
print(json.dumps({"seconds": seconds}))
