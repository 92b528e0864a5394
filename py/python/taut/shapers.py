"""Input shapers from files of vibration."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

from . import _checks, _html, _native, _plots
from ._toml import change
from .table import frame

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from .types import Direction, DriveState, Firmware


@dataclass(frozen=True)
class Shape:
    """Input shapers for a file of vibration, and one that is recommended."""

    data: dict[str, Any]
    """The output of ``taut shape --json``."""

    @property
    def recommended(self) -> tuple[str, float, float]:
        """Name, frequency (Hz) and damping ratio of the shaper that is recommended."""
        best = self.data["recommended"]
        return best["shaper"], best["frequency"], best["damping"]

    @property
    def lines(self) -> list[str]:
        """Lines for Klipper's configuration."""
        return list(self.data["recommended"]["lines"])

    @property
    def pairs(self) -> list[dict[str, Any]]:
        """The best pairs of shapers, one behind the other, with their ``impulses``; empty unless ``pairs=True`` was
        said."""
        return list(self.data["pairs"])

    @property
    def belts(self) -> dict[str, Any] | None:
        """Which belt is ``looser``, the ``stiffness_ratio`` (belt B to belt A) with its ``interval_95``, and ``words``;
        ``None`` unless ``belts=True`` was said."""
        belts: dict[str, Any] | None = self.data["belts"]
        return belts

    @property
    def pair_line(self) -> str | None:
        """The line for ``[controller]`` of a case, where a pair is clearly better than the recommended shaper."""
        best = self.data["recommended_pair"]
        return None if best is None else str(best["line"])

    def to_pandas(self) -> pandas.DataFrame:
        """A pandas.DataFrame of the shapers: frequency (Hz), vibration that is left, smoothing (m), acceleration up to
        (m/s^2)."""
        rows = self.data["shapers"]
        keys = ("shaper", "frequency", "vibration", "smoothing", "max_acceleration", "candidate")
        return frame({key: [row[key] for row in rows] for key in keys})

    def plot(self, *, ax: Axes | None = None) -> Figure:
        """The vibration that each shaper leaves; over a measured spectrum the spectrum, with the shapers'
        frequencies."""
        figure, (axis,) = _plots.panels(ax, 1, height=3.0)
        spectrum = self.data.get("spectrum")
        if spectrum is None:
            rows = self.data["shapers"]
            _plots.bars(axis, [row["shaper"] for row in rows], [100 * row["vibration"] for row in rows], "vibration left, %")
            return figure
        axis.plot(spectrum["frequency"], spectrum["density"], "k", linewidth=1, label="measured")
        for row in self.data["shapers"]:
            name = f"{row['shaper']} {row['frequency']:.1f} Hz"
            axis.axvline(row["frequency"], linestyle="--", linewidth=1, label=name)
        _plots.finished(axis, "frequency, Hz", "density")
        return figure

    def __repr__(self) -> str:
        name, frequency, _ = self.recommended
        return f"<taut.Shape {self.data['file']!r}: {name} at {frequency:.1f} Hz>"

    def _repr_html_(self) -> str:
        rows = [(row["shaper"], row["frequency"], row["vibration"], row["smoothing"]) for row in self.data["shapers"]]
        return _html.table(str(self.data["file"]), ("shaper", "frequency, Hz", "vibration left", "smoothing, m"), rows)


def shape(
    files: str | PathLike[str] | Sequence[str | PathLike[str]],
    *,
    together: bool = False,
    firmware: Firmware = "klipper",
    axis: Direction | None = None,
    damping: float | str | None = None,
    max_smoothing: float | None = None,
    max_vibrations: float | None = None,
    corner_speed: float | None = None,
    shapers: Iterable[str] | None = None,
    uncertainty: float | None = None,
    motor: DriveState | None = None,
    pairs: bool = False,
    belts: bool = False,
    changes: Mapping[str, Any] | None = None,
) -> Shape:
    """An input shaper from one file of vibration, two that are compared, or several ``together``.

    A file is a spectrum or samples of an accelerometer as Klipper writes them, or a case. ``firmware`` is ``klipper``
    or ``klipper-2025-08``; ``axis`` of the accelerometer is ``x``, ``y`` or ``z``; ``damping`` is a ratio, or
    ``"fitted"``; ``max_smoothing`` is in m, ``max_vibrations`` a share (0.05 is 5 %), ``corner_speed`` in m/s;
    ``shapers`` are names to choose among. Of a case, ``uncertainty`` is by which share its frequencies may be off,
    ``motor`` is ``held`` or ``free``, and ``changes`` are values by key, as of :meth:`taut.Case.changed`. With
    ``pairs`` two shapers one behind the other are looked at, too: for two modes, or for one that moves far along the
    travel. With ``belts`` the two files are those of belts A and B of a CoreXY, and ``Shape.belts`` has the looser one.
    """
    paths = [files] if isinstance(files, (str, PathLike)) else list(files)
    fitted = isinstance(damping, str)
    if fitted and damping != "fitted":
        raise ValueError(f'damping: expected a ratio such as 0.08, or "fitted", found {damping!r}')
    if not isinstance(changes, (Mapping, type(None))):
        raise TypeError(f"changes: expected a dictionary, found {type(changes).__name__}")
    options = {
        "together": bool(together),
        "firmware": _checks.text("firmware", firmware),
        "axis": _checks.word("axis", axis),
        "damping": None if fitted else _checks.number("damping", damping),
        "fitted": fitted,
        "max_smoothing": _checks.number("max_smoothing", max_smoothing),
        "max_vibrations": _checks.number("max_vibrations", max_vibrations),
        "corner_speed": _checks.number("corner_speed", corner_speed),
        "shapers": _checks.names("shapers", shapers),
        "uncertainty": _checks.number("uncertainty", uncertainty),
        "motor": _checks.word("motor", motor),
        "pairs": bool(pairs),
        "belts": bool(belts),
        "changes": [change(key, value) for key, value in (changes or {}).items()],
    }
    return Shape(_native.shape([_checks.path(path) for path in paths], options))
