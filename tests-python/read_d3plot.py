#!/usr/bin/env python3
"""What lasso-python or VTK's reader finds in d3plot families, as a line of JSON for each.

    python read_d3plot.py lasso|vtk ROOT...

`times`; for the first and last state `coordinates` and `velocity` with `min`, `max` and `sum` over all nodes (lasso-python), and
`plastic_strain` of shells over all layers; the part titles. VTK shows the nodes of elements only, those of several parts once for each, and
numbers them anew: so `corners` are, of both, positions and velocities at the corners of all elements, one element after the other. Of both, too,
words of the first three layers of shells and of the first point of solids.
"""
from __future__ import annotations

import json
import os
import sys

import numpy as np


def stats(array) -> dict | None:
    if array is None or np.size(array) == 0:
        return None
    array = np.asarray(array, float).reshape(-1, np.shape(array)[-1])
    return {"min": array.min(0).tolist(), "max": array.max(0).tolist(), "sum": array.sum(0).tolist()}


def with_lasso(root: str) -> dict:
    from lasso.dyna import D3plot

    plot = D3plot(root)
    arrays = plot.arrays
    times = [float(time) for time in arrays.get("timesteps", [])]

    def state(k: int) -> dict:
        def of(name):
            return arrays[name][k] if name in arrays else None

        strain = of("element_shell_effective_plastic_strain")
        corners = []
        for kind in ("solid", "tshell", "shell", "beam"):
            if f"element_{kind}_node_indexes" not in arrays:
                continue
            nodes = np.sort(arrays[f"element_{kind}_node_indexes"][:, : 2 if kind == "beam" else None], axis=1).astype(int)
            # an element of fewer corners repeats nodes
            first = np.diff(nodes, axis=1, prepend=-1) != 0
            corners.append(nodes[first])
        corners = np.concatenate(corners) if corners else np.zeros(0, int)
        # a mesh that was misread may name nodes that are not there
        corners = corners[(corners >= 0) & (corners < len(arrays["node_coordinates"]))]
        nodal = {name: of(key) for name, key in (("coordinates", "node_displacement"), ("velocity", "node_velocity"))}
        solid = of("element_solid_effective_plastic_strain")
        return {
            "corners": {
                **{name: stats(array[corners]) for name, array in nodal.items() if array is not None},
                "shell_strain": stats(strain[:, :3].reshape(-1, 1)) if strain is not None and strain.shape[1] >= 3 else None,
                "shell_stress": stats(of("element_shell_stress")[:, :3].reshape(-1, 6)) if of("element_shell_stress") is not None and strain.shape[1] >= 3 else None,
                "solid_strain": stats(solid[:, :1].reshape(-1, 1)) if solid is not None else None,
            },
            "coordinates": stats(of("node_displacement")),
            "velocity": stats(of("node_velocity")),
            "plastic_strain": stats(strain.reshape(-1, 1)) if strain is not None else None,
        }

    titles = [bytes(title).decode("latin-1").strip(" \0") for title in arrays.get("part_titles", [])]
    return {"times": times, "titles": titles, "states": [state(0), state(len(times) - 1)] if times else []}


def with_vtk(root: str) -> dict:
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOLSDyna import vtkLSDynaReader

    reader = vtkLSDynaReader()
    reader.SetFileName(root)
    reader.SetDeformedMesh(1)
    reader.SetRemoveDeletedCells(0)
    reader.UpdateInformation()
    count = reader.GetNumberOfTimeSteps()
    times = [reader.GetTimeValue(k) for k in range(count)]
    titles: list[str] = []

    def leaves(block, into):
        for k in range(block.GetNumberOfBlocks()):
            child = block.GetBlock(k)
            if child is None:
                continue
            if child.IsA("vtkMultiBlockDataSet"):
                leaves(child, into)
            elif child.GetNumberOfPoints():
                into.append(child)

    def state(k: int) -> dict:
        reader.SetTimeStep(k)
        reader.UpdateTimeStep(times[k])
        grids: list = []
        leaves(reader.GetOutput(), grids)
        points = np.vstack([vtk_to_numpy(grid.GetPoints().GetData()) for grid in grids])
        velocity = [grid.GetPointData().GetArray("Velocity") for grid in grids]
        velocity = np.vstack([vtk_to_numpy(array) for array in velocity]) if all(velocity) else None

        def at_corners(array):
            """Rows of all points of all cells but particles, which are cells of one point."""
            rows, before = [], 0
            for grid in grids:
                for cell in range(grid.GetNumberOfCells()):
                    ids = grid.GetCell(cell).GetPointIds()
                    ids = {ids.GetId(corner) + before for corner in range(ids.GetNumberOfIds())}
                    rows.extend(sorted(ids) if len(ids) > 1 else [])
                before += grid.GetNumberOfPoints()
            return stats(array[rows])

        def cells(names: list, shape: tuple, kind: tuple) -> dict | None:
            of_kind = [grid for grid in grids if grid.GetCellType(0) in kind]
            found = [grid.GetCellData().GetArray(name) for grid in of_kind for name in names]
            return stats(np.concatenate([vtk_to_numpy(array).reshape(shape) for array in found])) if found and all(found) else None

        shells, solids, surfaces = (5, 9), (10, 12, 13, 14), ("", "InnerSurf", "OuterSurf")
        return {
            "corners": {
                "coordinates": at_corners(points),
                **({"velocity": at_corners(velocity)} if velocity is not None else {}),
                "shell_strain": cells([f"EffPlastStrn{surface}" for surface in surfaces], (-1, 1), shells),
                "shell_stress": cells([f"Stress{surface}" for surface in surfaces], (-1, 6), shells),
                "solid_strain": cells(["EffPlastStrn"], (-1, 1), solids),
            },
            # for `benches/read_table.py`
            "coordinates": {key: value for key, value in stats(points).items() if key != "sum"},
            "cells": sum(grid.GetNumberOfCells() for grid in grids),
        }

    return {"times": times, "titles": titles, "states": [state(0), state(count - 1)] if count else []}


def main() -> int:
    program, *roots = sys.argv[1:]
    # both print words of their own to standard output
    out = os.dup(1)
    os.dup2(2, 1)
    for root in roots:
        found = with_lasso(root) if program == "lasso" else with_vtk(root)
        os.write(out, (json.dumps(found) + "\n").encode())
    return 0


if __name__ == "__main__":
    sys.exit(main())
