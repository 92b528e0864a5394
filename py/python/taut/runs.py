"""Runs of experiments and moves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import NDArray

from . import _checks, _html, _native
from ._optional import needed
from .table import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Run(Table):
    """One experiment or move that was run: its columns over time, key figures and events."""

    __slots__ = ("_native",)

    def __init__(self, native: _native.Run) -> None:
        """Made by :meth:`taut.Case.simulate` and :meth:`taut.Case.move`."""
        if not isinstance(native, _native.Run):
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
        """By how much positions at the belt may be off, m: the exact solver's bound of rounding; ``None`` for the others."""
        return self._native.position_error

    @property
    def metrics(self) -> dict[str, Any]:
        """The key figures, as ``taut simulate --json`` has them; keys say their units."""
        figures: dict[str, Any] = self._native.figures()
        return figures

    @property
    def events(self) -> list[dict[str, Any]]:
        """Every stick, slip and reversal: ``time_s``, ``part``, ``from``, ``to``, ``load``, ``load_unit``, ``by_rounding``."""
        events: list[dict[str, Any]] = self._native.events()
        return events

    @property
    def took(self) -> float:
        """How long the solver took, s."""
        return self._native.took

    def write(self, path: str | PathLike[str]) -> None:
        """Writes the columns to a ``.csv`` or ``.parquet`` file, as ``taut simulate --out`` does."""
        self._native.write(_checks.path(path))

    def plot(self, *columns: str) -> Figure:
        """A matplotlib figure of these columns over time, one panel for each unit.

        Without names: where the cart is and should be, its speed, and the voltage; of a gantry also those of the bridge and both drives.
        """
        usual = ["reference", "bridge_position", "cart_position", "bridge_speed", "cart_speed"]
        usual += ["voltage", "left_voltage", "right_voltage"]
        names = columns or tuple(name for name in usual if name in self)
        panels: dict[str, list[str]] = {}
        for name in names:
            own = next((own for own, heading in self.headings.items() if name in (own, heading)), None)
            if own is None:
                self[name]  # tells what there is
                continue
            panels.setdefault(self.units[own], []).append(own)
        figure: Figure = needed("matplotlib.figure", "matplotlib", "plot()").Figure(
            figsize=(7, 1 + 2 * len(panels)), layout="constrained"
        )
        axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
        for axis, (unit, group) in zip(axes, panels.items()):
            for name in group:
                axis.plot(self.time, self[name], label=name.replace("_", " "), linewidth=1)
            axis.set_ylabel(unit)
            axis.legend(loc="best", fontsize="small")
            axis.grid(True, alpha=0.3)
        axes[-1].set_xlabel("time, s")
        figure.suptitle(self.name)
        return figure

    def __repr__(self) -> str:
        return f"<taut.Run {self.name!r}: {self.rows} rows, {self.ending}, {len(self.events)} events>"

    def _repr_html_(self) -> str:
        figures = [(key, value) for key, value in self.metrics.items() if isinstance(value, (float, int, type(None)))]
        peaks = [(key, value["value"]) for key, value in self.metrics.items() if isinstance(value, dict) and "value" in value]
        title = f"{self.name}: {self.ending}, {self.rows} rows, {len(self.events)} events"
        return _html.table(title, ("", ""), figures + peaks)


class Runs(Sequence[Run]):
    """Several runs in the case's order, by number or by name."""

    __slots__ = ("_runs", "_told")

    def __init__(self, runs: Sequence[Run], moved: bool) -> None:
        """Made by :meth:`taut.Case.simulate` and :meth:`taut.Case.move`."""
        self._runs = list(runs)
        if not all(isinstance(run, Run) for run in self._runs):
            raise TypeError("runs are made by Case.simulate and Case.move")
        self._told = _native.moves if moved else _native.simulation

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
        """What ``taut simulate --json`` or ``taut move --json`` prints."""
        data: dict[str, Any] = self._told([run._native for run in self._runs])
        return data

    def __repr__(self) -> str:
        return "[" + ", ".join(map(repr, self._runs)) + "]"

    def _repr_html_(self) -> str:
        return "".join(run._repr_html_() for run in self._runs)
