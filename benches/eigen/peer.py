#!/usr/bin/env python3
"""One run of a peer on L and M that `measure --dump` wrote: prints one line of JSON.

    python peer.py scipy|lapy|slepc|dense FOLDER K

scipy: `eigsh` of SciPy, shift-invert at -1e-4 with CHOLMOD (scikit-sparse). lapy: LaPy's Solver.eigs with CHOLMOD, given
the same matrices. slepc: Krylov-Schur with shift-invert, on the mass-scaled matrix,
with MUMPS where it is there. dense: `scipy.linalg.eigh`.
The residual is the largest |L x - lambda M x| in the inverse-mass norm over lambda_K, orthogonality max |X' M X - I|.
"""
from __future__ import annotations

import glob
import json
import sys
import time
from pathlib import Path

import numpy as np
import scipy
import scipy.sparse as sparse


def read(folder: Path):
    start, columns = np.fromfile(folder / "start.i64", np.int64), np.fromfile(folder / "columns.i32", np.int32)
    mass = np.fromfile(folder / "mass.f64")
    shape = (len(mass), len(mass))
    # Symmetric: rows are columns.
    return sparse.csc_matrix((np.fromfile(folder / "values.f64"), columns, start), shape), mass


def shift_invert(stiffness, mass, count, shift):
    import scipy.sparse.linalg
    from sksparse.cholmod import cholesky

    factor = cholesky((stiffness - shift * sparse.diags(mass)).tocsc())
    inverse = sparse.linalg.LinearOperator(stiffness.shape, matvec=factor, dtype=float)
    return sparse.linalg.eigsh(stiffness, count, sparse.diags(mass).tocsc(), sigma=shift, which="LM", OPinv=inverse)


def slepc(stiffness, mass, count):
    # Where Debian keeps both, when no alternative is set up.
    sys.path += glob.glob("/usr/lib/*dir/*/*-real/lib/python3/dist-packages")
    import slepc4py

    slepc4py.init([])
    from petsc4py import PETSc
    from slepc4py import SLEPc

    scale = sparse.diags(1 / np.sqrt(mass))
    scaled = (scale @ stiffness @ scale).tocsr()
    scaled.sort_indices()
    matrix = PETSc.Mat().createAIJ(scaled.shape, csr=(scaled.indptr.astype(np.int32), scaled.indices.astype(np.int32), scaled.data))
    solver = SLEPc.EPS().create(PETSc.COMM_SELF)
    solver.setOperators(matrix)
    solver.setProblemType(SLEPc.EPS.ProblemType.HEP)
    solver.setDimensions(count)
    solver.setTarget(-1e-4)
    solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    solver.setTolerances(1e-10, 500)
    transform = solver.getST()
    transform.setType("sinvert")
    inner = transform.getKSP()
    inner.setType("preonly")
    inner.getPC().setType("cholesky")
    if len(mass) > 50_000:
        inner.getPC().setFactorSolverType("mumps")
    solver.solve()
    found = min(count, solver.getConverged())
    values, vectors, vector = np.empty(found), np.empty((len(mass), found)), matrix.createVecRight()
    for k in range(found):
        values[k] = solver.getEigenpair(k, vector).real
        vectors[:, k] = vector.getArray() / np.sqrt(mass)
    return values, vectors


def main() -> None:
    peer, folder, count = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3])
    stiffness, mass = read(folder)
    before, cpu_before = time.perf_counter(), time.process_time()
    if peer == "scipy":
        values, vectors = shift_invert(stiffness, mass, count, -1e-4)
    elif peer == "lapy":
        from lapy import Solver

        solver = Solver.__new__(Solver)  # its constructor builds the matrices from a mesh; these are ours
        solver.stiffness, solver.mass, solver.use_cholmod = stiffness, sparse.diags(mass).tocsc(), True
        values, vectors = solver.eigs(count)
    elif peer == "slepc":
        values, vectors = slepc(stiffness, mass, count)
    elif peer == "dense":
        root = np.sqrt(mass)
        scaled = stiffness.toarray() / root[:, None] / root
        values, vectors = scipy.linalg.eigh(scaled, subset_by_index=[0, count - 1])
        vectors /= root[:, None]
    else:
        raise SystemExit(__doc__)
    wall, cpu = time.perf_counter() - before, time.process_time() - cpu_before
    order = np.argsort(values)
    values, vectors = values[order], vectors[:, order]
    residuals = stiffness @ vectors - mass[:, None] * vectors * values
    gram = vectors.T @ (mass[:, None] * vectors)
    kernels = []
    try:
        from threadpoolctl import threadpool_info

        kernels = sorted({f"{i.get('internal_api')} {i.get('version')} {i.get('architecture')}" for i in threadpool_info() if i.get("user_api") == "blas"})
    except ImportError:
        pass
    print(json.dumps({
        "wall": wall,
        "cpu": cpu,
        "pairs": len(values),
        "missing": count - len(values),
        "residual": float(np.sqrt((residuals**2 / mass[:, None]).sum(0)).max() / values[-1]),
        "orthogonality": float(abs(gram - np.eye(len(values))).max()),
        "last_eigenvalue": float(values[-1]),
        "versions": {"numpy": np.__version__, "scipy": scipy.__version__},
        "blas": kernels,
    }))


if __name__ == "__main__":
    main()
