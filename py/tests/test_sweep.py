"""Many runs: the same rows on any number of threads, processes and machines."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import taut

VARY = {"all": "20 %", "motor.resistance": "normal(0.7 ohm, 0.02 ohm)"}


def same(one, other):
    """To the last bit, NaN included."""
    assert list(one) == list(other) and one.units == other.units
    for name in one:
        assert np.array_equal(one[name].view(np.uint64), other[name].view(np.uint64)), name


def test_rows_are_the_same_on_any_number_of_threads(case):
    alone = case.sweep(300, vary=VARY, seed=3, threads=1)
    assert alone.rows == 300 and np.array_equal(alone["run"], np.arange(300))
    same(alone, taut.sweep(case, 300, vary=VARY, seed=3, threads=3))
    assert not np.array_equal(alone["cart.mass"], case.sweep(300, vary=VARY, seed=4)["cart.mass"])
    assert alone.units["cart.mass"] == "kg" and alone["cart.mass_kg"] is alone["cart.mass"]
    assert 0.8 * 0.362 <= alone["cart.mass"].min() < 0.85 * 0.362
    # The case is as it was.
    assert case.text == taut.template()


def test_rows_are_the_command_lines(root, tmp_path):
    program = os.environ.get("TAUT_PROGRAM")
    if program is None:
        pytest.skip("TAUT_PROGRAM does not say where the program taut is")
    parquet = pytest.importorskip("pyarrow.parquet")
    stage, file = root / "stages" / "sollmann-jouaneh" / "table4.toml", tmp_path / "runs.parquet"
    options = ["--runs", "200", "--vary", "cart.mass=10%", "--design", "sobol", "--seed", "7", "--out", file, "--quiet"]
    subprocess.run([program, "sweep", stage, *options], check=True)
    table = taut.read(stage).sweep(200, vary={"cart.mass": "10%"}, design="sobol", seed=7).to_arrow()
    theirs = parquet.read_table(file)
    assert theirs.schema.names == table.schema.names
    for name in table.schema.names:
        ours = table.column(name).to_numpy()
        assert np.array_equal(ours.view(np.uint64), theirs.column(name).to_numpy().view(np.uint64)), name
        assert theirs.schema.metadata[f"unit.{name}".encode()] == table.schema.metadata[f"unit.{name}".encode()]


def test_a_row_is_the_run_of_its_machine(case):
    vary = {"cart.mass": "uniform(0.3 kg, 0.5 kg)"}
    table = case.sweep(5, vary=vary, solver="exact")
    metrics = case.changed({"cart.mass": table["cart.mass"][3]}).simulate("5 V pulse").metrics
    assert table["5-v-pulse.final_cart_position"][3] == metrics["final_cart_position_m"]
    # Side by side it is that within 1e-12 m.
    beside = case.sweep(5, vary=vary)
    assert abs(beside["5-v-pulse.final_cart_position"][3] - metrics["final_cart_position_m"]) < 1e-12


def test_figures_are_chosen(case):
    table = case.sweep(4, vary=VARY, figures=["final_cart_position"])
    figures = [name for name in table if name.startswith("5-v-pulse.")]
    assert figures == ["5-v-pulse.status", "5-v-pulse.final_cart_position"]
    whole = case.sweep(4, vary=VARY)
    for name in table:
        assert np.array_equal(table[name].view(np.uint64), whole[name].view(np.uint64)), name
    with pytest.raises(taut.Error, match='nothing that is swept has a figure "final_cart_positon"'):
        case.sweep(4, vary=VARY, figures=["final_cart_positon"])
    with pytest.raises(TypeError, match="figures: expected a list of names, found str"):
        case.sweep(4, vary=VARY, figures="final_cart_position")


def test_the_kernel_takes_any_runs_in_any_order(case):
    arrow = pytest.importorskip("pyarrow")
    from taut.sweeps import _planned, kernel

    planned = _planned(case, 50, VARY, None, None, False, None, None, None)
    whole = taut.sweep(planned).to_arrow()
    numbers = [7, 8, 9, 3, 49, 0]
    some = kernel(planned.text, "axis.toml", arrow.table({"run": numbers}))
    assert some.schema.equals(whole.schema, check_metadata=True)
    assert some.equals(whole.take(numbers))
    none = kernel(planned.text, "axis.toml", arrow.table({"run": arrow.array([], arrow.uint64())}))
    assert none.num_rows == 0 and none.schema.equals(whole.schema)


def test_mistakes_are_told(case):
    with pytest.raises(taut.Error, match="sweep"):
        case.sweep()
    with pytest.raises(taut.Error, match='"weight" is not known|weight'):
        case.sweep(10, vary={"cart.weight": "20%"})
    with pytest.raises(TypeError, match="chunk goes with client"):
        case.sweep(10, vary=VARY, chunk=5)


@pytest.fixture
def cluster(tmp_path):
    """A scheduler and three workers on loopback, each a process of its own: the client, and the workers by address."""
    distributed = pytest.importorskip("distributed")
    file = tmp_path / "scheduler.json"
    dask = [sys.executable, "-m", "dask"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": tmp_path}
    common = ["--scheduler-file", str(file), "--no-dashboard"]
    scheduler = subprocess.Popen([*dask, "scheduler", "--host", "127.0.0.1", "--port", "0", *common], **quiet)
    processes = [scheduler]
    try:
        deadline = time.monotonic() + 60
        while not file.exists() and time.monotonic() < deadline:
            time.sleep(0.1)
        for _ in range(3):
            worker = [*dask, "worker", "--host", "127.0.0.1", "--no-nanny", "--nthreads", "1", *common]
            processes.append(subprocess.Popen(worker, **quiet))
        with distributed.Client(scheduler_file=str(file), timeout=60) as client:
            client.wait_for_workers(3, timeout=60)
            yield client
    finally:
        for process in processes:
            process.kill()
        for process in processes:
            process.wait()


def test_a_killed_worker_costs_no_row(case, cluster):
    # Runs that are long enough to be killed in.
    case["experiment.0.input"] = {"sine": "5 V", "frequency": "3 Hz"}
    case["experiment.0.until"] = 5
    runs, chunk = 600, 20
    local = case.sweep(runs, vary=VARY, seed=5)
    tables = taut.sweep_tables(case, runs, vary=VARY, seed=5, client=cluster, chunk=chunk)
    found = [next(tables), next(tables)]
    # One that has work to do or results that nobody has fetched.
    busy, full = cluster.processing(), cluster.has_what()
    victim = next(address for address in busy if busy[address] or full[address])
    os.kill(cluster.run(os.getpid, workers=[victim])[victim], signal.SIGKILL)
    found.extend(tables)
    assert victim not in cluster.scheduler_info()["workers"]
    assert [table.num_rows for table in found] == [chunk] * (runs // chunk)
    arrow = pytest.importorskip("pyarrow")
    whole = arrow.concat_tables(found)
    assert np.array_equal(whole.column("run").to_numpy(), np.arange(runs))
    assert whole.schema.equals(local.to_arrow().schema, check_metadata=True)
    for name, heading in local.headings.items():
        theirs = whole.column(heading).combine_chunks().to_numpy()
        assert np.array_equal(local[name].view(np.uint64), theirs.view(np.uint64)), name
    # As one table, in tasks of a size that is tried.
    same(local, taut.sweep(case, runs, vary=VARY, seed=5, client=cluster))


def test_numbers_of_laws_and_lists_are_free(case):
    law = "cart.friction.lugre"
    other = case.changed({law: {"stiffness": "100 kN/m", "damping": "190 N s/m", "velocity": "10 mm/s"}})
    vary = {f"{law}.stiffness": [5e4, 2e5], "belt.stiffness.1": "10 %"}
    table = other.changed({"experiment.0.until": "2 ms"}).sweep(4, vary=vary, seed=1)
    assert set(table[f"{law}.stiffness"]) <= {5e4, 2e5} and table.units[f"{law}.stiffness"] == "N/m"
    with pytest.raises(taut.Error, match="has no value in this case"):
        case.sweep(4, vary={f"{law}.stiffness": "20 %"})
    with pytest.raises(taut.Error, match="has no value in this case"):
        case.changed({"fit.free": [f"{law}.stiffness"]})
    assert other.changed({"fit.free": [f"{law}.stiffness"]})["fit.free"] == [f"{law}.stiffness"]
