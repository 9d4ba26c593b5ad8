"""The paper's figures as tables: sizes, errors, the nine nearest, rankings, confusion, for every mode."""

import dimred
import numpy as np
import rivals
from cases import MODES, SELECTS
from pages import table
from quality import by_mode, judged


def crush_similarities(case):
    """Every run beside the crush descriptor, as `crumple search` says, by what is compared."""
    run = case.runs[case.queries["crush"]]
    out = {}
    for select, words in (("coordinates", "the paper's descriptor, coordinates"), ("difference", "the paper's descriptor, differences")):
        case.describe(run, f"crush-{select}", "--kind", "paper", "--select", select)
        out[words] = case.similarities(f"crush-{select}")
    out["rotation spectrum (the program's default)"] = case.similarities("crush-coordinates", "--kind", "rotation")
    return out


def sizes(bench):
    rows = []
    for name, case in bench.beams.items():
        for mode in MODES:
            found = [case.row(mode, select, "descriptor") for select in SELECTS]
            kept = [case.row(mode, select, "first M") for select in SELECTS]
            every = case.row(mode, "coordinates", "first 500")
            cells = [f"{row['rms']:.1f} ({100 * row['relative']:.0f} %)" for pair in zip(found, kept) for row in pair]
            rows.append(
                [
                    name if mode == MODES[0] else "",
                    mode,
                    found[0]["query"],
                    len(case.rest),
                    found[0]["size"],
                    *cells[:2],
                    f"{every['rms']:.1f}",
                    found[1]["size"],
                    *cells[2:],
                ]
            )
    head = [
        "beam",
        "mode",
        "representative",
        "N",
        "M, coordinates",
        "descriptor, mm",
        "first M, mm",
        "first 500, mm",
        "M, differences",
        "descriptor, mm",
        "first M, mm",
    ]
    return table(head, rows, 3)


def nearest(bench):
    case, rows = bench.cases["apart"], []
    for mode in MODES:
        found = {
            "coordinates": case.row(mode, "coordinates", "descriptor"),
            "differences": case.row(mode, "difference", "descriptor"),
            "rotation": case.row(mode, "rotation", "rotation spectrum"),
        }
        for words, row in found.items():
            label = lambda run: case.label[case.runs.index(run)]
            cells = [run.removeprefix("run_") + ("" if label(run) == mode else f" **({label(run)})**") for run in row["nearest"]]
            rows.append([f"{mode}, {row['query']}" if words == "coordinates" else "", words, ", ".join(cells)])
    return table(["mode", "compared by", "the nine nearest runs, nearest first"], rows, 3)


def methods(case):
    """Name, numbers of a query of each mode, query -> similarities: the descriptor and all its rivals."""
    size = {select: {mode: case.row(mode, select, "descriptor")["size"] for mode in MODES} for select in SELECTS}
    every = rivals.Pca(case, np.arange(len(case.runs)))
    times = lambda factor, select="difference": {mode: factor * count for mode, count in size[select].items()}
    same = lambda count: dict.fromkeys(MODES, count)
    betas, hashes, (spheres, cells) = dimred.Betas(case), dimred.hash_similarities(case), dimred.sphere_similarities(case)
    out = []
    for select in SELECTS:
        words = {"coordinates": "coordinates", "difference": "differences"}[select]
        out += [
            (f"**descriptor**, {words}", times(3, select), rivals.descriptor(case.values[select])),
            (f"first M, {words}", times(3, select), rivals.first(case.values[select])),
            (f"first 500, {words}", same(1500), rivals.first(case.values[select], 500)),
        ]
    out += [("PCA, M components", times(1), rivals.components(case, every)), ("PCA, 3M components", times(3), rivals.components(case, every, 3))]
    out += [
        ("M hand-picked nodes", times(3), rivals.hand_picked(case)),
        ("dimred: betas", same(betas.betas.shape[1]), rivals.of_rows(betas.betas)),
        ("dimred: hashes", same(3 * dimred.HASH_MODES * dimred.HASH_POINTS), lambda query: hashes[query]),
        ("dimred: sphere", same(cells), lambda query: spheres[query]),
        ("**rotation spectrum**", same(case.row("crush", "rotation", "rotation spectrum")["size"]), rivals.rotation(case)),
    ]
    return out


def ranking(bench):
    case, rows = bench.cases["apart"], []
    for name, numbers, similarity_of in bench.methods:
        means = by_mode(similarity_of, case)
        cells = [judged(similarity_of(case.queries[mode]), case.queries[mode], case.label) for mode in MODES]
        each = lambda place, digits: " / ".join(f"{cell[place]:.{digits}f}" for cell in cells)
        bench.kept["ranking", name.replace("**", "")] = np.mean(list(means.values()))
        counts = list(numbers.values())
        rows.append(
            [
                name,
                str(counts[0]) if len(set(counts)) == 1 else " / ".join(map(str, counts)),
                each(0, 2),
                each(1, 3),
                each(2, 3),
                " / ".join(f"{means[mode]:.3f}" for mode in MODES),
                f"{np.mean(list(means.values())):.3f}",
            ]
        )
    return table(["compared by", "numbers", "precision at 9", "average precision", "ROC area", "mean AP, every run the query", "mean"], rows)


def elsewhere(bench):
    """The main rows on every mesh, as `compare` says."""
    rows = []
    kinds = [
        ("descriptor, coordinates", "coordinates", "descriptor"),
        ("first M, coordinates", "coordinates", "first M"),
        ("first 500, coordinates", "coordinates", "first 500"),
    ]
    kinds += [
        ("descriptor, differences", "difference", "descriptor"),
        ("PCA, M components", "difference", "PCA"),
        ("rotation spectrum", "rotation", "rotation spectrum"),
    ]
    for name, case in bench.beams.items():
        for words, select, method in kinds:
            found = [case.row(mode, select, method) for mode in MODES]
            each = lambda key, digits: " / ".join(f"{row[key]:.{digits}f}" for row in found)
            means = np.mean([row["mean_average_precision"] for row in found])
            cells = [each("precision_at_9", 2), each("average_precision", 3), each("mean_average_precision", 3), f"{means:.3f}"]
            rows.append([name if words == kinds[0][0] else "", words, *cells])
    return table(["beam", "compared by", "precision at 9", "average precision", "mean AP, every run the query", "mean"], rows, 2)


def confusion(bench):
    """Each run to the mode whose representative's descriptor it is most similar to, by `crumple search`."""
    case, rows = bench.cases["apart"], []
    for words, select, kind in (
        ("coordinates", "coordinates", "paper"),
        ("differences", "difference", "paper"),
        ("rotation spectrum", "coordinates", "rotation"),
    ):
        found = []
        for mode in MODES:
            name = f"confusion-{mode}"
            case.describe(case.runs[case.queries[mode]], name, "--kind", kind, "--select", select)
            found.append(case.similarities(name))
        best = np.argmax(found, axis=0)
        others = ~np.isin(np.arange(len(case.runs)), list(case.queries.values()))
        for label in (*MODES, "mixed"):
            of = others & (case.label == label)
            right = "" if label == "mixed" else f"{(best[of] == MODES.index(label)).mean():.2f}"
            rows.append([words if label == MODES[0] else "", label, *[int((best[of] == column).sum()) for column in range(3)], right])
        of = others & (case.label != "mixed")
        bench.kept["confusion", words] = np.mean([MODES[k] == label for k, label in zip(best[of], case.label[of])])
        rows.append(["", "all three", "", "", "", f"{bench.kept['confusion', words]:.2f}"])
    return table(["compared by", "label \\ nearest descriptor", *MODES, "right"], rows, 2)


def modes_found(bench):
    """Agreement of modes found without labels, from `compare`."""
    rows = []
    ways = [(by, method) for by in ("rotation", "displacement") for method in ("kmeans", "ward", "average", "mixture", "hdbscan")]
    for by, method in ways:
        cells = []
        for case in bench.beams.values():
            of = {found["chosen"]: found for found in case.compared["modes"] if (found["by"], found["method"]) == (by, method)}
            cells += [f"{of[False]['ari']:.2f}" if False in of else "–", f"{of[True]['count']}: {of[True]['ari']:.2f}" if True in of else "–"]
        rows.append(
            [
                by
                + (
                    ", the default"
                    if (by, method) == ("rotation", "kmeans")
                    else ", the paper's"
                    if (by, method) == ("displacement", "kmeans")
                    else ""
                ),
                method,
                *cells,
            ]
        )
    head = [words for name in bench.beams for words in (f"{name}: 3 given", "chosen")]
    return table(["runs alike by", "method", *head], rows, 2)


def cloud_separates(bench):
    """What the cloud's triples say of the labels: label of the nearest other run, adjusted Rand index of three k-means groups."""
    from sklearn.cluster import KMeans
    from sklearn.metrics import adjusted_rand_score

    case, rows = bench.cases["joined"], []
    kept = case.label != "mixed"
    for words, points in (
        ("eigenvector 1", case.values["coordinates"][:, 0]),
        ("eigenvector 2", case.values["coordinates"][:, 1]),
        ("both", case.values["coordinates"][:, :2].reshape(len(case.runs), -1)),
        ("all 500", case.values["coordinates"].reshape(len(case.runs), -1)),
    ):
        points, label = points[kept], case.label[kept]
        distance = np.linalg.norm(points[:, None] - points[None], axis=2) + np.diag(np.full(len(points), np.inf))
        groups = KMeans(3, n_init=20, random_state=1).fit_predict(points)
        bench.kept["cloud", words] = (label[distance.argmin(1)] == label).mean()
        rows.append([words, f"{bench.kept['cloud', words]:.2f}", f"{adjusted_rand_score(label, groups):.2f}"])
    return table(["coefficients", "nearest run has the same label", "three k-means groups, adjusted Rand index"], rows)


TABLES = {
    "sizes": sizes,
    "cloud": cloud_separates,
    "nearest": nearest,
    "ranking": ranking,
    "elsewhere": elsewhere,
    "confusion": confusion,
    "modes": modes_found,
}
