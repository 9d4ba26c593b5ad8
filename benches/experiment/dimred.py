"""lasso-python's `dimred`, as far as it runs: what its functions give, and what stops the others.

Its command line samples 2000 nodes, reduces the displacements of each time step to at most ten numbers by a singular value
decomposition ("betas") and clusters them; `hashing` makes curves of a field along eigenvectors, `sphere` a field on a
sphere around the part.
"""

import os
import re
import shutil
import subprocess
import sys
import warnings
from importlib.metadata import version

import bundles
import h5py
import numpy as np
from lasso.dimred import graph_laplacian, hashing, hashing_sphere
from lasso.dimred.sphere import algorithms as sphere
from lasso.dimred.svd import clustering_betas, pod_functions, subsampling_methods
from lasso.dimred.svd.keyword_types import ClusterType
from quality import cosine

VERSION = version("lasso-python")
HASH_MODES, HASH_POINTS = 5, 100  # the defaults of run_graph_laplacian and compute_hashes


class Betas:
    """The decomposition of all runs' positions: R x 10 numbers of the last state, and the way back."""

    def __init__(self, case):
        states = bundles.shapes(case.bundle, every_state=True)
        positions = np.array([run[: min(map(len, states))] for run in states])
        basis, betas = pod_functions.calculate_v_and_betas(positions)
        self.basis, self.betas, self.rest = basis[:, -1], betas[:, -1], case.rest

    def shape(self, run):
        return self.rest + (self.betas[run] @ self.basis).reshape(-1, 3)

    def groups(self, count):
        """k-means of the last betas as the command line does it; a label for each run."""
        rows = np.arange(len(self.betas))
        _, members = clustering_betas.group_betas(rows, self.betas, cluster=ClusterType.KMeans, cluster_params={"n_clusters": count})
        found = np.zeros(len(rows), int)
        for group, ids in enumerate(members):
            found[np.asarray(ids, int)] = group
        return found


def command_line(case, scratch, end="REDUCTION"):
    """Runs the command `dimred` on a bundle up to a stage; runs and their betas of the last state, or the last line of what it
    said where it fails."""
    project = os.path.join(scratch, "dimred-" + end.lower())
    shutil.rmtree(project, ignore_errors=True)
    pattern = os.path.join(case.bundle.runs_folder, "run_*", "d3plot")
    call = [
        sys.executable,
        "-m",
        "lasso.dimred.run",
        pattern,
        "--project-dir",
        project,
        "--end-stage",
        end,
        "--cluster-args",
        "KMeans",
        "n_clusters",
        "int",
        "3",
        "--n-processes",
        "2",
    ]
    done = subprocess.run(call, capture_output=True, text=True)
    if done.returncode:
        return done.stderr.strip().splitlines()[-1]
    with h5py.File(os.path.join(project, "project_buffer.hdf5")) as file:
        return list(file["betas"]), np.array([betas[-1] for betas in file["betas"].values()])


def hash_similarities(case):
    """R x R: for each of x, y, z the field's curves along the first eigenvectors that are not constant; cosine of the curves
    by `curve_normalizer`'s integral, weighted by `get_mode_weights_inv`, mean of x, y, z.

    The graph Laplacian does not run, so eigenvectors are the study's; the mesh is the same for all runs, so none is matched
    or turned."""
    positive = np.flatnonzero(case.bundle.eigenvalues > 1e-9 * case.bundle.eigenvalues[-1])[:HASH_MODES]
    vectors, weights = case.bundle.eigenvectors[positive].T, hashing.get_mode_weights_inv(case.bundle.eigenvalues[positive])
    curves = np.array(
        [[[y for _, y in hashing.compute_hashes(vectors, run[:, axis], HASH_POINTS)] for axis in range(3)] for run in case.displacements]
    )
    curves = curves / np.maximum(np.linalg.norm(curves, axis=-1, keepdims=True), 1e-300)  # R x 3 x modes x points
    return np.einsum("racp,sacp,c->rs", curves, curves, weights) / 3


def sphere_similarities(case):
    """R x R, and how many numbers: x, y and z of the displacement on the sphere around the undeformed part, their hashes end to end."""
    histogram = sphere.create_histogram(case.rest)
    hashes = np.array([np.concatenate([sphere.sphere_hashing(histogram, run[:, axis]) for axis in range(3)]) for run in case.displacements])
    hashes = hashes[:, np.any(hashes != 0, axis=0)]
    return np.array([cosine(hashes, row) for row in hashes]), hashes.shape[1]


def hashes_of_files(case, scratch):
    """`hashing_sphere.compute_hashes` on a folder as it documents it: `xyz` and `fields` of each run."""
    folder = os.path.join(scratch, "sphere", "")
    os.makedirs(folder, exist_ok=True)
    with h5py.File(folder + "run_0.h5", "w") as file:
        file["xyz"], file["fields"] = case.shapes[0][:, None], case.displacements[0][:, None, 2]
    return hashing_sphere.compute_hashes(folder, n_files=1, ret_vals=True)


def what_stops(case, fine, scratch):
    """Function, what it said: those that do not run here. `fine`: a case with nodes enough for the command line, or None."""
    run_file = os.path.join(case.bundle.runs_folder, case.runs[0], "d3plot")
    x = np.linspace(0, 1, 5)
    tried = {
        "`dimred` (command line) on the coarse mesh, at `create_reference_subsample`": lambda: subsampling_methods.create_reference_subsample(
            run_file, []
        ),
        "`graph_laplacian.run_graph_laplacian`": lambda: graph_laplacian.run_graph_laplacian(case.rest),
        "the same, without its filter of warnings": lambda: graph_laplacian._laplacian(graph_laplacian._laplacian_gauss_idw(case.rest)),
        "`hashing.run_hash_comparison`, at `curve_normalizer`": lambda: hashing.curve_normalizer(x, x),
        "`hashing_sphere.compute_hashes`": lambda: hashes_of_files(case, scratch),
    }
    if fine is not None:
        tried["`dimred` on the fine mesh, last stage (the page)"] = lambda: command_line(fine, scratch, "EXPORT_PLOT")
    out = []
    for name, call in tried.items():
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                found = call()
            said = f'"{found}"' if isinstance(found, str) else "runs"
        except Exception as error:
            said = f"{type(error).__name__}: {error}"
        # Not where things are installed.
        said = re.sub(r"'/[^']*/(lasso/[^']*)'", r"'…/\1'", said)
        out.append([name, said])
    return out
