"""Two sentences of the paper put to the test: its formulas to the letter, and "irrespective of the exact location"."""

import numpy as np
import rivals
from cases import MODES, Case
from pages import table
from quality import NEAREST, judged, ranked
from scipy.stats import spearmanr


def letter(bench):
    """M, and what the rankings of the representatives are worth, with the paper's formulas as printed: α > t without bars, M = I."""
    rows = []
    for name in [name for name in ("apart", "joined", "fine", "fine, joined") if name in bench.cases]:
        case = bench.cases[name]
        plain = Case(bench.options, f"{name}, plain", case.bundle.runs_folder, case.labels, "2.5" if "joined" in name else None, "--mass", "identity")
        for words, study, options in (
            ("as the program does it: |α| > t, lumped mass", case, []),
            ("α > t", case, ["--signed"]),
            ("M = I", plain, []),
            ("both: to the letter", plain, ["--signed"]),
        ):
            found = []
            for mode in MODES:
                query = case.queries[mode]
                size = study.describe(case.runs[query], "letter", "--kind", "paper", *options)["size"]
                found.append((size, *judged(study.similarities("letter"), query, case.label)))
            bench.kept["letter", name, words] = found
            each = lambda place, digits: " / ".join(f"{one[place]:.{digits}f}" for one in found)
            rows.append([name if not options and study is case else "", words, each(0, 0), each(1, 2), each(2, 3)])
    return table(["beam", "selection", "M", "precision at 9", "average precision"], rows, 2)


def place(bench):
    """Over all pairs of clear crush runs: does similarity fall with the distance of their folds?"""
    rows = []
    for name in [name for name in ("apart", "fine") if name in bench.cases]:
        case = bench.cases[name]
        where, runs = case.fold_positions, np.flatnonzero((case.label == "crush") & case.bundle.clear)
        apart = np.abs(where[runs][:, None] - where[runs])
        pairs = ~np.eye(len(runs), dtype=bool)
        far = np.mean(apart[pairs])
        for words, similarity in (
            ("coordinates", rivals.descriptor(case.values["coordinates"])),
            ("differences", rivals.descriptor(case.values["difference"])),
            ("rotation spectrum", rivals.rotation(case)),
        ):
            matrix = np.array([similarity(run) for run in runs])
            rho = spearmanr(matrix[:, runs][pairs], apart[pairs]).statistic
            bench.kept["place", name, words] = rho
            near = [ranked(row, run)[:NEAREST] for row, run in zip(matrix, runs)]
            crush = np.mean([(case.label[found] == "crush").mean() for found in near])
            distance = np.mean(np.concatenate([np.abs(where[found[case.label[found] == "crush"]] - where[run]) for found, run in zip(near, runs)]))
            rows.append(
                [
                    f"{name}, {len(runs)} clear crush runs" if words == "coordinates" else "",
                    words,
                    f"{rho:+z.2f}",
                    f"{crush:.2f}",
                    f"{distance:.0f} mm of {far:.0f} mm",
                ]
            )
    head = [
        "beam",
        "compared by",
        "ρ of similarity and distance of the folds, all pairs",
        "crush among the nine nearest, mean query",
        "distance of the folds of those, of all pairs",
    ]
    return table(head, rows, 2)


TABLES = {"letter": letter, "place": place}
