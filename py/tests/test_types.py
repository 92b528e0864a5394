"""Types of dictionaries and words: they have to be those that come out and are taken."""

from __future__ import annotations

import re
import types as python_types
from typing import Any, get_args, get_origin, get_type_hints, is_typeddict

import pytest

import taut
from conftest import ROOT

STAGE = f"{ROOT}/stages/sollmann-jouaneh"


def fits(value: Any, hint: Any) -> bool:
    """True if a value is of an annotated type."""
    if is_typeddict(hint):
        hints = get_type_hints(hint)
        known = isinstance(value, dict) and all(key in hints and fits(one, hints[key]) for key, one in value.items())
        return known and hint.__required_keys__ <= set(value)
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is list:
        return isinstance(value, list) and all(fits(one, arguments[0]) for one in value)
    if origin is dict:
        return isinstance(value, dict) and all(fits(one, arguments[1]) for one in value.values())
    if origin is python_types.UnionType:
        return any(fits(value, one) for one in arguments)
    if hint is float:
        return isinstance(value, (float, int)) and not isinstance(value, bool)
    return type(value) is hint


RUNS = {
    "axis": lambda: taut.read(f"{STAGE}/table4.toml").simulate(),
    "a move": lambda: taut.read(f"{STAGE}/controllers/pid.toml").move(),
    "gantry": lambda: taut.read(f"{ROOT}/stages/core-xy/core-xy.toml").simulate(),
    "H-frame": lambda: taut.read(f"{ROOT}/stages/h-frame/h-frame.toml").simulate(),
    "dual belt": lambda: taut.read(f"{ROOT}/stages/dual-belt/dual-belt.toml").simulate(),
    "a path of three drives": lambda: taut.read(f"{ROOT}/stages/dual-belt/square.toml").move(),
    "a path": lambda: taut.read(f"{ROOT}/stages/core-xy/square.toml").move(),
}


@pytest.mark.parametrize("kind", RUNS)
def test_figures_and_events_have_their_types(kind):
    hints = get_type_hints(taut.types.Metrics)
    for run in RUNS[kind]():
        for key, value in run.metrics.items():
            assert key in hints, f"{kind}: {key} is not in Metrics"
            assert fits(value, hints[key]), f"{kind}: {key} is {value}, of {hints[key]}"
        for event in run.events:
            assert fits(event, taut.types.Event), f"{kind}: {event}"


def test_what_does_not_fit_is_found():
    assert not fits({"value": 1.0}, taut.types.Peak)
    assert not fits({"value": 1.0, "time_s": "now"}, taut.types.Peak)
    assert not fits({"value": 1.0, "time_s": 0.0, "more": 1.0}, taut.types.Peak)


CASE = taut.Case(taut.template())
WORDS = [
    (taut.types.Solver, lambda word: CASE.simulate(solver=word)),
    (taut.types.Method, lambda word: CASE.simulate(solver="table3", step=1e-4, method=word)),
    (taut.types.Hold, lambda word: CASE.modes(sample_time=1e-3, hold=word)),
    (taut.types.Criterion, lambda word: CASE.design(criterion=word)),
    (taut.types.Excitation, lambda word: CASE.design(["cart.mass"], inputs=[word])),
    (taut.types.Law, lambda word: CASE.changed({"fit": {"free": ["cart.mass"]}}).compare(word)),
    (taut.types.Direction, lambda word: taut.shape("nowhere.csv", axis=word)),
    (taut.types.DriveState, lambda word: taut.shape("nowhere.csv", motor=word)),
    (taut.types.SweepSolver, lambda word: taut.sweep(CASE, 10, vary={"cart.mass": "2 %"}, solver=word)),
    (taut.types.SweepDesign, lambda word: taut.sweep(CASE, design=word)),
    (taut.types.Target, lambda word: taut.export(CASE, word, "nowhere")),
    (taut.types.Part, lambda word: taut.export(CASE, "c", "nowhere", part=word)),
    (taut.types.Real, lambda word: taut.export(CASE, "c", "nowhere", real=word)),
    (taut.types.Firmware, lambda word: taut.shape("nowhere.csv", firmware=word)),
]


@pytest.mark.parametrize(("words", "call"), WORDS)
def test_a_word_that_is_not_allowed_is_answered_with_those_that_are(words, call):
    with pytest.raises(ValueError) as told:
        call("nonsense")
    text = str(told.value).replace("nonsense", "")
    # The words of the sentence that lists them, and no other.
    listed = re.search(r"(?:none of|allowed:|expected) (.*?)(?:, found.*)?$", text, re.MULTILINE)
    found = re.split(r", | or ", listed.group(1).replace('"', ""))
    assert sorted(found) == sorted(get_args(words)), text


WRONG = {
    "an experiment": (lambda: CASE.simulate("no such experiment"), "experiment= "),
    "a move": (lambda: CASE.move("no such move"), None),
    "a criterion": (lambda: CASE.design(criterion="nonsense"), None),
    "an interval": (lambda: taut.sweep(CASE, interval="nonsense"), None),
    "draws": (lambda: CASE.tune(draws="no such file.csv"), None),
    "a change": (lambda: CASE.changed({"cart.mass": "0.5 m"}), 'change:1:11: cart.mass: "0.5 m" is a length'),
    "a key": (lambda: CASE.changed({"": 1}), 'key: expected the key of a value, such as "cart.mass"'),
    "parameters": (lambda: CASE.design(), 'names=["cart.mass", "cart.friction.coulomb"]'),
    "a sweep": (lambda: CASE.sweep(), 'n=1000, vary={"cart.mass": "20%"}'),
    "a range": (lambda: CASE.modes(lowest=100, highest=10), "lowest, highest: "),
    "a solver": (lambda: CASE.simulate(tolerance=1e-9, solver="exact"), 'solver="general"'),
    "a part": (lambda: taut.export(CASE, "fmu", "nowhere.fmu", part="controller"), "part="),
    "a machine": (lambda: taut.export(CASE, "st", "nowhere"), '`taut.export(case, "fmu", ...)`'),
    "an empty case": (lambda: taut.Case(""), "`taut.template()`"),
    "spectra": (lambda: taut.shape("nowhere.csv", belts=True), "belts: 1 file"),
    "tuning": (lambda: CASE.changed({"tune": {"spread": -1}}), None),
}

@pytest.mark.parametrize("what", WRONG)
def test_errors_name_arguments_as_python_has_them(what):
    call, part = WRONG[what]
    with pytest.raises(ValueError) as told:
        call()
    # Commands between backquotes write files.
    text = re.sub(r"`[^`]*`", "", str(told.value))
    assert not re.search(r"(^|[^\w-])--[a-z]", text), str(told.value)
    assert part is None or part in str(told.value), str(told.value)
