"""The classical experiments with the LuGre law, as cases of a stage: tests/authorities/lugre_experiments.json.

C. Canudas de Wit, H. Olsson, K. J. Åström, P. Lischinsky, "A new model for control of systems with friction", IEEE
Transactions on Automatic Control 40(3), 1995: presliding displacement, break-away force over force rate, stick-slip.
Its parameters, a unit mass: σ₀ = 1e5 N/m, σ₁ = √1e5 N s/m, σ₂ = 0.4 N s/m, F_C = 1 N, F_S = 1.5 N, v_s = 0.001 m/s. The
paper itself was not to hand: the experiments follow their description in a public reconstruction
(github.com/auralius/LuGre), the ramps' and holds' lengths are ours, and no curve has been compared with a printed one.

Each is solved three times: as a case by elements_taylor.py and elements_dop853.py, and as the bare equations of the
mass by SciPy's implicit Radau.

    m x'' = u − F,   F = σ₀ z + σ₁ z' + σ₂ x',   z' = x' − σ₀ |x'| z / g(x'),   g(v) = F_C + (F_S − F_C) exp(−(v/v_s)²)
"""

from __future__ import annotations

import json
import math
import time
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

import elements_dop853
import elements_taylor
from casefile import Case, toml

OUTPUT = Path(__file__).resolve().parents[1] / "tests" / "authorities" / "lugre_experiments.json"
SOURCE = (
    "C. Canudas de Wit, H. Olsson, K. J. Astrom, P. Lischinsky, A new model for control of systems with friction, "
    "IEEE Transactions on Automatic Control 40(3), 1995, pp. 419-425"
)
S0, S1, S2, FC, FS, VS = 1e5, math.sqrt(1e5), 0.4, 1.0, 1.5, 0.001
PULL, SPRING = 0.1, 2.0
RATES = [1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 40.0, 50.0]


def mass_case(title, signal, until, every):
    """A unit mass under a force: a rigid belt, pulleys without mass to speak of, i amperes are i newtons."""
    #   force = K_t i / r,  K_t = r
    return toml(
        {
            "title": title,
            "motor": {"torque_constant": 0.01, "back_emf_constant": 0.0, "resistance": 1.0},
            "amplifier": {"mode": "current"},
            "drive_pulley": {"radius": 0.01, "inertia": 1e-18},
            "idler_pulley": {"inertia": 1e-18},
            "cart": {"mass": 1.0, "friction": law()},
            "belt": {"model": "rigid", "stiffness": [1e6, 1e6, 5e5]},
            "experiment": [{"name": "run", "input": signal, "until": until, "every": every}],
        }
    )


def law():
    return {
        "viscous": S2,
        "coulomb": FC,
        "static": FS,
        "lugre": {"stiffness": S0, "damping": S1, "velocity": VS},
    }


def pulled_case(until, every):
    """A unit mass behind a spring whose end moves evenly: the spring is span 1, its end a drive pulley too heavy to be
    slowed."""
    return toml(
        {
            "title": "LuGre: stick-slip of a mass pulled through a spring",
            "motor": {"torque_constant": 0.01, "back_emf_constant": 0.0, "resistance": 1.0},
            "amplifier": {"mode": "current"},
            "drive_pulley": {"radius": 0.01, "inertia": 1e9},
            "idler_pulley": {"inertia": 1.0},
            "cart": {"mass": 1.0, "friction": law()},
            "belt": {"stiffness": [SPRING, 1e-9, 1e-9]},
            "experiment": [
                {
                    "name": "run",
                    "input": {"step": 0.0},
                    "until": until,
                    "every": every,
                    "initial": {"drive_speed": PULL / 0.01},
                }
            ],
        }
    )


def friction(v, z):
    """(F, z')."""
    g = FC + (FS - FC) * math.exp(-((v / VS) ** 2))
    rate = v - S0 * abs(v) * z / g
    return S0 * z + S1 * rate + S2 * v, rate


def direct(force, times, corners=()):
    """(x, v, z) at the times: the bare equations by Radau, restarted at the force's corners. force(t, x)."""

    def rhs(t, y):
        F, rate = friction(y[1], y[2])
        return [y[1], force(t, y[0]) - F, rate]

    stops = sorted({0.0, *corners, times[-1]})
    y, found = np.zeros(3), np.zeros((len(times), 3))
    for a, b in zip(stops, stops[1:]):
        inside = [k for k, t in enumerate(times) if a < t <= b]
        at = [times[k] for k in inside]
        asked = at + ([b] if not at or at[-1] < b else [])
        with np.errstate(all="ignore"):
            run = solve_ivp(rhs, (a, b), y, method="Radau", rtol=1e-10, atol=[1e-15, 1e-13, 1e-15], t_eval=asked)
        assert run.success, run.message
        found[inside] = run.y.T[: len(inside)]
        y = run.y[:, -1]
    return found


def bristle_rows(case, force):
    """Rows [t, x, v, z, F, u] of the case by Taylor series."""
    solver = elements_taylor.Solver(case, np.longdouble)
    rows, kept = [], solver.row

    def row(z):
        x, v, bristle = (float(z[k]) for k in (elements_taylor.X, elements_taylor.V, elements_taylor.Z2))
        rows.append([x, v, bristle])
        return kept(z)

    solver.row = row
    run = solver.run()
    assert not run.doubts, run.doubts
    return np.array([[t, *row, friction(row[1], row[2])[0], force(t, row[0])] for t, row in zip(case.times, rows)])


def experiment(name, about, text, force, corners=(), checks=None):
    case = Case(text)
    began = time.perf_counter()
    rows = bristle_rows(case, force)
    coarse = elements_taylor.solve(case, np.float64)
    rival = elements_dop853.solve(case)
    bare = direct(force, case.times, corners)
    position = lambda run: np.abs(np.array(run.rows)[:, 2] - rows[:, 1]).max()
    speed = lambda run: np.abs(np.array(run.rows)[:, 3] - rows[:, 2]).max()
    differ = {
        "rounding": {"position_m": position(coarse), "speed_m_s": speed(coarse)},
        "methods": {"position_m": position(rival), "speed_m_s": speed(rival)},
        "bare equations": {
            "position_m": np.abs(bare[:, 0] - rows[:, 1]).max(),
            "speed_m_s": np.abs(bare[:, 1] - rows[:, 2]).max(),
        },
    }
    print(f"{name}: {len(rows)} rows, " + ", ".join(
        f"{what} {off['position_m']:.0e} m {off['speed_m_s']:.0e} m/s" for what, off in differ.items()
    ) + f"  ({time.perf_counter() - began:.1f} s)", flush=True)
    digits = lambda value: float(f"{value:.14g}")
    shown = checks(rows) if checks else {}
    for key, value in shown.items():
        print(f"    {key}: {value}")
    return {
        "name": name,
        "about": about,
        "case": text,
        "differ_by": {what: {k: float(f"{v:.1e}") for k, v in off.items()} for what, off in differ.items()},
        "checks": shown,
        "columns": ["time", "cart_position", "cart_speed", "bristle", "friction", "applied_force"],
        "rows": [[digits(value) for value in row] for row in rows],
    }


def presliding():
    top = 0.95 * FS
    points = [[0.0, 0.0], [10.0, top], [15.0, top], [35.0, -top], [40.0, -top], [60.0, top], [65.0, top]]

    def force(t, x):
        return float(np.interp(t, [p[0] for p in points], [p[1] for p in points]))

    def checks(rows):
        #   slowly, g = F_S and dF/dx = σ₀ (1 − F/F_S sign v):  x = −F_S/σ₀ ln(1 − F/F_S), and back from F to −F by
        #   −F_S/σ₀ ln((1 + F/F_S) / (1 − F/F_S))
        there = -FS / S0 * math.log(1 - top / FS)
        back = FS / S0 * math.log((1 + top / FS) / (1 - top / FS))
        at = lambda t: float(rows[np.argmin(abs(rows[:, 0] - t)), 1])
        return {
            "position held at 0.95 F_S, m": at(15),
            "in the limit of slow force": there,
            "position held at -0.95 F_S, m": at(40),
            "in the limit of slow force, there": there - back,
            "position held at 0.95 F_S again, m": at(65),
            "in the limit of slow force, again": there,
        }

    text = mass_case("LuGre: presliding displacement", {"table": points}, 65.0, 0.5)
    about = (
        "A force on a unit mass goes slowly to 95 % of the break-away force, is held, goes to the negative of it, is held, and "
        "returns: friction over position is a closed loop with memory."
    )
    return experiment("presliding", about, text, force, [p[0] for p in points], checks)


def stick_slip():
    def checks(rows):
        slips = int(((rows[1:, 2] > 0.01) & (rows[:-1, 2] <= 0.01)).sum())
        return {"slips that rows show": slips, "largest spring force in rows, N": float(rows[:, 5].max())}

    about = (
        "A unit mass on a plate is pulled through a spring of 2 N/m whose end moves at 0.1 m/s: it sticks until the spring "
        "force reaches break-away, and slips."
    )
    return experiment(
        "stick-slip", about, pulled_case(20.0, 0.1), lambda t, x: SPRING * (PULL * t - x), [], checks
    )


def break_away():
    """Cases of ramps at several rates; the force at which the mass starts to slide, by two readings."""
    found, cases = [], []
    for rate in RATES:

        def rhs(t, y):
            F, bristle = friction(y[1], y[2])
            return [y[1], rate * t - F, bristle]

        def slope(t, y):
            #   Ḟ along the motion
            dv, dz = rhs(t, y)[1:]
            h = 1e-7 * min(1.0, 10 / rate)
            ahead = friction(y[1] + h * dv, y[2] + h * dz)[0]
            behind = friction(y[1] - h * dv, y[2] - h * dz)[0]
            return (ahead - behind) / (2 * h)

        def fast(t, y):
            return y[1] - VS

        slope.direction, fast.direction = -1, 1
        readings = []
        for method in ("Radau", "DOP853"):
            with np.errstate(all="ignore"):
                run = solve_ivp(
                    rhs, (0, 2 * FS / rate), [0, 0, 0], method=method, rtol=1e-11, atol=[1e-16, 1e-14, 1e-16], events=[slope, fast]
                )
            at = [(t[0], friction(y[0][1], y[0][2])[0]) for t, y in zip(run.t_events, run.y_events)]
            readings.append([at[0][1], at[0][0], at[1][1], at[1][0]])
        top, top_time, sliding, sliding_time = readings[1]
        error = max(abs(a - b) for a, b in zip(*readings))
        digits = lambda value: float(f"{value:.9g}")
        found.append([rate, *map(digits, (top, top_time, sliding, sliding_time, rate * sliding_time))])
        print(
            f"    {rate:4.0f} N/s: first top {top:.7f} N at {top_time:.6f} s; at v_s friction {sliding:.7f} N, "
            f"applied {rate * sliding_time:.7f} N, {sliding_time:.6f} s (Radau {error:.0e})"
        )
        if rate in (1.0, 5.0, 20.0, 50.0):
            until = float(f"{2 * FC / rate:.6g}")
            text = mass_case(f"LuGre: break-away at {rate:g} N/s", {"ramp": 2 * FC, "over": until}, until, until / 50)
            about = "A force on a unit mass grows evenly."
            cases.append(experiment(f"break-away at {rate:g} N/s", about, text, lambda t, x: rate * t))
    falls = lambda values: all(a > b for a, b in zip(values, values[1:]))
    assert falls([row[1] for row in found if row[0] <= 30]) and FC < found[6][1] and found[0][1] < FS
    assert falls([row[3] for row in found]) and falls([row[5] for row in found])
    return cases, {
        "about": (
            "A force that grows evenly from zero. Where the mass starts to slide: the first top of the friction force (up to 30 N/s; "
            "beyond, there is none before it slides freely), or the speed v_s. Friction at v_s and the applied force fall over all rates; the first top falls up to 30 N/s, and is about F_C at 40 and 50."
        ),
        "columns": [
            "force_rate",
            "friction_at_first_top",
            "time_of_first_top",
            "friction_at_v_s",
            "time_of_v_s",
            "applied_force_at_v_s",
        ],
        "rows": found,
    }


def main():
    experiments = [presliding(), stick_slip()]
    cases, table = break_away()
    experiments += cases
    head = {
        "format": 1,
        "authority": "authorities/lugre.py",
        "source": SOURCE,
        "parameters": {
            "mass": 1.0,
            "sigma_0": S0,
            "sigma_1": S1,
            "sigma_2": S2,
            "coulomb": FC,
            "static": FS,
            "velocity": VS,
            "spring": SPRING,
            "pull_speed": PULL,
        },
        "break_away": table,
    }
    body = ",\n".join(json.dumps(one, ensure_ascii=False, separators=(",", ":")) for one in experiments)
    OUTPUT.write_text(json.dumps(head, ensure_ascii=False)[:-1] + ',\n"experiments": [\n' + body + "\n]}\n")


if __name__ == "__main__":
    main()
