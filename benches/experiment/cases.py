"""A bundle with its study, its labels and what the program says of it."""

import csv
import json
import os
import subprocess
from functools import cached_property

import bundles
import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy

MODES = ("crush", "down", "up")  # labels of the beam, in the order of every table
SELECTS = ("coordinates", "difference")


class Case:
    """Arrays over the last states of R runs; shapes are R x N x 3, coefficients R x K x 3."""

    def __init__(self, options, name, runs, labels, join=None, *more):
        self.program, self.labels, self.scratch = options.program, labels, options.scratch
        self.bundle = bundles.make(options.program, name, runs, labels, options.scratch, None, join, more=more)
        self.name, self.runs, self.label = name, self.bundle.runs, self.bundle.label
        self.mass, self.rest, self.triangles = self.bundle.mass, self.bundle.vertices, self.bundle.triangles.astype(int)
        self.values = {"coordinates": self.bundle.delta + self.bundle.baseline, "difference": self.bundle.delta}
        self.modes = self.bundle.modes

    def ask(self, command, *words):
        """The JSON that `crumple COMMAND STUDY WORDS…` prints."""
        call = [self.program, "--quiet", "--json", command, self.bundle.study, *map(str, words)]
        return json.loads(subprocess.run(call, check=True, capture_output=True, text=True).stdout)

    @cached_property
    def shapes(self):
        return bundles.shapes(self.bundle)

    @cached_property
    def displacements(self):
        return self.shapes - self.rest

    @cached_property
    def products(self):
        """Products of the runs' displacements over the surface, R x R."""
        rows = (self.displacements * np.sqrt(self.mass)[:, None]).reshape(len(self.runs), -1)
        return rows @ rows.T

    @cached_property
    def compared(self):
        return self.ask("compare", "--labels", self.labels)

    @cached_property
    def queries(self):
        """Row of the representative of each label: the medoid of its clear runs, as the program finds it."""
        return {row["label"]: self.runs.index(row["query"]) for row in self.compared["rotation"]}

    def row(self, mode, select, method):
        """One row of `compare`."""
        rows = self.compared["rows"] + self.compared["rotation"]
        (found,) = [row for row in rows if (row["label"], row["select"], row["method"]) == (mode, select, method)]
        return found

    @cached_property
    def fold_positions(self):
        """Where each run folds, mm from the clamped end, by its labels."""
        with open(self.labels, newline="") as file:
            rows = {row["run"].removeprefix("run_").lstrip("0"): row for row in csv.DictReader(file)}
        return np.array([float(rows[run.removeprefix("run_").lstrip("0")]["fold_position_mm"]) for run in self.runs])

    def members(self, mode):
        return np.flatnonzero(self.label == mode)

    def describe(self, run, name, *words):
        return self.ask("describe", run, "--name", name, *words)

    def similarities(self, descriptor, *words):
        """Similarity of every run to a descriptor, in the order of the runs."""
        found = self.ask("search", descriptor, "--top", len(self.runs), *words)["results"]
        by_run = {result["run"]: result["similarity"] for result in found}
        return np.array([by_run[run] for run in self.runs])

    def rebuilt(self, run, *words):
        """The shape that `crumple reconstruct` writes for a run, N x 3."""
        path = os.path.join(self.scratch, "rebuilt.vtu")
        self.ask("reconstruct", run, "-o", path, *words)
        reader = vtk.vtkXMLUnstructuredGridReader()
        reader.SetFileName(path)
        reader.Update()
        return vtk_to_numpy(reader.GetOutput().GetPoints().GetData()).astype(float)

    def rms(self, function):
        """Root mean square over the surface of functions, ... x N x 3."""
        return np.sqrt(((function**2).sum(-1) @ self.mass) / self.mass.sum())
