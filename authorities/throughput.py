"""Simulations a second, side by side in one run: many machines, each its own parameters, metrics out.

The problem of `taut sweep`: the paper's machine (Table 4 with the rest of Table 2), all parameters by +-20 %, pulses of
5 V and 10 V for 0.25 s, 1 s each with a row every millisecond; out come where the cart ends, its peak speed and the
peak force in span 1. All on all processors.

- taut: `examples/sweep.rs` on as many threads as there are processors, all 24 figures of a sweep, and three of them
  (`--figures`).
- C in lanes (lanes.c): the same plain Runge-Kutta of fourth order as under Numba, written by hand for vectors: eight
  machines in the lanes of AVX-512, or four in those of AVX2, ways along the belt, a batch ends when all of its machines
  rest; one process for each processor. It knows this one axis with this one law of friction, has no events, takes the
  three figures from rows and nothing else, and its error is that of its step.
- SciPy: `solve_ivp` with events (speed.py's own loop), multiprocessing.
- CVODE in C (cvode.c) with root finding, one process for each processor, each the nominal machine at 5 V again and
  again: its parameters are constants of the program.
- Numba: a plain fixed-step Runge-Kutta of fourth order, compiled, with friction in the plainest way that sticks: a body
  at zero speed whose load is within its Coulomb friction stays there, and a step that turns a speed round ends at zero.
  Its step is halved until the error is that stated.
- MuJoCo: three sliding masses with friction loss, spans as tendons, its `rollout` on as many threads as there are
  processors.
- diffrax: Tsit5 with steps of its own, batches of 128 machines at once (`vmap`), dry friction smoothed, as stick and
  slip of each machine have events of their own.

The error is the largest distance of drive pulley, cart and idler positions at any row from those of authority B, for
the nominal machine at 5 V; taut's own is in speed.py's output. SciPy and CVODE have the loosest tolerance whose error
is below 1e-6 m. A fixed step meets the stops of one machine better or worse than those of another, so that C in lanes
is also run with the fewest steps for which the cart of 95 % of 1000 simulations of drawn machines, and of all of them,
ends within 4e-7 m of where it does for `taut sweep`, whose rows are within 1e-12 m of the exact solver's. Rates are
those of wall time, a few seconds each, and vary with what else the computer does.
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
# Of the carts of drawn machines, m.
NEAR = 4e-7
STEPS = (2, 4, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512)
TAUT = ["cargo", "run", "--quiet", "--release", "--package", "taut", "--no-default-features", "--example", "sweep", "--"]


FIGURES = "final_cart_position,peak_cart_speed,peak_span1_force"
TURNS = 5


def by_taut(*figures, seconds=SECONDS):
    """Simulations a second."""
    runs = 1000
    while True:
        command = [*TAUT, str(runs), str(PROCESSORS), *figures]
        out = subprocess.run(command, cwd=HERE.parent, capture_output=True, text=True, check=True).stdout
        told = json.loads(out)
        if told["seconds"] > seconds / 2:
            return told["simulations_per_second"]
        runs = int(runs * max(2.0, seconds / max(told["seconds"], 0.01)))


def error(rows, truth):
    """The largest distance in position, m."""
    return speed.position_error(rows, truth.exact)


# --- SciPy ----------------------------------------------------------------------------------------------------------


def machine(factors, volts):
    """Table 4, every parameter of friction times one of these factors."""
    viscous = tuple(b * f for b, f in zip(speed.VISCOUS, factors[:3]))
    coulomb = tuple(c * f for c, f in zip(speed.COULOMB, factors[3:6]))
    return speed.Pulse(viscous, coulomb, volts)


def scipy_runs(job):
    """Runs machines for so long; how many."""
    seed, method, rtol, seconds = job
    random = np.random.default_rng(seed)
    begin, count = time.perf_counter(), 0
    while time.perf_counter() - begin < seconds:
        factors = random.uniform(0.8, 1.2, 6)
        for volts in (5.0, 10.0):
            states = speed.scipy_run(machine(factors, volts), method, rtol)[0]
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
            run = speed.program_rival(truth, [program], [method])
            for rtol in speed.TOLERANCES:
                try:
                    took, off, _ = run(rtol, 0.1)
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


# --- C in lanes -----------------------------------------------------------------------------------------------------


def lanes_rate(program, steps, seconds):
    """Simulations a second of one process for each processor."""
    commands = [[program, "rate", str(steps), str(seconds), str(seed)] for seed in range(PROCESSORS)]
    running = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for command in commands]
    told = [process.communicate()[0].split() for process in running]
    return sum(int(done) / float(took) for done, took, _ in told)


# The numbers of a machine as lanes.c has them.
NUMBERS = [
    *("motor.torque_constant_N_m_A", "motor.back_emf_constant_V_s_rad", "motor.resistance_ohm", "drive_pulley.radius_m"),
    *("drive_pulley.inertia_kg_m^2", "cart.mass_kg", "idler_pulley.inertia_kg_m^2"),
    *(f"belt.stiffness.{span}_N_m" for span in range(3)),
    *("drive_pulley.friction.viscous_N_m_s_rad", "cart.friction.viscous_N_s_m", "idler_pulley.friction.viscous_N_m_s_rad"),
    *("drive_pulley.friction.coulomb_N_m", "cart.friction.coulomb_N", "idler_pulley.friction.coulomb_N_m"),
]


def drawn(folder):
    """500 machines, each number by +-20 %, as text, and where their carts end at 5 V and at 10 V by `taut sweep`, m."""
    file = Path(folder) / "drawn.csv"
    options = ["--runs", "500", "--vary", "all=20%", "--design", "sobol", "--figures", "final_cart_position"]
    case = "stages/sollmann-jouaneh/table4.toml"
    command = ["cargo", "run", "--quiet", "--release", "--package", "taut-cli", "--", "sweep", case, *options, "--out", file]
    subprocess.run(command, cwd=HERE.parent, capture_output=True, check=True)
    head, *rows = [line.split(",") for line in file.read_text().splitlines() if not line.startswith("#")]
    machines = "\n".join(" ".join(row[head.index(name)] for name in NUMBERS) for row in rows)
    ends = [[float(row[head.index(f"{volts}-v-pulse.final_cart_position_m")]) for volts in (5, 10)] for row in rows]
    return machines, np.array(ends)


def by_lanes(truth, folder):
    """Name, errors, program and steps of a row, for vectors of eight and of four numbers: the fewest steps by the nominal
    machine, by most of the drawn ones, and by all. Errors are those of the nominal machine, and the median, the 95 %
    quantile and the largest one of the drawn ones."""
    has_512 = "avx512f" in Path("/proc/cpuinfo").read_text()
    machines, ends = drawn(folder)
    found = []
    for lanes in (8, 4) if has_512 else (4,):
        program = str(Path(folder) / f"lanes{lanes}")
        options = ["-O3", "-march=native", "-ffast-math", "-Wno-psabi", f"-DLANES={lanes}"]
        try:
            subprocess.run(["gcc", *options, "-o", program, str(HERE / "lanes.c"), "-lm"], check=True)
        except (OSError, subprocess.CalledProcessError):
            return []
        wanted = [(0, TARGET), (2, NEAR), (3, NEAR)]
        for steps in STEPS:
            out = subprocess.run([program, "rows", str(steps)], capture_output=True, check=True).stdout
            told = subprocess.run([program, "ends", str(steps)], input=machines, capture_output=True, check=True, text=True)
            off = np.abs(np.array(told.stdout.split(), float).reshape(ends.shape) - ends)
            errors = [error(np.frombuffer(out).reshape(1001, 3), truth), *np.quantile(off, [0.5, 0.95, 1.0])]
            met = [goal for goal in wanted if errors[goal[0]] <= goal[1]]
            if met:
                wanted = [goal for goal in wanted if goal not in met]
                found.append((f"C, {lanes} lanes, {steps} steps a ms", errors, program, steps))
            if not wanted:
                break
    return found


def in_turns(truth):
    """Taut with all figures and with three, and C in lanes: one after another, again and again; the middle of each
    one's rates."""
    with tempfile.TemporaryDirectory() as folder:
        lanes = by_lanes(truth, folder)
        works = [("taut sweep, 24 figures", None, by_taut), ("taut sweep, 3 figures", None, lambda seconds: by_taut(FIGURES, seconds=seconds))]
        for name, off, program, steps in lanes:
            works.append((name, off, lambda seconds, program=program, steps=steps: lanes_rate(program, steps, seconds)))
        rates = [[] for _ in works]
        for _ in range(TURNS):
            for rate_, (_, _, work) in zip(rates, works):
                rate_.append(work(seconds=SECONDS / 3))
        return [(name, off, float(np.median(rate_))) for (name, off, _), rate_ in zip(works, rates)]


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


# --- MuJoCo ---------------------------------------------------------------------------------------------------------

try:
    import mujoco
    from mujoco import rollout
except ImportError:
    mujoco = None

WORLD = """<mujoco><option gravity="0 0 0" timestep="{h!r}" integrator="{integrator}" iterations="50" tolerance="1e-14"/>
<worldbody>{bodies}</worldbody><tendon>{spans}</tendon><actuator><motor joint="q0"/></actuator></mujoco>"""
BODY = """<body><joint name="q{i}" type="slide" axis="1 0 0" damping="{damping!r}" frictionloss="{friction!r}" solreffriction="{time!r} 1"
solimpfriction="0.9999 0.9999 0.001 0.5 2"/><inertial pos="0 0 0" mass="{mass!r}" diaginertia="1 1 1"/></body>"""
SPAN = """<fixed stiffness="{k!r}" springlength="0"><joint joint="q{a}" coef="1"/><joint joint="q{b}" coef="-1"/></fixed>"""


def mujoco_model(p, h, integrator):
    """Three sliding masses with friction loss, spans as tendons; all along the belt."""
    kt, ke, resistance, r = p[:4]
    arm = np.array([r, 1.0, r])
    mass, damping, friction = p[4:7] / arm**2, p[10:13] / arm**2, p[13:16] / arm
    damping[0] += kt * ke / resistance / r**2
    columns = zip(mass.tolist(), damping.tolist(), friction.tolist())
    bodies = "".join(BODY.format(i=i, mass=m, damping=b, friction=f, time=2.0 * h) for i, (m, b, f) in enumerate(columns))
    ends = [(p[7], 0, 1), (p[8], 1, 2), (p[9], 2, 0)]
    spans = "".join(SPAN.format(k=float(k), a=a, b=b) for k, a, b in ends)
    return mujoco.MjModel.from_xml_string(WORLD.format(h=h, integrator=integrator, bodies=bodies, spans=spans))


def mujoco_run(parameters, volts, steps, integrator, pool, data):
    """Positions at the rows of each machine, and the figures of all."""
    models = [mujoco_model(p, 1e-3 / steps, integrator) for p in parameters]
    while len(data) < PROCESSORS:
        data.append(mujoco.MjData(models[0]))
    force = np.zeros((len(models), 1000 * steps, 1))
    force[:, : 250 * steps, 0] = [[p[0] * volts / p[2] / p[3]] for p in parameters]
    start = np.zeros((len(models), mujoco.mj_stateSize(models[0], mujoco.mjtState.mjSTATE_FULLPHYSICS)))
    states, _ = pool.rollout(models, data, start, force)
    rows = np.concatenate([np.zeros((len(models), 1, 6)), states[:, steps - 1 :: steps, 1:7]], axis=1)
    k1 = np.array([[p[7]] for p in parameters])
    figures = rows[:, -1, 1], np.max(np.abs(rows[:, :, 4]), axis=1), np.max(np.abs(k1 * (rows[:, :, 0] - rows[:, :, 1])), axis=1)
    return rows[:, :, :3], figures


def by_mujoco(truth):
    """Integrator and steps of a row that are near enough in the least time, error and simulations a second."""
    if mujoco is None:
        return []
    found, p = [], nominal()
    with rollout.Rollout(nthread=PROCESSORS) as pool:
        for target in (1e-5, TARGET):
            best = None
            for integrator in ("Euler", "implicitfast", "RK4"):
                steps, off = 1, np.inf
                while steps <= 256 and not off < target:
                    steps *= 2
                    begin = time.perf_counter()
                    rows = mujoco_run([p], 5.0, steps, integrator, pool, [])[0][0] / [p[3], 1.0, p[3]]
                    took, off = time.perf_counter() - begin, error(rows, truth)
                if off < target and (best is None or took < best[3]):
                    best = (integrator, steps, off, took)
            integrator, steps, off, _ = best
            random, data = np.random.default_rng(1), []
            begin, done = time.perf_counter(), 0
            while time.perf_counter() - begin < SECONDS:
                machines = p * random.uniform(0.8, 1.2, (16, len(p)))
                for volts in (5.0, 10.0):
                    mujoco_run(machines, volts, steps, integrator, pool, data)
                    done += len(machines)
            found.append((f"MuJoCo {integrator}, {steps} steps a ms", off, done / (time.perf_counter() - begin)))
    return found


# --- diffrax --------------------------------------------------------------------------------------------------------

try:
    import diffrax
    import jax

    jax.config.update("jax_enable_x64", True)
except ImportError:
    diffrax = None


def by_diffrax(truth):
    """Batches of machines at once (vmap), Tsit5 with steps of its own; dry friction as F_c tanh(v/v0), which never
    sticks."""
    if diffrax is None:
        return []
    np_, times = jax.numpy, jax.numpy.linspace(0.0, 1.0, 1001)

    def rate(t, y, given):
        p, volts, v0 = given
        u = np_.where(t < 0.25, volts, 0.0)
        q, v, r = y[:3], y[3:], p[3]
        f1, f2, f3 = p[7] * (r * q[0] - q[1]), p[8] * (q[1] - r * q[2]), p[9] * (r * q[2] - r * q[0])
        load = np_.stack([r * (f3 - f1) + p[0] * (u - p[1] * v[0]) / p[2], f1 - f2, r * (f2 - f3)])
        friction = p[10:13] * v + p[13:16] * np_.tanh(np_.stack([r, 1.0, r]) * v / v0)
        return np_.concatenate([v, (load - friction) / p[4:7]])

    def run(p, volts, v0, rtol):
        steps = diffrax.PIDController(rtol=rtol, atol=1e-3 * rtol)
        given = dict(saveat=diffrax.SaveAt(ts=times), stepsize_controller=steps, max_steps=1_000_000)
        rows = diffrax.diffeqsolve(
            diffrax.ODETerm(rate), diffrax.Tsit5(), 0.0, 1.0, None, np_.zeros(6), (p, volts, v0), **given
        ).ys
        stretch = p[3] * rows[:, 0] - rows[:, 1]
        return rows[:, :3], (rows[-1, 1], np_.max(np_.abs(rows[:, 4])), np_.max(np_.abs(p[7] * stretch)))

    one, many = jax.jit(run), jax.jit(jax.vmap(lambda *given: run(*given)[1], in_axes=(0, None, None, None)))
    found, p = [], nominal()
    for target in (1e-5, TARGET):
        best = None
        for v0 in (1e-3, 3e-4, 1e-4, 3e-5, 1e-5):
            for rtol in (1e-4, 1e-5, 1e-6, 1e-7):
                off = error(np.asarray(one(p, 5.0, v0, rtol)[0]), truth)
                begin = time.perf_counter()
                jax.block_until_ready(one(p, 5.0, v0, rtol))
                took = time.perf_counter() - begin
                if off < target and (best is None or took < best[3]):
                    best = (v0, rtol, off, took)
        if best is None:
            found.append((f"diffrax Tsit5, below {target:g} m", np.nan, None))
            continue
        v0, rtol, off, _ = best
        random = np.random.default_rng(1)
        batch = lambda: p * random.uniform(0.8, 1.2, (128, len(p)))  # noqa: E731
        jax.block_until_ready(many(batch(), 5.0, v0, rtol))
        begin, done = time.perf_counter(), 0
        while time.perf_counter() - begin < SECONDS:
            machines = batch()
            for volts in (5.0, 10.0):
                jax.block_until_ready(many(machines, volts, v0, rtol))
                done += len(machines)
        found.append((f"diffrax Tsit5 {rtol:g}, v0 {1e3 * v0:g} mm/s", off, done / (time.perf_counter() - begin)))
    return found


def main():
    truth = speed.Problem("coulomb")
    turns = in_turns(truth)
    mine = turns[0][2]
    others = "--turns" not in sys.argv[1:]
    rivals = [by_scipy(truth), by_cvode(truth), *by_numba(truth), *by_mujoco(truth), *by_diffrax(truth)] if others else []
    lines = [
        f"{PROCESSORS} processors; position error at 5 V against authority B, m; of C in lanes also the median, the 95 % quantile",
        "and the largest error of the carts' ends of 1000 simulations of drawn machines, m; simulations a second, and how many",
        "times fewer than taut's",
        "",
    ]
    for name, off, rate_ in turns:
        told = " ".join(f"{one:9.1e}" for one in off) if off else f"{'–':>39}"
        lines.append(f"{name:34} {told} {rate_:10.0f} {mine / rate_:9.2f}")
    if len(turns) == 2:
        lines.append("C in lanes: not measured (no compiler)")
    for rival in filter(None, rivals):
        name, off, rate_ = rival
        told = "not reached" if rate_ is None else f"{off:9.1e} {rate_:40.1f} {mine / rate_:9.0f}"
        lines.append(f"{name:34} {told}")
    if not others:
        text = "\n".join(lines) + "\n"
        (HERE / "output" / "turns.txt").write_text(text)
        print(text, end="")
        return
    if rivals[1] is None:
        lines.append("CVODE: not measured (no compiler or no libsundials-dev, or no tolerance was near enough)")
    if numba is None:
        lines.append("Numba: not measured (not installed)")
    for name, module in (("MuJoCo", mujoco), ("diffrax", diffrax)):
        if module is None:
            lines.append(f"{name}: not measured (not installed)")
    text = "\n".join(lines) + "\n"
    (HERE / "output" / "throughput.txt").write_text(text)
    print(text, end="")


if __name__ == "__main__":
    sys.exit(main())
