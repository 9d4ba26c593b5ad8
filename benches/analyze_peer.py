#!/usr/bin/env python3
"""What `crumple analyze` does, written with lasso-python, SciPy and scikit-learn.

    python analyze_peer.py BUNDLE OUT [--join 2.5] [-K 500]

A script as a competent user of these packages writes it today: read all runs, one Laplace-Beltrami
basis, coefficients of every state, modes by k-means with the number chosen by silhouette, a medoid and
the paper's descriptor for each, its errors beside the rivals', a ranking of all runs, tables and a page.
It is the other side of `side_by_side.py`, and `ranking_reference.py` takes its mesh and operator.

Prints one line of JSON: seconds of each stage, peak memory, versions, threads, what was found.
"""
from __future__ import annotations

import argparse
import json
import resource
import time
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Iterator

import numpy as np
import pandas as pd
import plotly.graph_objects as go
import scipy.sparse as sp
from lasso.dyna import ArrayType, D3plot
from plotly.subplots import make_subplots
from scipy.sparse.linalg import eigsh
from scipy.spatial import cKDTree
from sklearn.cluster import KMeans
from sklearn.decomposition import PCA
from sklearn.metrics import silhouette_score
from threadpoolctl import threadpool_info

RESTARTS = 10
COUNTS = range(2, 9)  # numbers of modes that are tried


@dataclass
class Bundle:
    """All runs of a folder on their common mesh."""

    runs: list[str]
    times: list[np.ndarray]  # of each run's states
    rest: np.ndarray  # N x 3, undeformed
    quads: np.ndarray  # F x 4
    positions: list[np.ndarray]  # of each run, S x N x 3

    @property
    def final(self) -> np.ndarray:
        """Displacements of the last state of each run, R x N x 3."""
        return np.array([states[-1] for states in self.positions]) - self.rest


def read_bundle(folder: Path) -> Bundle:
    bundle = None
    for root in sorted(folder.glob("*/d3plot")):
        arrays = D3plot(str(root), state_array_filter=[ArrayType.global_timesteps, ArrayType.node_displacement]).arrays
        ids, quads = arrays[ArrayType.node_ids], arrays[ArrayType.element_shell_node_indexes]
        if bundle is None:
            reference_ids = ids
            bundle = Bundle([], [], arrays[ArrayType.node_coordinates].astype(float), quads, [])
        if not (np.array_equal(ids, reference_ids) and np.array_equal(quads, bundle.quads)):
            raise SystemExit(f"{root}: another mesh than that of {bundle.runs[0]}")
        bundle.runs.append(root.parent.name)
        bundle.times.append(arrays[ArrayType.global_timesteps])
        bundle.positions.append(arrays[ArrayType.node_displacement].astype(float))  # lasso's name for positions
    if bundle is None:
        raise SystemExit(f"{folder}: no */d3plot")
    return bundle


def triangulate(points: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """Splits quads along the diagonal that gives the larger minimum angle; the first one on a tie."""

    def smallest_angle(triangles: np.ndarray) -> np.ndarray:
        corners = points[triangles]
        angles = []
        for i in range(3):
            u, v = corners[:, (i + 1) % 3] - corners[:, i], corners[:, (i + 2) % 3] - corners[:, i]
            cosine = (u * v).sum(1) / (np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1))
            angles.append(np.arccos(np.clip(cosine, -1, 1)))
        return np.min(angles, axis=0)

    first = [quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]
    second = [quads[:, [0, 1, 3]], quads[:, [1, 2, 3]]]
    angle_of_first = np.minimum(*map(smallest_angle, first))
    angle_of_second = np.minimum(*map(smallest_angle, second))
    take_first = (angle_of_first >= angle_of_second - 1e-9)[:, None]
    return np.concatenate([np.where(take_first, a, b) for a, b in zip(first, second)])


def operator(points: np.ndarray, triangles: np.ndarray) -> tuple[sp.csr_matrix, np.ndarray]:
    """Cotangent stiffness L (N x N) and lumped mass (N)."""
    n, corners = len(points), points[triangles]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    rows, columns, values = [], [], []
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        cotangent = ((corners[:, j] - corners[:, i]) * (corners[:, k] - corners[:, i])).sum(1) / (2 * area)
        a, b = triangles[:, j], triangles[:, k]
        rows += [a, b, a, b]
        columns += [b, a, a, b]
        values += [-cotangent / 2, -cotangent / 2, cotangent / 2, cotangent / 2]
    stiffness = sp.csr_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(n, n))
    return stiffness, np.bincount(triangles.ravel(), np.repeat(area / 3, 3), minlength=n)


def join(points: np.ndarray, stiffness: sp.csr_matrix, distance: float) -> sp.csr_matrix:
    """P (N x n): mutually nearest vertices of different components, at most `distance` apart, share a degree of freedom."""
    count, component = sp.csgraph.connected_components(stiffness, directed=False)
    freedom = np.arange(len(points))
    for one in range(count):
        for other in range(one + 1, count):
            a, b = np.flatnonzero(component == one), np.flatnonzero(component == other)
            gap, nearest_b = cKDTree(points[b]).query(points[a])
            nearest_a = cKDTree(points[a]).query(points[b])[1]
            mutual = (nearest_a[nearest_b] == np.arange(len(a))) & (gap <= distance)
            freedom[b[nearest_b[mutual]]] = freedom[a[mutual]]
    columns = np.unique(freedom, return_inverse=True)[1]
    return sp.csr_matrix((np.ones(len(points)), (np.arange(len(points)), columns)))


def eigenbasis(stiffness: sp.csr_matrix, mass: np.ndarray, prolongation: sp.csr_matrix, k: int) -> tuple[np.ndarray, np.ndarray]:
    """The k smallest eigenpairs of L x = lambda M x: eigenvalues (K), eigenvectors (K x N)."""
    reduced = (prolongation.T @ stiffness @ prolongation).tocsc()
    reduced_mass = sp.diags(prolongation.T @ mass).tocsc()
    eigenvalues, vectors = eigsh(reduced, k=k, M=reduced_mass, sigma=-1e-4)
    order = np.argsort(eigenvalues)
    return eigenvalues[order], (prolongation @ vectors[:, order]).T


def select(values: np.ndarray) -> np.ndarray:
    """The paper's rule on K x 3 values: eigenvectors with a magnitude above mean + one standard deviation of all."""
    magnitude = np.abs(values)
    return np.flatnonzero((magnitude > magnitude.mean() + magnitude.std()).any(axis=1))


def cosine(values: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Cosine of each row of `values` (R x ...) with `target`."""
    flat = values.reshape(len(values), -1)
    return flat @ target.ravel() / (np.linalg.norm(flat, axis=1) * np.linalg.norm(target))


def medoid(shapes: np.ndarray) -> int:
    """The shape with the smallest mean distance to the others."""
    flat = shapes.reshape(len(shapes), -1)
    return int(np.linalg.norm(flat[:, None] - flat[None], axis=2).mean(axis=1).argmin())


def cluster(features: np.ndarray, seed: int) -> tuple[np.ndarray, dict[int, float]]:
    """k-means with the number of clusters chosen by silhouette."""
    labels = {count: KMeans(count, n_init=RESTARTS, random_state=seed).fit_predict(features) for count in COUNTS}
    scores = {count: float(silhouette_score(features, labels[count])) for count in COUNTS}
    return labels[max(scores, key=scores.get)], scores


def errors(shape: np.ndarray, target: np.ndarray, rest: np.ndarray, mass: np.ndarray) -> dict[str, float]:
    """Weighted RMS distance (mm), largest distance of a vertex (mm), RMS relative to the RMS displacement (%)."""

    def rms(difference: np.ndarray) -> float:
        return float(np.sqrt((mass * (difference**2).sum(1)).sum() / mass.sum()))

    return {
        "rms_mm": rms(shape - target),
        "max_mm": float(np.linalg.norm(shape - target, axis=1).max()),
        "percent": 100 * rms(shape - target) / rms(target - rest),
    }


def state_measures(positions: np.ndarray, rest: np.ndarray, mass: np.ndarray, deltas: np.ndarray, edges: np.ndarray) -> pd.DataFrame:
    """Numbers about each state of a run: how far it moved, what the basis catches of it, how much the surface stretches."""
    moved = positions - rest
    total = (mass[:, None] * moved**2).sum((1, 2))
    rest_length = np.linalg.norm(rest[edges[:, 0]] - rest[edges[:, 1]], axis=1)
    strain = np.abs(np.linalg.norm(positions[:, edges[:, 0]] - positions[:, edges[:, 1]], axis=2) / rest_length - 1)
    return pd.DataFrame({
        "rms": np.sqrt(total / mass.sum()),
        "max": np.linalg.norm(moved, axis=2).max(1),
        "captured": (deltas**2).sum((1, 2)) / np.where(total > 0, total, 1),
        "strain_median": np.median(strain, axis=1),
        "strain_p95": np.quantile(strain, 0.95, axis=1),
    })


def page(path: Path, bundle: Bundle, triangles: np.ndarray, deltas: np.ndarray, modes: np.ndarray, medoids: list[int],
         ranking: pd.DataFrame, comparison: pd.DataFrame) -> None:
    """One self-contained HTML page: shapes of the medoids, the cloud of runs, similarity, tables."""
    shapes = make_subplots(cols=len(medoids), rows=1, specs=[[{"type": "scene"}] * len(medoids)],
                           subplot_titles=[f"mode {mode}: {bundle.runs[run]}" for mode, run in enumerate(medoids)])
    for column, run in enumerate(medoids, start=1):
        x, y, z = bundle.positions[run][-1].T
        i, j, k = triangles.T
        shapes.add_trace(go.Mesh3d(x=x, y=y, z=z, i=i, j=j, k=k, intensity=z - bundle.rest[:, 2], coloraxis="coloraxis", flatshading=True), row=1, col=column)
    shapes.update_scenes(aspectmode="data")
    cloud = go.Figure()
    for mode in range(len(medoids)):
        members = np.flatnonzero(modes == mode)
        x, y, z = deltas[members, 1:4, 2].T
        cloud.add_trace(go.Scatter3d(x=x, y=y, z=z, mode="markers", name=f"mode {mode}", text=[bundle.runs[run] for run in members], marker={"size": 4}))
    similarity = go.Figure()
    for mode in range(len(medoids)):
        rows = ranking[ranking["mode"] == mode]
        similarity.add_trace(go.Bar(x=rows["run"], y=rows["similarity"], name=f"to mode {mode}"))
    figures = [figure.to_html(full_html=False, include_plotlyjs=first) for figure, first in ((shapes, True), (cloud, False), (similarity, False))]
    tables = [ranking[ranking["rank"] <= 9].to_html(index=False), comparison.to_html(index=False, float_format="%.3f")]
    path.write_text("<!doctype html><meta charset='utf-8'><title>Runs</title>" + "".join(figures + tables), encoding="utf-8")


class Clock:
    """Seconds of named stages."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        self.seconds[name] = round(time.perf_counter() - start, 3)


def analyze(folder: Path, out: Path, k: int, join_distance: float | None, seed: int) -> dict[str, object]:
    clock = Clock()
    out.mkdir(parents=True, exist_ok=True)
    with clock.stage("read"):
        bundle = read_bundle(folder)
        rest = bundle.rest
    with clock.stage("operator"):
        triangles = triangulate(rest, bundle.quads)
        stiffness, mass = operator(rest, triangles)
        prolongation = sp.identity(len(rest), format="csr") if join_distance is None else join(rest, stiffness, join_distance)
    with clock.stage("eigenbasis"):
        eigenvalues, vectors = eigenbasis(stiffness, mass, prolongation, k)
        null = np.flatnonzero(eigenvalues < 1e-9 * eigenvalues[-1])
    with clock.stage("project"):
        weighted = vectors * mass
        baseline = weighted @ rest
        deltas = [weighted @ (states - rest) for states in bundle.positions]
        edges = np.unique(np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1), axis=0)
        measures = [state_measures(states, rest, mass, delta, edges) for states, delta in zip(bundle.positions, deltas)]
        final = np.array([delta[-1] for delta in deltas])
    with clock.stage("modes"):
        modes, scores = cluster(final.reshape(len(final), -1), seed)
        members = [np.flatnonzero(modes == mode) for mode in range(modes.max() + 1)]
        medoids = [int(runs[medoid(final[runs])]) for runs in members]
    with clock.stage("descriptors"):
        coordinates = final + baseline
        descriptors = [select(coordinates[run]) for run in medoids]
    with clock.stage("rivals"):
        displacements = bundle.final.reshape(len(final), -1)
        pca = PCA(max(len(chosen) for chosen in descriptors)).fit(displacements)
        scores_of_runs = pca.transform(displacements)
        comparison = []
        for mode, (run, chosen) in enumerate(zip(medoids, descriptors)):
            target, m = bundle.positions[run][-1], len(chosen)
            with_null = np.union1d(chosen, null)
            shapes = {
                "descriptor": vectors[with_null].T @ coordinates[run][with_null],
                "first M": vectors[:m].T @ coordinates[run][:m],
                "first K": vectors.T @ coordinates[run],
                "PCA": rest + (pca.mean_ + scores_of_runs[run, :m] @ pca.components_[:m]).reshape(-1, 3),
            }
            comparison += [{"mode": mode, "run": bundle.runs[run], "set": name, "M": k if name == "first K" else m, **errors(shape, target, rest, mass)}
                           for name, shape in shapes.items()]
    with clock.stage("ranking"):
        rows = []
        for mode, (run, chosen) in enumerate(zip(medoids, descriptors)):
            similarity = cosine(coordinates[:, chosen], coordinates[run, chosen])
            order = np.argsort(-similarity, kind="stable")
            rows += [{"mode": mode, "rank": rank, "run": bundle.runs[other], "similarity": similarity[other]} for rank, other in enumerate(order)]
        ranking = pd.DataFrame(rows)
    with clock.stage("write"):
        comparison_table = pd.DataFrame(comparison)
        counts = [len(times) for times in bundle.times]
        keys = pd.DataFrame({"run": np.repeat(bundle.runs, counts), "state": np.concatenate([np.arange(n) for n in counts]), "time": np.concatenate(bundle.times)})
        values = pd.DataFrame(np.concatenate(deltas).reshape(sum(counts), -1).astype(np.float32), columns=[f"d{number}_{axis}" for number in range(1, k + 1) for axis in "xyz"])
        pd.concat([keys, pd.concat(measures, ignore_index=True), values], axis=1).to_parquet(out / "coefficients.parquet")
        pd.DataFrame({"run": bundle.runs, "mode": modes, "medoid": [bundle.runs[medoids[mode]] for mode in modes]}).to_parquet(out / "modes.parquet")
        ranking.to_csv(out / "ranking.csv", index=False)
        comparison_table.to_csv(out / "comparison.csv", index=False)
        np.savez(out / "basis.npz", eigenvalues=eigenvalues, eigenvectors=vectors.astype(np.float32), mass=mass, baseline=baseline)
    with clock.stage("page"):
        page(out / "report.html", bundle, triangles, final, modes, medoids, ranking, comparison_table)
    return {
        "runs": len(bundle.runs),
        "states": sum(counts),
        "modes": [{"medoid": bundle.runs[run], "members": len(runs), "M": len(chosen)} for run, runs, chosen in zip(medoids, members, descriptors)],
        "silhouette": scores,
        "seconds": clock.seconds,
    }


def surroundings() -> dict[str, object]:
    packages = ("lasso-python", "numpy", "scipy", "scikit-learn")
    pools = [{key: pool.get(key) for key in ("internal_api", "version", "architecture", "num_threads")} for pool in threadpool_info()]
    return {"versions": {name: version(name) for name in packages}, "threads": pools}


def main() -> None:
    parser = argparse.ArgumentParser(description="crumple analyze, written with lasso-python, SciPy and scikit-learn")
    parser.add_argument("bundle", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("-K", type=int, default=500, help="number of eigenpairs")
    parser.add_argument("--join", type=float, help="distance up to which mutually nearest vertices are joined")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    start = time.perf_counter()
    result = analyze(args.bundle, args.out, args.K, args.join, args.seed)
    result["seconds"]["all but imports"] = round(time.perf_counter() - start, 3)
    result["peak_mb"] = round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    print(json.dumps(result | surroundings()))


if __name__ == "__main__":
    main()
