#!/usr/bin/env python3
"""Make the example's d3plot families from the full bundle by keeping every second state.

    python3 thin_states.py BUNDLE OUT

BUNDLE holds folders `run_001`, `run_002`, ... with one d3plot family each, seven states in it
(0, 1, ..., 6 ms). OUT gets folders of the same names with the states 0, 2, 4 and 6 ms. Needs NumPy.

Nothing is decoded and written anew. The root member (control block, geometry, user numbers, titles)
is copied byte by byte, and so is each state that is kept. Only how the states are cut into members
changes, in proportion: all states in one file stay in one file, one state per file stays so, and
three of seven per file become two of four. Each member ends as the format wants it: an end mark
(-999999.0), then zeros up to a multiple of 512 words.

The length of a state is computed from the control block, for the kind of file this bundle has (single
precision, little endian, four-node shells only, nodal coordinates without velocities), and every
member is checked against it: a whole number of states, the end mark right after them, zeros after
that. Anything else stops the program.
"""
import argparse
import math
import re
from pathlib import Path

import numpy as np

KEEP = (0, 2, 4, 6)  # states of the full bundle, one every millisecond
END_MARK = np.array([-999999.0], "<f4")
BLOCK = 512  # words; a member's length is a multiple of it

# Words of the control block (counted from 0) that fix the length of a state here ...
NUMNP, NGLBV, NEL4, NV2D = 16, 18, 31, 33
# ... and those which would add to it, with the value that adds nothing.
EXPECTED = {"NDIM": (15, 4), "IT": (19, 0), "IU": (20, 1), "IV": (21, 0), "IA": (22, 0), "NEL8": (23, 0), "NEL2": (28, 0),
            "NMSPH": (37, 0), "NELT": (40, 0), "NPEFG": (54, 0), "IDTDT": (56, 0), "EXTRA": (57, 0)}


def words_per_state(root: np.ndarray) -> int:
    """Length of one state in words: time, globals, coordinates of the nodes, values of the shells."""
    control = root[:64].view("<i4")
    for name, (word, value) in EXPECTED.items():
        if control[word] != value:
            raise SystemExit(f"control word {word} ({name}) is {control[word]}, expected {value}: not a family of this bundle")
    return int(1 + control[NGLBV] + 3 * control[NUMNP] + control[NEL4] * control[NV2D])


def states_of(member: Path, length: int) -> np.ndarray:
    """The states of one member, one a row, as raw words."""
    words = np.fromfile(member, "<f4")
    count = len(words) // length
    rest = words[count * length:]
    if count == 0 or rest[0] != END_MARK[0] or rest[1:].any():
        raise SystemExit(f"{member}: no end mark after {count} states of {length} words, or something behind it")
    return words[: count * length].reshape(count, length)


def member_bytes(states: np.ndarray) -> bytes:
    """The states as one member of a family: end mark and padding after them."""
    words = np.concatenate([states.ravel(), END_MARK])
    return np.pad(words, (0, -len(words) % BLOCK)).tobytes()


def thin(source: Path, target: Path) -> None:
    """Write the family of folder `source` to folder `target`, only the states in KEEP."""
    length = words_per_state(np.fromfile(source / "d3plot", "<f4"))
    members = sorted((p for p in source.iterdir() if re.fullmatch(r"d3plot\d{2,3}", p.name)), key=lambda p: int(p.name[6:]))
    blocks = [states_of(member, length) for member in members]
    states = np.concatenate(blocks)
    kept = states[list(KEEP)]
    per_file = math.ceil(len(blocks[0]) * len(kept) / len(states))

    target.mkdir(parents=True, exist_ok=True)
    (target / "d3plot").write_bytes((source / "d3plot").read_bytes())
    for number, first in enumerate(range(0, len(kept), per_file), start=1):
        (target / f"d3plot{number:02d}").write_bytes(member_bytes(kept[first:first + per_file]))


def main() -> None:
    parser = argparse.ArgumentParser(description="keep the states 0, 2, 4, 6 ms of every run")
    parser.add_argument("bundle", type=Path)
    parser.add_argument("out", type=Path)
    args = parser.parse_args()
    runs = sorted(p for p in args.bundle.iterdir() if re.fullmatch(r"run_\d+", p.name))
    for run in runs:
        thin(run, args.out / run.name)
    size = sum(p.stat().st_size for p in args.out.rglob("d3plot*"))
    print(f"{len(runs)} runs, {size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
