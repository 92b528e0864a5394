"""The part that is written in Rust."""

from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

__version__: str

class Error(ValueError):
    """A mistake in an input, told as the command line tells it: what, where, what is allowed, what to do next."""

    what: str
    file: str | None
    line: int | None
    column: int | None
    allowed: str | None
    next: str | None

class Bug(RuntimeError):
    """A mistake in taut itself, which no input should bring about; where it happened stands on the standard error."""

class Observation:
    """The knowledge of a controller at a sample. SI units."""

    @property
    def time(self) -> float:
        """Time of the sample, s."""

    @property
    def position(self) -> float:
        """Measured position, m along the belt: whole counts of the encoder."""

    @property
    def scale(self) -> float | None:
        """The cart's position on a scale beside that encoder, m: whole counts; None without a scale."""

    @property
    def current(self) -> float:
        """Measured motor current, A."""

    @property
    def reference(self) -> float:
        """Where the cart should be now, m."""

    @property
    def reference_speed(self) -> float:
        """How fast it should be, m/s."""

    @property
    def reference_acceleration(self) -> float:
        """How much it should accelerate, m/s^2."""

    @property
    def ahead(self) -> float:
        """Where it should be when the command acts, m."""

    @property
    def ahead_speed(self) -> float:
        """How fast it should be then, m/s."""

    @property
    def ahead_acceleration(self) -> float:
        """How much it should accelerate then, m/s^2."""

class Run:
    @property
    def arrays(self) -> dict[str, NDArray[np.float64]]: ...
    @property
    def names(self) -> list[tuple[str, str, str]]: ...
    @property
    def addresses(self) -> list[int]: ...
    @property
    def name(self) -> str: ...
    @property
    def ending(self) -> tuple[str, float]: ...
    @property
    def took(self) -> float: ...
    @property
    def position_error(self) -> float | None: ...
    @property
    def decided_within_rounding(self) -> list[tuple[float, str]]: ...
    @property
    def inputs(self) -> list[str]: ...
    def figures(self) -> Any: ...
    def events(self) -> Any: ...

class Fit:
    @property
    def data(self) -> dict[str, Any]: ...
    @property
    def case(self) -> Case: ...
    @property
    def draws(self) -> tuple[dict[str, NDArray[np.float64]], list[tuple[str, str, str]]] | None: ...
    @property
    def logs(self) -> list[dict[str, Any]]: ...

class Case:
    @staticmethod
    def read(path: str, changes: list[str]) -> Case: ...
    @staticmethod
    def from_text(path: str, text: str, changes: list[str]) -> Case: ...
    def changed(self, changes: list[str]) -> Case: ...
    @property
    def drives(self) -> list[str]: ...
    @property
    def slides(self) -> list[str]: ...
    @property
    def kind(self) -> str: ...
    @property
    def title(self) -> str: ...
    @property
    def text(self) -> str: ...
    @property
    def path(self) -> str: ...
    @property
    def experiments(self) -> list[str]: ...
    @property
    def left_out(self) -> list[tuple[str, str]]: ...
    def require(self, name: str) -> None: ...
    @property
    def moves(self) -> list[str]: ...
    def value(self, key: str) -> Any: ...
    def save(self, path: str | PathLike[str]) -> None: ...
    def simulate(
        self, names: list[str], solver: str | None, tolerance: float | None, step: float | None, method: str | None
    ) -> list[Run]: ...
    def run_moves(
        self,
        names: list[str],
        controller: Any,
        timing: tuple[float | None, float | None, float | None],
        spread: float | None,
    ) -> list[Run]: ...
    def check(self) -> dict[str, Any]: ...
    def fit(self, effort: tuple[int, int] | None, profiled: bool) -> Fit: ...
    def frf(
        self,
        segment: float | None,
        period: float | None,
        at: float | None,
        bridge: float | None,
        delay: float | None,
    ) -> dict[str, Any]: ...
    def design(
        self,
        names: list[str],
        inputs: tuple[list[str], list[str]],
        criterion: str,
        times: tuple[float, float | None],
        shares: tuple[float, float, float],
        limits: tuple[float | None, float | None, float | None],
        measured: list[tuple[str, float]],
        verified: int,
        seed: int,
    ) -> tuple[dict[str, Any], Case]: ...
    def tune(
        self, spread: float | None, corners: bool, judged: bool, draws: str | None, effort: float
    ) -> tuple[dict[str, Any], Case]: ...
    def plan(
        self, names: list[str], limits: tuple[float | None, float | None, float | None], reserve: float
    ) -> tuple[dict[str, Any], Case]: ...
    def learn(
        self,
        names: list[str],
        time: list[float],
        positions: list[list[float]],
        added: list[list[float]] | None,
        encoder: bool,
    ) -> dict[str, Any]: ...
    def force_map(self) -> tuple[dict[str, Any], Case | None]: ...
    def compare(self, laws: list[str], windows: list[float | None] | None) -> tuple[dict[str, Any], Case]: ...
    def drift(self) -> dict[str, Any]: ...
    def modes(
        self,
        at: float | None,
        bridge: float | None,
        speed: float | None,
        stuck: list[str],
        sample_time: float | None,
        hold: str | None,
        delay: float | None,
        lowest: float | None,
        highest: float | None,
        /,
    ) -> dict[str, Any]: ...
    def export(
        self, target: str, out: str, how: tuple[str | None, str, float | None, float | None, float | None, int], /
    ) -> tuple[list[Path], list[str]]: ...
    def show(self) -> dict[str, Any]: ...

class Sweep:
    def __init__(self, case: Case) -> None: ...
    @property
    def runs(self) -> int: ...
    def names(self) -> list[tuple[str, str, str]]: ...
    def rows(
        self, first: int, count: int, threads: int
    ) -> tuple[dict[str, NDArray[np.float64]], list[tuple[str, str, str]]]: ...

def template() -> str: ...
def fail_as_a_bug(told: str) -> None: ...
def simulation(runs: list[Run]) -> Any: ...
def moves(runs: list[Run]) -> Any: ...
def shape(files: list[str], options: dict[str, Any]) -> dict[str, Any]: ...
def write(
    arrays: dict[str, NDArray[np.float64]],
    names: list[tuple[str, str, str]],
    inputs: list[str],
    path: str | PathLike[str],
) -> None: ...
