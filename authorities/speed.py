"""The same work by several solvers, side by side: SciPy, SUNDIALS CVODE in C, and taut, exact and general.

Two problems, each of 1 s with 1000 output samples, stick and slip by events: the paper's machine (Table 4 friction with the rest of
Table 2, 5 V for 0.25 s), and the same with a Stribeck curve on top of each Coulomb friction, F_s = 0.3 F_c and v_s = 0.05 m/s at the
belt. Each solver has the loosest tolerance, on a ladder of half decades, whose positions keep a stated error against authority B
(`elements_taylor.py`). Times are those of the best of several runs.
"""

from __future__ import annotations

import math
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

import elements_taylor
from casefile import Case, toml
from curves import pulse, stage, stribeck
from verify import TABLE4

HERE = Path(__file__).resolve().parent
TARGETS = (1e-6, 1e-9)  # m
TOLERANCES = [10 ** (-k / 2) for k in range(5, 27)]
SAMPLES = np.arange(1001) / 1000
EDGES = ((0.0, 5.0), (0.25, 0.0))
BLIND = 1e-6  # s
PATIENCE = 8.0  # s
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
VELOCITY = [0.05 / R, 0.05, 0.05 / R]  # v_s


class Problem:
    """With a Stribeck curve or without, and the positions at the samples by authority B."""

    viscous, coulomb, edges = VISCOUS, COULOMB, EDGES

    def __init__(self, name, share):
        self.name, self.curved = name, share > 0
        self.above = [share * c for c in COULOMB]
        self.breakaway = [c + a for c, a in zip(COULOMB, self.above)]
        tables = stage(stribeck("gaussian", self.above, VELOCITY) if self.curved else None)
        tables["title"] = name
        tables["experiment"] = [{"name": "run", "input": pulse(5.0), "until": 1.0, "every": 0.001}]
        run = elements_taylor.solve(Case(toml(tables)))
        assert not run.doubts
        self.exact = np.array(run.rows)[:, [0, 2, 4]]
        self.events = len(run.events)

    def at_rest(self, k, load):
        return 1 if load > self.breakaway[k] else -1 if load < -self.breakaway[k] else 0

    def equations(self, modes, volts):
        """ẏ as a function of t and y, and its Jacobian: a matrix where it is constant, else a function."""
        #   ẏ = A y + b − F_s e^{−(v/v_s)²} sign(v) / m
        a, b = np.zeros((6, 6)), np.zeros(6)
        sliding = []
        for k, mode in enumerate(modes):
            a[2 * k, 2 * k + 1] = 1
            if mode:
                a[2 * k + 1] = LOADS[k] / INERTIA[k]
                a[2 * k + 1, 2 * k + 1] -= self.viscous[k] / INERTIA[k]
                b[2 * k + 1] = (PER_VOLT[k] * volts - mode * self.coulomb[k]) / INERTIA[k]
                sliding.append((2 * k + 1, mode * self.above[k] / INERTIA[k], 1 / VELOCITY[k]))
        if not self.curved:
            return lambda t, y: a @ y + b, a

        def rate(t, y):
            dy = a @ y + b
            for row, force, per_speed in sliding:
                dy[row] -= force * math.exp(-((y[row] * per_speed) ** 2))
            return dy

        def jacobian(t, y):
            j = a.copy()
            for row, force, per_speed in sliding:
                q = y[row] * per_speed
                j[row, row] += 2 * force * q * per_speed * math.exp(-q * q)
            return j

        return rate, jacobian


def watched(problem, modes, volts, left, since):
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
            row, extra, limit = LOADS[k], PER_VOLT[k] * volts, problem.breakaway[k]
            found.append((k, 1, lambda t, y, row=row, extra=extra, limit=limit: limit - extra - row @ y))
            found.append((k, -1, lambda t, y, row=row, extra=extra, limit=limit: limit + extra + row @ y))
    for _, _, function in found:
        function.terminal, function.direction = True, -1
    return found


def scipy_run(problem, method, rtol):
    """(states at the samples, number of events)."""
    y, t, modes, events = np.zeros(6), 0.0, [0, 0, 0], 0
    out = np.zeros((len(SAMPLES), 6))
    options = dict(method=method, rtol=rtol, atol=rtol * SIZE)
    for (_, volts), end in zip(problem.edges, (problem.edges[1][0], SAMPLES[-1])):
        left = None
        for k in range(3):
            if not modes[k] and (mode := problem.at_rest(k, LOADS[k] @ y + PER_VOLT[k] * volts)):
                modes[k], events, left = mode, events + 1, k
        while t < end:
            rate, jacobian = problem.equations(modes, volts)
            asked = SAMPLES[np.searchsorted(SAMPLES, t, "right") : np.searchsorted(SAMPLES, end, "right")]
            functions = watched(problem, modes, volts, left, t)
            if method == "LSODA" and not callable(jacobian):
                jacobian = lambda t, y, matrix=jacobian: matrix
            run = solve_ivp(
                rate,
                (t, end),
                y,
                t_eval=asked,
                events=[f for _, _, f in functions],
                **options,
                **({"jac": jacobian} if method in ("LSODA", "Radau", "BDF") else {}),
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
                mode = problem.at_rest(k, LOADS[k] @ y + PER_VOLT[k] * volts)
            modes[k], events, left = mode, events + 1, k
    return out, events


# --- rivals and the table -------------------------------------------------------------------------------------------


def position_error(states, exact):
    """Largest error of r φ₁, x and r φ₃, m; of columns φ₁, x, φ₃."""
    return float(np.abs((states - exact) * [R, 1, R]).max())


def scipy_rival(problem, method):
    def run(rtol, times):
        best, begin, runs = math.inf, time.perf_counter(), 0
        # Nine runs, and more where they are short: a machine that is busy for a moment does not show.
        while runs < times or (times > 1 and time.perf_counter() - begin < PATIENCE):
            clock = time.perf_counter()
            out, events = scipy_run(problem, method, rtol)
            best, runs = min(best, time.perf_counter() - clock), runs + 1
        return best, position_error(out[:, [0, 2, 4]], problem.exact), events

    return run


def program_rival(problem, program, method, often):
    """A program that is given the problem, its method if it has several, a tolerance and the number of runs."""

    def run(rtol, times):
        command = [*program, problem.name, *method, str(rtol), str(often * times)]
        text = subprocess.run(command, capture_output=True, text=True, check=True, cwd=HERE.parent).stdout
        first, *rows = text.splitlines()
        seconds, events = first.split()
        rows = np.array([row.split() for row in rows], dtype=float)
        return float(seconds), position_error(rows, problem.exact), int(events)

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


TAUT = ["cargo", "run", "--quiet", "--release", "--package", "taut", "--example", "speed", "--"]


def compile_taut():
    """The command line of taut's own example, or None with the reason printed."""
    done = subprocess.run([*TAUT, "20"], cwd=HERE.parent, capture_output=True, text=True)
    if done.returncode == 0:
        return TAUT
    last = [line for line in done.stderr.splitlines() if line.startswith("error")] or [f"exit status {done.returncode}"]
    print(f"taut left out: {' '.join(TAUT[:-1])}: {last[0]}")
    return None


def rows_of(name, run, problem):
    """(name, asked for, tolerance, error, seconds) for each target: the loosest tolerance that keeps it."""
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
            yield name, target, None, min(error for _, _, error in ladder), None
            continue
        rtol = max(enough)
        seconds, error, found = run(rtol, 9)
        yield name, target, f"{rtol:.1e}" + ("" if found == problem.events else f" ({found} events)"), error, seconds


def compare(problem, taut, cvode):
    """The table of one problem."""
    rows, rivals = [], {}
    if taut and not problem.curved:
        seconds, error, _ = program_rival(problem, taut, [], 200)("exact", 10)
        rows.append(("taut exact", None, "-", error, seconds))
    if taut:
        rivals["taut general"] = program_rival(problem, taut, [], 50)
    if cvode:
        methods = ("bdf", "adams", "adams-fixed")
        rivals |= {f"CVODE {name}": program_rival(problem, [cvode], [name], 20) for name in methods}
    rivals |= {f"SciPy {name}": scipy_rival(problem, name) for name in ("LSODA", "RK45", "DOP853", "Radau", "BDF")}
    for name, run in rivals.items():
        rows += rows_of(name, run, problem)
    general = {target: seconds for name, target, _, _, seconds in rows if name == "taut general"}
    exact = {target: seconds for name, _, _, _, seconds in rows if name == "taut exact" for target in (None, *TARGETS)}

    rest = problem.exact[-1, 1]
    print(f"\n{problem.name}: {problem.events} events; the cart comes to rest at {rest:.12f} m")
    heads = "".join(f"{head:>15}" for head in ("times exact", "times general"))
    print(f"{'solver':<20}{'asked for':>10}{'rtol':>20}{'error, m':>11}{'ms per run':>12}{heads}")
    for name, target, rtol, error, seconds in rows:
        asked = "-" if target is None else f"{target:.0e} m"
        ratios = [seconds / base[target] if seconds and target in base else None for base in (exact, general)]
        ratios = "".join(f"{ratio:>15.1f}" if ratio else f"{'-':>15}" for ratio in ratios)
        time_ms = f"{1e3 * seconds:.3f}" if seconds else "-"
        print(f"{name:<20}{asked:>10}{rtol or 'not reached':>20}{error:>11.1e}{time_ms:>12}{ratios}")


def main():
    taut = compile_taut()
    with tempfile.TemporaryDirectory() as folder:
        cvode = compile_cvode(folder)
        for problem in (Problem("coulomb", 0.0), Problem("stribeck", 0.3)):
            compare(problem, taut, cvode)


if __name__ == "__main__":
    sys.exit(main())
