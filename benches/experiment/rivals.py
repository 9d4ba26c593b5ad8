"""What the descriptor is compared with: ways to turn runs into a few numbers, and back where there is a way back.

A rival is made for a case and a query and gives R x F numbers; their cosine ranks the runs.
"""

import numpy as np
import spectra
from analyze_peer import select
from quality import cosine


class Pca:
    """Principal components of last displacements, in the inner product weighted by the area, centred by their mean.

    Everything follows from the runs' products with each other, so that a thousand of these cost nothing."""

    def __init__(self, case, train):
        products, train = case.products, np.asarray(train)
        to_mean = products[:, train].mean(1)
        self.centred = products - to_mean[:, None] - to_mean[None] + to_mean[train].mean()  # R x R
        squares, vectors = np.linalg.eigh(self.centred[np.ix_(train, train)])
        squares, vectors = squares[::-1], vectors[:, ::-1]
        kept = squares > 1e-10 * squares[0]
        self.scores = self.centred[:, train] @ vectors[:, kept] / np.sqrt(squares[kept])  # R x C
        self.area = case.mass.sum()

    def errors(self, runs):
        """RMS error of the nearest displacement that mean and the first 0, 1, ..., C components make, R x (C + 1)."""
        caught = np.cumsum(self.scores[runs] ** 2, axis=1)
        left = np.diag(self.centred)[runs][:, None] - np.column_stack([np.zeros(len(runs)), caught])
        return np.sqrt(np.maximum(left, 0) / self.area)


def descriptor(values):
    """query -> similarities by the query's own descriptor (the paper's rule); `values` are R x K x 3."""

    def similarity(query):
        kept = select(values[query])
        return cosine(values[:, kept], values[query, kept])

    return similarity


def first(values, count=None):
    """query -> similarities by as many eigenvectors of lowest frequency as its descriptor has, or by `count`."""

    def similarity(query):
        size = count or len(select(values[query]))
        return cosine(values[:, :size], values[query, :size])

    return similarity


def size_of(case, query):
    """M of a run's descriptor of differences, which components and nodes are as many as."""
    return len(select(case.values["difference"][query]))


def components(case, pca, share=1):
    """query -> similarities by M principal components, or `share` times as many, M that of its descriptor of differences."""
    scores = pca.scores

    def similarity(query):
        size = share * size_of(case, query)
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
        nodes = stations(case, size_of(case, query))
        return cosine(case.displacements[:, nodes], case.displacements[query, nodes])

    return similarity


def of_rows(rows):
    """query -> cosines of rows of numbers that do not depend on the query."""
    return lambda query: cosine(rows, rows[query])


def rotation(case):
    return of_rows(spectra.spectrum(case.bundle))
