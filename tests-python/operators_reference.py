"""Numbers of other programs for the operators' tests: crates/mesh-spectrum/testdata/operators.

Writes seven small meshes as OBJ and, in reference.json, their matrices and lowest eigenvalues as computed by
robust_laplacian 1.1.0 (tufted, mollify_factor 1e-5), libigl 2.6.3 (cotangent, barycentric and full mass, intrinsic Delaunay)
and, for the polygon operator, by a NumPy 2.4.6 program below that follows the paper's definitions with a
constrained least-squares solve; eigenvalues by SciPy 1.17.1 eigh.

    python3 tests-python/operators_reference.py crates/mesh-spectrum/testdata/operators
"""

import json
import sys
from importlib.metadata import version
from pathlib import Path

import igl
import numpy as np
import robust_laplacian
import scipy.linalg
import scipy.sparse as sp

rng = np.random.default_rng(20)
EIGENVALUES = 30


def grid(nx, ny, place, wrap=False, jitter=0.0):
    columns = nx if wrap else nx + 1
    vertices = np.array([place(i, j) for j in range(ny + 1) for i in range(columns)], float)
    vertices += jitter * rng.uniform(-1, 1, vertices.shape)
    faces = []
    for j in range(ny):
        for i in range(nx):
            a, b = j * columns + i, j * columns + (i + 1) % columns
            c, d = b + columns, a + columns
            faces += [[a, b, c], [a, c, d]] if rng.uniform() < 0.5 else [[a, b, d], [b, c, d]]
    return vertices, faces


def sheet():
    """Flat but for noise, jittered by a third of an edge, diagonals at random: many edges are not Delaunay."""
    return grid(11, 8, lambda i, j: (i, j, 0), jitter=0.3)


def ball():
    """A closed surface: an octahedron divided three times, stretched and bumpy."""
    v = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    f = [(x, y, z) for x in (0, 1) for y in (2, 3) for z in (4, 5)]
    f = [(a, b, c) if (a + b + c) % 2 == 0 else (a, c, b) for a, b, c in f]
    for _ in range(3):
        middle, new = {}, []

        def mid(p, q):
            if (min(p, q), max(p, q)) not in middle:
                middle[min(p, q), max(p, q)] = len(v)
                v.append(tuple((np.array(v[p]) + np.array(v[q])) / 2))
            return middle[min(p, q), max(p, q)]

        for a, b, c in f:
            ab, bc, ca = mid(a, b), mid(b, c), mid(c, a)
            new += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        f = new
    v = np.array(v)
    v /= np.linalg.norm(v, axis=1)[:, None]
    v = v * np.array([1, 1.7, 0.6]) * (1 + 0.15 * rng.uniform(-1, 1, (len(v), 1)))
    return v, f


def fins():
    """Five sheets that share one line: every edge of it has five faces."""
    vertices, faces = [(0, 0, z + 0.2 * rng.uniform()) for z in range(9)], []
    for fin in range(5):
        angle = 1.1 * fin + 0.3 * rng.uniform()
        first = len(vertices)
        for k in range(1, 5):
            vertices += [(k * np.cos(angle) + 0.2 * rng.uniform(), k * np.sin(angle), z + 0.3 * rng.uniform()) for z in range(9)]

        def at(k, z):
            return z if k == 0 else first + 9 * (k - 1) + z

        for k in range(4):
            for z in range(8):
                a, b, c, d = at(k, z), at(k + 1, z), at(k + 1, z + 1), at(k, z + 1)
                faces += [[a, b, c], [a, c, d]] if rng.uniform() < 0.5 else [[b, a, d], [b, c, d]]
    return np.array(vertices, float), faces


def moebius():
    def place(i, j):
        t, w = 2 * np.pi * i / 24, (j - 2) * 0.25
        return ((3 + w * np.cos(t / 2)) * np.cos(t), (3 + w * np.cos(t / 2)) * np.sin(t), w * np.sin(t / 2))

    vertices = np.array([place(i, j) for i in range(24) for j in range(5)]) + 0.02 * rng.uniform(-1, 1, (120, 3))
    faces = []
    for i in range(24):
        for j in range(4):
            a, b = 5 * i + j, 5 * i + j + 1
            c, d = (5 * (i + 1) + j + 1, 5 * (i + 1) + j) if i < 23 else (3 - j, 4 - j)
            faces += [[a, b, c], [a, c, d]]
    return vertices, faces


def needles():
    """A jittered sheet with a face without area, one twice, one turned over on itself, and slivers of 1e-4 to 1e-7."""
    vertices, faces = grid(9, 6, lambda i, j: (i, j, 0), jitter=0.2)
    vertices, extra = list(map(tuple, vertices)), []
    for k, height in enumerate((1e-4, 1e-5, 1e-7, 0.0)):
        a, b, c = faces[10 + 20 * k]
        p, q = np.array(vertices[a]), np.array(vertices[b])
        vertices.append(tuple(0.4 * p + 0.6 * q + np.array([0, 0, height])))
        extra.append([a, b, len(vertices) - 1])
        extra.append([b, c, len(vertices) - 1])
    faces += extra + [faces[3], faces[5][::-1]]
    return np.array(vertices, float), faces


def fan():
    """Obtuse boundary triangles and a vertex with one triangle."""
    v = [(0, 0, 0), (4, 0, 0), (2, 0.3, 0.1), (2, -0.4, 0), (2, 0.2, 1), (6, 3, 0), (7, 3.1, 0.5)]
    return np.array(v, float), [[0, 1, 2], [0, 1, 3], [1, 0, 4], [1, 5, 6]]


def polygons():
    """Quadrilaterals, warped and not convex, with a pentagon, a hexagon and triangles."""
    vertices, _ = grid(8, 6, lambda i, j: (i, j, 0.3 * np.sin(i + 0.4 * j)), jitter=0.25)
    faces = []
    for j in range(6):
        for i in range(8):
            a = 9 * j + i
            quad = [a, a + 1, a + 10, a + 9]
            if (i, j) == (2, 2):
                faces.append([a, a + 1, a + 2, a + 11, a + 10, a + 9])
            elif (i, j) == (3, 2):
                continue
            elif (i, j) == (5, 4):
                vertices = np.vstack([vertices, (vertices[a] + vertices[a + 1]) / 2 + [0, -0.2, 0.05]])
                faces.append([a, len(vertices) - 1, a + 1, a + 10, a + 9])
            elif (i + j) % 5 == 0:
                faces += [quad[:3], [quad[0], quad[2], quad[3]]]
            else:
                faces.append(quad)
    return vertices, faces


def polygon_matrices(vertices, faces):
    """Bunge et al. 2020 by its definitions: w = argmin Σ area², Σ w = 1, of least length; L = Pᵀ L P, M = Pᵀ M P."""
    n = len(vertices)
    stiffness, mass = sp.lil_matrix((n, n)), sp.lil_matrix((n, n))
    for face in faces:
        x = vertices[face]
        k = len(face)
        if k == 3:
            fan_points, fan, prolong = x, [[0, 1, 2]], np.eye(3)
        else:
            # Rows of |(x_{i+1} - x_i) × (Σ w x - x_i)|, linear in w.
            rows, rhs = [], []
            for i in range(k):
                edge = x[(i + 1) % k] - x[i]
                rows.append(np.cross(edge, x).T)
                rhs.append(np.cross(edge, x[i]))
            a, b = np.vstack(rows), np.concatenate(rhs)
            # Σ w = 1 by elimination: w = 1/k + Z y, Z an orthonormal basis of the vectors with sum 0.
            z = scipy.linalg.null_space(np.ones((1, k)))
            even = np.full(k, 1 / k)
            w = even + z @ (np.linalg.pinv(a @ z, rcond=1e-9) @ (b - a @ even))
            fan_points, fan = np.vstack([x, w @ x]), [[i, (i + 1) % k, k] for i in range(k)]
            prolong = np.vstack([np.eye(k), w])
        m = len(fan_points)
        local_l, local_m = np.zeros((m, m)), np.zeros((m, m))
        for t in fan:
            p = fan_points[t]
            area = np.linalg.norm(np.cross(p[1] - p[0], p[2] - p[0])) / 2
            for c in range(3):
                i, j = t[(c + 1) % 3], t[(c + 2) % 3]
                u, v = p[(c + 1) % 3] - p[c], p[(c + 2) % 3] - p[c]
                weight = u @ v / (4 * area)
                local_l[i, j] -= weight
                local_l[j, i] -= weight
                local_l[i, i] += weight
                local_l[j, j] += weight
            local_m[np.ix_(t, t)] += area / 12 * (np.ones((3, 3)) + np.eye(3))
        index = np.ix_(face, face)
        stiffness[index] = stiffness[index].toarray() + prolong.T @ local_l @ prolong
        mass[index] = mass[index].toarray() + prolong.T @ local_m @ prolong
    return stiffness.tocsr(), mass.tocsr()


def digits(x):
    return float(f"{x:.13g}")


def entries(matrix):
    """Upper triangle: [row, column, value]."""
    upper = sp.triu(sp.csr_matrix(matrix)).tocoo()
    return [[int(i), int(j), digits(v)] for i, j, v in sorted(zip(upper.row, upper.col, upper.data)) if abs(v) > 1e-13]


def lowest(stiffness, mass):
    values = scipy.linalg.eigh(stiffness.toarray(), mass.toarray(), eigvals_only=True)
    return [digits(x) for x in values[:EIGENVALUES]]


def main(folder: Path):
    folder.mkdir(parents=True, exist_ok=True)
    made = {"versions": {name: version(name) for name in ("robust_laplacian", "libigl", "numpy", "scipy")}, "meshes": {}}
    for make in (sheet, ball, fins, moebius, needles, fan, polygons):
        vertices, faces = make()
        vertices = np.round(vertices, 9)
        name = make.__name__
        lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices] + ["f " + " ".join(str(c + 1) for c in face) for face in faces]
        (folder / f"{name}.obj").write_text("\n".join(lines) + "\n")
        vertices = np.array([[float(f"{x:.9g}") for x in point] for point in vertices])
        here = {}
        if name == "polygons":
            stiffness, mass = polygon_matrices(vertices, faces)
            here["polygon"] = {"stiffness": entries(stiffness), "consistent": entries(mass), "lumped": [digits(x) for x in mass.sum(axis=1).A1],
                               "eigenvalues_consistent": lowest(stiffness, mass)}
        else:
            triangles = np.array(faces, int)
            stiffness, mass = robust_laplacian.mesh_laplacian(vertices, triangles, mollify_factor=1e-5)
            here["tufted"] = {"stiffness": entries(stiffness), "lumped": [digits(x) for x in mass.diagonal()], "eigenvalues_lumped": lowest(stiffness, mass)}
            if name != "needles":
                stiffness = -igl.cotmatrix(vertices, triangles)
                lumped = igl.massmatrix(vertices, triangles, igl.MASSMATRIX_TYPE_BARYCENTRIC)
                full = igl.massmatrix(vertices, triangles, igl.MASSMATRIX_TYPE_FULL)
                here["cotan"] = {"stiffness": entries(stiffness), "lumped": [digits(x) for x in lumped.diagonal()], "consistent": entries(full),
                                 "eigenvalues_lumped": lowest(stiffness, lumped), "eigenvalues_consistent": lowest(stiffness, full)}
            if name == "ball":
                here["intrinsic_delaunay"] = {"stiffness": entries(-igl.intrinsic_delaunay_cotmatrix(vertices, triangles)[0])}
        made["meshes"][name] = here
    text = json.dumps(made, separators=(",", ":"))
    (folder / "reference.json").write_text(text + "\n")
    print(len(text), "bytes")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
