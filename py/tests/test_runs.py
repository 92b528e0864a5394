"""Runs: arrays without copies, tables, figures, and what may interrupt them."""

import _thread
import json
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import taut


def test_columns_are_the_memory_that_rust_filled(case):
    run = case.simulate("5 V pulse")
    for (name, _, _), address in zip(run._native.names, run._native.addresses):
        array = run[name]
        assert array.__array_interface__["data"][0] == address
        assert not array.flags.owndata and array.flags.c_contiguous and array.dtype == np.float64
        assert type(array.base).__name__ == "PySliceContainer"
        assert run[name] is array
    # It lives as long as any array of it.
    position = run["cart_position"]
    last = position[-1]
    del run
    assert position[-1] == last


def test_a_run_has_columns_units_and_figures(case):
    run = case.simulate("5 V pulse")
    assert run.rows == 1001 and run.time[1] == 0.001 and run.ending == "complete"
    assert run.units["cart_position"] == "m" and run.units["drive_speed"] == "rad/s"
    assert run["cart_position_m"] is run["cart_position"]
    assert list(run)[:3] == ["time", "voltage", "drive_angle"]
    # Ours, from the README's JSON.
    assert run.metrics["final_cart_position_m"] == run["cart_position"][-1] == 0.05382078557945904
    assert len(run.events) == 15
    assert run.events[0]["part"] == "drive" and run.events[0]["load_unit"] == "N m"
    assert not run.events[0]["by_rounding"] and run.position_error is not None and run.position_error < 1e-9
    with pytest.raises(KeyError, match="there is no column 'speed'; there are time, "):
        run["speed"]


def test_all_runs_are_the_summary(case):
    runs = case.simulate()
    assert [run.name for run in runs] == case.experiments
    assert runs["5 V pulse"] is runs[0]
    told = runs.data["experiments"][0]
    assert told["metrics"] == runs[0].metrics and told["events"] == runs[0].events
    assert runs.data["solver"] == {"name": "exact"}
    json.dumps(runs.data)


def test_solvers_are_chosen_by_name(case):
    exact = case.simulate("5 V pulse")
    general = case.simulate("5 V pulse", solver="general", tolerance=1e-10)
    assert np.abs(exact["cart_position"] - general["cart_position"]).max() < 1e-9
    assert case.simulate(["5 V pulse"], solver="table3", step=1e-3).data["solver"]["step_s"] == 1e-3
    with pytest.raises(taut.Error, match="only the general solver has a tolerance"):
        case.simulate(tolerance=1e-9)
    with pytest.raises(ValueError, match="none of exact, general, table3"):
        case.simulate(solver="euler")
    with pytest.raises(taut.Error, match='there is no experiment "6 V pulse"'):
        case.simulate("6 V pulse")


def test_arrow_has_the_schema_of_our_parquet(case, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    run = case.simulate("5 V pulse")
    run.write(tmp_path / "run.parquet")
    table = run.to_arrow()
    file = parquet.read_table(tmp_path / "run.parquet")
    assert table.schema.names == file.schema.names
    assert table.schema.types == file.schema.types
    ours = {key: value for key, value in file.schema.metadata.items() if key.startswith(b"unit.")}
    assert table.schema.metadata == ours and ours[b"unit.cart_position_m"] == b"m"
    assert not table.schema.field("time_s").nullable and not file.schema.field("time_s").nullable
    assert table.schema.field("cart_speed_m_s").metadata == {b"unit": b"m/s"}
    assert table.equals(file)
    # The same memory here too.
    buffer = table.column("cart_position_m").chunk(0).buffers()[1]
    assert buffer.address == run["cart_position"].__array_interface__["data"][0]


def test_tables_for_pandas_and_polars(case, tmp_path):
    pytest.importorskip("pandas")
    pytest.importorskip("polars")
    run = case.simulate("5 V pulse")
    frame = run.to_pandas()
    assert frame.attrs["units"]["cart_position_m"] == "m"
    assert frame["cart_position_m"].iloc[-1] == run["cart_position"][-1]
    polars = run.to_polars()
    assert polars["cart_position_m"][-1] == run["cart_position"][-1] and polars.shape == (1001, len(run))
    run.write(tmp_path / "run.csv")
    read = np.genfromtxt(tmp_path / "run.csv", delimiter=",", names=True)
    assert np.array_equal(read["cart_position_m"], run["cart_position"])
    with pytest.raises(taut.Error, match=r"allowed: .csv or .parquet"):
        run.write(tmp_path / "run.xlsx")


def test_a_missing_package_is_named():
    code = (
        "import sys; sys.modules['polars'] = None; import taut; "
        "assert 'matplotlib' not in sys.modules and 'pyarrow' not in sys.modules; "
        "taut.Case(taut.template()).simulate('5 V pulse').to_polars()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "to_polars() needs polars; install it with: pip install polars" in done.stderr


def test_plots_and_notebooks(case, tmp_path):
    pytest.importorskip("matplotlib")
    run = case.simulate("5 V pulse")
    run.plot().savefig(tmp_path / "run.png")
    figure = run.plot("cart_speed", "idler_angle_rad", "drive_angle")
    assert [axis.get_ylabel() for axis in figure.axes] == ["m/s", "rad"]
    assert len(figure.axes[1].lines) == 2
    with pytest.raises(KeyError, match="there is no column 'speed'"):
        run.plot("speed")
    assert "final_cart_position_m" in run._repr_html_()
    assert "5 V pulse: complete, 1001 rows, 15 events" in case.simulate()._repr_html_()
    assert repr(run) == "<taut.Run '5 V pulse': 1001 rows, complete, 15 events>"


def long(case):
    """Minutes of computing."""
    shaken = {"sine": "5 V", "frequency": "3 Hz"}
    return case.changed({"experiment.0.until": 500_000, "experiment.0.every": 1, "experiment.0.input": shaken})


def test_ctrl_c_ends_a_long_run(case):
    case = long(case)
    timer = threading.Timer(0.3, _thread.interrupt_main)
    timer.start()
    begin = time.perf_counter()
    with pytest.raises(KeyboardInterrupt):
        case.simulate("5 V pulse")
    assert time.perf_counter() - begin < 60.0


def test_ctrl_c_ends_a_sweep_on_threads(case):
    timer = threading.Timer(0.3, _thread.interrupt_main)
    timer.start()
    begin = time.perf_counter()
    with pytest.raises(KeyboardInterrupt):
        case.sweep(10_000_000, vary={"all": "20 %"}, threads=2)
    assert time.perf_counter() - begin < 60.0


def test_the_lock_of_the_interpreter_is_free_meanwhile(case):
    case = case.changed({"experiment.0.until": 30, "experiment.0.every": 1e-4})
    done, counted = threading.Event(), 0
    thread = threading.Thread(target=lambda: (case.simulate("5 V pulse"), done.set()))
    thread.start()
    while not done.is_set():
        counted += 1
    thread.join()
    # With the lock held this thread would come to count only between experiments.
    assert counted > 1000


def test_runs_in_threads_are_the_same(case):
    alone = case.simulate("5 V pulse")["cart_position"]
    found = []
    threads = [threading.Thread(target=lambda: found.append(case.simulate("5 V pulse"))) for _ in range(8)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert len(found) == 8 and all(np.array_equal(run["cart_position"], alone) for run in found)


def test_a_result_replaces_no_file_that_the_case_reads(tmp_path):
    """A run written as the log of its own case took the place of what was measured."""
    log = tmp_path / "u.csv"
    log.write_text("t,u\n0,5\n0.25,0\n")
    text = taut.template().replace('{ pulse = "5 V", for = "0.25 s" }', '{ file = "u.csv", time = "t", column = "u" }', 1)
    assert "u.csv" in text
    path = tmp_path / "axis.toml"
    path.write_text(text)
    case = taut.read(path)
    run = case.simulate("5 V pulse")
    for write in (run.write, case.save):
        with pytest.raises(taut.Error, match="would replace the file that it is made from"):
            write(log)
    assert log.read_text() == "t,u\n0,5\n0.25,0\n"
    case.save(path)
