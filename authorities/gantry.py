"""Random H-frames and CoreXY gantries, and elastic modes in 60 digits: tests/authorities/gantry.json.

Each case is a case file's text, solved by Taylor series in 80-bit numbers (B), the same in 64-bit numbers, and DOP853
(A). It is kept if all see the same changes and agree to 1e-11 m at the belt and 1e-9 s, if nothing is nearly undecided,
and if enough sticks and slips. All numbers are chosen: of the H-frame's paper no parameter values were recovered.
"""

from __future__ import annotations

import argparse
import collections
import json
import math
import time
from pathlib import Path

import mpmath
import numpy as np

import gantry_dop853
import gantry_taylor
from casefile import toml
from elements_rules import Doubt
from gantry_case import BODIES, WORD, Gantry

OUTPUT = Path(__file__).resolve().parents[1] / "tests" / "authorities" / "gantry.json"
CASES, ROWS, EVERY = 100, 25, 1e-3
FEWEST, MOST = 8, 160  # events of a case worth keeping
LIMITS = {"belt_m": 1e-11, "belt_m_s": 1e-8, "event_s": 1e-9}
COLUMNS = ["left_angle", "left_speed", "right_angle", "right_speed", "bridge_position", "bridge_speed", "cart_position", "cart_speed"]

INPUTS = [
    ("pulse", "step"), ("sine", "triangle"), ("triangle", "triangle"), ("square", "pulse"), ("ramp", "sine"),
    ("step", "sine"), ("table", "square"), ("sine", "sine"), ("pulse", "pulse"), ("triangle", "rest"),
    ("square", "square"), ("rest", "sine"), ("table", "triangle"), ("pulse", "ramp"), ("square", "sine"),
    ("triangle", "table"), ("step", "square"),
]  # fmt: skip

#   the table of three machines: kind, stiffnesses in N/m, elastic modes in Hz as they are documented
MACHINES = [
    ("h-frame", [132760.0, 132760.0, 58885.0], ["196.643946994", "220.198687165"]),
    ("h-frame", [100000.0, 200000.0, 80000.0], ["193.499561135", "257.381999764"]),
    ("core-xy", [150000.0, 90000.0, 140000.0, 95000.0], ["214.360612188", "263.042776685"]),
]


# --- drawing ----------------------------------------------------------------------------------------------------------


class Draw:
    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)

    def even(self, low, high):
        return float(self.rng.uniform(low, high))

    def times(self, value, low=0.4, high=2.5):
        """The value times a factor, its logarithm even."""
        return float(value * math.exp(self.rng.uniform(math.log(low), math.log(high))))

    def chance(self, share):
        return self.rng.random() < share

    def friction(self, viscous, coulomb):
        entry = {"viscous": self.times(viscous), "coulomb": self.times(coulomb)}
        if self.chance(0.65):
            entry["static"] = entry["coulomb"] * self.even(1.05, 1.8)
        elif self.chance(0.5):
            entry["static"] = entry["coulomb"]
        if self.chance(0.15):
            entry["coulomb_backward"] = entry["coulomb"] * self.even(0.6, 1.0)
        return entry

    def motor(self, full=False):
        n = self.even(1.5, 6) if self.chance(0.4) else 1.0
        kt, R = self.times(0.05 / n, 0.5, 2), self.times(1.2)
        motor = {"torque_constant": kt, "back_emf_constant": kt if self.chance(0.6) else self.times(kt, 0.8, 1.25), "resistance": R}
        inductance = self.times(R * 8e-4) if self.chance(0.4) else 0.0
        rotor = self.times(5e-5 / n**2, 0.2, 2) if self.chance(0.5) else 0.0
        for key, value, usual in (("inductance", inductance, 0.0), ("rotor_inertia", rotor, 0.0), ("gear_ratio", n, 1.0)):
            if full or value != usual:
                motor[key] = value
        return motor

    def machine(self, kind):
        spans = [1.4e5, 1.4e5, 7e4] if kind == "h-frame" else [1.5e5, 9e4, 1.5e5, 9e4]
        two = self.chance(0.2)
        tables = {"title": "", "kind": kind, "motor": self.motor(two)}
        if two:
            tables["right_drive.motor"] = self.motor(True)
        tables |= {
            "drive_pulley": {
                "radius": self.even(0.009, 0.025),
                "inertia": self.times(6.3e-5, 0.5, 2.5),
                "friction": self.friction(0.0012, 0.012),
            },
            "bridge": {"mass": self.times(0.9, 0.5, 2.5), "friction": self.friction(8.0, 1.2)},
            "cart": {"mass": self.times(0.4), "friction": self.friction(5.0, 0.8)},
            "belt": {"stiffness": [self.times(k, 0.35, 2.2) for k in spans]},
        }
        if self.chance(0.55):
            mass = tables["cart"]["mass"]
            tables["belt"]["damping"] = [2 * self.times(0.008, 0.2, 4) * math.sqrt(k * mass) for k in tables["belt"]["stiffness"]]
        return tables

    def input(self, kind, full, until):
        """An input in proportion to the voltage that moves everything."""
        side = 1 if self.chance(0.6) else -1
        if kind == "rest":
            return {"step": 0.0}
        if kind == "step":
            return {"step": side * full * self.even(1.0, 3.0), "at": 0.0 if self.chance(0.4) else self.even(0.002, 0.05)}
        if kind == "pulse":
            at = {} if self.chance(0.4) else {"at": self.even(0.002, 0.1)}
            return {"pulse": side * full * self.even(1.2, 5), "for": round(self.even(0.15, 0.5) * until, 3)} | at
        if kind == "ramp":
            return {"ramp": side * full * self.even(1.2, 3), "over": self.even(0.3, 0.9) * until, "at": self.even(0, 0.05)}
        if kind == "triangle":
            return {"triangle": full * self.even(1.1, 3), "frequency": self.even(3, 14)}
        if kind == "square":
            return {"square": side * full * self.even(0.8, 3), "frequency": self.even(2, 9), "duty": self.even(0.3, 0.7)}
        if kind == "sine":
            return {
                "sine": full * self.even(1.2, 3),
                "frequency": self.even(3, 20),
                "phase": self.even(-3, 3) if self.chance(0.5) else 0.0,
                "offset": full * self.even(-0.4, 0.4) if self.chance(0.3) else 0.0,
            }
        count = int(self.rng.integers(5, 14))
        moments = np.sort(self.rng.uniform(0, until, count))
        return {"table": [[float(t), full * self.even(-2.5, 2.5)] for t in moments]}


def draw(number, seed):
    d = Draw(seed)
    tables = d.machine("h-frame" if number % 2 == 0 else "core-xy")
    until = round(d.even(0.3, 0.8), 2)
    r, static = tables["drive_pulley"]["radius"], lambda part: tables[part]["friction"].get("static", tables[part]["friction"]["coulomb"])
    torque = static("drive_pulley") + 0.5 * r * (static("bridge") + static("cart"))
    kinds, signals = INPUTS[number // 2 % len(INPUTS)], {}
    if number // 2 >= len(INPUTS):
        kinds = kinds[:: 1 if number // 2 >= 2 * len(INPUTS) else -1]
    for side, kind in zip(("left", "right"), kinds):
        motor = tables["motor"] if side == "left" else tables.get("right_drive.motor", tables["motor"])
        full = torque * motor["resistance"] / motor["torque_constant"] / motor.get("gear_ratio", 1.0)
        signals[side] = d.input(kind, full, until)
    name = f"{number:03d} {tables['kind']}: {kinds[0]}, {kinds[1]}"
    tables["title"] = name
    tables["experiment"] = [{"name": "run", "input": signals, "until": until, "every": EVERY}]
    return name, toml(tables)


# --- judging ----------------------------------------------------------------------------------------------------------


def differences(case, run, other):
    off = np.abs(np.array(run.rows) - np.array(other.rows)).max(axis=0)
    off[:4] *= case.r
    return {
        "belt_m": float(off[::2].max()),
        "belt_m_s": float(off[1::2].max()),
        "event_s": max((abs(a[0] - b[0]) for a, b in zip(run.events, other.events)), default=0.0),
    }


def in_order(run):
    """The events without their times, those of one moment sorted."""
    return [event[1:] for event in sorted(run.events, key=lambda event: (event[0], event[1]))]


def judge(name, seed, text):
    """(the record, None) or (None, why it is left out)."""
    case = Gantry(text)
    count = round(case.until / EVERY)
    rng = np.random.default_rng(seed + 10**6)
    chosen = {int(k) for k in rng.choice(np.arange(1, count), ROWS - 1, replace=False)}
    #   and a row on an edge, where there is one
    chosen |= {round(t / EVERY) for t in case.edges if t > 0 and abs(t - EVERY * round(t / EVERY)) < 1e-12}
    chosen = sorted(chosen) + [count]
    times = [k * EVERY for k in chosen[:-1]] + [case.until]
    try:
        run = gantry_taylor.solve(case, times)
        if run.doubts:
            return None, run.doubts[0]
        if not FEWEST <= len(run.events) <= MOST:
            return None, f"{len(run.events)} events"
        if max(np.abs(np.array(run.rows)[:, [4, 6]]).max(axis=0)) < 1e-4:
            return None, "bridge and cart hardly move"
        if any(abs(event[0] - t) < 1e-8 for event in run.events for t in times):
            return None, "an event falls on a row"
        coarse = gantry_taylor.solve(case, times, np.float64)
        rival = gantry_dop853.solve(case, times)
    except Doubt as doubt:
        return None, str(doubt)
    record = {"name": name, "seed": seed, "kind": case.kind, "case": text}
    for key, other in (("rounding_differs_by", coarse), ("methods_differ_by", rival)):
        if in_order(other) != in_order(run):
            return None, f"{key}: other events ({len(other.events)} instead of {len(run.events)})"
        off = differences(case, run, other)
        if too_far := [f"{what} {off[what]:.1e}" for what, limit in LIMITS.items() if not off[what] <= limit]:
            return None, f"{key}: {', '.join(too_far)}"
        record[key] = {what: float(f"{value:.1e}") for what, value in off.items()}
    record["rows"] = chosen
    record["states"] = [[t] + [float(f"{value:.15g}") for value in row] for t, row in zip(times, run.rows)]
    record["events"] = [[t, body, WORD[a], WORD[b]] for t, body, a, b in sorted(run.events, key=lambda e: (e[0], e[1]))]
    return record, None


# --- elastic modes ----------------------------------------------------------------------------------------------------


def energy(kind, k, r, q):
    """V, span by span."""
    p1, p2, x, y = q
    if kind == "h-frame":
        return (k[0] * (r * p1 + x + y) ** 2 + k[1] * (-r * p2 + x - y) ** 2 + k[2] * (-r * p1 + r * p2 - 2 * x) ** 2) / 2
    a, b = r * p1 - x - y, r * p2 - x + y
    return (k[0] * a**2 + k[1] * a**2 + k[2] * b**2 + k[3] * b**2) / 2


def elastic(kind, k, r, inertias):
    """The elastic modes in Hz, rising, in 60 digits; by the lever arms and by the energy, which have to agree."""
    k, r, inertias = [mpmath.mpf(v) for v in k], mpmath.mpf(r), [mpmath.mpf(v) for v in inertias]
    B = mpmath.matrix(gantry_taylor.levers(kind, r))
    root = mpmath.diag([1 / mpmath.sqrt(m) for m in inertias])
    squares = sorted(mpmath.eigsy(root * B.T * mpmath.diag(k) * B * root, eigvals_only=True))
    #   K_ij = V(e_i + e_j) − V(e_i) − V(e_j)
    unit = [[int(i == j) for j in range(4)] for i in range(4)]
    V = lambda *e: energy(kind, k, r, [sum(column) for column in zip(*e)])
    K = mpmath.matrix([[V(unit[i], unit[j]) - V(unit[i]) - V(unit[j]) for j in range(4)] for i in range(4)])
    again = mpmath.eig(mpmath.diag([1 / m for m in inertias]) * K, left=False, right=False)
    again = sorted(mpmath.re(value) for value in again)
    top = squares[-1]
    assert all(abs(value) < top * mpmath.mpf(10) ** -50 for value in squares[:2] + again[:2]), "two rigid modes"
    assert all(abs(a - b) < top * mpmath.mpf(10) ** -50 for a, b in zip(squares, again)), "the two ways agree"
    return [mpmath.sqrt(value) / (2 * mpmath.pi) for value in squares[2:]]


def modes():
    """Records of the three machines and of 20 random ones."""
    told = lambda hz: {"elastic_Hz": [float(f) for f in hz], "digits": [mpmath.nstr(f, 40) for f in hz]}
    records = []
    print("Elastic modes, Hz, in 60 digits, and the documented ones:")
    for kind, k, documented in MACHINES:
        r, j, total, cart = "0.0194", "6.3e-5", "1.2", "0.362"
        hz = elastic(kind, k, r, [j, j, total, cart])
        for f, text in zip(hz, documented):
            verdict = "as documented" if mpmath.nstr(f, 12) == text else f"DOCUMENTED AS {text}"
            print(f"  {kind:<8} {'/'.join(f'{v:g}' for v in k):<28} {mpmath.nstr(f, 30)}  {verdict}")
        tables = {
            "title": f"{kind}: documented",
            "kind": kind,
            "motor": {"torque_constant": 0.05, "back_emf_constant": 0.05, "resistance": 1.0},
            "drive_pulley": {"radius": 0.0194, "inertia": 6.3e-5},
            "bridge": {"mass": 0.838},
            "cart": {"mass": 0.362},
            "belt": {"stiffness": k},
            "experiment": [{"name": "run", "input": {"left": {"step": 1.0}, "right": {"step": 0.0}}, "until": 0.1, "every": EVERY}],
        }
        records.append({"name": tables["title"], "kind": kind, "case": toml(tables)} | told(hz))
    for number in range(20):
        name, text = draw(number, 900000 + number)
        case = Gantry(text)
        #   J + n² J_r and m_bridge + m_cart in 60 digits, too
        drives = []
        for drive in case.drives_as_given:
            inertia, rotor, n = (mpmath.mpf(v) for v in drive)
            drives.append(inertia + n**2 * rotor)
        hz = elastic(case.kind, case.k, case.r, [*drives, mpmath.mpf(case.m_bridge) + mpmath.mpf(case.m_cart), case.m_cart])
        print(f"  random {number:>2}, {case.kind:<8} {mpmath.nstr(hz[0], 20)} {mpmath.nstr(hz[1], 20)}")
        records.append({"name": f"random {number}", "kind": case.kind, "case": text} | told(hz))
    return records


def facts():
    """What follows from the lever arms alone."""
    r = 0.02
    B = {kind: np.array(gantry_taylor.levers(kind, r)) for kind in ("h-frame", "core-xy")}
    x, y = np.array([0, 0, 1, 0]), np.array([0, 0, 0, 1])
    rigid = {
        "h-frame": [x + [-1 / r, 1 / r, 0, 0], y + [-1 / r, -1 / r, 0, 0]],
        "core-xy": [x + [1 / r, 1 / r, 0, 0], y + [1 / r, -1 / r, 0, 0]],
    }
    print("H-frame: the rows add up to", B["h-frame"].sum(axis=0))
    for kind, motions in rigid.items():
        print(f"{kind}: largest stretch of a rigid motion along x and y:", [float(np.abs(B[kind] @ q).max()) for q in motions])
        print(f"{kind}: force along x and y per N m of left and right, rigid:", [[round(float(v), 9) for v in q[:2]] for q in motions])


# --- all of it --------------------------------------------------------------------------------------------------------


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=CASES)
    parser.add_argument("--output", type=Path, default=OUTPUT)
    options = parser.parse_args()
    mpmath.mp.dps = 60
    facts()
    frequencies = modes()
    cases, replaced, began = [], [], time.perf_counter()
    for number in range(options.count):
        for attempt in range(40):
            seed = 1000 * (number + 1) + attempt
            clock = time.perf_counter()
            name, text = draw(number, seed)
            record, reason = judge(name, seed, text)
            clock = time.perf_counter() - clock
            if record:
                cases.append(record)
                worst, rounding = record["methods_differ_by"], record["rounding_differs_by"]
                print(
                    f"{name:<32} {len(record['events']):>4} events  methods: {worst['belt_m']:.0e} m {worst['belt_m_s']:.0e} m/s "
                    f"{worst['event_s']:.0e} s  rounding: {rounding['belt_m']:.0e} m {rounding['event_s']:.0e} s  ({clock:.1f} s)",
                    flush=True,
                )
                break
            replaced.append({"name": name, "seed": seed, "reason": reason})
            print(f"    {name}, seed {seed}, left out: {reason}  ({clock:.1f} s)", flush=True)
        else:
            raise SystemExit(f"no case for {number}")
    events = [event for case in cases for event in case["events"]]
    print(f"{len(cases)} cases with {len(events)} events, {len(replaced)} left out; {time.perf_counter() - began:.0f} s")
    print(f"left out because methods see other events: {sum('other events' in r['reason'] for r in replaced)}")
    print(f"left out because they differ by too much: {sum('differ' in r['reason'] and 'other' not in r['reason'] for r in replaced)}")
    for body in BODIES:
        changes = collections.Counter(f"{event[2]} to {event[3]}" for event in events if event[1] == body)
        print(f"{body}: " + ", ".join(f"{count} {change}" for change, count in sorted(changes.items())))
    read = [Gantry(case["case"]) for case in cases]
    coverage = {
        "damped": sum(any(case.c) for case in read),
        "gear": sum(any(d.n != 1 for d in case.drives) for case in read),
        "rotor": sum(any(rotor for _, rotor, _ in case.drives_as_given) for case in read),
        "inductance": sum(any(d.L for d in case.drives) for case in read),
        "two motors": sum(case.drives[0] != case.drives[1] for case in read),
        "breakaway as Coulomb somewhere": sum(any(l.static == l.coulomb for l in case.laws) for case in read),
        "Coulomb differs backward somewhere": sum(any(l.coulomb[1] != l.coulomb[-1] for l in case.laws) for case in read),
        "all four bodies stick and slip": sum(len({event[1] for event in case["events"]}) == 4 for case in cases),
        "a row on an edge": sum(any(abs(row[0] - t) < 1e-12 for row in c["states"] for t in g.edges) for c, g in zip(cases, read)),
    }
    print("cases with: " + ", ".join(f"{name} {count}" for name, count in coverage.items()))
    travel = [max(abs(row[k]) for row in case["states"] for k in (5, 7)) for case in cases]
    print(f"bridge or cart move by {min(travel):.1e} to {max(travel):.1e} m, half of them more than {np.median(travel):.1e} m")
    for field in ("methods_differ_by", "rounding_differs_by"):
        print(field, {name: max(case[field][name] for case in cases) for name in LIMITS})
    head = {
        "format": 1,
        "authority": "authorities/gantry.py",
        "columns": ["time"] + COLUMNS,
        "event": ["time", "body", "from", "to"],
        "replaced": replaced,
    }
    lines = lambda records: ",\n".join(json.dumps(record, ensure_ascii=False, separators=(",", ":")) for record in records)
    options.output.write_text(
        json.dumps(head, ensure_ascii=False)[:-1]
        + f',\n"frequencies": [\n{lines(frequencies)}\n],\n"cases": [\n{lines(cases)}\n]}}\n'
    )


if __name__ == "__main__":
    main()
