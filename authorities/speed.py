"""The same work by several solvers, side by side: SciPy, SUNDIALS CVODE in C, and taut.

Table 4 friction with the rest of Table 2, 5 V for 0.25 s, 1 s in all, 1000 output samples, stick and slip by events.
Each solver has the loosest tolerance, on a ladder of half decades, whose positions keep a stated error against the
reference trajectory nl_t2_5V. Times are those of the best of several runs.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from verify import TABLE4, reference

HERE = Path(__file__).resolve().parent
TARGETS = (1e-6, 1e-9)  # m
TOLERANCES = [10 ** (-k / 2) for k in range(5, 27)]
SAMPLES = np.arange(1001) / 1000
EDGES = ((0.0, 5.0), (0.25, 0.0))
BLIND = 1e-6  # s
MOST_EVENTS = 200  # more is chatter: the tolerance is too loose
R = TABLE4.pulley_radius
SIZE = np.array([2.5, 10.0, 0.05, 0.2, 2.5, 10.0])  # of the six states in this run: atol = rtol times these


# --- SciPy ----------------------------------------------------------------------------------------------------------


def load_matrix(s):
    """Loads on the three inertias, every force but friction, as a 3×6 matrix; and what a volt adds to the first."""
    r, k1, k2, k3 = s.pulley_radius, s.k1, s.k2, s.k3
    #              φ₁               w₁                                                  x         v    φ₃              w₃
    matrix = [
        [-r * r * (k1 + k3), -s.torque_constant * s.back_emf_constant / s.resistance, r * k1, 0, r * r * k3, 0],
        [r * k1, 0, -(k1 + k2), 0, r * k2, 0],
        [r * r * k3, 0, r * k2, 0, -r * r * (k2 + k3), 0],
    ]
    return np.array(matrix), np.array([s.torque_constant / s.resistance, 0, 0])


LOADS, PER_VOLT = load_matrix(TABLE4)
COULOMB = [TABLE4.friction(body).coulomb_forward for body in (1, 2, 3)]
VISCOUS = [TABLE4.friction(body).viscous_forward for body in (1, 2, 3)]
INERTIA = [TABLE4.drive_inertia, TABLE4.cart_mass, TABLE4.idler_inertia]


def mode_matrices(modes, volts):
    """ẏ = A y + b."""
    a, b = np.zeros((6, 6)), np.zeros(6)
    for k, mode in enumerate(modes):
        a[2 * k, 2 * k + 1] = 1
        if mode:
            a[2 * k + 1] = LOADS[k] / INERTIA[k]
            a[2 * k + 1, 2 * k + 1] -= VISCOUS[k] / INERTIA[k]
            b[2 * k + 1] = (PER_VOLT[k] * volts - mode * COULOMB[k]) / INERTIA[k]
    return a, b


def at_rest(k, load):
    return 1 if load > COULOMB[k] else -1 if load < -COULOMB[k] else 0


def watched(modes, volts, left, since):
    """(inertia, mode it may go to or None where its load decides, function falling through zero there).

    An inertia that has just left zero is not asked for BLIND whether it is there.
    """
    found = []
    for k, mode in enumerate(modes):
        if mode and k == left:
            found.append((k, None, lambda t, y, row=2 * k + 1, mode=mode: 1.0 if t < since + BLIND else mode * y[row]))
        elif mode:
            found.append((k, None, lambda t, y, row=2 * k + 1, mode=mode: mode * y[row]))
        else:
            row, extra, limit = LOADS[k], PER_VOLT[k] * volts, COULOMB[k]
            found.append((k, 1, lambda t, y, row=row, extra=extra, limit=limit: limit - extra - row @ y))
            found.append((k, -1, lambda t, y, row=row, extra=extra, limit=limit: limit + extra + row @ y))
    for _, _, function in found:
        function.terminal, function.direction = True, -1
    return found


def scipy_run(method, rtol):
    """(states at the samples, number of events)."""
    y, t, modes, events = np.zeros(6), 0.0, [0, 0, 0], 0
    out = np.zeros((len(SAMPLES), 6))
    options = dict(method=method, rtol=rtol, atol=rtol * SIZE)
    for (start, volts), end in zip(EDGES, (EDGES[1][0], SAMPLES[-1])):
        left = None
        for k in range(3):
            if not modes[k] and (mode := at_rest(k, LOADS[k] @ y + PER_VOLT[k] * volts)):
                modes[k], events, left = mode, events + 1, k
        while t < end:
            a, b = mode_matrices(modes, volts)
            asked = SAMPLES[np.searchsorted(SAMPLES, t, "right") : np.searchsorted(SAMPLES, end, "right")]
            functions = watched(modes, volts, left, t)
            jacobian = {"LSODA": dict(jac=lambda t, y: a), "Radau": dict(jac=a), "BDF": dict(jac=a)}.get(method, {})
            run = solve_ivp(
                lambda t, y: a @ y + b,
                (t, end),
                y,
                t_eval=asked,
                events=[f for _, _, f in functions],
                **options,
                **jacobian,
            )
            if run.status < 0 or events > MOST_EVENTS:
                raise RuntimeError("chatter, or no solution")
            first = np.searchsorted(SAMPLES, t, "right")
            out[first : first + len(run.t)] = run.y.T if len(run.t) else out[first:first]
            if run.status == 0:
                t, y = end, run.y[:, -1]
                continue
            which = next(k for k, at in enumerate(run.t_events) if len(at))
            k, mode, _ = functions[which]
            t, y = run.t_events[which][0], run.y_events[which][0]
            if mode is None:
                y[2 * k + 1] = 0.0
                mode = at_rest(k, LOADS[k] @ y + PER_VOLT[k] * volts)
            modes[k], events, left = mode, events + 1, k
    return out, events


# --- rivals and the table -------------------------------------------------------------------------------------------


def position_error(states, exact):
    """Largest error of r φ₁, x and r φ₃, m; of columns φ₁, x, φ₃."""
    return float(np.abs((states - exact) * [R, 1, R]).max())


def scipy_rival(method, exact):
    def run(rtol, times):
        best = math.inf
        for _ in range(times):
            clock = time.perf_counter()
            out, events = scipy_run(method, rtol)
            best = min(best, time.perf_counter() - clock)
        return best, position_error(out[:, [0, 2, 4]], exact), events

    return run


def cvode_rival(program, method, exact):
    def run(rtol, times):
        text = subprocess.run(
            [program, method, repr(rtol), str(20 * times)], capture_output=True, text=True, check=True
        ).stdout
        first, *rows = text.splitlines()
        seconds, events = first.split()
        return float(seconds), position_error(np.array([row.split() for row in rows], dtype=float), exact), int(events)

    return run


def compile_cvode(folder):
    """The C program's path, or None with the reason printed."""
    program = str(Path(folder) / "cvode")
    libraries = [
        "-lsundials_cvode",
        "-lsundials_nvecserial",
        "-lsundials_sunlinsoldense",
        "-lsundials_sunmatrixdense",
        "-lsundials_sunnonlinsolfixedpoint",
        "-lm",
    ]
    try:
        subprocess.run(["gcc", "-O2", "-march=native", "-o", program, str(HERE / "cvode.c"), *libraries], check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        print(f"CVODE left out: {error} (Debian: apt-get install gcc libsundials-dev)")
        return None
    return program


def taut():
    """(seconds, position error) of taut's own example, or None with the reason printed."""
    done = subprocess.run(
        ["cargo", "run", "--quiet", "--release", "--package", "taut", "--example", "speed", "--"],
        cwd=HERE.parent,
        capture_output=True,
        text=True,
    )
    if done.returncode:
        last = [line for line in done.stderr.splitlines() if line.startswith("error")] or [
            f"exit status {done.returncode}"
        ]
        print(f"taut left out: cargo run --release --package taut --example speed: {last[0]}")
        return None
    report = json.loads(done.stdout)
    return report["seconds_per_run"], report["position_error_m"]


def main():
    _, states, _, events = reference("nl_t2_5V")
    exact = states[:, [0, 2, 4]]
    ours = taut()
    rows = [("taut", "exact", ours[1], ours[0], None)] if ours else []
    with tempfile.TemporaryDirectory() as folder:
        rivals = {}
        if program := compile_cvode(folder):
            rivals |= {f"CVODE {name}": cvode_rival(program, name, exact) for name in ("bdf", "adams", "adams-fixed")}
        rivals |= {f"SciPy {name}": scipy_rival(name, exact) for name in ("LSODA", "RK45", "DOP853", "Radau", "BDF")}
        for name, run in rivals.items():
            ladder = []
            for rtol in TOLERANCES:
                try:
                    seconds, error, _ = run(rtol, 1)
                except (RuntimeError, ValueError, subprocess.CalledProcessError):
                    continue
                ladder.append((rtol, seconds, error))
                if error <= min(TARGETS) / 3 or seconds > 20:
                    break
            for target in TARGETS:
                enough = [rtol for rtol, _, error in ladder if error <= target]
                if not enough:
                    rows.append((name, None, min(error for _, _, error in ladder), None, target))
                    continue
                rtol = max(enough)
                seconds, error, found = run(rtol, 9)
                rows.append(
                    (
                        name,
                        f"{rtol:.1e}" + ("" if found == len(events) else f" ({found} events)"),
                        error,
                        seconds,
                        target,
                    )
                )

    print(f"\n{'solver':<20}{'asked for':>10}{'rtol':>20}{'error, m':>11}{'ms per run':>12}{'times taut':>12}")
    for name, rtol, error, seconds, target in rows:
        asked = "-" if target is None else f"{target:.0e} m"
        if seconds is None:
            print(f"{name:<20}{asked:>10}{'not reached':>20}{error:>11.1e}{'-':>12}{'-':>12}")
            continue
        ratio = f"{seconds / ours[0]:.0f}" if ours else "-"
        print(f"{name:<20}{asked:>10}{rtol:>20}{error:>11.1e}{1e3 * seconds:>12.3f}{ratio:>12}")


if __name__ == "__main__":
    sys.exit(main())
