"""Siconos on a contact problem in a .npz file; run by the Python that has siconos.

Usage: python3 by_siconos.py GIVEN.npz SOLVER TOLERANCE ITERATIONS FOUND.npy; prints CPU seconds as one
line of JSON. GIVEN: W in compressed columns (data, indices, indptr), free q, and friction μ (k,) for
the solvers of frictional contact in two dimensions, NSGS, CPG, LEMKE and ENUM, which take a normal
and a tangential row of each contact in turn. SOLVER is PGS without friction: 0 ≤ z ⟂ W z + q ≥ 0."""

import json
import sys
import time
import warnings

import numpy as np
import scipy.sparse as sparse
import siconos.numerics as numerics

inputs, solver, tolerance, iterations, found = sys.argv[1:]
warnings.simplefilter("ignore")
file = np.load(inputs)
free = file["free"]
size = len(free)
# siconos' integers have 64 bits; giving it others makes it convert them
matrix = sparse.csc_matrix((size, size))
matrix.data = file["data"]
matrix.indices, matrix.indptr = (file[name].astype(np.int64) for name in ("indices", "indptr"))
if solver == "PGS":
    problem, run = numerics.LCP(matrix, free), numerics.linearComplementarity_driver
    options = numerics.SolverOptions(numerics.SICONOS_LCP_PGS)
else:
    if solver == "NSGS":
        blocks = matrix.tobsr(blocksize=(2, 2))
        _, blocks = numerics.SBM_from_csparse(2, sparse.csc_matrix(blocks))
        wrapped = numerics.NumericsMatrix(blocks)
    else:
        wrapped = matrix.toarray(order="F")
    friction = file["friction"]
    problem = numerics.FrictionContactProblem(2, len(friction), wrapped, free, friction)
    run = numerics.fc2d_driver
    options = numerics.SolverOptions(getattr(numerics, f"SICONOS_FRICTION_2D_{solver}"))
options.dparam[numerics.SICONOS_DPARAM_TOL] = float(tolerance)
options.iparam[numerics.SICONOS_IPARAM_MAX_ITER] = int(iterations)
reaction, velocity = np.zeros(size), np.zeros(size)
started = time.process_time()
run(problem, reaction, velocity, options)
seconds = time.process_time() - started
np.save(found, reaction)
print(json.dumps({"seconds": seconds}))
