#!/usr/bin/env python3
"""What lasso-python or VTK's reader finds in a d3plot family, as one line of JSON.

    python read_d3plot.py lasso|vtk ROOT

`times`; for the first and last state `coordinates` with `min`, `max` and `sum` over all nodes (lasso-python) or `min` and
`max` over all blocks (VTK, whose blocks repeat nodes that parts share), the same of `velocity`, and `plastic_strain` of
shells over all layers; the part titles.
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
        return {
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

        def least_and_most(array):
            found = stats(array)
            return {key: found[key] for key in ("min", "max")} if found else None

        return {
            "coordinates": least_and_most(points),
            "velocity": least_and_most(velocity),
            "cells": sum(grid.GetNumberOfCells() for grid in grids),
        }

    return {"times": times, "titles": titles, "states": [state(0), state(count - 1)] if count else []}


def main() -> int:
    program, root = sys.argv[1:]
    # both print words of their own to standard output
    out = os.dup(1)
    os.dup2(2, 1)
    found = with_lasso(root) if program == "lasso" else with_vtk(root)
    os.write(out, (json.dumps(found) + "\n").encode())
    return 0


if __name__ == "__main__":
    sys.exit(main())
