#!/usr/bin/env python3
"""Our reader beside plain reading and lasso-python, on one family of 400 MB; and opening a family of 1,000 files.

    python benches/read_peers.py MEASURE --scratch FOLDER [--repeats 3]

MEASURE is the example program of the crate d3plot (`crates/d3plot/examples/read_speed.rs`), which also writes the families.
Warm cache. lasso-python is asked for the positions alone (`state_array_filter`) and for everything, each in a process of its
own, alternating with ours; times are medians and leave the start of Python and its imports out, memory is the largest
resident set of the process.
"""
import argparse
import json
import statistics
import subprocess
import sys
from pathlib import Path

PEER = """
import sys, time, json
from lasso.dyna import D3plot, ArrayType
start = time.perf_counter()
plot = D3plot(sys.argv[1], **({"state_array_filter": [ArrayType.node_displacement]} if sys.argv[2] == "filtered" else {}))
shape = plot.arrays["node_displacement"].shape
print(json.dumps({"seconds": time.perf_counter() - start, "shape": shape}))
"""


def run(command):
    """JSON that a process prints, and its largest resident set in MB."""
    script = f"import subprocess, resource, sys; p = subprocess.run({command!r}, stdout=subprocess.PIPE, check=True); " \
        "print(p.stdout.decode().strip()); print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024)"
    lines = subprocess.run([sys.executable, "-c", script], stdout=subprocess.PIPE, check=True).stdout.decode().splitlines()
    return json.loads(lines[-2]), float(lines[-1])


def main():
    parser = argparse.ArgumentParser(description="our reader beside plain reading and lasso-python")
    parser.add_argument("measure")
    parser.add_argument("--scratch", type=Path, required=True)
    parser.add_argument("--repeats", type=int, default=3)
    args = parser.parse_args()
    large, many = args.scratch / "large", args.scratch / "many"
    for what, folder in (("make", large), ("many", many)):
        if not (folder / "d3plot").exists():
            subprocess.run([args.measure, what, str(folder)], check=True)
    size = sum(file.stat().st_size for file in large.iterdir())
    for file in large.iterdir():
        file.read_bytes()  # warm

    ours, _ = run([args.measure, "read", str(large)])
    opened, _ = run([args.measure, "open", str(many)])
    sides = {"ours": [args.measure, "once", str(large)]}
    for kind in ("filtered", "all"):
        sides[f"lasso {kind}"] = [sys.executable, "-c", PEER, str(large / "d3plot"), kind]
    seen = {side: [] for side in sides}
    for _ in range(args.repeats):
        for side, command in sides.items():
            told, memory = run(command)
            seen[side].append((told["seconds"], memory))
    times = {side: statistics.median(time for time, _ in runs) for side, runs in seen.items()}
    memory = {side: max(memory for _, memory in runs) for side, runs in seen.items()}

    print(f"family: {size / 1e6:.0f} MB; coordinates: {ours['bytes'] / 1e6:.1f} MB")
    print(f"plain reads of the same bytes  {ours['plain'] * 1e3:8.2f} ms")
    for key, name in (("f32", "ours, f32"), ("f64", "ours, f64"), ("f32_mapped", "ours, f32, mapped"), ("open_and_f32", "ours, f32, with opening")):
        print(f"{name:30s} {ours[key] * 1e3:8.2f} ms, {ours[key] / ours['plain']:.2f} of plain reading")
    for side in sides:
        print(f"{side:30s} {times[side] * 1e3:8.1f} ms, {memory[side]:7.1f} MB, time {times[side] / times['ours']:.1f}, memory {memory[side] / memory['ours']:.1f} of ours")
    print(f"opening {opened['files']} files: {opened['open'] * 1e3:.2f} ms, {opened['open'] / opened['stat']:.1f} times stat on each ({opened['stat'] * 1e3:.2f} ms)")
    print(json.dumps({"read": ours, "open": opened, "seconds": times, "memory_mb": memory}))


if __name__ == "__main__":
    main()
