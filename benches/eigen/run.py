#!/usr/bin/env python3
"""The eigenbasis beside its peers on the same L and M, alternately: what `just bench-eigen` runs.

    python run.py [--cases 9k/500,9k/1000,100k/500] [--threads 1,2] [--repeats 3] [--peers scipy,slepc,lapy,dense]
                  [--scratch target/bench-eigen] [--prefix COMMAND] [--table-only]

Every run is a process of its own, and one file in SCRATCH/runs: what is there is not run again, so the bench can be
stopped and taken up. `--prefix` is put before every measured command (`nice -n -5`, a lock). Wall seconds are those of
the solution alone, without reading; CPU seconds and peak memory are the kernel's figures for the process. Peers run
with OPENBLAS_CORETYPE and OPENBLAS_L2_SIZE unset, which slow them where they are set.
Writes SCRATCH/table.md and SCRATCH/table.json, and with `--page` the table of that page between its marks.
"""
from __future__ import annotations

import argparse
import json
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from statistics import median

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.path.insert(0, str(ROOT / "benches"))
import numpy as np  # noqa: E402
import pages  # noqa: E402

MESHES = {"9k": "hat:9000", "100k": "hat:100000", "1M": "hat:1000000", "9k-apart": "hat-apart:9000", "100k-apart": "hat-apart:100000",
          "1M-apart": "hat-apart:1000000", "9k-closed": "closed:9000", "100k-closed": "closed:100000"}


def bundle(scratch: Path, crumple: Path) -> Path:
    """The example bundle's own mesh as OBJ."""
    mesh, study, exported = scratch / "bundle.obj", scratch / "bundle", scratch / "bundle-exported"
    if not mesh.exists():
        run = ROOT / "examples/hat-section/runs/run_001"
        shutil.rmtree(study, ignore_errors=True)  # what a bench that was stopped has left
        subprocess.run([crumple, "--quiet", "init", "--reference", run, "-K", "2", study], check=True)
        subprocess.run([crumple, "--quiet", "export", study, "-o", exported], check=True)
        vertices, triangles = np.load(exported / "vertices.npy"), np.load(exported / "triangles.npy")
        lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in triangles.tolist()]
        mesh.write_text("\n".join(lines) + "\n")
    return mesh


def environment(threads: int) -> dict[str, str]:
    names = ("OPENBLAS_CORETYPE", "OPENBLAS_L2_SIZE")
    kept = {name: value for name, value in os.environ.items() if name not in names}
    count = str(threads)
    return kept | {"RAYON_NUM_THREADS": count, "OPENBLAS_NUM_THREADS": count, "OMP_NUM_THREADS": count}


def once(command: list[str], threads: int, prefix: list[str]) -> dict:
    """A run through cost.py, because a prefix may wait: the figures are those of the command alone."""
    process = subprocess.run([*prefix, sys.executable, str(HERE / "cost.py"), *command], env=environment(threads), text=True, capture_output=True)
    if process.returncode != 0:
        return {"failed": (process.stderr.strip().splitlines() or ["no word"])[-1]}
    return json.loads(process.stdout.strip().splitlines()[-1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", default="9k/100,9k/500,9k/1000,9k-apart/500,9k-closed/500,bundle/500,100k/500")
    parser.add_argument("--threads", default="1,2")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--peers", default="scipy,slepc,lapy,dense")
    parser.add_argument("--scratch", type=Path, default=ROOT / "target/bench-eigen")
    parser.add_argument("--prefix", default="")
    parser.add_argument("--program", type=Path, default=ROOT / "target/release/examples/measure")
    parser.add_argument("--crumple", type=Path, default=ROOT / "target/release/crumple", help="reads the mesh of the case bundle/K")
    parser.add_argument("--slepc-python", default="/usr/bin/python3", help="a Python that has slepc4py (Debian: python3-slepc4py)")
    parser.add_argument("--table-only", action="store_true")
    parser.add_argument("--page", type=Path, help="docs/eigen.md")
    options = parser.parse_args()
    prefix, peers = shlex.split(options.prefix), options.peers.split(",") if options.peers else []
    runs = options.scratch / "runs"
    runs.mkdir(parents=True, exist_ok=True)

    for case in options.cases.split(",") if not options.table_only else []:
        mesh, count = case.split("/")
        shape = str(bundle(options.scratch, options.crumple)) if mesh == "bundle" else MESHES.get(mesh, mesh)
        folder = options.scratch / mesh.replace("/", "_")
        if not (folder / "mass.f64").exists():
            subprocess.run([options.program, shape, "1", "--dump", folder], check=True)
        for repeat in range(options.repeats):
            for threads in map(int, options.threads.split(",")):
                for who in ["ours", "ours-full", *peers]:
                    if who == "dense" and not mesh.startswith("9k"):
                        continue
                    file = runs / f"{mesh}-{count}-{threads}-{who}-{repeat}.json"
                    if file.exists():
                        continue
                    if who.startswith("ours"):
                        command = [str(options.program), shape, count, "--rates", *(["--full"] if who == "ours-full" else [])]
                    else:
                        python = options.slepc_python if who == "slepc" else sys.executable
                        command = [python, str(HERE / "peer.py"), who, str(folder), count]
                    found = once(command, threads, prefix)
                    file.write_text(json.dumps(found))
                    print(file.stem, found.get("failed") or f"{found['wall']:.2f} s", flush=True)
    lines = table(options.scratch)
    print(lines)
    if options.page:
        pages.write(options.page, {"peers": lines})


def table(scratch: Path) -> str:
    """Medians of what has been run."""
    cases: dict[tuple, dict[str, list]] = {}
    for file in sorted((scratch / "runs").glob("*.json")):
        *mesh, count, threads, who, _ = file.stem.replace("ours-full", "ours_full").split("-")
        found = json.loads(file.read_text())
        if "failed" not in found:
            cases.setdefault(("-".join(mesh), int(count), int(threads)), {}).setdefault(who, []).append(found)
    rows = []
    for (mesh, count, threads), everyone in sorted(cases.items(), key=lambda item: (item[0][2], item[0][0], item[0][1])):
        ours = everyone.get("ours", [])
        for who, found in everyone.items():
            middle = {key: median(run[key] for run in found) for key in ("wall", "process_cpu", "peak_mb", "residual", "orthogonality", "missing")}
            row = {"mesh": mesh, "pairs": count, "threads": threads, "who": who.replace("_", "-"), "runs": len(found)} | middle
            if ours:
                row["ratio"] = middle["wall"] / median(run["wall"] for run in ours)
                row["ratio_cpu"] = middle["process_cpu"] / median(run["process_cpu"] for run in ours)
            if who.startswith("ours"):
                # One factorisation, 2 K solves and 4 N K^2 operations, at the rates of the run itself.
                limits = [run["seconds"]["factor"] / max(run["factorisations"], 1) + 2 * count * run["seconds"]["solve"] / max(run["solves"], 1)
                          + 4 * run["vertices"] * count**2 / (1e9 * run["gigaflops"]) for run in found]
                row["limit"] = median(limits)
                row["over_limit"] = middle["wall"] * threads / row["limit"]
            rows.append(row)
    (scratch / "table.json").write_text(json.dumps(rows, indent=1))
    head = ["mesh", "who", "K", "threads", "runs", "wall s", "CPU s", "peak MB", "residual", "orthogonality", "missing", "wall ÷ ours", "CPU ÷ ours",
            "over the limit"]
    number = lambda row, key: f"{row[key]:.1f}" if key in row else ""
    lines = pages.table(head, [
        [r["mesh"], r["who"], r["pairs"], r["threads"], r["runs"], f"{r['wall']:.2f}", f"{r['process_cpu']:.2f}", f"{r['peak_mb']:.0f}", f"{r['residual']:.1e}",
         f"{r['orthogonality']:.1e}", f"{r['missing']:.0f}", *(number(r, key) for key in ("ratio", "ratio_cpu", "over_limit"))] for r in rows], text=2)
    (scratch / "table.md").write_text(lines + "\n")
    return lines


if __name__ == "__main__":
    main()
