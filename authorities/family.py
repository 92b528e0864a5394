"""The family of the paper's machine: waves with many stick-slip transitions, steps beside each breakaway, the stiffness
of Table 1 with dry friction, other voltages. Solved and judged as in random_stages.py; writes
tests/authorities/family.json.
"""

from __future__ import annotations

import argparse
import dataclasses
import time
from pathlib import Path

import numpy as np

import events_expm
import random_stages
from model import Friction, Stage, pieces
from random_stages import judged, sample_times, write

OUTPUT = Path(__file__).resolve().parents[1] / "tests" / "authorities" / "family.json"

TABLE_4 = Stage(
    torque_constant=0.023,
    back_emf_constant=0.023,
    resistance=0.71,
    pulley_radius=0.0194,
    drive_inertia=6.3e-5,
    cart_mass=0.362,
    idler_inertia=6.3e-5,
    k1=1.3276e5,
    k2=1.3276e5,
    k3=5.8885e4,
    drive_friction=Friction.symmetric(0.0016, 0.015),
    cart_friction=Friction.symmetric(19.0424, 0.2),
    idler_friction=Friction.symmetric(0.0016, 0.015),
)
STIFF = dataclasses.replace(TABLE_4, k1=2.6552e5, k2=2.6552e5, k3=1.1777e5, drive_inertia=7e-5, idler_inertia=7e-5)
INDUCTIVE = dataclasses.replace(TABLE_4, inductance=6e-4)
STICKY = dataclasses.replace(
    TABLE_4,
    drive_friction=Friction.symmetric(0.0016, 0.015, 0.024),
    cart_friction=Friction.symmetric(19.0424, 0.2, 0.5),
    idler_friction=Friction.symmetric(0.0016, 0.015, 0.021),
)


def pulse(value):
    return {"kind": "pulse", "value": value, "duration": 0.25, "at": 0.0}


def step(value):
    return {"kind": "step", "value": value, "at": 0.0}


def triangle(amplitude, frequency):
    return {"kind": "triangle", "amplitude": amplitude, "frequency": frequency}


def square(amplitude, frequency, duty=0.5):
    return {"kind": "square", "amplitude": amplitude, "frequency": frequency, "duty": duty}


def sine(amplitude, frequency, phase=0.0, offset=0.0):
    return {"kind": "sine", "amplitude": amplitude, "frequency": frequency, "phase": phase, "offset": offset}


def prbs(amplitude, bit, seed):
    return {"kind": "prbs", "amplitude": amplitude, "bit": bit, "seed": seed}


def threshold(stage, body, until=0.1):
    """The least step, to 1e-7, at which the body leaves its rest."""
    low, high = 0.0, 5.0
    while high - low > 1e-7 * high:
        middle = 0.5 * (low + high)
        run = events_expm.solve(stage, step(middle), [until], np.float64)
        if any(event.body == body for event in run.events):
            high = middle
        else:
            low = middle
    return high


def family():
    """(name, stage, input, length)."""
    for value in (1.0, 2.0, 3.3, -7.0, 12.0, 24.0):
        yield f"pulse of {value:g} V", TABLE_4, pulse(value), 0.5
    for amplitude, frequency, until in ((1.0, 5, 1), (2.0, 5, 1), (1.4, 10, 1), (3.0, 10, 0.8), (5.0, 20, 0.5), (0.9, 2, 2)):
        yield f"triangle of {amplitude:g} V, {frequency} Hz", TABLE_4, triangle(amplitude, frequency), until
    for arguments in ((1.5, 4.0), (2.5, 10.0, 1.0), (1.2, 25.0, -0.7, 0.6)):
        yield f"sine of {arguments[0]:g} V, {arguments[1]:g} Hz", TABLE_4, sine(*arguments), 0.6
    for arguments in ((1.3, 10.0), (2.0, 20.0, 0.3), (0.9, 5.0, 0.6)):
        yield f"square of {arguments[0]:g} V, {arguments[1]:g} Hz", TABLE_4, square(*arguments), 0.57
    for arguments in ((1.2, 0.01, 1), (2.0, 0.02, 2), (5.0, 0.005, 3)):
        yield f"PRBS of {arguments[0]:g} V, {arguments[1]:g} s", TABLE_4, prbs(*arguments), 0.5
    for body, name in ((1, "drive pulley"), (2, "cart"), (3, "idler")):
        least = threshold(TABLE_4, body)
        for factor in (0.98, 1 - 1e-5, 1 + 1e-5, 1 + 1e-3, 1.02):
            yield f"step {factor:g} of what frees the {name}", TABLE_4, step(least * factor), 0.3
    for value in (5.0, 10.0):
        yield f"Table 1 stiffness, pulse of {value:g} V", STIFF, pulse(value), 0.5
    yield "Table 1 stiffness, triangle", STIFF, triangle(2.0, 5), 1
    yield "Table 1 stiffness, PRBS", STIFF, prbs(1.5, 0.02, 4), 0.5
    yield "inductance, triangle", INDUCTIVE, triangle(2.0, 5), 1
    yield "inductance, square", INDUCTIVE, square(1.3, 10.0), 0.5
    yield "breakaway above Coulomb, triangle", STICKY, triangle(2.0, 5), 1
    yield "breakaway above Coulomb, pulse", STICKY, pulse(5.0), 0.5


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=OUTPUT)
    options = parser.parse_args()
    random_stages.SAMPLES = 20
    cases, replaced = [], []
    began = time.perf_counter()
    for number, (name, stage, signal, until) in enumerate(family()):
        clock = time.perf_counter()
        times = sample_times(np.random.default_rng(number), pieces(signal, until), until)
        case, reason = judged(f"{number:03d} {name}", number, stage, signal, until, times)
        clock = time.perf_counter() - clock
        if case is None:
            replaced.append({"seed": number, "input": name, "reason": reason})
            print(f"{number:03d} {name:<44} left out: {reason}  ({clock:.1f} s)", flush=True)
            continue
        cases.append(case)
        worst, rounding = case["scipy_differs_by"], case["rounding_differs_by"]
        print(
            f"{case['name']:<48} {len(case['events']):>4} events  scipy: {worst['angle_rad']:.0e} rad "
            f"{worst['position_m']:.0e} m {worst['event_s']:.0e} s  rounding: {rounding['angle_rad']:.0e} rad "
            f"{rounding['event_s']:.0e} s  ({clock:.1f} s)",
            flush=True,
        )
    events = sum(len(case["events"]) for case in cases)
    print(f"{len(cases)} cases with {events} events, {len(replaced)} left out; {time.perf_counter() - began:.0f} s")
    for field in ("scipy_differs_by", "rounding_differs_by"):
        print(field, {key: max(case[field][key] for case in cases) for key in cases[0][field]})
    write(options.output, "authorities/family.py", replaced, cases)


if __name__ == "__main__":
    main()
