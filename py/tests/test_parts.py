"""Controllers and moves as objects: their fields are the rows of the table of the case file, and they write and read
the same case as dictionaries do."""

from __future__ import annotations

import ast
import re
import textwrap

import pytest

import taut
from conftest import ROOT
from taut.controllers import Cascade, Controller, CurrentLoop, DisturbanceObserver, FeedForward, Fuzzy, LowPass, Notch, Pid, SlidingMode, StateFeedback
from taut.moves import Move, Plan, Point

STAGE = f"{ROOT}/stages/sollmann-jouaneh"
CONTROLLERS = sorted(path.stem for path in (ROOT / "stages/sollmann-jouaneh/controllers").glob("*.toml"))


def rows(section):
    """The rows of a table of docs/case-file.md: key, unit, default, meaning."""
    text = (ROOT / "docs/case-file.md").read_text(encoding="utf-8")
    table = re.search(rf"<!-- parameters: {section} -->\n(.*?)<!-- end -->", text, re.DOTALL).group(1)
    for line in table.splitlines()[2:]:
        key, _, unit, default, _, _, meaning = (cell.strip() for cell in line.strip("| ").split(" | "))
        yield key.strip("`"), unit, default, meaning


def fields(module):
    """By class, the annotated fields with the strings below them, and whether each has a default."""
    tree = ast.parse((ROOT / "py/python/taut" / f"{module}.py").read_text(encoding="utf-8"))
    found = {}
    for node in tree.body:
        if isinstance(node, ast.ClassDef):
            pairs = zip(node.body, node.body[1:])
            found[node.name] = {
                field.target.id.rstrip("_"): (" ".join(ast.literal_eval(below.value).split()), field.value is not None)
                for field, below in pairs
                if isinstance(field, ast.AnnAssign) and isinstance(below, ast.Expr)
            }
    return found


CLASSES = {
    "controller": {
        "": "Controller", "pid": "Pid", "cascade": "Cascade", "cascade.current": "CurrentLoop", "state_feedback": "StateFeedback",
        "sliding_mode": "SlidingMode", "fuzzy": "Fuzzy", "feed_forward": "FeedForward", "disturbance_observer": "DisturbanceObserver",
        "filters": "Notch",
    },
    "move": {"": "Move", "plan": "Plan", "points": "Point"},
}  # fmt: skip
ELSEWHERE = {"fuzzy.rule", "shaper.time", "shaper.amplitude", "filters.low_pass"}
"""Values of lists, which have no field of their own, and the field of the other filter."""
REQUIRED_BY_CLASS = {"filters.notch"}
"""One of two keys in the file, each of which has a class here."""
OPTIONAL_BY_CLASS = {("controller", "every")}
"""Steppers do without."""


@pytest.mark.parametrize(("section", "module"), [("controller", "controllers"), ("move", "moves")])
def test_fields_are_the_rows_of_the_case_file(section, module):
    known = fields(module)
    for key, unit, default, meaning in rows(section):
        if key in ELSEWHERE:
            continue
        table, _, name = key.rpartition(".")
        text, has_default = known[CLASSES[section][table]][name]
        required = default == "required" or key in REQUIRED_BY_CLASS
        if (section, key) in OPTIONAL_BY_CLASS:
            assert has_default and text == "Sample time; required except for a stepper. [s]"
            continue
        notes = [*([unit] if unit != "–" else []), *([] if required else [f"default: {default}"])]
        expected = " ".join([meaning, *([f"[{'; '.join(notes)}]"] if notes else [])]).replace("`", "``")
        assert (text, has_default) == (expected, not required), key


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_controller_that_is_read_and_written_is_the_same(name):
    case = taut.read(f"{STAGE}/controllers/{name}.toml")
    controller = Controller.of(case)
    moves = [Move.of(case, move) for move in case.moves]
    again = case.changed({"controller": controller, "move": moves})
    assert Controller.of(again) == controller
    assert [Move.of(again, move) for move in again.moves] == moves
    move = case.moves[0]
    assert (again.move(move)["cart_position"] == case.move(move)["cart_position"]).all()


def test_all_parts_are_written(case):
    cascade = Cascade(position="60 rad/s", speed="16 A s/m", current=CurrentLoop(proportional="0.1 V/A", integral="400 V/(A s)"))
    controller = Controller(
        cascade,
        every="1 ms",
        delay=5e-4,
        limit="24 V",
        feed_forward=FeedForward("elastic", friction=0.8),
        disturbance_observer=DisturbanceObserver("8 Hz"),
        filters=[Notch("190 Hz", depth=0.1), LowPass("300 Hz")],
        shaper=[(0, 0.5), ("2.6 ms", 0.5)],
    )
    limits = {"speed": "0.3 m/s", "acceleration": "5 m/s^2", "until": "1.5 s"}
    moves = [
        Move("points", points=["20 mm", Point("10 mm", speed="50 mm/s", wait="0.1 s"), 0.0], from_="1 mm", **limits),
        Move("code", gcode="G1 X20 F6000\nG0 X0", **limits),
        Move("planned", to="50 mm", plan=Plan(reserve=0.2), until="1 s", window="50 um"),
    ]
    case.update({"controller": controller, "move": moves})
    assert case["controller.cascade.current.proportional"] == 0.1
    assert case["controller.shaper"] == [[0, 0.5], ["2.6 ms", 0.5]]
    assert Controller.of(case).filters == [Notch(190.0, depth=0.1), LowPass(300.0)]
    assert Move.of(case, "points").points[1] == Point(0.01, speed=0.05, wait=0.1)
    assert Move.of(case, "planned").plan == Plan(reserve=0.2)
    for structure in (
        StateFeedback(position="0.5 mm", command="1 V", disturbance="0.3 V"),
        SlidingMode(bandwidth="15 rad/s", reaching="7 m/s^2", boundary="0.7 m/s"),
        Fuzzy(error="2 mm", rate="0.6 m/s", command="8 V", rules=[[-1, -0.5, 0], [-0.5, 0, 0.5], [0, 0.5, 1]]),
    ):
        assert type(Controller.of(case.changed({"controller": Controller(structure, every=1e-3, limit="24 V")})).structure) is type(structure)


def test_a_move_takes_a_controller_as_an_object():
    case = taut.read(f"{STAGE}/controllers/pid.toml")
    controller = Controller(Pid(proportional="1 V/mm", derivative="5 V s/m"), every="1 ms", limit="12 V")
    name = case.moves[0]
    run = case.move(name, controller=controller)
    assert (run["cart_position"] == case.changed({"controller": controller}).move(name)["cart_position"]).all()
    assert case.move(name).metrics["cart_error"] != run.metrics["cart_error"]
    with pytest.raises(TypeError, match="go with a controller of your own"):
        case.move(name, controller=controller, every=1e-3)


def test_wrong_parts_are_errors_of_the_case(case):
    assert Controller.of(case) is None
    with pytest.raises(KeyError, match="there is no move 'there'; there are none"):
        Move.of(case, "there")
    with pytest.raises(taut.Error, match="controller.every"):
        case["controller"] = Controller(Pid(proportional=1.0))
    with pytest.raises(taut.Error, match=r'"2 mm" is a length'):
        case["controller"] = Controller(Pid(proportional="2 mm"), every="1 ms")
    with pytest.raises(TypeError, match="proportional"):
        Pid()
    both = textwrap.dedent(
        """
        [controller]
        every = "1 ms"
        pid = { proportional = 1 }
        cascade = { position = 1, speed = 1 }
        """
    )
    with pytest.raises(taut.Error, match="the structure is pid already"):
        taut.Case(case.text + both)
