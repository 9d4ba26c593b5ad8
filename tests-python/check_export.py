#!/usr/bin/env python3
"""Open what `crumple export` wrote with NumPy, pandas, polars and DuckDB.

    python check_export.py FOLDER

Every `.npy` file must load without pickle, be little-endian and finite; every `.csv` and `.parquet`
file must read alike in pandas, polars and DuckDB; a CSV and a Parquet file of the same name must hold
the same rows and columns, with the same numbers to f32. Prints one line of JSON: shapes of the arrays,
rows and columns of the tables. Exits 1 with a sentence when something is wrong.
"""
from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from tables import Disagreement, expect, read_table

SAME_NUMBER = 1e-6  # relative; a CSV may print an f32 with as many digits as tell it from its neighbours


def open_array(path: Path) -> np.ndarray:
    array = np.load(path, allow_pickle=False)
    expect(array.size > 0, f"{path}: empty")
    expect(array.dtype.byteorder in "<|=" and sys.byteorder == "little", f"{path}: {array.dtype.str} is not little-endian")
    if np.issubdtype(array.dtype, np.floating):
        expect(bool(np.isfinite(array).all()), f"{path}: values that are not finite numbers")
    return array


def same_table(csv: pd.DataFrame, parquet: pd.DataFrame, name: str) -> None:
    expect(list(csv.columns) == list(parquet.columns), f"{name}: columns of CSV and Parquet differ")
    expect(len(csv) == len(parquet), f"{name}: {len(csv)} rows in CSV, {len(parquet)} in Parquet")
    for column in csv.columns:
        if not pd.api.types.is_numeric_dtype(parquet[column]):
            expect(bool((csv[column].fillna("").astype(str) == parquet[column].fillna("").astype(str)).all()), f"{name}: texts of column {column} differ")
            continue
        a, b = csv[column].to_numpy(dtype=float), parquet[column].to_numpy(dtype=float)
        expect(bool(np.allclose(a, b, rtol=SAME_NUMBER, atol=0, equal_nan=True)), f"{name}: numbers of column {column} differ between CSV and Parquet")


def check_export(folder: Path) -> dict[str, dict[str, list[int]]]:
    arrays = {str(path.relative_to(folder)): open_array(path) for path in sorted(folder.rglob("*.npy"))}
    tables = {path: read_table(path) for path in sorted(folder.rglob("*")) if path.suffix in (".csv", ".parquet")}
    expect(bool(arrays or tables), f"{folder}: no .npy, .csv or .parquet file")
    for path, frame in tables.items():
        twin = tables.get(path.with_suffix(".parquet"))
        if path.suffix == ".csv" and twin is not None:
            same_table(frame, twin, str(path.relative_to(folder)))
    return {
        "arrays": {name: list(array.shape) for name, array in arrays.items()},
        "tables": {str(path.relative_to(folder)): list(frame.shape) for path, frame in tables.items()},
    }


def main() -> int:
    parser = argparse.ArgumentParser(description="open an export with NumPy, pandas, polars and DuckDB")
    parser.add_argument("folder", type=Path)
    args = parser.parse_args()
    try:
        print(json.dumps(check_export(args.folder)))
    except Disagreement as problem:
        print(problem, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
