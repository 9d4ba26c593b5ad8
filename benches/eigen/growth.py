#!/usr/bin/env python3
"""How time and memory of the eigenbasis grow with N and K: what `just bench-growth` runs.

    python growth.py [--scratch target/bench-eigen] [--program PROGRAM] [--prefix COMMAND] [--page docs/eigen.md]

One run of each case on one thread, on the hat-section beam; what has been run is not run again. Writes the table of the
page between its marks, and docs/images/eigen-growth.png, with logarithmic axes.
"""
from __future__ import annotations

import argparse
import json
import math
import shlex
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.path[:0] = [str(HERE), str(ROOT / "benches")]
import pages  # noqa: E402
from run import once  # noqa: E402

BY_N = [(n, 500) for n in (3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000)]
BY_K = [(100_000, k) for k in (50, 100, 200, 500, 1000)]


def measured(options: argparse.Namespace) -> dict[tuple[int, int], dict]:
    runs = options.scratch / "growth"
    runs.mkdir(parents=True, exist_ok=True)
    found = {}
    for n, k in [*BY_N, *BY_K]:
        file = runs / f"{n}-{k}.json"
        if not file.exists():
            result = once([str(options.program), f"hat:{n}", str(k), "--rates"], 1, shlex.split(options.prefix))
            file.write_text(json.dumps(result))
            print(file.stem, result.get("failed") or f"{result['wall']:.2f} s", flush=True)
        found[n, k] = json.loads(file.read_text())
    return {case: run for case, run in found.items() if "failed" not in run}


def table(found: dict[tuple[int, int], dict]) -> str:
    head = ["vertices", "K", "seconds", "peak memory", "of it the result", "residual", "orthogonality", "solves a pair"]
    rows = [[f"{run['vertices']:,}", k, f"{run['wall']:.2f}", f"{run['peak_mb']:.0f} MB", f"{8e-6 * run['vertices'] * k:.0f} MB", f"{run['residual']:.0e}",
             f"{run['orthogonality']:.0e}", f"{run['solves'] / k:.1f}"] for (_, k), run in sorted(found.items())]
    lines = [pages.table(head, rows, text=0)]
    for by, cases in (("N", BY_N[2:]), ("K", BY_K[1:])):
        low, high = found.get(cases[0]), found.get(cases[-1])
        if low and high:
            size = (lambda run: run["vertices"]) if by == "N" else (lambda run: run["pairs"])
            power = [math.log(high[what] / low[what]) / math.log(size(high) / size(low)) for what in ("wall", "peak_mb")]
            lines += ["", f"From {size(low):,} to {size(high):,} {'vertices' if by == 'N' else 'pairs'} time grows as {by}^{power[0]:.2f}, "
                          f"memory as {by}^{power[1]:.2f}."]
    return "\n".join(lines)


def picture(found: dict[tuple[int, int], dict], file: Path) -> None:
    figure, axes = pyplot.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for axis, cases, size, label in ((axes[0], BY_N, "vertices", "vertices N, K = 500"), (axes[1], BY_K, "pairs", "eigenpairs K, N = 100,820")):
        runs = [found[case] for case in cases if case in found]
        sizes = [run[size] for run in runs]
        axis.loglog(sizes, [run["wall"] for run in runs], "o-", color="#0072b2", label="seconds, one thread")
        axis.loglog(sizes, [run["peak_mb"] / 1000 for run in runs], "s--", color="#d55e00", label="peak memory, GB")
        axis.loglog(sizes, [8e-9 * run["vertices"] * run["pairs"] for run in runs], ":", color="#555555", label="the result, GB")
        axis.set_xlabel(label)
        axis.grid(True, which="major", color="#dddddd")
    axes[0].legend(frameon=False)
    figure.savefig(file, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scratch", type=Path, default=ROOT / "target/bench-eigen")
    parser.add_argument("--program", type=Path, default=ROOT / "target/release/examples/measure")
    parser.add_argument("--prefix", default="", help="put before every measured command")
    parser.add_argument("--page", type=Path, default=ROOT / "docs/eigen.md")
    options = parser.parse_args()
    found = measured(options)
    picture(found, options.page.parent / "images/eigen-growth.png")
    pages.write(options.page, {"growth": table(found)})


if __name__ == "__main__":
    main()
