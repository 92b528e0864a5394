"""Figures that a notebook shows by itself. Imported when a plot is asked for, since it needs matplotlib."""

from __future__ import annotations

from io import BytesIO

from matplotlib.figure import Figure


class NotebookFigure(Figure):
    """A figure of its own, without pyplot: notebooks show it whatever was imported before, and no window opens."""

    def _repr_png_(self) -> bytes:
        file = BytesIO()
        self.savefig(file, format="png", dpi=150)
        return file.getvalue()
