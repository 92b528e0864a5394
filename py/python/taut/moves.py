"""Moves of a case as objects, with the keys of ``[[move]]``; :mod:`taut.controllers` has an example.

A field that is None is left out of the case, which then has the default in brackets. Values are numbers in SI units or
texts with a unit; a position of a gantry is a list: bridge, cart.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING, TypeAlias

from ._parts import CasePart, Quantity

if TYPE_CHECKING:
    from .case import Case

Position: TypeAlias = "Quantity | Sequence[Quantity]"
"""A position of the cart, or of bridge and cart of a gantry, m."""


@dataclass(frozen=True)
class Point(CasePart):
    """A point that a move passes, with what differs from the move."""

    to: Position
    """Each point of a list, or its ``to``. [m]"""
    _: KW_ONLY
    center: Sequence[Quantity] | None = None
    """Centre of an arc to the point, for a gantry a list: bridge, cart; counterclockwise unless ``clockwise =
    true``. [m; default: a straight leg]"""
    clockwise: bool | None = None
    """True for a clockwise arc. [default: False]"""
    speed: Quantity | None = None
    """Largest speed towards this point. [m/s; default: the move's]"""
    wait: Quantity | None = None
    """How long it stands there. [s; default: 0]"""


@dataclass(frozen=True)
class Plan(CasePart):
    """Limits of a move planned as the fastest that the machine can make."""

    _: KW_ONLY
    speed: Quantity | None = None
    """Largest speed of a move that is planned. [m/s; default: what the machine allows]"""
    acceleration: Quantity | None = None
    """Largest acceleration. [m/s^2; default: what the machine allows]"""
    jerk: Quantity | None = None
    """Largest jerk. [m/s^3; default: what the jerk time requires]"""
    reserve: Quantity | None = None
    """Share of voltage and current, or of the pull-out torque of a stepper, that is reserved. [default: 0.1]"""


@dataclass(frozen=True)
class Move(CasePart):
    """A move in closed loop: a reference for the cart."""

    _inside = {
        "plan": Plan._read,
        "points": lambda each: [Point._read(one) if isinstance(one, Mapping) else one for one in each],
    }

    name: str
    """Its name, unique among the moves."""
    _: KW_ONLY
    until: Quantity
    """End of the run. [s]"""
    to: Position | None = None
    """Target of the cart; for a gantry a list: bridge, cart. [m; default: ``points`` or ``gcode`` instead]"""
    points: Sequence[Position | Point] | None = None
    """Points that it stops at, one after the other; instead of ``to``."""
    gcode: str | None = None
    """The move in G-code; instead of ``to``."""
    speed: Quantity | None = None
    """Largest speed, along the path of a gantry. [m/s; default: ``plan`` instead]"""
    acceleration: Quantity | None = None
    """Largest acceleration. [m/s^2; default: ``plan`` instead]"""
    jerk: Quantity | None = None
    """Largest jerk. [m/s^3; default: none: a trapezoid]"""
    snap: Quantity | None = None
    """Largest snap; only with ``jerk``. [m/s^4; default: none: third order]"""
    plan: Plan | None = None
    """The fastest move that the machine can make, instead of ``speed`` and ``acceleration``; ``Plan()`` for all it can."""
    from_: Position | None = None
    """Position of the cart at time zero; for a gantry a list: bridge, cart. [m; default: 0]"""
    every: Quantity | None = None
    """Interval between the rows of the result, the last of which is at the end; it affects neither accuracy nor
    figures. [s; default: the controller's ``every``]"""
    window: Quantity | None = None
    """Distance from its target within which the cart counts as settled. [m; default: 0.0001]"""

    @classmethod
    def of(cls, case: Case, name: str) -> Move:
        """The move of this name in a case: numbers in SI units, elements of ``points`` as the file has them."""
        found = next((move for move in case.get("move", []) if move["name"] == name), None)
        if found is None:
            raise KeyError(f"there is no move {name!r}; there are {', '.join(map(repr, case.moves)) or 'none'}")
        return cls._read(found)
