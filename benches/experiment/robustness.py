"""What moves the figures: seeds, the basis, K, noise, the moment, the mesh, and the run that stands for its mode."""

import matplotlib.pyplot as plt
import numpy as np
import rivals
import spectra
from analyze_peer import select
from cases import MODES, SELECTS
from drawing import COLOUR
from judge import average_precision
from pages import table
from quality import by_mode, judged, ranked
from scipy.stats import spearmanr
from sklearn.metrics import adjusted_rand_score

SEEDS = range(1, 21)
WORDS = {"coordinates": "coordinates", "difference": "differences"}


def outcome(case, values):
    """Of the paper's descriptor on coefficients R x K x 3, by mode: M, average precision of the representative, mean over all runs."""
    similarity = rivals.descriptor(values)
    means = by_mode(similarity, case)
    return {
        mode: (len(select(values[case.queries[mode]])), judged(similarity(case.queries[mode]), case.queries[mode], case.label)[1], means[mode])
        for mode in MODES
    }


def cells(found):
    """M, AP and mean AP of the three modes from one outcome, or their ranges from several."""
    found = found if isinstance(found, list) else [found]
    out = []
    for place, digits in ((0, 0), (1, 3), (2, 3)):
        words = []
        for mode in MODES:
            low, high = (function(one[mode][place] for one in found) for function in (min, max))
            text = [f"{value:.{digits}f}" for value in (low, high)]
            words.append(text[0] if text[0] == text[1] else "…".join(text))
        out.append(words[0] if len(set(words)) == 1 and place == 0 else " / ".join(words))
    return out


def seeds(bench):
    rows = []
    for name, case in bench.beams.items():
        kept = case.label != "mixed"
        for by in ("rotation", "displacement"):
            groupings, indices = set(), []
            for seed in SEEDS:
                found = case.ask("modes", "--by", by, "--count", 3, "--seed", seed)["modes"]
                of = {run: group for group, mode in enumerate(found) for run in mode["members"]}
                groups = np.array([of[run] for run in case.runs])
                groupings.add(frozenset(frozenset(mode["members"]) for mode in found))
                indices.append(adjusted_rand_score(case.label[kept], groups[kept]))
            rows.append([name if by == "rotation" else "", by, len(groupings), f"{min(indices):.2f}", f"{max(indices):.2f}"])
    return table(["beam", "runs alike by", "different groupings of 20 seeds", "least index", "largest"], rows, 2)


def turned(case, values, random):
    """The same coefficients in another basis: each pair of eigenvalues equal within 1e-6 turned by an angle of its own."""
    values, eigenvalues = values.copy(), case.bundle.eigenvalues
    at = 0
    while at + 1 < 40:
        if eigenvalues[at + 1] - eigenvalues[at] <= 1e-6 * eigenvalues[at + 1] or at == 0 and eigenvalues[1] < 1e-9 * eigenvalues[-1]:
            angle = random.uniform(0, 2 * np.pi)
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            values[:, at : at + 2] = np.einsum("ij,rjc->ric", turn, values[:, at : at + 2])
            at += 1
        at += 1
    return values


def basis(bench):
    rows = []
    for name in ("apart", "joined"):
        case = bench.cases[name]
        for by in SELECTS:
            values = case.values[by]
            found = [outcome(case, turned(case, values, np.random.default_rng(seed))) for seed in SEEDS]
            rows.append([name, WORDS[by], "as solved", *cells(outcome(case, values))])
            rows.append(["", "", "pairs turned, 20 draws", *cells(found)])
            rows += [["", "", f"K = {count}", *cells(outcome(case, values[:, :count]))] for count in (50, 100, 200, 300)]
    return table(["beam", "coefficients", "basis", "M", "AP", "mean AP"], rows, 3)


def noise(bench):
    case, rows = bench.cases["apart"], []
    weighted = case.bundle.eigenvectors.astype(float) * case.mass
    clean = spectra.spectrum(case.bundle)
    for sigma in (0, 0.1, 1, 5):
        draws = [np.random.default_rng(seed) for seed in (1, 2, 3)] if sigma else [None]
        for what in (*SELECTS, "rotation"):
            found, moved = [], []
            for random in draws:
                shift = random.normal(0, sigma, case.shapes.shape) if sigma else np.zeros(case.shapes.shape)
                if what == "rotation":
                    fields = [spectra.project(case.bundle, spectra.rotation_field(case.bundle, shape)) for shape in case.shapes + shift]
                    points = spectra.spectrum(case.bundle, np.array([rho for rho, _ in fields]), np.array([energy for _, energy in fields]))
                    similarity, before = rivals.of_rows(points), clean @ clean.T
                    means = by_mode(similarity, case)
                    found.append(
                        {
                            mode: (points.shape[1], judged(similarity(case.queries[mode]), case.queries[mode], case.label)[1], means[mode])
                            for mode in MODES
                        }
                    )
                    moved.append(np.abs(points @ points.T - before).max())
                else:
                    values = case.values[what] + np.einsum("kn,rnc->rkc", weighted, shift)
                    found.append(outcome(case, values))
                    own, other = rivals.descriptor(case.values[what]), rivals.descriptor(values)
                    moved.append(max(np.abs(own(query) - other(query)).max() for query in range(len(case.runs))))
            rows.append([f"{sigma} mm" if what == "coordinates" else "", WORDS.get(what, "rotation spectrum"), *cells(found), f"{max(moved):.2g}"])
    return table(["noise", "compared by", "M, or numbers", "AP", "mean AP", "largest move of a similarity"], rows, 2)


def moments(bench):
    """The experiment with another state of each run in place of the last; labels are those of the end."""
    case, rows = bench.cases["apart"], []
    states = case.bundle.states
    for number in range(1, int(states.state.max()) + 1):
        at = np.flatnonzero(states.state == number)
        time = states.time.to_numpy()[at].mean()
        deltas = case.bundle.delta_states[at]
        for by in SELECTS:
            rows.append(
                [
                    f"{time:.0f} ms" if by == "coordinates" else "",
                    WORDS[by],
                    *cells(outcome(case, deltas + (case.bundle.baseline if by == "coordinates" else 0))),
                ]
            )
        points = spectra.spectrum(case.bundle, case.bundle.rho_states[at], case.bundle.energy_states[at])
        similarity = rivals.of_rows(points)
        means = by_mode(similarity, case)
        rows.append(
            [
                "",
                "rotation spectrum",
                *cells(
                    {
                        mode: (points.shape[1], judged(similarity(case.queries[mode]), case.queries[mode], case.label)[1], means[mode])
                        for mode in MODES
                    }
                ),
            ]
        )
    return table(["state", "compared by", "M, or numbers", "AP", "mean AP"], rows, 2)


def meshes(bench):
    """The runs that both meshes have and that end in the same mode on both; labels, queries and rankings among these."""
    if "fine" not in bench.cases:
        return None
    rows = []
    for names in (("apart", "fine"), ("joined", "fine, joined")):
        coarse, fine = (bench.cases[name] for name in names)
        label = dict(zip(fine.runs, fine.label))
        both = [run for run, own in zip(coarse.runs, coarse.label) if label.get(run) == own and own != "mixed"]
        at = [np.array([case.runs.index(run) for run in both]) for case in (coarse, fine)]
        ends = coarse.label[at[0]]
        for what in (*SELECTS, "rotation"):
            matrices, sizes = [], []
            for case, of in zip((coarse, fine), at):
                similarity = rivals.rotation(case) if what == "rotation" else rivals.descriptor(case.values[what])
                matrices.append(np.array([similarity(query)[of] for query in of]))
                sizes.append(np.array([len(select(case.values[what][query])) for query in of]) if what in SELECTS else np.array([27]))
            off = ~np.eye(len(both), dtype=bool)
            means = [np.mean([average_precision(ends[ranked(row, query)] == ends[query]) for query, row in enumerate(matrix)]) for matrix in matrices]
            agree = spearmanr(matrices[0][off], matrices[1][off]).statistic
            size = lambda found: f"{np.median(found):.0f} ({found.min()}…{found.max()})" if what in SELECTS else "–"
            rows.append(
                [
                    f"{names[0]} / {names[1]}, {len(both)} runs" if what == "coordinates" else "",
                    WORDS.get(what, "rotation spectrum"),
                    size(sizes[0]),
                    size(sizes[1]),
                    *[f"{mean:.3f}" for mean in means],
                    f"{agree:.2f}",
                ]
            )
    return table(
        [
            "beams",
            "compared by",
            "M, coarse: median",
            "M, fine",
            "mean AP, coarse",
            "mean AP, fine",
            "similarities of all pairs, coarse against fine: Spearman's ρ",
        ],
        rows,
        2,
    )


def eigenvalues(bench):
    if "fine" not in bench.cases:
        return None
    rows = []
    for names in (("apart", "fine"), ("joined", "fine, joined")):
        coarse, fine = (bench.cases[name].bundle.eigenvalues for name in names)
        first = 2 if names[0] == "apart" else 1
        change = np.abs(coarse[first:] / fine[first:] - 1)
        rows.append([f"{names[0]} / {names[1]}", *[f"{100 * change[: last - first].max():.1f} %" for last in (10, 20, 50, 100, 200, 500)]])
    return table(["largest change of the first …", "10", "20", "50", "100", "200", "500"], rows)


def clear_queries(bench):
    """Average precision with every clear run as the representative, by what is compared and mode."""
    if not hasattr(bench, "representatives"):
        case = bench.cases["apart"]
        bench.representatives = {}
        for name, _, similarity in bench.methods:
            precision = {
                mode: np.array([judged(similarity(run), run, case.label)[1] for run in case.members(mode) if case.bundle.clear[run]])
                for mode in MODES
            }
            bench.representatives[name.replace("**", "")] = precision
    return bench.representatives


def representatives(bench):
    rows = []
    for name, found in clear_queries(bench).items():
        rows.append([name, *[f"{values.min():.2f} / {np.median(values):.2f} / {values.max():.2f}" for values in found.values()]])
    return table(["compared by", *[f"{mode}: least / median / largest" for mode in MODES]], rows)


SHOWN = (
    "descriptor, coordinates",
    "descriptor, differences",
    "first 500, coordinates",
    "PCA, 3M components",
    "M hand-picked nodes",
    "rotation spectrum",
)


def representatives_picture(bench):
    figure, axes = plt.subplots(figsize=(9.4, 3.6), layout="constrained")
    random, case = np.random.default_rng(1), bench.cases["apart"]
    for place, name in enumerate(SHOWN):
        for offset, mode in zip((-0.25, 0, 0.25), MODES):
            values = clear_queries(bench)[name][mode]
            axes.plot(
                place + offset + random.uniform(-0.07, 0.07, len(values)),
                values,
                "o",
                ms=2.8,
                alpha=0.7,
                color=COLOUR[mode],
                label=f"{mode}, {len(values)} clear runs" if place == 0 else None,
            )
            axes.plot([place + offset - 0.1, place + offset + 0.1], [np.median(values)] * 2, color=COLOUR[mode], lw=2)
            chance = np.mean(case.label == mode)
            axes.plot([place + offset - 0.1, place + offset + 0.1], [chance] * 2, color="#888888", lw=0.8)
    axes.set(
        xticks=range(len(SHOWN)),
        xticklabels=[name.replace(", ", ",\n").replace("M hand-picked ", "M hand-picked\n").replace("rotation ", "rotation\n") for name in SHOWN],
        ylabel="average precision",
        ylim=(0.25, 1.02),
    )
    axes.legend(loc="upper left", bbox_to_anchor=(1, 1), fontsize=8, title="dot: a representative\nbar: median\ngrey: chance", title_fontsize=8)
    return figure


TABLES = {
    "seeds": seeds,
    "basis": basis,
    "noise": noise,
    "moments": moments,
    "meshes": meshes,
    "eigenvalues": eigenvalues,
    "representatives": representatives,
}
PICTURES = {"experiment-representatives": representatives_picture}
