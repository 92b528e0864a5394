"""The key figures of a sweep, each computed here from whole trajectories: `tests/authorities/metrics.json`.

A few machines of a sweep (`SWEEPS`) are run again one by one by `taut simulate`, with their parameters as numbers on
its command line and rows `EVERY` apart, a fiftieth of the sweep's; what it writes (every quantity at every row, and the
events) is looked at with NumPy, by the definitions in `FIGURES` and nothing else. Rows miss the top of a peak by at
most (ω h)²/8 of what swings, 2e-4 at 2000 rad/s: figures that are peaks of the motion have to agree to `PEAK`, times of
peaks to `TIME`, all others to the last digits. The program `taut` is taken from target/, or from where TAUT says.
"""

from __future__ import annotations

import csv
import json
import os
import subprocess
import tempfile
import tomllib
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
EVERY = 2e-5
PEAK, TIME = 2e-4, 2e-3
SWEEPS = [
    ("stages/sollmann-jouaneh/table4.toml", 6, "sobol", ["all=20 %"]),
    ("stages/laser-gantry/laser-gantry.toml", 4, "latin-hypercube", ["cart.mass=20 %", "motor.resistance=20 %", "cart.friction.coulomb=20 %"]),
    ("stages/printer-axis/printer-axis.toml", 4, "random", ["cart.mass=15 %", "cart.friction.viscous=15 %", "motor.torque_constant=15 %"]),
]


def program():
    """Where `taut` is."""
    found = [os.environ.get("TAUT"), ROOT / "target/release/taut", ROOT / "target/debug/taut"]
    return str(next(path for path in found if path and Path(path).exists()))


def read(path):
    """Columns by heading; those that are no numbers as texts."""
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    columns = {}
    for name, *values in zip(*rows):
        try:
            columns[name] = np.array([float(value) for value in values])
        except ValueError:
            columns[name] = np.array(values)
    return columns


def largest(values):
    """The value of largest magnitude, with its sign; the first of equal ones."""
    return values[np.argmax(np.abs(values))]


class Run:
    """One run: columns of the trajectory, the pulleys' radius, the events."""

    def __init__(self, columns, events, radius):
        self.columns, self.events, self.radius = columns, events, radius

    def __getattr__(self, name):
        return self.columns[name]

    def drive(self):
        return self.radius * self.drive_angle_rad

    def idler(self):
        return self.radius * self.idler_angle_rad

    def input(self):
        return self.columns.get("input_V", self.columns.get("input_A", self.voltage_V))

    def at_rest(self):
        states = [self.drive_state[-1], self.cart_state[-1], self.idler_state[-1]]
        speeds = [self.drive_speed_rad_s[-1], self.cart_speed_m_s[-1], self.idler_speed_rad_s[-1]]
        return all(value == 0 for value in states + speeds)

    def steady(self):
        """The speed at the end of the last stretch on which the input keeps one value other than zero, no shorter than
        a fiftieth of the run."""
        u, t, last = self.input(), self.time_s, np.nan
        edges = [0, *(np.flatnonzero(np.diff(u)) + 1), len(u) - 1]
        for begin, end in zip(edges, edges[1:]):
            if t[end] - t[begin] >= t[-1] / 50 * (1 - 1e-9) and u[begin] != 0:
                # The row on the edge has the input that follows, and the same speed.
                last = self.cart_speed_m_s[end]
        return last

    def counted(self, body, test):
        if not self.events:
            return 0
        rows = zip(self.events["part"], self.events["from"], self.events["to"])
        return sum(1 for part, before, after in rows if part == body and test(before, after))

    def last_stop(self):
        if not self.at_rest():
            return np.nan
        bodies = [t for t, part in zip(self.events.get("time_s", []), self.events.get("part", [])) if part in ("drive", "cart", "idler")]
        return bodies[-1] if bodies else 0.0


def stops(before, after):
    return after == "stuck"


def reversals(before, after):
    return "stuck" not in (before, after)


FIGURES = {
    "final_drive_travel": lambda run: run.drive()[-1],
    "final_cart_position": lambda run: run.cart_position_m[-1],
    "final_cart_speed": lambda run: run.cart_speed_m_s[-1],
    "final_drive_travel_minus_cart": lambda run: run.drive()[-1] - run.cart_position_m[-1],
    "peak_cart_speed": lambda run: largest(run.cart_speed_m_s),
    "peak_cart_speed_time": lambda run: run.time_s[np.argmax(np.abs(run.cart_speed_m_s))],
    "peak_drive_speed": lambda run: run.radius * largest(run.drive_speed_rad_s),
    "steady_speed": lambda run: run.steady(),
    "peak_span1_stretch": lambda run: largest(run.drive() - run.cart_position_m),
    "peak_span2_stretch": lambda run: largest(run.cart_position_m - run.idler()),
    "peak_span3_stretch": lambda run: largest(run.idler() - run.drive()),
    "peak_span1_force": lambda run: largest(run.span1_force_N),
    "peak_span2_force": lambda run: largest(run.span2_force_N),
    "peak_span3_force": lambda run: largest(run.span3_force_N),
    "peak_belt_force": lambda run: max(np.abs([run.span1_force_N, run.span2_force_N, run.span3_force_N]).ravel()),
    "peak_motor_current": lambda run: largest(run.motor_current_A),
    "stop_time": lambda run: run.last_stop(),
    "settled": lambda run: float(run.at_rest()),
    "drive_stops": lambda run: run.counted("drive", stops),
    "drive_reversals": lambda run: run.counted("drive", reversals),
    "cart_stops": lambda run: run.counted("cart", stops),
    "cart_reversals": lambda run: run.counted("cart", reversals),
    "idler_stops": lambda run: run.counted("idler", stops),
    "idler_reversals": lambda run: run.counted("idler", reversals),
}


def file_name(name):
    return "".join(c if c.isalnum() else "-" for c in name.lower())


def main():
    taut, lines, text = program(), [], []
    for case, count, design, vary in SWEEPS:
        plan = ["--runs", str(count), "--design", design, *(word for how in vary for word in ("--vary", how))]
        experiments = [e["name"] for e in tomllib.loads((ROOT / case).read_text())["experiment"]]
        with tempfile.TemporaryDirectory() as folder:
            rows = Path(folder) / "rows.csv"
            subprocess.run([taut, "sweep", case, *plan, "--out", str(rows), "--quiet"], cwd=ROOT, check=True)
            table = read(rows)
            swept = json.loads(subprocess.run([taut, "sweep", case, *plan, "--json"], cwd=ROOT, check=True, capture_output=True, text=True).stdout)
            parameters = [(p["name"], heading) for p, heading in zip(swept["parameters"], swept["columns"][1:])]
            runs, worst, peaks, times = [], 0.0, 0.0, 0.0
            for run in range(count):
                values = {name: float(table[heading][run]) for name, heading in parameters}
                out = Path(folder) / f"run-{run}"
                changes = [word for name, value in values.items() for word in ("--set", f"{name}={value!r}")]
                changes += [word for k in range(len(experiments)) for word in ("--set", f"experiment.{k}.every={EVERY}")]
                subprocess.run([taut, "simulate", case, *changes, "--out", str(out), "--no-report", "--quiet"], cwd=ROOT, check=True)
                radius = json.loads((out / "summary.json").read_text())["stage"]["pulley_radius_m"]
                for experiment in experiments:
                    name = file_name(experiment)
                    events = read(out / f"{name}.events.csv") if (out / f"{name}.events.csv").exists() else {}
                    seen = Run(read(out / f"{name}.csv"), events, radius)
                    figures = {key: float(figure(seen)) for key, figure in FIGURES.items()}
                    runs.append({"run": run, "experiment": name, "figures": {k: None if np.isnan(v) else v for k, v in figures.items()}})
                    for key, value in figures.items():
                        heading = next(h for h in swept["columns"] if h == f"{name}.{key}" or h.startswith(f"{name}.{key}_") and h.removeprefix(f"{name}.{key}_") in ("m", "s", "m_s", "N", "A"))
                        mine = float(table[heading][run])
                        if np.isnan(value) != np.isnan(mine):
                            raise SystemExit(f"{case} run {run} {heading}: {value} and {mine}")
                        if not np.isnan(value):
                            if key.endswith("_time") and key.startswith("peak"):
                                times = max(times, abs(mine - value))
                            elif key.startswith("peak"):
                                peaks = max(peaks, abs(mine - value) / max(abs(value), 1e-9))
                            else:
                                worst = max(worst, abs(mine - value) / max(abs(value), 1e-3))
            inner = ",\n  ".join(json.dumps(run) for run in runs)
            lines.append(f'{{"case": "{case}", "runs": {count}, "design": "{design}", "vary": {json.dumps(vary)}, "figures": [\n  {inner}\n]}}')
            text.append(f"{case}: {count} machines, {len(parameters)} parameters, {len(runs)} simulations, {len(FIGURES)} figures each: largest relative difference {worst:.1e}, of peaks {peaks:.1e}, of their times {times:.1e} s")
            if worst > 1e-9 or peaks > PEAK or times > TIME:
                raise SystemExit(text[-1])
    (ROOT / "tests/authorities/metrics.json").write_text("[\n" + ",\n".join(lines) + "\n]\n")
    (HERE / "output/metrics.txt").write_text("\n".join(text) + "\n")
    print("\n".join(text))


if __name__ == "__main__":
    main()
