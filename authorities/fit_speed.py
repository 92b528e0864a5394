"""The same fit by several solvers, side by side: taut, and SciPy's `least_squares` over SUNDIALS CVODE in C and over
`solve_ivp`.

Four friction parameters of the paper's machine (Table 4 with the rest of Table 2): viscous and Coulomb friction of the
two pulleys, which are equal, and of the cart, from logs of the pulses of 5 V and 10 V (0.25 s long, 1 s each, 1 kHz,
2002 rows), all from the same start. A row holds the drive pulley's angle and the cart's position: the angle alone tells
little more than two sums. The logs are made here, by LSODA at a tolerance of 1e-11: once exact, and once with normal
noise of 0.2 mrad and 4 um (NumPy's generator, seed 1).

Residuals are model minus log in standard deviations (without noise: hundredths of the range); taut, which estimates the
deviations itself, also does what belongs to its `fit`: what the logs determine, beforehand, and covariance and
intervals, afterwards. The others have a fixed tolerance and differences of one side with the step that goes with it.
Seconds are those of the processor, of both processes where there are two, so that what else the computer does counts
little. taut also fits where the position starts, which the others take for zero. `cost` is half the sum of the squares
at the estimates, by LSODA at 1e-11 and with the same deviations for all.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

import speed

ROWS = len(speed.SAMPLES)
VOLTS = (5.0, 10.0)
NAMES = ("pulleys' viscous", "cart's viscous", "pulleys' Coulomb", "cart's Coulomb")
TRUTH = np.array([0.0016, 19.0424, 0.015, 0.2])
START = np.array([0.001, 10.0, 0.01, 0.5])
DEVIATION = (2e-4, 4e-6)  # rad, m
TAUT = ["cargo", "run", "--quiet", "--release", "--package", "taut", "--no-default-features", "--example", "fit_speed", "--"]

CASE = """title = "Four friction parameters"
motor = {{ torque_constant = {kt}, back_emf_constant = {ke}, resistance = {resistance} }}
drive_pulley = {{ radius = {r}, inertia = {j1}, friction = {{ viscous = {p[0]}, coulomb = {p[2]} }} }}
idler_pulley = {{ inertia = {j3}, friction = {{ viscous = {p[0]}, coulomb = {p[2]} }} }}
cart = {{ mass = {mass}, friction = {{ viscous = {p[1]}, coulomb = {p[3]} }} }}
belt = {{ stiffness = [{k1}, {k2}, {k3}] }}
{experiments}
[fit]
free = ["cart.friction.viscous", "cart.friction.coulomb"]
tied = [
    ["drive_pulley.friction.viscous", "idler_pulley.friction.viscous"],
    ["drive_pulley.friction.coulomb", "idler_pulley.friction.coulomb"],
]
"""

EXPERIMENT = """
[[experiment]]
name = "{volts:g} V"
log = {{ file = "{volts:g}.csv", time = "time_s", input = "voltage_V", drive_angle = "drive_angle_rad", cart_position = "cart_position_m" }}
"""


def clock():
    """Seconds of the processor that this process and those it has waited for have had."""
    both = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(used.ru_utime + used.ru_stime for used in both)


def machine(parameters, volts):
    """The paper's machine with these four numbers, and a pulse of so many volts."""
    b, cart_b, c, cart_c = parameters
    return speed.Pulse((b, cart_b, b), (c, cart_c, c), volts)


def by_scipy(method, rtol):
    """Drive angle and cart position at the samples."""
    return lambda p, volts: speed.scipy_run(machine(p, volts), method, rtol)[0][:, [0, 2]].T


class Cvode:
    """The same by the C program, which is asked through a pipe."""

    def __init__(self, program, method, rtol):
        command = [program, "fit", method, repr(rtol)]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def __call__(self, p, volts):
        b, cart_b, c, cart_c = map(float, p)
        self.process.stdin.write(f"{volts!r} {b!r} {cart_b!r} {b!r} {c!r} {cart_c!r} {c!r}\n".encode())
        self.process.stdin.flush()
        answer = np.frombuffer(self.process.stdout.read(16 * ROWS)).reshape(2, ROWS)
        if not np.isfinite(answer).all():
            raise RuntimeError("chatter, or no solution")
        return answer

    def close(self):
        self.process.communicate()


class Logs:
    """What was seen, and how far a model is from it."""

    def __init__(self, noisy):
        random = np.random.default_rng(1)
        exact = by_scipy("LSODA", 1e-11)
        self.seen = [exact(TRUTH, volts) for volts in VOLTS]
        self.deviation = np.array(DEVIATION if noisy else [0.01 * np.ptp(self.seen[1][k]) for k in (0, 1)])
        if noisy:
            self.seen = [seen + self.deviation[:, None] * random.standard_normal(seen.shape) for seen in self.seen]

    def residuals(self, solve, parameters):
        pairs = zip(VOLTS, self.seen)
        return np.concatenate([((solve(parameters, volts) - seen) / self.deviation[:, None]).ravel() for volts, seen in pairs])

    def write(self, folder):
        """Two CSV files and the case that names them."""
        experiments = ""
        for volts, seen in zip(VOLTS, self.seen):
            inputs = np.where(speed.SAMPLES < 0.25, volts, 0.0)
            rows = "".join(f"{t!r},{u!r},{a!r},{x!r}\n" for t, u, a, x in np.column_stack([speed.SAMPLES, inputs, *seen]).tolist())
            (folder / f"{volts:g}.csv").write_text("time_s,voltage_V,drive_angle_rad,cart_position_m\n" + rows)
            experiments += EXPERIMENT.format(volts=volts)
        s = speed.TABLE4
        numbers = dict(kt=s.torque_constant, ke=s.back_emf_constant, resistance=s.resistance, r=s.pulley_radius, mass=s.cart_mass)
        numbers |= dict(j1=s.drive_inertia, j3=s.idler_inertia, k1=s.k1, k2=s.k2, k3=s.k3, p=START.tolist())
        case = folder / "case.toml"
        case.write_text(CASE.format(experiments=experiments, **numbers))
        return case


def fit_by_taut(case, runs):
    """(seconds, simulated logs, how it ended, estimates): the mean of the runs after the first."""
    seconds = []
    # Built beforehand, so that no time of the compiler's counts.
    subprocess.run([TAUT[0], "build", *TAUT[2:-1]], cwd=speed.HERE.parent, check=True)
    for count in (1, 1 + runs):
        begin = clock()
        done = subprocess.run([*TAUT, str(case), str(count)], cwd=speed.HERE.parent, capture_output=True, text=True, check=True)
        seconds.append(clock() - begin)
    first, *rows = done.stdout.splitlines()
    _, _, simulations, ending = first.split()
    cart_b, cart_c, b, c = (float(row.rsplit(" ", 2)[1]) for row in rows)
    return (seconds[1] - seconds[0]) / runs, int(simulations), ending, np.array([b, cart_b, c, cart_c])


def fit_by_least_squares(logs, start, step):
    """The same by SciPy's trust region over a solver, which `start` starts."""
    count = 0

    def residuals(x):
        nonlocal count
        count += len(VOLTS)
        return logs.residuals(solve, START * x)

    begin = clock()
    solve = start()
    found = least_squares(residuals, np.ones(4), bounds=(0.0, 100.0), x_scale="jac", diff_step=step)
    if isinstance(solve, Cvode):
        solve.close()
    ending = {0: "out_of_iterations", 1: "gradient", 2: "cost", 3: "step", 4: "cost_and_step"}[found.status]
    return clock() - begin, count, ending, START * found.x


def compare(noisy, cvode):
    logs, exact = Logs(noisy), by_scipy("LSODA", 1e-11)
    rivals = {}
    with tempfile.TemporaryDirectory() as folder:
        case = logs.write(Path(folder))
        rivals["taut fit"] = fit_by_taut(case, 20)
    if cvode:
        for rtol in (1e-6, 1e-8):
            start = lambda rtol=rtol: Cvode(cvode, "adams", rtol)
            rivals[f"CVODE adams {rtol:.0e}"] = fit_by_least_squares(logs, start, rtol**0.5)
    for method, rtol in (("LSODA", 1e-6), ("LSODA", 1e-8), ("RK45", 1e-6)):
        start = lambda method=method, rtol=rtol: by_scipy(method, rtol)
        rivals[f"SciPy {method} {rtol:.0e}"] = fit_by_least_squares(logs, start, rtol**0.5)
    print(f"\n{'with noise' if noisy else 'exact'}: {2 * ROWS} rows; truth {', '.join(f'{n} {v:g}' for n, v in zip(NAMES, TRUTH))}")
    heads = "".join(f"{name:>18}" for name in NAMES)
    print(f"{'solver':<20}{'seconds':>10}{'times taut':>12}{'simulated logs':>16}{'cost':>12}{heads}  ended by")
    least = rivals["taut fit"][0]
    for name, (seconds, count, ending, found) in rivals.items():
        cost = 0.5 * np.sum(logs.residuals(exact, found) ** 2)
        numbers = "".join(f"{v:>18.8g}" for v in found)
        print(f"{name:<20}{seconds:>10.4f}{seconds / least:>12.0f}{count:>16}{cost:>12.5g}{numbers}  {ending}", flush=True)


def main():
    with tempfile.TemporaryDirectory() as folder:
        cvode = speed.compile_cvode(folder)
        for noisy in (False, True):
            compare(noisy, cvode)


if __name__ == "__main__":
    sys.exit(main())
