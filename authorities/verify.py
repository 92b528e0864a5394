"""Both authorities against the reference trajectories: a table of the largest differences."""

from __future__ import annotations

import csv
import os
import time
from pathlib import Path

import numpy as np

import events_expm
import events_scipy
from model import Friction, Stage

# In the repository, unless TAUT_REFERENCE says otherwise.
REFERENCE = Path(os.environ.get("TAUT_REFERENCE", Path(__file__).resolve().parents[1] / "data" / "reference"))

PAPER = dict(torque_constant=23e-3, back_emf_constant=23e-3, resistance=0.71, pulley_radius=0.0194, cart_mass=0.362)


def paper_stage(drive_friction, cart_friction, inertia, k, k3):
    return Stage(
        **PAPER,
        drive_inertia=inertia,
        idler_inertia=inertia,
        k1=k,
        k2=k,
        k3=k3,
        drive_friction=drive_friction,
        cart_friction=cart_friction,
        idler_friction=drive_friction,
    )


TABLE1 = paper_stage(Friction.symmetric(0.0042), Friction.symmetric(40.6518), 7e-5, 2.6552e5, 11.777e4)
TABLE2 = paper_stage(Friction.symmetric(0.0021), Friction.symmetric(20.3259), 6.3e-5, 1.3276e5, 5.8885e4)
TABLE4 = paper_stage(Friction.symmetric(0.0016, 0.015), Friction.symmetric(19.0424, 0.2), 6.3e-5, 1.3276e5, 5.8885e4)


def pulse(volts):
    return {"kind": "pulse", "value": volts, "duration": 0.25, "at": 0.0}


CASES = {
    "lin_t1_5V": (TABLE1, pulse(5.0)),
    "lin_t1_10V": (TABLE1, pulse(10.0)),
    "lin_t2_5V": (TABLE2, pulse(5.0)),
    "nl_t2_5V": (TABLE4, pulse(5.0)),
    "nl_t2_10V": (TABLE4, pulse(10.0)),
    "ramp_t2": (TABLE4, {"kind": "ramp", "value": 1.2, "over": 1.0, "at": 0.0}),
    "brk_motor_below_t2": (TABLE4, {"kind": "step", "value": 0.45378260869565218, "at": 0.0}),
}


def reference(case):
    """(times, states, modes, events) of a reference trajectory."""
    table = np.genfromtxt(REFERENCE / f"{case}.csv", delimiter=",", names=True)
    states = np.column_stack([table[name] for name in ("phi1", "w1", "x", "v", "phi3", "w3")])
    modes = np.column_stack([table[f"mode{k}"] for k in (1, 2, 3)]).astype(int)
    with open(REFERENCE / f"{case}.events.csv") as file:
        events = [
            (float(row["t"]), int(row["inertia"]), int(row["from"]), int(row["to"]), float(row["applied"]))
            for row in csv.DictReader(file)
        ]
    return table["t"], states, modes, events


def main():
    print("Largest difference from the references, over every sample and event.")
    print(
        f"{'case':<20}{'authority':<9}{'events':>7}{'same modes':>11}{'angle/rad':>11}{'x/m':>10}"
        f"{'w/(rad/s)':>11}{'v/(m/s)':>10}{'event/s':>10}{'load':>10}{'seconds':>9}"
    )
    for case, (stage, signal) in CASES.items():
        times, states, modes, events = reference(case)
        grid = [k / 1000 for k in range(len(times))]
        for name, solver in (("scipy", events_scipy.solve), ("expm", events_expm.solve)):
            clock = time.perf_counter()
            run = solver(stage, signal, grid)
            clock = time.perf_counter() - clock
            off = np.abs(run.states[:, :6].astype(float) - states).max(axis=0)
            sequence = [(e.body, e.before, e.after) for e in run.events] == [e[1:4] for e in events]
            same = sequence and (run.modes == modes).all()
            event = max((abs(e.time - ref[0]) for e, ref in zip(run.events, events)), default=0.0)
            load = max((abs(e.load - ref[4]) for e, ref in zip(run.events, events)), default=0.0)
            print(
                f"{case:<20}{name:<9}{len(run.events):>7}{'yes' if same else 'NO':>11}{max(off[0], off[4]):>11.1e}{off[2]:>10.1e}"
                f"{max(off[1], off[5]):>11.1e}{off[3]:>10.1e}{event:>10.1e}{load:>10.1e}{clock:>9.2f}",
                flush=True,
            )
            for doubt in run.doubts:
                print(f"    doubt: {doubt}")


if __name__ == "__main__":
    main()
