"""What the paper says, beside what is found here: a claim, a command, a place on the page, a number. Made last, from numbers
that the other tables kept."""

import numpy as np
from cases import MODES
from isometry import shifts
from pages import table

RUNS = "examples/hat-section/runs"


def spread(values, form="{:.1f}"):
    low, high = (form.format(pick(values)) for pick in (min, max))
    return low if low == high else f"{low} to {high}"


def summary(bench):
    kept, case, fine = bench.kept, bench.cases["apart"], bench.cases.get("fine")
    size = lambda case: " / ".join(str(case.row(mode, "coordinates", "descriptor")["size"]) for mode in MODES)
    better = lambda case: [case.row(mode, "coordinates", "first M")["rms"] / case.row(mode, "coordinates", "descriptor")["rms"] for mode in MODES]
    nine = lambda case: f"{round(9 * case.row('crush', 'coordinates', 'descriptor')['precision_at_9'])} of 9"
    unseen = {share: [kept["unseen", mode, "PCA, unseen", share] / kept["unseen", mode, "PCA, each left out", share] for mode in MODES] for share in ("M", "3M")}
    moved = shifts(bench)
    also = lambda words, make: f"; {words} {make(fine)}" if fine else ""
    literal = kept.get(("letter", "fine", "α > t"))
    rows = [
        ["the coefficients of the first eigenvector show the modes", f"`crumple analyze {RUNS} --join 2.5 -o joined`, its report", "[cloud](#the-cloud)",
         f"yes: {100 * kept['cloud', 'eigenvector 1']:.0f} % of the runs have their own kind as the nearest by three numbers"],
        ["k-means of the first 500 finds the three modes", "`crumple modes plain --by displacement --count 3`", "[modes](#modes-without-labels)", "no; by rotation yes"],
        ["M = 14 / 17 / 16 (crush, up, down) by mean + 1 standard deviation", "`crumple describe plain run_007 --kind paper`", "[sizes](#sizes-and-shapes)",
         f"smaller; crush, down, up: {size(case)}{also('fine mesh', size)}"],
        ["the descriptor rebuilds the shape better than the first M", "`crumple reconstruct plain run_007 --descriptor crush`", "[shapes](#sizes-and-shapes)",
         f"yes: the first M are {spread(better(case))} times as far off; joined {spread(better(bench.cases['joined']))}"],
        ["the nine nearest to the crush descriptor are crush", "`crumple search plain crush --top 9`", "[nearest](#the-nine-nearest)",
         f"{nine(case)}{also('fine mesh', nine)}" + (f", with the equation as printed {round(9 * literal[0][1])} of 9" if literal else "")],
        ["… irrespective of the location of the folding", "", "[place](#irrespective-of-the-location)", f"no: rank correlation {kept['place', 'apart', 'coordinates']:+.2f} with the distance of the folds; rotation spectrum {abs(kept['place', 'apart', 'rotation spectrum']):.2f}"],
        ["it distinguishes the modes", "`crumple compare plain --labels labels.csv`", "[ranking](#ranking-and-rivals), [confusion](#confusion)",
         f"mean AP {kept['ranking', 'descriptor, coordinates']:.2f}, {100 * kept['confusion', 'coordinates']:.0f} % to the right descriptor; rotation spectrum {kept['ranking', 'rotation spectrum']:.2f}, {100 * kept['confusion', 'rotation spectrum']:.0f} %"],
        ["it is more focused than the first 500", "the same", "[ranking](#ranking-and-rivals), [curves](#from-1-to-500)", f"as good with a fiftieth of the numbers: {kept['ranking', 'descriptor, coordinates']:.3f} to {kept['ranking', 'first 500, coordinates']:.3f}; but so is the first M, {kept['ranking', 'first M, coordinates']:.3f}"],
        ["single nodes do not describe complex deformations", "", "[ranking](#ranking-and-rivals)", f"not seen: M hand-picked nodes {kept['ranking', 'M hand-picked nodes']:.3f}, the descriptor of differences {kept['ranking', 'descriptor, differences']:.3f}"],
        ["PCA cannot represent a deformation that it has not seen", "", "[unseen](#pca-and-the-unseen)", f"half: its error rises {spread(unseen['M'])} times (M components), {spread(unseen['3M'])} times (3M)"],
        ["ε-isometric shapes have nearly the same eigenbasis, Laplacians up to a factor", "`crumple eigen shape.obj`", "[isometry](#isometry)",
         f"yes: eigenvalues rise by a factor of {np.median(moved['scale']):.2f}, {100 * np.median(moved['rest']):.1f} % beside it; {100 * np.median(moved['span']):.0f} % of the span of 50 is common"],
    ]
    return table(["the paper", "command", "figure", "here"], rows, 4)


TABLES = {"summary": summary}
