"""How isometric the runs are, what that does to eigenvalues and eigenvectors, and what it does to similarity.

The basis of a study is that of the undeformed part. For the check `crumple eigen RUN@last` computes that of a deformed state as a
mesh of its own: the same vertices and triangles, the two sheets apart.
"""

import os
import subprocess

import matplotlib.pyplot as plt
import numpy as np
import rivals
from cases import MODES
from drawing import COLOUR, MARK, legend_of_labels
from judge import average_precision
from pages import table
from quality import cosine, ranked
from safetensors.numpy import load_file
from scipy.stats import spearmanr

COUNT = 50  # eigenpairs compared
NULL = 2


def strains(bench):
    """From the measures that the study stores with each state: quantiles over a state's edges and faces, then over runs."""
    rows = []
    for name in [name for name in ("apart", "fine") if name in bench.cases]:
        case = bench.cases[name]
        states, measures = case.bundle.states, case.bundle.measures
        label = dict(zip(case.runs, case.label))
        of_run = np.array([label[run] for run in states.run])
        for number in range(1, int(states.state.max()) + 1):
            at = (states.state == number).to_numpy()
            last = number == states.state.max()
            for group in ("all", *MODES) if last else ("all",):
                of = at & (of_run == group) if group != "all" else at
                rigid = 100 * measures.rigid_share.to_numpy()[of]
                cells = [f"{np.median(rigid):.0f} ({rigid.min():.0f}…{rigid.max():.0f})"]
                for column in ("strain_median", "strain_p95", "area_median", "area_p95"):
                    values = 100 * measures[column].to_numpy()[of]
                    cells.append(f"{np.median(values):.1f} ({values.min():.1f}…{values.max():.1f})")
                rows.append([name if number == 1 else "", f"{states.time.to_numpy()[at].mean():.0f} ms, {group}", *cells])
    head = [
        "beam",
        "state, runs",
        "rigid motion, % of the displacement's square",
        "edge strain, median of a state, %",
        "95 % quantile",
        "area strain, median of a state, %",
        "95 % quantile",
    ]
    return table(head, rows, 2)


def vertex_areas(case, points):
    """A third of each face's area to each of its corners, N."""
    corners = points[case.triangles]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return np.bincount(case.triangles.ravel(), np.repeat(area / 3, 3), len(points))


def eigenpairs(bench, case, run, state=""):
    """Eigenvalues, eigenvectors of a run's surface by `crumple eigen`: undeformed, or in a state."""
    basis = os.path.join(bench.options.scratch, "shape.safetensors")
    mesh = os.path.join(case.bundle.runs_folder, run) + state
    subprocess.run([case.program, "--quiet", "eigen", mesh, "-K", str(COUNT), "-o", basis], check=True, stdout=subprocess.DEVNULL)
    found = load_file(basis)
    expected = case.shapes[case.runs.index(run)] if state else case.rest
    assert np.allclose(found["points"], expected, atol=1e-5), "the vertices are those of the study"
    return found["eigenvalues"], found["eigenvectors"]


def shifts(bench):
    """Of the last state of every run: quantities by name."""
    if not hasattr(bench, "shifts"):
        case = bench.cases["apart"]
        values, vectors = eigenpairs(bench, case, case.runs[0])
        out = {name: [] for name in ("shift", "largest", "scale", "area", "rest", "rest largest", "span", "shape")}
        for run, shape in zip(case.runs, case.shapes):
            own_values, own = eigenpairs(bench, case, run, "@last")
            ratio = own_values[NULL:] / values[NULL:]
            scale = np.exp(np.log(ratio).mean())
            out["shift"].append(np.median(np.abs(ratio - 1)))
            out["largest"].append(np.abs(ratio - 1).max())
            out["scale"].append(scale)
            out["area"].append(case.mass.sum() / vertex_areas(case, shape).sum())
            out["rest"].append(np.median(np.abs(ratio / scale - 1)))
            out["rest largest"].append(np.abs(ratio / scale - 1).max())
            # Share of one span in the other, in the undeformed mass: own vectors made orthonormal there.
            root = np.sqrt(case.mass)
            basis = np.linalg.qr((own * root).T)[0]
            out["span"].append(np.linalg.norm((vectors * root) @ basis) ** 2 / COUNT)
            # How well each basis of 50 rebuilds the deformed coordinates, as a ratio of RMS errors.
            errors = [
                np.linalg.norm(root[:, None] * shape - space @ (space.T @ (root[:, None] * shape)))
                for space in (np.linalg.qr((vectors * root).T)[0], basis)
            ]
            out["shape"].append(errors[0] / errors[1])
        bench.shifts = {name: np.array(values) for name, values in out.items()}
    return bench.shifts


def shift_table(bench):
    case, found, rows = bench.cases["apart"], shifts(bench), []
    words = {
        "shift": "shift of eigenvalues 3 to 50: median, %",
        "largest": "largest, %",
        "scale": "common factor",
        "area": "undeformed over deformed area",
        "rest": "shift beside the factor: median, %",
        "rest largest": "largest beside it, %",
        "span": "share of the span of 50 that is common",
        "shape": "error of 50 undeformed over that of 50 own",
    }
    for group in ("all", *MODES, "mixed"):
        of = np.ones(len(case.runs), bool) if group == "all" else case.label == group
        cells = []
        for name in words:
            values = found[name][of] * (100 if words[name].endswith("%") else 1)
            digits = 1 if words[name].endswith("%") else 2
            cells.append(f"{np.median(values):.{digits}f} ({values.min():.{digits}f}…{values.max():.{digits}f})")
        rows.append([group, *cells])
    return table(["runs", *words.values()], rows)


def last_measure(case, column):
    states = case.bundle.states
    last = ~states.run.duplicated(keep="last").to_numpy()
    return case.bundle.measures[column].to_numpy()[last]


def loss(bench):
    """Strain of a run against what its similarities are worth, over the clear runs: rank correlations with their 5 % bound."""
    case, rows, significant = bench.cases["apart"], [], []
    clear = np.flatnonzero(case.bundle.clear & (case.label != "mixed"))
    measures = {
        "edge strain, 95 % quantile": last_measure(case, "strain_p95"),
        "area strain, 95 % quantile": last_measure(case, "area_p95"),
        "eigenvalue shift, median": shifts(bench)["shift"],
        "share of the span lost": 1 - shifts(bench)["span"],
    }
    for what, similarity in (
        ("coordinates", rivals.descriptor(case.values["coordinates"])),
        ("differences", rivals.descriptor(case.values["difference"])),
        ("rotation spectrum", rivals.rotation(case)),
    ):
        precision = np.array([average_precision(case.label[ranked(similarity(run), run)] == case.label[run]) for run in clear])
        to_medoid = np.array([1 - similarity(case.queries[case.label[run]])[run] for run in clear])
        for place, (name, values) in enumerate(measures.items()):
            cells = []
            for target in (to_medoid, precision):
                # Within a mode: modes differ in both, and that would be taken for an effect.
                found = [spearmanr(values[clear][of], target[of]) for of in (case.label[clear] == mode for mode in MODES)]
                significant += [one.pvalue < 0.05 for one in found]
                cells += [" / ".join(f"{one.statistic:+.2f}{'*' if one.pvalue < 0.05 else ''}" for one in found)]
            rows.append([what if place == 0 else "", name, *cells])
    return (
        table(
            ["compared by", "strain measure", "ρ with 1 − similarity to the representative", "ρ with the run's average precision as the query"],
            rows,
            2,
        )
        + f"\n\n{sum(significant)} of {len(significant)} correlations have p < 0.05, where chance alone gives {0.05 * len(significant):.0f}."
    )


def own_metric(bench):
    """Similarities with the areas of each deformed shape in place of the undeformed ones: what the choice of metric matters."""
    case, rows = bench.cases["apart"], []
    vectors = case.bundle.eigenvectors.astype(float)
    areas = [vertex_areas(case, shape) for shape in case.shapes]
    functions = {"coordinates": case.shapes, "differences": case.displacements}
    for words, function in functions.items():
        stored = case.values["coordinates" if words == "coordinates" else "difference"]
        other = np.array([(vectors * mass) @ values for mass, values in zip(areas, function)])
        same = np.array([cosine(one[None], two)[0] for one, two in zip(stored, other)])
        means = [
            [
                np.mean([average_precision(case.label[ranked(similarity(run), run)] == case.label[run]) for run in case.members(mode)])
                for mode in MODES
            ]
            for similarity in (rivals.descriptor(stored), rivals.descriptor(other))
        ]
        rows.append([words, f"{np.median(same):.4f}", f"{same.min():.4f}", *[" / ".join(f"{value:.3f}" for value in row) for row in means]])
    return table(["coefficients", "cosine of both, median run", "least", "mean AP, undeformed areas", "mean AP, deformed areas"], rows)


def picture(bench):
    case, found = bench.cases["apart"], shifts(bench)
    strain = 100 * last_measure(case, "strain_p95")
    similarity = rivals.descriptor(case.values["difference"])
    figure, axes = plt.subplots(1, 3, figsize=(10.4, 3.6), layout="constrained")
    panels = [
        (100 * found["shift"], "shift of eigenvalues 3 to 50, median, %"),
        (found["span"], "share of the span of 50 eigenvectors"),
        (
            np.array(
                [
                    average_precision(case.label[ranked(similarity(run), run)] == label) if label != "mixed" else np.nan
                    for run, label in enumerate(case.label)
                ]
            ),
            "average precision of the run\nas the query, differences",
        ),
    ]
    for panel, (values, words) in zip(axes, panels):
        for label in COLOUR:
            of = case.label == label
            panel.plot(strain[of], values[of], MARK[label], color=COLOUR[label], ms=4)
        panel.set(xlabel="edge strain, 95 % quantile, %", ylabel=words)
    legend_of_labels(axes[1], loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, fontsize=8)
    return figure


TABLES = {"strains": strains, "shifts": shift_table, "strain and similarity": loss, "own metric": own_metric}
PICTURES = {"experiment-isometry": picture}
