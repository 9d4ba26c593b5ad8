"""The program's figures beside an independent implementation, other similarities, and the same pipeline on other structures."""

import json
import os
import shutil
import subprocess

import numpy as np
import ranking_reference as reference
from cases import MODES
from pages import table

SUBSETS = {"descriptor": "descriptor", "first M": "first M", "first 500": "first K", "PCA": "PCA"}


def plain(bench, join):
    """The independent study of the coarse beam: LAPACK's dense eigenvectors, NumPy for everything else."""
    if not hasattr(bench, "plain"):
        bench.plain = {}
    if join not in bench.plain:
        case = bench.cases["apart"]
        bench.plain[join] = reference.read_study(reference.Path(case.bundle.runs_folder), reference.Path(case.labels), join, 500)
    return bench.plain[join]


def agreement(bench):
    rows = []
    for name, join in (("apart", None), ("joined", 2.5)):
        case, study = bench.cases[name], plain(bench, join)
        for method, subset in SUBSETS.items():
            sizes, nine, average, mean = [], [], [], []
            for select, function in (("coordinates", "coordinates"), ("difference", "displacements")):
                if method == "PCA" and select == "coordinates":
                    continue
                rank = (
                    reference.pca_ranker(study)
                    if method == "PCA"
                    else reference.ranker(study.coefficients[function], study.coefficients[function], subset)
                )
                for mode, (size, precision, precisions, means) in reference.judged(study, rank).items():
                    row = case.row(mode, select, method)
                    assert study.runs[study.representative(mode)] == row["query"]
                    sizes.append(abs(size - row["size"]))
                    nine.append(abs(precision - row["precision_at_9"]))
                    average.append(abs(precisions - row["average_precision"]))
                    mean.append(abs(means - row["mean_average_precision"]))
            rows.append(
                [name if method == "descriptor" else "", method, len(sizes), max(sizes), *[f"{max(values):.4f}" for values in (nine, average, mean)]]
            )
    return table(["beam", "method", "rows", "M", "precision at 9", "average precision", "mean AP"], rows, 2)


def variations(bench):
    """The same sets compared otherwise: mean average precision over all runs of each mode."""
    study, rows = plain(bench, None), []
    for name, function, chosen, compared, euclidean in reference.variations(study):
        found = reference.judged(study, reference.ranker(chosen, compared, "descriptor", euclidean=euclidean))
        means = [found[mode][3] for mode in MODES]
        rows.append(
            [
                {"displacements": "differences"}.get(function, function) if name == "cosine" else "",
                name,
                *[f"{mean:.3f}" for mean in means],
                f"{np.mean(means):.3f}",
            ]
        )
    return table(["coefficients", "similarity", *MODES, "mean"], rows, 2)


def certificate(bench):
    """What `crumple init` says of the basis of each beam."""
    rows = []
    for name, case in bench.beams.items():
        study = os.path.join(bench.options.scratch, "certified")
        shutil.rmtree(study, ignore_errors=True)
        run = os.path.join(case.bundle.runs_folder, case.runs[0])
        join = ["--join", "2.5"] if "joined" in name else []
        said = subprocess.run(
            [case.program, "--quiet", "--json", "init", study, "--reference", run, *join], check=True, capture_output=True, text=True
        )
        found = json.loads(said.stdout)
        pairs = ", ".join("–".join(map(str, (group[0], group[-1]))) for group in found["clusters"]) or "none"
        complete = "yes" if found["complete"] else "no"
        rows.append(
            [
                name,
                found["null_space"],
                complete,
                f"{found['residual']:.0e}",
                f"{found['orthogonality']:.0e}",
                f"{found['residual_stored']:.0e}",
                pairs,
            ]
        )
    head = [
        "beam",
        "zero eigenvalues",
        "counts agree",
        "residual over λ₅₀₀",
        "orthogonality",
        "residual as stored, f32",
        "equal within the solver's tolerance",
    ]
    return table(head, rows)


def structures(bench):
    rows = []
    for name, case in bench.structures.items():
        for mode in case.modes:
            row = {method: case.row(mode, "difference", method) for method in ("descriptor", "first M", "first 500", "PCA")}
            other, turned = case.row(mode, "coordinates", "descriptor"), case.row(mode, "rotation", "rotation spectrum")
            errors = [f"{100 * row[method]['relative']:.1f} %" for method in row]
            means = [f"{one['mean_average_precision']:.2f}" for one in (row["descriptor"], row["first M"], row["PCA"], turned)]
            rows.append([name if mode == case.modes[0] else "", mode, other["size"], row["descriptor"]["size"], *errors, *means])
    return table(
        [
            "structure",
            "mode",
            "M, coordinates",
            "M, differences",
            "error: descriptor",
            "first M",
            "first 500",
            "PCA, M",
            "mean AP: descriptor",
            "first M",
            "PCA, M",
            "rotation",
        ],
        rows,
        2,
    )


TABLES = {"agreement": agreement, "similarities": variations, "certificate": certificate, "structures": structures}
