"""200 random stages and inputs, solved by both authorities, written to tests/authorities/random_stages.json.

A case is kept only if it is sure: matrix exponentials in 80-bit numbers, the same in 64-bit numbers, and SciPy's DOP853
agree on every mode change and, within the limits below, on every time and position, and no decision was a close one.
The others are listed with the reason and replaced. States are those of the 80-bit run.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from pathlib import Path

import numpy as np

import events_expm
import events_scipy
from model import Friction, Stage, current, pieces

OUTPUT = Path(__file__).resolve().parents[1] / "tests" / "authorities" / "random_stages.json"
SAMPLES = 20
EVERY = 1e-3
MOST_EVENTS = 400  # of a case worth keeping

# What "agree" means between the 80-bit run and another; positions relative where they exceed one radian or metre.
LIMITS = {"angle_rad": 2e-10, "position_m": 2e-11, "event_s": 2e-10}

INPUTS = (
    ["pulse"] * 36
    + ["step at drive breakaway"] * 18
    + ["step at full breakaway"] * 18
    + ["triangle"] * 44
    + ["square"] * 26
    + ["table"] * 28
    + ["ramp"] * 18
    + ["sine"] * 8
    + ["chirp"] * 4
)


def spread(rng, value, low=0.2, high=5.0):
    """The value times a factor, its logarithm even."""
    return float(value * math.exp(rng.uniform(math.log(low), math.log(high))))


def random_friction(rng, viscous, coulomb, may_be_none):
    """Symmetric, asymmetric, breakaway above Coulomb, breakaway only, or none; sometimes without viscosity."""
    b = 0.0 if rng.random() < 0.1 else spread(rng, viscous, 0.3, 3)
    c = spread(rng, coulomb)
    kind = rng.choice(
        ["symmetric", "asymmetric", "breakaway", "both", "breakaway only", "none"], p=[0.3, 0.2, 0.2, 0.15, 0.03, 0.12]
    )
    if kind == "symmetric" or (kind == "none" and not may_be_none):
        return Friction.symmetric(b, c)
    if kind == "asymmetric":
        c_back = spread(rng, c, 0.5, 2)
        return Friction(b, spread(rng, b, 0.5, 2), c, c_back, c, c_back)
    if kind == "breakaway":
        return Friction.symmetric(b, c, c * rng.uniform(1.05, 2))
    if kind == "both":
        c_back = spread(rng, c, 0.5, 2)
        return Friction(b, spread(rng, b, 0.5, 2), c, c_back, c * rng.uniform(1, 2), c_back * rng.uniform(1, 2))
    if kind == "breakaway only":
        return Friction.symmetric(b, 0.0, c)
    return Friction.symmetric(b)


def random_stage(rng):
    gear_ratio = 1.0 if rng.random() < 0.5 else float(rng.uniform(1.5, 10))
    gear_efficiency = 1.0 if rng.random() < 0.75 else float(rng.uniform(0.5, 0.98))
    amplifier_mode = "current" if rng.random() < 0.2 else "voltage"
    resistance = spread(rng, 0.71)
    inductance = 0.0
    if amplifier_mode == "voltage" and rng.random() < 0.5:
        inductance = resistance * spread(rng, 1e-3, 0.1, 5)
    k = [float(10 ** rng.uniform(3, 6)) for _ in range(3)]
    mass, drive_inertia, idler_inertia = spread(rng, 0.362), spread(rng, 6.3e-5), spread(rng, 6.3e-5)
    c = [0.0, 0.0, 0.0]
    if rng.random() < 0.6:
        c = [
            0.0 if rng.random() < 0.2 else 2 * spread(rng, 0.02, 0.05, 5) * math.sqrt(stiffness * mass)
            for stiffness in k
        ]
    kt = spread(rng, 23e-3)
    return Stage(
        torque_constant=kt,
        back_emf_constant=kt if rng.random() < 0.6 else spread(rng, kt, 0.5, 2),
        resistance=resistance,
        inductance=inductance,
        rotor_inertia=0.0 if rng.random() < 0.5 else spread(rng, drive_inertia / gear_ratio**2),
        gear_ratio=gear_ratio,
        gear_efficiency=gear_efficiency,
        amplifier_mode=amplifier_mode,
        amplifier_gain=1.0 if rng.random() < 0.6 else spread(rng, 1.0),
        pulley_radius=spread(rng, 0.0194, 0.4, 2.5),
        drive_inertia=drive_inertia,
        cart_mass=mass,
        idler_inertia=idler_inertia,
        k1=k[0],
        k2=k[1],
        k3=k[2],
        c1=c[0],
        c2=c[1],
        c3=c[2],
        # Behind a lossy gear "no dry friction" would not mean "no modes": left out.
        drive_friction=random_friction(rng, 0.0016, 0.015, gear_efficiency == 1.0),
        cart_friction=random_friction(rng, 19.0424, 0.2, True),
        idler_friction=random_friction(rng, 0.0016, 0.015, True),
    )


def random_input(rng, stage, kind, until):
    """An input sized by what it takes to break the drive pulley, or everything, away."""
    torque = stage.amplifier_gain * stage.torque_constant * stage.gear_ratio * stage.gear_efficiency
    if stage.amplifier_mode == "voltage":
        torque /= stage.resistance
    drive = stage.drive_friction.breakaway_forward / torque
    full = (
        drive
        + (stage.idler_friction.breakaway_forward + stage.pulley_radius * stage.cart_friction.breakaway_forward)
        / torque
    )
    if full == 0.0:
        full = spread(rng, 1.0)
    if drive == 0.0:
        drive = full
    sign = 1 if rng.random() < 0.6 else -1
    near = 1 + sign * 10 ** rng.uniform(-4, -1)
    side = 1 if rng.random() < 0.75 else -1
    if kind == "pulse":
        at = 0.0 if rng.random() < 0.6 else float(rng.uniform(0, 0.1 * until))
        duration = float(rng.uniform(0.2, 0.7) * until)
        return {"kind": "pulse", "value": side * full * float(rng.uniform(0.7, 6)), "duration": duration, "at": at}
    if kind == "step at drive breakaway":
        return {"kind": "step", "value": drive * near, "at": 0.0 if rng.random() < 0.5 else float(rng.uniform(0, 0.1))}
    if kind == "step at full breakaway":
        return {"kind": "step", "value": full * near, "at": 0.0 if rng.random() < 0.5 else float(rng.uniform(0, 0.1))}
    if kind == "triangle":
        return {
            "kind": "triangle",
            "amplitude": full * float(rng.uniform(0.9, 3)),
            "frequency": float(rng.uniform(4, 40)),
        }
    if kind == "square":
        return {
            "kind": "square",
            "amplitude": side * full * float(rng.uniform(0.6, 4)),
            "frequency": float(rng.uniform(3, 30)),
            "duty": 0.5 if rng.random() < 0.4 else float(rng.uniform(0.2, 0.8)),
        }
    if kind == "ramp":
        return {
            "kind": "ramp",
            "value": side * full * float(rng.uniform(0.8, 3)),
            "over": float(rng.uniform(0.2, 0.9) * until),
            "at": 0.0 if rng.random() < 0.4 else float(rng.uniform(0, 0.1)),
        }
    if kind == "sine":
        return {
            "kind": "sine",
            "amplitude": full * float(rng.uniform(1.3, 3)),
            "frequency": float(rng.uniform(2, 40)),
            "phase": 0.0 if rng.random() < 0.4 else float(rng.uniform(-3, 3)),
            "offset": 0.0 if rng.random() < 0.4 else full * float(rng.uniform(-0.5, 0.5)),
        }
    if kind == "chirp":
        return {
            "kind": "chirp",
            "amplitude": full * float(rng.uniform(1, 3)),
            "from": float(rng.uniform(1, 10)),
            "to": float(rng.uniform(15, 60)),
            "over": float(rng.uniform(0.6, 1.2) * until),
        }
    count = int(rng.integers(4, 16))
    times = np.sort(rng.uniform(0, until, count))
    if rng.random() < 0.5:
        times[0] = 0.0
    return {"kind": "table", "points": [[float(t), full * float(rng.uniform(-3, 3))] for t in times]}


def sample_times(rng, chain, until):
    """Some times of the 1 ms grid, never on an edge of the input; the last is the end."""
    grid = [k * EVERY for k in range(1, round(until / EVERY) + 1)]
    clear = [t for t in grid if all(abs(t - piece.start) > 1e-8 for piece in chain)]
    chosen = sorted(rng.choice(len(clear) - 1, SAMPLES - 1, replace=False))
    return [clear[k] for k in chosen] + [clear[-1]]


def with_current(stage, chain, run):
    """States with the current filled in where it is not a state."""
    states = run.states.astype(float)
    for t, y in zip(run.times, states):
        piece = [piece for piece in chain if piece.start <= t][-1]
        y[6] = current(stage, y, piece(t))
    return states


def difference(one, other, states, other_states):
    """Largest differences between two runs with the same mode changes."""
    off = np.abs(states - other_states).max(axis=0)
    event = max((abs(a.time - b.time) for a, b in zip(one.events, other.events)), default=0.0)
    return {
        "angle_rad": max(off[0], off[4]),
        "position_m": off[2],
        "speed_rad_s": max(off[1], off[5]),
        "speed_m_s": off[3],
        "current_A": off[6],
        "event_s": event,
    }


def beyond(off, states):
    """What of a difference exceeds its limit."""
    size = {
        "angle_rad": max(1.0, np.abs(states[:, [0, 4]]).max()),
        "position_m": max(1.0, np.abs(states[:, 2]).max()),
        "event_s": 1.0,
    }
    return [f"{name} {off[name]:.1e}" for name, limit in LIMITS.items() if not off[name] <= limit * size[name]]


def sequence(run):
    return [(event.body, event.before, event.after) for event in run.events]


def solve_case(number, seed, kind):
    """(the case's record, None) or (None, why it is unsure)."""
    rng = np.random.default_rng(seed)
    stage = random_stage(rng)
    until = round(float(rng.uniform(0.3, 1.0)), 2)
    signal = random_input(rng, stage, kind, until)
    times = sample_times(rng, pieces(signal, until), until)
    return judged(f"{number:03d} {kind}", seed, stage, signal, until, times)


def judged(name, seed, stage, signal, until, times):
    """The same for a case that is already drawn."""
    chain = pieces(signal, until)
    try:
        run = events_expm.solve(stage, signal, times)
        if run.doubts:
            return None, run.doubts[0]
        if len(run.events) > MOST_EVENTS:
            return None, f"{len(run.events)} events: sure, but too long to keep"
        coarse = events_expm.solve(stage, signal, times, np.float64)
        rival = events_scipy.solve(stage, signal, times)
    except (events_expm.Doubt, events_scipy.Doubt) as doubt:
        return None, str(doubt)
    near = min((abs(event.time - t) for event in run.events for t in times), default=1.0)
    if near < 1e-8:
        return None, "an event falls on a sample"
    for other_name, other in (("64-bit exponentials", coarse), ("DOP853", rival)):
        if sequence(other) != sequence(run):
            return None, f"{other_name} see other mode changes ({len(other.events)} instead of {len(run.events)})"
        if (other.modes != run.modes).any():
            return None, f"{other_name} see other modes"
    states = with_current(stage, chain, run)
    off_rival = difference(run, rival, states, with_current(stage, chain, rival))
    off_coarse = difference(run, coarse, states, with_current(stage, chain, coarse))
    for other_name, off in (("64-bit exponentials", off_coarse), ("DOP853", off_rival)):
        if too_far := beyond(off, states):
            return None, f"{other_name} differ by " + ", ".join(too_far)
    digits = lambda off: {key: float(f"{value:.1e}") for key, value in off.items()}
    return {
        "name": name,
        "seed": seed,
        "until": until,
        "every": EVERY,
        "stage": stage.flat(),
        "input": signal,
        "times": times,
        "states": states.tolist(),
        "modes": run.modes.tolist(),
        "events": [[event.time, event.body, event.before, event.after, event.load] for event in run.events],
        "scipy_differs_by": digits(off_rival),
        "rounding_differs_by": digits(off_coarse),
    }, None


def write(path, authority, replaced, cases):
    """Cases, each on a line of its own."""
    head = {
        "format": 1,
        "authority": authority,
        "state": ["phi1", "w1", "x", "v", "phi3", "w3", "i"],
        "event": ["time", "body", "from", "to", "load"],
        "replaced": replaced,
    }
    body = ",\n".join(json.dumps(case, ensure_ascii=False) for case in cases)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(head, ensure_ascii=False)[:-1] + ',\n"cases": [\n' + body + "\n]}\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=len(INPUTS))
    parser.add_argument("--output", type=Path, default=OUTPUT)
    options = parser.parse_args()
    cases, replaced = [], []
    began = time.perf_counter()
    for number, kind in enumerate(INPUTS[:: len(INPUTS) // options.count] if options.count < len(INPUTS) else INPUTS):
        for attempt in range(50):
            seed = 1000 * (number + 1) + attempt
            clock = time.perf_counter()
            case, reason = solve_case(number, seed, kind)
            clock = time.perf_counter() - clock
            if case:
                cases.append(case)
                worst = case["scipy_differs_by"]
                print(
                    f"{case['name']:<28} seed {seed:<7} {len(case['events']):>4} events  scipy: {worst['angle_rad']:.0e} rad "
                    f"{worst['position_m']:.0e} m {worst['event_s']:.0e} s  rounding: {case['rounding_differs_by']['angle_rad']:.0e} rad "
                    f"{case['rounding_differs_by']['event_s']:.0e} s  ({clock:.1f} s)",
                    flush=True,
                )
                break
            replaced.append({"seed": seed, "input": kind, "reason": reason})
            print(f"{number:03d} {kind:<24} seed {seed:<7} replaced: {reason}  ({clock:.1f} s)", flush=True)
    events = sum(len(case["events"]) for case in cases)
    print(f"{len(cases)} cases with {events} events, {len(replaced)} replaced; {time.perf_counter() - began:.0f} s")
    for field in ("scipy_differs_by", "rounding_differs_by"):
        print(field, {name: max(case[field][name] for case in cases) for name in cases[0][field]})
    write(options.output, "authorities/random_stages.py", replaced, cases)


if __name__ == "__main__":
    main()
