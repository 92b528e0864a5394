"""Cases: read, edited, saved, and mistakes told."""

import functools
import os
import pickle
import zipfile
from pathlib import Path

import numpy as np
import pytest

import taut


def test_values_are_read_in_si_units(case):
    assert case["motor.resistance"] == 0.71
    assert case["drive_pulley.radius"] == 0.0194
    assert case["belt.stiffness"] == [132760.0, 132760.0, 58885.0]
    assert case['experiment."5 V pulse".input'] == {"pulse": 5.0, "for": 0.25}
    assert case["experiment.0.name"] == "5 V pulse"
    # A default that the text does not say.
    assert case["motor.gear_efficiency"] == 1.0
    assert "cart.mass" in case and "cart.weight" not in case
    with pytest.raises(KeyError, match="does not set `cart.weight`"):
        case["cart.weight"]


def test_values_are_written_with_comments_kept(case):
    before = case.text
    case["cart.mass"] = "600 g"
    assert case["cart.mass"] == 0.6 and '"600 g"' in case.text
    case["cart.mass"] = 0.1 + 0.2
    assert case["cart.mass"] == 0.1 + 0.2
    case["cart.mass"] = np.float64(0.5)
    assert case["cart.mass"] == 0.5
    case["belt.stiffness"] = np.array([1e5, 2e5, 3e5])
    assert case["belt.stiffness"] == [1e5, 2e5, 3e5]
    case["experiment.0.input"] = {"step": "3 V", "at": 0.1}
    assert case["experiment.0.input"] == {"step": 3.0, "at": 0.1}
    comments = [line for line in before.splitlines() if line.startswith("#")]
    assert comments and [line for line in case.text.splitlines() if line.startswith("#")] == comments


def test_another_case_leaves_this_one_alone(case):
    other = case.changed({"cart.mass": 1, "experiment.0.until": "2 s"})
    assert other["cart.mass"] == 1.0 and case["cart.mass"] == 0.362
    copy = case.copy()
    copy["cart.mass"] = 2
    assert case["cart.mass"] == 0.362
    assert case.copy() == case != copy


def test_a_refused_value_changes_nothing(case):
    before = case.text
    with pytest.raises(taut.Error):
        case["cart.mass"] = -1
    assert case.text == before
    with pytest.raises(taut.Error, match="not a finite number"):
        case["cart.mass"] = float("nan")
    with pytest.raises(TypeError, match="and no object"):
        case["cart.mass"] = object()


def test_mistakes_are_told_as_on_the_command_line(case):
    with pytest.raises(taut.Error) as caught:
        case["cart.mass"] = "0.5 m"
    assert str(caught.value) == (
        'change:1:11: cart.mass: "0.5 m" is a length (m); expected a mass (kg)\n'
        '  1 | cart.mass="0.5 m"\n'
        "    |           ^^^^^^^\n"
        '  next: write for example mass = "0.362 kg"'
    )
    with pytest.raises(ValueError) as caught:
        taut.Case(taut.template().replace("torque_constant", "torque_konstant"), "axis.toml")
    error = caught.value
    assert isinstance(error, taut.Error)
    assert error.file == "axis.toml" and error.line > 1 and error.column == 1
    assert error.what == "`motor` has no key `torque_konstant`"
    assert error.next == "did you mean `torque_constant`?"
    assert error.allowed.startswith("torque_constant, ")
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.line, again.next) == (str(error), error.line, error.next)


def mistake(path):
    """The message about a wrong case, or about the first log of it that is left out."""
    try:
        return next(iter(taut.read(path).left_out.values()))
    except taut.Error as error:
        return str(error)


def spoken(text):
    """A message of the command line in Python's terms, as far as the wrong cases need it; lines of the file stay."""
    terms = [("`taut init`", "`taut.template()`"), ("`taut fit`", "`case.fit()`"), ("give --runs", "give n=")]
    lines = text.splitlines(keepends=True)
    return "".join(line if " | " in line else functools.reduce(lambda told, term: told.replace(*term), terms, line) for line in lines)


@pytest.mark.skipif("TAUT_BAD" not in os.environ, reason="TAUT_BAD names no folder that `cargo xtask bad` wrote")
@pytest.mark.parametrize("folder", ["case", "mapping"])
def test_wrong_files_give_their_messages(folder):
    """Every wrong case under tests/bad, with the message that the command line must give."""
    folder = Path(os.environ["TAUT_BAD"]) / folder
    wrong = sorted(folder.glob("*.toml"))
    assert len(wrong) >= 60
    for path in wrong:
        expected = path.with_suffix(".txt").read_text(encoding="utf-8")
        assert mistake(path).replace(f"{folder}/", "") + "\n" == spoken(expected), path.name


def test_cases_are_read_and_saved(case, tmp_path):
    path = tmp_path / "axis.toml"
    case["cart.mass"] = 0.7
    case.save(path)
    assert [file.name for file in tmp_path.iterdir()] == ["axis.toml"]
    read = taut.read(path)
    assert read.text == case.text and read.path == str(path)
    assert pickle.loads(pickle.dumps(read)) == read
    with pytest.raises(taut.Error, match="there is no such file"):
        taut.read(tmp_path / "none.toml")


def test_it_shows_itself(case):
    assert repr(case).startswith("<taut.Case 'My axis': 5 V pulse")
    assert "<td>cart.mass</td><td>0.362</td>" in case._repr_html_()


def test_a_case_is_exported_as_the_program_does(case, tmp_path):
    files = taut.export(case, "c", tmp_path / "axis.c", real="float")
    assert [file.name for file in files] == ["axis.c", "axis.h"]
    assert "typedef float axis_real;" in files[1].read_text(encoding="utf-8")
    files = taut.export(case, "matlab", tmp_path / "matlab")
    assert all(file.is_file() for file in files) and len(files) == 5
    files = taut.export(case, "fmu", tmp_path / "axis.fmu", fmi=2)
    with zipfile.ZipFile(files[0]) as archive:
        assert {"modelDescription.xml", "resources/machine.toml", "sources/fmi2.c"} <= set(archive.namelist())
        assert b'fmiVersion="2.0"' in archive.read("modelDescription.xml")
    with pytest.raises(ValueError, match="fmi: 1 cannot be; allowed: 2 to 3"):
        taut.export(case, "fmu", tmp_path / "axis.fmu", fmi=1)
    with pytest.raises(taut.Error, match="this case has no controller"):
        taut.export(case, "fmu", tmp_path / "axis.fmu", part="both")
    with pytest.raises(taut.Error, match="there is no target"):
        taut.export(case, "fortran", tmp_path)
    with pytest.raises(taut.Error, match="no controller"):
        taut.export(case, "st", tmp_path)
    with pytest.raises(ValueError, match="real: expected float or double"):
        taut.export(case, "c", tmp_path, real="half")


def test_a_stepper_at_rest_and_at_a_speed_has_modes(root):
    case = taut.read(root / "stages/stepper-axis/stepper-axis.toml")
    for speed, gain in [(0.1, 1.0), (0.0, 0.45 / (0.45 - 4 * 0.015))]:
        found = case.modes(speed=speed).data
        [command] = found["inputs"]
        assert (command["name"], command["unit"], found["rigid"]) == ("position_command", "m", [])
        [cart] = [output for output in command["outputs"] if output["name"] == "cart_position"]
        assert cart["low_frequency_gain"] == pytest.approx(gain)
    with pytest.raises(taut.Error, match=r"the supply of 24.V does not suffice"):
        case.modes(speed=3.0)


def test_a_missing_log_is_told_to_those_who_need_it(case, tmp_path):
    """One log that was not there blocked the whole case: its modes, its export, the simulation of other experiments."""
    text = case.text + """
[[experiment]]
name = "gone"
log  = { file = "gone.csv", time = "time_s", input = "voltage_V", drive_angle = "drive_angle_rad" }
[fit]
free = ["cart.friction.viscous"]
"""
    (tmp_path / "mine.toml").write_text(text)
    line = 1 + next(k for k, line in enumerate(text.splitlines()) if "gone.csv" in line)
    for mine in (taut.read(tmp_path / "mine.toml"), taut.Case(text, tmp_path / "mine.toml")):
        assert mine.experiments == case.experiments and list(mine.left_out) == ["gone"] and "gone.csv" in mine.left_out["gone"]
        assert mine.modes().data == case.modes().data and mine.show().data["title"] == case.title
        assert mine.simulate(case.experiments[0]).metrics == case.simulate(case.experiments[0]).metrics
        assert mine.changed({"cart.mass": 0.5})["cart.mass"] == 0.5
        for needs in (mine.check, mine.fit, mine.frf, mine.compare, mine.simulate, lambda: mine.simulate("gone")):
            with pytest.raises(taut.Error, match=f"mine.toml:{line}(.|\\n)*experiment \"gone\"|experiment \"gone\"(.|\\n)*mine.toml:{line}"):
                needs()
    assert case.left_out == {}
