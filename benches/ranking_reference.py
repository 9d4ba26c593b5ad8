#!/usr/bin/env python3
"""How well coefficients rank the runs of the hat-section bundle: an independent calculation in Python.

    python ranking_reference.py BUNDLE [--labels labels.csv] [--join 2.5] [--variations] [--modes]

Eigenvectors from LAPACK's dense solver (nearly equal pairs come apart as far as double precision allows),
everything else in NumPy. The conventions:

- Coefficients C = Phi^T M f of the final state, K x 3, with f the coordinates or the displacements, Phi^T M Phi = I.
- Descriptor of a run: the eigenvectors of which an |C| in x, y or z is above mean + one standard deviation (of the
  population) of all 3K |C|. The null space takes part like any other eigenvector. M is their number.
- "first M": eigenvectors 1 to M; "first K": all K; "PCA": the first M principal components of the displacements of all
  final states, centred by their mean, vertices not weighted, with M of the descriptor of displacements.
- The query's set is used for every run: cosine of the 3M values as they are. The query itself is left out. A run counts as
  right when it has the query's label, clear or not; `mixed` runs are in the ranking and count as wrong.
- Average precision: mean, over the right runs, of the precision at their rank.
- The query of a mode is the medoid of its clear runs: the smallest mean Euclidean distance of displacements (3N numbers). The
  last column is the mean of the average precision over all runs of the mode, each with its own descriptor.

`--variations` compares the values centred by the mean of all final states, weighted by the square root of the eigenvalue or
by one over the spread, or by Euclidean distance; the choice of the set stays. `--modes` clusters the final states.
"""
from __future__ import annotations

import argparse
import csv
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from sklearn.cluster import AgglomerativeClustering, KMeans
from sklearn.metrics import adjusted_rand_score, silhouette_score

from analyze_peer import join, medoid, operator, read_bundle, select, triangulate

MODES = ("crush", "down", "up")
NEAREST = 9


@dataclass
class Study:
    """The final states of all runs in one eigenbasis."""

    runs: list[str]
    labels: np.ndarray  # of each run
    clear: np.ndarray  # of each run, bool
    eigenvalues: np.ndarray  # K
    displacements: np.ndarray  # R x N x 3
    coefficients: dict[str, np.ndarray]  # R x K x 3 by function

    def representative(self, mode: str) -> int:
        members = np.flatnonzero((self.labels == mode) & self.clear)
        return int(members[medoid(self.displacements[members])])


def read_labels(path: Path, runs: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Label and "clear" of each run; a run stands in the table as `run_007` or as 7."""
    with path.open(newline="") as file:
        rows = {row["run"].removeprefix("run_").lstrip("0"): row for row in csv.DictReader(file)}
    found = [rows[run.removeprefix("run_").lstrip("0")] for run in runs]
    return np.array([row["label"] for row in found]), np.array([row["clear"] == "true" for row in found])


def dense_eigenbasis(stiffness: sp.csr_matrix, mass: np.ndarray, prolongation: sp.csr_matrix, k: int) -> tuple[np.ndarray, np.ndarray]:
    """The k smallest eigenpairs of L x = lambda M x: eigenvalues (K), eigenvectors (K x N)."""
    scale = 1 / np.sqrt(prolongation.T @ mass)
    symmetric = sp.diags(scale) @ (prolongation.T @ stiffness @ prolongation) @ sp.diags(scale)
    eigenvalues, vectors = scipy.linalg.eigh(symmetric.toarray())
    return eigenvalues[:k], (prolongation @ (scale[:, None] * vectors[:, :k])).T


def read_study(folder: Path, labels: Path, distance: float | None, k: int) -> Study:
    bundle = read_bundle(folder)
    stiffness, mass = operator(bundle.rest, triangulate(bundle.rest, bundle.quads))
    prolongation = sp.identity(len(mass), format="csr") if distance is None else join(bundle.rest, stiffness, distance)
    eigenvalues, vectors = dense_eigenbasis(stiffness, mass, prolongation, k)
    weighted, displacements = vectors * mass, bundle.final
    of_displacements = weighted @ displacements
    return Study(bundle.runs, *read_labels(labels, bundle.runs), eigenvalues, displacements,
                 {"coordinates": of_displacements + weighted @ bundle.rest, "displacements": of_displacements})


Ranker = Callable[[int], tuple[int, np.ndarray]]  # query -> M, the other runs from the most similar on


def ranker(chosen_by: np.ndarray, compared: np.ndarray, subset: str, euclidean: bool = False) -> Ranker:
    """Ranks runs by `compared` (R x K x 3) on the query's set, which its `chosen_by` (R x K x 3) gives."""

    def rank(query: int) -> tuple[int, np.ndarray]:
        chosen = select(chosen_by[query])
        if subset != "descriptor":
            chosen = np.arange(compared.shape[1] if subset == "first K" else len(chosen))
        values = compared[:, chosen].reshape(len(compared), -1)
        if euclidean:
            similarity = -np.linalg.norm(values - values[query], axis=1)
        else:
            similarity = values @ values[query] / (np.linalg.norm(values, axis=1) * np.linalg.norm(values[query]))
        order = np.argsort(-similarity, kind="stable")
        return len(chosen), order[order != query]

    return rank


def pca_ranker(study: Study) -> Ranker:
    centred = (study.displacements - study.displacements.mean(axis=0)).reshape(len(study.runs), -1)
    u, s, _ = np.linalg.svd(centred, full_matrices=False)
    scores = (u * s)[:, :, None]

    def rank(query: int) -> tuple[int, np.ndarray]:
        m = len(select(study.coefficients["displacements"][query]))
        return m, ranker(scores, scores[:, :m], "first K")(query)[1]

    return rank


def average_precision(right: np.ndarray) -> float:
    """Mean precision at the ranks of the right ones; `right` in the order of the ranking."""
    return float((np.cumsum(right) / np.arange(1, len(right) + 1))[right].mean())


def judged(study: Study, rank: Ranker) -> dict[str, tuple[int, float, float, float]]:
    """By mode: M, precision at 9 and average precision of its representative, mean average precision over all its runs."""
    found = {}
    for mode in MODES:
        is_right = study.labels == mode
        m, order = rank(study.representative(mode))
        mean = np.mean([average_precision(is_right[rank(int(query))[1]]) for query in np.flatnonzero(is_right)])
        found[mode] = m, float(is_right[order[:NEAREST]].mean()), average_precision(is_right[order]), float(mean)
    return found


def evaluate(study: Study, rank: Ranker) -> Iterator[str]:
    """Table cells for each mode: mode, M, precision at 9, average precision, mean over all queries."""
    for mode, (m, precision, average, mean) in judged(study, rank).items():
        yield f"{mode} | {m} | {precision:.2f} | {average:.3f} | {mean:.3f} |"


def print_ranking(study: Study) -> None:
    print("Representatives: " + ", ".join(f"{mode} {study.runs[study.representative(mode)]}" for mode in MODES) + "\n")
    print("| method | function | mode | M (eigenvectors) | precision at 9 | average precision | mean AP, all queries of the mode |\n|---|---|---|---|---|---|---|")
    for function, values in study.coefficients.items():
        for subset in ("descriptor", "first M", "first K"):
            for cells in evaluate(study, ranker(values, values, subset)):
                print(f"| {subset} | {function} | {cells}")
    for cells in evaluate(study, pca_ranker(study)):
        print(f"| PCA | displacements | {cells}")


def variations(study: Study) -> Iterator[tuple[str, str, np.ndarray, np.ndarray, bool]]:
    """Name, function, values that choose the set, values that are compared on it, whether by distance instead of cosine."""
    frequency = np.sqrt(np.maximum(study.eigenvalues, 0))[:, None]
    for function, values in study.coefficients.items():
        centred, spread = values - values.mean(axis=0), values.std(axis=0)
        yield "cosine", function, values, values, False
        yield "centred", function, values, centred, False
        yield "weighted by √λ", function, values, values * frequency, False
        yield "centred, weighted by √λ", function, values, centred * frequency, False
        yield "weighted by 1/spread", function, values, values / spread, False
        yield "centred, weighted by 1/spread", function, values, centred / spread, False
        yield "Euclidean", function, values, values, True


def print_variations(study: Study) -> None:
    print("\n| compared | method | function | mode | M (eigenvectors) | precision at 9 | average precision | mean AP, all queries of the mode |\n|---|---|---|---|---|---|---|---|")
    for name, function, chosen, compared, euclidean in variations(study):
        for subset in ("descriptor", "first M", "first K"):
            for cells in evaluate(study, ranker(chosen, compared, subset, euclidean)):
                print(f"| {name} | {subset} | {function} | {cells}")


def print_modes(study: Study) -> None:
    """Adjusted Rand index of clusters of the final states against the labels; mixed runs are clustered but not counted."""
    deltas = study.coefficients["displacements"]
    frequency = np.sqrt(np.maximum(study.eigenvalues, 0))[:, None]
    counted = study.labels != "mixed"

    def rows(values: np.ndarray, unit: bool) -> np.ndarray:
        flat = values.reshape(len(values), -1)
        return flat / np.linalg.norm(flat, axis=1, keepdims=True) if unit else flat

    centred = deltas - deltas.mean(axis=0)
    features = {
        "raw": rows(deltas, unit=False),
        "unit length": rows(deltas, unit=True),
        "centred, unit length": rows(centred, unit=True),
        "weighted by sqrt(lambda)": rows(deltas * frequency, unit=False),
        "weighted by sqrt(lambda), unit length": rows(deltas * frequency, unit=True),
        "weighted by 1/spread": rows(centred / deltas.std(axis=0), unit=False),
    }
    algorithms = {"k-means": lambda count: KMeans(count, n_init=10, random_state=0), "Ward": lambda count: AgglomerativeClustering(count)}
    print("\n| features | algorithm | ARI, three modes | modes by silhouette | silhouette | ARI |\n|---|---|---|---|---|---|")
    for name, values in features.items():
        for algorithm, make in algorithms.items():
            found = {count: make(count).fit_predict(values) for count in range(2, 9)}
            scores = {count: silhouette_score(values, found[count]) for count in found}
            best = max(scores, key=scores.get)
            three, chosen = (adjusted_rand_score(study.labels[counted], found[count][counted]) for count in (3, best))
            print(f"| {name} | {algorithm} | {three:.2f} | {best} | {scores[best]:.2f} | {chosen:.2f} |")


def main() -> None:
    parser = argparse.ArgumentParser(description="ranking quality on the hat-section bundle, calculated independently")
    parser.add_argument("bundle", type=Path)
    parser.add_argument("--labels", type=Path, help="default: labels.csv in the bundle's folder or beside it")
    parser.add_argument("-K", type=int, default=500, help="number of eigenpairs")
    parser.add_argument("--join", type=float, help="distance up to which mutually nearest vertices are joined")
    parser.add_argument("--variations", action="store_true", help="other ways to compare")
    parser.add_argument("--modes", action="store_true", help="clusters of the final states")
    args = parser.parse_args()
    labels = args.labels or next(path for path in (args.bundle / "labels.csv", args.bundle.parent / "labels.csv") if path.exists())
    study = read_study(args.bundle, labels, args.join, args.K)
    print_ranking(study)
    if args.variations:
        print_variations(study)
    if args.modes:
        print_modes(study)


if __name__ == "__main__":
    main()
