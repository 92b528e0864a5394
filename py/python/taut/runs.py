"""Runs of experiments and moves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any, cast, overload

import numpy as np
from numpy.typing import NDArray

from . import _checks, _html, _native, _plots
from ._optional import needed
from .table import Table

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from .types import Event, Metrics


class _Kept:
    """A run that was pickled: all that it holds, without what the solver has of it."""

    def __init__(self, kept: dict[str, Any], figures: dict[str, Any], events: list[dict[str, Any]], data: dict[str, Any]) -> None:
        self.names: list[tuple[str, str, str]] = kept["names"]
        self.arrays: dict[str, NDArray[np.float64]] = kept["arrays"]
        for array in self.arrays.values():
            array.setflags(write=False)
        self.name: str = kept["name"]
        self.ending: tuple[str, float] = tuple(kept["ending"])
        self.took: float = kept["took"]
        self.position_error: float | None = kept["position_error"]
        self.decided_within_rounding: list[tuple[float, str]] = [tuple(tie) for tie in kept["decided_within_rounding"]]
        self.inputs: list[str] = kept["inputs"]
        self.data = data
        self._figures, self._events = figures, events

    def figures(self) -> dict[str, Any]:
        return self._figures

    def events(self) -> list[dict[str, Any]]:
        return self._events


def _restored(*parts: Any) -> Run:
    return Run(_Kept(*parts))


class Run(Table):
    """One experiment or move that was run: its columns over time, key figures and events."""

    __slots__ = ("_native",)

    def __init__(self, native: _native.Run | _Kept) -> None:
        """Made by :meth:`taut.Case.simulate` and :meth:`taut.Case.move`; a run that was pickled, by ``pickle``."""
        if not isinstance(native, (_native.Run, _Kept)):
            raise TypeError(f"runs are made by Case.simulate and Case.move, and not of {type(native).__name__}")
        super().__init__(native.arrays, native.names)
        self._native = native

    @property
    def name(self) -> str:
        """The experiment's or the move's."""
        return self._native.name

    @property
    def time(self) -> NDArray[np.float64]:
        """Times of the rows, s."""
        return self["time"]

    @property
    def ending(self) -> str:
        """How it ended: ``complete``, ``left_travel``, ``too_many_events``, ``too_stiff``, ``diverged``."""
        return self._native.ending[0]

    @property
    def position_error(self) -> float | None:
        """By how much positions at the belt may be off, m: the exact solver's bound of rounding, for a move ten times
        the largest difference from a second run; ``None`` for other solvers with given inputs, and for a move with a
        controller in Python."""
        return self._native.position_error

    @property
    def decided_within_rounding(self) -> list[tuple[float, str]]:
        """When, s, and for which part numbers that differ in their last bit may have the motion go on otherwise: its
        load at rest was its breakaway. What the exact solver knows of it."""
        return list(self._native.decided_within_rounding)

    @property
    def metrics(self) -> Metrics:
        """The key figures, as ``taut simulate --json`` has them, of a move also those of ``taut move --json``; keys say
        their units."""
        return cast("Metrics", self._native.figures())

    @property
    def events(self) -> list[Event]:
        """Every stick, slip and reversal: ``time_s``, ``part``, ``from``, ``to``, ``load``, ``load_unit``,
        ``by_rounding``."""
        return cast("list[Event]", self._native.events())

    @property
    def took(self) -> float:
        """How long the solver took, s."""
        return self._native.took

    def write(self, path: str | PathLike[str]) -> None:
        """Writes the columns to a ``.csv`` or ``.parquet`` file, as ``taut simulate --out`` does."""
        native = self._native
        _native.write(native.arrays, native.names, native.inputs, _checks.path(path))

    def plot(self, *columns: str, ax: Axes | Sequence[Axes] | None = None) -> Figure:
        """A matplotlib figure of these columns over time, one panel for each unit.

        Without names: where the cart is and should be, its speed, and the voltage; of a gantry also those of the bridge
        and all drives. ``ax`` is what to draw into: one Axes, or as many as there are units.
        """
        usual = ["reference", "bridge_position", "cart_position", "bridge_speed", "cart_speed"]
        usual += ["voltage", "left_voltage", "right_voltage", "cart_voltage"]
        names = columns or tuple(name for name in usual if name in self)
        units: dict[str, list[str]] = {}
        for name in names:
            own = next((own for own, heading in self.headings.items() if name in (own, heading)), None)
            if own is None:
                self[name]  # tells what there is
                continue
            units.setdefault(self.units[own], []).append(own)
        figure, axes = _plots.panels(ax, len(units))
        for axis, (unit, group) in zip(axes, units.items()):
            for name in group:
                axis.plot(self.time, self[name], label=name.replace("_", " "), linewidth=1)
            _plots.finished(axis, "time, s" if axis is axes[-1] else "", unit)
        if ax is None:
            figure.suptitle(self.name)
        return figure

    def __reduce__(self) -> tuple[Any, ...]:
        kept = {name: getattr(self._native, name) for name in ("names", "name", "ending", "took", "position_error", "decided_within_rounding", "inputs")}
        kept["arrays"] = dict(self._native.arrays)
        return (_restored, (kept, self.metrics, self.events, self._data()))

    def _data(self) -> dict[str, Any]:
        """The part of the program's output that is about this run."""
        if isinstance(self._native, _Kept):
            return self._native.data
        told = _native.simulation([self._native])
        data: dict[str, Any] = _native.moves([self._native]) if told is None else told
        return data

    def __repr__(self) -> str:
        return f"<taut.Run {self.name!r}: {self.rows} rows, {self.ending}, {len(self.events)} events>"

    def _repr_html_(self) -> str:
        figures = [(key, value) for key, value in self.metrics.items() if isinstance(value, (float, int, type(None)))]
        peaks = [(key, value["value"]) for key, value in self.metrics.items() if isinstance(value, dict) and "value" in value]
        title = f"{self.name}: {self.ending}, {self.rows} rows, {len(self.events)} events"
        return _html.table(title, ("", ""), figures + peaks)


class Runs(Sequence[Run]):
    """Several runs in the case's order, by number or by name."""

    __slots__ = ("_runs",)

    def __init__(self, runs: Sequence[Run]) -> None:
        """Made by :meth:`taut.Case.simulate` and :meth:`taut.Case.move`."""
        self._runs = list(runs)
        if not all(isinstance(run, Run) for run in self._runs):
            raise TypeError("runs are made by Case.simulate and Case.move")

    @overload
    def __getitem__(self, index: int | str) -> Run: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Run]: ...
    def __getitem__(self, index: int | str | slice) -> Run | Sequence[Run]:
        if isinstance(index, str):
            found = next((run for run in self._runs if run.name == index), None)
            if found is None:
                raise KeyError(f"there is no run {index!r}; there are {', '.join(run.name for run in self._runs)}")
            return found
        return self._runs[index]

    def __len__(self) -> int:
        return len(self._runs)

    def __iter__(self) -> Iterator[Run]:
        return iter(self._runs)

    @property
    def data(self) -> dict[str, Any]:
        """The output of ``taut simulate --json`` or ``taut move --json``."""
        each = [run._data() for run in self._runs]
        if not each:
            return {}
        done = "moves" if "moves" in each[0] else "experiments"
        return {**each[0], done: [one for data in each for one in data[done]]}

    def plot(self, *columns: str) -> Figure:
        """The same columns of all runs over each other, one panel for each unit; named as those of :meth:`Run.plot`."""
        if not self._runs:
            raise ValueError("there is no run to plot")
        figure = self._runs[0].plot(*columns)
        for run in self._runs[1:]:
            run.plot(*columns, ax=figure.axes)
        for axis in figure.axes:
            lines = axis.get_lines()
            share = len(lines) // len(self._runs)
            for place, line in enumerate(lines):
                line.set_label(f"{self._runs[place // share].name}: {line.get_label()}")
            axis.legend(loc="best", fontsize="small")
        figure.suptitle("")
        return figure

    def to_pandas(self) -> pandas.DataFrame:
        """The rows of all runs in one pandas.DataFrame, with the name of each run as the first level of its index."""
        frames = {run.name: run.to_pandas() for run in self._runs}
        joined: pandas.DataFrame = needed("pandas", "pandas", "to_pandas()").concat(frames, names=["run", "row"])
        return joined

    def __repr__(self) -> str:
        return "[" + ", ".join(map(repr, self._runs)) + "]"

    def _repr_html_(self) -> str:
        return "".join(run._repr_html_() for run in self._runs)
