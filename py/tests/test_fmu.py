"""FMUs of ``taut export fmu`` in two importers: FMPy with its own integrator, and ecos."""

from __future__ import annotations

import csv
import os
import random
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

fmpy = pytest.importorskip("fmpy")
from fmpy import extract, read_model_description, simulate_fmu  # noqa: E402
from fmpy.build import build_platform_binary  # noqa: E402
from fmpy.fmi2 import FMU2Slave  # noqa: E402
from fmpy.fmi3 import FMU3Slave  # noqa: E402
from fmpy.validation import validate_fmu  # noqa: E402

PROGRAM = os.environ.get("TAUT_PROGRAM")
pytestmark = pytest.mark.skipif(PROGRAM is None, reason="TAUT_PROGRAM does not name the program")

PAPER = "stages/sollmann-jouaneh/table4.toml"
PULSE = {"step": 1e-3, "until": 1.0}

#: Co-simulation is exact but for rounding; a stranger's integrator is as good as its tolerance. Metres.
SAME, NEAR = 1e-12, 1e-6


def taut(*words: str) -> None:
    """Runs the program, which has to succeed."""
    assert PROGRAM is not None
    done = subprocess.run([PROGRAM, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def export(case: Path, out: Path, version: int, *more: str) -> str:
    """An FMU of a case."""
    taut("export", "fmu", str(case), "--out", str(out), "--fmi", str(version), *more)
    return str(out)


def rows(case: Path, folder: Path, name: str, *changes: str) -> dict[str, np.ndarray[Any, Any]]:
    """Rows of ``taut simulate`` of an experiment."""
    sets = [word for change in changes for word in ("--set", change)]
    taut("simulate", str(case), "--out", str(folder), "--no-report", *sets)
    with (folder / name).open() as file:
        table = list(csv.DictReader(file))
    return {key: np.array([float(row[key]) for row in table]) for key in table[0]}


def signal(points: list[tuple[float, float]], name: str = "command") -> np.ndarray[Any, Any]:
    """An input of straight lines; two points at one time are a jump."""
    return np.array(points, dtype=[("time", np.float64), (name, np.float64)])


def sources_of(unit: str, version: int) -> tuple[Any, str]:
    """An instance of the sources in a unit, compiled by FMPy's own means in the place of its binary."""
    if not any(shutil.which(compiler) for compiler in ("cc", "gcc", "clang")):
        pytest.skip("there is no C compiler")
    place = extract(unit)
    for binary in Path(place).glob("binaries/*/*"):
        binary.unlink()
    # CMake is a package of this environment, too.
    os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    build_platform_binary(place, all_warnings=True)
    assert any(Path(place).glob("binaries/*/taut_fmu.*")), "it is compiled"
    return slave(unit, version, place)[0], place


def slave(unit: str, version: int, place: str | None = None) -> tuple[Any, dict[str, int], str]:
    """An instance of FMPy's that is ready for its first step, its value references, and where it was unpacked."""
    description = read_model_description(unit)
    place = place or extract(unit)
    kind = FMU2Slave if version == 2 else FMU3Slave
    one = kind(guid=description.guid, unzipDirectory=place, modelIdentifier=description.coSimulation.modelIdentifier)
    one.instantiate()
    if version == 2:
        one.setupExperiment(startTime=0.0)
    one.enterInitializationMode()
    one.exitInitializationMode()
    return one, {variable.name: variable.valueReference for variable in description.modelVariables}, place


#: 10 V for a quarter of a second.
JUMPS = [(0.0, 10.0), (0.25, 10.0), (0.25, 0.0), (1.0, 0.0)]


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize(
    ("case", "more"),
    [
        (PAPER, ()),
        ("stages/core-xy/core-xy.toml", ()),
        ("stages/core-xy/follows.toml", ()),
        ("stages/h-frame/h-frame.toml", ()),
        ("stages/dual-belt/dual-belt.toml", ()),
        ("stages/emps/emps.toml", ()),
        ("stages/two-mass/two-mass.toml", ()),
        ("stages/laser-gantry/laser-gantry.toml", ()),
        ("stages/sollmann-jouaneh/controllers/pid.toml", ("--part", "both")),
    ],
)
def test_descriptions_are_valid(root: Path, tmp_path: Path, version: int, case: str, more: tuple[str, ...]) -> None:
    """The schema of the standard, and what FMPy checks beyond it."""
    unit = export(root / case, tmp_path / "unit.fmu", version, *more)
    assert validate_fmu(unit) == []
    with zipfile.ZipFile(unit) as archive:
        assert archive.testzip() is None
        names = archive.namelist()
    assert "resources/case.toml" in names and "documentation/licenses/license.txt" in names
    assert ("model.png" if version == 2 else "terminalsAndIcons/icon.png") in names


@pytest.mark.parametrize(("version", "events"), [(2, False), (3, False), (3, True)])
def test_co_simulation_is_exact(root: Path, tmp_path: Path, version: int, events: bool) -> None:
    """The pulse in steps of a millisecond and of a quarter of a second, with importers' defaults and with event
    mode."""
    wanted = rows(root / PAPER, tmp_path / "rows", "10-v-pulse.csv")
    unit = export(root / PAPER, tmp_path / "unit.fmu", version)
    for step in (1e-3, 0.25):
        result = simulate_fmu(
            unit,
            fmi_type="CoSimulation",
            stop_time=1.0,
            output_interval=step,
            input=signal(JUMPS),
            output=["cart_position", "drive_angle", "cart_state"],
            use_event_mode=events,
            early_return_allowed=events,
        )
        x = dict(zip(np.round(wanted["time_s"], 9), wanted["cart_position_m"], strict=True))
        whole = [k for k, t in enumerate(result["time"]) if round(t, 9) in x and abs(t - round(t, 9)) < 1e-15]
        off = max(abs(result["cart_position"][k] - x[round(result["time"][k], 9)]) for k in whole)
        assert len(whole) >= 1 / step and off <= SAME, off


@pytest.mark.parametrize("version", [2, 3])
def test_a_stranger_integrates_through_stick_and_slip(root: Path, tmp_path: Path, version: int) -> None:
    """Model exchange with CVODE: a triangle wave, through every rest and turn."""
    wanted = rows(
        root / PAPER, tmp_path / "rows", "5-v-pulse.csv", 'experiment.0.input={ triangle = "3 V", frequency = "2 Hz" }'
    )
    unit = export(root / PAPER, tmp_path / "unit.fmu", version)
    corners = [(0.0, 0.0)] + [(0.125 + 0.25 * k, 3.0 * (-1) ** k) for k in range(4)] + [(1.0, 0.0)]
    result = simulate_fmu(
        unit,
        fmi_type="ModelExchange",
        solver="CVode",
        stop_time=0.5,
        relative_tolerance=1e-9,
        # The belt swings at 300 Hz with nothing to damp it: at this tolerance CVODE takes 2 us, and no more than 500
        # steps from one output to the next.
        output_interval=0.25e-3,
        input=signal(corners),
        output=["cart_position", "cart_state"],
        record_events=False,
    )
    off = np.max(np.abs(result["cart_position"][::4] - wanted["cart_position_m"][:501]))
    assert off <= NEAR, off
    assert set(result["cart_state"]) == {-1, 0, 1}, "it slides both ways, and sticks"


def test_ramps_are_exact_by_input_derivatives(root: Path, tmp_path: Path) -> None:
    """FMI 2.0: a triangle wave in steps of an eighth of a second, told by value and slope."""
    wanted = rows(
        root / PAPER, tmp_path / "rows", "5-v-pulse.csv", 'experiment.0.input={ triangle = "3 V", frequency = "2 Hz" }'
    )
    unit = export(root / PAPER, tmp_path / "unit.fmu", 2)
    one, references, place = slave(unit, 2)
    command, cart = [references["command"]], [references["cart_position"]]
    for k in range(8):
        # From 0 up to 3 V, down to -3 V and back, an eighth of a second for each 3 V.
        value, slope = [0.0, 3.0, 0.0, -3.0][k % 4], [24.0, -24.0, -24.0, 24.0][k % 4]
        one.setReal(command, [value])
        one.setRealInputDerivatives(command, [1], [slope])
        one.doStep(k / 8, 1 / 8)
        off = abs(one.getReal(cart)[0] - wanted["cart_position_m"][125 * (k + 1)])
        assert off <= SAME, (k, off)
    one.terminate()
    one.freeInstance()
    shutil.rmtree(place)


@pytest.mark.parametrize("version", [2, 3])
def test_steps_are_taken_back_by_the_importer(root: Path, tmp_path: Path, version: int) -> None:
    """States got, set and sent as bytes, by FMPy's own calls, in steps that nobody has planned."""
    wanted = rows(root / PAPER, tmp_path / "rows", "10-v-pulse.csv")["cart_position_m"]
    unit = export(root / PAPER, tmp_path / "unit.fmu", version)
    one, references, place = slave(unit, version)
    command, cart = [references["command"]], [references["cart_position"]]
    reads = one.getReal if version == 2 else one.getFloat64
    sets = one.setReal if version == 2 else one.setFloat64
    choose = random.Random(5)
    time, milliseconds = 0.0, 0
    sets(command, [10.0])
    while milliseconds < 1000:
        state = one.getFMUState()
        back = choose.random() < 0.3
        steps = choose.choice([1, 3, 7, 50])
        steps = min(steps, (250 if milliseconds < 250 else 1000) - milliseconds)
        end = (milliseconds + steps) / 1000
        one.doStep(time, end - time)
        if back:
            # As bytes and from them, and once more.
            data = one.serializeFMUState(state)
            again = one.deserializeFMUState(data)
            one.setFMUState(again)
            one.freeFMUState(again)
        else:
            time, milliseconds = end, milliseconds + steps
            assert abs(reads(cart)[0] - wanted[milliseconds]) <= SAME
        one.freeFMUState(state)
        if milliseconds >= 250:
            sets(command, [0.0])
    one.terminate()
    one.freeInstance()
    shutil.rmtree(place)


def test_a_controller_inside_follows_as_taut_move_does(root: Path, tmp_path: Path) -> None:
    """The reference goes in, the error comes out; PID of the paper's axis with a reference that is known at its
    samples."""
    case = root / "stages/sollmann-jouaneh/controllers/pid.toml"
    unit = export(case, tmp_path / "unit.fmu", 3, "--part", "both")
    result = simulate_fmu(
        unit,
        fmi_type="CoSimulation",
        stop_time=0.5,
        output_interval=1e-3,
        start_values={"reference": 0.01},
        output=["cart_position", "error", "command"],
    )
    assert abs(result["error"][-1]) < 2e-4, "it gets there, as far as friction lets it"
    assert result["error"][0] == 0.01
    off = 0.01 - result["cart_position"] - result["error"]
    assert np.max(np.abs(off)) < 1e-15
    exchanged = simulate_fmu(
        unit,
        fmi_type="ModelExchange",
        solver="CVode",
        stop_time=0.05,
        relative_tolerance=1e-9,
        output_interval=0.25e-3,
        start_values={"reference": 0.01},
        output=["cart_position"],
        record_events=False,
    )
    off = np.max(np.abs(exchanged["cart_position"][::4] - result["cart_position"][:51]))
    assert off <= NEAR, off


@pytest.mark.parametrize("version", [2, 3])
def test_a_second_importer_runs_it(root: Path, tmp_path: Path, version: int) -> None:
    """Ecos, in a process of its own: a held input for half a second, in its steps."""
    # Its library looks for that of the package tbb, which lies in the environment.
    libraries = {**os.environ, "LD_LIBRARY_PATH": str(Path(sys.prefix) / "lib")}
    wanted = rows(root / PAPER, tmp_path / "rows", "5-v-pulse.csv", 'experiment.0.input={ step = "5 V" }')
    unit = export(root / PAPER, tmp_path / "unit.fmu", version)
    script = (
        "import sys\n"
        "from ecospy import EcosSimulation, EcosSimulationStructure\n"
        "structure = EcosSimulationStructure()\n"
        "structure.add_model('one', sys.argv[1])\n"
        "structure.add_parameter_set('start', {'one::command': 5.0})\n"
        "simulation = EcosSimulation(structure=structure, step_size=0.01)\n"
        "simulation.init(parameter_set='start')\n"
        "simulation.step(50)\n"
        "print(repr(simulation.get_real('one::cart_position')))\n"
        "simulation.terminate()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, unit], capture_output=True, text=True, check=False, env=libraries
    )
    assert done.returncode == 0, done.stderr + done.stdout
    x = float(done.stdout.strip().splitlines()[-1])
    assert abs(x - wanted["cart_position_m"][500]) <= SAME, x


@pytest.mark.parametrize("version", [2, 3])
def test_what_the_sources_make_is_the_same_machine(root: Path, tmp_path: Path, version: int) -> None:
    """The sources in the FMU, compiled by FMPy's own means in the place of the binary: the pulse, and a jump in
    slope."""
    wanted = rows(root / PAPER, tmp_path / "rows", "10-v-pulse.csv")
    unit = export(root / PAPER, tmp_path / "unit.fmu", version)
    one, place = sources_of(unit, version)
    one.terminate()
    one.freeInstance()
    for step in (1e-3, 0.25):
        names = ["cart_position", "drive_angle", "motor_current", "span1_force", "cart_friction", "cart_state"]
        result = simulate_fmu(
            place, fmi_type="CoSimulation", stop_time=1.0, output_interval=step, input=signal(JUMPS), output=names
        )
        x = dict(zip(np.round(wanted["time_s"], 9), wanted["cart_position_m"], strict=True))
        whole = [k for k, t in enumerate(result["time"]) if round(t, 9) in x and abs(t - round(t, 9)) < 1e-15]
        off = max(abs(result["cart_position"][k] - x[round(result["time"][k], 9)]) for k in whole)
        assert len(whole) >= 1 / step and off <= SAME, off
    shutil.rmtree(place)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("case", [PAPER, "stages/h-frame/h-frame.toml", "stages/printer-axis/printer-axis.toml"])
def test_sources_and_binary_agree_in_all_outputs(root: Path, tmp_path: Path, version: int, case: str) -> None:
    """Random inputs, ramps among them, in random steps, some taken back by bytes: every output, and its derivatives."""
    unit = export(root / case, tmp_path / "unit.fmu", version)
    one, references, place = slave(unit, version)
    other, compiled = sources_of(unit, version)
    variables = read_model_description(unit).modelVariables
    inputs = [v.valueReference for v in variables if v.causality == "input" and v.name.endswith("command")]
    outputs = [v for v in variables if v.causality == "output" and v.type in ("Real", "Float64")]
    states = [v.valueReference for v in variables if v.causality == "output" and v.type in ("Integer", "Int32")]
    smooth = [v.valueReference for v in outputs if v.variability == "continuous"]
    choose, time = random.Random(3), 0.0
    for k in range(60):
        values = [choose.choice([0.0, choose.uniform(-12, 12)]) for _ in inputs]
        slopes, size = [choose.uniform(-50, 50) for _ in inputs], choose.choice([1e-4, 1e-3, 7.3e-3, 0.05])
        for unit_ in (one, other):
            (unit_.setReal if version == 2 else unit_.setFloat64)(inputs, values)
            if version == 2 and k % 3 == 0:
                unit_.setRealInputDerivatives(inputs, [1] * len(inputs), slopes)
            if k % 7 == 0:
                data = unit_.serializeFMUState(unit_.getFMUState())
                unit_.doStep(time, size)
                unit_.setFMUState(unit_.deserializeFMUState(data))
            unit_.doStep(time, size)
        time += size
        read = [v.valueReference for v in outputs]
        rows_ = [(u.getReal if version == 2 else u.getFloat64)(read) for u in (one, other)]
        for variable, is_, was in zip(outputs, *rows_, strict=True):
            allowed = SAME if variable.name.endswith("position") else 1e-9 * max(1.0, abs(is_))
            assert abs(is_ - was) <= allowed, (k, variable.name, is_, was)
        found = [list((u.getInteger if version == 2 else u.getInt32)(states)) for u in (one, other)]
        assert found[0] == found[1], k
        if version == 2:
            orders = [1 + k % 3] * len(smooth)
            pairs = zip(*(u.getRealOutputDerivatives(smooth, orders) for u in (one, other)), strict=True)
            assert all(abs(is_ - was) <= 1e-7 * max(1.0, abs(is_)) for is_, was in pairs), k
    for unit_, folder in ((one, place), (other, compiled)):
        unit_.terminate()
        unit_.freeInstance()
        shutil.rmtree(folder)


def test_what_the_sources_cannot_do_is_refused(root: Path, tmp_path: Path) -> None:
    """Their numbers are fixed: one that is set to another value is an error, and the instance lives on."""
    unit = export(root / PAPER, tmp_path / "unit.fmu", 3)
    one, place = sources_of(unit, 3)
    references = {v.name: v.valueReference for v in read_model_description(unit).modelVariables}
    for name, value in [("cart.mass", 1.0), ("command", float("nan"))]:
        with pytest.raises(fmpy.fmi1.FMICallException):
            one.setFloat64([references[name]], [value])
    one.setFloat64([references["cart.mass"]], [0.362])
    for size in (0.0, -1.0, float("nan")):
        with pytest.raises(fmpy.fmi1.FMICallException):
            one.doStep(0.0, size)
    one.doStep(0.0, 0.1)
    one.terminate()
    one.freeInstance()
    with pytest.raises(Exception, match="nstantiat"):
        simulate_fmu(place, fmi_type="ModelExchange", stop_time=0.1)
    shutil.rmtree(place)


def test_the_package_exports_the_units_of_the_program(root: Path, tmp_path: Path) -> None:
    """``taut.export`` writes what ``taut export fmu`` does, but for the icon, and it runs."""
    import taut as package

    unit = export(root / PAPER, tmp_path / "unit.fmu", 3)
    (own,) = package.export(root / PAPER, "fmu", tmp_path / "own.fmu")
    with zipfile.ZipFile(unit) as one, zipfile.ZipFile(own) as other:
        assert set(one.namelist()) - set(other.namelist()) == {"terminalsAndIcons/icon.png"}
        assert one.read("modelDescription.xml") == other.read("modelDescription.xml")
    result = simulate_fmu(str(own), stop_time=0.5, input=signal(JUMPS), output=["cart_position"])
    assert result["cart_position"][-1] > 0.05


def test_a_stepper_is_the_machine_of_the_program(root: Path, tmp_path: Path) -> None:
    """A held command goes to the nearest microstep in co-simulation. Model exchange has no microsteps: it is near the
    program with the finest ones, in half of one (0.1 um of belt) and what the integrator adds."""
    text = (root / "stages/stepper-axis/stepper-axis.toml").read_text()
    text = text[: text.index("[[experiment]]")]
    times = [k * 1e-4 for k in range(1201)]
    held = [0.01 * (1 - np.cos(10 * np.pi * t)) if t < 0.1 else 0.02 for t in times]
    (tmp_path / "command.csv").write_text(
        "time_s,command_m\n" + "".join(f"{t!r},{float(u)!r}\n" for t, u in zip(times, held, strict=True))
    )
    file = '{ file = "command.csv", time = "time_s", column = "command_m", hold = "zero" }'
    case = tmp_path / "held.toml"
    case.write_text(f'{text}[[experiment]]\nname = "held"\nuntil = 0.12\nevery = 1e-4\ninput = {file}\n')
    wanted = rows(case, tmp_path / "rows", "held.csv")
    for version in (2, 3):
        unit, references, place = slave(export(case, tmp_path / f"{version}.fmu", version), version)
        command = [references["command"]]
        (read, write) = (unit.getReal, unit.setReal) if version == 2 else (unit.getFloat64, unit.setFloat64)
        off = 0.0
        for k, value in enumerate(held[:-1]):
            write(command, [float(value)])
            unit.doStep(times[k], times[k + 1] - times[k])
            off = max(off, abs(read([references["cart_position"]])[0] - wanted["cart_position_m"][k + 1]))
        assert off <= SAME, off
        unit.terminate()
        unit.freeInstance()
        shutil.rmtree(place)
    line = [(0.0, 0.0), (0.05, 5e-3), (0.1, 5e-3)]
    points = ", ".join(f"[{t}, {u}]" for t, u in line)
    case = tmp_path / "line.toml"
    table = f"{{ table = [{points}] }}"
    case.write_text(f'{text}[[experiment]]\nname = "line"\nuntil = 0.1\nevery = 1e-3\ninput = {table}\n')
    wanted = rows(case, tmp_path / "fine", "line.csv", "stepper.microsteps=1024")
    result = simulate_fmu(
        export(case, tmp_path / "line.fmu", 3),
        fmi_type="ModelExchange",
        stop_time=0.1,
        output_interval=1e-5,
        relative_tolerance=1e-6,
        input=signal(line),
        output=["cart_position"],
    )
    reached = np.interp(wanted["time_s"], result["time"], result["cart_position"])
    assert np.max(np.abs(reached - wanted["cart_position_m"])) < 5e-7
