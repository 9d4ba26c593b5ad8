#!/usr/bin/env python3
"""The table case → ours → lasso-python → VTK → dynars of `docs/reading.md`.

    python benches/read_table.py CRUMPLE FOLDER... [--write PAGE]

`--write` puts the table into PAGE, between the lines `<!-- read-table -->` and `<!-- /read-table -->`.

Each FOLDER holds families, each with an `expected.json` that says what is in it. Every program reads every family in a process
of its own, for two minutes at most, and is judged alike: the number of states, and least, largest and sum of the positions of all
nodes in the first and in the last state (of VTK, which shows the nodes of elements only: least and largest lie within those,
and the states are as many). Needs lasso-python, vtk and dynars (`pip install lasso-python==2.0.4 vtk==9.7.2 dynars==1.1.0`).
"""
import argparse
import importlib.metadata
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
READ = HERE.parent / "tests-python" / "read_d3plot.py"

DYNARS = """
import json, sys, numpy as np, dynars
plot = dynars.open_d3plot(sys.argv[1])
def state(k):
    p = np.asarray(plot.node_coordinates(k), float).reshape(-1, 3)
    return {"coordinates": {"min": p.min(0).tolist(), "max": p.max(0).tolist(), "sum": p.sum(0).tolist()}}
n = plot.num_states
n = n() if callable(n) else n
print(json.dumps({"times": [0.0] * n, "states": [state(0), state(n - 1)] if n else []}))
"""


def run(command):
    """JSON of a process, or a word on how it failed."""
    try:
        with tempfile.TemporaryDirectory() as place:
            done = subprocess.run(command, capture_output=True, timeout=120, cwd=place)
    except subprocess.TimeoutExpired:
        return None, "never returns"
    if done.returncode < 0:
        return None, f"**dies** (signal {-done.returncode})"
    if done.returncode:
        words = done.stderr.decode(errors="replace")
        return None, "**panics**" if "panicked" in words else "refuses"
    try:
        words = done.stdout.decode().strip()
        return json.loads(words if words.startswith("{") else words.splitlines()[-1]), None
    except (ValueError, IndexError):
        return None, "refuses"


def ours(crumple, root):
    found, word = run([crumple, "info", root, "--ranges", "--json"])
    if word:
        return None, word
    states = [found[name] for name in ("first_state", "last_state") if found[name]]
    return {"states": states, "times": found["times"]}, None


def same(a, b):
    return a is not None and b is not None and all(abs(x - y) <= 1e-5 * max(1e3, abs(y)) for x, y in zip(a, b))


def judge(found, word, expected, box_only):
    if "error" in expected:
        return "refused" if word == "refuses" else (word or f"{len(found['times'])} states from a family that is cut or compressed")
    if word:
        return word
    if len(found["times"]) != expected["n_states"]:
        return f"{len(found['times'])} of {expected['n_states']} states"
    for name, state in zip(("first_state", "last_state"), found["states"]):
        known = expected[name]["coordinates"]
        got = state.get("coordinates")
        if known is None:
            if got is not None and not box_only:
                return "positions that are not there"
            continue
        if got is None:
            return "no positions"
        if box_only:
            inside = all(g >= k - 1e-3 for g, k in zip(got["min"], known["min"])) and all(g <= k + 1e-3 for g, k in zip(got["max"], known["max"]))
            if not inside or any(math.isnan(x) for x in got["min"]):
                return f"wrong positions ({name.replace('_', ' ')})"
        elif not all(same(got[key], known[key]) for key in ("min", "max", "sum")):
            return f"wrong positions ({name.replace('_', ' ')})"
    return "right"


def table(crumple, folders):
    versions = {name: importlib.metadata.version(name) for name in ("lasso-python", "vtk", "dynars")}
    names = " | ".join(f"{name} {version}" for name, version in versions.items())
    yield f"| case | what it is | ours | {names} |"
    yield "| --- | --- | --- | --- | --- | --- |"
    right = [0, 0, 0, 0]
    # some real families are in both folders
    families = {path.parent.name: path.parent for folder in folders for path in Path(folder).glob("*/expected.json")}
    for _, folder in sorted(families.items()):
        file = json.loads((folder / "expected.json").read_text())
        root, expected = str((folder / file["root"]).resolve()), file["expected"]
        answers = [
            judge(*ours(crumple, root), expected, False),
            judge(*run([sys.executable, str(READ), "lasso", root]), expected, False),
            judge(*run([sys.executable, str(READ), "vtk", root]), expected, True),
            judge(*run([sys.executable, "-c", DYNARS, root]), expected, False),
        ]
        right = [count + (answer in ("right", "refused")) for count, answer in zip(right, answers)]
        what = file.get("what", "").split(";")[0].split(",")[0].replace("|", "/")
        yield f"| `{folder.name}` | {what} | {' | '.join(answers)} |"
    yield f"| | right, or refused rightly | {' | '.join(str(count) for count in right)} |"


def main():
    parser = argparse.ArgumentParser(description="the table case → ours → lasso-python → VTK → dynars")
    parser.add_argument("crumple")
    parser.add_argument("folders", nargs="+")
    parser.add_argument("--write", type=Path)
    args = parser.parse_args()
    lines = []
    for line in table(args.crumple, args.folders):
        print(line, flush=True)
        lines.append(line)
    if args.write:
        page = args.write.read_text()
        begin, end = "<!-- read-table -->\n", "<!-- /read-table -->"
        before, rest = page.split(begin, 1)
        args.write.write_text(before + begin + "\n".join(lines) + "\n" + end + rest.split(end, 1)[1])


if __name__ == "__main__":
    main()
