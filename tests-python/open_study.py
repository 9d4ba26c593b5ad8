#!/usr/bin/env python3
"""Open a study with the programs that its users have, and check what it says.

    python open_study.py STUDY

`study.toml` and `manifest.json` with the standard library, `mesh.vtu` with VTK (what ParaView reads
with), `basis.safetensors` with safetensors and NumPy, the tables with pandas, polars and DuckDB. Prints
one line of JSON with counts; exits 1 with a sentence when something is wrong.
"""
from __future__ import annotations

import argparse
import json
import sys
import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
from safetensors.numpy import load_file
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

from tables import Disagreement, expect, finite, read_table

VTK_TRIANGLE = 5
ORTHONORMALITY = 1e-5  # eigenvectors are stored in f32: 6e-8 relative an entry, sums over thousands of vertices
LAYOUT = {"eigenvalues": ("float64", 1), "eigenvectors": ("float32", 2), "mass": ("float64", 1), "baseline": ("float64", 2)}


def open_mesh(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Points (N x 3) and triangles (T x 3) of the reference mesh, as VTK reads them."""
    complaints: list[str] = []
    reader = vtkXMLUnstructuredGridReader()
    for event in ("ErrorEvent", "WarningEvent"):
        reader.AddObserver(getattr(vtkCommand, event), lambda *_, event=event: complaints.append(event))
    reader.SetFileName(str(path))
    reader.Update()
    expect(not complaints, f"{path}: VTK reports {complaints}")
    grid = reader.GetOutput()
    n, t = grid.GetNumberOfPoints(), grid.GetNumberOfCells()
    expect(n > 0 and t > 0, f"{path}: VTK sees {n} points and {t} cells")
    types = {grid.GetCellType(cell) for cell in range(t)}
    expect(types == {VTK_TRIANGLE}, f"{path}: cell types {types}, expected triangles only")
    triangles = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(t, 3)
    expect(bool((np.sort(np.unique(triangles)) == np.arange(n)).all()), f"{path}: vertices without a triangle, or indices outside of 0..{n}")

    node_id = grid.GetPointData().GetArray("node_id")
    face = grid.GetCellData().GetArray("face")
    expect(node_id is not None, f"{path}: no point array 'node_id'")
    expect(face is not None, f"{path}: no cell array 'face'")
    ids = vtk_to_numpy(node_id)
    expect(len(ids) == n and len(np.unique(ids)) == n, f"{path}: 'node_id' does not number the {n} points")
    expect(len(vtk_to_numpy(face)) == t, f"{path}: 'face' has {face.GetNumberOfTuples()} entries for {t} triangles")
    return vtk_to_numpy(grid.GetPoints().GetData()).astype(float), triangles


def open_basis(path: Path, points: np.ndarray, triangles: np.ndarray) -> int:
    """Checks the basis against the mesh and itself; returns the number of eigenpairs K."""
    tensors = load_file(path)
    for name, (dtype, dimensions) in LAYOUT.items():
        expect(name in tensors, f"{path}: no tensor '{name}', only {sorted(tensors)}")
        tensor = tensors[name]
        expect(str(tensor.dtype) == dtype and tensor.ndim == dimensions, f"{path}: '{name}' is {tensor.dtype} {tensor.shape}, expected {dtype} of {dimensions} dimensions")
        expect(bool(np.isfinite(tensor).all()), f"{path}: '{name}' holds values that are not finite")
    eigenvalues, mass, baseline = tensors["eigenvalues"], tensors["mass"], tensors["baseline"]
    eigenvectors = tensors["eigenvectors"].astype(float)
    k, n = eigenvectors.shape
    expect(n == len(points), f"{path}: eigenvectors have {n} entries, the mesh has {len(points)} points")
    expect(eigenvalues.shape == (k,) and mass.shape == (n,) and baseline.shape == (k, 3), f"{path}: shapes {[t.shape for t in tensors.values()]} do not belong together")

    expect(bool((np.diff(eigenvalues) >= 0).all()), f"{path}: eigenvalues are not ascending")
    expect(eigenvalues[0] >= -1e-9 * eigenvalues[-1], f"{path}: the first eigenvalue is {eigenvalues[0]}, below zero")
    expect(bool((mass > 0).all()), f"{path}: {np.count_nonzero(mass <= 0)} masses are not positive")
    p, q, r = (points[triangles[:, corner]] for corner in range(3))
    area = 0.5 * np.linalg.norm(np.cross(q - p, r - p), axis=1).sum()
    expect(abs(mass.sum() - area) <= 1e-6 * area, f"{path}: the masses sum to {mass.sum()}, the area of the mesh is {area}")

    weighted = eigenvectors * mass
    defect = np.abs(weighted @ eigenvectors.T - np.eye(k)).max()
    expect(defect <= ORTHONORMALITY, f"{path}: eigenvectors are orthonormal to {defect:.1e}, expected {ORTHONORMALITY}")
    projected = weighted @ points
    error = np.abs(projected - baseline).max() / np.abs(baseline).max()
    expect(error <= ORTHONORMALITY, f"{path}: 'baseline' differs from the projected mesh by {error:.1e} of its largest value")
    return k


def open_runs(path: Path) -> set[str]:
    """Ids of the runs of the study."""
    frame = read_table(path)
    expect("run" in frame.columns, f"{path}: no column 'run', only {list(frame.columns)}")
    expect(frame["run"].is_unique, f"{path}: a run stands in it twice")
    return set(frame["run"])


def open_coefficients(folder: Path, named: set[str], k: int) -> pd.DataFrame:
    """`run`, `state` and `time` of every state of the parts that the manifest names."""
    parts = [path for path in sorted(folder.glob("*.parquet")) if f"{folder.name}/{path.name}" in named]
    expect(bool(parts), f"{folder}: no part that the manifest names")
    values = [f"d{number}_{axis}" for number in range(1, k + 1) for axis in "xyz"]
    keys = []
    for path in parts:
        frame = read_table(path)
        missing = [name for name in ("run", "state", "time", *values) if name not in frame.columns]
        expect(not missing, f"{path}: {len(missing)} columns are missing, among them {missing[:3]}")
        expect(f"d{k + 1}_x" not in frame.columns, f"{path}: more coefficients than the basis has eigenvectors ({k})")
        expect(pd.api.types.is_integer_dtype(frame["state"]), f"{path}: 'state' is {frame['state'].dtype}")
        expect(frame["time"].dtype == np.float64, f"{path}: 'time' is {frame['time'].dtype}, expected f64")
        expect(bool((frame[values].dtypes == np.float32).all()), f"{path}: coefficients are not f32 throughout")
        finite(frame, ["time", *values], path)
        keys.append(frame[["run", "state", "time"]])
    return pd.concat(keys, ignore_index=True)


def open_modes(path: Path, runs: set[str]) -> int | None:
    """Number of modes, or None in a study that has not been clustered."""
    if not path.exists():
        return None
    frame = read_table(path)
    expect({"run", "mode"} <= set(frame.columns), f"{path}: columns {list(frame.columns)}, expected 'run' and 'mode' among them")
    strangers = set(frame["run"].dropna()) - runs
    expect(not strangers, f"{path}: runs that the study does not have: {sorted(strangers)[:3]}")
    return int(frame["mode"].nunique())


def open_study(study: Path) -> dict[str, int | None]:
    """Opens everything in a study's folder; counts of what is there."""
    for name in ("study.toml", "manifest.json", "mesh.vtu", "basis.safetensors", "runs.parquet", "coefficients"):
        expect((study / name).exists(), f"{study}: no {name}")
    tomllib.loads((study / "study.toml").read_text(encoding="utf-8"))
    manifest = json.loads((study / "manifest.json").read_text(encoding="utf-8"))
    for name, record in manifest["files"].items():
        size = (study / name).stat().st_size
        expect(size == record["bytes"], f"{study / name}: {size} bytes, the manifest says {record['bytes']}")

    points, triangles = open_mesh(study / "mesh.vtu")
    k = open_basis(study / "basis.safetensors", points, triangles)
    runs = open_runs(study / "runs.parquet")
    expect(runs == set(manifest["runs"]), f"{study}: runs.parquet and the manifest name different runs")
    states = open_coefficients(study / "coefficients", set(manifest["files"]), k)
    expect(set(states["run"]) == runs, f"{study}: coefficients and runs.parquet name different runs")
    expect(not states.duplicated(["run", "state"]).any(), f"{study}: a state stands in the coefficients twice")
    return {
        "points": len(points),
        "triangles": len(triangles),
        "eigenpairs": k,
        "runs": len(runs),
        "states": len(states),
        "modes": open_modes(study / "modes.parquet", runs),
    }


def main() -> int:
    parser = argparse.ArgumentParser(description="open a study with VTK, safetensors, pandas, polars and DuckDB")
    parser.add_argument("study", type=Path)
    args = parser.parse_args()
    try:
        print(json.dumps(open_study(args.study)))
    except Disagreement as problem:
        print(problem, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
