"""Bundles as arrays: made into studies by the built `crumple`, then read from what it stored."""

import glob
import os
import subprocess
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
import pyarrow.parquet as pq

MEASURES = ("rms", "max", "captured", "rigid_share", "strain_median", "strain_p95", "area_median", "area_p95", "turn")


@dataclass
class Bundle:
    """One study, and the labels of its runs; arrays over the last states unless said otherwise."""

    name: str
    study: str
    runs_folder: str
    fold: str  # the label that means folding
    runs: list = field(default_factory=list)
    label: np.ndarray = None
    clear: np.ndarray = None
    eigenvalues: np.ndarray = None  # K
    eigenvectors: np.ndarray = None  # K x N
    mass: np.ndarray = None  # N
    vertices: np.ndarray = None  # N x 3
    triangles: np.ndarray = None  # T x 3
    rho: np.ndarray = None  # runs x K x 3
    delta: np.ndarray = None  # runs x K x 3
    energy: np.ndarray = None  # runs: the squared norm of the whole rotation field
    states: pd.DataFrame = None  # run, state, time of every state
    rho_states: np.ndarray = None  # states x K x 3
    delta_states: np.ndarray = None  # states x K x 3
    measures: pd.DataFrame = None  # rms to turn of every state
    energy_states: np.ndarray = None
    baseline: np.ndarray = None  # K x 3: coefficients of the undeformed coordinates

    @property
    def area(self):
        return self.mass.sum()

    @property
    def modes(self):
        return [label for label in sorted(set(self.label)) if label != "mixed"]


def crumple(program, *arguments):
    subprocess.run([program, "--quiet", *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)


def make(program, name, runs_folder, labels, scratch, fold, join=None, eigenpairs=500, more=()):
    """The study of all runs of a folder, made anew, and read; `more`: further words for `init`."""
    study = os.path.join(scratch, name.replace(", ", "-").replace(" ", "-"))
    subprocess.run(["rm", "-rf", study, study + "-arrays"], check=True)
    reference = sorted(glob.glob(os.path.join(runs_folder, "run_*")))[0]
    options = ["-K", eigenpairs] + (["--join", join] if join else []) + list(more)
    crumple(program, "init", study, "--reference", reference, *options)
    crumple(program, "add", study, runs_folder)
    crumple(program, "export", study, "-o", study + "-arrays", "--format", "parquet", "--last")
    return read(Bundle(name, study, runs_folder, fold), labels)


def read(bundle, labels):
    """Everything that the study stores, in the order of the runs' ids."""
    arrays = {path.split("/")[-1][:-4]: np.load(path) for path in glob.glob(bundle.study + "-arrays/*.npy")}
    for name in ("eigenvalues", "eigenvectors", "mass", "vertices", "triangles", "baseline"):
        setattr(bundle, name, arrays[name])
    parts = [pq.read_table(path).to_pandas() for path in glob.glob(bundle.study + "/coefficients/*.parquet")]
    table = pd.concat(parts).sort_values(["run", "state"]).reset_index(drop=True)
    size = len(bundle.eigenvalues)
    columns = {letter: [f"{letter}{k}_{c}" for k in range(1, size + 1) for c in "xyz"] for letter in "dr"}
    triples = lambda rows, letter: rows[columns[letter]].to_numpy(float).reshape(len(rows), size, 3)
    bundle.states = table[["run", "state", "time"]]
    bundle.measures = table[[column for column in MEASURES if column in table]]
    bundle.rho_states, bundle.delta_states = triples(table, "r"), triples(table, "d")
    last = table.groupby("run").tail(1)
    bundle.runs = list(last.run)
    bundle.rho, bundle.delta = triples(last, "r"), triples(last, "d")
    if "turn" in table:
        # The program stores the root mean square of the field.
        bundle.energy_states = table.turn.to_numpy(float) ** 2 * bundle.area
        bundle.energy = last.turn.to_numpy(float) ** 2 * bundle.area
    known = pd.read_csv(labels, dtype=str).set_index("run")
    known.index = [run if run.startswith("run_") else f"run_{int(run):03d}" for run in known.index]
    bundle.label = known.label[bundle.runs].to_numpy(str)
    bundle.clear = known.clear[bundle.runs].isin(["true", "1"]).to_numpy()
    return bundle


def shapes(bundle, every_state=False):
    """Positions of the study's vertices, runs x N x 3 of the last states, or a list of states x N x 3 arrays."""
    from lasso.dyna import D3plot
    from scipy.spatial import cKDTree

    order, out = None, []
    for run in bundle.runs:
        arrays = D3plot(os.path.join(bundle.runs_folder, run, "d3plot"), state_array_filter=["node_displacement"]).arrays
        if order is None:
            distance, order = cKDTree(arrays["node_coordinates"]).query(bundle.vertices)
            assert distance.max() < 1e-5 * np.ptp(bundle.vertices), "the study's vertices are nodes of the file"
        positions = arrays["node_displacement"][:, order].astype(float)
        out.append(positions if every_state else positions[-1])
    return out if every_state else np.array(out)


def write_family(folder, undeformed, triangles, states):
    """The smallest d3plot family that a reader accepts; nodes and shells are numbered from 1."""
    os.makedirs(folder, exist_ok=True)
    nodes, shells = len(undeformed), len(triangles)
    end = np.float32(-999999.0).tobytes()
    word = {11: 1, 15: 4, 16: nodes, 17: 6, 20: 1, 31: shells, 32: 1, 36: 3, 39: 19 + nodes + shells, 43: 999, 44: 999, 45: 999, 46: 999, 51: 1}
    head = np.zeros(64, "<i4")
    for at, value in word.items():
        head[at] = value
    head = bytearray(head.tobytes())
    head[:40], head[52:56], head[56:60] = b"variant".ljust(40), b"R910", np.float32(960.0).tobytes()
    connectivity = np.column_stack([triangles + 1, triangles[:, 2] + 1, np.ones(shells)]).astype("<i4")
    numbering = np.r_[-1, 1, 1, 1, 1, nodes, 0, 0, shells, 0, 1, 1, 1, 1, 0, 1, 1 : nodes + 1, 1 : shells + 1, 1, 1, 1].astype("<i4")
    titles = np.array([90001, 1, 1], "<i4").tobytes() + b"PART".ljust(72) + np.int32(90000).tobytes() + b"variant".ljust(72)
    body = bytes(head) + undeformed.astype("<f4").tobytes() + connectivity.tobytes() + numbering.tobytes() + end + titles + end
    pad = lambda data: data + bytes(-len(data) % 2048)
    with open(os.path.join(folder, "d3plot"), "wb") as file:
        file.write(pad(body))
    with open(os.path.join(folder, "d3plot01"), "wb") as file:
        file.write(pad(b"".join(np.float32(time).tobytes() + p.astype("<f4").tobytes() for time, p in states) + end))
