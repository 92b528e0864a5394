"""The common part of all plots: a figure of one's own, or the axes that the caller gives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ._optional import needed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def panels(ax: Axes | Sequence[Axes] | None, count: int, *, shared: bool = True, height: float = 2.0) -> tuple[Figure, list[Any]]:
    """A figure with ``count`` panels below each other; or that of the axes that are given, of which there have to be as
    many."""
    if ax is None:
        figure: Figure = needed("taut._notebook", "matplotlib", "plot()").NotebookFigure(
            figsize=(7, 1 + height * max(count, 1)), layout="constrained"
        )
        return figure, list(figure.subplots(max(count, 1), 1, sharex=shared, squeeze=False)[:, 0])
    if hasattr(ax, "plot"):
        given: list[Any] = [ax]
    elif isinstance(ax, str) or not hasattr(ax, "__iter__"):
        raise TypeError(f"ax: Axes of matplotlib are wanted, and no {type(ax).__name__}")
    else:
        given = list(ax)
    for one in given:
        if not (hasattr(one, "plot") and hasattr(one, "get_figure")):
            raise TypeError(f"ax: Axes of matplotlib are wanted, and no {type(one).__name__}")
    if len(given) != count:
        raise ValueError(f"ax: this plot has {count} panels, and {len(given)} axes were given")
    owner: Figure = given[0].get_figure()
    return owner, given


def finished(axis: Any, x: str, y: str, *, legend: bool = True) -> None:
    """Labels, a legend where something has a name, and a grid."""
    axis.set_xlabel(x)
    axis.set_ylabel(y)
    if legend and axis.get_legend_handles_labels()[1]:
        axis.legend(loc="best", fontsize="small")
    axis.grid(True, alpha=0.3)


def bars(axis: Any, names: Sequence[str], values: Sequence[float], x: str) -> None:
    """Named values as horizontal bars, the first on top."""
    axis.barh(range(len(names)), values)
    axis.set_yticks(range(len(names)), names)
    axis.invert_yaxis()
    axis.set_xlabel(x)
    axis.grid(True, axis="x", alpha=0.3)
