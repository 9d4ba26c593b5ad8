"""What a ranking is worth: every other run is ranked, a run of another label counts as wrong, mixed ones too."""

import numpy as np
from judge import average_precision
from sklearn.metrics import roc_auc_score

NEAREST = 9


def ranked(similarity, query):
    """All other runs, most similar first; ties by run id."""
    order = np.argsort(-similarity, kind="stable")
    return order[order != query]


def judged(similarity, query, label):
    """Precision at nine, average precision and ROC area of one query."""
    order = ranked(similarity, query)
    right = label[order] == label[query]
    return right[:NEAREST].mean(), average_precision(right), roc_auc_score(right, similarity[order])


def mean_average_precision(similarity_of, label, queries):
    """Mean over queries; `similarity_of(query)` is a row over all runs."""
    return float(np.mean([average_precision(label[ranked(similarity_of(query), query)] == label[query]) for query in queries]))


def cosine(values, target):
    """Cosine of each row of `values` (R x ...) with `target`; 0 to a zero vector."""
    flat, target = values.reshape(len(values), -1), np.ravel(target)
    length = np.linalg.norm(flat, axis=1) * np.linalg.norm(target)
    return flat @ target / np.where(length > 0, length, np.inf)


def by_mode(similarity_of, case, queries=None):
    """Mean average precision over all runs of each label, or over `queries`."""
    chosen = lambda mode: [run for run in case.members(mode) if queries is None or run in queries]
    return {mode: mean_average_precision(similarity_of, case.label, chosen(mode)) for mode in case.modes}
