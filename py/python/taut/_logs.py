"""Logs that are in memory, as files that a case names."""

from __future__ import annotations

import csv
import os
import re
import tempfile
from collections.abc import Mapping
from functools import lru_cache
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .table import Table

_numbers = count(1)


@lru_cache(maxsize=1)
def _folder() -> tempfile.TemporaryDirectory[str]:
    """A folder for logs without a name of their own; it is removed when Python ends."""
    return tempfile.TemporaryDirectory(prefix="taut-")


def _columns(log: Any) -> dict[str, NDArray[np.float64]]:
    """Names and numbers of a DataFrame (pandas, polars), a table of Arrow, a Table, or a dictionary of arrays."""
    if isinstance(log, Table):
        return {heading: log[name] for name, heading in log.headings.items()}
    if hasattr(log, "column_names") and hasattr(log, "column"):  # Arrow
        return {str(name): _numbers_of(str(name), log.column(name).to_numpy()) for name in log.column_names}
    if hasattr(log, "columns"):  # pandas and polars
        return {str(name): _numbers_of(str(name), log[name].to_numpy()) for name in log.columns}
    if isinstance(log, Mapping):
        return {str(name): _numbers_of(str(name), np.asarray(values)) for name, values in log.items()}
    raise TypeError(f"log: expected a DataFrame, a Table or a dictionary of arrays, found {type(log).__name__}")


def _numbers_of(name: str, values: Any) -> NDArray[np.float64]:
    try:
        column = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"log: the column {name!r} holds no numbers; leave out what is none") from None
    if column.ndim != 1:
        raise ValueError(f"log: the column {name!r} has {column.ndim} dimensions, and no single row of numbers")
    return column


def write_log(log: Any, path: str | None, name: str) -> str:
    """Writes a log as CSV, whole or not at all, numbers to the last bit; returns the absolute path of it."""
    columns = _columns(log)
    lengths = {len(values) for values in columns.values()}
    if len(lengths) != 1 or 0 in lengths:
        raise ValueError("log: columns of equal length with at least one row are wanted")
    if path is None:
        own = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")[:60] or "log"
        path = str(Path(_folder().name) / f"{next(_numbers)}-{own}.csv")
    whole = os.path.abspath(path)
    draft = f"{whole}.{os.getpid()}.part"
    try:
        with open(draft, "w", newline="", encoding="utf-8") as file:
            rows = csv.writer(file, lineterminator="\n")
            rows.writerow(columns)
            rows.writerows(zip(*([repr(value) for value in values.tolist()] for values in columns.values())))
        os.replace(draft, whole)
    finally:
        if os.path.exists(draft):
            os.remove(draft)
    return whole
