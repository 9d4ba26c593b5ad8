"""Read one table with pandas, polars and DuckDB and make sure that they see the same."""
from __future__ import annotations

from pathlib import Path

import duckdb
import numpy as np
import pandas as pd
import polars as pl


class Disagreement(AssertionError):
    """A file is not what it should be, or two programs read it differently."""


def expect(condition: bool, message: str) -> None:
    """Raises Disagreement with `message` unless `condition` holds; unlike `assert` also under `python -O`."""
    if not condition:
        raise Disagreement(message)


def read_table(path: Path) -> pd.DataFrame:
    """The table of a Parquet or CSV file as pandas reads it.

    polars and DuckDB must see the same column names, the same number of rows, and the same numbers
    in every numeric column (compared as f64, missing values in the same places).
    """
    parquet = path.suffix == ".parquet"
    frame = pd.read_parquet(path) if parquet else pd.read_csv(path, float_precision="round_trip")
    other = pl.read_parquet(path) if parquet else pl.read_csv(path, infer_schema_length=None)
    reader = "read_parquet" if parquet else "read_csv"
    with duckdb.connect() as connection:
        third = connection.execute(f"select * from {reader}(?)", [str(path)]).fetchnumpy()

    names = list(frame.columns)
    expect(names == other.columns, f"{path}: pandas sees columns {names[:8]}, polars {other.columns[:8]}")
    expect(names == list(third), f"{path}: pandas sees columns {names[:8]}, DuckDB {list(third)[:8]}")
    rows = {"pandas": len(frame), "polars": other.height, "DuckDB": len(next(iter(third.values()), []))}
    expect(len(set(rows.values())) == 1, f"{path}: rows differ: {rows}")
    for name in names:
        if not pd.api.types.is_numeric_dtype(frame[name]) or pd.api.types.is_bool_dtype(frame[name]):
            continue
        ours = frame[name].to_numpy(dtype=float, na_value=np.nan)
        polars_values = other[name].cast(pl.Float64).to_numpy()
        duckdb_values = np.ma.filled(np.ma.asarray(third[name]).astype(float), np.nan)
        for program, values in (("polars", polars_values), ("DuckDB", duckdb_values)):
            expect(np.array_equal(ours, values, equal_nan=True), f"{path}: column {name} differs between pandas and {program}")
    return frame


def finite(frame: pd.DataFrame, columns: list[str], path: Path) -> None:
    """Every value of these columns is a finite number."""
    values = frame[columns].to_numpy(dtype=float)
    expect(bool(np.isfinite(values).all()), f"{path}: {np.count_nonzero(~np.isfinite(values))} values are not finite numbers")
