"""What many runs cost on Dask, and what ten thousand million of them would take: measured, then worked out.

A machine is Table 4 with every parameter within 20 %; a row is its 5 V and 10 V pulses, one second each, figures from
rows 1 ms apart. Measured: rows per second of processor time of one thread; two threads and two worker processes of Dask
on loopback, in turns, by the wall clock and in processor time, which other work on the machine touches less; bytes of a
row in memory, on the wire and in Parquet; what scheduler and client, and a worker, compute for a task, with tasks that
have nothing to do. The package is the release wheel, installed where this runs, with distributed and pyarrow.
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
from taut.sweeps import SECONDS_OF_A_TASK, kernel

STAGE = Path(__file__).resolve().parents[1] / "stages" / "sollmann-jouaneh" / "table4.toml"
EXPERIMENTS = ("5 V pulse", "10 V pulse")
VARY = {"all": "20 %"}
SECONDS = 6.0  # of the measurement of a core
TURNS = 3
TASKS_OF_A_TURN = 4
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


def processor_time(client: Client) -> float:
    """Seconds that this process, which is client and scheduler, and the workers have computed."""
    return time.process_time() + sum(client.run(time.process_time).values())


def side_by_side(client: Client, rows: int, chunk: int) -> list[tuple[float, float, float, float]]:
    """Seconds, and seconds of processor time, for so many rows by two threads, and by two workers of Dask, in turns."""
    case = taut.read(STAGE)
    found = []
    for turn in range(TURNS):
        begin, spent = time.perf_counter(), time.process_time()
        one = case.sweep(rows, vary=VARY, seed=turn, threads=2)
        here = time.perf_counter() - begin, time.process_time() - spent
        begin, spent = time.perf_counter(), processor_time(client)
        other = case.sweep(rows, vary=VARY, seed=turn, client=client, chunk=chunk)
        there = time.perf_counter() - begin, processor_time(client) - spent
        assert one.to_arrow().equals(other.to_arrow()), "the rows differ"
        found.append((*here, *there))
    return found


def idle(client: Client) -> float:
    """Seconds of processor time per second of a cluster that has nothing to do: heartbeats, profiles, clocks."""
    begin, spent = time.perf_counter(), processor_time(client)
    time.sleep(5)
    return (processor_time(client) - spent) / (time.perf_counter() - begin)


def cost_of_a_task(client: Client) -> tuple[float, float]:
    """Seconds of processor time of scheduler and client for a task, and of a worker: tasks of no run, handed out as a
    sweep does."""
    case = planned(1000)
    none = pyarrow.table({"run": pyarrow.array([], pyarrow.uint64())})
    client.submit(kernel, case.text, case.path, none, pure=False).result()
    begin, both, waiting = time.process_time(), processor_time(client), []
    for _ in range(TASKS):
        waiting.append(client.submit(kernel, case.text, case.path, none, pure=False))
        if len(waiting) == 8:
            waiting.pop(0).result()
    [future.result() for future in waiting]
    own = time.process_time() - begin
    return own / TASKS, (processor_time(client) - both - own) / TASKS


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
    chunk = round(SECONDS_OF_A_TASK * rate)
    rows = TASKS_OF_A_TURN * chunk
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        with Client(cluster) as client:
            client.submit(kernel, planned(1).text, str(STAGE), pyarrow.table({"run": [0]}), pure=False).result()
            turns = side_by_side(client, rows, chunk)
            task, worker = cost_of_a_task(client)
            rest = idle(client)
    median = [statistics.median(times) for times in zip(*turns)]
    busy = statistics.median((turn[3] - rest * turn[2]) / turn[1] for turn in turns)
    walls, spent = [[f"{turn[k + 2] / turn[k]:.3f}" for turn in turns] for k in (0, 1)]
    print(f"Python {sys.version.split()[0]}, taut {taut.__version__}; a row is {len(EXPERIMENTS)} simulations of 1 s")
    print(f"measured; {rows} rows in {TASKS_OF_A_TURN} tasks, {TURNS} turns")
    print(f"  rows per second of processor time, one thread      {rate:10.0f}")
    print(f"  rows per second, two threads; as wall clock        {rows / median[0]:10.0f}")
    print(f"  rows per second, two workers of Dask; the same     {rows / median[2]:10.0f}")
    print(f"  Dask's time over that of threads, wall clock       {median[2] / median[0]:10.3f} (turns: {', '.join(walls)})")
    print(f"  Dask's time over that of threads, processor        {median[3] / median[1]:10.3f} (turns: {', '.join(spent)})")
    print(f"  the same without what an idle cluster needs        {busy:10.3f} ({rest:.3f} s per second: scheduler, client, two workers)")
    print(f"  processor time of scheduler and client for a task  {1e3 * task:10.3f} ms")
    print(f"  processor time of a worker for a task of no run    {1e3 * worker:10.3f} ms")
    print(f"  bytes of a row in memory, on the wire, as zstd     {memory:10.0f} {wire:.0f} {parquet:.0f}")
    print(f"worked out for {RUNS:.0e} rows, in tasks of {SECONDS_OF_A_TASK:g} s")
    tasks = RUNS / chunk
    print(f"  processor time of the rows                         {RUNS / rate / 86400:10.1f} days of a core")
    print(f"  rows of a task, tasks, bytes of a task's rows      {chunk:10.0f} {tasks:.0f} {chunk * wire / 1e6:.1f} MB")
    print(f"  scheduler's and client's time for all tasks        {tasks * task / 3600:10.2f} h")
    print(f"  share of a task that Dask adds on all sides        {100 * (task + worker) / SECONDS_OF_A_TASK:10.3f} %")
    print(f"  cores at which one scheduler is busy all the time  {SECONDS_OF_A_TASK / task:10.0f}")
    print(f"  all rows in memory and as zstd                     {RUNS * memory / 1e12:10.2f} TB {RUNS * parquet / 1e12:.2f} TB")
    for cores in CORES:
        hours = max(RUNS / rate / cores, tasks * task) / 3600
        print(f"  {cores:>6} cores: {hours:10.1f} h, {cores * rate * wire / 1e6:9.1f} MB/s of rows to the client")


if __name__ == "__main__":
    main()
