"""Results of checks, fits and linear analyses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _html, _plots
from ._optional import needed
from .table import Table, frame

if TYPE_CHECKING:
    import control
    import pandas
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from .case import Case


@dataclass(frozen=True)
class Check:
    """How well the logs of a case determine its parameters, before any fit."""

    data: dict[str, Any]
    """The output of ``taut check --json``."""

    @property
    def complete(self) -> bool:
        """Whether all free parameters are determined."""
        return bool(self.data["complete"])

    @property
    def errors(self) -> dict[str, float]:
        """Relative standard error of each parameter; infinite if it is not determined."""
        infinite = float("inf")
        return {
            row["name"]: infinite if row["relative_error"] is None else row["relative_error"]
            for row in self.data["parameters"]
        }

    @property
    def not_determined(self) -> list[str]:
        """The combinations that nothing tells apart, in words."""
        return [group["words"] for group in self.data["not_determined"]]

    def to_pandas(self) -> pandas.DataFrame:
        """A pandas.DataFrame of the parameters and their relative standard errors (1 is 100 %)."""
        return frame({"parameter": list(self.errors), "relative_error": list(self.errors.values())})

    def plot(self, *, ax: Axes | None = None) -> Figure:
        """Relative standard error of each parameter, as bars; undetermined ones reach the end of the scale."""
        figure, (axis,) = _plots.panels(ax, 1, height=1 + 0.3 * len(self.errors))
        known = [100 * error for error in self.errors.values() if np.isfinite(error)]
        most = 10 * max(known, default=10.0)
        _plots.bars(axis, list(self.errors), [min(100 * e, most) for e in self.errors.values()], "standard error, % of the value")
        axis.set_xscale("log")
        return figure

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
class FitLog:
    """How a fit meets one log, or one window of it."""

    name: str
    """The experiment's."""
    window: int
    """Which window of it, from 0."""
    held_out: bool
    """Whether none of it was fitted."""
    complete: bool
    """Whether the model reached its end."""
    fitted_rows: int
    """Rows from the first on that were fitted; the others were held out."""
    time: NDArray[np.float64]
    """Times of the rows, s."""
    units: dict[str, str]
    """The unit of each output."""
    measured: dict[str, NDArray[np.float64]]
    """The measured values, by output; NaN where nothing was measured."""
    model: dict[str, NDArray[np.float64]]
    """The values of the fitted model."""

    @classmethod
    def _of(cls, told: dict[str, Any]) -> FitLog:
        outputs = told["outputs"]
        return cls(
            name=told["name"],
            window=told["window"],
            held_out=told["held_out"],
            complete=told["complete"],
            fitted_rows=told["fitted_rows"],
            time=told["time"],
            units={name: unit for name, (unit, _, _) in outputs.items()},
            measured={name: measured for name, (_, measured, _) in outputs.items()},
            model={name: model for name, (_, _, model) in outputs.items()},
        )

    @property
    def residuals(self) -> dict[str, NDArray[np.float64]]:
        """The model minus what was measured, by output."""
        return {name: self.model[name] - self.measured[name] for name in self.measured}

    def to_pandas(self) -> pandas.DataFrame:
        """A pandas.DataFrame: ``time_s``, and of each output what was measured, the model's, and the residual."""
        columns: dict[str, Any] = {"time_s": self.time}
        for name, residual in self.residuals.items():
            columns |= {f"{name}_measured": self.measured[name], f"{name}_model": self.model[name], f"{name}_residual": residual}
        return frame(columns)

    def plot(self, *, ax: Axes | Sequence[Axes] | None = None) -> Figure:
        """Log and model over time, and the residuals below: two panels for each output, or as many ``ax``."""
        figure, axes = _plots.panels(ax, 2 * len(self.measured))
        for k, (name, residual) in enumerate(self.residuals.items()):
            above, below = axes[2 * k : 2 * k + 2]
            above.plot(self.time, self.measured[name], label="log", linewidth=1)
            above.plot(self.time, self.model[name], "--", label="model", linewidth=1)
            below.plot(self.time, residual, label="model − log", linewidth=1)
            label = f"{name.replace('_', ' ')}, {self.units[name]}"
            _plots.finished(above, "", label)
            _plots.finished(below, "time, s", f"residual, {self.units[name]}")
        if ax is None:
            figure.suptitle(self.name)
        return figure

    def __repr__(self) -> str:
        return f"<taut.FitLog {self.name!r}: {len(self.time)} rows of {', '.join(self.measured)}>"


@dataclass(frozen=True)
class Fit:
    """Parameters from logs, and how well they are known."""

    data: dict[str, Any]
    """The output of ``taut fit --json``."""
    case: Case
    """The case with the estimates in it."""
    draws: Table | None
    """Draws from the posterior, if they were asked for: ``chain``, ``draw`` and each parameter."""
    logs: list[FitLog]
    """How each log is met: those that were fitted, then those that were held out."""

    @property
    def residuals(self) -> dict[str, NDArray[np.float64]]:
        """By output, the residuals (model minus measured, SI units) of all rows that were fitted, one log after the
        other."""
        parts: dict[str, list[NDArray[np.float64]]] = {}
        for log in self.logs:
            if not log.held_out:
                for name, residual in log.residuals.items():
                    parts.setdefault(name, []).append(residual[: log.fitted_rows])
        return {name: np.concatenate(each) for name, each in parts.items()}

    def to_pandas(self) -> pandas.DataFrame:
        """A pandas.DataFrame of the estimates: value, standard error, interval, unit, and whether at a bound."""
        each = list(self.estimates.values())
        low, high = ([None if e.interval_95 is None else e.interval_95[k] for e in each] for k in (0, 1))
        return frame(
            {
                "parameter": [e.name for e in each],
                "value": [e.value for e in each],
                "standard_error": [e.standard_error for e in each],
                "low_95": low,
                "high_95": high,
                "unit": [e.unit for e in each],
                "at_bound": [e.at_bound for e in each],
            }
        )

    def plot(self, log: str | int = 0, *, ax: Axes | Sequence[Axes] | None = None) -> Figure:
        """One log beside the model, with the residuals: by its number in ``logs``, or the first of this name."""
        if isinstance(log, str):
            found = next((one for one in self.logs if one.name == log), None)
            if found is None:
                raise KeyError(f"there is no log {log!r}; there are {', '.join(dict.fromkeys(one.name for one in self.logs))}")
            return found.plot(ax=ax)
        return self.logs[log].plot(ax=ax)

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
class Designed:
    """An experiment that was designed, and what it promises."""

    data: dict[str, Any]
    """The output of ``taut design --json``."""
    case: Case
    """The case with the experiment in it."""

    @property
    def toml(self) -> str:
        """The experiment as the case file has it."""
        return str(self.data["toml"])

    @property
    def errors(self) -> dict[str, float | None]:
        """The standard error that is promised of each parameter, SI; None where the experiment does not determine
        it."""
        return {row["name"]: row["standard_error"] for row in self.data["parameters"]}

    def to_pandas(self) -> pandas.DataFrame:
        """A pandas.DataFrame of the parameters: value, standard error, relative error, whether determined."""
        keys = ("name", "unit", "value", "standard_error", "relative_error", "determined", "counts")
        return frame({key: [row[key] for row in self.data["parameters"]] for key in keys})

    def plot(self, *, ax: Axes | None = None) -> Figure:
        """The relative error of the best input of each kind, in per cent."""
        figure, (axis,) = _plots.panels(ax, 1, height=3.0)
        rows = self.data["inputs"]
        axis.barh([row["input"] for row in rows][::-1], [100 * (row["mean_relative_error"] or 0) for row in rows][::-1])
        _plots.finished(axis, f"mean relative error ({self.data['criterion']}), %", "")
        return figure

    def __repr__(self) -> str:
        return f"<taut.Designed {self.data['title']!r}: {self.data['words']}>"

    def _repr_html_(self) -> str:
        rows = [(row["name"], row["value"], row["standard_error"], row["unit"]) for row in self.data["parameters"]]
        return _html.table(self.data["words"], ("parameter", "value", "standard error", "unit"), rows)


@dataclass(frozen=True)
class Tuned:
    """A controller that was tuned or judged, and what its moves come to over a family of machines."""

    data: dict[str, Any]
    """The output of ``taut tune --json``."""
    case: Case
    """The case with the gains that were found."""

    @property
    def verdict(self) -> str:
        """``better``, ``unchanged`` or ``worse`` than the gains of the file."""
        return str(self.data["verdict"])

    @property
    def forced_by(self) -> dict[str, Any] | None:
        """The limit that makes it worse (``limit``, ``mode_Hz``, ``place_m``), where one does."""
        forced: dict[str, Any] | None = self.data["forced_by"]
        return forced

    @property
    def feed_forward(self) -> dict[str, Any] | None:
        """The feed-forward that makes the moves better than the gains alone: ``setting``, the value of
        ``controller.feed_forward``, ``objective``, and ``moves`` (``name``, ``cart_error_m``, ``worst_m``, ``settled``)."""
        ahead: dict[str, Any] | None = self.data["feed_forward"]
        return ahead

    @property
    def least_worse(self) -> dict[str, Any] | None:
        """Where it is worse: of all gains within the limits that were judged, those whose worst figure is worse by least
        (``move``, ``figure``, ``before``, ``after``, ``by`` as a share, ``objective``, ``gains``, ``filters``)."""
        least: dict[str, Any] | None = self.data["least_worse"]
        return least

    @property
    def gains(self) -> dict[str, tuple[float, float, str]]:
        """Of each gain: as the file has it, as it was found, and its unit."""
        return {row["key"]: (row["before"], row["after"], row["unit"]) for row in self.data["gains"]}

    def to_pandas(self) -> pandas.DataFrame:
        """A pandas.DataFrame of the moves: error (m), settling (s) and current (A), as in the file and at worst, before
        and after."""
        rows = []
        for when in ("before", "after"):
            for move in self.data[when]["moves"]:
                worst = move["worst"]
                rows.append(
                    {
                        "gains": when,
                        "move": move["name"],
                        "cart_error_m": move["cart_error"]["peak_m"],
                        "settling_s": move["settling_s"],
                        "rms_current_A": move["rms_current_A"],
                        "worst_cart_error_m": worst["cart_error_m"],
                        "worst_settling_s": worst["settling_s"],
                        "settled": worst["settled"],
                        "of": worst["axes"],
                    }
                )
        return frame({key: [row[key] for row in rows] for key in (rows[0] if rows else {})})

    def plot(self, *, ax: Axes | None = None) -> Figure:
        """The worst cart error of each move over the family, before and after."""
        figure, (axis,) = _plots.panels(ax, 1, height=3.0)
        names = [move["name"] for move in self.data["before"]["moves"]]
        for k, when in enumerate(("before", "after")):
            errors = [1e3 * (move["worst"]["cart_error_m"] or np.nan) for move in self.data[when]["moves"]]
            axis.bar(np.arange(len(errors)) + 0.4 * k - 0.2, errors, 0.4, label=when)
        axis.set_xticks(range(len(names)), names)
        _plots.finished(axis, "", "cart error at worst, mm")
        return figure

    def __repr__(self) -> str:
        gains = ", ".join(f"{key} = {after:.4g} {unit}".strip() for key, (_, after, unit) in self.gains.items())
        return f"<taut.Tuned {self.data['title']!r}, {self.verdict}: {gains}>"

    def _repr_html_(self) -> str:
        rows = [(key, *values) for key, values in self.gains.items()]
        return _html.table(f"{self.data['title']}: {self.verdict}", ("gain", "before", "after", "unit"), rows)


@dataclass(frozen=True)
class Comparison:
    """Friction laws and windows by what they predict."""

    data: dict[str, Any]
    """The output of ``taut fit --compare --json``."""
    case: Case
    """The case with the chosen law and its estimates."""

    @property
    def chosen(self) -> str:
        """The law and the windows that are chosen, in words."""
        return str(self.data["candidates"][self.data["chosen"]]["name"])

    def to_pandas(self) -> pandas.DataFrame:
        """A pandas.DataFrame of laws and windows: parameters, and RMSE on held-out parts and in training."""
        rows = self.data["candidates"]
        return frame({key: [row[key] for row in rows] for key in ("name", "parameters", "held_out_rmse", "training_rmse")})

    def plot(self, *, ax: Axes | None = None) -> Figure:
        """The error on held-out parts and in training, for each law and window."""
        rows = self.data["candidates"]
        figure, (axis,) = _plots.panels(ax, 1, height=1 + 0.35 * len(rows))
        _plots.bars(axis, [row["name"] for row in rows], [row["held_out_rmse"] or np.nan for row in rows], "RMSE")
        axis.plot([row["training_rmse"] or np.nan for row in rows], range(len(rows)), "k|", markersize=12, label="training")
        axis.legend(loc="best", fontsize="small")
        return figure

    def __repr__(self) -> str:
        return f"<taut.Comparison {self.data['title']!r}: {self.chosen}>"

    def _repr_html_(self) -> str:
        rows = [(c["name"], c["parameters"], c["held_out_rmse"], c["training_rmse"]) for c in self.data["candidates"]]
        return _html.table(str(self.data["title"]), ("law and windows", "parameters", "held out", "training"), rows)


@dataclass(frozen=True)
class Drift:
    """The errors of a machine after single changes."""

    data: dict[str, Any]
    """The output of ``taut fit --drift --json``."""

    @property
    def changes(self) -> dict[str, float]:
        """The value of each parameter that explains the logs best by itself: those that act alike first."""
        return {row["name"]: row["to"] for row in self.data["changes"]}

    def to_pandas(self) -> pandas.DataFrame:
        """A pandas.DataFrame of single changes: parameter, from, to, and the share of the squares that is left."""
        rows = self.data["changes"]
        return frame({key: [row[key] for row in rows] for key in ("name", "from", "to", "left")})

    def plot(self, *, ax: Axes | None = None) -> Figure:
        """The share of the squares that each single change leaves."""
        rows = self.data["changes"]
        figure, (axis,) = _plots.panels(ax, 1, height=1 + 0.35 * len(rows))
        _plots.bars(axis, [row["name"] for row in rows], [100 * row["left"] for row in rows], "squares that are left, %")
        return figure

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


def _together(
    states: int,
    models: Sequence[tuple[NDArray[np.float64], ...]],
    names: Sequence[Sequence[str]],
    inputs: Sequence[str],
) -> tuple[tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]], tuple[str, ...]]:
    """A, B, C, D of one machine from those of each of its inputs, which have the machine's states first and then
    inputs of their own that are on their way; and the names of all states."""
    late = [a.shape[0] - states for a, *_ in models]
    size = states + sum(late)
    first = models[0]
    A, B = np.zeros((size, size)), np.zeros((size, len(models)))
    C = np.zeros((first[2].shape[0], size))
    A[:states, :states], C[:, :states] = first[0][:states, :states], first[2][:, :states]
    place, every = states, list(names[0][:states])
    for k, (a, b, c, _) in enumerate(models):
        own = slice(place, place + late[k])
        A[:states, own], A[own, own], C[:, own] = a[:states, states:], a[states:, states:], c[:, states:]
        B[:states, k], B[own, k] = b[:states, 0], b[states:, 0]
        every += [f"{inputs[k]}_{name}" if len(models) > 1 else name for name in names[k][states:]]
        place += late[k]
    return (A, B, C, np.hstack([d for *_, d in models])), tuple(every)


Response = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Magnitude (output's unit per input's unit) and phase (degrees)."""


@dataclass(frozen=True)
class Modes:
    """How a machine swings: its equations linearised while everything slides."""

    data: dict[str, Any]
    """The output of ``taut modes --json``."""
    model: LinearModel
    """In continuous time, with an input for each drive."""
    discrete: LinearModel | None
    """For the sample time, if one was given."""
    frequency: NDArray[np.float64]
    """Frequencies of the responses, Hz."""
    by_input: dict[str, dict[str, Response]]
    """By input, then by output."""

    @classmethod
    def _of(cls, found: dict[str, Any], sample_time: float | None) -> Modes:
        data = found["data"]
        inputs, outputs, states = (tuple(row["name"] for row in data[key]) for key in ("inputs", "outputs", "states"))
        units = {row["name"]: row["unit"] for row in [*data["inputs"], *data["outputs"]]}
        a, b, c, d = found["continuous"]
        model = LinearModel(a, b, c, d, 0.0, states, inputs, outputs, units)
        discrete = None
        if sample_time is not None:
            names = [one["discrete"]["states"] for one in data["inputs"]]
            (a, b, c, d), every = _together(len(states), found["discrete"], names, inputs)
            discrete = LinearModel(a, b, c, d, float(sample_time), every, inputs, outputs, units)
        return cls(data, model, discrete, found["frequency"], found["responses"])

    @property
    def responses(self) -> dict[str, Response]:
        """Of the first input, by output."""
        return next(iter(self.by_input.values()))

    @property
    def poles(self) -> NDArray[np.complex128]:
        """1/s, the slowest first; an integrator is exactly zero."""
        return np.array([complex(pole["re"], pole["im"]) for pole in self.data["poles"]])

    @property
    def resonances(self) -> list[float]:
        """Natural frequencies of the pole pairs, Hz, at the place that was asked for."""
        return [float(root["frequency_Hz"]) for root in self.data["here"]["resonances"]]

    @property
    def damping(self) -> list[float]:
        """The damping ratios of the resonances."""
        return [float(root["damping_ratio"]) for root in self.data["here"]["resonances"]]

    @property
    def shapes(self) -> pandas.DataFrame:
        """A pandas.DataFrame of the elastic modes: frequency without damping (Hz), damping ratio, and how far each body
        moves at the belt. Empty where a body is held."""
        rows = self.data["elastic"] or []
        bodies = list(dict.fromkeys(body for row in rows for body in row["shape_at_belt"]))
        columns = {key: [row[key] for row in rows] for key in ("frequency_Hz", "damping_ratio")}
        return frame(columns | {body: [row["shape_at_belt"].get(body) for row in rows] for body in bodies})

    @property
    def map(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]] | None:
        """Positions of the bridge and of the cart (m), and the frequencies (Hz) by mode, bridge and cart.

        None for an axis, and where the stiffness does not depend on the place.
        """
        found = self.data["map"]
        if found is None:
            return None
        bridge, cart, hertz = (np.array(found[key]) for key in ("bridge_position_m", "cart_position_m", "elastic_Hz"))
        return bridge, cart, hertz

    def to_control(self) -> control.StateSpace:
        """The model as python-control has it: in discrete time if a sample time was given."""
        return (self.discrete or self.model).to_control()

    def to_pandas(self) -> pandas.DataFrame:
        """A pandas.DataFrame of the responses: ``frequency_Hz``, and magnitude and phase (degrees) of each output. With
        several inputs each column begins with the name of its own."""
        columns: dict[str, Any] = {"frequency_Hz": self.frequency}
        for given, responses in self.by_input.items():
            of = f"{given}_to_" if len(self.by_input) > 1 else ""
            for name, (magnitude, phase) in responses.items():
                columns |= {f"{of}{name}_magnitude": magnitude, f"{of}{name}_phase_deg": phase}
        return frame(columns)

    def plot(
        self, output: str | None = None, *, input: str | None = None, ax: Axes | Sequence[Axes] | None = None
    ) -> Figure:
        """Bode diagram of one output (the first unless said) and input (the first unless said): magnitude above, phase
        below, or both into two ``ax``."""
        given = self.model.inputs[0] if input is None else input
        if given not in self.by_input:
            raise KeyError(f"there is no input {given!r}; there are {', '.join(self.by_input)}")
        responses = self.by_input[given]
        name = next(iter(responses)) if output is None else output
        if name not in responses:
            raise KeyError(f"there is no output {name!r}; there are {', '.join(responses)}")
        magnitude, phase = responses[name]
        figure, (above, below) = _plots.panels(ax, 2)
        above.loglog(self.frequency, magnitude, linewidth=1)
        below.semilogx(self.frequency, phase, linewidth=1)
        _plots.finished(above, "", f"{name.replace('_', ' ')}, {self.model.units[name]}/{self.model.units[given]}")
        _plots.finished(below, "frequency, Hz", "phase, °")
        return figure

    def plot_map(self, mode: int = 0, *, ax: Axes | None = None) -> Figure:
        """Frequency without damping of an elastic mode over the working area; where it is the same everywhere, all modes as
        bars."""
        figure, (axis,) = _plots.panels(ax, 1, height=3.0)
        area, shown = self.map, [float(row["frequency_Hz"]) for row in self.data["elastic"] or []]
        if area is None:
            _plots.bars(axis, [f"mode {k}" for k in range(len(shown))], shown, "frequency, Hz")
            return figure
        bridge, cart, hertz = area
        filled = axis.contourf(1e3 * bridge, 1e3 * cart, hertz[mode].T, levels=20)
        figure.colorbar(filled, ax=axis, label="frequency, Hz")
        _plots.finished(axis, "bridge, mm", "cart, mm")
        return figure

    def __repr__(self) -> str:
        found = ", ".join(f"{frequency:.4g} Hz" for frequency in self.resonances)
        return f"<taut.Modes {self.data['title']!r}: {len(self.poles)} poles, resonances at {found or 'none'}>"

    def _repr_html_(self) -> str:
        rows = [(p["re"], p["im"], p["frequency_Hz"], p["damping_ratio"]) for p in self.data["poles"]]
        head = ("real part, 1/s", "imaginary part, 1/s", "frequency, Hz", "damping ratio")
        return _html.table(f"{self.data['title']}: poles", head, rows)


@dataclass(frozen=True)
class Shown:
    """Quantities that follow from the numbers of a case: ``shown["total_mass"]`` is a value in SI units."""

    data: dict[str, Any]
    """The output of ``taut show --json``."""

    @property
    def rows(self) -> dict[str, tuple[float, str]]:
        """Value and SI unit of each quantity, by its key."""
        return {row["key"]: (row["value"], row["unit"]) for group in self.data["groups"] for row in group["rows"]}

    @property
    def notes(self) -> dict[str, str]:
        """Notes on the result, each by a word for programs."""
        return {note["code"]: note["text"] for note in self.data["notes"]}

    def __getitem__(self, key: str) -> float:
        """The value of a quantity, in SI units."""
        return self.rows[key][0]

    def __contains__(self, key: str) -> bool:
        return key in self.rows

    def to_pandas(self) -> pandas.DataFrame:
        """A pandas.DataFrame of all quantities: key, name, value and SI unit."""
        rows = [row for group in self.data["groups"] for row in group["rows"]]
        return frame({key: [row[key] for row in rows] for key in ("key", "name", "value", "unit")})

    def plot(self, *, ax: Axes | None = None) -> Figure:
        """Natural frequencies at each place along the travel, without damping."""
        figure, (axis,) = _plots.panels(ax, 1, height=3.0)
        places = self.data["places"]
        for k in range(min((len(place["resonances"]) for place in places), default=0)):
            hertz = [place["resonances"][k]["frequency_Hz"] for place in places]
            axis.plot([1e3 * place["position_m"][0] for place in places], hertz, ".-", label=f"resonance {k + 1}")
        _plots.finished(axis, "position, mm", "frequency, Hz")
        return figure

    def __repr__(self) -> str:
        return f"<taut.Shown {self.data['title']!r}: {', '.join(self.rows)}>"

    def _repr_html_(self) -> str:
        rows = [(row["name"], row["value"], row["unit"]) for group in self.data["groups"] for row in group["rows"]]
        return _html.table(self.data["title"], ("quantity", "value", "unit"), rows)


@dataclass(frozen=True)
class Plans:
    """Planned moves."""

    data: dict[str, Any]
    """The output of ``taut plan --json``."""
    case: Case
    """The case with the planned limits."""

    def arrivals(self) -> dict[str, tuple[float | None, float | None]]:
        """Of each move: when the cart of the slowest axis stays in its window, planned and with the limits of the file,
        s; None where one does not."""
        return {
            move["name"]: (move["arrival"]["in_window_worst_s"], move["given"]["arrival"]["in_window_worst_s"])
            for move in self.data["moves"]
        }

    def to_pandas(self) -> pandas.DataFrame:
        """A pandas.DataFrame with a row for each plan that was tried."""
        rows = [
            {"move": move["name"], **one["limits"], "share": one["share"], **one["arrival"]}
            for move in self.data["moves"]
            for one in move["tried"]
        ]
        return frame({key: [row[key] for row in rows] for key in rows[0]} if rows else {})

    def __repr__(self) -> str:
        return f"<taut.Plans {self.data['title']!r}: {', '.join(move['name'] for move in self.data['moves'])}>"

    def _repr_html_(self) -> str:
        rows = [(name, *times) for name, times in self.arrivals().items()]
        return _html.table(self.data["title"], ("move", "planned, s", "file, s"), rows)


@dataclass(frozen=True)
class Learned:
    """What was learned of a repeated move."""

    data: dict[str, Any]
    """The output of ``taut learn --json``."""

    @property
    def added(self) -> Any:
        """The signal to add to the command of the next repetition, V or A: a value for each sample of the controller. Of
        a gantry a mapping with the signal of each motor."""
        signals = {one["name"]: np.array(one["added"], dtype=np.float64) for one in self.data["drives"]}
        return signals if len(signals) > 1 else next(iter(signals.values()))

    @property
    def times(self) -> NDArray[np.float64]:
        """The times of :attr:`added` from the beginning of the move on, s."""
        count = len(self.data["drives"][0]["added"])
        return np.arange(count, dtype=np.float64) * np.float64(self.data["every_s"])

    def to_pandas(self) -> pandas.DataFrame:
        """A pandas.DataFrame of time, signal of the log and next one, error of the log and expected next one (m); of a
        gantry with the motor, ``bridge`` or ``cart`` before each name."""
        columns: dict[str, Any] = {"time_s": self.times}
        for group, names in (("drives", ("added_before", "added")), ("loads", ("error_m", "expected_m"))):
            for one in self.data[group]:
                prefix = f"{one['name']}_" if len(self.data["drives"]) > 1 else ""
                columns.update({prefix + name: one[name] for name in names})
        return frame(columns)

    def __repr__(self) -> str:
        return f"<taut.Learned {self.data['title']!r}: {self.data['move']}>"

    def _repr_html_(self) -> str:
        rows = [
            (k + 1, load["name"], one["nominal"]["rms_m"], one["worst"]["rms_m"])
            for load in self.data["loads"]
            for k, one in enumerate(load["predicted"])
        ]
        columns = ("repetition", "of the", "error on the machine of the file, m", "at worst, m")
        return _html.table(self.data["title"], columns, rows)


@dataclass(frozen=True)
class ForceMap:
    """A force along the travel."""

    data: dict[str, Any]
    """The output of ``taut learn --map --json``."""

    case: Case | None
    """The case with the map in ``cart.force_along``; None if no force along the travel is significant."""

    def to_pandas(self) -> pandas.DataFrame:
        """A pandas.DataFrame with a row for each point: position, force, its 95 % band, and the means of the passes in
        each direction."""
        names = ("position_m", "force_N", "low_N", "high_N", "forward_N", "backward_N")
        return frame({name: self.data[name] for name in names})

    def __repr__(self) -> str:
        return f"<taut.ForceMap {self.data['title']!r}: {len(self.data['position_m'])} points>"

    def _repr_html_(self) -> str:
        rows = [
            (" or ".join(origin["words"] for origin in one["origins"]), one["period_m"], one["amplitude_N"])
            for one in self.data["components"]
        ]
        return _html.table(self.data["title"], ("component", "period, m", "amplitude, N"), rows)


@dataclass(frozen=True)
class FrequencyResponses:
    """Frequency responses from logs."""

    data: dict[str, Any]
    """The output of ``taut frf --json``."""

    @property
    def stiffness(self) -> tuple[float, tuple[float, float]] | None:
        """The factor on the stiffness of the case's belt with its 95 % interval; None where the responses do not tell
        it."""
        fit = self.data["fit"]
        return None if fit is None else (fit["stiffness"]["value"], tuple(fit["stiffness"]["interval"]))

    def to_pandas(self) -> pandas.DataFrame:
        """A pandas.DataFrame with a row for each frequency of each response; ``real`` and ``imaginary`` are output per
        V or A."""
        columns: dict[str, list[Any]] = {}
        for one in self.data["responses"]:
            count = len(one["frequency_Hz"])
            for name in ("log", "input", "quantity"):
                columns.setdefault(name, []).extend([one[name]] * count)
            for name in ("frequency_Hz", "real", "imaginary", "radius", "coherence"):
                columns.setdefault(name, []).extend(one[name])
        return frame(columns)

    def response(self, number: int = 0) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
        """Frequencies (Hz) and complex values of a response, by its number."""
        one = self.data["responses"][number]
        return np.array(one["frequency_Hz"]), np.array(one["real"]) + 1j * np.array(one["imaginary"])

    def plot(self, response: int = 0, *, ax: Axes | Sequence[Axes] | None = None) -> Figure:
        """Magnitude and coherence of a response over frequency, by its number."""
        one = self.data["responses"][response]
        hertz, values = self.response(response)
        figure, (above, below) = _plots.panels(ax, 2)
        above.loglog(hertz, abs(values), ".", markersize=3)
        below.semilogx(hertz, one["coherence"], linewidth=1)
        _plots.finished(above, "", f"magnitude of {one['quantity'].replace('_', ' ')}")
        _plots.finished(below, "frequency, Hz", "coherence")
        return figure

    def __repr__(self) -> str:
        several = len({one["input"] for one in self.data["responses"]}) > 1
        name = "{log}: {input} to {quantity}" if several else "{log}: {quantity}"
        told = ", ".join(name.format(**one) for one in self.data["responses"])
        return f"<taut.FrequencyResponses {self.data['title']!r}: {told}>"

    def _repr_html_(self) -> str:
        rows = [(one["log"], one["input"], one["quantity"], len(one["frequency_Hz"])) for one in self.data["responses"]]
        return _html.table(str(self.data["title"]), ("log", "input", "quantity", "frequencies"), rows)
