#!/usr/bin/env python3
"""Write the LS-DYNA keyword deck of one run of the hat-section bundle.

    python3 make_deck.py inputs.csv run_001 coarse|fine out.k

The runs of this folder were made with `coarse`.

Units: mm, ms, kg (so kN, GPa).  Only NumPy and the standard library are used.

The beam lies along x, 0..480 mm.  The base plate is the plane z=0, the hat
stands on it with its flanges in the plane z=GAP.  The two parts do not share
nodes; rigid spot welds join them along the middle of both flanges.
"""
import csv
import sys

import numpy as np

# ---------------------------------------------------------------- dimensions
L = 480.0          # length
TOP = 64.0         # width of the hat top
H = 48.0           # height of the hat
FLANGE = 16.0      # width of a flange
GAP = 2.0          # distance of the mid surfaces of flange and base plate
T_NOTCH = 1.0e-4   # thickness of a notch element
WELD_PITCH = 20.0  # distance of the spot welds
MESH = {"coarse": (10.0, 8.0), "fine": (4.0, 4.0)}   # (dx, edge in the section)
STATES = {"coarse": 7, "fine": 4}      # states that the solver writes, the undeformed one included
DT2MS = {"coarse": -5.0e-4, "fine": -4.5e-4}   # time step of the mass scaling, ms
PART_TITLE = {1: "HAT", 2: "BASE_PLATE", 3: "HAT_NOTCH", 4: "BASE_PLATE_NOTCH"}

# ------------------------------------------------------ material and loading
RHO, E, NU = 7.85e-6, 210.0, 0.3       # kg/mm3, GPa
SIGY, ETAN = 0.30, 1.0                 # GPa, linear hardening
NOTCH_RHO_FACTOR, NOTCH_ETAN = 100.0, 0.001   # the foil of a notch: heavier and without hardening, so that it stays stable
FRICTION = 0.2                         # self contact
CONTACT_T = 1.2                        # contact thickness, the same for all t


def profile(h):
    """Section polylines (y, z): hat from left to right flange, base plate."""
    def seg(p, q):
        n = int(round(max(abs(q[0] - p[0]), abs(q[1] - p[1])) / h))
        s = np.arange(n)[:, None] / n
        return np.array(p) + s * (np.array(q) - np.array(p))
    yt, yf = TOP / 2, TOP / 2 + FLANGE
    hat = [(-yf, GAP), (-yt, GAP), (-yt, GAP + H), (yt, GAP + H), (yt, GAP), (yf, GAP)]
    hat = np.vstack([seg(a, b) for a, b in zip(hat[:-1], hat[1:])] + [np.array([hat[-1]])])
    nb = int(round(2 * yf / h))
    base = np.column_stack([np.linspace(-yf, yf, nb + 1), np.zeros(nb + 1)])
    return hat, base


def build_mesh(kind):
    """User node ids, coordinates, user element ids, connectivity (user ids),
    element centres and 'is hat' flags."""
    dx, h = MESH[kind]
    xs = np.linspace(0.0, L, int(round(L / dx)) + 1)
    nid, xyz, eid, con, hatflag = [], [], [], [], []
    for part, prof in enumerate(profile(h)):
        first = 1001 if part == 0 else 50001
        m = len(prof)
        for i, x in enumerate(xs):
            for j, (y, z) in enumerate(prof):
                nid.append(first + i * m + j)
                xyz.append((x, y, z))
        e = first
        for i in range(len(xs) - 1):
            for j in range(m - 1):
                a = first + i * m + j
                con.append((a, a + m, a + m + 1, a + 1))
                eid.append(e)
                hatflag.append(part == 0)
                e += 1
    nid, xyz = np.array(nid), np.array(xyz)
    eid, con, hatflag = np.array(eid), np.array(con), np.array(hatflag)
    pos = {n: k for k, n in enumerate(nid)}
    idx = np.vectorize(pos.get)(con)
    return nid, xyz, eid, con, idx, hatflag


# Notch places.  Each is a test on the element centre (y, z) and the part.
def place_mask(place, c, hat):
    y, z = c[:, 1], c[:, 2]
    yt = TOP / 2
    fl, top = GAP + 1e-6, GAP + H - 1e-6
    out = np.zeros(len(c), bool)
    if place in ("flange_left", "flange_both"):
        out |= hat & (z < fl) & (y < -yt)
    if place in ("flange_right", "flange_both"):
        out |= hat & (z < fl) & (y > yt)
    if place in ("rim_left", "rim_both"):            # flange and base plate under it
        out |= (z < fl) & (y < -yt)
    if place in ("rim_right", "rim_both"):
        out |= (z < fl) & (y > yt)
    if place == "foot_both":                         # flange and the lower third of the webs
        out |= hat & (z < GAP + H / 3) & (abs(y) > yt - 1e-6)
    if place == "top":                               # middle half of the hat top
        out |= hat & (z > top) & (abs(y) < yt / 2)
    if place == "top_full":
        out |= hat & (z > top)
    if place in ("edge_left", "edge_both"):          # upper edge: outer quarter of the top + upper sixth of the web
        out |= hat & (((z > top) & (y < -yt / 2)) | ((z > GAP + H * 5 / 6) & (y < -yt + 1e-6)))
    if place in ("edge_right", "edge_both"):
        out |= hat & (((z > top) & (y > yt / 2)) | ((z > GAP + H * 5 / 6) & (y > yt - 1e-6)))
    if place in ("web_left", "web_both"):            # middle half of the web
        out |= hat & (z > GAP + H / 4) & (z < GAP + 3 * H / 4) & (y < -yt + 1e-6)
    if place in ("web_right", "web_both"):
        out |= hat & (z > GAP + H / 4) & (z < GAP + 3 * H / 4) & (y > yt - 1e-6)
    if place == "base":                              # middle half of the base plate
        out |= ~hat & (abs(y) < yt / 2)
    if place == "base_full":                         # base plate between the flanges
        out |= ~hat & (abs(y) < yt)
    if place == "ring":                              # corners of the whole section
        out |= place_mask("edge_both", c, hat) | place_mask("flange_both", c, hat)
    return out


def parse_notches(text):
    """'place@x1-x2;place@x1-x2' -> list of (place, x1, x2)."""
    out = []
    for item in filter(None, (s.strip() for s in text.split(";"))):
        place, rng = item.split("@")
        a, b = rng.split("-")
        out.append((place, float(a), float(b)))
    return out


def write_deck(path, kind, run, thickness, notches, speed, crush, n_states, mass=5000.0, dt2ms=0.0):
    nid, xyz, eid, con, idx, hat = build_mesh(kind)
    c = xyz[idx].mean(1)
    notch = np.zeros(len(eid), bool)
    for place, x1, x2 in notches:
        m = place_mask(place, c, hat)
        if place not in PLACES:
            raise SystemExit(f"unknown place {place}")
        notch |= m & (c[:, 0] > x1) & (c[:, 0] < x2)
    part = np.where(hat, 1, 2) + 2 * notch
    parts = [p for p in (1, 2, 3, 4) if (part == p).any()]
    tend = crush / speed

    o = []
    w = o.append
    w("*KEYWORD")
    w("*TITLE")
    w(f"hat section beam, run {run:03d}, {kind} mesh, t={thickness:g} mm")
    w("*CONTROL_TERMINATION")
    w(f"{tend:10.4f}")
    w("*CONTROL_TIMESTEP")
    w(f"{0.0:10.3f}{0.8:10.3f}{0:10d}{0.0:10.3f}{dt2ms:10.2e}")
    w("*DATABASE_BINARY_D3PLOT")
    w(f"{tend / (n_states - 1):10.5f}")
    for mid, rho, etan in ((1, RHO, ETAN), (2, RHO * NOTCH_RHO_FACTOR, NOTCH_ETAN)):
        w("*MAT_PIECEWISE_LINEAR_PLASTICITY")
        w(f"{mid:10d}{rho:10.3e}{E:10.3f}{NU:10.3f}{SIGY:10.4f}{etan:10.4f}")
        w(f"{0.0:10.3f}{0.0:10.3f}{0:10d}{0:10d}")
        w("".join(f"{0.0:10.3f}" for _ in range(8)))
        w("".join(f"{0.0:10.3f}" for _ in range(8)))
    for sid, t in ((1, thickness), (2, T_NOTCH)):
        w("*SECTION_SHELL")
        w(f"{sid:10d}{2:10d}{0.8333:10.4f}{3:10d}")
        w("".join(f"{t:10.5g}" for _ in range(4)))
    for p in parts:
        w("*PART")
        w(PART_TITLE[p])
        w(f"{p:10d}{1 if p < 3 else 2:10d}{1 if p < 3 else 2:10d}")
    w("*NODE")
    for n, (x, y, z) in zip(nid, xyz):
        w(f"{n:8d}{x:16.6f}{y:16.6f}{z:16.6f}")
    w("*ELEMENT_SHELL")
    for e, p, q in zip(eid, part, con):
        w(f"{e:8d}{p:8d}" + "".join(f"{n:8d}" for n in q))
    # clamp at x=0
    w("*SET_NODE_LIST")
    w(f"{1:10d}")
    fix = nid[xyz[:, 0] < 1e-6]
    for k in range(0, len(fix), 8):
        w("".join(f"{n:10d}" for n in fix[k:k + 8]))
    w("*BOUNDARY_SPC_SET")
    w(f"{1:10d}{0:10d}" + "".join(f"{1:10d}" for _ in range(6)))
    # impactor at x=L
    w("*RIGIDWALL_PLANAR_MOVING")
    w(f"{0:10d}{0:10d}{0:10d}")
    w(f"{L:10.3f}{0.0:10.3f}{20.0:10.3f}{L - 1:10.3f}{0.0:10.3f}{20.0:10.3f}{1.0:10.3f}")
    w(f"{mass:10.3f}{speed:10.3f}")
    # self contact
    w("*SET_PART_LIST")
    w(f"{900:10d}")
    w(f"{1:10d}{2:10d}")
    w("*CONTACT_AUTOMATIC_SINGLE_SURFACE")
    w(f"{900:10d}{0:10d}{2:10d}{0:10d}{0:10d}{0:10d}{0:10d}{0:10d}")
    w(f"{FRICTION:10.3f}{FRICTION:10.3f}{0.0:10.3f}{0.0:10.3f}{20.0:10.3f}{0:10d}{0.0:10.3f}{1e20:10.3e}")
    w(f"{1.0:10.3f}{1.0:10.3f}{CONTACT_T:10.3f}{CONTACT_T:10.3f}{1.0:10.3f}{1.0:10.3f}{1.0:10.3f}{1.0:10.3f}")
    # spot welds in the middle of the flanges
    yw = TOP / 2 + FLANGE / 2
    sid = 100
    bad = set(nid[idx[notch].ravel()].tolist())
    for side in (-1, 1):
        x = WELD_PITCH
        while x < L - 1e-6:
            d = abs(xyz[:, 0] - x) + abs(xyz[:, 1] - side * yw)
            pair = nid[(d < 1e-3) & (xyz[:, 2] < GAP + 1e-6)]
            assert len(pair) == 2
            inner = [n for n in pair if n in bad and part[(con == n).any(1)].min() > 2]
            if not inner:              # a node inside a notch carries no weld
                w("*CONSTRAINED_NODAL_RIGID_BODY")
                w(f"{sid:10d}{0:10d}{sid:10d}")
                w("*SET_NODE_LIST")
                w(f"{sid:10d}")
                w("".join(f"{n:10d}" for n in pair))
                sid += 1
            x += WELD_PITCH
    w("*END")
    with open(path, "w") as f:
        f.write("\n".join(o) + "\n")


PLACES = ("flange_left", "flange_right", "flange_both", "rim_left", "rim_right", "rim_both",
          "foot_both", "top", "top_full", "edge_left", "edge_right", "edge_both", "web_left",
          "web_right", "web_both", "base", "base_full", "ring")


def main():
    table, run, kind, out = sys.argv[1:]
    with open(table, newline="") as f:
        rows = {row["run"]: row for row in csv.DictReader(f)}
    if run not in rows:
        raise SystemExit(f"no run {run} in {table}; the first is {next(iter(rows))}")
    row = rows[run]
    write_deck(out, kind, int(run.removeprefix("run_")), float(row["thickness_mm"]), parse_notches(row["notches"]),
               float(row["speed_mm_per_ms"]), float(row["crush_mm"]), STATES[kind], dt2ms=DT2MS[kind])


if __name__ == "__main__":
    main()
