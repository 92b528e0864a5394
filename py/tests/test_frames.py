"""Results in notebooks, in pandas, in matplotlib, and pickled."""

import copy
import pickle

import numpy as np
import pytest

import taut

STAGE = "stages/sollmann-jouaneh"


@pytest.fixture
def moving(root):
    return taut.read(root / STAGE / "controllers" / "pid.toml")


def test_figures_show_themselves_in_a_notebook(case):
    pytest.importorskip("matplotlib")
    # A figure without pyplot is not known to notebooks that have not imported it: it has to bring its own picture.
    assert case.simulate("5 V pulse").plot()._repr_png_().startswith(b"\x89PNG")


def test_every_result_plots_into_axes_of_ones_own(case, root, moving):
    figures = pytest.importorskip("matplotlib.figure")
    runs = case.simulate()
    fit = taut.read(root / STAGE / "identification" / "linear-5v.toml")
    found, gantry = fit.fit(), taut.read(root / "stages/core-xy/core-xy.toml").modes()
    sweep = case.sweep(20, vary={"cart.mass": "20 %"})
    plots = [
        (1, lambda ax: runs[0].plot("cart_speed", ax=ax)),
        (3, lambda ax: runs[0].plot(ax=ax)),
        (1, lambda ax: sweep.plot("cart.mass", ax=ax)),
        (1, lambda ax: sweep.plot("cart.mass", "5-v-pulse.final_cart_position", ax=ax)),
        (1, lambda ax: fit.check().plot(ax=ax)),
        (2, lambda ax: found.plot(ax=ax)),
        (2, lambda ax: found.logs[0].plot(ax=ax)),
        (2, lambda ax: case.modes().plot("cart_position", ax=ax)),
        (1, lambda ax: gantry.plot_map(ax=ax)),
        (2, lambda ax: gantry.plot("bridge_position", input="right_voltage_command", ax=ax)),
        (1, lambda ax: moving.tune(evaluate=True).plot(ax=ax)),
        (1, lambda ax: case.show().plot(ax=ax)),
        (1, lambda ax: case.design(["cart.mass"], inputs=["trapezoid"], duration=0.5).plot(ax=ax)),
        (1, lambda ax: taut.shape(root / "stages/printer-axis/printer-axis.toml").plot(ax=ax)),
        (1, lambda ax: fit.compare("viscous").plot(ax=ax)),
    ]
    for count, plot in plots:
        figure = figures.Figure()
        axes = figure.subplots(count, 1, squeeze=False)[:, 0]
        assert plot(list(axes) if count > 1 else axes[0]) is figure
        assert all(axis.has_data() for axis in axes), plot
        assert plot(None)._repr_png_()
    assert len(runs.plot().axes[0].get_lines()) == 2
    with pytest.raises(ValueError, match="this plot has 3 panels, and 1 axes were given"):
        runs[0].plot(ax=figures.Figure().subplots())
    with pytest.raises(TypeError, match="ax: Axes of matplotlib are wanted, and no str"):
        runs[0].plot(ax="cart_speed")
    with pytest.raises(KeyError, match="there is no output 'speed'"):
        case.modes().plot("speed")
    with pytest.raises(KeyError, match="there is no log '7 V'"):
        found.plot("7 V")
    with pytest.raises(TypeError, match="one column for a histogram, or two for points"):
        sweep.plot()


def test_every_result_goes_to_pandas(case, root, moving):
    pytest.importorskip("pandas")
    fit = taut.read(root / STAGE / "identification" / "linear-5v.toml")
    found, tuned, gantry = fit.fit(), moving.tune(evaluate=True), taut.read(root / "stages/core-xy/core-xy.toml").modes()
    assert list(fit.check().to_pandas()["parameter"]) == list(found.estimates)
    frame = found.to_pandas().set_index("parameter")
    assert all(frame.loc[name, "value"] == estimate.value for name, estimate in found.estimates.items())
    assert case.modes().to_pandas().shape[0] == len(case.modes().frequency)
    assert list(gantry.shapes["frequency_Hz"]) == [mode["frequency_Hz"] for mode in gantry.data["elastic"]]
    assert "right_voltage_command_to_cart_speed_phase_deg" in gantry.to_pandas()
    assert list(tuned.to_pandas()["gains"].unique()) == ["before", "after"]
    assert dict(zip(*case.show().to_pandas()[["key", "value"]].to_dict("list").values())) == {
        key: value for key, (value, _) in case.show().rows.items()
    }
    assert len(fit.compare("viscous").to_pandas()) == len(fit.compare("viscous").data["candidates"])
    runs = case.simulate()
    joined = runs.to_pandas()
    assert joined.shape[0] == sum(run.rows for run in runs)
    assert joined.loc["5 V pulse"]["cart_position_m"].iloc[-1] == runs["5 V pulse"]["cart_position"][-1]


def test_a_design_is_that_of_the_program(case, root, tmp_path):
    from test_results import program

    case.save(tmp_path / "axis.toml")
    told = program(root, "design", str(tmp_path / "axis.toml"), "--for", "cart.mass", "--input", "trapezoid", "--duration", "0.5")
    designed = taut.read(tmp_path / "axis.toml").design(["cart.mass"], inputs=["trapezoid"], duration=0.5)
    assert designed.data == told
    assert designed.toml in designed.case.text and "designed" in designed.case.experiments
    assert 0 < designed.errors["cart.mass"] < 0.01
    assert list(designed.to_pandas()["name"]) == ["cart.mass"] and "cart.mass" in designed._repr_html_()


def test_a_fit_has_its_samples_and_residuals(root):
    found = taut.read(root / STAGE / "identification" / "linear-5v.toml").fit()
    log = found.logs[0]
    assert log.units == {"drive_angle": "rad"} and len(log.time) == len(log.measured["drive_angle"])
    residual = log.residuals["drive_angle"]
    assert np.array_equal(residual, log.model["drive_angle"] - log.measured["drive_angle"])
    rmse = float(np.sqrt(np.mean(found.residuals["drive_angle"] ** 2)))
    told = [output for log in found.data["logs"] for output in log["outputs"]]
    assert rmse == pytest.approx(told[0]["fitted"]["rmse"], rel=1e-9)


def test_a_move_has_the_figures_of_its_loop(moving):
    run = moving.move(moving.moves[0])
    told = moving.move().data["moves"][0]
    for key in ("cart_error", "settling_s", "overshoot_m", "rms_current_A", "limited_samples", "window_m"):
        assert run.metrics[key] == told[key]
    # And still those of any run.
    assert run.metrics["final_cart_position_m"] == run["cart_position"][-1]


def test_runs_pickle(case, moving, tmp_path):
    for run in (case.simulate("5 V pulse"), moving.move(moving.moves[0])):
        for again in (pickle.loads(pickle.dumps(run)), copy.deepcopy(run)):
            assert repr(again) == repr(run) and again.units == run.units
            assert all(np.array_equal(again[name], run[name], equal_nan=True) for name in run)
            assert again.metrics == run.metrics and again.events == run.events
            assert (again.took, again.position_error) == (run.took, run.position_error)
            assert not again.time.flags.writeable
        run.write(tmp_path / "run.csv")
        again.write(tmp_path / "again.csv")
        assert (tmp_path / "again.csv").read_bytes() == (tmp_path / "run.csv").read_bytes()
    runs = case.simulate()
    assert pickle.loads(pickle.dumps(runs)).data == runs.data


@pytest.mark.parametrize("kind", ["pandas", "polars", "arrow", "run", "dict"])
def test_a_log_in_memory_is_fitted_as_its_file_is(case, kind, tmp_path):
    run = case.simulate("5 V pulse")
    if kind != "run" and kind != "dict":
        pytest.importorskip("pyarrow" if kind == "arrow" else kind)
    log = {
        "pandas": lambda: run.to_pandas(),
        "polars": lambda: run.to_polars(),
        "arrow": lambda: run.to_arrow(),
        "run": lambda: run,
        "dict": lambda: {heading: run[name] for name, heading in run.headings.items()},
    }[kind]()
    columns = {"time": "time_s", "input": "voltage_V", "drive_angle": "drive_angle_rad"}
    path = None if kind == "dict" else tmp_path / "log.csv"
    logged = case.with_log("logged", log, columns, path=path)
    assert logged.experiments == [*case.experiments, "logged"] and case.experiments != logged.experiments
    run.write(tmp_path / "file.csv")
    text = case.text + f"""
[[experiment]]
name = "logged"
log  = {{ file = {str(tmp_path / "file.csv")!r}, time = "time_s", input = "voltage_V", drive_angle = "drive_angle_rad" }}
"""
    free = '\n[fit]\nfree = ["cart.friction.viscous"]\n'
    one, other = (taut.Case(each + free, "axis.toml").fit() for each in (text, logged.text))
    assert one["cart.friction.viscous"] == other["cart.friction.viscous"]
    assert pickle.loads(pickle.dumps(logged)) == logged


def test_what_is_no_log_is_told(case, tmp_path):
    columns = {"time": "t", "input": "u", "drive_angle": "phi"}
    with pytest.raises(TypeError, match="expected a DataFrame, a Table or a dictionary of arrays, found int"):
        case.with_log("logged", 3, columns)
    with pytest.raises(TypeError, match="the column 'u' holds no numbers"):
        case.with_log("logged", {"t": [0.0], "u": ["high"]}, columns)
    with pytest.raises(ValueError, match="columns of equal length with at least one row"):
        case.with_log("logged", {"t": [0.0, 1.0], "u": [1.0]}, columns)
    with pytest.raises(ValueError, match="has 2 dimensions"):
        case.with_log("logged", {"t": [[0.0]], "u": [1.0]}, columns)
    with pytest.raises(TypeError, match="columns: expected a dictionary, found list"):
        case.with_log("logged", {"t": [0.0]}, ["t"])
    with pytest.raises(taut.Error, match="there is no column `u`|u"):
        case.with_log("logged", {"t": [0.0, 1.0], "phi": [0.0, 1.0]}, columns, path=tmp_path / "log.csv")


def test_tuning_is_the_command_lines(root, moving):
    from test_results import program

    told = program(root, "tune", f"{STAGE}/controllers/pid.toml", "--evaluate")
    tuned = moving.tune(evaluate=True)
    assert tuned.data == told
    assert tuned.verdict == "unchanged" and tuned.forced_by is None and tuned.least_worse is None
    assert tuned.case["controller"] == moving["controller"]
    assert all(name in tuned._repr_html_() for name in tuned.gains)
    with pytest.raises(TypeError, match="spread: expected a number in SI units"):
        moving.tune(spread="10 %")
    with pytest.raises(taut.Error, match="an effort of 0 is invalid"):
        moving.tune(effort=0)
    with pytest.raises(taut.Error):
        taut.Case(taut.template()).tune()


def test_plans_are_the_command_lines(root, moving):
    from test_results import program

    told = program(root, "plan", f"{STAGE}/controllers/pid.toml", "--move", "short fast", "--reserve", "20%")
    found = moving.plan("short fast", reserve=0.2)
    assert found.data == told
    planned, given = found.arrivals()["short fast"]
    assert planned is None or given is None or planned <= given
    assert found.case["move.0.speed"] == pytest.approx(told["moves"][0]["limits"]["speed_m_s"]) or told["moves"][0]["kept"]
    assert "short fast" in found._repr_html_() and "short fast" in repr(found)
    assert len(found.to_pandas()) == len(told["moves"][0]["tried"])
    for wrong in ({"speed": 0.0}, {"jerk": -1.0}, {"reserve": 0.95}, {"moves": "gone"}):
        with pytest.raises(taut.Error):
            moving.plan(**wrong)


def test_learning_is_that_of_the_command_line(root, tmp_path):
    from test_results import program

    moving = taut.read(root / STAGE / "controllers/pid-shaped.toml")
    # A cart that lags behind by two milliseconds and a little more.
    every, until = 1e-3, 0.6
    times = [k * every for k in range(int(until / every) + 1)]
    run = moving.move("short fast")
    lagging = [float(np.interp(max(t - 2e-3, 0.0), run["time"], run["cart_position"])) for t in times]
    log = tmp_path / "log.csv"
    log.write_text("time_s,cart_position_m\n" + "".join(f"{t!r},{x!r}\n" for t, x in zip(times, lagging)))
    told = program(root, "learn", f"{STAGE}/controllers/pid-shaped.toml", "--move", "short fast", "--log", str(log))
    found = moving.learn(times, lagging, move="short fast")
    assert found.data == told
    assert len(found.added) == len(found.times) == len(found.to_pandas()) and np.abs(found.added).max() > 0
    assert "short fast" in repr(found) and "repetition" in found._repr_html_()
    again = moving.learn(times, lagging, move="short fast", added=found.added)
    assert again.data["drives"][0]["added_before"] == list(found.added)
    for wrong in ({"move": "gone"}, {}):
        with pytest.raises(taut.Error):
            moving.learn(times, lagging, **wrong)
    with pytest.raises(taut.Error, match="the log ends at"):
        moving.learn(times[:20], lagging[:20], move="short fast")


def test_pairs_of_shapers_are_the_command_lines(root):
    from test_results import program

    case = "stages/sollmann-jouaneh/table4.toml"
    told = program(root, "shape", case, "--pairs")
    found = taut.shape(root / case, pairs=True)
    assert {**found.data, "file": ""} == {**told, "file": ""}
    assert len(found.pairs) == 3
    for pair in found.pairs:
        assert sum(amplitude for _, amplitude in pair["impulses"]) == pytest.approx(1.0)
        assert len(pair["parts"]) == 2
    assert taut.shape(root / case).pairs == []


def test_shapers_are_the_command_lines(root):
    from test_results import program

    told = program(root, "shape", "stages/printer-axis/printer-axis.toml", "--shapers", "zv,mzv", "--motor", "free")
    found = taut.shape(root / "stages/printer-axis/printer-axis.toml", shapers=["zv", "mzv"], motor="free")
    assert {**found.data, "file": ""} == {**told, "file": ""}
    assert found.recommended[0] in ("zv", "mzv") and found.lines[0] == "[input_shaper]"
    assert list(found.to_pandas()["shaper"]) == ["zv", "mzv"]
    with pytest.raises(ValueError, match='firmware: "marlin" is none of klipper, klipper-2025-08'):
        taut.shape(root / "stages/printer-axis/printer-axis.toml", firmware="marlin")
    with pytest.raises(taut.Error, match="no file was given"):
        taut.shape([])
    assert found.belts is None
    with pytest.raises(taut.Error, match="a case file has no spectra of two belts"):
        taut.shape(root / "stages/printer-axis/printer-axis.toml", belts=True)
