#!/usr/bin/env python3
"""Measures `crumple analyze` and its peer on one bundle, alternately.

    python side_by_side.py BUNDLE [--repeats 3] [--join 2.5] [--scratch target/side-by-side]

Each program runs as a process of its own, from nothing to the finished page; wall time, CPU seconds of all threads
and peak resident memory are the kernel's figures for it. The files are read once before, so that neither side
pays for a cold disk. The peer runs with OPENBLAS_CORETYPE and OPENBLAS_L2_SIZE unset, which would slow it.
Needs `cargo build --release` and the Python packages of tests-python/requirements.txt.
Prints a Markdown table of medians and ratios.
"""
from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from statistics import median

HERE = Path(__file__).resolve().parent
SLOWS_OPENBLAS = ("OPENBLAS_CORETYPE", "OPENBLAS_L2_SIZE")


@dataclass
class Measured:
    """What one process cost."""

    wall: float  # seconds
    cpu: float  # seconds, user and system, all threads
    peak: float  # MB resident
    output: str


def measure(command: list[str], environment: dict[str, str]) -> Measured:
    start = time.perf_counter()
    process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)
    output = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.perf_counter() - start
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        raise SystemExit(f"{' '.join(command)}: exit code {process.returncode}")
    return Measured(wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, output)


def processor() -> str:
    names = [line.split(":", 1)[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("model name")]
    return f"{len(names)} x {names[0]}" if names else "unknown processor"


def main() -> None:
    parser = argparse.ArgumentParser(description="crumple analyze beside its peer, alternating")
    parser.add_argument("bundle", type=Path)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--join", default="2.5", help="passed to both")
    parser.add_argument("--crumple", type=Path, default=HERE.parent / "target/release/crumple")
    parser.add_argument("--python", default=sys.executable, help="interpreter of the peer")
    parser.add_argument("--scratch", type=Path, default=Path("target/side-by-side"))
    args = parser.parse_args()

    ours_out, peer_out = args.scratch / "crumple", args.scratch / "peer"
    ours = [str(args.crumple), "analyze", str(args.bundle), "--join", args.join, "-o", str(ours_out)]
    peer = [args.python, str(HERE / "analyze_peer.py"), str(args.bundle), str(peer_out), "--join", args.join]
    peer_environment = {name: value for name, value in os.environ.items() if name not in SLOWS_OPENBLAS}
    size = sum(len(path.read_bytes()) for path in args.bundle.glob("*/d3plot*"))

    rounds: dict[str, list[Measured]] = {"crumple": [], "peer": []}
    for _ in range(args.repeats):
        for name, command, environment, out in (("crumple", ours, dict(os.environ), ours_out), ("peer", peer, peer_environment, peer_out)):
            shutil.rmtree(out, ignore_errors=True)
            out.parent.mkdir(parents=True, exist_ok=True)
            rounds[name].append(measure(command, environment))

    said = [json.loads(run.output) for run in rounds["peer"]]
    version = subprocess.run([str(args.crumple), "--version"], capture_output=True, text=True, check=True).stdout.strip()
    packages = ", ".join(f"{name} {number}" for name, number in said[0]["versions"].items())
    kernels = sorted({f"OpenBLAS {pool['version']} {pool['architecture']}" for pool in said[0]["threads"] if pool["internal_api"] == "openblas"})
    print(f"{said[0]['runs']} runs, {said[0]['states']} states, {size / 1e6:.0f} MB; {processor()}; {version}; {packages}; {', '.join(kernels)}; "
          f"{args.repeats} runs each, alternating, medians\n")
    print("| | crumple | lasso-python + SciPy + scikit-learn | ratio |\n|---|---|---|---|")
    for label, unit, of in (("wall", "s", lambda run: run.wall), ("CPU", "s", lambda run: run.cpu), ("peak memory", "MB", lambda run: run.peak)):
        a, b = (median(of(run) for run in rounds[name]) for name in ("crumple", "peer"))
        print(f"| {label} | {a:.2f} {unit} | {b:.2f} {unit} | {b / a:.1f} |")
    print("\nStages of the peer, seconds: " + ", ".join(f"{stage} {median(run['seconds'][stage] for run in said):.2f}" for stage in said[0]["seconds"]))


if __name__ == "__main__":
    main()
