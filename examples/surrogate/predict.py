"""Predicts the numbers of `crumple features` from the inputs, and reports the error on held-out runs.

    python3 predict.py features.csv

Ten-fold cross-validation: each run is predicted by a model that has not seen it. The mean of the other runs is the
prediction to beat; R2 is 1 minus the squared error over that of the mean, 0 or less where nothing is learnt.
"""

import re
import sys

import numpy as np
import pandas as pd
from sklearn.dummy import DummyRegressor
from sklearn.ensemble import RandomForestRegressor
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
from sklearn.model_selection import KFold, cross_val_predict
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

MODELS = {
    "mean of the others": DummyRegressor(),
    "random forest": RandomForestRegressor(n_estimators=300, min_samples_leaf=2, random_state=1),
    "Gaussian process": make_pipeline(
        StandardScaler(),
        GaussianProcessRegressor(
            ConstantKernel() * RBF(3.0, (0.3, 100.0)) + WhiteKernel(0.1), normalize_y=True, random_state=1
        ),
    ),
}


def inputs(table):
    """Thickness; for each kind of notch whether it is there; place and length of the first and of the second."""
    notches = [re.findall(r"(\w+)@(\d+)-(\d+)", text) for text in table["notches"].fillna("")]
    kinds = sorted({kind for found in notches for kind, _, _ in found})
    rows = []
    for thickness, found in zip(table["thickness_mm"], notches):
        places = sorted((float(first), float(last)) for _, first, last in found)
        row = [thickness, len(found)] + [float(any(kind == have for have, _, _ in found)) for kind in kinds]
        for at in range(2):
            first, last = places[min(at, len(places) - 1)] if places else (250.0, 250.0)
            row += [(first + last) / 2, last - first]
        rows.append(row)
    return np.array(rows)


def main(path):
    """Prints one line a model."""
    table = pd.read_csv(path)
    numbers = table[[name for name in table.columns if re.fullmatch(r"kind_\d+|turn_\d+_[xyz]", name)]].to_numpy()
    targets = {"distance to the descriptor": table[["distance"]].to_numpy(), "all numbers": numbers}
    folds = KFold(10, shuffle=True, random_state=1)
    x = inputs(table)
    print(f"{len(table)} runs, {x.shape[1]} inputs, {numbers.shape[1]} numbers, ten-fold cross-validation")
    for name, y in targets.items():
        mean = None
        for model, regressor in MODELS.items():
            found = cross_val_predict(regressor, x, y.squeeze(), cv=folds).reshape(y.shape)
            square = np.mean(np.sum((found - y) ** 2, axis=1))
            mean = mean or square
            print(f"{name:27} {model:19} RMS error {np.sqrt(square):.3f}   R2 against the mean {1 - square / mean:5.2f}")


if __name__ == "__main__":
    main(sys.argv[1])
