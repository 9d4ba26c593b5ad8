"""From one number to all: how error and ranking depend on how many are kept. Every labelled run is rebuilt and is the query in turn."""

import matplotlib.pyplot as plt
import numpy as np
import rivals
from cases import MODES, SELECTS
from drawing import METHOD
from judge import average_precision
from pages import table
from quality import ranked

AT = (1, 2, 3, 5, 10, 14, 20, 50, 100, 200, 500)


def precisions(products, squares, label, query):
    """Average precision of a query for each number of dimensions kept, from running sums R x D of products and squares."""
    length = np.sqrt(squares * squares[query])
    cosines = products / np.where(length > 0, length, np.inf)
    return [average_precision(label[ranked(column, query)] == label[query]) for column in cosines.T]


def spectral(case, select_by, sort):
    """Mean over the runs of each mode, 500 each: RMS error in mm, average precision; eigenvectors in the order of the query's
    largest coefficients (`sort`) or of frequency."""
    values = case.values[select_by]
    null = [0, 1]  # always in a reconstruction
    out = {}
    for mode in MODES:
        errors, ranks = [], []
        for query in case.members(mode):
            own = values[query]
            order = np.argsort(-np.abs(own).max(1), kind="stable") if sort else np.arange(len(own))
            products = np.cumsum((values[:, order] * own[order]).sum(2), axis=1)
            squares = np.cumsum((values[:, order] ** 2).sum(2), axis=1)
            ranks.append(precisions(products, squares, case.label, query))
            function = case.shapes[query] if select_by == "coordinates" else case.displacements[query]
            energy = (own[order] ** 2).sum(1)
            energy[np.isin(order, null)] = 0
            caught = np.cumsum(energy) + (own[null] ** 2).sum()
            errors.append(np.sqrt(np.maximum(case.rms(function) ** 2 - caught / case.mass.sum(), 0)))
        out[mode] = np.mean(errors, 0), np.mean(ranks, 0)
    return out


def components(case, without):
    """The same for principal components, trained on all runs, or for each mode without it and without mixed runs."""
    out = {}
    for mode in MODES:
        train = np.flatnonzero((case.label != mode) & (case.label != "mixed")) if without else np.arange(len(case.runs))
        pca = rivals.Pca(case, train)
        scores, members = pca.scores, case.members(mode)
        ranks = [precisions(np.cumsum(scores * scores[query], axis=1), np.cumsum(scores**2, axis=1), case.label, query) for query in members]
        out[mode] = pca.errors(members).mean(0)[1:], np.mean(ranks, 0)
    return out


def found(bench):
    case = bench.cases["apart"]
    if not hasattr(bench, "curves"):
        bench.curves = {
            (select, method): spectral(case, select, method == "descriptor") for select in SELECTS for method in ("descriptor", "first M")
        }
        bench.curves |= {("difference", "PCA"): components(case, False), ("difference", "PCA, mode unseen"): components(case, True)}
    return bench.curves


def mean(curve, what):
    """Mean of the modes, as far as all of them go."""
    shortest = min(len(curve[mode][what]) for mode in MODES)
    return np.mean([curve[mode][what][:shortest] for mode in MODES], axis=0)


def curves_table(bench):
    curves = found(bench)
    rows = []
    for kept in AT:
        cells = []
        for curve in curves.values():
            errors, ranks = mean(curve, 0), mean(curve, 1)
            cells.append(f"{errors[kept - 1]:.1f}, {ranks[kept - 1]:.3f}" if kept <= len(errors) else "–")
        rows.append([kept, *cells])
    words = {"coordinates": "coordinates", "difference": "differences"}
    return table(["M", *[f"{method}, {words[select]}" if "PCA" not in method else method for select, method in curves]], rows)


def curves_picture(bench):
    figure, axes = plt.subplots(2, 2, figsize=(9.4, 6.6), layout="constrained", sharex=True)
    for (select, method), curve in found(bench).items():
        column, own = SELECTS.index(select), 1 if "PCA" in method else 3
        for row in range(2):
            for mode in MODES:
                axes[row, column].plot(own * (np.arange(len(curve[mode][row])) + 1), curve[mode][row], color=METHOD[method], lw=0.5, alpha=0.45)
            values = mean(curve, row)
            style = {"descriptor": "-", "first M": "--"}.get(method, "-.")
            axes[row, column].plot(own * (np.arange(len(values)) + 1), values, color=METHOD[method], lw=1.8, ls=style, label=method)
    turned, at = (
        np.mean([row["mean_average_precision"] for row in bench.cases["apart"].compared["rotation"]]),
        bench.cases["apart"].compared["rotation"][0]["size"],
    )
    for column, words in enumerate(("coordinates", "differences")):
        axes[0, column].set(title=words, yscale="log", ylabel="RMS error, mm", ylim=(0.7, 200))
        axes[1, column].plot(at, turned, "D", ms=5, color=METHOD["rotation spectrum"], label="rotation spectrum")
        axes[1, column].set(
            xscale="log", xlabel="numbers kept (3 an eigenvector, 1 a component)", ylabel="average precision, mean over queries", ylim=(0.3, 1)
        )
    axes[0, 0].legend(loc="lower left", fontsize=8)
    axes[0, 1].legend(loc="lower left", fontsize=8)
    axes[1, 1].legend(*[found[-1:] for found in axes[1, 1].get_legend_handles_labels()], loc="lower right", fontsize=8)
    return figure


TABLES = {"curves": curves_table}
PICTURES = {"experiment-curves": curves_picture}
