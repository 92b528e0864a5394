"""Cases: everything needed to repeat a run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol, TypeAlias, overload

from . import _checks, _html, _native
from ._logs import write_log
from ._toml import change
from ._toml import written as toml
from .results import Check, Comparison, Designed, Drift, Fit, FitLog, ForceMap, FrequencyResponses, Learned, LinearModel, Modes, Plans, Shown, Tuned
from .controllers import Controller
from .runs import Run, Runs
from .sweeps import sweep
from .table import Table

if TYPE_CHECKING:
    from distributed import Client

    from .types import Criterion, Excitation, Hold, Law, Method, Part, Real, Solver, SweepDesign, SweepSolver, Target


class OwnController(Protocol):
    """A controller of one's own.

    It may also have ``reset()``, called before a move, and ``limited(given)``, told after each sample what the limit
    left.
    """

    def step(self, seen: _native.Observation, /) -> float:
        """The command, V or A, that follows from what is seen; called once a sample."""
        ...


OneController: TypeAlias = "OwnController | Callable[[float, float], float]"
"""A controller of one's own, or a function of the measured position and the reference, m."""


class Case:
    """A case file: a machine, and what is done with it.

    ``case["cart.mass"]`` reads a value in SI units, ``case["cart.mass"] = "0.6 kg"`` or ``= 0.6`` writes one: by the
    keys of the case file, with comments and layout kept, and checked as the file is. ``case.text`` is the file.
    """

    __slots__ = ("_native",)

    def __init__(self, text: str, path: str | PathLike[str] = "case.toml") -> None:
        """Reads a case from text. ``path`` stands in messages; other files that the text names are found from its
        folder."""
        self._take(_native.Case.from_text(_checks.path(path), _checks.text("text", text), []))

    @classmethod
    def _of(cls, native: _native.Case) -> Case:
        case = Case.__new__(Case)
        case._take(native)
        return case

    def _take(self, native: _native.Case) -> None:
        self._native = native

    @property
    def kind(self) -> str:
        """The kind of machine: ``axis``, ``h-frame``, ``core-xy`` or ``dual-belt``."""
        return self._native.kind

    @property
    def title(self) -> str:
        """The title of the case."""
        return self._native.title

    @property
    def text(self) -> str:
        """The case file: read again, it gives the same case."""
        return self._native.text

    @property
    def path(self) -> str:
        """Where it was read from, or as it was called."""
        return self._native.path

    @property
    def experiments(self) -> list[str]:
        """Names of the experiments whose files could be read."""
        return self._native.experiments

    @property
    def left_out(self) -> dict[str, str]:
        """Experiments of which a file cannot be read, each with the reason; what needs one raises an error."""
        return dict(self._native.left_out)

    @property
    def moves(self) -> list[str]:
        """Names of the moves in closed loop."""
        return self._native.moves

    def __getitem__(self, key: str) -> Any:
        """The value under a key such as ``cart.mass`` or ``experiment.0.until``: quantities in SI units."""
        try:
            return self._native.value(_checks.text("key", key))
        except _native.Error as error:
            raise KeyError(str(error)) from None

    def get(self, key: str, default: Any = None) -> Any:
        """The value under a key, or the default."""
        try:
            return self[key]
        except KeyError:
            return default

    def __contains__(self, key: str) -> bool:
        return self.get(key) is not None

    def __setitem__(self, key: str, value: Any) -> None:
        """Writes a value: a number in SI units, a text with a unit, a list or a dictionary of these."""
        self.update({key: value})

    def update(self, changes: Mapping[str, Any]) -> None:
        """Writes several values, which are checked together."""
        self._take(self._native.changed([change(key, value) for key, value in changes.items()]))

    def changed(self, changes: Mapping[str, Any]) -> Case:
        """Another case with these values; this one stays as it is."""
        return self._of(self._native.changed([change(key, value) for key, value in changes.items()]))

    def copy(self) -> Case:
        """Another case with the same text."""
        return self._of(self._native)

    def save(self, path: str | PathLike[str]) -> None:
        """Writes the text: under a temporary name first, so that nobody sees half of it."""
        self._native.save(_checks.path(path))

    @overload
    def simulate(
        self,
        experiment: str,
        *,
        solver: Solver | None = None,
        tolerance: float | None = None,
        step: float | None = None,
        method: Method | None = None,
    ) -> Run: ...
    @overload
    def simulate(
        self,
        experiment: list[str] | tuple[str, ...] | None = None,
        *,
        solver: Solver | None = None,
        tolerance: float | None = None,
        step: float | None = None,
        method: Method | None = None,
    ) -> Runs: ...
    def simulate(
        self,
        experiment: str | list[str] | tuple[str, ...] | None = None,
        *,
        solver: Solver | None = None,
        tolerance: float | None = None,
        step: float | None = None,
        method: Method | None = None,
    ) -> Run | Runs:
        """Runs one experiment by its name, several, or all.

        ``solver`` is ``exact``, ``general`` (with ``tolerance``) or ``table3`` (with ``step``, s, and ``method``,
        ``rk4`` or ``dp5``); by default the one for this stage.
        """
        one = isinstance(experiment, str)
        names = _checks.names("experiment", [experiment] if isinstance(experiment, str) else experiment)
        how = (_checks.word("solver", solver), _checks.number("tolerance", tolerance), _checks.number("step", step))
        runs = [Run(run) for run in self._native.simulate(names, *how, _checks.word("method", method))]
        return runs[0] if one else Runs(runs)

    def show(self) -> Shown:
        """Quantities that follow from the numbers: moved mass, stiffness, frequencies, largest speed and acceleration,
        safety of the belt."""
        return Shown(self._native.show())

    def check(self) -> Check:
        """How well the logs determine the parameters in [fit], before any fit."""
        return Check(self._native.check())

    def fit(
        self, *, profiles: bool = False, posterior: bool = False, draws: int = 1000, chains: int = 4
    ) -> Fit:
        """Finds the parameters in [fit] from the logs.

        With ``profiles`` it also holds each parameter beside its estimate and fits the others: ``data["profiles"]``.
        With ``posterior`` it also draws from the posterior: ``draws`` of each of ``chains`` chains. Ctrl-C ends it.
        """
        effort = (_checks.whole("draws", draws, 1), _checks.whole("chains", chains, 1))
        native = self._native.fit(effort if posterior else None, bool(profiles))
        drawn = None if native.draws is None else Table(*native.draws)
        return Fit(native.data, self._of(native.case), drawn, [FitLog._of(log) for log in native.logs])

    def frf(
        self,
        *,
        segment: float | None = None,
        period: float | None = None,
        at: float | None = None,
        bridge: float | None = None,
        delay: float | None = None,
    ) -> FrequencyResponses:
        """Frequency responses from the logs, without a model, and stiffness, damping and delay fitted to them.

        ``segment`` is the length of the pieces of Welch's method (s), ``period`` that of a multisine (s); ``at`` is
        where the cart is (m), ``bridge`` where a gantry's bridge is, ``delay`` the time from a sample to its command
        (s, that of the controller unless said). Of a gantry there is a response for each input and output.
        """
        n = _checks.number
        place = n("at", at), n("bridge", bridge)
        return FrequencyResponses(
            self._native.frf(n("segment", segment), n("period", period), *place, n("delay", delay))
        )

    def design(
        self,
        names: Sequence[str] | None = None,
        *,
        inputs: Sequence[Excitation] | None = None,
        drives: Sequence[str] | None = None,
        criterion: Criterion = "d",
        duration: float = 4.0,
        every: float | None = None,
        margin: float = 0.1,
        doubt: float = 0.2,
        model_error: float = 0.01,
        amplitude: float | None = None,
        current: float | None = None,
        travel: float | None = None,
        measured: Mapping[str, float] | None = None,
        verify: int = 4,
        seed: int = 1,
    ) -> Designed:
        """The experiment that determines the named parameters best (those of [fit] unless named) within travel, input
        and current.

        ``inputs`` are those to choose among: ``trapezoid``, ``sweep``, ``chirp``, ``multisine``, ``prbs``; of a gantry
        ``drives`` are what they may drive: a motor by its side, ``bridge``, ``cart`` or ``all``;
        ``criterion`` is ``d`` or ``a``; ``margin`` is the share of each limit that is left free, ``doubt`` that by
        which each parameter may be off and the limits hold; no standard error is below ``model_error`` of the value;
        ``measured`` has quantities with the standard deviations of their noise. On ``verify`` machines, off by up to
        ``doubt``, a log is simulated and fitted. Ctrl-C ends it with the best so far.
        """
        n = _checks.number
        noises = [(_checks.text("measured", name), n(f"measured[{name!r}]", noise) or 0.0) for name, noise in dict(measured or {}).items()]
        data, case = self._native.design(
            _checks.names("names", names),
            (_checks.names("inputs", inputs), _checks.names("drives", drives)),
            _checks.text("criterion", criterion),
            (_checks.given("duration", duration), n("every", every)),
            (_checks.given("margin", margin), _checks.given("doubt", doubt), _checks.given("model_error", model_error)),
            (n("amplitude", amplitude), n("current", current), n("travel", travel)),
            noises,
            _checks.whole("verify", verify, 0, 100_000),
            _checks.whole("seed", seed, 0),
        )
        return Designed(data, self._of(case))

    def tune(
        self,
        *,
        spread: float | None = None,
        corners: bool = False,
        evaluate: bool = False,
        draws: str | PathLike[str] | None = None,
        effort: float = 1.0,
    ) -> Tuned:
        """Finds gains and filters for the case's controller, judged by moves over a family of machines that can exist.

        ``spread`` is by which share parameters may be off (0.1 is 10 %; that of [tune] unless said, 0 for the machine
        of the file alone); with ``corners`` all of them are off at once in the worst directions; ``draws`` is a file of
        draws from the posterior of a fit, of which the machines are taken instead. ``effort`` is how many times as
        long as usual the search may take. With ``evaluate`` nothing is searched for: the gains of the file are judged.
        Ctrl-C ends it.
        """
        data, case = self._native.tune(
            _checks.number("spread", spread),
            bool(corners),
            bool(evaluate),
            None if draws is None else _checks.path(draws),
            _checks.given("effort", effort),
        )
        return Tuned(data, self._of(case))

    def plan(
        self,
        moves: str | Sequence[str] | None = None,
        *,
        speed: float | None = None,
        acceleration: float | None = None,
        jerk: float | None = None,
        reserve: float = 0.1,
    ) -> Plans:
        """Plans the fastest moves that the machine can make: all of the case's, or those of these names.

        ``speed`` (m/s), ``acceleration`` (m/s²) and ``jerk`` (m/s³) are limits besides those of the machine;
        ``reserve`` is the share of voltage and current that is left to the loop. Ctrl-C ends it.
        """
        names = _checks.names("moves", [moves] if isinstance(moves, str) else moves)
        n = _checks.number
        limits = (n("speed", speed), n("acceleration", acceleration), n("jerk", jerk))
        data, case = self._native.plan(names, limits, _checks.given("reserve", reserve))
        return Plans(data, self._of(case))

    def _columns(self, name: str, values: Any, drives: bool) -> list[list[float]]:
        """A column for each drive or sliding part: of an axis the values, of a gantry those of a mapping."""
        keys = self._native.drives if drives else self._native.slides
        if self.kind == "axis":
            return [_checks.column(name, values)]
        if not isinstance(values, Mapping) or set(values) != set(keys):
            raise TypeError(f"{name}: expected a mapping with {', '.join(keys)}")
        return [_checks.column(f"{name}[{key!r}]", values[key]) for key in keys]

    def learn(
        self,
        time: Any,
        position: Any,
        *,
        move: str | None = None,
        added: Any = None,
        encoder: bool = False,
    ) -> Learned:
        """The next feed-forward signal of a repeated move, from the positions (m) at the times (s) of a repetition.

        ``move`` is its name, if the case has several moves. ``added`` is the signal that was added to the command
        meanwhile, a value (V or A) for each sample of the controller: :attr:`Learned.added` of the repetition before.
        ``position`` is that of the cart, or with ``encoder`` the one that the controller measures, along the belt. Of a
        gantry it is a mapping of the positions of ``bridge`` and ``cart``, or of those that the controllers measure by
        their motors (``left``, ``right``), and so is ``added``. Ctrl-C ends it.
        """
        data = self._native.learn(
            _checks.names("move", None if move is None else [_checks.text("move", move)]),
            _checks.column("time", time),
            self._columns("position", position, drives=bool(encoder)),
            None if added is None else self._columns("added", added, drives=True),
            bool(encoder),
        )
        return Learned(data)

    def force_map(self) -> ForceMap:
        """The force that depends on the position of the cart, from logs of slow motion in both directions."""
        data, case = self._native.force_map()
        return ForceMap(data, None if case is None else self._of(case))

    def with_log(
        self,
        name: str,
        log: Any,
        columns: Mapping[str, Any],
        *,
        path: str | PathLike[str] | None = None,
        **settings: Any,
    ) -> Case:
        """Another case with one more experiment, whose log is a DataFrame, a Table or a dictionary of arrays.

        ``columns`` says which column is what, as the table ``log`` of a case file does: ``time`` (s), ``input`` (V or
        A), and what was measured, such as ``drive_angle`` (rad) or ``cart_position`` (m): ``{"time": "t", "input": "u",
        "drive_angle": "phi"}``. ``settings`` are other keys of that table, such as ``hold="linear"``. The log is
        written as CSV to ``path``, where the case finds it from then on; without one, to a folder that is removed when
        Python ends.
        """
        written = write_log(log, None if path is None else _checks.path(path), _checks.text("name", name))
        if not isinstance(columns, Mapping):
            raise TypeError(f"columns: expected a dictionary, found {type(columns).__name__}")
        table = {"file": written, **columns, **settings}
        experiment = f"\n[[experiment]]\nname = {toml(_checks.text('name', name))}\nlog = {toml(table)}\n"
        logged = Case(self.text.rstrip("\n") + "\n" + experiment, self.path)
        logged._native.require(name)
        return logged

    def compare(
        self, laws: Law | Sequence[Law] | None = None, windows: Sequence[float | None] | None = None
    ) -> Comparison:
        """Friction laws and windows by the error on parts of the logs that are held out, and a fit with the best.

        ``laws`` are of ``viscous``, ``coulomb``, ``asymmetric``, ``stribeck``, ``along``, ``force-along``,
        ``force-by-speed`` and ``lugre``, by default the first five; ``windows`` are lengths, s, and None for whole logs.
        """
        names = _checks.names("laws", [laws] if isinstance(laws, str) else laws)
        lengths = None if windows is None else [_checks.number("windows", window) for window in windows]
        data, case = self._native.compare(names, lengths)
        return Comparison(data, self._of(case))

    def drift(self) -> Drift:
        """Which single change of the machine explains the logs best, all else as the case has it."""
        return Drift(self._native.drift())

    def modes(
        self,
        *,
        at: float | None = None,
        bridge: float | None = None,
        speed: float | None = None,
        stuck: Sequence[str] = (),
        sample_time: float | None = None,
        hold: Hold = "zero",
        delay: float = 0.0,
        lowest: float | None = None,
        highest: float | None = None,
    ) -> Modes:
        """Linearises the machine while everything slides: matrices, poles, zeros, frequency responses, resonances.

        ``at`` is where the cart is (m), ``bridge`` where the bridge of a gantry is (m), ``speed`` how fast it slides
        (m/s, 0.1 if not said), ``stuck`` which of ``drive``, ``cart``, ``idler`` (``left``, ``right``, ``cart_pulley``,
        ``bridge``, ``cart`` of a gantry) are held. With ``sample_time`` (s) also a discrete-time model, whose inputs are held
        (``zero``, ``first`` or ``tustin``) and late by ``delay`` (s). ``lowest`` and ``highest`` bound the responses,
        Hz.
        """
        n = _checks.number
        found = self._native.modes(
            n("at", at),
            n("bridge", bridge),
            n("speed", speed),
            _checks.names("stuck", stuck),
            n("sample_time", sample_time),
            _checks.word("hold", hold),
            n("delay", delay),
            n("lowest", lowest),
            n("highest", highest),
        )
        return Modes._of(found, sample_time)

    @overload
    def move(
        self,
        move: str,
        *,
        controller: Controller | OneController | list[OneController] | tuple[OneController, ...] | None = None,
        every: float | None = None,
        delay: float | None = None,
        limit: float | None = None,
        spread: float | None = None,
    ) -> Run: ...
    @overload
    def move(
        self,
        move: list[str] | tuple[str, ...] | None = None,
        *,
        controller: Controller | OneController | list[OneController] | tuple[OneController, ...] | None = None,
        every: float | None = None,
        delay: float | None = None,
        limit: float | None = None,
        spread: float | None = None,
    ) -> Runs: ...
    def move(
        self,
        move: str | list[str] | tuple[str, ...] | None = None,
        *,
        controller: Controller | OneController | list[OneController] | tuple[OneController, ...] | None = None,
        every: float | None = None,
        delay: float | None = None,
        limit: float | None = None,
        spread: float | None = None,
    ) -> Run | Runs:
        """Runs one move in closed loop by its name, several, or all; with the case's controller, or one of your own.

        ``controller`` is a function of the measured position and the reference (m), or an object with ``step(seen)``;
        it returns the command (V or A) and is called once a sample; of a gantry a list of them, one for each drive, each
        of which is given its part of the belt. ``every`` (sample time, s), ``delay`` (from sample to command, s) and
        ``limit`` (of the command) are the case's unless given. What it raises comes out here. A
        :class:`taut.controllers.Controller` replaces that of the case. ``spread`` also tries the case's controller with
        each parameter off by this share.
        """
        if isinstance(controller, Controller):
            case, controller = self.changed({"controller": controller}), None
        else:
            case = self
        if controller is None and (every, delay, limit) != (None, None, None):
            raise TypeError("every, delay and limit go with a controller of your own; the case's are in [controller]")
        if controller is not None and spread is not None:
            raise TypeError("spread goes with the case's own controller")
        names = _checks.names("move", [move] if isinstance(move, str) else move)
        timing = (_checks.number("every", every), _checks.number("delay", delay), _checks.number("limit", limit))
        share = _checks.number("spread", spread)
        runs = [Run(run) for run in case._native.run_moves(names, controller, timing, share)]
        return runs[0] if isinstance(move, str) else Runs(runs)

    def sweep(
        self,
        n: int | None = None,
        *,
        vary: Mapping[str, Any] | None = None,
        design: SweepDesign | None = None,
        seed: int | None = None,
        indices: bool = False,
        interval: str | float | None = None,
        figures: Sequence[str] | None = None,
        solver: SweepSolver | None = None,
        threads: int = 0,
        client: Client | None = None,
        chunk: int | None = None,
    ) -> Table:
        """Runs ``n`` machines with parameters varied; a row of parameters and key figures for each.

        ``vary`` says by how much, ``{"cart.mass": "20 %"}``; ``design`` is ``random``, ``latin-hypercube``, ``sobol``,
        ``grid`` or ``one-at-a-time``; ``interval`` (s) is how far apart the rows are that figures are taken from. All
        of it is told at :func:`taut.sweep`, which this is.
        """
        return sweep(
            self,
            n,
            vary=vary,
            design=design,
            seed=seed,
            indices=indices,
            interval=interval,
            figures=figures,
            solver=solver,
            threads=threads,
            client=client,
            chunk=chunk,
        )

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Case) and (self.text, self.path) == (other.text, other.path)

    def __hash__(self) -> int:
        return hash((self.text, self.path))

    def __reduce__(self) -> tuple[type[Case], tuple[str, str]]:
        return (Case, (self.text, self.path))

    def __repr__(self) -> str:
        done = [*self.experiments, *self.moves]
        return f"<taut.{type(self).__name__} {self.title!r}: {', '.join(done)}>"

    def _repr_html_(self) -> str:
        keys = ("bridge.mass", "cart.mass", "drive_pulley.inertia", "motor.torque_constant", "motor.resistance", "belt.stiffness")
        rows = [(key, self.get(key)) for key in keys if key in self or key != "bridge.mass"]
        done = [("experiment", name) for name in self.experiments] + [("move", name) for name in self.moves]
        return _html.table(self.title, ("key", "SI"), rows + done)


def read(path: str | PathLike[str]) -> Case:
    """Reads a case file."""
    return Case._of(_native.Case.read(_checks.path(path), []))


def show(case: Case | str | PathLike[str]) -> Shown:
    """Quantities that follow from the numbers of a case, or of a case file."""
    return (case if isinstance(case, Case) else read(case)).show()


def export(
    case: Case | str | PathLike[str],
    target: Target,
    out: str | PathLike[str],
    *,
    part: Part | None = None,
    real: Real = "double",
    step: float | None = None,
    at: float | None = None,
    bridge: float | None = None,
    fmi: Literal[2, 3] = 3,
) -> list[Path]:
    """Writes a case, or a case file, for another tool, as ``taut export`` does, and returns the files.

    ``target`` is ``fmu``, ``c``, ``st``, ``matlab``, ``python`` or ``json``. ``out`` names the file where it ends as
    the target's files do, else a folder. ``part`` is ``plant``, ``controller`` or ``both``, ``real`` the numbers of C
    (``float`` or ``double``), ``step`` the step of the plant, s, ``at`` and ``bridge`` the positions of cart and bridge, m,
    for which spans that follow them are held in C, MATLAB and Python, ``fmi`` the version of an FMU: 2 or 3.
    """
    number = _checks.number
    places = (number("at", at), number("bridge", bridge))
    for name, value in (("step", step), ("at", at), ("bridge", bridge)):
        if value is not None and target not in ("c", "matlab", "python"):
            raise ValueError(f"{name}: means nothing to {target!r}; c, matlab and python take it")
    found = case if isinstance(case, Case) else read(case)
    how = (_checks.word("part", part), _checks.text("real", real), number("step", step), *places, _checks.whole("fmi", fmi, 2, 3))
    files, _ = found._native.export(_checks.text("target", target), _checks.path(out), how)
    return [Path(file) for file in files]


def template() -> str:
    """The commented case file that ``taut init`` writes."""
    return _native.template()
