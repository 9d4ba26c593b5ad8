"""The pictures of the paper's figures: the cloud, the shapes rebuilt, similarity of every run, the nine nearest."""

import glob

import matplotlib.pyplot as plt
import numpy as np
import pyarrow.parquet as pq
from cases import MODES
from drawing import COLOUR, MARK, colour_bar, draw, frame, legend_of_labels
from quality import NEAREST, ranked


def first_coefficients(case, count=2):
    """Run, time and coefficients of the first eigenvectors of every state, as the study stores them: S, S, S x count x 3."""
    columns = [f"d{k}_{axis}" for k in range(1, count + 1) for axis in "xyz"]
    table = pq.read_table(sorted(glob.glob(case.bundle.study + "/coefficients/*.parquet")), columns=["run", "time", *columns]).to_pandas()
    table = table.sort_values(["run", "time"])
    return table.run.to_numpy(), table.time.to_numpy(), table[columns].to_numpy(float).reshape(-1, count, 3) + case.bundle.baseline[:count]


def cloud(bench):
    case = bench.cases["joined"]
    run, time, values = first_coefficients(case)
    label = dict(zip(case.runs, case.label))
    figure, axes = plt.subplots(2, 2, figsize=(9, 6.6), layout="constrained")
    for row, (left, right) in enumerate(axes):
        x, z = values[:, row, 0] / 1000, values[:, row, 2] / 1000
        for name in case.runs:
            of = run == name
            left.plot(x[of], z[of], "-", lw=0.4, color=COLOUR[label[name]], alpha=0.5)
            left.plot(x[of][-1:], z[of][-1:], MARK[label[name]], ms=4.5, color=COLOUR[label[name]])
        points = right.scatter(x, z, c=np.round(time), s=11, cmap="viridis")
        for panel, colour in ((left, "label; lines: states of a run"), (right, "time")):
            panel.set(
                xlabel=f"$\\alpha^x_{row + 1}$, 1000 mm²", ylabel=f"$\\alpha^z_{row + 1}$, 1000 mm²", title=f"eigenvector {row + 1}, by {colour}"
            )
    legend_of_labels(axes[1, 0], loc="upper left", ncols=1, fontsize=8)
    figure.colorbar(points, ax=axes[:, 1], label="time, ms", ticks=np.unique(np.round(time)), fraction=0.05)
    return figure


def rebuilt(case):
    figure, axes = plt.subplots(4, 3, figsize=(9.6, 7.2), layout="constrained")
    rows = {}
    for mode in MODES:
        run = case.runs[case.queries[mode]]
        found = case.describe(run, f"shown-{mode}", "--kind", "paper")
        size = found["size"]
        near = {rival["method"]: rival["rms"] for rival in found["rivals"]}
        rows[mode] = [
            ("simulated: " + run, case.shapes[case.queries[mode]]),
            (f"500 eigenvectors, off by {near['first 500']:.1f} mm", case.rebuilt(run)),
            (f"descriptor, M = {size}, off by {found['errors']['rms']:.1f} mm", case.rebuilt(run, "--descriptor", f"shown-{mode}")),
            (f"first M = {size}, off by {near['first M']:.1f} mm", case.rebuilt(run, "--first", size)),
        ]
    everything = np.array([shape for shapes in rows.values() for _, shape in shapes])
    limit = np.abs(everything[[0, 4, 8]][:, :, 2] - case.rest[:, 2]).max()
    for column, mode in enumerate(MODES):
        for row, (words, shape) in enumerate(rows[mode]):
            draw(axes[row, column], shape, case.triangles, shape[:, 2] - case.rest[:, 2], limit)
            frame(axes[row, column], everything)
            axes[row, column].set_title(f"{mode}\n{words}" if row == 0 else words, fontsize=9)
    colour_bar(figure, axes, limit, "displacement in z, mm")
    return figure


def similarity(bench):
    """Every run beside the axial-crush descriptor, most similar first."""
    case = bench.cases["apart"]
    query = case.queries["crush"]
    figure, axes = plt.subplots(3, 1, figsize=(9, 7.4), layout="constrained", sharex=True)
    for panel, (words, found) in zip(axes, bench.crush_similarities.items()):
        order = ranked(found, query)
        for rank, run in enumerate(order, start=1):
            panel.plot(rank, found[run], MARK[case.label[run]], color=COLOUR[case.label[run]], ms=5)
        panel.axvline(NEAREST + 0.5, color="#444444", lw=0.8, ls="--")
        panel.set(ylabel="cosine similarity", title=words)
        panel.margins(x=0.01)
    axes[0].annotate("the nine nearest", (NEAREST + 0.8, found.max()), xycoords=("data", "axes fraction"), xytext=(NEAREST + 0.8, 0.05), fontsize=8)
    legend_of_labels(axes[1], loc="lower left", ncols=4, fontsize=8)
    axes[-1].set_xlabel(f"runs by similarity to the crush descriptor ({case.runs[query]}; label by mark and colour)")
    return figure


def nearest(bench):
    case = bench.cases["apart"]
    query = case.queries["crush"]
    figure, axes = plt.subplots(3, 6, figsize=(11, 4.6), layout="constrained")
    blocks = list(bench.crush_similarities.items())
    shown = {words: ranked(found, query)[:NEAREST] for words, found in (blocks[0], blocks[2])}
    everything = case.shapes[np.unique(np.concatenate(list(shown.values())))]
    limit = np.abs(everything[:, :, 2] - case.rest[:, 2]).max()
    for block, (words, runs) in enumerate(shown.items()):
        for place, run in enumerate(runs):
            panel = axes[place // 3, 3 * block + place % 3]
            draw(panel, case.shapes[run], case.triangles, case.shapes[run][:, 2] - case.rest[:, 2], limit)
            frame(panel, everything)
            right = case.label[run] == "crush"
            panel.set_title(
                f"{place + 1}: {case.runs[run]}, {case.label[run]}",
                fontsize=8,
                color="black" if right else COLOUR["down"],
                fontweight="normal" if right else "bold",
            )
        figure.text(0.25 + 0.5 * block, 1.01, words, ha="center", fontsize=9.5)
    colour_bar(figure, axes, limit, "displacement in z, mm")
    return figure


PICTURES = {
    "experiment-cloud": cloud,
    "experiment-rebuilt": lambda bench: rebuilt(bench.cases["apart"]),
    "experiment-rebuilt-joined": lambda bench: rebuilt(bench.cases["joined"]),
    "experiment-similarity": similarity,
    "experiment-nearest": nearest,
}
