"""Every table and picture of docs/experiment.md, from the built `crumple` and the bundles.

    python3 benches/experiment --program target/release/crumple --structures target/release/structures --scratch target/experiment

Needs NumPy, SciPy, pandas, pyarrow, scikit-learn, matplotlib, vtk, lasso-python. `--write docs/experiment.md` puts each table between
the marks that carry its name, and the pictures into `images` beside the page.
"""

import os
import subprocess
import sys
import time
from functools import cached_property

# Small matrices: more threads of the linear algebra cost more than they give where other work goes on.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path += [os.path.join(HERE, os.pardir), os.path.join(HERE, os.pardir, "rotation_spectrum")]

import claims
import curves
import decks
import drawing
import independent
import isometry
import pages
import pictures
import ranking
import robustness
import summary
import unseen
import uses
from cases import Case

SECTIONS = [ranking, claims, independent, unseen, curves, robustness, isometry, decks, uses, pictures, summary]


class Bench:
    """The bundles, each taken through the program once, and what several tables need of them."""

    def __init__(self, options):
        self.options, self.kept = options, {}  # kept: single numbers that the summary repeats, by name
        os.makedirs(options.scratch, exist_ok=True)
        runs, labels = os.path.join(options.example, "runs"), os.path.join(options.example, "labels.csv")
        self.cases = {"apart": Case(options, "apart", runs, labels), "joined": Case(options, "joined", runs, labels, "2.5")}
        if os.path.isdir(options.fine):
            labels = os.path.join(options.fine, "labels.csv")
            self.cases |= {
                "fine": Case(options, "fine", options.fine, labels),
                "fine, joined": Case(options, "fine, joined", options.fine, labels, "2.5"),
            }
        else:
            print(f"left out: the fine bundle, which is not at {options.fine}\n")

    @property
    def beams(self):
        return self.cases

    @cached_property
    def structures(self):
        folder = os.path.join(self.options.scratch, "structures")
        subprocess.run([self.options.structures, folder], check=True, stdout=subprocess.DEVNULL)
        at = lambda name, part: os.path.join(folder, name, part)
        return {name: Case(self.options, name, at(name, "runs"), at(name, "labels.csv")) for name in ("tube", "plate", "rail")}

    @cached_property
    def methods(self):
        return ranking.methods(self.cases["apart"])

    @cached_property
    def crush_similarities(self):
        return ranking.crush_similarities(self.cases["apart"])


def main():
    options = pages.arguments(__doc__, "target/experiment", "tables and pictures")
    bench, made = Bench(options), {}
    images = os.path.join(os.path.dirname(options.write), "images") if options.write else options.scratch
    wanted = lambda name: not options.only or name in options.only
    for section in SECTIONS:
        for name, make in getattr(section, "TABLES", {}).items():
            if wanted(name):
                start = time.time()
                made[name] = make(bench) or "Not made: the fine bundle is not there."
                print(f"### {name}\n\n{made[name]}\n", flush=True)
                print(f"{name}: {time.time() - start:.1f} s", file=sys.stderr)
        for name, draw in getattr(section, "PICTURES", {}).items():
            if wanted(name):
                start = time.time()
                path = drawing.save(draw(bench), images, name)
                print(f"{path}: {os.path.getsize(path) / 1000:.0f} kB, {time.time() - start:.1f} s", file=sys.stderr)
    if options.write:
        pages.write(options.write, made)


if __name__ == "__main__":
    main()
