"""A third opinion on `gantry.json`: plain time stepping, no events, no modes, bodies and spans written out again.

A body at rest stays while its load is within breakaway; one that a step would carry through zero stops there for that step. First
order: the distance from the answers kept has to fall with the step.
"""

from __future__ import annotations

import json
import time
import tomllib
from pathlib import Path

import numpy as np

from casefile import signal
from model import pieces

ANSWERS = Path(__file__).resolve().parents[1] / "tests" / "authorities" / "gantry.json"
CASES = range(0, 100, 9)
STEPS = (4e-6, 2e-6, 1e-6)


def samples(table, until, t):
    """The input at all times."""
    u = np.zeros(len(t))
    for piece in pieces(signal(table), until):
        after = t >= piece.start
        s = t[after] - piece.start
        if hasattr(piece, "slope"):
            u[after] = piece.value + piece.slope * s
        else:
            u[after] = piece.offset + piece.amplitude * np.sin(piece.phase + piece.rate * s)
    return u.tolist()


def run(text, times, h):
    """Positions φ₁, φ₂, x, y at the times."""
    case = tomllib.loads(text)
    experiment, pulley, belt = case["experiment"][0], case["drive_pulley"], case["belt"]
    until, r = experiment["until"], pulley["radius"]
    grid = np.arange(round(until / h) + 1) * h
    u = [samples(experiment["input"][side], until, grid) for side in ("left", "right")]
    motors = [case["motor"], case.get("right_drive", {}).get("motor", case["motor"])]
    R, kt, ke = ([m[key] for m in motors] for key in ("resistance", "torque_constant", "back_emf_constant"))
    n, L = ([m.get(key, usual) for m in motors] for key, usual in (("gear_ratio", 1.0), ("inductance", 0.0)))
    mass = [pulley["inertia"] + n[j] ** 2 * motors[j].get("rotor_inertia", 0.0) for j in (0, 1)]
    mass += [case["bridge"]["mass"] + case["cart"]["mass"], case["cart"]["mass"]]
    laws = [part["friction"] for part in (pulley, pulley, case["bridge"], case["cart"])]
    viscous = [law["viscous"] for law in laws]
    slide = [(law["coulomb"], law.get("coulomb_backward", law["coulomb"])) for law in laws]
    hold = [(law.get("static", ahead), law.get("static", behind)) for law, (ahead, behind) in zip(laws, slide)]
    k = belt["stiffness"]
    c = belt.get("damping", [0.0] * len(k))
    h_frame = case["kind"] == "h-frame"
    q, w, i, found, waiting = [0.0] * 4, [0.0] * 4, [0.0] * 2, [], [round(t / h) for t in times]
    for step in range(len(grid)):
        if waiting and step == waiting[0]:
            found.append(list(q))
            waiting.pop(0)
        #   belt run out on either side of each motor: a, b and their rates
        a, b, da, db = r * q[0], r * q[1], r * w[0], r * w[1]
        x, y, dx, dy = q[2], q[3], w[2], w[3]
        if h_frame:
            #   cart and bridge lengthen the left span by x + y, the right one by x − y, and shorten the back one by 2 x
            left = k[0] * (x + y + a) + c[0] * (dx + dy + da)
            right = k[1] * (x - y - b) + c[1] * (dx - dy - db)
            back = k[2] * (b - a - 2 * x) + c[2] * (db - da - 2 * dx)
            load = [r * (back - left), r * (right - back), 2 * back - left - right, right - left]
        else:
            #   what motor A winds up is x + y, motor B x − y; tension ahead of a motor less that behind it
            out_a = k[0] * (a - x - y) + c[0] * (da - dx - dy)
            back_a = k[1] * (x + y - a) + c[1] * (dx + dy - da)
            out_b = k[2] * (b - x + y) + c[2] * (db - dx + dy)
            back_b = k[3] * (x - y - b) + c[3] * (dx - dy - db)
            pull_a, pull_b = out_a - back_a, out_b - back_b
            load = [-r * pull_a, -r * pull_b, pull_a + pull_b, pull_a - pull_b]
        for j in (0, 1):
            emf = ke[j] * n[j] * w[j]
            if L[j]:
                i[j] += h * (u[j][step] - emf - R[j] * i[j]) / L[j]
            else:
                i[j] = (u[j][step] - emf) / R[j]
            load[j] += n[j] * kt[j] * i[j]
        for body in range(4):
            speed, force = w[body], load[body]
            if speed == 0.0:
                if -hold[body][1] <= force <= hold[body][0]:
                    continue
                dry = slide[body][0] if force > 0 else -slide[body][1]
            else:
                dry = slide[body][0] if speed > 0 else -slide[body][1]
            new = speed + h * (force - dry - viscous[body] * speed) / mass[body]
            w[body] = 0.0 if new * speed < 0 else new
            q[body] += h * w[body]
    return np.array(found)


def main():
    began = time.perf_counter()
    cases = json.loads(ANSWERS.read_text())["cases"]
    print("largest distance at the belt from the answers kept, by step:")
    for number in CASES:
        record = cases[number]
        states = np.array(record["states"])
        r = tomllib.loads(record["case"])["drive_pulley"]["radius"]
        scale = np.array([r, r, 1, 1])
        travel = (np.abs(states[:, 1::2]) * scale).max()
        off = [(np.abs(run(record["case"], states[:, 0], h) - states[:, 1::2]) * scale).max() for h in STEPS]
        told = "  ".join(f"{h * 1e6:g} us {value:.1e} m" for h, value in zip(STEPS, off))
        print(f"{record['name']:<32} {len(record['events']):>4} events, moves {travel:.1e} m:  {told}", flush=True)
    print(f"{time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main()
