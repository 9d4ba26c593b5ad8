#!/usr/bin/env python3
"""Label every run of a bundle from the node coordinates of its final state.

    python3 labels.py runs labels.csv          (needs numpy and lasso-python to read d3plot)

The rule uses the displaced centre line of the beam only, no spectral method; it is
described in DATA.md.
"""
import csv
import glob
import os
import sys

import numpy as np


def centre_line(x0, x):
    """Mean position of each cross section (stations of equal initial x)."""
    st, inv = np.unique(np.round(x0[:, 0], 3), return_inverse=True)
    n = np.bincount(inv)
    return st, np.column_stack([np.bincount(inv, x[:, k]) / n for k in range(3)])


def measures(x0, x):
    st, c = centre_line(x0, x)
    _, c0 = centre_line(x0, x0)
    length = st[-1] - st[0]
    # smooth over three stations, ends kept
    s = c.copy()
    s[1:-1] = (c[:-2] + c[1:-1] + c[2:]) / 3
    chord = s[-1] - s[0]
    chord_len = np.linalg.norm(chord)
    e = chord / chord_len
    d = s - s[0]
    perp = d - np.outer(d @ e, e)
    k = np.argmax(abs(perp[:, 2]))
    sag_z = perp[k, 2]
    counter = (-np.sign(sag_z) * perp[:, 2]).max()      # the largest deviation the other way
    ky = np.argmax(abs(perp[:, 1]))
    step = np.linalg.norm(np.diff(s, axis=0), axis=1)
    step0 = np.diff(st)
    loss = step0 - step                      # local shortening of the centre line
    shortening = (c0[-1, 0] - c0[0, 0]) - (c[-1, 0] - c[0, 0])
    line_loss = loss.sum()                   # shortening by folding, not by bending
    w = np.clip(loss, 0, None) ** 2
    mid = (st[:-1] + st[1:]) / 2
    fold = (w @ mid) / w.sum()
    spread = np.sqrt((w @ (mid - fold) ** 2) / w.sum())
    return dict(sagitta_mm=sag_z, sagitta_x_mm=st[k], counter_mm=counter, sagitta_y_mm=perp[ky, 1], shortening_mm=shortening,
                fold_share=line_loss / shortening, fold_position_mm=fold, fold_spread_mm=spread,
                end_drop_mm=c[-1, 2] - c0[-1, 2])


COLUMNS = ("run", "label", "clear", "sagitta_mm", "sagitta_position_mm", "counter_sagitta_mm", "side_sagitta_mm", "shortening_mm",
           "fold_share", "fold_position_mm", "fold_spread_mm", "max_plastic_strain")


def label(m):
    s, sy, spread = m["sagitta_mm"], m["sagitta_y_mm"], m["fold_spread_mm"]
    share, counter = m["fold_share"], m["counter_mm"]
    if abs(s) >= 45 and share <= 0.70 and counter < 0.5 * abs(s):
        name = "up" if s > 0 else "down"
        clear = abs(s) >= 55 and abs(sy) < 15 and share < 0.60 and counter < 0.25 * abs(s)
    elif abs(s) <= 30 and spread <= 120:
        name = "crush"
        clear = abs(s) <= 26 and abs(sy) < 15 and spread <= 100
    else:
        name, clear = "mixed", False
    return name, bool(clear)


def row(run, x0, x, eps):
    m = measures(x0, x)
    name, clear = label(m)
    return dict(run=run, label=name, clear=str(clear).lower(), sagitta_mm=f"{m['sagitta_mm']:.1f}",
                sagitta_position_mm=f"{m['sagitta_x_mm']:.0f}", counter_sagitta_mm=f"{m['counter_mm']:.1f}",
                side_sagitta_mm=f"{m['sagitta_y_mm']:.1f}",
                shortening_mm=f"{m['shortening_mm']:.1f}", fold_share=f"{m['fold_share']:.2f}",
                fold_position_mm=f"{m['fold_position_mm']:.0f}", fold_spread_mm=f"{m['fold_spread_mm']:.0f}",
                max_plastic_strain=f"{eps.max():.3f}")


def main():
    from lasso.dyna import D3plot
    root, table = sys.argv[1:]
    out = []
    for folder in sorted(glob.glob(os.path.join(root, "run_*"))):
        a = D3plot(os.path.join(folder, "d3plot")).arrays
        out.append(row(os.path.basename(folder), a["node_coordinates"].astype(float),
                       a["node_displacement"][-1].astype(float), a["element_shell_effective_plastic_strain"][-1]))
    with open(table, "w", newline="") as f:
        w = csv.DictWriter(f, COLUMNS, lineterminator="\n")
        w.writeheader()
        w.writerows(out)


if __name__ == "__main__":
    main()
