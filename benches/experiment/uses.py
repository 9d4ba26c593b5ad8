"""What the paper proposes beyond its experiment: clusters of whole time series and of plastic strain, a threshold for verifying."""

import numpy as np
from cases import MODES, Case
from pages import table
from sklearn.metrics import adjusted_rand_score

FIELD = "plastic_strain"


def with_field(bench):
    """The coarse beam, apart, its plastic strain projected beside the shape."""
    if not hasattr(bench, "field_case"):
        case = bench.cases["apart"]
        bench.field_case = Case(bench.options, "with field", case.bundle.runs_folder, case.labels, None, "--field", FIELD)
    return bench.field_case


def explained(groups, values):
    """Share of the variance of `values` that groups explain (η²)."""
    between = sum((groups == group).sum() * (values[groups == group].mean() - values.mean()) ** 2 for group in np.unique(groups))
    return between / ((values - values.mean()) ** 2).sum()


def grouped(bench):
    """Three modes by the program, by what is grouped and which states, beside the labels and the place of the deformation."""
    case, rows = with_field(bench), []
    kept = case.label != "mixed"
    states = [
        ("last state", []),
        ("series, by time", ["--states", "series"]),
        ("series, by intrusion", ["--states", "series", "--align", "intrusion"]),
    ]
    for by in ("displacement", "rotation", FIELD):
        cells = []
        for _, words in states:
            found = case.ask("modes", "--by", by, "--count", 3, *words)["modes"]
            of = {run: group for group, mode in enumerate(found) for run in mode["members"]}
            groups = np.array([of[run] for run in case.runs])[kept]
            cells += [f"{adjusted_rand_score(case.label[kept], groups):z.2f}", f"{explained(groups, case.fold_positions[kept]):.2f}"]
        bench.kept["grouped", by] = cells[0] if by == FIELD else cells[2]
        rows.append([by, *cells])
    return table(["runs alike by", *[words for name, _ in states for words in (f"{name}: index", "place, η²")]], rows)


def verified(bench):
    """Thresholds that `crumple verify --calibrate` finds for the representatives, with error rates by cross-validation."""
    case, rows = bench.cases["apart"], []
    for words, options in (
        ("coordinates", ["--kind", "paper"]),
        ("differences", ["--kind", "paper", "--select", "difference"]),
        ("rotation spectrum", ["--kind", "rotation"]),
    ):
        for mode in MODES:
            case.describe(case.runs[case.queries[mode]], "verified", *options)
            found = case.ask("verify", "verified", case.runs[case.queries[mode]], "--calibrate", "--labels", case.labels, "--label", mode)[
                "calibration"
            ]
            bench.kept["verified", words, mode] = (
                f"{100 * found['false_fail']:.0f} % of the right runs fail, {100 * found['false_pass']:.0f} % of the wrong ones pass"
            )
            rows.append(
                [
                    words if mode == MODES[0] else "",
                    mode,
                    f"{found['threshold']:.3f}",
                    f"{100 * found['false_fail']:.0f} %",
                    f"{100 * found['false_pass']:.0f} %",
                ]
            )
    return table(["compared by", "mode", "threshold", "right runs that fail", "wrong runs that pass"], rows, 2)


TABLES = {"grouped": grouped, "verified": verified}
