"""What a ranking and a grouping are worth, given labels, and how certain that is."""

import numpy as np
from sklearn.cluster import HDBSCAN, AgglomerativeClustering, KMeans
from sklearn.metrics import adjusted_rand_score, silhouette_score


def average_precision(relevant):
    return (np.cumsum(relevant) / np.arange(1, len(relevant) + 1))[relevant].mean() if relevant.any() else np.nan


def queries(similarity, bundle, clear=False, targets=None, query_is=None, target_is=None):
    """Average precision of every query, by mode. Mixed runs are left out of queries and ranking; with `clear` so are all
    whose label is not. `targets`: the bundle that the columns are, where it is another one."""
    other = targets or bundle
    in_queries = (bundle.label != "mixed") & (bundle.clear | (not clear))
    in_ranking = (other.label != "mixed") & (other.clear | (not clear))
    out = {}
    for mode in [query_is] if query_is else bundle.modes:
        wanted = target_is or mode
        found = []
        for query in np.flatnonzero(in_queries & (bundle.label == mode)):
            rows = np.flatnonzero(in_ranking)
            rows = rows[rows != query] if targets is None else rows
            # Ties by run id: a stable sort of runs in the order of their ids.
            order = rows[np.argsort(-similarity[query, rows], kind="stable")]
            found.append(average_precision(other.label[order] == wanted))
        out[mode] = np.array(found)
    return out


def interval(values, seed=1, draws=2000):
    """95 % bootstrap interval of a mean over queries."""
    random = np.random.default_rng(seed)
    means = values[random.integers(0, len(values), (draws, len(values)))].mean(1)
    return np.quantile(means, [0.025, 0.975])


def precision_at_9(similarity, bundle):
    """By mode: of the medoid of its clear runs, and the mean over all queries; mixed runs left out."""
    rows = np.flatnonzero(bundle.label != "mixed")
    def of(query, mode):
        others = rows[rows != query]
        nearest = others[np.argsort(-similarity[query, others], kind="stable")][:9]
        return (bundle.label[nearest] == mode).mean()

    out = {}
    for mode in bundle.modes:
        members = np.flatnonzero(bundle.clear & (bundle.label == mode))
        medoid = members[np.argmax(similarity[np.ix_(members, members)].mean(1))]
        out[mode] = of(medoid, mode), np.mean([of(query, mode) for query in np.flatnonzero(bundle.label == mode)])
    return out


def groups(points, bundle, most=8):
    """By method: number of modes chosen by the mean silhouette, adjusted Rand index, runs left out (labelled, mixed)."""
    labelled = bundle.label != "mixed"
    makers = {
        "k-means": lambda count: KMeans(count, n_init=20, random_state=1),
        "Ward": lambda count: AgglomerativeClustering(count),
    }
    out = {}
    for name, maker in makers.items():
        tried = [maker(count).fit_predict(points) for count in range(2, most + 1)]
        best = max(tried, key=lambda found: silhouette_score(points, found))
        out[name] = best.max() + 1, adjusted_rand_score(bundle.label[labelled], best[labelled]), None
    found = HDBSCAN(min_cluster_size=max(5, round(len(points) / 10)), min_samples=5, copy=True).fit_predict(points)
    kept = labelled & (found >= 0)
    left = int((found[labelled] < 0).sum()), int((found[~labelled] < 0).sum())
    out["HDBSCAN"] = found.max() + 1, adjusted_rand_score(bundle.label[kept], found[kept]), left
    return out
