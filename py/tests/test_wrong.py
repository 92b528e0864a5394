"""Everything public with wrong types, wrong numbers, wrong shapes and controllers that misbehave: documented exceptions
only.

What may come out stands in docs/python.md under "Exceptions". A panic would be ``taut.Bug``, and what gets past that
``PanicException``: neither may come. The draws are seeded; ``TAUT_WRONG=10000`` makes more of them, ``TAUT_SEED``
others.
"""

from __future__ import annotations

import _thread
import copy
import math
import os
import pathlib
import pickle
import random
import threading
import time

import numpy as np
import pytest

import taut
from conftest import ROOT

SEED = int(os.environ.get("TAUT_SEED", "1"))
MANY = int(os.environ.get("TAUT_WRONG", "400"))

DOCUMENTED = (taut.Error, TypeError, ValueError, KeyError, IndexError, RecursionError)
"""``taut.Bug`` is a RuntimeError, and so is RecursionError, which a controller that runs itself brings about."""


def allowed(call, told):
    """Calls; what comes out has to be a result or one of the documented exceptions, with a text."""
    try:
        return call()
    except DOCUMENTED as exception:
        assert not isinstance(exception, taut.Bug), told
        assert str(exception), told
        return None
    except BaseException as exception:  # PanicException is none of Exception
        raise AssertionError(f"{told}: {type(exception).__name__}: {exception}") from exception


class Liar:
    """A number that is none when it is asked."""

    def __float__(self):
        raise ValueError("no number today")

    def __index__(self):
        return "seven"

    def __fspath__(self):
        return 7


class Tolist:
    """Says that it is an array."""

    def tolist(self):
        return self


ENDLESS: list = []
ENDLESS.append(ENDLESS)
DEEP: list = []
for _ in range(500):
    DEEP = [DEEP]

NUMBERS = [
    float("nan"), float("inf"), float("-inf"), -1.0, -0.0, 0, 1, 5e-324, 1e-300, 1e-15, 1e-9, 1e-3, 0.05, 0.2, 1.0, 7.5, 1e3, 1e9, 1e15,
    1e300, 2**31, 2**53 + 1, 2**63, 2**64, 10**30, 10**400, -(10**400), np.float32(0.5), np.int64(-3), np.float64("nan"), True, False,
]  # fmt: skip
THINGS = [
    None, "", " ", "5", "5 V", "nan", "5 parsecs", "\0", "\ud800", "µ" * 300, "a\nb", "[", "{", '"', "=", "cart", "exact", "zero", b"x",
    bytearray(b"y"), (), [], {}, [None], [1, "2"], ["5 V pulse"], {"pulse": 5}, {5: 6}, {"": 1}, {1, 2}, object(), object, len, Liar(),
    Tolist(), ENDLESS, DEEP, np.array([]), np.array([[1.0, 2.0]]), np.array(["x"]), np.zeros((3, 3)), range(3), 1 + 2j, float, taut,
    pathlib.Path("x"), Ellipsis, lambda *_: 1,
]  # fmt: skip
WRONG = NUMBERS + THINGS


def shown(value):
    """Short, whatever it is."""
    return ascii(value)[:60] if isinstance(value, (int, float, str, bytes)) else type(value).__name__


def told(name, *arguments, **options):
    """The call in words."""
    given = [shown(a) for a in arguments] + [f"{key}={shown(value)}" for key, value in options.items()]
    return f"{name}({', '.join(given)})"


@pytest.fixture
def short(case):
    """A case whose calls take milliseconds."""
    return case.changed({"experiment.0.until": 0.02, "experiment.0.every": 0.001, "experiment.1.until": 0.02})


MOVING = """
[controller]
every = "1 ms"
limit = "12 V"
pid   = { proportional = "2 V/mm", derivative = "10 V s/m", filter = "200 Hz" }

[[move]]
name         = "5 mm"
to           = "5 mm"
speed        = "0.3 m/s"
acceleration = "5 m/s^2"
until        = "0.15 s"
"""


@pytest.fixture
def moving(short):
    """One that moves in closed loop."""
    return taut.Case(short.text + MOVING)


def test_a_limit_that_is_none_is_told_and_no_panic(moving):
    """A limit of NaN, or a negative one, ended in a panic: the library clamps with it."""
    idle = lambda position, reference: 1.0  # noqa: E731
    for limit in float("nan"), -5.0, -0.0, 0, float("inf"):
        with pytest.raises(taut.Error) as caught:
            moving.move("5 mm", controller=idle, limit=limit)
        assert str(caught.value) == (
            f"the limit of the command cannot be {'NaN' if math.isnan(limit) else float(limit)}\n"
            "  allowed: above zero, in V or A; none at all"
        )
    for option, value, text in [
        ("every", float("nan"), "a loop cannot be sampled every NaN s\n  allowed: above zero"),
        ("every", -1e-3, "a loop cannot be sampled every -0.001 s\n  allowed: above zero"),
        ("every", 1e-12, "a sample every 1e-12 s makes 1.5e11 of them in 0.15 s\n  allowed: up to 1e9"),
        ("delay", float("nan"), "a command cannot be NaN s late\n  allowed: from zero to 1000 sample times"),
        ("delay", 1e9, "a command cannot be 1000000000.0 s late\n  allowed: from zero to 1000 sample times"),
    ]:
        with pytest.raises(taut.Error) as caught:
            moving.move("5 mm", controller=idle, **{option: value})
        assert str(caught.value).startswith(text)


def test_arrays_are_read_only(case):
    """A column that was written to changed what `write` put into files, beside key figures of the run as it was."""
    run = case.simulate("5 V pulse")
    last = run["cart_position"][-1]
    for name in run:
        assert not run[name].flags.writeable, name
    with pytest.raises(ValueError, match="read-only"):
        run["cart_position"][-1] = 5.0
    with pytest.raises(ValueError, match="read-only"):
        run["cart_position"] *= 2
    with pytest.raises(ValueError, match="cannot set WRITEABLE flag"):
        run["cart_position"].flags.writeable = True
    table = case.sweep(3, vary={"cart.mass": "20 %"}, seed=1)
    assert not any(table[name].flags.writeable for name in table)
    # What one computes from them is one's own.
    doubled = 2 * run["cart_position"]
    doubled[0] = 1.0
    assert run["cart_position"].copy().flags.writeable and run["cart_position"][-1] == last == run.metrics["final_cart_position_m"]


def test_tables_over_the_same_memory_cannot_change_it(case):
    run = case.simulate("5 V pulse")
    before = run["cart_position"].copy()
    if pytest.importorskip("pyarrow"):
        assert not run.to_arrow().column("cart_position_m").to_numpy().flags.writeable
    if pytest.importorskip("polars"):
        assert not run.to_polars()["cart_position_m"].to_numpy().flags.writeable
    frame = pytest.importorskip("pandas") and run.to_pandas()
    assert not frame["cart_position_m"].to_numpy().flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        frame.loc[0, "cart_position_m"] = 5.0
    # A frame may have other columns, and a copy is one's own.
    frame["cart_position_m"] *= 2
    own = run.to_pandas().copy()
    own.loc[0, "cart_position_m"] = 5.0
    assert np.array_equal(run["cart_position"], before)


def test_a_bug_is_an_exception_by_name(capfd):
    """A panic came out as PanicException, which `except Exception` lets through: one bad row ended a night of runs."""
    with pytest.raises(taut.Bug) as caught:
        taut._native.fail_as_a_bug("the index 7 is past the end")
    assert issubclass(taut.Bug, RuntimeError) and not issubclass(taut.Bug, taut.Error)
    assert str(caught.value) == (
        "this is a bug in taut: the index 7 is past the end\n"
        "  next: report it with the case and the call; the standard error says where it happened"
    )
    # Nothing is hidden.
    assert "panicked at" in capfd.readouterr().err


def test_seeds_beyond_a_double_are_seeds(case):
    """A seed above 2^53 was refused; all whole numbers that TOML has are seeds now, to the last digit."""
    vary = {"cart.mass": "20 %"}
    seeds = [2**53, 2**53 + 1, 2**63 - 2, 2**63 - 1]
    drawn = [tuple(case.sweep(3, vary=vary, seed=seed)["cart.mass"]) for seed in seeds]
    assert len(set(drawn)) == len(seeds)
    for seed in -1, 2**63, 1.5:
        with pytest.raises(taut.Error, match="whole number from 0 to 9223372036854775807|TOML"):
            case.sweep(3, vary=vary, seed=seed)


def test_tables_larger_than_the_memory_are_refused(case):
    """They were begun, and the system ended the interpreter."""
    with pytest.raises(taut.Error, match=r"more than this machine's memory\n.*\n  next: taut.sweep_tables"):
        case.sweep(10**12, vary={"all": "20 %"})
    # No more than 1e9 rows, says the case; here they meet a machine of any size.
    long = case.changed({"experiment.0.until": 1e6, "experiment.0.every": 1e-3})
    if os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") < 1.9e11:
        with pytest.raises(taut.Error, match=r"more than this machine's memory\n.*\n  next: take a longer interval"):
            long.simulate("5 V pulse")


def test_cases_from_nonsense():
    draw = random.Random(SEED)
    for value in WRONG:
        allowed(lambda: taut.Case(value), told("Case", value))
        allowed(lambda: taut.Case(taut.template(), value), told("Case", "…", value))
        allowed(lambda: taut.read(value), told("read", value))
    # The template with letters and lines exchanged, doubled and lost.
    text = taut.template()
    for number in range(MANY):
        letters = list(text)
        for _ in range(draw.choice([1, 1, 2, 5, 20])):
            place = draw.randrange(len(letters))
            letters[place] = draw.choice(["", "[", "]", '"', "\n", "=", "0", "9e9", "-", "{", "}", "é", "#", ".", " m", letters[-place], "\0"])
        mutant = "".join(letters)
        case = allowed(lambda: taut.Case(mutant), f"mutant {number}")
        if case is not None:
            allowed(lambda: [repr(case), case._repr_html_(), case.moves, hash(case), case == case.copy()], f"mutant {number}")


def test_overviews_with_nonsense(short):
    for value in WRONG:
        allowed(lambda: taut.show(value), told("show", value))
        allowed(lambda: short.show()[value], told("shown[]", value))


def test_shapers_with_nonsense():
    case = ROOT / "stages/printer-axis/printer-axis.toml"
    for value in WRONG:
        allowed(lambda: taut.shape(value), told("shape", value))
        for option in ("firmware", "axis", "damping", "max_smoothing", "max_vibrations", "corner_speed", "shapers", "uncertainty", "motor", "changes"):
            allowed(lambda: taut.shape(case, **{option: value}), told("shape", **{option: value}))


def test_values_of_nonsense(short):
    keys = [
        "cart.mass", "motor.resistance", "belt.stiffness", "belt", "motor", "experiment", "experiment.0", "experiment.0.input", "title",
        "experiment.0.until", "experiment.0.every", "experiment.0.name", "experiment.0.input.for", "cart.friction", "encoder", "travel",
        "experiment.9.until", "experiment.-1.until", "nowhere", "", ".", "a..b", "[", '"', "cart.mass.x", "belt.stiffness.0", "µ", "\0", "a=b",
        "sweep.seed", "sweep", "fit", "controller", "move", "amplifier.mode", "measurement", "experiment.0.input.pulse", "x" * 5000,
    ]  # fmt: skip
    for key in [*keys, *THINGS[:20], *NUMBERS[:5]]:
        allowed(lambda: short[key], told("case[]", key))
        allowed(lambda: short.get(key), told("case.get", key))
        allowed(lambda: key in short, told("in case", key))
        for value in WRONG:
            before = short.text
            case = short.copy()
            allowed(lambda: case.update({key: value}), told("case[] =", key, value))
            allowed(lambda: case.changed({key: value}), told("case.changed", key, value))
            assert short.text == before
    for value in WRONG:
        allowed(lambda: short.update(value) if hasattr(value, "items") else None, told("case.update", value))


def test_edited_to_nonsense_that_reads(short):
    """Values that the ranges allow, together as no machine has them: it runs, or says why not."""
    draw = random.Random(SEED + 1)
    numbers = [1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1, 10, 1e3, 1e6, 1e9, 1e12, 1e15]
    keys = [
        "cart.mass", "motor.resistance", "motor.torque_constant", "motor.back_emf_constant", "motor.inductance", "motor.rotor_inertia",
        "motor.gear_ratio", "drive_pulley.radius", "drive_pulley.inertia", "idler_pulley.inertia", "cart.friction.viscous",
        "cart.friction.coulomb", "cart.load", "amplifier.gain", "amplifier.voltage_limit", "amplifier.current_limit", "belt.pretension",
        "encoder.lines", "experiment.0.input.pulse", "experiment.0.input.for",
    ]  # fmt: skip
    ran = 0
    for number in range(MANY // 4):
        case = short.copy()
        given = {key: draw.choice(numbers) for key in draw.sample(keys, draw.choice([1, 2, 3, 6]))}
        name = f"{number}: {given}"
        if allowed(lambda: case.update(given) or True, name) is None:
            continue
        # No longer than a few thousand steps of what is fastest, so that stiff ones end soon.
        run = allowed(lambda: case.changed({"experiment.0.until": 1e-6, "experiment.0.every": 1e-7}).simulate("5 V pulse"), name)
        if run is not None:
            ran += 1
            allowed(lambda: [run.metrics, run.events, repr(run), run._repr_html_(), run.ending, run.rows], name)
    assert ran > MANY // 20


def test_simulations_with_nonsense(short, tmp_path):
    for value in WRONG:
        allowed(lambda: short.simulate(value), told("simulate", value))
        for option in "solver", "tolerance", "step", "method":
            allowed(lambda: short.simulate(**{option: value}), told("simulate", **{option: value}))
        for solver, option in ("general", "tolerance"), ("table3", "step"), ("table3", "method"):
            # A step that 1e12 of fit into the run is taken: it would take days.
            if option == "step" and isinstance(value, (int, float)) and 0 < value < 1e-7:
                continue
            call = {"solver": solver, option: value}
            allowed(lambda: short.simulate("5 V pulse", **call), told("simulate", **call))
    run, runs = short.simulate("5 V pulse"), short.simulate()
    table = taut.Table(dict(run), [(name, run.units[name], run.headings[name]) for name in run])
    for value in WRONG:
        allowed(lambda: run[value], told("run[]", value))
        allowed(lambda: runs[value], told("runs[]", value))
        allowed(lambda: run.write(value), told("run.write", value))
        allowed(lambda: run.plot(value), told("run.plot", value))
        allowed(lambda: taut.Run(value), told("Run", value))
        allowed(lambda: taut.Runs(value), told("Runs", value))
        allowed(lambda: run.plot(ax=value), told("run.plot", ax=value))
        allowed(lambda: runs.plot(value), told("runs.plot", value))
        allowed(lambda: table.plot(value), told("table.plot", value))
        allowed(lambda: table.plot("cart_speed", value, ax=value), told("table.plot", value))
        allowed(lambda: taut.Table(value, value), told("Table", value))
    for name in "", ".", "x", "x.csv/y.csv", "a\0.csv", "no/such/folder/run.csv", "run.csv", "run.parquet", "run.CSV", "é.csv":
        allowed(lambda: run.write(tmp_path / name), told("run.write", name))
        allowed(lambda: short.save(tmp_path / "saved" / name), told("case.save", name))
    for what in run, runs:
        allowed(lambda: pickle.dumps(what), "pickle")
        allowed(lambda: copy.deepcopy(what), "deepcopy")
    # Whoever exchanges the arrays inside is told.
    run._native.arrays["cart_position"] = np.zeros(3)
    with pytest.raises(taut.Error, match="not the same length"):
        run.write(tmp_path / "exchanged.csv")


def test_moves_with_nonsense(moving):
    steady = lambda position, reference: 100.0 * (reference - position)  # noqa: E731
    for value in WRONG:
        allowed(lambda: moving.move(value), told("move", value))
        if not callable(value):
            allowed(lambda: moving.move(controller=value), told("move", controller=value))
        for option in "every", "delay", "limit", "spread":
            allowed(lambda: moving.move("5 mm", **{option: value}), told("move", **{option: value}))
            # A sample each nanosecond is a long run, and not a wrong one.
            if option == "every" and isinstance(value, (int, float)) and 0 < value < 1e-4:
                continue
            allowed(lambda: moving.move("5 mm", controller=steady, **{option: value}), told("move", "own", **{option: value}))


class Odd:
    """A controller with one method that does as it is told."""

    def __init__(self, step=lambda seen: 0.0, limited=None, reset=None):
        self.step = step
        if limited is not None:
            self.limited = limited
        if reset is not None:
            self.reset = reset


def test_controllers_that_return_anything(moving):
    for value in WRONG:
        allowed(lambda: moving.move("5 mm", controller=lambda position, reference: value), told("controller", value))
        allowed(lambda: moving.move("5 mm", controller=Odd(lambda seen: value)), told("step", value))
        for method in "limited", "reset", "step":
            allowed(lambda: moving.move("5 mm", controller=Odd(**{method: value})), told("Odd", **{method: value}))
    for value, kind, text in [
        (10**400, ValueError, "at 0 s the controller's command is beyond any number in use"),
        ("5 V", TypeError, "at 0 s the controller's command is no number: str"),
        (None, TypeError, "at 0 s the controller's command is no number: NoneType"),
        (float("inf"), ValueError, "at 0 s the controller's command is inf"),
    ]:
        with pytest.raises(kind) as caught:
            moving.move("5 mm", controller=lambda position, reference: value)
        assert str(caught.value) == text
    # The wrong number of arguments.
    with pytest.raises(TypeError):
        moving.move("5 mm", controller=lambda: 0.0)
    # The largest numbers there are: the axis flies, or the run says that it diverged.
    for value in 1e300, -1e308, 5e-324:
        run = allowed(lambda: moving.move("5 mm", controller=lambda position, reference: value, limit=1e308), told("controller", value))
        assert run is None or run.ending in ("complete", "diverged", "too_many_events", "left_travel")


class Planned(Exception):
    """The error that a controller of the test raises."""


def test_controllers_that_raise_anywhere(moving):
    def broken(*_):
        raise Planned

    for method in "step", "limited", "reset":
        with pytest.raises(Planned):
            moving.move("5 mm", controller=Odd(**{method: broken}))
    for kind in KeyboardInterrupt, SystemExit, GeneratorExit, StopIteration, MemoryError:

        def leave(position, reference):
            raise kind

        with pytest.raises(kind):
            moving.move("5 mm", controller=leave)

    class Hidden:
        @property
        def step(self):
            raise Planned

    class Named:
        __name__ = property(broken)

        def step(self, seen):
            return 0.0

    class Unprintable:
        def __str__(self):
            raise Planned

        __repr__ = __str__

    class Unnamed:
        __name__ = Unprintable()

        def step(self, seen):
            return 0.0

    with pytest.raises(Planned):
        moving.move("5 mm", controller=Hidden())
    for controller in Named(), Unnamed():
        try:
            moving.move("5 mm", controller=controller)
        except Planned:
            pass


def test_controllers_that_come_back_in(moving):
    """A controller that runs, edits and reads the same case while it is stepped, and one that runs itself for ever."""
    seen = []

    def busy(position, reference):
        if len(seen) < 3:
            seen.append(moving.simulate("5 V pulse").rows)
            moving["cart.mass"] = 0.362 + 0.01 * len(seen)
            seen.append(moving.move("5 mm", controller=lambda p, r: 0.0).rows)
            moving.sweep(2, vary={"cart.mass": "1 %"}, threads=2)
        return 100.0 * (reference - position)

    assert moving.move("5 mm", controller=busy).ending == "complete"

    def endless(position, reference):
        return moving.move("5 mm", controller=endless)["cart_position"][-1]

    with pytest.raises(RecursionError, match="moves are nested 16 deep"):
        moving.move("5 mm", controller=endless)
    # It is over when it is over.
    assert moving.move("5 mm", controller=lambda p, r: 0.0).ending == "complete"
    # On other threads meanwhile.
    rows = []
    work = lambda: rows.append(moving.move("5 mm", controller=lambda p, r: 0.0).rows)  # noqa: E731
    threads = [threading.Thread(target=work) for _ in range(4)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert len(set(rows)) == 1 and len(rows) == 4


def test_modes_with_nonsense(short):
    for value in WRONG:
        for option in "at", "bridge", "speed", "stuck", "sample_time", "hold", "delay", "lowest", "highest":
            allowed(lambda: short.modes(**{option: value}), told("modes", **{option: value}))
        for option in "hold", "delay":
            call = {"sample_time": 1e-3, option: value}
            allowed(lambda: short.modes(**call), told("modes", **call))
    draw = random.Random(SEED + 2)
    for _ in range(MANY // 4):
        call = {name: draw.choice(NUMBERS) for name in draw.sample(["at", "speed", "sample_time", "delay", "lowest", "highest"], 3)}
        modes = allowed(lambda: short.modes(**call), told("modes", **call))
        if modes is not None:
            allowed(lambda: [repr(modes), modes._repr_html_(), modes.poles, modes.resonances], told("modes", **call))


def test_sweeps_with_nonsense(short):
    vary = {"cart.mass": "20 %"}
    for value in WRONG:
        # So many runs that they would take hours are not wrong.
        many = isinstance(value, (int, float)) and not isinstance(value, bool) and 1000 < value < 10**12
        if not many:
            allowed(lambda: short.sweep(value, vary=vary), told("sweep", value))
        for option in "vary", "design", "seed", "indices", "interval", "figures", "threads", "client", "chunk":
            # A row each nanosecond is long, and not wrong.
            if option == "interval" and isinstance(value, (int, float)) and 0 < value < 1e-4:
                continue
            call = {"vary": vary, option: value}
            allowed(lambda: short.sweep(2, **call), told("sweep", 2, **call))
            if option not in ("threads", "client"):
                allowed(lambda: list(taut.sweep_tables(short, 2, client=object(), **call)), told("sweep_tables", **call))
        for key in "cart.mass", "", value:
            allowed(lambda: short.sweep(2, vary={key: value}), told("sweep", vary=(key, value)))
        allowed(lambda: taut.sweep(value, 2, vary=vary), told("taut.sweep", value))
    native = taut._native.Sweep(short.changed({"sweep.runs": 3, "sweep.vary": vary})._native)
    for first, count, threads in [(0, 10**9, 10**6), (2**63, 2**63, 2), (3, 1, 1), (2, 0, 2), (1, 1, 0)]:
        rows, _ = native.rows(first, count, threads)
        assert len(next(iter(rows.values()), ())) == len(range(*slice(min(first, 3), min(first + count, 3)).indices(3)))


def logged(case, folder):
    """A case with a log in that folder, and what to fit to it."""
    case.simulate("5 V pulse").write(folder / "pulse.csv")
    table = """
[[experiment]]
name = "log"
log  = { file = "pulse.csv", time = "time_s", input = "voltage_V", drive_angle = "drive_angle_rad" }

[fit]
free = ["cart.friction.viscous"]
"""
    return taut.Case(case.text + table, folder / "case.toml")


def test_fits_with_nonsense(case, tmp_path):
    fitted = logged(case.changed({"experiment.0.until": 0.1}), tmp_path)
    for value in WRONG:
        size = isinstance(value, (int, float)) and not isinstance(value, bool) and value > 20
        for option in "draws", "chains":
            # Values that could be are long, and not wrong.
            if not size or value > 10**9:
                call = {option: value, "posterior": True, "draws" if option == "chains" else "chains": 1}
                allowed(lambda: fitted.fit(**call), told("fit", **call))
    with pytest.raises(taut.Error, match=r"1000000 chains cannot be\n  allowed: from 1 to 100"):
        fitted.fit(posterior=True, chains=10**6)
    with pytest.raises(taut.Error, match=r"2147483648 draws of each of 4 chains cannot be\n  allowed: from 1 to 2500000"):
        fitted.fit(posterior=True, draws=2**31)
    fit = fitted.fit()
    for value in WRONG:
        allowed(lambda: fit[value], told("fit[]", value))
        # None and nothing at all are the default laws, which take long.
        if value is not None and not (hasattr(value, "__len__") and len(value) == 0):
            allowed(lambda: fitted.compare(value), told("compare", value))
        allowed(lambda: fitted.frf(segment=value), told("frf", segment=value))
        allowed(lambda: fitted.frf(period=value), told("frf", period=value))
    with pytest.raises(taut.Error):
        case.drift()
    with pytest.raises(taut.Error, match="no experiment has a log"):
        case.force_map()


def test_designs_with_nonsense(short):
    names = ["cart.mass"]
    options = ("duration", "every", "margin", "doubt", "model_error", "amplitude", "current", "travel", "verify", "criterion", "inputs", "measured")
    for value in THINGS:
        for option in options:
            call = {"duration": 0.02, "inputs": ["trapezoid"], "travel": 0.05, option: value}
            allowed(lambda: short.design(names, **call), told("design", **call))
        allowed(lambda: short.design(value, duration=0.02, inputs=["trapezoid"]), told("design", value))
    with pytest.raises(taut.Error, match=r'there is no input "square"\n  allowed: trapezoid, sweep, chirp, multisine, prbs'):
        short.design(names, inputs=["square"])
    with pytest.raises(taut.Error, match=r"a duration of NaN cannot be\n  allowed: above 0"):
        short.design(names, duration=float("nan"))
    with pytest.raises(taut.Error, match=r"`cart.mas`"):
        short.design(["cart.mas"])


def test_tunings_and_logs_with_nonsense(short, moving):
    for value in WRONG:
        if not isinstance(value, (int, float)):
            allowed(lambda: moving.tune(spread=value, evaluate=True), told("tune", spread=value))
            allowed(lambda: moving.plan("gone", speed=value), told("plan", speed=value))
            allowed(lambda: moving.plan("gone", reserve=value), told("plan", reserve=value))
        allowed(lambda: moving.learn(value, [0.0]), told("learn", value, "…"))
        allowed(lambda: moving.learn([0.0], value), told("learn", "…", value))
        allowed(lambda: moving.learn([0.0, 1.0], [0.0, 1.0], added=value), told("learn", added=value))
        allowed(lambda: moving.learn([0.0], [0.0], move=value), told("learn", move=value))
        allowed(lambda: short.tune(spread=value), told("tune without a controller", spread=value))
        allowed(lambda: short.with_log(value, {"t": [0.0, 1.0]}, {"time": "t"}), told("with_log", value))
        allowed(lambda: short.with_log("log", value, {"time": "t"}), told("with_log", "log", value))
        allowed(lambda: short.with_log("log", {"t": value}, {"time": "t"}), told("with_log", "log", {"t": value}))
        allowed(lambda: short.with_log("log", {"t": [0.0, 1.0]}, value), told("with_log", "log", "…", value))
        allowed(lambda: short.with_log("log", {"t": [0.0, 1.0]}, {"time": value}), told("with_log", "log", "…", {"time": value}))


def test_files_that_are_gone_or_something_else(case, tmp_path):
    fitted = logged(case.changed({"experiment.0.until": 0.1}), tmp_path)
    log = tmp_path / "pulse.csv"
    whole = log.read_bytes()
    draw = random.Random(SEED + 3)
    for number in range(MANY // 4):
        start, end = sorted(draw.sample(range(len(whole)), 2))
        log.write_bytes(draw.choice([whole[:start], whole[start:], whole[:start] + whole[end:], whole[:start] + os.urandom(8) + whole[end:], b""]))
        allowed(lambda: taut.Case(fitted.text, fitted.path), f"log {number}: {start}, {end}")
    log.unlink()
    with pytest.raises(taut.Error, match="there is no such file"):
        taut.Case(fitted.text, fitted.path).check()
    log.mkdir()
    with pytest.raises(taut.Error, match="pulse.csv"):
        taut.Case(fitted.text, fitted.path).check()
    # A case that was read has its logs, whatever becomes of the files.
    assert fitted.check().complete
    with pytest.raises(taut.Error):
        taut.read(tmp_path)
    with pytest.raises(taut.Error):
        fitted.save(tmp_path)


@pytest.mark.parametrize("what", ["move", "own controller", "spread", "fit", "posterior", "tune"])
def test_ctrl_c_ends_what_takes_long(case, moving, tmp_path, what):
    """Within two seconds of each processor, whatever else runs on them, and as a KeyboardInterrupt."""
    long = moving.changed({"move.0.until": 1000, "controller.every": "0.1 ms"})
    fitted = logged(case, tmp_path).changed({"fit.starts": 1000})
    drawn = fitted.changed({"fit.starts": 1})
    if what == "posterior":
        # Steps of an encoder: without any error there is nothing to draw from.
        log = np.genfromtxt(tmp_path / "pulse.csv", delimiter=",", names=True)
        columns = [log["time_s"], log["voltage_V"], log["drive_angle_rad"].round(2)]
        np.savetxt(tmp_path / "pulse.csv", np.transpose(columns), delimiter=",", header="time_s,voltage_V,drive_angle_rad", comments="")
        drawn = taut.Case(drawn.text, drawn.path)
    call = {
        "move": lambda: long.move("5 mm"),
        "own controller": lambda: long.move("5 mm", controller=lambda position, reference: 0.0),
        "spread": lambda: moving.changed({"move.0.until": 50}).move("5 mm", spread=0.1),
        "fit": lambda: fitted.fit(),
        "posterior": lambda: drawn.fit(posterior=True, draws=1_000_000),
        "tune": lambda: moving.tune(),
    }[what]
    timer = threading.Timer(0.5, _thread.interrupt_main)
    timer.start()
    began = time.process_time()
    with pytest.raises(KeyboardInterrupt):
        call()
    processors = 1 if what in ("move", "own controller") else os.cpu_count() or 1
    # A tuning judges what it has before it ends.
    assert time.process_time() - began < (10.0 if what == "tune" else 2.5) * processors
    timer.join()


def test_everything_public_is_called_here():
    """A new method has to come into this file."""
    source = pathlib.Path(__file__).read_text(encoding="utf-8")
    called = {
        "Case": [
            "changed", "check", "compare", "copy", "design", "drift", "fit", "force_map", "frf", "get", "learn", "modes", "move", "plan", "save", "show", "simulate", "sweep",
            "tune", "update", "with_log",
        ],  # fmt: skip
        "Run": ["plot", "write"],
        "Table": ["plot", "to_arrow", "to_pandas", "to_polars"],
    }
    for name, methods in called.items():
        kind = getattr(taut, name)
        public = [key for key, member in vars(kind).items() if callable(member) and not key.startswith("_")]
        assert sorted(public) == methods
        assert all(f".{method}(" in source for method in methods)
    assert {name for name in taut.__all__ if callable(getattr(taut, name)) and not isinstance(getattr(taut, name), type)} == {
        "export", "read", "shape", "show", "sweep", "sweep_tables", "template",
    }  # fmt: skip
