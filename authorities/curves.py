"""Curved friction and stretching spans: tests/authorities/curves.json.

Stribeck curves in their three shapes, Simscape's smooth law, LuGre, friction along the travel and a belt that follows
the cart, on the stage of Table 4. Solved and judged as in elements.py.
"""

from __future__ import annotations

import argparse
import copy
import time
from pathlib import Path

from casefile import toml
from elements import judge, report, summary, write

OUTPUT = Path(__file__).resolve().parents[1] / "tests" / "authorities" / "curves.json"
LIMITS = {"position_m": 1e-10, "angle_rad": 5e-9, "event_s": 1e-9}
MOST_EVENTS = 250

TABLE_4 = {
    "title": "",
    "motor": {"torque_constant": 0.023, "back_emf_constant": 0.023, "resistance": 0.71},
    "drive_pulley": {"radius": 0.0194, "inertia": 6.3e-5, "friction": {"viscous": 0.0016, "coulomb": 0.015}},
    "idler_pulley": {"inertia": 6.3e-5, "friction": {"viscous": 0.0016, "coulomb": 0.015}},
    "cart": {"mass": 0.362, "friction": {"viscous": 19.0424, "coulomb": 0.2}},
    "belt": {"stiffness": [1.3276e5, 1.3276e5, 5.8885e4]},
}
BODIES = ("drive_pulley", "cart", "idler_pulley")
FOLLOWS = {"modulus": 8.335e9, "section": 5.5626e-6, "spans": [0.34925, 0.34925, 0.7874], "follows_cart": True}


def pulse(volts, length=0.25):
    return {"pulse": volts, "for": length}


def stage(frictions=None, **changes):
    """Table 4 with friction entries added by body and keys changed by section."""
    tables = copy.deepcopy(TABLE_4)
    for body, entries in zip(BODIES, frictions or ({}, {}, {})):
        tables[body]["friction"].update(entries)
    for section, entries in changes.items():
        if section == "belt" and "modulus" in entries:
            tables["belt"] = {}
        tables.setdefault(section, {}).update(entries)
    return tables


def stribeck(shape, force=(0.008, 0.15, 0.008), velocity=(2.0, 0.05, 2.0)):
    """One entry per body."""
    entries = []
    for f, v in zip(force, velocity):
        if shape == "decay":
            entries.append({"stribeck": {"force": f, "decay": 1 / v**2}})
        elif shape == "gaussian":
            entries.append({"stribeck": {"force": f, "velocity": v}})
        else:
            entries.append({"stribeck": {"force": f, "velocity": v, "shape": shape}})
    return entries


def smooth(velocity=(0.2, 0.01, 0.2), static=(0.023, 0.35, 0.023)):
    return [{"static": s, "smooth": {"breakaway_velocity": v}} for s, v in zip(static, velocity)]


def lugre(velocity=(0.5, 0.01, 0.5), static=(0.022, 0.3, 0.022)):
    stiffness, damping = (15.0, 1e4, 15.0), (0.03, 60.0, 0.03)
    return [
        {"static": s, "lugre": {"stiffness": k, "damping": c, "velocity": v}}
        for s, k, c, v in zip(static, stiffness, damping, velocity)
    ]


HILLS = [[0.0, 1.0], [0.01, 0.4], [0.02, 2.5], [0.03, 2.5], [0.045, 0.7], [0.06, 1.5]]
BOTH = [[-0.03, 2.0], [-0.01, 0.5], [0.004, 1.4], [0.015, 0.6], [0.035, 3.0]]


def family():
    """(group, name, tables, input, until, every)."""
    for shape in ("decay", "gaussian", "exponential"):
        forces = {"decay": (0.008, 0.15, 0.008), "gaussian": (0.005, 0.3, 0.01), "exponential": (0.006, 0.2, 0.006)}[shape]
        speeds = {"decay": (2.0, 0.05, 2.0), "gaussian": (1.0, 0.02, 0.5), "exponential": (1.5, 0.03, 1.5)}[shape]
        laws = stribeck(shape, forces, speeds)
        yield "stribeck", f"{shape}, 5 V pulse", stage(laws), pulse(5.0), 0.6, 0.012
        yield "stribeck", f"{shape}, 10 V pulse", stage(laws), pulse(10.0), 0.6, 0.012
        yield "stribeck", f"{shape}, triangle", stage(laws), {"triangle": 2.4, "frequency": 5.1}, 0.98, 0.014
        yield (
            "stribeck",
            f"{shape}, triangle of 11 Hz, damped belt",
            stage(laws, belt={"damping": [6.0, 6.0, 3.0]}),
            {"triangle": 3.3, "frequency": 11.3},
            0.7,
            0.014,
        )
    yield (
        "stribeck",
        "exponential on the cart only, inductance, sine",
        stage([{}, stribeck("exponential")[1], {}], motor={"inductance": 6e-4}),
        {"sine": 2.8, "frequency": 4.3},
        0.6,
        0.01,
    )
    yield (
        "stribeck",
        "three shapes, backward Coulomb, ramp",
        stage(
            [
                {**stribeck("decay")[0], "coulomb_backward": 0.012},
                {**stribeck("gaussian")[1], "coulomb_backward": 0.15},
                stribeck("exponential")[2],
            ]
        ),
        {"ramp": -3.1, "over": 0.373},
        0.6,
        0.01,
    )
    yield (
        "stribeck",
        "decay of 1e4, slow triangle, stick-slip",
        stage(stribeck("decay", (0.01, 0.5, 0.01), (0.3, 0.01, 0.3))),
        {"triangle": 2.2, "frequency": 2.3},
        1.0,
        0.0125,
    )
    yield "smooth", "5 V pulse", stage(smooth()), pulse(5.0), 0.6, 0.012
    yield "smooth", "10 V pulse", stage(smooth((0.5, 0.02, 0.3))), pulse(10.0), 0.6, 0.012
    yield "smooth", "triangle", stage(smooth()), {"triangle": 2.4, "frequency": 5.1}, 0.7, 0.014
    yield (
        "smooth",
        "cart only, inductance, sine",
        stage([{}, smooth((0.1, 0.005, 0.1))[1], {}], motor={"inductance": 6e-4}),
        {"sine": 2.8, "frequency": 4.3},
        0.6,
        0.01,
    )
    yield "along", "5 V pulse", stage([{}, {"along": HILLS}, {}]), pulse(5.0), 0.6, 0.012
    yield "along", "10 V pulse, static", stage([{}, {"static": 0.5, "along": HILLS}, {}]), pulse(10.0), 0.6, 0.012
    yield (
        "along",
        "triangle",
        stage([{}, {"coulomb": 0.8, "static": 1.0, "along": BOTH}, {}]),
        {"triangle": 3.0, "frequency": 3.1},
        0.98,
        0.014,
    )
    yield (
        "along",
        "Stribeck, sine",
        stage([{}, {"stribeck": {"force": 0.4, "velocity": 0.03}, "along": BOTH}, {}]),
        {"sine": 3.2, "frequency": 2.7},
        0.8,
        0.01,
    )
    travel = {"min": -0.34, "max": 0.34}
    yield "follows_cart", "5 V pulse", stage(belt=FOLLOWS, travel=travel), pulse(5.0), 0.6, 0.012
    yield "follows_cart", "far to the drive pulley", stage(belt=FOLLOWS, travel=travel), pulse(24.0, 0.26), 0.6, 0.012
    yield (
        "follows_cart",
        "far to the idler pulley, damped",
        stage(belt={**FOLLOWS, "damping": [8.0, 8.0, 4.0]}, travel=travel),
        {"square": -21.0, "frequency": 1.9, "duty": 0.5},
        0.8,
        0.016,
    )
    yield (
        "follows_cart",
        "Stribeck and along, triangle",
        stage(
            [{}, {"stribeck": {"force": 0.2, "velocity": 0.03}, "along": BOTH}, {}],
            belt=FOLLOWS,
            travel=travel,
        ),
        {"triangle": 4.0, "frequency": 2.7},
        0.8,
        0.01,
    )
    yield "lugre", "5 V pulse", stage(lugre()), pulse(5.0), 0.6, 0.012
    yield "lugre", "10 V pulse", stage(lugre((1.0, 0.02, 0.4))), pulse(10.0), 0.6, 0.012
    yield "lugre", "triangle", stage(lugre()), {"triangle": 2.4, "frequency": 5.1}, 0.7, 0.014
    yield (
        "lugre",
        "cart only, damped belt, sine",
        stage([{}, lugre()[1], {}], belt={"damping": [6.0, 6.0, 3.0]}),
        {"sine": 2.8, "frequency": 4.3},
        0.6,
        0.01,
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", help="one group")
    parser.add_argument("--output", type=Path, default=OUTPUT)
    options = parser.parse_args()
    cases, replaced, began = [], [], time.perf_counter()
    for group, name, tables, signal, until, every in family():
        if options.only and group != options.only:
            continue
        tables["title"] = f"{group}: {name}"
        tables["experiment"] = [{"name": "run", "input": signal, "until": until, "every": every}]
        clock = time.perf_counter()
        record, reason = judge(
            group, f"{len(cases):03d} {group}: {name}", toml(tables), limits=LIMITS, most=MOST_EVENTS
        )
        clock = time.perf_counter() - clock
        if record:
            cases.append(record)
            report(record, clock)
        else:
            replaced.append({"group": group, "name": name, "reason": reason})
            print(f"    {group}: {name}, left out: {reason}  ({clock:.1f} s)", flush=True)
    summary(cases, replaced, began)
    write(options.output, "authorities/curves.py", replaced, cases)


if __name__ == "__main__":
    main()
