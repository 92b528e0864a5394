"""What many runs cost on Dask, and what ten thousand million of them would take: measured, then worked out.

A machine is Table 4 with every parameter within 20 %; a row is its 5 V and 10 V pulses, one second each, figures from rows 1 ms apart.
Measured: rows per second of processor time of one thread; rows per second of two threads and of two worker processes of Dask on
loopback, in turns; bytes of a row in memory, on the wire and in Parquet; what the scheduler and the client need for a task, with tasks
that have nothing to do. The package is the release wheel, installed where this runs, with distributed and pyarrow.
"""

from __future__ import annotations

import io
import pickle
import statistics
import sys
import time
from pathlib import Path

import pyarrow
import pyarrow.parquet
from distributed import Client, LocalCluster

import taut
from taut.sweep import SECONDS_OF_A_TASK, kernel

STAGE = Path(__file__).resolve().parents[1] / "stages" / "sollmann-jouaneh" / "table4.toml"
EXPERIMENTS = ("5 V pulse", "10 V pulse")
VARY = {"all": "20 %"}
SECONDS = 8.0  # of each measurement
TURNS = 5
TASKS = 2000
RUNS = 10**10
CORES = (2, 100, 1000, 10000)


def planned(runs: int) -> taut.Case:
    return taut.read(STAGE).changed({"sweep.runs": runs, 'sweep.vary."all"': VARY["all"]})


def rate_of_a_core() -> float:
    """Rows per second of processor time, one thread."""
    case = planned(100_000_000)
    native = taut._native.Sweep(case._native)
    native.rows(0, 200, 1)
    rates, first = [], 200
    for _ in range(TURNS):
        rows, begin = 0, time.process_time()
        while (spent := time.process_time() - begin) < SECONDS / TURNS:
            native.rows(first, 200, 1)
            rows, first = rows + 200, first + 200
        rates.append(rows / spent)
    return statistics.median(rates)


def side_by_side(client: Client, rows: int) -> tuple[list[float], list[float]]:
    """Seconds for so many rows by two threads, and by two workers of Dask, in turns."""
    case = taut.read(STAGE)
    here, there = [], []
    for turn in range(TURNS):
        begin = time.perf_counter()
        one = case.sweep(rows, vary=VARY, seed=turn, threads=2)
        here.append(time.perf_counter() - begin)
        begin = time.perf_counter()
        other = case.sweep(rows, vary=VARY, seed=turn, client=client, chunk=rows // 16)
        there.append(time.perf_counter() - begin)
        assert one.to_arrow().equals(other.to_arrow()), "the rows differ"
    return here, there


def cost_of_a_task(client: Client) -> float:
    """Seconds that scheduler and client need for a task: tasks of no run, handed out as a sweep does."""
    case = planned(1000)
    none = pyarrow.table({"run": pyarrow.array([], pyarrow.uint64())})
    client.submit(kernel, case.text, case.path, none, pure=False).result()
    costs = []
    for _ in range(TURNS):
        begin, waiting = time.perf_counter(), []
        for _ in range(TASKS // TURNS):
            waiting.append(client.submit(kernel, case.text, case.path, none, pure=False))
            if len(waiting) == 8:
                waiting.pop(0).result()
        [future.result() for future in waiting]
        costs.append((time.perf_counter() - begin) / (TASKS // TURNS))
    return statistics.median(costs)


def bytes_of_a_row() -> tuple[float, float, float]:
    """In memory, on the wire, in Parquet (zstd)."""
    table = planned(20000).sweep().to_arrow()
    file = io.BytesIO()
    pyarrow.parquet.write_table(table, file, compression="zstd")
    rows = table.num_rows
    return table.nbytes / rows, len(pickle.dumps(table, protocol=5)) / rows, file.tell() / rows


def main() -> None:
    assert set(EXPERIMENTS) == set(taut.read(STAGE).experiments), taut.read(STAGE).experiments
    rate = rate_of_a_core()
    memory, wire, parquet = bytes_of_a_row()
    rows = max(16, int(2 * rate * SECONDS / TURNS) // 16 * 16)
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        with Client(cluster) as client:
            client.submit(kernel, planned(1).text, str(STAGE), pyarrow.table({"run": [0]}), pure=False).result()
            here, there = side_by_side(client, rows)
            task = cost_of_a_task(client)
    ratio = statistics.median(b / a for a, b in zip(here, there))
    print(f"Python {sys.version.split()[0]}, taut {taut.__version__}; a row is {len(EXPERIMENTS)} simulations of 1 s")
    print("measured")
    print(f"  rows per second of processor time, one thread    {rate:12.0f}")
    print(f"  two threads, {rows} rows                         {rows / statistics.median(here):12.0f} rows/s")
    print(f"  two workers of Dask, the same rows bit for bit   {rows / statistics.median(there):12.0f} rows/s")
    print(f"  time of Dask over that of threads, 16 tasks      {ratio:12.3f} (median of {TURNS} turns; {', '.join(f'{b / a:.3f}' for a, b in zip(here, there))})")
    print(f"  scheduler, worker and client, a task of no run   {1e3 * task:12.3f} ms")
    print(f"  bytes of a row in memory, on the wire, as zstd   {memory:12.0f} {wire:.0f} {parquet:.0f}")
    print(f"worked out for {RUNS:.0e} rows, in tasks of {SECONDS_OF_A_TASK:g} s")
    chunk = SECONDS_OF_A_TASK * rate
    tasks = RUNS / chunk
    print(f"  processor time                                   {RUNS / rate / 86400:12.1f} days of a core")
    print(f"  rows of a task, tasks, bytes of a task's rows    {chunk:12.0f} {tasks:.0f} {chunk * wire / 1e6:.1f} MB")
    print(f"  scheduler's time for all tasks                   {tasks * task / 3600:12.2f} h")
    print(f"  share of a task that the scheduler adds          {100 * task / SECONDS_OF_A_TASK:12.3f} %")
    print(f"  cores at which one scheduler is busy all the time{SECONDS_OF_A_TASK / task:12.0f}")
    print(f"  all rows in memory and as zstd                   {RUNS * memory / 1e12:12.2f} TB {RUNS * parquet / 1e12:.2f} TB")
    for cores in CORES:
        hours = max(RUNS / rate / cores, tasks * task) / 3600
        print(f"  {cores:>6} cores: {hours:10.1f} h, {cores * rate * wire / 1e6:9.1f} MB/s of rows to the client")


if __name__ == "__main__":
    main()
