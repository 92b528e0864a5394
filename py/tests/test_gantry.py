"""Gantries: read, edited, simulated, and how they swing."""

import json
import os
import pickle
import subprocess

import numpy as np
import pytest

import taut


@pytest.fixture
def gantry(root):
    return taut.read(root / "stages/h-frame/h-frame.toml")


def test_a_gantry_opens_as_any_case(gantry, root):
    assert type(gantry) is taut.Case and gantry.kind == "h-frame"
    assert gantry.experiments == ["one motor", "along x", "along y"] and gantry.moves == []
    assert gantry["cart.travel.max"] == 0.25 and gantry["experiment.0.input.left.for"] == 0.25
    assert gantry["belt.stiffness"] == [132760.0, 132760.0, 58885.0]
    gantry["bridge.mass"] = "1 kg"
    assert gantry["bridge.mass"] == 1.0 and "# without the cart" in gantry.text
    assert taut.Case(gantry.text).kind == gantry.copy().kind == "h-frame"
    assert pickle.loads(pickle.dumps(gantry)) == gantry
    assert "bridge.mass" in gantry._repr_html_()
    assert taut.Case(taut.template()).kind == "axis"


def test_columns_events_and_figures(gantry):
    run = gantry.simulate("one motor")
    for column in ("left_voltage", "right_angle", "bridge_position", "cart_speed", "left_span_force", "cart_state"):
        assert len(run[column]) == 1001
    assert run.units["left_speed"] == "rad/s" and run.headings["bridge_position"] == "bridge_position_m"
    assert {event["part"] for event in run.events} == {"left", "right", "bridge", "cart"}
    units = {event["part"]: event["load_unit"] for event in run.events}
    assert units == {"left": "N m", "right": "N m", "bridge": "N", "cart": "N"}
    assert run.metrics["final_bridge_position_m"] == run["bridge_position"][-1]
    assert abs(run.metrics["peak_left_current_A"]["value"]) >= np.abs(run["left_current"]).max()
    assert run.ending == "complete" and run.position_error < 1e-9
    assert run.metrics["stop_time_s"] == max(event["time_s"] for event in run.events)
    # The pulleys say where bridge and cart are, but for what the belt stretches: r phi1 = -x - y, r phi2 = x - y.
    r, left, right = gantry["drive_pulley.radius"], run["left_angle"], run["right_angle"]
    assert np.abs(r * (right - left) / 2 - run["bridge_position"]).max() < 1e-4
    assert np.abs(-r * (right + left) / 2 - run["cart_position"]).max() < 1e-4


def test_data_is_what_the_command_prints(gantry):
    program = os.environ.get("TAUT_PROGRAM")
    if program is None:
        pytest.skip("TAUT_PROGRAM names no program")
    for words, data in (("simulate", gantry.simulate().data), ("modes", gantry.modes().data)):
        told = subprocess.run([program, words, gantry.path, "--json"], capture_output=True, check=True, text=True)
        want = json.loads(told.stdout)
        for experiment in want.get("experiments", []):
            experiment["files"] = []
        assert data == want


def test_modes(gantry, root):
    modes = gantry.modes()
    undamped = [mode["frequency_Hz"] for mode in modes.data["elastic"]]
    assert undamped == pytest.approx([196.643946994, 220.198687165], abs=1e-8)
    assert modes.resonances == pytest.approx(undamped, rel=1e-3)
    assert all(0 < damping < 0.1 for damping in modes.damping) and modes.map is None
    system = modes.to_control()
    assert (system.nstates, system.ninputs) == (8, 2) and system.input_labels == ["left_voltage_command", "right_voltage_command"]
    swings = sorted({round(abs(pole.imag) / (2 * np.pi), 6) for pole in system.poles() if pole.imag > 1})
    assert swings == [round(root["damped_frequency_Hz"], 6) for root in modes.data["here"]["resonances"]]
    assert "196.6 Hz" in repr(modes) and "poles" in modes._repr_html_()
    bridge, cart, hertz = taut.read(root / "stages/core-xy/follows.toml").modes().map
    assert hertz.shape == (2, len(bridge), len(cart)) and (hertz > 100).all()


def test_a_sampled_model_of_two_inputs_is_that_of_each(gantry):
    control = pytest.importorskip("control")
    modes = gantry.modes(sample_time=1e-3, delay=1.5e-3, at=0.05, bridge=-0.05)
    assert modes.data["here"]["bridge_position_m"] == -0.05
    model = modes.discrete
    assert model.A.shape == (8 + 2 * 2, 8 + 2 * 2) and model.states[-1] == "right_voltage_command_input_2_samples_ago"
    z = np.exp(2j * np.pi * 30.0 * 1e-3)
    together = model.C @ np.linalg.solve(z * np.eye(12) - model.A, model.B) + model.D
    for k, one in enumerate(modes.data["inputs"]):
        a, b, c, d = (np.array(one["discrete"][key]) for key in "ABCD")
        alone = c @ np.linalg.solve(z * np.eye(len(a)) - a, b) + d
        assert np.abs(together[:, [k]] - alone).max() <= 1e-9 * np.abs(alone).max()
    assert control.isdtime(modes.to_control(), strict=True)
    with pytest.raises(taut.Error, match="outside the travel"):
        gantry.modes(bridge=9.0)
    with pytest.raises(KeyError, match="there is no input 'middle'"):
        modes.plot("cart_position", input="middle")


def test_a_row_of_a_sweep_is_the_run_of_its_machine(gantry):
    vary = {"cart.mass": "20 %", "left_drive.motor.resistance": "5 %"}
    table = gantry.sweep(4, vary=vary, design="sobol", solver="exact")
    beside = gantry.sweep(4, vary=vary, design="sobol")
    name = "one-motor.final_bridge_position"
    assert np.abs(beside[name] - table[name]).max() < 1e-12
    assert len(table["run"]) == 4 and len(set(table["cart.mass"])) == 4
    for row in (0, 3):
        keys = ("cart.mass", "left_drive.motor.resistance")
        run = gantry.changed({key: float(table[key][row]) for key in keys}).simulate("one motor")
        assert table["one-motor.final_bridge_position"][row] == run.metrics["final_bridge_position_m"]
        assert table["one-motor.peak_left_span_force"][row] == abs(run.metrics["peak_span_force_N"]["left_span"]["value"])
    with pytest.raises(taut.Error, match="is of a single axis, and this is a gantry"):
        gantry.sweep(4, vary={"idler_pulley.inertia": "20 %"})


def test_moves_in_the_plane(root):
    case = taut.read(root / "stages/core-xy/square.toml")
    assert case.moves == ["square", "part"]
    run = case.move("square")
    figures = run.metrics
    errors = [figures["loads"][part]["error"]["peak_m"] for part in ("bridge", "cart")]
    for part, peak in zip(("bridge", "cart"), errors):
        assert run[f"{part}_error"] == pytest.approx(run[f"{part}_reference"] - run[f"{part}_position"])
        assert 0 <= abs(peak) - np.abs(run[f"{part}_error"]).max() < 2e-6
    assert abs(figures["contour_error"]["peak_m"]) == pytest.approx(np.abs(run["contour_error"]).max(), abs=2e-6)
    assert set(figures["drives"]) == {"left", "right"} and "cart_error" not in figures
    # Along a leg without a stop the distance from the path, positive to its left, is minus the other coordinate's error.
    first = run["time"] < 0.15
    assert run["contour_error"][first] == pytest.approx(-run["cart_error"][first], abs=1e-15)
    assert case.move("square", spread=0.1).metrics["spread"]["axes"] == 20


def test_each_drive_of_a_gantry_has_a_controller_of_its_own(root):
    case = taut.read(root / "stages/core-xy/square.toml")
    seen = {"left": [], "right": []}

    def of(side):
        def proportional(position, reference):
            seen[side].append(reference)
            return 2000.0 * (reference - position)

        return proportional

    run = case.move("square", controller=[of("left"), of("right")], every=1e-3)
    assert len(seen["left"]) == len(seen["right"]) == 1501
    x, y = run["bridge_reference"], run["cart_reference"]
    assert seen["left"] == pytest.approx(x + y) and seen["right"] == pytest.approx(x - y)
    with pytest.raises(taut.Error, match="1 controllers and 2 profiles(.|\n)*2 controllers, one for each drive"):
        case.move("square", controller=of("left"))
    with pytest.raises(taut.Error, match="`disturbance_observer` needs a single axis"):
        case["controller.disturbance_observer"] = {"bandwidth": 20}
    with pytest.raises(taut.Error, match="2 positions: bridge, cart"):
        case["move.0.points"] = [["40 mm"]]


def test_loops_of_both_motors_have_margins(root):
    case = taut.read(root / "stages/core-xy/square.toml")
    tuned = case.tune(evaluate=True)
    told = tuned.data["after"]["nominal"]
    assert told["stable"] and told["gain_margin_drive"] in ("left drive", "right drive")
    worst = tuned.data["after"]["worst"]
    assert worst["bridge_m"] == 0 and len(tuned.data["after"]["moves"]) == len(case.moves)
    # Too much for the belts.
    case["controller.pid.proportional"] = 1e6
    assert not case.tune(evaluate=True).data["after"]["nominal"]["stable"]


def test_a_dual_belt_has_three_drives(root):
    case = taut.read(root / "stages/dual-belt/dual-belt.toml")
    assert case.kind == "dual-belt" and case["experiment.2.input.cart.at"] == 0.1
    run = case.simulate("one side")
    r = case["drive_pulley.radius"]
    # Two pulleys say where the bridge is, the third one where the cart is, but for what belts stretch.
    assert np.abs(r * (run["left_angle"] + run["right_angle"]) / 2 - run["bridge_position"]).max() < 1e-4
    assert np.abs(r * run["cart_pulley_angle"] - run["cart_position"]).max() < 1e-4
    assert abs(run.metrics["peak_cart_current_A"]["value"]) >= np.abs(run["cart_current"]).max()
    assert len(case.modes().data["elastic"]) == 3
    square = taut.read(root / "stages/dual-belt/square.toml").move("square")
    assert set(square.metrics["drives"]) == {"left", "right", "cart"}
    with pytest.raises(taut.Error, match="cannot have compliant gears"):
        case.changed({"motor.rotor_inertia": "1e-5 kg m^2", "motor.gear_stiffness": "300 N m/rad"})


def test_what_is_not_there_says_so(gantry):
    assert repr(gantry) == "<taut.Case 'H-frame': one motor, along x, along y>"
    with pytest.raises(taut.Error, match="nothing is measured in this case"):
        gantry.design(["cart.mass"])
    with pytest.raises(taut.Error, match="no log to measure a response from"):
        gantry.frf()
    with pytest.raises(taut.Error, match="is of a single axis"):
        gantry.simulate(solver="table3")


def test_logs_of_both_motors_are_checked_and_fitted(root):
    case = taut.read(root / "stages/core-xy/belts.toml")
    told = case.check()
    assert told.complete and told.data["regression"] is None and told.data["experiments"] == []
    found = case.fit()
    ratio = (105 + 90) / (120 + 100)
    low, high = found.data["belts"]["interval_95"]
    assert found.data["belts"]["looser"] == "right drive" and low < ratio < high < 0.92
    compared = case.compare(laws=["viscous", "coulomb"], windows=[None])
    assert compared.data["body"] == "cart" and len(compared.data["candidates"]) == 2


def test_responses_of_every_output_to_every_motor(root):
    case = taut.read(root / "stages/core-xy/belts.toml")
    found = case.frf(segment=0.128, at=0.0, bridge=0.0)
    titles = [(one["input"], one["quantity"]) for one in found.data["responses"]]
    sides = ("left", "right")
    assert titles == [(f"{motor}_input", f"{pulley}_angle") for motor in sides for pulley in sides]
    assert found.data["bridge_m"] == 0 and found.data["warnings"] == []
    assert all(one["input_coherence"] < 0.5 for one in found.data["responses"])
    assert set(found.to_pandas()["input"]) == {"left_input", "right_input"}
    assert "both motors: left_input to left_angle" in repr(found)
    with pytest.raises(taut.Error, match="segments of 1000 samples"):
        case.frf(segment=1.0)
    with pytest.raises(taut.Error, match="of no use here"):
        case.frf(bridge=float("nan"))


def test_an_experiment_is_designed(gantry):
    measured = {"left_angle": 1e-3, "right_angle": 1e-3}
    options = {"inputs": ["trapezoid"], "duration": 0.3, "verify": 0, "measured": measured}
    found = gantry.design(["cart.mass"], drives=["left"], **options)
    assert found.data["drive"] == "left" and found.data["bridge"]["travel_m"]["value"] == 0.5
    assert "input = { left = {" in found.toml and found.data["complete"]
    assert found.case.simulate("designed").metrics["final_bridge_position_m"] is not None
    with pytest.raises(taut.Error, match="`middle` is nothing that an input can go to"):
        gantry.design(["cart.mass"], drives=["middle"], **options)


def test_a_repeated_move_is_learned(root):
    gains = {"proportional": "3 V/mm", "derivative": "20 V s/m"}
    case = taut.read(root / "stages/core-xy/square.toml").changed({f"controller.pid.{key}": value for key, value in gains.items()})
    run = case.move("square")
    positions = {"bridge": run["bridge_position"], "cart": run["cart_position"]}
    found = case.learn(run["time"], positions, move="square")
    assert [load["name"] for load in found.data["loads"]] == ["bridge", "cart"]
    assert set(found.added) == {"left", "right"} and len(found.added["left"]) == len(found.times)
    assert "right_added" in found.to_pandas() and "bridge_error_m" in found.to_pandas()
    again = case.learn(run["time"], positions, move="square", added=found.added)
    assert again.data["drives"][1]["added_before"] == list(found.added["right"])
    with pytest.raises(TypeError, match="position: expected a mapping with bridge, cart"):
        case.learn(run["time"], run["cart_position"], move="square")
    with pytest.raises(TypeError, match="added: expected a mapping with left, right"):
        case.learn(run["time"], positions, move="square", added=found.added["left"])
