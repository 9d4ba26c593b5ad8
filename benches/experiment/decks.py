"""The deck generator of the example: are its decks those of the bundle?"""

import csv
import filecmp
import os
import subprocess
import sys

import bundles
import pandas as pd
from pages import table


def decks(bench):
    example, folder = bench.options.example, os.path.join(bench.options.scratch, "decks")
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(example, "inputs.csv"), newline="") as file:
        runs = [row["run"] for row in csv.DictReader(file)]
    write = lambda run, mesh: subprocess.run(
        [
            sys.executable,
            os.path.join(example, "make_deck.py"),
            os.path.join(example, "inputs.csv"),
            run,
            mesh,
            os.path.join(folder, f"{run}-{mesh}.k"),
        ],
        check=True,
    )
    for run in runs:
        write(run, "coarse")
    kept = sorted(os.listdir(os.path.join(example, "decks")))
    same = sum(
        filecmp.cmp(os.path.join(example, "decks", name), os.path.join(folder, name.replace(".k", "-coarse.k")), shallow=False) for name in kept
    )
    rows = [["decks written from `inputs.csv`", len(runs)], ["of those kept in `decks/`, byte for byte the same", f"{same} of {len(kept)}"]]
    labels = os.path.join(folder, "labels.csv")
    subprocess.run(
        [sys.executable, os.path.join(example, "labels.py"), bench.cases["apart"].bundle.runs_folder, labels], check=True, stdout=subprocess.DEVNULL
    )
    rows.append(
        ["`labels.csv` written anew by `labels.py`", "the same" if filecmp.cmp(labels, bench.cases["apart"].labels, shallow=False) else "another"]
    )
    beams = [("coarse", bench.cases["apart"])] + ([("fine", bench.cases["fine"])] if "fine" in bench.cases else [])
    for mesh, case in beams:
        write(runs[0], mesh)
        study = os.path.join(bench.options.scratch, f"by-deck-{mesh}")
        subprocess.run(["rm", "-rf", study], check=True)
        bundles.crumple(case.program, "init", study, "--reference", os.path.join(folder, f"{runs[0]}-{mesh}.k"), "-K", 20)
        bundles.crumple(case.program, "add", study, case.bundle.runs_folder)
        rows.append(
            [
                f"runs that a study made from the {mesh} deck of {runs[0]} takes",
                f"{len(pd.read_parquet(os.path.join(study, 'runs.parquet')))} of {len(case.runs)}",
            ]
        )
    return table(["", ""], rows)


TABLES = {"decks": decks}
