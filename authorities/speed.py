"""The same work by several solvers, side by side: SciPy, SUNDIALS CVODE in C, and taut, exact and general.

Five problems, each of 1 s with 1000 output samples, stick and slip by events: the paper's machine (Table 4 friction
with the rest of Table 2, 5 V for 0.25 s); the same with a Stribeck curve on top of each Coulomb friction, F_s = 0.3 F_c
and v_s = 0.05 m/s at the belt; with bristles (LuGre) under the cart, sigma0 = 1e4 and 1e7 N/m, sigma1 = 60 N s/m, F_s =
0.3 F_c, v_s = 0.01 m/s; with spans 1 and 2 that follow the cart. Each solver has the loosest tolerance, on a ladder of
half decades, whose positions keep a stated error against authority B (`elements_taylor.py`). The solvers take turns,
round after round, so that what else the computer does falls on all of them alike; a time is that of the best run, of
SciPy and CVODE in processor seconds.

`python speed.py [--update] [PROBLEM ...]` prints the tables; with `--update` it writes them into output/speed.txt, too,
and a summary into docs/general-solver.md.
"""

from __future__ import annotations

import argparse
import functools
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
ROUNDS = 3
SLOW = 10.0  # s: no tighter tolerance is tried after a run as long as that
LONGEST = 30.0  # s: a program that takes longer is stopped
KEPT = HERE.parent / "target" / "speed"
DOCUMENT = HERE.parent / "docs" / "general-solver.md"
FOLLOWS = {"modulus": 8.335e9, "section": 5.5626e-6, "spans": [0.34925, 0.34925, 0.7874], "follows_cart": True}
RIGIDITY, SPANS = FOLLOWS["modulus"] * FOLLOWS["section"], FOLLOWS["spans"]
BRISTLES = {"damping": 60.0, "velocity": 0.01}
SHARE = 0.3  # F_s/F_c
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
MOTOR = TABLE4.torque_constant / TABLE4.resistance


class Problem:
    """One machine, and the positions at the samples by authority B."""

    viscous, coulomb, edges = VISCOUS, COULOMB, EDGES

    def __init__(self, name):
        self.name, self.curved, self.follows = name, name == "stribeck", name == "follows"
        self.sigma0 = float(name.removeprefix("lugre-")) if name.startswith("lugre-") else 0.0
        self.above = [SHARE * c if self.curved else 0.0 for c in COULOMB]
        self.breakaway = [c + a for c, a in zip(COULOMB, self.above)]
        self.size = np.append(SIZE, COULOMB[1] / self.sigma0) if self.sigma0 else SIZE
        self.is_linear = name == "coulomb"

    @functools.cached_property
    def reference(self):
        """(positions at the samples, number of events); of stiff bristles after minutes, so it is kept."""
        kept = KEPT / f"{self.name}.npz"
        if kept.exists():
            with np.load(kept) as file:
                return file["positions"], int(file["events"])
        positions, events = self.solve()
        KEPT.mkdir(parents=True, exist_ok=True)
        np.savez(kept, positions=positions, events=events)
        return positions, events

    def solve(self):
        frictions, changes = None, {}
        if self.curved:
            frictions = stribeck("gaussian", self.above, VELOCITY)
        if self.sigma0:
            bristles = {"static": (1 + SHARE) * COULOMB[1], "lugre": {"stiffness": self.sigma0, **BRISTLES}}
            frictions = [{}, bristles, {}]
        if self.follows:
            changes = {"belt": FOLLOWS}
        tables = stage(frictions, **changes)
        tables["title"] = self.name
        tables["experiment"] = [{"name": "run", "input": pulse(5.0), "until": 1.0, "every": 0.001}]
        run = elements_taylor.solve(Case(toml(tables)))
        assert not run.doubts
        return np.array(run.rows)[:, [0, 2, 4]], len(run.events)

    exact = property(lambda self: self.reference[0])
    events = property(lambda self: self.reference[1])

    def at_rest(self, k, load):
        return 1 if load > self.breakaway[k] else -1 if load < -self.breakaway[k] else 0

    def loads(self, y, volts):
        """Loads on the three inertias, every force but friction."""
        if not self.follows:
            return LOADS @ y[:6] + PER_VOLT * volts
        #   k = E A / l
        k1, k2, k3 = RIGIDITY / (SPANS[0] - y[2]), RIGIDITY / (SPANS[1] + y[2]), RIGIDITY / SPANS[2]
        f1, f2, f3 = k1 * (R * y[0] - y[2]), k2 * (y[2] - R * y[4]), k3 * R * (y[4] - y[0])
        motor = MOTOR * (volts - TABLE4.back_emf_constant * y[1])
        return np.array([motor + R * (f3 - f1), f1 - f2, R * (f2 - f3)])

    def equations(self, modes, volts):
        """ẏ as a function of t and y, and its Jacobian: a matrix where it is constant, else a function."""
        #   ẏ = A y + b − F_s e^{−(v/v_s)²} sign(v) / m
        n = len(self.size)
        a, b = np.zeros((n, n)), np.zeros(n)
        sliding = []
        for k, mode in enumerate(modes):
            a[2 * k, 2 * k + 1] = 1
            if mode:
                if not self.follows:
                    a[2 * k + 1, :6] = LOADS[k] / INERTIA[k]
                    b[2 * k + 1] = PER_VOLT[k] * volts / INERTIA[k]
                a[2 * k + 1, 2 * k + 1] -= self.viscous[k] / INERTIA[k]
                if not (self.sigma0 and k == 1):
                    b[2 * k + 1] -= mode * self.coulomb[k] / INERTIA[k]
                    sliding.append((2 * k + 1, mode * self.above[k] / INERTIA[k], 1 / VELOCITY[k]))
        if self.is_linear:
            return lambda t, y: a @ y + b, a
        if self.sigma0:
            return self.bristles(a, b)
        if self.follows:
            return self.following(a, b, modes, volts)

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

    def bristles(self, a, b):
        sigma0, sigma1, vs, fc, mass = self.sigma0, BRISTLES["damping"], BRISTLES["velocity"], COULOMB[1], INERTIA[1]

        def slip(v):
            left = SHARE * fc * math.exp(-((v / vs) ** 2))
            return fc + left, -2 * v / vs**2 * left

        def rate(t, y):
            #   ż = v − σ₀ |v| z / g,   F = σ₀ z + σ₁ ż
            dy = a @ y + b
            v, z = y[3], y[6]
            dy[6] = v - sigma0 * abs(v) * z / slip(v)[0]
            dy[3] -= (sigma0 * z + sigma1 * dy[6]) / mass
            return dy

        def jacobian(t, y):
            j = a.copy()
            v, z = y[3], y[6]
            (g, slope), sign = slip(v), math.copysign(1.0, v)
            j[6, 3] = 1 - sigma0 * z * (sign / g - abs(v) * slope / g**2)
            j[6, 6] = -sigma0 * abs(v) / g
            j[3, 3] -= sigma1 * j[6, 3] / mass
            j[3, 6] = -(sigma0 + sigma1 * j[6, 6]) / mass
            return j

        return rate, jacobian

    def following(self, a, b, modes, volts):
        moving = [(2 * k + 1, k, 1 / INERTIA[k]) for k, mode in enumerate(modes) if mode]

        def rate(t, y):
            dy = a @ y + b
            loads = self.loads(y, volts)
            for row, k, per_mass in moving:
                dy[row] += loads[k] * per_mass
            return dy

        def jacobian(t, y):
            k1, k2, k3 = RIGIDITY / (SPANS[0] - y[2]), RIGIDITY / (SPANS[1] + y[2]), RIGIDITY / SPANS[2]
            #   dk/dx = ± k²/(E A)
            d1, d2 = k1 * k1 / RIGIDITY * (R * y[0] - y[2]), -k2 * k2 / RIGIDITY * (y[2] - R * y[4])
            by = [
                [-R * R * (k1 + k3), -MOTOR * TABLE4.back_emf_constant, R * (k1 - d1), 0, R * R * k3, 0],
                [R * k1, 0, -(k1 + k2) + d1 - d2, 0, R * k2, 0],
                [R * R * k3, 0, R * (k2 + d2), 0, -R * R * (k2 + k3), 0],
            ]
            j = a.copy()
            for row, k, per_mass in moving:
                j[row, :6] += np.array(by[k]) * per_mass
            return j

        return rate, jacobian


class Pulse(Problem):
    """The machine with Coulomb friction alone, other numbers of it and another voltage."""

    def __init__(self, viscous, coulomb, volts):
        super().__init__("coulomb")
        self.viscous, self.coulomb, self.breakaway = viscous, coulomb, coulomb
        self.edges = ((0.0, volts), (0.25, 0.0))


def watched(problem, modes, volts, left, since):
    """(inertia, mode it may go to or None where its load decides, function falling through zero there).

    An inertia that has just left zero is not asked for BLIND whether it is there.
    """
    found = []
    for k, mode in enumerate(modes):
        if problem.sigma0 and k == 1:
            continue  # bristles never stick
        if mode and k == left:
            found.append((k, None, lambda t, y, row=2 * k + 1, mode=mode: 1.0 if t < since + BLIND else mode * y[row]))
        elif mode:
            found.append((k, None, lambda t, y, row=2 * k + 1, mode=mode: mode * y[row]))
        else:
            limit = problem.breakaway[k]
            found.append((k, 1, lambda t, y, k=k, limit=limit: limit - problem.loads(y, volts)[k]))
            found.append((k, -1, lambda t, y, k=k, limit=limit: limit + problem.loads(y, volts)[k]))
    for _, _, function in found:
        function.terminal, function.direction = True, -1
    return found


def scipy_run(problem, method, rtol):
    """(states at the samples, number of events)."""
    y, t, modes, events = np.zeros(len(problem.size)), 0.0, [0, int(problem.sigma0 > 0), 0], 0
    out = np.zeros((len(SAMPLES), len(y)))
    options = dict(method=method, rtol=rtol, atol=rtol * problem.size)
    for (_, volts), end in zip(problem.edges, (problem.edges[1][0], SAMPLES[-1])):
        left = None
        for k in range(3):
            if not modes[k] and (mode := problem.at_rest(k, problem.loads(y, volts)[k])):
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
                mode = problem.at_rest(k, problem.loads(y, volts)[k])
            modes[k], events, left = mode, events + 1, k
    return out, events


# --- rivals and the table -------------------------------------------------------------------------------------------


def position_error(states, exact):
    """Largest error of r φ₁, x and r φ₃, m; of columns φ₁, x, φ₃."""
    return float(np.abs((states - exact) * [R, 1, R]).max())


def scipy_rival(problem, method):
    def run(rtol, seconds):
        best, begin, runs = math.inf, time.process_time(), 0
        while runs == 0 or time.process_time() - begin < seconds:
            clock = time.process_time()
            out, events = scipy_run(problem, method, rtol)
            best, runs = min(best, time.process_time() - clock), runs + 1
        return best, position_error(out[:, [0, 2, 4]], problem.exact), events

    return run


def program_rival(problem, program, method):
    """A program that is given the problem, its method if it has several, a tolerance and the number of runs."""

    def run(rtol, seconds, times=1):
        command = [*program, problem.name, *method, str(rtol), str(times)]
        text = subprocess.run(command, capture_output=True, text=True, check=True, cwd=HERE.parent, timeout=LONGEST).stdout
        first, *rows = text.splitlines()
        took, events = first.split()
        if times == 1 and seconds >= 10 * float(took):
            return run(rtol, 0.0, int(seconds / float(took)))
        rows = np.array([row.split() for row in rows], dtype=float)
        return float(took), position_error(rows, problem.exact), int(events)

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


BUILD = ["cargo", "build", "--quiet", "--release", "--package", "taut", "--example", "speed"]


def compile_taut():
    """The command line of taut's own example, or None with the reason printed."""
    done = subprocess.run(BUILD, cwd=HERE.parent, capture_output=True, text=True)
    if done.returncode == 0:
        return [str(HERE.parent / "target" / "release" / "examples" / "speed")]
    last = [line for line in done.stderr.splitlines() if line.startswith("error")] or [f"exit status {done.returncode}"]
    print(f"taut left out: {' '.join(BUILD)}: {last[0]}")
    return None


FAILED = (RuntimeError, ValueError, subprocess.CalledProcessError)


def loosest(run):
    """The loosest tolerance for each target, or None, and the least error there was."""
    found, least = dict.fromkeys(TARGETS), math.inf
    for rtol in TOLERANCES:
        try:
            seconds, error, _ = run(rtol, 0.0)
        except subprocess.TimeoutExpired:
            break
        except FAILED:
            continue
        least = min(least, error)
        for target in TARGETS:
            if error <= target and found[target] is None:
                found[target] = rtol
        if None not in found.values() or seconds > SLOW:
            break
    return found, least


def compare(problem, taut, cvode):
    """(solver, target, tolerance, error, seconds, events) of one problem, all rivals in turn."""
    rivals = {}
    if taut:
        rivals["taut general"] = program_rival(problem, taut, [])
    if cvode:
        rivals |= {f"CVODE {name}": program_rival(problem, [cvode], [name]) for name in ("adams", "adams-fixed", "bdf")}
    rivals |= {f"SciPy {name}": scipy_rival(problem, name) for name in ("LSODA", "DOP853", "Radau")}
    entries, rows = [], []
    if taut and problem.is_linear:
        entries.append(["taut exact", None, "exact", program_rival(problem, taut, []), math.inf, 0.0, 0])
    for name, run in rivals.items():
        found, least = loosest(run)
        for target, rtol in found.items():
            entries.append([name, target, rtol, run, math.inf, least, 0])
    for _ in range(ROUNDS):
        for entry in entries:
            _, _, rtol, run, best, _, _ = entry
            if rtol is None:
                continue
            try:
                seconds, entry[5], entry[6] = run(rtol, 0.2)
            except subprocess.TimeoutExpired:
                seconds = LONGEST
            entry[4] = min(best, seconds)
    for name, target, rtol, _, best, error, events in entries:
        rows.append((name, target, rtol, error, best if rtol is not None else None, events))
    return rows


def table(problem, rows):
    """The table of one problem, as Markdown."""
    general = {target: seconds for name, target, _, _, seconds, _ in rows if name == "taut general"}
    rest = problem.exact[-1, 1]
    lines = [f"**{problem.name}**: {problem.events} events; the cart comes to rest at {rest:.12f} m.", ""]
    lines += ["| solver | asked for | tolerance | error, m | ms a run | times taut general |", "|---|---|---|---|---|---|"]
    for name, target, rtol, error, seconds, events in rows:
        asked = "" if target is None else f"{target:.0e} m"
        told = "not reached" if rtol is None else rtol if isinstance(rtol, str) else f"{rtol:.1e}"
        told += "" if rtol is None or events == problem.events else f" ({events} events)"
        ms = f"{1e3 * seconds:.3f}" if seconds else ""
        ratio = f"{seconds / general[target]:.1f}" if seconds and general.get(target) else ""
        lines.append(f"| {name} | {asked} | {told} | {error:.1e} | {ms} | {ratio} |")
    return "\n".join(lines)


def milliseconds(seconds):
    """Seconds as milliseconds with three digits."""
    return f"{1e3 * seconds:.3g}" if seconds < 1.0 else f"{1e3 * seconds:.0f}"


def summary(tables, target=1e-9):
    """Milliseconds a run of each solver on each problem where the error at every row is at most `target`, as
    Markdown."""
    names = [name for name, *_ in tables[-1][1] if name != "taut exact"]
    lines = ["| solver | " + " | ".join(problem.name for problem, _ in tables) + " |", "|---" * (len(tables) + 1) + "|"]
    for name in ["taut exact", *dict.fromkeys(names)]:
        cells = []
        for _, rows in tables:
            times = [seconds for who, wanted, _, _, seconds, _ in rows if who == name and wanted in (None, target)]
            cells.append("–" if not times else milliseconds(times[0]) if times[0] else "not reached")
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def verdict(tables):
    """Where taut is not ahead."""
    behind = []
    for problem, rows in tables:
        own = {target: seconds for name, target, _, _, seconds, _ in rows if name == "taut general"}
        for name, target, _, _, seconds, _ in rows:
            if seconds and own.get(target) and seconds < own[target] and not name.startswith("taut"):
                behind.append(f"{name} on {problem.name} at {target:.0e} m")
    return "Nobody here is ahead of taut." if not behind else "Ahead of taut: " + "; ".join(behind) + "."


BEGIN, END = "<!-- authorities/speed.py: begin -->", "<!-- authorities/speed.py: end -->"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    names = ["coulomb", "stribeck", "lugre-1e4", "lugre-1e7", "follows"]
    parser.add_argument("problems", nargs="*", default=names, metavar="PROBLEM", help=", ".join(names))
    parser.add_argument("--update", action="store_true", help="write output/speed.txt, and the summary in docs/general-solver.md")
    asked = parser.parse_args()
    if unknown := set(asked.problems) - set(names):
        parser.error(f"{', '.join(sorted(unknown))}: there are {', '.join(names)}")
    taut, tables = compile_taut(), []
    with tempfile.TemporaryDirectory() as folder:
        cvode = compile_cvode(folder)
        for problem in map(Problem, asked.problems):
            tables.append((problem, compare(problem, taut, cvode)))
            print(table(*tables[-1]), end="\n\n", flush=True)
    print(verdict(tables))
    if asked.update:
        text = "\n\n".join([table(*entry) for entry in tables] + [verdict(tables)])
        (HERE / "output" / "speed.txt").write_text(text + "\n")
        document = DOCUMENT.read_text()
        before, rest = document.split(BEGIN)
        text = f"{summary(tables)}\n\n{verdict(tables)}"
        DOCUMENT.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{rest.split(END)[1]}")


if __name__ == "__main__":
    sys.exit(main())
