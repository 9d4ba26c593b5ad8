#!/usr/bin/env python3
"""Measures projecting a bundle: `crumple add` beside reading the same files alone, and beside lasso-python + NumPy.

    python projection.py BUNDLE [--repeats 3] [--join 2.5] [-K 500] [--scratch target/projection]

One study is made before; each round then takes, in turn, a plain read of every byte of the files, `crumple add` into a copy
of the study, and a script that reads the positions with lasso-python, multiplies by the same basis (Phi^T M u of every
state) and saves the table. Each is a process of its own. Twice: with the files in the system's cache, and with the cache
told to forget them before each process, so that they come from the disk.
Prints a Markdown table: seconds, seconds per gigabyte of the files, ratio to reading alone.
"""
from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from statistics import median

from side_by_side import HERE, SLOWS_OPENBLAS, measure, processor

READ, OURS, PEER = "reading alone", "crumple add", "lasso-python + NumPy"
PIECE = 1 << 20  # bytes read at a time


def files_of(bundle: Path) -> list[Path]:
    return sorted(bundle.glob("*/d3plot*"))


def read_alone(bundle: Path) -> None:
    """Every byte once, one file after the other."""
    piece = bytearray(PIECE)
    for path in files_of(bundle):
        with open(path, "rb", buffering=0) as file:
            while file.readinto(piece):
                pass


def peer(bundle: Path, study: Path, out: Path) -> None:
    """Coefficients of every state of every run, as a competent user of these packages writes it."""
    import numpy as np
    from lasso.dyna import ArrayType, D3plot
    from safetensors.numpy import load_file

    basis = load_file(study / "basis.safetensors")
    weighted = basis["eigenvectors"] * basis["mass"].astype(np.float32)  # Phi^T M, K x N
    start = time.perf_counter()
    tables, reading, nodes, rest = [], 0.0, None, None
    for root in sorted(bundle.glob("*/d3plot")):
        before = time.perf_counter()
        arrays = D3plot(str(root), state_array_filter=[ArrayType.global_timesteps, ArrayType.node_displacement]).arrays
        reading += time.perf_counter() - before
        if nodes is None:
            nodes = np.unique(arrays[ArrayType.element_shell_node_indexes])  # those that a shell uses, in order
            rest = arrays[ArrayType.node_coordinates][nodes]
        moved = arrays[ArrayType.node_displacement][:, nodes] - rest  # lasso's name for positions; S x N x 3
        tables.append(np.einsum("kn,snc->skc", weighted, moved, optimize=True))
    np.save(out, np.concatenate(tables))
    print(json.dumps({"states": sum(map(len, tables)), "reading": reading, "all": time.perf_counter() - start}))


def forget(bundle: Path) -> None:
    """Tells the system that nobody needs these files in memory."""
    for path in files_of(bundle):
        with open(path, "rb") as file:
            os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)


def main() -> None:
    parser = argparse.ArgumentParser(description="crumple add beside reading alone and a peer, alternating")
    parser.add_argument("bundle", type=Path)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--join", default="2.5")
    parser.add_argument("-K", "--eigenpairs", default="500")
    parser.add_argument("--crumple", type=Path, default=HERE.parent / "target/release/crumple")
    parser.add_argument("--scratch", type=Path, default=Path("target/projection"))
    parser.add_argument("--only", choices=["read", "peer"], help="what the processes of the measurement are told")
    args = parser.parse_args()
    study, copy = args.scratch / "study", args.scratch / "copy"
    if args.only == "read":
        return read_alone(args.bundle)
    if args.only == "peer":
        return peer(args.bundle, study, args.scratch / "peer.npy")

    shutil.rmtree(args.scratch, ignore_errors=True)
    args.scratch.mkdir(parents=True)
    first = files_of(args.bundle)[0]
    make = [args.crumple, "init", study, "--reference", first, "-K", args.eigenpairs, "--quiet"]
    make += ["--join", args.join] if args.join else []
    subprocess.run(make, check=True, stdout=subprocess.DEVNULL)
    own = [sys.executable, str(HERE / "projection.py"), str(args.bundle), "--scratch", str(args.scratch), "--only"]
    ours = [str(args.crumple), "add", str(copy), str(args.bundle), "--json", "--quiet"]
    commands = {READ: [*own, "read"], OURS: ours, PEER: [*own, "peer"]}
    environment = {name: value for name, value in os.environ.items() if name not in SLOWS_OPENBLAS}

    gigabytes = sum(path.stat().st_size for path in files_of(args.bundle)) / 1e9
    print(f"{gigabytes:.3f} GB in {len(files_of(args.bundle))} files; {processor()}; {args.repeats} rounds, medians\n")
    print("| | files | seconds | seconds a GB | to reading alone |\n|---|---|---:|---:|---:|")
    for where in ("in the cache", "on the disk"):
        walls: dict[str, list[float]] = {name: [] for name in commands}
        for _ in range(args.repeats):
            for name, command in commands.items():
                shutil.rmtree(copy, ignore_errors=True)
                shutil.copytree(study, copy)
                read_alone(args.bundle) if where == "in the cache" else forget(args.bundle)
                walls[name].append(measure(command, environment).wall)
        for name, times in walls.items():
            wall = median(times)
            print(f"| {name} | {where} | {wall:.2f} | {wall / gigabytes:.2f} | {wall / median(walls[READ]):.1f} |")


if __name__ == "__main__":
    main()
