"""The controller of a case as an object, with the keys of the table ``[controller]``.

    >>> import taut
    >>> from taut.controllers import Controller, Pid
    >>> from taut.moves import Move
    >>> case = taut.Case(taut.template())
    >>> pid = Pid(proportional="2 V/mm", derivative="10 V s/m")
    >>> there = Move("there", to="50 mm", speed="0.3 m/s", acceleration="5 m/s^2", until="0.6 s")
    >>> case.update({"controller": Controller(pid, every="1 ms", limit="12 V"), "move": [there]})
    >>> Controller.of(case).structure.proportional  # V/m
    2000.0

A field that is None is left out of the case, which then has the default in brackets. Values are numbers in SI units or
texts with a unit; commands are in V, or in A where the amplifier commands the current.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from ._parts import CasePart, Quantity

if TYPE_CHECKING:
    from .case import Case


@dataclass(frozen=True)
class Pid(CasePart):
    """PID control of the position."""

    _key = "pid"

    _: KW_ONLY
    proportional: Quantity
    """Command per error of position. [V/m or A/m]"""
    integral: Quantity | None = None
    """Command per integral of the error. [V/(m s) or A/(m s); default: 0]"""
    derivative: Quantity | None = None
    """Command per rate of the error. [V s/m or A s/m; default: 0]"""
    filter: Quantity | None = None
    """Corner of the derivative's filter, of first order. [Hz; default: 200]"""
    reference_speed: Quantity | None = None
    """Weight of the reference's speed in the derivative: 1 differentiates the error, 0 the measurement alone.
    [default: 1]"""
    tracking: Quantity | None = None
    """Time in which the integral follows a command that is limited (anti-windup). [s; default: 0.05]"""


@dataclass(frozen=True)
class CurrentLoop(CasePart):
    """The current loop of a cascade, in voltage mode."""

    _: KW_ONLY
    proportional: Quantity
    """Voltage per error of current. [V/A]"""
    integral: Quantity | None = None
    """Voltage per integral of that. [V/(A s); default: 0]"""
    limit: Quantity | None = None
    """Largest current asked for. [A; default: none]"""


@dataclass(frozen=True)
class Cascade(CasePart):
    """A position loop around a speed loop, and a current loop in that if there is one."""

    _key = "cascade"

    _inside = {"current": CurrentLoop._read}

    _: KW_ONLY
    position: Quantity
    """Commanded speed per error of position. [rad/s]"""
    speed: Quantity
    """Command per error of speed; with a current loop the current. [V s/m or A s/m]"""
    speed_integral: Quantity | None = None
    """Command per integral of that; with a current loop the current. [V/m or A/m; default: 0]"""
    filter: Quantity | None = None
    """Corner of the filter of the measured speed, of first order. [Hz; default: 200]"""
    reference_speed: Quantity | None = None
    """Weight of the reference's speed in the commanded speed; 0 if the drive does not feed it forward. [default: 1]"""
    tracking: Quantity | None = None
    """Time in which the integrals follow a limited command or current. [s; default: 0.02]"""
    current: CurrentLoop | None = None
    """The current loop. [default: none]"""


@dataclass(frozen=True)
class StateFeedback(CasePart):
    """Linear-quadratic state feedback with a Kalman filter."""

    _key = "state_feedback"

    _: KW_ONLY
    position: Quantity
    """Error of the cart's position that weighs as much as ``command``. [m]"""
    speed: Quantity | None = None
    """The same of its speed. [m/s; default: no weight]"""
    integral: Quantity | None = None
    """Integral of the measured error that weighs as much: makes it LQI. [m s; default: no integral]"""
    command: Quantity
    """Command that weighs as much as each of these. [V or A]"""
    disturbance: Quantity
    """Standard deviation of an unknown command, and of a force on the cart as large, that the Kalman filter expects
    at each sample. [V or A]"""
    noise: Quantity | None = None
    """Standard deviation of a measured position; at least 0.3 counts are taken. [m; default: 0]"""


@dataclass(frozen=True)
class SlidingMode(CasePart):
    """Sliding mode control with a boundary layer."""

    _key = "sliding_mode"

    _: KW_ONLY
    bandwidth: Quantity
    """Decay rate of the error on the sliding surface ė + λ e = 0. [rad/s]"""
    reaching: Quantity
    """Acceleration that drives to the surface. [m/s^2]"""
    boundary: Quantity
    """Boundary layer: distance from the surface within which ``reaching`` acts in proportion. [m/s]"""
    integral: Quantity | None = None
    """Weight of the error's integral in the surface. [s^-2; default: 0]"""
    filter: Quantity | None = None
    """Corner of the filter of the measured speed, of first order. [Hz; default: 200]"""


@dataclass(frozen=True)
class Fuzzy(CasePart):
    """Fuzzy control by a table of rules."""

    _key = "fuzzy"

    _: KW_ONLY
    error: Quantity
    """Error at the outermost sets. [m]"""
    rate: Quantity
    """Its rate at the outermost sets. [m/s]"""
    rules: Sequence[Sequence[float]]
    """3, 5, 7 or 9 rows of as many values from -1 to 1: by error, and in each row by its rate."""
    command: Quantity | None = None
    """Command of a rule of 1: makes it PD. [V or A; default: none with ``slope``]"""
    slope: Quantity | None = None
    """Change of the command of a rule of 1: makes it PI. [V/s or A/s; default: none with ``command``]"""
    filter: Quantity | None = None
    """Corner of the filter of the rate, of first order. [Hz; default: 200]"""


Structure: TypeAlias = "Pid | Cascade | StateFeedback | SlidingMode | Fuzzy"
"""Structures of a controller."""

_STRUCTURES: dict[str, type[Structure]] = {
    "pid": Pid,
    "cascade": Cascade,
    "state_feedback": StateFeedback,
    "sliding_mode": SlidingMode,
    "fuzzy": Fuzzy,
}


@dataclass(frozen=True)
class FeedForward(CasePart):
    """Feed-forward of the reference."""

    model: Literal["rigid", "elastic", "none"]
    """The model of the machine that it inverts."""
    _: KW_ONLY
    inertia: Quantity | None = None
    """Share of the inertial force that is fed forward. [default: 1]"""
    friction: Quantity | None = None
    """Share of the friction that is fed forward. [default: 1]"""
    compensate_stretch: bool | None = None
    """True to add the stretch of the belt to the reference of an encoder at motor or drive pulley. [default: False]"""
    lead: Quantity | None = None
    """Time ahead of the sample at which the reference is evaluated. [s; default: the delay and half a sample]"""


@dataclass(frozen=True)
class DisturbanceObserver(CasePart):
    """Observer of a disturbance at the command, whose estimate is subtracted."""

    bandwidth: Quantity
    """Frequency of its three poles. [Hz]"""


@dataclass(frozen=True)
class Notch(CasePart):
    """A notch filter of the command."""

    notch: Quantity
    """Frequency that a notch removes from the command. [Hz]"""
    _: KW_ONLY
    damping: Quantity | None = None
    """Damping of the filter's poles; a larger value widens a notch. [default: 0.7]"""
    depth: Quantity | None = None
    """Damping of a notch's zeros: its gain there is depth over damping. [default: 0.05]"""


@dataclass(frozen=True)
class LowPass(CasePart):
    """A low-pass filter of the command, of second order."""

    low_pass: Quantity
    """Corner frequency of a low-pass of second order. [Hz]"""
    _: KW_ONLY
    damping: Quantity | None = None
    """Damping of the filter's poles; a larger value widens a notch. [default: 0.7]"""


@dataclass(frozen=True)
class Controller(CasePart):
    """The sampled controller of a case."""

    _inside = {
        "feed_forward": FeedForward._read,
        "disturbance_observer": DisturbanceObserver._read,
        "filters": lambda each: [(Notch if "notch" in one else LowPass)._read(one) for one in each],
        "shaper": lambda impulses: [tuple(impulse) for impulse in impulses],
    }

    structure: Structure | None
    """The feedback law; None for a stepper, which has none."""
    _: KW_ONLY
    every: Quantity | None = None
    """Sample time; required except for a stepper. [s]"""
    delay: Quantity | None = None
    """Time from a sample to the command that follows from it; up to 1000 sample times. [s; default: 0]"""
    limit: Quantity | None = None
    """Largest command, either way. [V or A; default: none]"""
    feed_forward: FeedForward | None = None
    """Feed-forward. [default: "rigid" of sliding mode, "elastic" of state feedback, else none]"""
    disturbance_observer: DisturbanceObserver | None = None
    """Disturbance observer. [default: none]"""
    filters: Sequence[Notch | LowPass] | None = None
    """Filters of the command, one after the other. [default: none]"""
    shaper: Sequence[tuple[Quantity, float]] | None = None
    """Impulses of an input shaper: increasing times (s) and amplitudes, whose sum is 1. [default: none]"""

    @classmethod
    def of(cls, case: Case) -> Controller | None:
        """The controller of a case, None if it has none: numbers in SI units, elements of ``shaper`` as the file has
        them."""
        given = case.get("controller")
        if given is None:
            return None
        rest = {key: value for key, value in given.items() if key not in _STRUCTURES}
        structures = [_STRUCTURES[key]._read(value) for key, value in given.items() if key in _STRUCTURES]
        return cls._read({"structure": structures[0] if structures else None, **rest})

    def table(self) -> dict[str, Any]:
        """The keys of the table that are given, with their values."""
        table = super().table()
        if self.structure is not None:
            table[self.structure._key] = table.pop("structure")
        return table
