"""What the descriptor is compared with: ways to turn runs into a few numbers, and back where there is a way back.

A rival is made for a case and a query and gives R x F numbers; their cosine ranks the runs.
"""

import numpy as np
import spectra
from analyze_peer import select
from quality import cosine


class Pca:
    """Principal components of last displacements, in the inner product weighted by the area, centred by their mean."""

    def __init__(self, case, train):
        self.case, self.root = case, np.sqrt(case.mass)[:, None]
        rows = (case.displacements[train] * self.root).reshape(len(train), -1)
        self.mean = rows.mean(0)
        _, size, directions = np.linalg.svd(rows - self.mean, full_matrices=False)
        self.directions = directions[size > 1e-9 * size[0]]  # C x 3N

    def scores(self, runs=slice(None)):
        """R x C."""
        rows = (self.case.displacements[runs] * self.root).reshape(len(self.case.displacements[runs]), -1)
        return (rows - self.mean) @ self.directions.T

    def errors(self, runs):
        """RMS error of the nearest displacement that mean and the first 0, 1, ..., C components make, R x (C + 1)."""
        rows = (self.case.displacements[runs] * self.root).reshape(len(runs), -1) - self.mean
        caught = np.cumsum((rows @ self.directions.T) ** 2, axis=1)
        left = (rows**2).sum(1)[:, None] - np.column_stack([np.zeros(len(rows)), caught])
        return np.sqrt(np.maximum(left, 0) / self.case.mass.sum())

    def nodes(self, run, count):
        """The displacement from the first `count` components, N x 3."""
        row = (self.case.displacements[run] * self.root).ravel() - self.mean
        near = self.mean + (row @ self.directions[:count].T) @ self.directions[:count]
        return near.reshape(-1, 3) / self.root


def chosen(case, select_by, query):
    """Eigenvectors of the paper's descriptor of a run, counted from 0."""
    return select(case.values[select_by][query])


def descriptor(case, select_by):
    """query -> similarities by the query's own descriptor."""

    def similarity(query):
        kept = chosen(case, select_by, query)
        return cosine(case.values[select_by][:, kept], case.values[select_by][query, kept])

    return similarity


def first(case, select_by, count=None):
    """query -> similarities by as many eigenvectors of lowest frequency as its descriptor has, or by `count`."""

    def similarity(query):
        size = count or len(chosen(case, select_by, query))
        return cosine(case.values[select_by][:, :size], case.values[select_by][query, :size])

    return similarity


def components(case, pca, share=1):
    """query -> similarities by M principal components, or `share` times as many, M that of its descriptor of differences."""
    scores = pca.scores()

    def similarity(query):
        size = share * len(chosen(case, "difference", query))
        return cosine(scores[:, :size], scores[query, :size])

    return similarity


def stations(case, count):
    """`count` nodes that somebody who knows the beam would watch: mid lines of the hat's top and of the base plate by
    turns, evenly along the length, the hit end among them. Bending shows in z there, crushing in x."""
    along, across, up = case.rest.T
    length, top = along.max(), up.max()
    places = length * (np.arange(count) + 1) / count
    wanted = [(place, 0.0, top if number % 2 == 0 else 0.0) for number, place in enumerate(places)]
    return np.array([np.argmin(((case.rest - place) ** 2).sum(1)) for place in wanted])


def hand_picked(case):
    """query -> similarities by the displacements of M hand-picked nodes, M that of its descriptor of differences."""

    def similarity(query):
        nodes = stations(case, len(chosen(case, "difference", query)))
        return cosine(case.displacements[:, nodes], case.displacements[query, nodes])

    return similarity


def of_rows(rows):
    """query -> cosines of rows of numbers that do not depend on the query."""
    return lambda query: cosine(rows, rows[query])


def rotation(case):
    return of_rows(spectra.spectrum(case.bundle))
