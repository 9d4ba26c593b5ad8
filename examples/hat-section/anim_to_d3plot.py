#!/usr/bin/env python3
"""OpenRadioss animation files (A001, A002, ...) -> LS-DYNA d3plot family.

    python3 anim_to_d3plot.py ROOT_NAME OUT_DIR [--states 0,2,4]
                              [--states-per-file N] [--layers 1|3] [--title TEXT]

Reads ROOT_NAMEA001, ROOT_NAMEA002, ... and writes OUT_DIR/d3plot (geometry),
d3plot01, d3plot02, ...  Little-endian single precision.  Only four-node shells
are kept, and of their results the effective plastic strain.  Part ids and titles
come from the part texts of the animation file ("id : title").
Only NumPy is needed.
"""
import argparse
import glob
import os
import struct

import numpy as np


class Anim:
    """The 2D section of one animation file (big endian)."""

    def __init__(self, path):
        self.b = open(path, "rb").read()
        self.p = 0
        self.magic = self.i4()
        self.time = float(self.arr(1, ">f4")[0])
        self.texts = [self.text(81) for _ in range(3)]
        flags = [self.i4() for _ in range(10)]
        nn, nf, npart, nfunc, nefunc, nvect, ntens, nskew = [self.i4() for _ in range(8)]
        self.arr(nskew * 6, ">i2")
        self.xyz = self.arr(nn * 3, ">f4").reshape(nn, 3)
        self.con = self.arr(nf * 4, ">i4").reshape(nf, 4)
        self.deleted = self.arr(nf, "u1") == 0        # 1 = alive
        self.part_end = self.arr(npart, ">i4")
        self.part_text = [self.text(50) for _ in range(npart)]
        self.arr(nn * 3, ">i2")
        names = [self.text(81) for _ in range(nfunc + nefunc)]
        self.nodal = {}
        for name in names[:nfunc]:
            self.nodal[name] = self.arr(nn, ">f4")
        self.shell = {}
        for name in names[nfunc:]:
            self.shell[name] = self.arr(nf, ">f4")
        vnames = [self.text(81) for _ in range(nvect)]
        self.vect = {n: self.arr(nn * 3, ">f4").reshape(nn, 3) for n in vnames}
        for _ in [self.text(81) for _ in range(ntens)]:
            self.arr(nf * 3, ">f4")
        if flags[0] == 1:
            self.arr(nf, ">f4"), self.arr(nn, ">f4")
        self.node_id = np.arange(1, nn + 1)
        self.shell_id = np.arange(1, nf + 1)
        if flags[1]:
            self.node_id = self.arr(nn, ">i4")
            self.shell_id = self.arr(nf, ">i4")
        self.part = np.zeros(nf, int)
        a = 0
        for k, e in enumerate(self.part_end):
            self.part[a:e] = k
            a = e

    def arr(self, n, t):
        d = np.dtype(t)
        a = np.frombuffer(self.b, d, n, self.p)
        self.p += n * d.itemsize
        return a.astype(d.newbyteorder("="))

    def i4(self):
        return int(self.arr(1, ">i4")[0])

    def text(self, n):
        s = self.b[self.p:self.p + n]
        self.p += n
        return s.split(b"\0")[0].decode("latin-1").strip()


def words(fmt, *v):
    return struct.pack("<" + fmt, *v)


def write_family(out, title, node_id, xyz0, shell_id, con, part_index, part_id, part_title,
                 states, layers, per_file):
    """states: list of (time, xyz, [layer arrays])."""
    os.makedirs(out, exist_ok=True)
    nn, ns, npart = len(node_id), len(shell_id), len(part_id)
    nglb = 6 + 7 * npart
    h = bytearray(64 * 4)

    def put(k, v):
        h[4 * k:4 * k + 4] = words("i", v)
    h[0:40] = title.encode("ascii")[:40].ljust(40)
    put(11, 1)
    put(12, 0)
    h[52:56] = b"R712"
    h[56:60] = words("f", 971.0)
    put(15, 4)
    put(16, nn)
    put(17, 6)
    put(18, nglb)
    put(20, 1)                       # current coordinates
    put(31, ns)
    put(32, npart)
    put(33, layers)                  # NV2D
    put(36, layers)                  # MAXINT
    narbs = 16 + nn + ns + 3 * npart
    put(39, narbs)
    put(43, 999)                     # no stresses
    put(44, 1000)                    # effective plastic strain
    put(45, 999)
    put(46, 999)
    put(51, npart)                   # NMMAT
    geo = bytearray(h)
    geo += xyz0.astype("<f4").tobytes()
    geo += np.column_stack([con + 1, part_index + 1]).astype("<i4").tobytes()
    nsort = 1
    ptr = [-nsort, nsort + nn, nsort + nn, nsort + nn, nsort + nn + ns, nn, 0, 0, ns, 0,
           nsort + nn + ns, nsort + nn + ns + npart, nsort + nn + ns + 2 * npart, npart, 0, npart]
    geo += np.array(ptr, "<i4").tobytes()
    geo += np.asarray(node_id).astype("<i4").tobytes()
    geo += np.asarray(shell_id).astype("<i4").tobytes()
    order = np.argsort(part_id)
    geo += np.asarray(part_id)[order].astype("<i4").tobytes()
    geo += np.asarray(part_id).astype("<i4").tobytes()
    geo += (order + 1).astype("<i4").tobytes()
    geo += words("f", -999999.0)
    geo += words("i", 90000) + title.encode("ascii")[:72].ljust(72)
    geo += words("ii", 90001, npart)
    for i, t in zip(part_id, part_title):
        geo += words("i", int(i)) + t.encode("ascii")[:72].ljust(72)
    geo += words("f", -999999.0)

    def pad(b):
        return bytes(b) + b"\0" * (-len(b) % 2048)
    open(os.path.join(out, "d3plot"), "wb").write(pad(geo))
    for k in range(0, len(states), per_file):
        buf = bytearray()
        for time, xyz, lay in states[k:k + per_file]:
            buf += words("f", time)
            buf += np.zeros(nglb, "<f4").tobytes()
            buf += xyz.astype("<f4").tobytes()
            buf += np.column_stack(lay).astype("<f4").tobytes()
        buf += words("f", -999999.0)
        open(os.path.join(out, f"d3plot{k // per_file + 1:02d}"), "wb").write(pad(buf))


def foil_filler(con, foil, n):
    """Nodes that belong to notch foils only carry next to no mass and their
    computed motion means nothing: their displacement is replaced by the
    harmonic interpolation (graph Laplacian) of the surrounding nodes."""
    real = np.zeros(n, bool)
    real[con[~foil]] = True
    lone = np.nonzero(~real)[0]
    if len(lone) == 0:
        return lambda u: u
    nb = [set() for _ in range(n)]
    for q in con[foil]:
        for k in range(4):
            i, j = int(q[k]), int(q[(k + 1) % 4])
            if i != j:
                nb[i].add(j)
                nb[j].add(i)
    pos = {int(i): k for k, i in enumerate(lone)}
    a = np.zeros((len(lone), len(lone)))
    rhs = []
    for i in lone:
        k = pos[int(i)]
        a[k, k] = len(nb[i])
        outer = []
        for j in nb[i]:
            if j in pos:
                a[k, pos[j]] -= 1
            else:
                outer.append(j)
        rhs.append(outer)
    inv = np.linalg.inv(a)

    def fill(u):
        u = u.copy()
        b = np.array([u[o].sum(0) if o else np.zeros(3) for o in rhs])
        u[lone] = inv @ b
        return u
    return fill


def convert(root, out, title, layers=1, per_file=100, pick=None):
    files = sorted(glob.glob(root + "A[0-9][0-9][0-9]"))
    if pick is not None:
        files = [files[i] for i in pick]
    first = Anim(files[0])
    keep_part, ids, titles = [], [], []
    for k, t in enumerate(first.part_text):
        head, _, tail = t.partition(":")
        if head.strip().isdigit() and tail.strip() and not tail.strip().upper().startswith("RIGID"):
            n = first.part == k
            if n.any() and (first.shell_id[n] > 0).all():
                keep_part.append(k)
                ids.append(int(head))
                titles.append(tail.strip())
    shells = np.nonzero(np.isin(first.part, keep_part) & (first.shell_id > 0))[0]
    shells = shells[np.argsort(first.shell_id[shells], kind="stable")]
    nodes = np.unique(first.con[shells])
    nodes = nodes[np.argsort(first.node_id[nodes], kind="stable")]
    back = np.full(len(first.node_id), -1)
    back[nodes] = np.arange(len(nodes))
    con = back[first.con[shells]]
    pmap = {k: i for i, k in enumerate(keep_part)}
    pidx = np.array([pmap[k] for k in first.part[shells]])
    foil = np.array(["NOTCH" in t for t in titles])[pidx]
    fill = foil_filler(con, foil, len(nodes))
    x0 = first.xyz[nodes].astype(float)
    states = []
    for f in files:
        a = Anim(f)
        assert (a.node_id == first.node_id).all() and (a.shell_id == first.shell_id).all()
        mid = [v for n, v in a.shell.items() if "plastic" in n.lower()]
        lay = [np.where(foil, 0.0, v[shells]) for v in mid] or [np.zeros(len(shells))]
        lay = (lay * layers)[:layers] if len(lay) < layers else lay[:layers]
        states.append((a.time, x0 + fill(a.xyz[nodes] - x0), lay))
    write_family(out, title, first.node_id[nodes], first.xyz[nodes], first.shell_id[shells], con, pidx,
                 ids, titles, states, layers, per_file)
    return states


def main():
    p = argparse.ArgumentParser()
    p.add_argument("root")
    p.add_argument("out")
    p.add_argument("--title", default="")
    p.add_argument("--layers", type=int, default=1)
    p.add_argument("--states-per-file", type=int, default=100)
    p.add_argument("--states", default="")
    a = p.parse_args()
    pick = [int(x) for x in a.states.split(",")] if a.states else None
    convert(a.root, a.out, a.title or os.path.basename(a.root), a.layers, a.states_per_file, pick)


if __name__ == "__main__":
    main()
