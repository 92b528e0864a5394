"""Many runs with parameters varied: on the threads of this machine, or on many machines by Dask."""

from __future__ import annotations

import json
import os
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from . import _checks, _native
from ._optional import needed
from .table import Table, arrow_table

if TYPE_CHECKING:
    import pyarrow
    from distributed import Client

    from .types import SweepDesign, SweepSolver

    from .case import Case

SECONDS_OF_A_TASK = 2.0
"""How long a task of Dask is to take: long beside what the scheduler needs for it, short beside one's patience."""

TASKS_AHEAD = 4
"""Tasks on their way for each thread of the workers: enough that none waits, few enough that memory stays flat."""


def sweep(
    case: Case,
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
    """Runs ``n`` machines, each with every experiment and move of the case: a row of parameters and key figures for
    each.

    What is not said here is as in [sweep] of the case. ``vary`` says how parameters vary, as ``--vary`` of the command
    line does: ``{"cart.mass": "20 %", "motor.resistance": "normal(0.7 ohm, 0.02 ohm)"}``. ``design`` is ``random``,
    ``latin-hypercube``, ``sobol``, ``grid`` or ``one-at-a-time``, ``seed`` says which draws, ``interval`` (s) how far
    apart the rows are that figures are taken from, ``indices`` makes the runs those that Sobol' indices need.
    ``figures`` are the names of those that are told, ``["peak_cart_speed", "stop_time"]``: others are not sought.
    ``solver="exact"`` runs the machines one by one instead of side by side.

    Row ``i`` depends on the case and ``i`` alone: the result is the same to the last bit with any number of ``threads``
    (0: one for each processor), and on the workers of a ``client`` of Dask, in tasks of ``chunk`` runs. A worker that
    is lost costs time, and no row.
    """
    changed = _planned(case, n, vary, design, seed, indices, interval, figures, solver)
    threads = _checks.whole("threads", threads, 0)
    if client is None:
        if chunk is not None:
            raise TypeError("chunk goes with client: on one machine threads take turns by themselves")
        native = _native.Sweep(changed._native)
        return Table(*native.rows(0, native.runs, threads))
    arrow = needed("pyarrow", "pyarrow", "sweep() on Dask")
    whole = arrow.concat_tables(list(_tables(changed, client, chunk))).combine_chunks()
    names = _native.Sweep(changed._native).names()
    return Table({name: whole.column(heading).to_numpy() for name, _, heading in names}, names)


def sweep_tables(
    case: Case,
    n: int | None = None,
    *,
    vary: Mapping[str, Any] | None = None,
    design: SweepDesign | None = None,
    seed: int | None = None,
    indices: bool = False,
    interval: str | float | None = None,
    figures: Sequence[str] | None = None,
    solver: SweepSolver | None = None,
    client: Client,
    chunk: int | None = None,
) -> Iterator[pyarrow.Table]:
    """The same rows piece by piece in their order, as tables of Arrow: memory stays flat however many runs there
    are."""
    return _tables(_planned(case, n, vary, design, seed, indices, interval, figures, solver), client, chunk)


def kernel(text: str, path: str, runs: pyarrow.Table) -> pyarrow.Table:
    """Arrow in, Arrow out: the rows of the runs whose numbers stand in the column ``run``, in that order.

    ``text`` and ``path`` are those of a case with [sweep]. This is what a worker runs; it keeps the last cases it was
    given.
    """
    arrow = needed("pyarrow", "pyarrow", "the sweep kernel")
    numbers = runs.column("run").to_pylist()
    native = _prepared(text, path)
    tables = [Table(*native.rows(first, count, 1)).to_arrow() for first, count in _stretches(numbers)]
    return arrow.concat_tables(tables) if tables else arrow_table({}, native.names())


@lru_cache(maxsize=4)
def _prepared(text: str, path: str) -> _native.Sweep:
    return _native.Sweep(_native.Case.from_text(path, text, []))


def _stretches(numbers: list[int]) -> list[tuple[int, int]]:
    """Numbers that follow each other, as first and count."""
    stretches: list[tuple[int, int]] = []
    for number in numbers:
        first, count = stretches[-1] if stretches else (number, 0)
        if number == first + count:
            stretches[-1:] = [(first, count + 1)]
        else:
            stretches.append((number, 1))
    return stretches


def _planned(
    case: Case,
    n: int | None,
    vary: Mapping[str, Any] | None,
    design: SweepDesign | None,
    seed: int | None,
    indices: bool,
    interval: str | float | None,
    figures: Sequence[str] | None,
    solver: str | None,
) -> Case:
    """The case with all of it in its text, as the command line does."""
    if not isinstance(getattr(case, "_native", None), _native.Case):
        raise TypeError(f"case: expected a taut.Case, found {type(case).__name__}")
    if not isinstance(vary, (Mapping, type(None))):
        raise TypeError(f"vary: expected a dictionary, found {type(vary).__name__}")
    given = {"runs": n, "design": design, "seed": seed, "interval": interval, "solver": solver}
    given["indices"] = True if indices else None
    changes: dict[str, Any] = {f"sweep.{key}": value for key, value in given.items() if value is not None}
    if figures is not None:
        if isinstance(figures, str) or not isinstance(figures, Sequence):
            raise TypeError(f"figures: expected a list of names, found {type(figures).__name__}")
        changes["sweep.figures"] = [_checks.text("figures", figure) for figure in figures]
    for key, how in (vary or {}).items():
        changes[f"sweep.vary.{json.dumps(_checks.text('vary', key), ensure_ascii=False)}"] = how
    return case.changed(changes) if changes else case


def _tables(case: Case, client: Client, chunk: int | None) -> Iterator[pyarrow.Table]:
    arrow = needed("pyarrow", "pyarrow", "sweep() on Dask")
    if not (hasattr(client, "submit") and hasattr(client, "nthreads")):
        raise TypeError(f"client: expected a Client of Dask, found {type(client).__name__}")
    native = _native.Sweep(case._native)
    size = _chunk(native) if chunk is None else _checks.whole("chunk", chunk, 1)
    text, path = case.text, os.path.abspath(case.path)
    workers: Any = client
    threads = sum(workers.nthreads().values()) or 1
    waiting: deque[Any] = deque()
    starts = iter(range(0, native.runs, size))
    while True:
        while len(waiting) < TASKS_AHEAD * threads and (first := next(starts, None)) is not None:
            numbers = arrow.array(range(first, min(first + size, native.runs)), arrow.uint64())
            runs = arrow.table({"run": numbers})
            waiting.append(client.submit(kernel, text, path, runs, pure=False))
        if not waiting:
            return
        yield waiting.popleft().result()


def _chunk(native: _native.Sweep) -> int:
    """So many runs that a task takes about as long as it should, by a trial."""
    trial = min(20, native.runs)
    native.rows(0, trial, 1)
    begin = time.perf_counter()
    native.rows(0, trial, 1)
    each = max(time.perf_counter() - begin, 1e-9) / max(trial, 1)
    return max(1, min(1_000_000, round(SECONDS_OF_A_TASK / each)))
