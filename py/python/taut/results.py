"""What checks, fits and linear analyses find."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _html
from ._optional import needed
from .table import Table

if TYPE_CHECKING:
    import control

    from .case import Case


@dataclass(frozen=True)
class Check:
    """What the logs of a case can tell of its parameters, before any fit."""

    data: dict[str, Any]
    """What ``taut check --json`` prints."""

    @property
    def complete(self) -> bool:
        """Whether everything that is searched for is determined."""
        return bool(self.data["complete"])

    @property
    def errors(self) -> dict[str, float]:
        """How well each parameter would be known: its standard error as a share of it; infinite if not at all."""
        infinite = float("inf")
        return {
            row["name"]: infinite if row["relative_error"] is None else row["relative_error"]
            for row in self.data["parameters"]
        }

    @property
    def not_determined(self) -> list[str]:
        """The combinations that nothing tells apart, in words."""
        return [group["words"] for group in self.data["not_determined"]]

    def __repr__(self) -> str:
        told = "everything determined" if self.complete else "; ".join(self.not_determined)
        return f"<taut.Check {self.data['title']!r}: {told}>"

    def _repr_html_(self) -> str:
        return _html.table(str(self.data["title"]), ("parameter", "relative error"), self.errors.items())


@dataclass(frozen=True)
class Estimate:
    """One parameter that was found. SI units."""

    name: str
    unit: str
    value: float
    standard_error: float | None
    """None where it is at a bound or not determined."""
    interval_95: tuple[float, float] | None
    at_bound: bool
    start: float


@dataclass(frozen=True)
class Fit:
    """Parameters from logs, and how well they are known."""

    data: dict[str, Any]
    """What ``taut fit --json`` prints."""
    case: Case
    """The case with the estimates in it."""
    draws: Table | None
    """Draws from the posterior, if they were asked for: ``chain``, ``draw`` and each parameter."""

    @property
    def converged(self) -> bool:
        """Whether the search came to its end."""
        return bool(self.data["converged"])

    @property
    def estimates(self) -> dict[str, Estimate]:
        """The estimates by the parameter's name."""
        rows = self.data["parameters"]
        return {
            row["name"]: Estimate(
                name=row["name"],
                unit=row["unit"],
                value=row["value"],
                standard_error=row["standard_error"],
                interval_95=None if row["interval_95"] is None else (row["interval_95"][0], row["interval_95"][1]),
                at_bound=row["at_bound"],
                start=row["start"],
            )
            for row in rows
        }

    def __getitem__(self, name: str) -> Estimate:
        return self.estimates[name]

    def __repr__(self) -> str:
        found = ", ".join(f"{e.name} = {e.value:.6g} {e.unit}".strip() for e in self.estimates.values())
        return f"<taut.Fit {self.data['title']!r}, {self.data['ending']}: {found}>"

    def _repr_html_(self) -> str:
        rows = [(e.name, e.value, e.standard_error, e.unit) for e in self.estimates.values()]
        title = f"{self.data['title']}: {self.data['ending']}"
        return _html.table(title, ("parameter", "value", "standard error", "unit"), rows)


@dataclass(frozen=True)
class Comparison:
    """Friction laws and windows by what they predict."""

    data: dict[str, Any]
    """What ``taut fit --compare --json`` prints."""
    case: Case
    """The case with the chosen law and its estimates."""

    @property
    def chosen(self) -> str:
        """The law and the windows that are chosen, in words."""
        return str(self.data["candidates"][self.data["chosen"]]["name"])

    def __repr__(self) -> str:
        return f"<taut.Comparison {self.data['title']!r}: {self.chosen}>"

    def _repr_html_(self) -> str:
        rows = [(c["name"], c["parameters"], c["held_out_rmse"], c["training_rmse"]) for c in self.data["candidates"]]
        return _html.table(str(self.data["title"]), ("law and windows", "parameters", "held out", "training"), rows)


@dataclass(frozen=True)
class Drift:
    """What single changes make of the errors of a machine."""

    data: dict[str, Any]
    """What ``taut fit --drift --json`` prints."""

    @property
    def changes(self) -> dict[str, float]:
        """The value of each parameter that explains the logs best by itself, the one that explains most first."""
        return {row["name"]: row["to"] for row in self.data["changes"]}

    def __repr__(self) -> str:
        best = next(iter(self.changes.items()), None)
        return f"<taut.Drift {self.data['title']!r}: {'nothing' if best is None else f'{best[0]} to {best[1]:.6g}'}>"

    def _repr_html_(self) -> str:
        rows = [(c["name"], c["from"], c["to"], c["left"]) for c in self.data["changes"]]
        return _html.table(str(self.data["title"]), ("parameter", "from", "to", "left of the squares"), rows)


@dataclass(frozen=True)
class LinearModel:
    """A linear model: dx/dt = A x + B u, y = C x + D u, or x[k+1] = A x[k] + B u[k] where ``dt`` is a sample time."""

    A: NDArray[np.float64]
    B: NDArray[np.float64]
    C: NDArray[np.float64]
    D: NDArray[np.float64]
    dt: float
    """Sample time, s; 0 for continuous time."""
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    units: dict[str, str]
    """Units of inputs and outputs."""

    def to_control(self) -> control.StateSpace:
        """The model as python-control has it, with the names of states, input and outputs."""
        package = needed("control", "control", "to_control()")
        names = {"states": list(self.states), "inputs": list(self.inputs), "outputs": list(self.outputs)}
        return package.ss(self.A, self.B, self.C, self.D, self.dt, **names)


@dataclass(frozen=True)
class Modes:
    """How a stage swings: its equations linearised while everything slides."""

    data: dict[str, Any]
    """What ``taut modes --json`` prints."""
    model: LinearModel
    """In continuous time."""
    discrete: LinearModel | None
    """For the sample time, if one was given."""
    frequency: NDArray[np.float64]
    """Frequencies of the responses, Hz."""
    responses: dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]
    """By output: magnitude (output's unit per input's unit) and phase (degrees)."""

    @property
    def poles(self) -> NDArray[np.complex128]:
        """1/s, the slowest first; an integrator is exactly zero."""
        return np.array([complex(pole["re"], pole["im"]) for pole in self.data["poles"]])

    @property
    def resonances(self) -> list[float]:
        """Hz, at the place that was asked for."""
        return [float(root["frequency_Hz"]) for root in self.data["here"]["resonances"]]

    def to_control(self) -> control.StateSpace:
        """The model as python-control has it: in discrete time if a sample time was given."""
        return (self.discrete or self.model).to_control()

    def __repr__(self) -> str:
        found = ", ".join(f"{frequency:.4g} Hz" for frequency in self.resonances)
        return f"<taut.Modes {self.data['title']!r}: {len(self.poles)} poles, resonances at {found or 'none'}>"

    def _repr_html_(self) -> str:
        rows = [(p["re"], p["im"], p["frequency_Hz"], p["damping_ratio"]) for p in self.data["poles"]]
        head = ("real part, 1/s", "imaginary part, 1/s", "frequency, Hz", "damping ratio")
        return _html.table(f"{self.data['title']}: poles", head, rows)


@dataclass(frozen=True)
class GantryModes:
    """How a gantry swings while everything slides."""

    data: dict[str, Any]
    """What ``taut modes --json`` prints."""

    @property
    def resonances(self) -> list[float]:
        """Undamped frequencies of the elastic modes, Hz, with bridge and cart at zero."""
        return [float(mode["frequency_Hz"]) for mode in self.data["elastic"]]

    @property
    def damping(self) -> list[float | None]:
        """Their damping ratios; None where damping is so strong that not every mode swings."""
        return [mode["damping_ratio"] for mode in self.data["elastic"]]

    @property
    def map(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]] | None:
        """Positions of the bridge and of the cart (m), and the frequencies (Hz) by mode, bridge and cart.

        None where the stiffness does not depend on the place.
        """
        found = self.data["map"]
        if found is None:
            return None
        bridge, cart, hertz = (np.array(found[key]) for key in ("bridge_position_m", "cart_position_m", "elastic_Hz"))
        return bridge, cart, hertz

    def __repr__(self) -> str:
        found = ", ".join(f"{frequency:.4g} Hz" for frequency in self.resonances)
        return f"<taut.GantryModes {self.data['title']!r}: resonances at {found}>"

    def _repr_html_(self) -> str:
        bodies = ("left", "right", "bridge", "cart")
        rows = [
            (mode["frequency_Hz"], mode["damping_ratio"], *(mode["shape_at_belt"].get(body) for body in bodies))
            for mode in self.data["elastic"]
        ]
        head = ("frequency, Hz", "damping ratio", *bodies)
        return _html.table(f"{self.data['title']}: elastic modes", head, rows)
