#!/usr/bin/env python3
"""The 500 lowest eigenvalues of hat-section.obj from SciPy, for the test of agreement with an independent program.

    pip install numpy==2.4.6 scipy==1.17.1
    python3 scipy_eigenvalues.py                      writes hat-section.json
    python3 scipy_eigenvalues.py MESH.obj K [JOIN]    measures: prints times, residual, orthogonality

Written from the same definitions as the crate, not from its code: cotangent stiffness, lumped mass (a third of each
triangle), quadrilaterals split along the diagonal with the larger minimum angle, joined vertices one degree of freedom.
"""
import json
import pathlib
import sys
import time

import numpy as np
import scipy
import scipy.sparse as sp
import scipy.sparse.csgraph
import scipy.sparse.linalg
import scipy.spatial


def read(path):
    vertices, faces = [], []
    for line in open(path):
        word, *rest = line.split()
        if word == "v":
            vertices.append([float(x) for x in rest])
        elif word == "f":
            faces.append([int(x) - 1 for x in rest])
    return np.array(vertices), np.array(faces)


def smallest_angle(x, triangles):
    least = np.full(len(triangles), np.inf)
    for k in range(3):
        at, to, other = (x[triangles[:, (k + i) % 3]] for i in range(3))
        u, v = to - at, other - at
        least = np.minimum(least, np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), (u * v).sum(1)))
    return least


def triangulate(x, faces):
    triangle = faces[:, 2] == faces[:, 3]
    quads, out = faces[~triangle], [faces[triangle][:, :3]]
    ac, bd = [quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]], [quads[:, [0, 1, 3]], quads[:, [1, 2, 3]]]
    better = np.minimum(*(smallest_angle(x, t) for t in bd)) > np.minimum(*(smallest_angle(x, t) for t in ac)) + 1e-9
    out += [ac[0][~better], ac[1][~better], bd[0][better], bd[1][better]]
    return np.concatenate(out)


def operator(x, t, distance):
    n = len(x)
    dof = np.arange(n)
    if distance:
        links = sp.coo_matrix((np.ones(2 * len(t)), (np.r_[t[:, 0], t[:, 0]], np.r_[t[:, 1], t[:, 2]])), (n, n))
        count, part = sp.csgraph.connected_components(links, directed=False)
        nearest, far = np.full(n, -1), np.full(n, np.inf)
        for p in range(count):
            own, others = np.flatnonzero(part == p), np.flatnonzero(part != p)
            d, i = scipy.spatial.cKDTree(x[others]).query(x[own])
            nearest[own], far[own] = others[i], d
        mutual = np.flatnonzero((nearest[nearest] == np.arange(n)) & (far <= distance))
        dof = np.minimum(dof, np.where(np.isin(dof, mutual), nearest, dof))
        dof = np.unique(dof, return_inverse=True)[1]
    m = dof.max() + 1
    rows, columns, values, mass = [], [], [], np.zeros(m)
    for k in range(3):
        i, j, o = t[:, (k + 1) % 3], t[:, (k + 2) % 3], t[:, k]
        u, v = x[i] - x[o], x[j] - x[o]
        double_area = np.linalg.norm(np.cross(u, v), axis=1)
        w = 0.5 * (u * v).sum(1) / double_area
        i, j, o = dof[i], dof[j], dof[o]
        rows += [i, j, i, j]
        columns += [j, i, i, j]
        values += [-w, -w, w, w]
        np.add.at(mass, o, double_area / 6)
    stiffness = sp.coo_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), (m, m)).tocsc()
    return stiffness, mass


def solve(stiffness, mass, k):
    m = sp.diags(mass).tocsc()
    # Below 0, so that L − σ M is definite; far enough from 0 that a double zero is no trouble.
    values, vectors = scipy.sparse.linalg.eigsh(stiffness, k, m, sigma=-1e-4, which="LM", v0=np.ones(len(mass)) + np.arange(len(mass)) % 7)
    order = np.argsort(values)
    values, vectors = values[order], vectors[:, order]
    r = stiffness @ vectors - (m @ vectors) * values
    residual = np.sqrt((r**2 / mass[:, None]).sum(0)).max() / values[-1]
    return values, residual, abs(vectors.T @ (m @ vectors) - np.eye(k)).max()


def main():
    here = pathlib.Path(__file__).parent
    if len(sys.argv) > 1:
        x, faces = read(sys.argv[1])
        distance = float(sys.argv[3]) if len(sys.argv) > 3 else None
        stiffness, mass = operator(x, triangulate(x, faces), distance)
        start = time.perf_counter(), time.process_time()
        values, residual, loss = solve(stiffness, mass, int(sys.argv[2]))
        wall, cpu = time.perf_counter() - start[0], time.process_time() - start[1]
        print(f"scipy {scipy.__version__} n={len(mass)} K={sys.argv[2]} wall={wall:.3f} cpu={cpu:.3f} residual={residual:.1e} orthogonality={loss:.1e} lambda_K={values[-1]:.12e}")
        return
    x, faces = read(here / "hat-section.obj")
    result = {"made_by": f"scipy_eigenvalues.py, SciPy {scipy.__version__}, NumPy {np.__version__}, eigsh(sigma=-1e-4), SuperLU", "unit": "1/mm^2"}
    for name, distance in [("separate", None), ("joined_at_2.5_mm", 2.5)]:
        stiffness, mass = operator(x, triangulate(x, faces), distance)
        values, residual, loss = solve(stiffness, mass, 500)
        print(name, len(mass), "area", mass.sum(), "residual", residual, "orthogonality", loss, values[:10])
        result[name] = {"dofs": len(mass), "residual": residual, "eigenvalues": [float(v) for v in values]}
    (here / "hat-section.json").write_text(json.dumps(result, indent=0) + "\n")


main()
