"""Every figure of docs/rotation-spectrum.md, from the built `crumple` and the bundles, as Markdown tables.

    python3 benches/rotation_spectrum --program target/release/crumple --structures target/release/structures --scratch target/rotation

Needs NumPy, SciPy, pandas, pyarrow, scikit-learn, lasso-python. `--write docs/rotation-spectrum.md` puts each table between
the marks that carry its name.
"""

import os
import subprocess
import sys

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), os.pardir))

import bundles
import pages
import tables


def all_bundles(options):
    """By name; the fine bundle only where its files are."""
    os.makedirs(options.scratch, exist_ok=True)
    subprocess.run([options.structures, os.path.join(options.scratch, "structures")], check=True, stdout=subprocess.DEVNULL)
    runs, labels = os.path.join(options.example, "runs"), os.path.join(options.example, "labels.csv")
    wanted = [("hat", runs, labels, "crush", None), ("hat, joined", runs, labels, "crush", "2.5")]
    if os.path.isdir(options.fine):
        labels = os.path.join(options.fine, "labels.csv")
        wanted += [("hat, fine", options.fine, labels, "crush", None), ("hat, fine, joined", options.fine, labels, "crush", "2.5")]
    else:
        print(f"left out: the fine bundle, which is not at {options.fine}\n")
    for name, fold in [("tube", "fold"), ("plate", "corrugate"), ("rail", "fold")]:
        folder = os.path.join(options.scratch, "structures", name)
        wanted.append((name, os.path.join(folder, "runs"), os.path.join(folder, "labels.csv"), fold, None))
    made = {}
    for name, runs, labels, fold, join in wanted:
        made[name] = bundles.make(options.program, name, runs, labels, options.scratch, fold, join)
    return made


def main():
    options = pages.arguments(__doc__, "target/rotation", "tables")
    bench = tables.Bench(options, all_bundles(options))
    made = {}
    for name, make in tables.TABLES.items():
        if options.only and name not in options.only:
            continue
        made[name] = make(bench)
        print(f"### {name}\n\n{made[name]}\n", flush=True)
    if options.write:
        pages.write(options.write, made)


if __name__ == "__main__":
    main()
