"""Random stages with limits, backlash, slack spans, stops, loads and reduced belts: tests/authorities/elements.json.

Each case is a case file's text, solved by Taylor series in 80-bit numbers (B), the same in 64-bit numbers, and DOP853
(A). It is kept if all see the same changes and agree to 1e-10 m, 1e-9 rad and 1e-9 s, if nothing is nearly undecided,
and if the element in question comes into play.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from pathlib import Path

import numpy as np

import elements_dop853
import elements_taylor
from casefile import Case, toml
from elements_rules import Doubt, grid_doubt
from model import pieces

OUTPUT = Path(__file__).resolve().parents[1] / "tests" / "authorities" / "elements.json"
MOST_EVENTS = 120
LIMITS = {"position_m": 1e-10, "angle_rad": 1e-9, "event_s": 1e-9}

COLUMNS = ["drive_angle", "drive_speed", "cart_position", "cart_speed", "idler_angle", "idler_speed", "motor_current"]
COLUMNS += ["rotor_angle", "rotor_speed", "gear_torque", "stop_force", "motor_voltage"]
KIND = ["angle_rad", "speed_rad_s", "position_m", "speed_m_s", "angle_rad", "speed_rad_s", "current_A"]
KIND += ["angle_rad", "speed_rad_s", "torque_N_m", "force_N", "voltage_V"]

#    group: how many cases, and the parts of which one has to change state
GROUPS = {
    "voltage_limit": (10, ("voltage",)),
    "current_limit": (12, ("current",)),
    "bandwidth": (10, ()),
    "backlash": (12, ("gear",)),
    "slack": (10, ("span_1", "span_2", "span_3")),
    "stops": (10, ("stop",)),
    "load": (10, ()),
    "rigid": (6, ()),
    "two-mass": (6, ()),
    "combined": (12, ()),
}
INPUTS = ["pulse", "triangle", "ramp", "sine", "table", "square"]


def short(value):
    """Four digits are enough for a drawn number."""
    return float(f"{value:.4g}")


class Draw:
    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)

    def even(self, low, high):
        return short(self.rng.uniform(low, high))

    def times(self, value, low=0.3, high=3.0):
        """The value times a factor, its logarithm even."""
        return short(value * math.exp(self.rng.uniform(math.log(low), math.log(high))))

    def chance(self, share):
        return self.rng.random() < share

    def friction(self, viscous, coulomb):
        entry = {"viscous": self.times(viscous), "coulomb": self.times(coulomb)}
        if self.chance(0.4):
            entry["static"] = short(entry["coulomb"] * self.rng.uniform(1.1, 2))
        if self.chance(0.2):
            entry["coulomb_backward"] = short(entry["coulomb"] * self.rng.uniform(0.6, 1.0))
        return entry

    def stage(self):
        """Around Table 4."""
        n = 1.0 if self.chance(0.6) else self.even(1.5, 6)
        kt = self.times(0.023 / n, 0.5, 2)
        tables = {
            "title": "",
            "motor": {
                "torque_constant": kt,
                "back_emf_constant": kt if self.chance(0.6) else self.times(kt, 0.7, 1.4),
                "resistance": self.times(0.71),
                "gear_ratio": n,
            },
            "amplifier": {"mode": "voltage", "gain": 1.0 if self.chance(0.7) else self.even(0.5, 4)},
            "drive_pulley": {
                "radius": self.times(0.0194, 0.6, 1.6),
                "inertia": self.times(6.3e-5),
                "friction": self.friction(0.0016, 0.015),
            },
            "idler_pulley": {"inertia": self.times(6.3e-5), "friction": self.friction(0.0016, 0.015)},
            "cart": {"mass": self.times(0.362), "friction": self.friction(19.0424, 0.2)},
            "belt": {"stiffness": [self.times(k, 0.3, 2) for k in (1.3276e5, 1.3276e5, 5.8885e4)]},
        }
        if self.chance(0.6):
            tables["belt"]["damping"] = [self.times(10.0), self.times(10.0), self.times(5.0)]
        return tables

    def inductance(self, tables):
        tables["motor"]["inductance"] = self.times(tables["motor"]["resistance"] * 1e-3)

    def rotor(self, tables):
        n = tables["motor"]["gear_ratio"]
        tables["motor"]["rotor_inertia"] = self.times(6.3e-5 / n**2, 0.3, 2)

    def current_mode(self, tables):
        tables["amplifier"]["mode"] = "current"

    def input(self, tables, kind, until, least=3.0, most=15.0):
        """An input of so many volts at the amplifier's output, or what they drive through the armature at rest."""
        peak = self.even(least, most) / tables["amplifier"]["gain"] / math.sqrt(tables["motor"]["gear_ratio"])
        if tables["amplifier"]["mode"] == "current":
            peak /= tables["motor"]["resistance"]
        peak = short(peak * (1 if self.chance(0.7) else -1))
        if kind == "pulse":
            return {"pulse": peak, "for": self.even(0.25, 0.6) * until, "at": self.even(0.003, 0.02)}
        if kind == "ramp":
            return {"ramp": peak, "over": self.even(0.3, 0.9) * until, "at": self.even(0.003, 0.02)}
        if kind == "triangle":
            return {"triangle": abs(peak), "frequency": self.even(1.3, 4) / until}
        if kind == "sine":
            return {
                "sine": abs(peak),
                "frequency": self.even(1.3, 5) / until,
                "phase": self.even(-3, 3) if self.chance(0.5) else 0.0,
                "offset": short(peak * 0.2) if self.chance(0.3) else 0.0,
            }
        if kind == "square":
            return {"square": peak, "frequency": self.even(1.3, 4) / until, "duty": self.even(0.3, 0.7)}
        count = int(self.rng.integers(4, 9))
        moments = np.sort(self.rng.uniform(0.01, 0.95, count)) * until
        return {"table": [[short(t), short(peak * self.rng.uniform(-1, 1))] for t in moments]}

    def size(self, tables, signal):
        """Largest command, V or A."""
        peak = max(abs(signal[k]) for k in signal if k in INPUTS and k != "table") if "table" not in signal else 0.0
        if "table" in signal:
            peak = max(abs(u) for _, u in signal["table"])
        return peak * tables["amplifier"]["gain"]

    # the elements

    def voltage_limit(self, tables, signal):
        volts = self.size(tables, signal) * (tables["motor"]["resistance"] if tables["amplifier"]["mode"] == "current" else 1)
        tables["amplifier"]["voltage_limit"] = short(volts * self.rng.uniform(0.3, 0.85))

    def current_limit(self, tables, signal):
        amps = self.size(tables, signal) / (tables["motor"]["resistance"] if tables["amplifier"]["mode"] == "voltage" else 1)
        tables["amplifier"]["current_limit"] = short(amps * self.rng.uniform(0.2, 0.8))

    def backlash(self, tables):
        self.rotor(tables)
        motor = tables["motor"]
        motor["backlash"] = self.times(0.01, 0.3, 4)
        motor["gear_stiffness"] = self.times(40.0, 0.3, 3)
        if self.chance(0.55):
            inertia = motor["rotor_inertia"] * motor["gear_ratio"] ** 2
            inertia = 1 / (1 / inertia + 1 / tables["drive_pulley"]["inertia"])
            motor["gear_damping"] = short(2 * self.rng.uniform(0.03, 0.4) * math.sqrt(motor["gear_stiffness"] * inertia))

    def stops(self, tables, reach):
        damping = {"stop_damping": self.times(30.0)} if self.chance(0.5) else {}
        tables["travel"] = {
            "min": -short(reach * self.rng.uniform(0.2, 0.8)),
            "max": short(reach * self.rng.uniform(0.2, 0.8)),
            "stop_stiffness": self.times(1e4, 0.1, 10),
            **damping,
        }


def draw(group, number, seed):
    """A case's text."""
    d = Draw(seed)
    tables = d.stage()
    kind = INPUTS[number % len(INPUTS)]
    until = float(d.rng.choice([0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0]))
    note = ""
    if group == "voltage_limit":
        if number % 2:
            d.inductance(tables)
        if number in (4, 8):  # without a bandwidth: the clip of the current
            d.current_mode(tables)
            note = "current mode, "
        signal = d.input(tables, kind, until, 6, 20)
        if note:
            tables["motor"].pop("inductance", None)
        d.voltage_limit(tables, signal)
        if number % 3 == 1:
            d.rotor(tables)
    elif group == "current_limit":
        variant = number % 3
        note = ("", "inductance, ", "current mode, ")[variant]
        if variant == 1:
            d.inductance(tables)
        if variant == 2:
            d.current_mode(tables)
        kind = INPUTS[number // 2 % len(INPUTS)]
        signal = d.input(tables, kind, until)
        d.current_limit(tables, signal)
        if number in (3, 4, 5, 9, 10):  # both limits
            d.voltage_limit(tables, signal)
            note += "voltage limit, "
    elif group == "bandwidth":
        d.current_mode(tables)
        signal = d.input(tables, kind, until, 5, 15)
        tables["amplifier"]["bandwidth"] = d.times(200.0, 0.2, 4)
        variant = number % 4
        if variant in (1, 3):
            d.inductance(tables)
            d.voltage_limit(tables, signal)
            note = "voltage limit, "
        if variant in (2, 3):
            d.current_limit(tables, signal)
            note += "current limit, "
    elif group == "backlash":
        d.backlash(tables)
        note = "damped, " if "gear_damping" in tables["motor"] else ""
        if number % 3 == 1:
            d.inductance(tables)
        if number % 4 == 3:
            d.current_mode(tables)
        signal = d.input(tables, kind, until, 2, 10)
    elif group == "slack":
        tables["belt"]["pretension"] = d.times(2.0, 0.2, 3)
        if number % 3 == 1:
            d.inductance(tables)
        signal = d.input(tables, kind, until, 5, 20)
    elif group == "stops":
        signal = d.input(tables, kind, until, 3, 10)
        d.stops(tables, 0.02)
        note = "damped, " if "stop_damping" in tables["travel"] else ""
    elif group == "load":
        dry = tables["cart"]["friction"].get("static", tables["cart"]["friction"]["coulomb"])
        r = tables["drive_pulley"]["radius"]
        for pulley in ("drive_pulley", "idler_pulley"):
            friction = tables[pulley]["friction"]
            dry += friction.get("static", friction["coulomb"]) / r
        sign = 1 if d.chance(0.5) else -1
        holds = number % 2 == 0
        force = sign * dry * d.even(0.2, 0.55) if holds else sign * dry * d.even(1.05, 2.5)
        note = "holds, " if holds else "slides, "
        if number % 3 == 1:
            tables["cart"]["load"] = short(force)
            note = "force, " + note
        else:
            tables["cart"]["inclination"] = short(math.asin(max(-0.8, min(0.8, -force / tables["cart"]["mass"] / 9.80665))))
            note = "inclination, " + note
            if number % 3 == 2:
                tables["cart"]["load"] = short(force * 0.1)
        signal = d.input(tables, kind, until, 0.01, 0.02) if number in (0, 1) else d.input(tables, kind, until, 2, 8)
    elif group in ("rigid", "two-mass"):
        tables["belt"]["model"] = group
        signal = d.input(tables, kind, until, 1.5, 8)
        if number % 3 == 1:
            d.inductance(tables)
        if number % 3 == 2:
            d.rotor(tables)
        if number == 4:
            d.voltage_limit(tables, signal)
            note = "voltage limit, "
        if number == 3:
            tables["cart"]["load"] = d.even(-0.3, 0.3)
    else:
        names = [
            ("backlash", "voltage_limit"),
            ("backlash", "slack"),
            ("slack", "current_limit", "voltage_limit"),
            ("backlash", "stops"),
            ("stops", "current_limit", "inductance"),
            ("slack", "stops", "load"),
            ("bandwidth", "backlash", "voltage_limit"),
            ("load", "backlash", "current_limit", "inductance"),
            ("slack", "backlash", "stops", "voltage_limit"),
            ("rigid", "backlash", "current_limit"),
            ("two-mass", "stops", "current_limit"),
            ("two-mass", "backlash", "voltage_limit", "load"),
        ][number]
        note = " + ".join(names) + ", "
        if "backlash" in names:
            d.backlash(tables)
        if "slack" in names:
            tables["belt"]["pretension"] = d.times(2.0, 0.3, 3)
        if "load" in names:
            tables["cart"]["load"] = d.even(-1.0, 1.0)
        if "inductance" in names:
            d.inductance(tables)
        for model in ("rigid", "two-mass"):
            if model in names:
                tables["belt"]["model"] = model
        if "bandwidth" in names:
            d.current_mode(tables)
            d.inductance(tables)
            tables["amplifier"]["bandwidth"] = d.times(300.0)
        signal = d.input(tables, kind, until, 4, 12)
        if "stops" in names:
            d.stops(tables, 0.02)
        if "voltage_limit" in names:
            d.voltage_limit(tables, signal)
        if "current_limit" in names:
            d.current_limit(tables, signal)
    name = f"{note}{kind}"
    tables["title"] = f"{group}: {name}"
    tables["experiment"] = [{"name": "run", "input": signal, "until": until, "every": round(until / 50, 6)}]
    return name, toml(tables)


def used(case):
    """Which columns this case fills."""
    return [
        *range(7),
        *((7, 8, 9) if case.backlash else ()),
        *((10,) if case.stops else ()),
        *((11,) if case.V is not None or case.I is not None else ()),
    ]


def differences(case, run, other):
    """Largest differences between two runs of the same events."""
    off = {}
    for column, values in enumerate(np.abs(np.array(run.rows) - np.array(other.rows)).max(axis=0)):
        if column in used(case):
            off[KIND[column]] = max(off.get(KIND[column], 0.0), float(values))
    off["event_s"] = max((abs(a[0] - b[0]) for a, b in zip(run.events, other.events)), default=0.0)
    return off


def in_order(run):
    """The events without their times, those of one moment sorted."""
    return [event[1:] for event in sorted(run.events, key=lambda event: (event[0], event[1]))]


def judge(group, name, text, wanted=(), limits=LIMITS, most=MOST_EVENTS, moves=True):
    """(the record, None) or (None, why it is left out)."""
    case = Case(text)
    chain = pieces(case.signal, case.until)
    try:
        run = elements_taylor.solve(case)
        if run.doubts:
            return None, run.doubts[0]
        if len(run.events) > most:
            return None, f"{len(run.events)} events: sure, but too long to keep"
        if wanted and not any(event[1] in wanted for event in run.events):
            return None, "the element never comes into play"
        if moves and np.abs(np.array(run.rows)[:, 2]).max() < 1e-4:
            return None, "the cart hardly moves"
        if doubt := grid_doubt(case, run.events, chain):
            return None, doubt
        coarse = elements_taylor.solve(case, np.float64)
        rival = elements_dop853.solve(case)
    except Doubt as doubt:
        return None, str(doubt)
    record = {"name": name, "group": group, "case": text, "columns": ["time"] + [COLUMNS[k] for k in used(case)]}
    for key, other in (("rounding_differs_by", coarse), ("methods_differ_by", rival)):
        if in_order(other) != in_order(run):
            return None, f"{key}: other events ({len(other.events)} instead of {len(run.events)})"
        off = differences(case, run, other)
        size = max(1.0, np.abs(np.array(run.rows)[:, [0, 4]]).max())
        for what, limit in limits.items():
            if not off.get(what, 0.0) <= limit * (size if what == "angle_rad" else 1.0):
                return None, f"{key}: {what} {off[what]:.1e}"
        record[key] = {what: float(f"{value:.1e}") for what, value in off.items()}
    digits = lambda value: float(f"{value:.14g}")
    record["rows"] = [
        [digits(t)] + [digits(row[k]) for k in used(case)] for t, row in zip(case.times, run.rows)
    ]
    record["events"] = [list(event) for event in sorted(run.events, key=lambda event: (event[0], event[1]))]
    return record, None


def write(path, authority, replaced, cases):
    """Cases, each on a line of its own."""
    head = {"format": 1, "authority": authority, "replaced": replaced}
    body = ",\n".join(json.dumps(case, ensure_ascii=False, separators=(",", ":")) for case in cases)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(head, ensure_ascii=False)[:-1] + ',\n"cases": [\n' + body + "\n]}\n")


def report(record, clock):
    worst, rounding = record["methods_differ_by"], record["rounding_differs_by"]
    print(
        f"{record['name']:<64} {len(record['events']):>4} events  methods: {worst['angle_rad']:.0e} rad "
        f"{worst['position_m']:.0e} m {worst['event_s']:.0e} s  rounding: {rounding['position_m']:.0e} m "
        f"{rounding['event_s']:.0e} s  ({clock:.1f} s)",
        flush=True,
    )


def summary(cases, replaced, began):
    events = sum(len(case["events"]) for case in cases)
    print(f"{len(cases)} cases with {events} events, {len(replaced)} left out; {time.perf_counter() - began:.0f} s")
    for field in ("methods_differ_by", "rounding_differs_by"):
        names = {name for case in cases for name in case[field]}
        print(field, {name: max(case[field].get(name, 0.0) for case in cases) for name in sorted(names)})


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", help="one group")
    parser.add_argument("--output", type=Path, default=OUTPUT)
    options = parser.parse_args()
    cases, replaced, began = [], [], time.perf_counter()
    for place, (group, (count, wanted)) in enumerate(GROUPS.items()):
        if options.only and group != options.only:
            continue
        for number in range(count):
            for attempt in range(30):
                seed = 100000 * (place + 1) + 100 * number + attempt
                clock = time.perf_counter()
                name, text = draw(group, number, seed)
                record, reason = judge(group, f"{len(cases):03d} {group}: {name}", text, wanted, moves=(group, number) not in (("load", 0), ("load", 2)))
                clock = time.perf_counter() - clock
                if record:
                    cases.append(record)
                    report(record, clock)
                    break
                replaced.append({"group": group, "seed": seed, "reason": reason})
                print(f"    {group} {number}, seed {seed}, left out: {reason}  ({clock:.1f} s)", flush=True)
    summary(cases, replaced, began)
    write(options.output, "authorities/elements.py", replaced, cases)


if __name__ == "__main__":
    main()
