"""PCA and deformations that it was not trained on: the paper's argument for a basis made of the part's geometry alone.

A set of runs is taken out; each of them is then rebuilt and is the query of a ranking. Trained *with* them, PCA has seen the
very run; *each left out*, all others of its kind; *unseen*, none of its kind (mixed runs, which are half of one kind, are out as well).
"""

import dimred
import numpy as np
import rivals
from cases import MODES
from pages import table
from quality import mean_average_precision


def spectral_errors(case, runs, count_of, sort):
    """RMS error of differences rebuilt from the eigenvectors of largest coefficient, or of lowest frequency, by run."""
    out = []
    for run in runs:
        values, whole = case.bundle.delta[run], case.rms(case.displacements[run])
        energy = (values**2).sum(1)
        if sort:
            energy = energy[np.argsort(-np.abs(values).max(1), kind="stable")]
        left = whole**2 - energy[: count_of(run)].sum() / case.mass.sum()
        out.append(np.sqrt(max(left, 0)))
    return np.array(out)


def unseen(bench):
    case, rows = bench.cases["apart"], []
    everything, size = np.arange(len(case.runs)), lambda run: rivals.size_of(case, run)
    kinds = {mode: (case.members(mode), np.flatnonzero((case.label != mode) & (case.label != "mixed"))) for mode in MODES}
    beyond = case.fold_positions > case.rest[:, 0].max() / 2
    hit = np.flatnonzero((case.label == "crush") & case.bundle.clear & beyond)
    kinds["crush at the hit end"] = hit, np.flatnonzero((case.label != "mixed") & ~((case.label == "crush") & beyond))
    for kind, (runs, others) in kinds.items():
        whole = case.rms(case.displacements[runs])
        ranks = lambda similarity: f"{mean_average_precision(similarity, case.label, runs):.3f}"
        delta = case.values["difference"]
        found = [
            ("descriptor", "3M", spectral_errors(case, runs, size, True), ranks(rivals.descriptor(delta))),
            ("first M", "3M", spectral_errors(case, runs, size, False), ranks(rivals.first(delta))),
        ]
        trained = {"with them": rivals.Pca(case, everything), "unseen": rivals.Pca(case, others)}
        alone = {run: rivals.Pca(case, np.setdiff1d(everything, [run])) for run in runs}
        for share, numbers in ((1, "M"), (3, "3M")):
            at = lambda errors, run: errors[min(share * size(run), len(errors) - 1)]
            for words in ("with them", "each left out", "unseen"):
                of = (lambda run: alone[run]) if words == "each left out" else (lambda run: trained[words])
                errors = np.array([at(of(run).errors([run])[0], run) for run in runs])
                found.append((f"PCA, {words}", numbers, errors, ranks(lambda run: rivals.components(case, of(run), share)(run))))
        rows += [
            [
                f"{kind} ({len(runs)} runs)" if method == "descriptor" else "",
                method,
                numbers,
                f"{errors.mean():.1f}",
                f"{100 * (errors / whole).mean():.1f} %",
                f"{100 * (errors / whole).max():.1f} %",
                rank,
            ]
            for method, numbers, errors, rank in found
        ]
    return table(["runs", "rebuilt from", "numbers", "mean error, mm", "of the displacement", "worst run", "mean AP"], rows, 3)


def few(bench):
    """Trained on few runs of other kinds, all components used, beside the descriptor of as many numbers; mean of draws and runs."""
    case, rows = bench.cases["apart"], []
    counts, draws = (5, 10, 20, 40), 10
    for mode in MODES:
        runs, others = case.members(mode), np.flatnonzero((case.label != mode) & (case.label != "mixed"))
        whole, cells = case.rms(case.displacements[runs]), []
        for count in counts:
            random = np.random.default_rng(count)
            errors = [rivals.Pca(case, random.choice(others, count, replace=False)).errors(runs)[:, -1] for _ in range(draws)]
            same = spectral_errors(case, runs, lambda run: -(-(count - 1) // 3), True)
            cells += [f"{100 * (np.mean(errors, 0) / whole).mean():.1f} %", f"{100 * (same / whole).mean():.1f} %"]
        rows.append([mode, *cells])
    return table(
        ["runs", *[words for count in counts for words in (f"PCA of {count} runs", f"descriptor, {3 * -(-(count - 1) // 3)} numbers")]], rows
    )


def lasso(bench):
    found = dimred.what_stops(bench.cases["apart"], bench.cases.get("fine"), bench.options.scratch)
    return table(["function of lasso-python " + dimred.VERSION, "what it says"], found, 2)


def lasso_fine(bench):
    """The command line's own ten numbers of each run, where the mesh has nodes enough for it."""
    if "fine" not in bench.cases:
        return None
    case = bench.cases["fine"]
    runs, betas = dimred.command_line(case, bench.options.scratch)
    at = np.array([case.runs.index(run) for run in runs])
    label = case.label[at]
    rows = []
    for name, similarity in (
        ("`dimred`: betas", rivals.of_rows(betas)),
        *[
            (words, lambda query, of=of: of(at[query])[at])
            for words, of in (
                ("descriptor, coordinates", rivals.descriptor(case.values["coordinates"])),
                ("rotation spectrum", rivals.rotation(case)),
            )
        ],
    ):
        means = [mean_average_precision(similarity, label, np.flatnonzero(label == mode)) for mode in MODES]
        rows.append([name, *[f"{mean:.3f}" for mean in means], f"{np.mean(means):.3f}"])
    return table([f"mean AP on the fine mesh, {len(runs)} runs", *MODES, "mean"], rows)


def lasso_rebuilds(bench):
    """Errors of the shapes that the ten betas rebuild, and groups of them."""
    from sklearn.metrics import adjusted_rand_score

    case = bench.cases["apart"]
    betas = dimred.Betas(case)
    errors = np.array([case.rms(betas.shape(run) - case.shapes[run]) / case.rms(case.displacements[run]) for run in range(len(case.runs))])
    kept, groups = case.label != "mixed", betas.groups(3)
    index = adjusted_rand_score(case.label[kept], groups[kept])
    return table(
        ["", *MODES, "mean"],
        [
            [
                "error of the displacement, 10 betas, trained with all runs",
                *[f"{100 * errors[case.members(mode)].mean():.1f} %" for mode in MODES],
                f"{100 * errors[kept].mean():.1f} %",
            ],
            ["three k-means groups, adjusted Rand index", "", "", "", f"{index:.2f}"],
        ],
    )


TABLES = {"unseen": unseen, "few": few, "dimred": lasso, "dimred rebuilds": lasso_rebuilds, "dimred, fine": lasso_fine}
