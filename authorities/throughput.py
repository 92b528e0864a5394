"""Simulations a second, side by side in one run: many machines, each its own parameters, metrics out.

The problem of `taut sweep`: the paper's machine (Table 4 with the rest of Table 2), all parameters by +-20 %, pulses of 5 V and 10 V for 0.25 s,
1 s each with a row every millisecond; out come where the cart ends, its peak speed and the peak force in span 1. All on all processors.

- taut: `examples/sweep.rs` on as many threads as there are processors, all 24 figures of a sweep.
- SciPy: `solve_ivp` with events (speed.py's own loop), multiprocessing.
- CVODE in C (cvode.c) with root finding, one process for each processor, each the nominal machine at 5 V again and again: its parameters are
  constants of the program.
- Numba: a plain fixed-step Runge-Kutta of fourth order, compiled, with friction in the plainest way that sticks: a body at zero speed whose load
  is within its Coulomb friction stays there, and a step that turns a speed round ends at zero. Its step is halved until the error is that stated.

The error is the largest distance of drive pulley, cart and idler positions at any row from those of authority B, for the nominal machine at
5 V; taut's own is in speed.py's output. SciPy and CVODE have the loosest tolerance whose error is below 1e-6 m. Rates are those of
wall time, a few seconds each, and vary with what else the computer does.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import speed

HERE = Path(__file__).resolve().parent
PROCESSORS = os.cpu_count() or 1
SECONDS = 6.0
TARGET = 1e-6  # m
TAUT = ["cargo", "run", "--quiet", "--release", "--package", "taut", "--no-default-features", "--example", "sweep", "--"]


def by_taut():
    """Simulations a second."""
    runs = 1000
    while True:
        out = subprocess.run([*TAUT, str(runs), str(PROCESSORS)], cwd=HERE.parent, capture_output=True, text=True, check=True).stdout
        told = json.loads(out)
        if told["seconds"] > SECONDS / 2:
            return told["simulations_per_second"]
        runs = int(runs * max(2.0, SECONDS / max(told["seconds"], 0.01)))


def error(rows, truth):
    """The largest distance in position, m."""
    return speed.position_error(rows, truth.exact)


# --- SciPy ----------------------------------------------------------------------------------------------------------


class Machine(speed.Problem):
    """Table 4, every parameter times one of these factors."""

    def __init__(self, factors, volts):
        self.curved, self.above = False, [0.0] * 3
        self.viscous = tuple(b * f for b, f in zip(speed.VISCOUS, factors[:3]))
        self.coulomb = tuple(c * f for c, f in zip(speed.COULOMB, factors[3:6]))
        self.breakaway = self.coulomb
        self.edges = ((0.0, volts), (0.25, 0.0))


def scipy_runs(job):
    """Runs machines for so long; how many."""
    seed, method, rtol, seconds = job
    random = np.random.default_rng(seed)
    begin, count = time.perf_counter(), 0
    while time.perf_counter() - begin < seconds:
        factors = random.uniform(0.8, 1.2, 6)
        for volts in (5.0, 10.0):
            states = speed.scipy_run(Machine(factors, volts), method, rtol)[0]
            (states[-1, 2], np.max(np.abs(states[:, 3])))
            count += 1
    return count


def by_scipy(truth):
    """Method, tolerance, error and simulations a second of the quickest that is near enough."""
    best = None
    for method in ("DOP853", "LSODA", "RK45"):
        for rtol in speed.TOLERANCES:
            try:
                begin = time.perf_counter()
                rows = speed.scipy_run(truth, method, rtol)[0][:, [0, 2, 4]]
                took = time.perf_counter() - begin
            except (RuntimeError, ValueError):
                continue
            off = error(rows, truth)
            if off < TARGET:
                if best is None or took < best[3]:
                    best = (method, rtol, off, took)
                break
    method, rtol, off, _ = best
    with multiprocessing.Pool(PROCESSORS) as pool:
        begin = time.perf_counter()
        counts = pool.map(scipy_runs, [(seed, method, rtol, SECONDS) for seed in range(PROCESSORS)])
        took = time.perf_counter() - begin
    return f"SciPy {method} rtol {rtol:.1e}", off, sum(counts) / took


# --- CVODE ----------------------------------------------------------------------------------------------------------


def by_cvode(truth):
    """The same of CVODE in C."""
    with tempfile.TemporaryDirectory() as folder:
        program = speed.compile_cvode(folder)
        if not program:
            return None
        best = None
        for method in ("bdf", "adams", "adams-fixed"):
            run = speed.program_rival(truth, [program], [method], 20)
            for rtol in speed.TOLERANCES:
                try:
                    took, off, _ = run(rtol, 5)
                except (RuntimeError, ValueError, subprocess.CalledProcessError):
                    continue
                if off < TARGET:
                    if best is None or took < best[3]:
                        best = (method, rtol, off, took)
                    break
        if best is None:
            return None
        method, rtol, off, took = best
        # Each process is told how many runs to do.
        count = int(SECONDS / took)
        command = [program, truth.name, method, str(rtol), str(count)]
        begin = time.perf_counter()
        running = [subprocess.Popen(command, stdout=subprocess.DEVNULL, cwd=HERE.parent) for _ in range(PROCESSORS)]
        assert all(process.wait() == 0 for process in running)
        return f"CVODE {method} rtol {rtol:.1e}", off, PROCESSORS * count / (time.perf_counter() - begin)


# --- Numba ----------------------------------------------------------------------------------------------------------

try:
    import numba

    @numba.njit(cache=False)
    def loads(y, p, u):
        """Forces and torques on the three inertias, friction apart."""
        kt, ke, resistance, r, k1, k2, k3 = p[0], p[1], p[2], p[3], p[7], p[8], p[9]
        f1 = k1 * (r * y[0] - y[2])
        f2 = k2 * (y[2] - r * y[4])
        f3 = k3 * (r * y[4] - r * y[0])
        return r * (f3 - f1) + kt * (u - ke * y[1]) / resistance, f1 - f2, r * (f2 - f3)

    @numba.njit(cache=False)
    def rate(y, p, u, side, out):
        """dy/dt with each body sliding to its side; 0 for one that rests."""
        torque = loads(y, p, u)
        for body in range(3):
            speed_ = y[2 * body + 1]
            if side[body] == 0.0:
                out[2 * body], out[2 * body + 1] = 0.0, 0.0
            else:
                friction = p[10 + body] * speed_ + p[13 + body] * side[body]
                out[2 * body] = speed_
                out[2 * body + 1] = (torque[body] - friction) / p[4 + body]

    @numba.njit(cache=False)
    def simulate(p, volts, steps, rows):
        """One second by steps of 1/steps ms; fills rows of positions and returns three figures."""
        y, side = np.zeros(6), np.zeros(3)
        k1, k2, k3, k4, z = np.zeros(6), np.zeros(6), np.zeros(6), np.zeros(6), np.zeros(6)
        h = 1e-3 / steps
        peak_speed, peak_force = 0.0, 0.0
        for row in range(1000):
            u = volts if row < 250 else 0.0
            for _ in range(steps):
                torque = loads(y, p, u)
                for body in range(3):
                    v = y[2 * body + 1]
                    if v != 0.0:
                        side[body] = 1.0 if v > 0.0 else -1.0
                    elif abs(torque[body]) > p[13 + body]:
                        side[body] = 1.0 if torque[body] > 0.0 else -1.0
                    else:
                        side[body] = 0.0
                rate(y, p, u, side, k1)
                for i in range(6):
                    z[i] = y[i] + 0.5 * h * k1[i]
                rate(z, p, u, side, k2)
                for i in range(6):
                    z[i] = y[i] + 0.5 * h * k2[i]
                rate(z, p, u, side, k3)
                for i in range(6):
                    z[i] = y[i] + h * k3[i]
                rate(z, p, u, side, k4)
                for i in range(6):
                    y[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
                for body in range(3):
                    if y[2 * body + 1] * side[body] < 0.0:
                        y[2 * body + 1] = 0.0
            rows[row + 1, 0], rows[row + 1, 1], rows[row + 1, 2] = y[0], y[2], y[4]
            peak_speed = max(peak_speed, abs(y[3]))
            peak_force = max(peak_force, abs(p[7] * (p[3] * y[0] - y[2])))
        return y[2], peak_speed, peak_force

    @numba.njit(parallel=True, cache=False)
    def many(parameters, steps, out):
        """All machines, both pulses, on all processors."""
        for run in numba.prange(parameters.shape[0]):
            rows = np.zeros((1001, 3))
            out[run, 0], out[run, 1], out[run, 2] = simulate(parameters[run], 5.0, steps, rows)
            out[run, 3], out[run, 4], out[run, 5] = simulate(parameters[run], 10.0, steps, rows)
except ImportError:
    numba = None


def nominal():
    s = speed.TABLE4
    return np.array([s.torque_constant, s.back_emf_constant, s.resistance, s.pulley_radius, *speed.INERTIA, s.k1, s.k2, s.k3, *speed.VISCOUS, *speed.COULOMB])


def by_numba(truth):
    """Steps of a row, error and simulations a second, for the target and for a tenth of the steps that it takes."""
    if numba is None:
        return []
    found, p = [], nominal()
    for target in (1e-5, TARGET, 1e-7):
        steps, off = 1, np.inf
        while steps <= 4096:
            rows = np.zeros((1001, 3))
            simulate(p, 5.0, steps, rows)
            off = error(rows, truth)
            if off < target:
                break
            steps *= 2
        if not off < target:
            found.append((f"Numba RK4, {steps // 2} steps a ms", off, None))
            continue
        count = max(PROCESSORS, 4000 // steps)
        parameters = p * np.random.default_rng(1).uniform(0.8, 1.2, (count, len(p)))
        out = np.zeros((count, 6))
        many(parameters[:PROCESSORS], steps, out[:PROCESSORS])
        begin, done = time.perf_counter(), 0
        while time.perf_counter() - begin < SECONDS:
            many(parameters, steps, out)
            done += 2 * count
        found.append((f"Numba RK4, {steps} steps a ms", off, done / (time.perf_counter() - begin)))
    return found


def main():
    truth = speed.Problem("coulomb", 0.0)
    mine = by_taut()
    rivals = [by_scipy(truth), by_cvode(truth), *by_numba(truth)]
    lines = [f"{PROCESSORS} processors; position error at 5 V against authority B; simulations a second, and how many times fewer than taut's", ""]
    lines.append(f"{'taut sweep':34} {'–':>10} {mine:10.0f}")
    for rival in filter(None, rivals):
        name, off, rate_ = rival
        told = "not reached" if rate_ is None else f"{rate_:10.1f} {mine / rate_:9.0f}"
        lines.append(f"{name:34} {off:8.1e} m {told}")
    if rivals[1] is None:
        lines.append("CVODE: not measured (no compiler or no libsundials-dev, or no tolerance was near enough)")
    if numba is None:
        lines.append("Numba: not measured (not installed)")
    lines.append("diffrax and MuJoCo: not measured here")
    text = "\n".join(lines) + "\n"
    (HERE / "output" / "throughput.txt").write_text(text)
    print(text, end="")


if __name__ == "__main__":
    sys.exit(main())
