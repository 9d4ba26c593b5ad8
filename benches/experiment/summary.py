"""What the paper says, beside what is found here: a claim, a command, a place on the page, a number. Made last, from numbers
that the other tables kept."""

import curves
import numpy as np
from cases import MODES
from isometry import shifts
from pages import table


def spread(values, form="{:.1f}"):
    low, high = (form.format(pick(values)) for pick in (min, max))
    return low if low == high else f"{low} to {high}"


def sizes(case):
    return " / ".join(str(case.row(mode, "coordinates", "descriptor")["size"]) for mode in MODES)


def better(case):
    """How many times as far off the first M are as the descriptor, by mode."""
    return [case.row(mode, "coordinates", "first M")["rms"] / case.row(mode, "coordinates", "descriptor")["rms"] for mode in MODES]


def nine(case):
    return f"{round(9 * case.row('crush', 'coordinates', 'descriptor')['precision_at_9'])} of 9"


def index(case, by):
    """Adjusted Rand index of three k-means modes."""
    (found,) = [found for found in case.compared["modes"] if (found["by"], found["method"], found["chosen"]) == (by, "kmeans", False)]
    return f"{found['ari']:.2f}"


def summary(bench):
    kept, case, joined, fine = bench.kept, bench.cases["apart"], bench.cases["joined"], bench.cases.get("fine")
    also = lambda make: f"; fine mesh {make(fine)}" if fine else ""
    literal = kept.get(("letter", "fine", "α > t"))
    mean = lambda name: f"{kept['ranking', name]:.3f}"
    confusion = lambda words: f"{100 * kept['confusion', words]:.0f} %"
    rho = lambda words: f"{kept['place', 'apart', words]:+z.2f}"
    end = lambda method: f"{np.mean([errors[-1] for errors, _ in curves.found(bench)['difference', method].values()]):.1f}"
    moved = {name: np.median(values) for name, values in shifts(bench).items()}
    numbers = spread([3 * case.row(mode, "coordinates", "descriptor")["size"] for mode in MODES], "{:d}")
    rows = [
        ["the coefficients of the first eigenvector show the modes", "`crumple report joined -o joined.html`", "[cloud](#the-cloud)"]
        + [f"yes: {100 * kept['cloud', 'eigenvector 1']:.0f} % of the runs have their own kind as the nearest by three numbers"],
        ["clusters of the first 500 are the three modes", "`crumple modes plain --by displacement --count 3`", "[modes](#modes-without-labels)"]
        + [f"no: adjusted Rand index {index(case, 'displacement')}; by rotation {index(case, 'rotation')}"],
        [
            "clusters of time series, of plastic strain",
            "`crumple modes … --states series`, `--by plastic_strain`",
            "[modes](#time-series-and-plastic-strain)",
        ]
        + [f"possible; index {kept['grouped', 'displacement']} and {kept['grouped', 'plastic_strain']}"],
        [
            "M = 14 / 16 / 17 (crush, down, up) by mean + 1 standard deviation",
            "`crumple describe plain run_007 --kind paper`",
            "[sizes](#sizes-and-shapes)",
        ]
        + [f"fewer: {sizes(case)}{also(sizes)}"],
        [
            "the descriptor rebuilds the shape better than the first M",
            "`crumple reconstruct plain run_007 --descriptor crush -o crush.vtu`",
            "[shapes](#sizes-and-shapes)",
        ]
        + [f"yes: the first M are {spread(better(case))} times as far off; joined {spread(better(joined))} times"],
        ["the nine nearest to the crush descriptor are crush", "`crumple search plain crush --top 10`", "[nearest](#the-nine-nearest)"]
        + [nine(case) + also(nine) + (f", with the equation as printed {round(9 * literal[0][1])} of 9" if literal else "")],
        ["… irrespective of the location of the folding", "", "[place](#irrespective-of-the-location)"]
        + [f"no: rank correlation {rho('coordinates')} of similarity and distance of the folds; rotation spectrum {rho('rotation spectrum')}"],
        ["it distinguishes the modes", "`crumple compare plain --labels …`", "[ranking](#ranking-and-rivals), [confusion](#confusion)"]
        + [
            f"mean AP {mean('descriptor, coordinates')}, {confusion('coordinates')} nearest to the right descriptor; "
            f"rotation spectrum {mean('rotation spectrum')}, {confusion('rotation spectrum')}"
        ],
        ["it is more focused than the first 500", "the same", "[ranking](#ranking-and-rivals), [curves](#from-1-to-500)"]
        + [
            f"as good with {numbers} numbers as with 1500: mean AP {mean('descriptor, coordinates')} and {mean('first 500, coordinates')}; "
            f"so is the first M, {mean('first M, coordinates')}"
        ],
        ["displacements of single nodes are limited", "", "[ranking](#ranking-and-rivals)"]
        + [f"not in a ranking: M hand-picked nodes {mean('M hand-picked nodes')}, the descriptor of differences {mean('descriptor, differences')}"],
        [
            "PCA cannot represent a deformation that it has not seen",
            "`crumple compare` (seen)",
            "[unseen](#pca-and-the-unseen), [curves](#from-1-to-500)",
        ]
        + [
            f"in the end: all components of an unseen mode stay {end('PCA, mode unseen')} mm off, 500 eigenvectors {end('first M')}; with few numbers PCA is as near"
        ],
        ["a threshold verifies a simulation", "`crumple verify plain crush --calibrate --labels …`", "[verify](#a-threshold)"]
        + [f"for crush {kept['verified', 'coordinates', 'crush']}; rotation spectrum {kept['verified', 'rotation spectrum', 'crush']}"],
        [
            "shapes in a crash are ε-isometric: nearly the same eigenbasis, Laplacians up to a factor",
            "`crumple eigen examples/hat-section/runs/run_007@last -K 50`",
            "[isometry](#isometry)",
        ]
        + [
            f"eigenvectors yes, {100 * moved['span']:.0f} % of the span of 50 is common; "
            f"eigenvalues by a factor of {moved['scale']:.2f} and {100 * moved['rest']:.1f} % beside it"
        ],
        ["the basis is computed once, 1000 pairs fast by sparse methods", "`crumple init`", "[the eigenbasis](eigen.md#what-it-costs)", "yes"],
    ]
    return table(["the paper", "command", "figure", "here"], rows, 4)


TABLES = {"summary": summary}
