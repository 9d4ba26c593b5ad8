#!/usr/bin/env python3
"""The hat-section beam joined in four ways: its first eigenvalues side by side, and what becomes of the rankings.

    python3 benches/joining.py target/release/crumple SCRATCH

Makes the studies `apart`, `distance`, `welds` and `merged` in SCRATCH. `merged` is the deck of run 001 with the nodes
of the plate that lie under the hat's flanges replaced by the flanges' own (standard library only).
"""
import json
import struct
import subprocess
import sys
from pathlib import Path

EXAMPLE = Path(__file__).resolve().parent.parent / "examples/hat-section"
DECK = EXAMPLE / "decks/run_001.k"
RUNS = EXAMPLE / "runs"
FIRST = 20


def crumple(program, *words):
    done = subprocess.run([program, *map(str, words), "--json", "--quiet"], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"crumple {words}: {done.stderr}")
    return json.loads(done.stdout)


def eigenvalues(study):
    """Of a study: 8 bytes with the header's length, a JSON header, the arrays."""
    data = (study / "basis.safetensors").read_bytes()
    (length,) = struct.unpack("<Q", data[:8])
    first, last = json.loads(data[8 : 8 + length])["eigenvalues"]["data_offsets"]
    return struct.unpack(f"<{(last - first) // 8}d", data[8 + length + first : 8 + length + last])


def merge(source, target):
    """Writes the deck with plate nodes right under a flange's node replaced by that node."""
    flange, other, block = {}, {}, ""
    lines = source.read_text().splitlines()
    for line in lines:
        if line.startswith("*"):
            block = line
        elif block == "*NODE":
            x, y, z = (float(line[at : at + 16]) for at in (8, 24, 40))
            if z == 2.0:
                flange[x, y] = line[:8]
            elif z == 0.0:
                other[line[:8]] = (x, y)
    renamed = {node: flange[place] for node, place in other.items() if place in flange}
    out = []
    for line in lines:
        if line.startswith("*"):
            block = line
        elif block == "*NODE" and line[:8] in renamed:
            continue
        elif block == "*ELEMENT_SHELL":
            fields = [line[at : at + 8] for at in range(0, len(line), 8)]
            line = "".join(fields[:2] + [renamed.get(field, field) for field in fields[2:]])
        out.append(line)
    target.write_text("\n".join(out) + "\n")
    return len(renamed)


def main():
    program, scratch = sys.argv[1], Path(sys.argv[2])
    scratch.mkdir(parents=True, exist_ok=True)
    print(f"{merge(DECK, scratch / 'merged.k')} nodes merged")
    ways = {
        "apart": [],
        "distance": ["--join", "2.5"],
        "welds": ["--join", "deck", "--deck", DECK],
        "merged": [],
    }
    facts, spectra = {}, {}
    for name, words in ways.items():
        study = scratch / name
        if name == "merged":
            facts[name] = crumple(program, "init", study, "--reference", scratch / "merged.k")
        else:
            facts[name] = crumple(program, "analyze", RUNS, *words, "-o", study)["init"]
        spectra[name] = eigenvalues(study)
    print("\n| k | " + " | ".join(ways) + " |\n|" + "---:|" * (len(ways) + 1))
    for k in range(FIRST):
        row = " | ".join(f"{1e5 * spectra[name][k]:.4f}" for name in ways)
        print(f"| {k + 1} | {row} |")
    for name in ways:
        print(name, {key: facts[name][key] for key in ("vertices", "null_space", "joined_pairs", "close")})
    for name in list(ways)[:3]:
        told = crumple(program, "compare", scratch / name, "--labels", EXAMPLE / "labels.csv")
        print(f"\n{name}")
        for row in told["rows"]:
            if row["method"] == "descriptor" and row["select"] == "coordinates":
                keys = ("label", "query", "size", "rms", "precision_at_9", "average_precision", "mean_average_precision")
                print("  ", {key: row[key] for key in keys})
        for modes in told["modes"]:
            if modes["by"] == "rotation" and modes["method"] == "kmeans" and modes["chosen"]:
                print("  ", {key: modes[key] for key in ("count", "silhouette", "ari")})


if __name__ == "__main__":
    main()
