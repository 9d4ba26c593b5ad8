#!/usr/bin/env python3
"""Gives the rigid bodies of a synthetic family with NDIM 8 or 9 a motion, in place of the words that make_d3plot.py leaves there.

    python rigid_motion.py FAMILY [--by-columns]

FAMILY was written by make_d3plot.py, one state after the other in its members, the motion of the bodies last in each state.
A body turns by a constant spin about an axis of its own and drifts, starting from a frame of its own (not the identity), so that
the rotation since the start is the product of two matrices. `expected.json` gets the positions of all nodes.
"""
import json
import sys
from pathlib import Path

import numpy as np

folder, by_columns = Path(sys.argv[1]), "--by-columns" in sys.argv[2:]
file = json.loads((folder / "expected.json").read_text())
options, expected = file["options"], file["expected"]
word = np.dtype("f8" if options.get("double") else "f4").newbyteorder(options.get("endian", "<"))
S, columns = expected["words_per_state"], 12 if options["ndim"] == 9 else 24
bodies = [np.array(body) - 1 for body in options["rigid_nodes"]]

root = np.fromfile(folder / "d3plot", word)
N = expected["n_nodes"]
ints = root.view(word.str.replace("f", "i"))
# coordinates follow the control block and, if there is one, the section of material types
start = 64 + (2 + ints[51] if options.get("material_section_in_8") else 0)
X = root[start:start + 3 * N].reshape(N, 3).astype(float)


def rotation(vector):
    angle = np.linalg.norm(vector)
    if angle == 0:
        return np.eye(3)
    x, y, z = vector / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


rigid = np.concatenate(bodies)
active = np.setdiff1d(np.arange(N), rigid)
seen, first = 0, {}
for member in expected["members"][1:]:
    words = np.fromfile(folder / member, word)
    for at in range(0, len(words) - S + 1, S):
        t = float(words[at])
        if t == -999999 or (seen and t == 0):
            break
        k = seen
        seen += 1
        state = words[at:at + S]
        motion = np.zeros((len(bodies), columns))
        globals_ = ints[18]
        places = state[1 + globals_:1 + globals_ + 3 * len(active)].reshape(-1, 3)
        positions = np.zeros((N, 3))
        for b, body in enumerate(bodies):
            spin = np.array([(0.1, 400, -60), (300, 0.2, 90)][b % 2])     # radians a second; a state is a millisecond
            velocity, frame = np.array([-900.0, 200 * b, 700]), rotation(np.array([0.4, -0.3, 1.1 + b]))
            c0 = X[body].mean(0)
            c, D = c0 + velocity * t, rotation(spin * t)
            R = D @ frame
            motion[b, :3], motion[b, 3:12] = c, (R.T if by_columns else R).ravel()
            if columns == 24:
                motion[b, 12:15], motion[b, 15:18] = velocity, spin
            # what the words of this precision say, not what they were rounded from
            said = motion[b, :12].astype(word).astype(float)
            first.setdefault(b, said)
            D_said = said[3:].reshape(3, 3).T @ first[b][3:].reshape(3, 3) if by_columns else said[3:].reshape(3, 3) @ first[b][3:].reshape(3, 3).T
            positions[body] = said[:3] + (X[body] - first[b][:3]) @ D_said.T
            # nodes beside a body go with it, and a little their own way
            beside = [n for n in active if np.abs(X[n] - c0).max() <= 20]
            for n in beside:
                places[np.searchsorted(active, n)] = c + (X[n] - c0) @ D.T + 0.2 * t / 0.002 * np.sin([n, 2 * n, 3 * n])
        state[S - motion.size:] = motion.ravel()
        positions[active] = places
        if k in (0, expected["n_states"] - 1):
            record = expected["first_state" if k == 0 else "last_state"]
            record["coordinates"] = {"min": positions.min(0).tolist(), "max": positions.max(0).tolist(), "sum": positions.sum(0).tolist()}
    words.tofile(folder / member)
file["motion"] = "rigid_motion.py" + (" --by-columns" if by_columns else "")
(folder / "expected.json").write_text(json.dumps(file, indent=1) + "\n")
