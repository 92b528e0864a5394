"""Columns of numbers with their units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _html, _plots
from ._optional import needed

if TYPE_CHECKING:
    import pandas
    import polars
    import pyarrow
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


class Table(Mapping[str, NDArray[np.float64]]):
    """Named columns of equal length, SI units, as NumPy arrays over memory that Rust has filled.

    ``table["cart_position"]`` is a column by its name, ``table["cart_position_m"]`` by its heading in files.
    ``table.units`` says the unit of each.
    """

    __slots__ = ("_arrays", "_names")

    def __init__(self, arrays: Mapping[str, NDArray[np.float64]], names: Sequence[tuple[str, str, str]]) -> None:
        """The columns by name, and name, unit and heading of each in their order."""
        self._arrays = arrays
        self._names = names

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        try:
            return self._arrays[name]
        except KeyError:
            for own, _, heading in self._names:
                if heading == name:
                    return self._arrays[own]
            known = ", ".join(own for own, _, _ in self._names)
            raise KeyError(f"there is no column {name!r}; there are {known}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        """Number of columns; ``table.rows`` is that of rows."""
        return len(self._arrays)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return next((len(array) for array in self._arrays.values()), 0)

    @property
    def units(self) -> dict[str, str]:
        """The unit of each column, such as ``m/s``; empty for pure numbers."""
        return {name: unit for name, unit, _ in self._names}

    @property
    def headings(self) -> dict[str, str]:
        """The name of each column in files, with its unit: ``cart_position_m``."""
        return {name: heading for name, _, heading in self._names}

    def _by_heading(self) -> dict[str, NDArray[np.float64]]:
        return {heading: self._arrays[name] for name, _, heading in self._names}

    def to_arrow(self) -> pyarrow.Table:
        """A pyarrow.Table over the same memory, named and described as in our Parquet files.

        Columns have headings with units; the schema's metadata holds ``unit.cart_position_m`` = ``m`` and so on, and
        each field's ``unit`` besides.
        """
        return arrow_table(self._arrays, self._names)

    def to_pandas(self) -> pandas.DataFrame:
        """A pandas.DataFrame with headings as columns; ``attrs["units"]`` holds the units."""
        frame: pandas.DataFrame = needed("pandas", "pandas", "to_pandas()").DataFrame(self._by_heading(), copy=False)
        frame.attrs["units"] = {heading: unit for _, unit, heading in self._names}
        return frame

    def to_polars(self) -> polars.DataFrame:
        """A polars.DataFrame with headings, which hold the units, as columns."""
        frame: polars.DataFrame = needed("polars", "polars", "to_polars()").DataFrame(self._by_heading())
        return frame

    def plot(self, *columns: str, ax: Axes | Sequence[Axes] | None = None) -> Figure:
        """A histogram of one column, or the second over the first as points; of a sweep, its figures over its
        parameters."""
        if len(columns) not in (1, 2):
            raise TypeError("plot() takes one column for a histogram, or two for points: plot('x', 'y')")
        figure, (axis,) = _plots.panels(ax, 1, height=3.0)
        label = [f"{name}, {self.units[name]}".rstrip(", ") if name in self.units else name for name in columns]
        if len(columns) == 1:
            axis.hist(self[columns[0]][np.isfinite(self[columns[0]])], bins="auto")
            _plots.finished(axis, label[0], "rows")
        else:
            axis.plot(self[columns[0]], self[columns[1]], ".", markersize=3)
            _plots.finished(axis, label[0], label[1])
        return figure

    def __repr__(self) -> str:
        return f"<taut.{type(self).__name__}: {self.rows} rows of {', '.join(self.headings.values())}>"

    def _repr_html_(self) -> str:
        rows = [(name, unit, float(self[name].min()), float(self[name].max())) for name, unit, _ in self._names if self.rows]
        return _html.table(f"{self.rows} rows", ("column", "unit", "least", "greatest"), rows)


def frame(columns: Mapping[str, Any]) -> pandas.DataFrame:
    """A pandas.DataFrame of these columns."""
    made: pandas.DataFrame = needed("pandas", "pandas", "to_pandas()").DataFrame(dict(columns))
    return made


def arrow_table(arrays: Mapping[str, NDArray[np.float64]], names: Sequence[tuple[str, str, str]]) -> pyarrow.Table:
    """Columns by name, each with its unit and heading, as Arrow; a column that is not there has no rows."""
    arrow = needed("pyarrow", "pyarrow", "to_arrow()")
    fields = [
        arrow.field(heading, arrow.float64(), nullable=False, metadata={"unit": unit}) for _, unit, heading in names
    ]
    schema = arrow.schema(fields, metadata={f"unit.{heading}": unit for _, unit, heading in names})
    columns = [arrow.array(arrays.get(name, ()), arrow.float64()) for name, _, _ in names]
    return arrow.Table.from_arrays(columns, schema=schema)
