"""Checks, fits, linear models and moves, against the command line and against python-control."""

import json
import os
import subprocess
from html import escape

import numpy as np
import pytest

import taut

STAGE = "stages/sollmann-jouaneh"


def program(root, *arguments):
    """The output of ``taut … --json``. ``cargo xtask test`` says where the program is."""
    path = os.environ.get("TAUT_PROGRAM")
    if path is None:
        pytest.skip("TAUT_PROGRAM does not say where the program taut is")
    done = subprocess.run([path, *arguments, "--json"], cwd=root, capture_output=True, text=True)
    assert done.returncode in (0, 1), done.stderr
    return json.loads(done.stdout)


def test_simulations_are_the_command_lines(root):
    told = program(root, "simulate", f"{STAGE}/table4.toml")
    assert taut.read(root / STAGE / "table4.toml").simulate().data == told


def test_checks_are_the_command_lines(root):
    told = program(root, "check", f"{STAGE}/identification/linear-5v.toml")
    check = taut.read(root / STAGE / "identification" / "linear-5v.toml").check()
    assert check.data == told
    assert set(check.errors) == {row["name"] for row in told["parameters"]}
    assert check.complete == (check.not_determined == [])
    assert all(name in check._repr_html_() for name in check.errors)


def test_fits_are_the_command_lines(root):
    told = program(root, "fit", f"{STAGE}/identification/linear-5v.toml")
    fit = taut.read(root / STAGE / "identification" / "linear-5v.toml").fit()
    assert fit.data == told
    for name, estimate in fit.estimates.items():
        assert fit[name] == estimate
        assert estimate.name in repr(fit) and estimate.name in fit._repr_html_()
    # The estimates stand in the case to the digits that are known, and it simulates.
    assert all(parameter["sets"] for parameter in told["parameters"])
    for parameter in told["parameters"]:
        known = 0.1 * parameter["standard_error"] / abs(parameter["value"])
        for row in parameter["sets"]:
            if not isinstance(fit.case.get(row["key"]), (list, type(None))):
                assert fit.case[row["key"]] == pytest.approx(row["value"], rel=known)
    assert all(run.ending == "complete" for run in fit.case.simulate())


def test_a_case_without_a_fit_says_what_to_add(case):
    with pytest.raises(taut.Error, match=r"add a table \[fit\]"):
        case.fit()


def test_draws_come_as_columns(root):
    fit = taut.read(root / STAGE / "identification" / "linear-5v.toml").fit(profiles=True, posterior=True, draws=50, chains=2)
    assert [profile["name"] for profile in fit.data["profiles"]] == list(fit.estimates)
    draws = fit.draws
    assert draws.rows == 100 and set(draws["chain"]) == {0.0, 1.0}
    for parameter in fit.data["posterior"]["parameters"]:
        assert draws[parameter["name"]].mean() == pytest.approx(parameter["mean"])


def test_modes_are_the_command_lines(root):
    options = ["--sample-time", "1ms", "--delay", "0.5ms", "--stuck", "idler"]
    told = program(root, "modes", f"{STAGE}/table4.toml", *options)
    modes = taut.read(root / STAGE / "table4.toml").modes(sample_time=1e-3, delay=5e-4, stuck=["idler"])
    assert modes.data == told
    assert np.array_equal(modes.model.A, told["A"]) and np.array_equal(modes.model.B, told["B"])
    assert np.array_equal(modes.discrete.A, told["discrete"]["A"])


def test_what_follows_from_the_numbers_is_the_command_lines(root):
    for file in [f"{STAGE}/table4.toml", "stages/core-xy/core-xy.toml"]:
        shown = taut.show(root / file)
        assert shown.data == program(root, "show", file)
        assert all(shown[key] == value for key, (value, _) in shown.rows.items())
        assert "no such" not in shown and escape(shown.data["title"]) in shown._repr_html_()


def test_models_go_to_python_control(case):
    control = pytest.importorskip("control")
    modes = case.modes(sample_time=1e-3)
    model = modes.model.to_control()
    assert isinstance(model, control.StateSpace) and model.isctime()
    assert model.state_labels[0] == modes.data["states"][0]["name"]
    assert model.output_labels == [row["name"] for row in modes.data["outputs"]]
    assert np.sort(model.poles().real) == pytest.approx(np.sort(modes.poles.real), abs=1e-6)
    assert modes.to_control().dt == 1e-3
    # Their frequency response is ours.
    output = "cart_speed"
    magnitude, phase = modes.responses[output]
    theirs = control.frequency_response(model[output, 0], 2 * np.pi * modes.frequency)
    assert np.abs(theirs.frdata).ravel() == pytest.approx(magnitude, rel=1e-6)
    assert case.modes().to_control().isctime()


def test_modes_refuse_what_is_not_there(case):
    with pytest.raises(taut.Error, match='no body "card"(.|\n)*drive, cart, idler'):
        case.modes(stuck=["card"])
    with pytest.raises(taut.Error, match="the response would end at 1 Hz"):
        case.modes(lowest=10, highest=1)


@pytest.fixture
def pid(root):
    return taut.read(root / STAGE / "controllers" / "pid.toml")


def test_moves_are_the_command_lines(root, pid):
    told = program(root, "move", f"{STAGE}/controllers/pid.toml", "--spread", "10%")
    runs = pid.move(spread=0.1)
    assert runs.data == told
    assert runs[0].units["cart_error"] == "m"
    assert runs[0]["reference"] - runs[0]["cart_position"] == pytest.approx(runs[0]["cart_error"])


def test_a_controller_may_be_a_function(pid):
    asked = []

    def proportional(position, reference):
        asked.append(position)
        return 2000.0 * (reference - position)

    name = pid.moves[0]
    run = pid.move(name, controller=proportional)
    assert run.name == name and run.ending == "complete"
    # Once a sample.
    told = pid.move([name], controller=proportional).data
    assert told["structure"] == "proportional" and told["moves"][0]["samples"] == len(asked) / 2
    assert abs(run["cart_error"][-1]) < 1e-3


def test_a_controller_may_be_an_object(pid):
    class Relay:
        def __init__(self):
            self.resets, self.seen, self.left = 0, [], []

        def reset(self):
            self.resets += 1

        def step(self, seen):
            self.seen.append(seen)
            return 100.0 * (1 if seen.ahead > seen.position else -1)

        def limited(self, given):
            self.left.append(given)

    relay = Relay()
    run = pid.move(pid.moves[0], controller=relay, every=2e-3, limit=5.0)
    assert relay.resets == 1 and len(relay.left) == len(relay.seen)
    assert max(map(abs, relay.left)) == 5.0 and np.abs(run["voltage"]).max() <= 5.0
    assert relay.seen[1].time == 2e-3 and isinstance(relay.seen[0], taut.Observation)


def test_what_a_controller_raises_comes_out(pid):
    def broken(position, reference):
        calls.append(position)
        return 1 / 0 if len(calls) == 7 else 0.0

    calls = []
    with pytest.raises(ZeroDivisionError):
        pid.move(controller=broken)
    assert len(calls) == 7
    with pytest.raises(ValueError, match="the controller's command is NaN"):
        pid.move(controller=lambda position, reference: float("nan"))
    with pytest.raises(TypeError):
        pid.move(controller=lambda position, reference: "5 V")
    with pytest.raises(TypeError, match="a controller is a function"):
        pid.move(controller=5)
    with pytest.raises(taut.Error, match='there is no move "none"'):
        pid.move("none")


def test_a_case_without_moves_says_what_to_add(case):
    with pytest.raises(taut.Error, match=r"add \[controller\]"):
        case.move()
