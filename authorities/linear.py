"""Poles, zeros, gains and responses of 200 random stages: by python-control with SLICOT, and in 60-digit numbers.

The matrices are written here from eq. (1)-(4) and (16)-(18), with what the paper does not have (inductance, rotor, a
compliant gear, a current loop, belt damping, reduced belts, a Stribeck curve) added by hand; nothing of taut is used.
mpmath takes numerators and denominators as polynomials; python-control gets the same system in 64-bit numbers, in
stretches and balanced, which is what it needs.

Writes ../tests/authorities/linear.json and output/linear.txt.
"""

import json
import math
import os
import random

import control
import mpmath as mp
import numpy as np
import scipy.linalg

from casefile import toml

HERE = os.path.dirname(os.path.abspath(__file__))
COUNT = 200
OUTPUTS = ["drive_angle", "cart_position", "span1_force"]
mp.mp.dps = 60


def draw(rng):
    """The parameters of a stage, in SI units."""

    def decades(low, high):
        return math.exp(rng.uniform(math.log(low), math.log(high)))

    def maybe(share, value):
        return value() if rng.random() < share else 0.0

    p = {
        "kt": decades(0.005, 0.1),
        "resistance": decades(0.2, 4.0),
        "inductance": maybe(0.4, lambda: decades(1e-5, 5e-3)),
        "rotor": maybe(0.5, lambda: decades(1e-7, 1e-4)),
        "gear": rng.choice([1.0, 1.0, rng.uniform(0.5, 8.0)]),
        "efficiency": rng.choice([1.0, 1.0, rng.uniform(0.5, 1.0)]),
        "gear_stiffness": 0.0,
        "gear_damping": 0.0,
        "current": rng.random() < 0.25,
        "bandwidth": 0.0,
        "gain": rng.choice([1.0, rng.uniform(0.5, 2.0)]),
        "radius": decades(0.005, 0.04),
        "j1": decades(1e-5, 5e-4),
        "j2": decades(1e-5, 5e-4),
        "mass": decades(0.05, 3.0),
        "b1": maybe(0.8, lambda: decades(3e-4, 8e-3)),
        "b2": maybe(0.8, lambda: decades(3e-4, 8e-3)),
        "b": maybe(0.8, lambda: decades(4.0, 95.0)),
        "k": [decades(2e3, 5e5) for _ in range(3)],
        "c": [maybe(0.4, lambda: decades(0.1, 30.0)) for _ in range(3)],
        "model": rng.choice(["elastic"] * 4 + ["two-mass", "rigid"]),
        "coulomb": maybe(0.6, lambda: decades(0.04, 1.0)),
        "stribeck": 0.0,
        "stribeck_velocity": 0.0,
        "speed": decades(0.02, 0.5),
    }
    p["ke"] = p["kt"] * rng.choice([1.0, 1.0, rng.uniform(0.8, 1.2)])
    if p["current"]:
        p["bandwidth"] = maybe(0.5, lambda: decades(20.0, 2000.0))
    if rng.random() < 0.25:
        p["rotor"], p["efficiency"] = decades(1e-6, 1e-4), 1.0
        p["gear_stiffness"] = decades(5.0, 500.0)
        p["gear_damping"] = maybe(0.5, lambda: decades(1e-3, 0.1))
    if p["model"] == "elastic" and p["coulomb"] and rng.random() < 0.4:
        p["stribeck"] = p["coulomb"] * rng.uniform(0.1, 0.8)
        p["stribeck_velocity"] = decades(0.01, 0.2)
    return p


def case(p):
    """The case file of these parameters."""
    motor = {"torque_constant": p["kt"], "back_emf_constant": p["ke"], "resistance": p["resistance"]}
    motor |= {"inductance": p["inductance"], "rotor_inertia": p["rotor"], "gear_ratio": p["gear"]}
    motor |= {"gear_efficiency": p["efficiency"]}
    if p["gear_stiffness"]:
        motor |= {"gear_stiffness": p["gear_stiffness"], "gear_damping": p["gear_damping"]}
    amplifier = {"mode": "current" if p["current"] else "voltage", "gain": p["gain"]}
    if p["bandwidth"]:
        amplifier["bandwidth"] = p["bandwidth"]
    friction = {"viscous": p["b"], "coulomb": p["coulomb"]}
    if p["stribeck"]:
        friction["stribeck"] = {"force": p["stribeck"], "velocity": p["stribeck_velocity"]}
    return toml(
        {
            "motor": motor,
            "amplifier": amplifier,
            "drive_pulley": {"radius": p["radius"], "inertia": p["j1"], "friction": {"viscous": p["b1"]}},
            "idler_pulley": {"inertia": p["j2"], "friction": {"viscous": p["b2"]}},
            "cart": {"mass": p["mass"], "friction": friction},
            "belt": {"stiffness": p["k"], "damping": p["c"], "model": p["model"]},
            "experiment": [{"name": "none", "input": {"step": 0.0, "at": 0.0}, "until": 0.1, "every": 0.01}],
        }
    )


def matrices(p, number):
    """A, b, C, d as lists, in numbers of that kind."""
    q = {k: ([number(v) for v in value] if isinstance(value, list) else value) for k, value in p.items()}
    q = {k: (number(v) if isinstance(v, float) else v) for k, v in q.items()}
    zero, one = number(0.0), number(1.0)
    r, n, (k1, k2, k3), (c1, c2, c3) = q["radius"], q["gear"], q["k"], q["c"]
    own_rotor = bool(p["gear_stiffness"])
    current_state = bool(p["bandwidth"] if p["current"] else p["inductance"])
    # What every way and speed is in terms of the states.
    if p["model"] == "elastic":
        names = ["phi1", "w1", "x", "v", "phi3", "w3"]
    elif p["model"] == "two-mass":
        names = ["phi1", "w1", "x", "v"]
    else:
        names = ["x", "v"]
    names += ["i"] if current_state else []
    names += ["phir", "wr"] if own_rotor else []
    size = len(names) + 1  # behind the states, the input

    def row(entries):
        out = [zero] * size
        for name, value in entries.items():
            out[names.index(name) if name in names else -1] += value
        return out

    def add(*rows):
        return [sum(column, zero) for column in zip(*rows)]

    def times(factor, of):
        return [factor * entry for entry in of]

    x, v = row({"x": one}), row({"v": one})
    phi1, w1 = (row({"phi1": one}), row({"w1": one})) if p["model"] != "rigid" else (times(1 / r, x), times(1 / r, v))
    phi3, w3 = (row({"phi3": one}), row({"w3": one})) if p["model"] == "elastic" else (phi1, w1)
    phir, wr = (row({"phir": one}), row({"wr": one})) if own_rotor else (phi1, w1)

    def span(k, c, way_a, way_b, rate_a, rate_b):
        return add(times(k, way_a), times(-k, way_b), times(c, rate_a), times(-c, rate_b))

    # f1 = k1 (r phi1 - x) + c1 (r w1 - v), and so on
    f1 = span(k1, c1, times(r, phi1), x, times(r, w1), v)
    if p["model"] == "elastic":
        f2 = span(k2, c2, x, times(r, phi3), v, times(r, w3))
        f3 = span(k3, c3, times(r, phi3), times(r, phi1), times(r, w3), times(r, w1))
    else:
        # spans 2 and 3 in series
        f2 = span(k2 * k3 / (k2 + k3), (c2 * k3 * k3 + c3 * k2 * k2) / (k2 + k3) ** 2, x, times(r, phi1), v, times(r, w1))
        f3 = f2
    # the motor
    u = row({"u": q["gain"]})
    emf = times(q["ke"] * n, wr)
    if current_state:
        i = row({"i": one})
    elif p["current"]:
        i = u
    else:
        i = times(1 / q["resistance"], add(u, times(-one, emf)))
    inertia1 = q["j1"]
    if own_rotor:
        gear = add(
            times(q["gear_stiffness"], add(phir, times(-one, phi1))), times(q["gear_damping"], add(wr, times(-one, w1)))
        )
        torque = gear
    else:
        # the motor drives: e = efficiency
        torque = times(n * q["kt"] * q["efficiency"], i)
        inertia1 = inertia1 + q["efficiency"] * n * n * q["rotor"]
    # d/dv of b v + F_c + F_s exp(-(v/v_s)^2)
    b = q["b"]
    if p["stribeck"]:
        s = q["speed"] / q["stribeck_velocity"]
        exp = mp.exp if number is mp.mpf else math.exp
        b = b - 2 * s / q["stribeck_velocity"] * q["stribeck"] * exp(-s * s)
    rates = {"x": v, "phi1": w1, "phi3": w3, "phir": wr}
    friction1, friction, friction3 = times(-q["b1"], w1), times(-b, v), times(-q["b2"], w3)
    if p["model"] == "elastic":
        rates["w1"] = times(1 / inertia1, add(times(-r, f1), times(r, f3), torque, friction1))  # (16)
        rates["v"] = times(1 / q["mass"], add(f1, times(-one, f2), friction))  # (17)
        rates["w3"] = times(1 / q["j2"], add(times(r, f2), times(-r, f3), friction3))  # (18)
    elif p["model"] == "two-mass":
        rates["w1"] = times(1 / (inertia1 + q["j2"]), add(times(-r, f1), times(r, f2), torque, friction1, friction3))
        rates["v"] = times(1 / q["mass"], add(f1, times(-one, f2), friction))
    else:
        whole = q["mass"] + (inertia1 + q["j2"]) / (r * r)
        rates["v"] = times(1 / whole, add(times(1 / r, torque), friction, times(1 / r, friction1), times(1 / r, friction3)))
    if p["current"] and current_state:
        pi = mp.pi if number is mp.mpf else math.pi
        rates["i"] = times(2 * pi * q["bandwidth"], add(u, times(-one, i)))
    elif current_state:
        rates["i"] = times(1 / q["inductance"], add(u, times(-q["resistance"], i), times(-one, emf)))
    if own_rotor:
        rates["wr"] = times(1 / (n * n * q["rotor"]), add(times(n * q["kt"], i), times(-one, gear)))
    outputs = [phi1, x] + ([f1] if p["model"] != "rigid" else [])
    a = [rates[name][:-1] for name in names]
    return a, [rates[name][-1] for name in names], [o[:-1] for o in outputs], [o[-1] for o in outputs]


def conditioned(p, a, b, c, d):
    """The same system in 64-bit numbers as python-control can digest it: stretches instead of positions, balanced.

    In positions a span's force is a small difference of large numbers, and at low frequency nothing is left of it.
    """
    n, r = a.rows, mp.mpf(p["radius"])
    t = mp.eye(n)
    if p["model"] != "rigid":
        t[0, 0], t[0, 2] = r, -1  # r phi1 - x for phi1
    if p["model"] == "elastic":
        t[4, 4], t[4, 2] = -r, 1  # x - r phi3 for phi3
    if p["gear_stiffness"]:
        if p["model"] == "rigid":
            t[n - 2, 0] = -1 / r
        else:
            t[n - 2, 0] = -1  # phir - phi1 for phir
    back = t**-1
    a, b, c = t * a * back, t * b, c * back
    # Output forces and rates do not depend on where the axis is; what is left of the cancellation is dropped.
    for m in (a, c):
        size = max(abs(v) for v in m)
        for i in range(m.rows):
            for j in range(m.cols):
                if abs(m[i, j]) < size * mp.mpf(10) ** -40:
                    m[i, j] = mp.mpf(0)
    fa, fb, fc = (np.array(m.tolist(), dtype=float) for m in (a, b, c))
    fa, (scale, order) = scipy.linalg.matrix_balance(fa, permute=False, separate=True)
    fb, fc = fb / scale.reshape(-1, 1), fc * scale.reshape(1, -1)
    return fa, fb, fc, np.array([float(v) for v in d]).reshape(-1, 1)


def polynomials(a, b, c, d):
    """Coefficients, highest first, of det(sI - A) and of c adj(sI - A) b + d det(sI - A), by Faddeev and LeVerrier."""
    n = a.rows
    m, chi, numerator = mp.eye(n), [mp.mpf(1)], []
    for k in range(1, n + 1):
        numerator.append((c * m * b)[0])
        am = a * m
        coefficient = -sum(am[i, i] for i in range(n)) / k
        chi.append(coefficient)
        m = am + coefficient * mp.eye(n)
    return chi, [d * chi[0]] + [num + d * coefficient for num, coefficient in zip(numerator, chi[1:])]


def roots(coefficients, size):
    """Roots, those that are zero exactly; leading coefficients that are rounding are dropped. `size` is a typical
    rate."""
    weight = [abs(value) * size ** (len(coefficients) - 1 - k) for k, value in enumerate(coefficients)]
    largest = max(weight)
    if largest == 0:
        return [], mp.mpf(0)
    lead = next(k for k, w in enumerate(weight) if w > largest * mp.mpf(10) ** -35)
    rest = coefficients[lead:]
    zeros = 0
    while len(rest) > 1 and abs(rest[-1]) * mp.mpf(10) ** 35 < abs(rest[-2]) * 1:
        rest, zeros = rest[:-1], zeros + 1
    found = mp.polyroots(rest, maxsteps=500, extraprec=400) if len(rest) > 1 else []
    # Double zeros at zero come apart by the root of the precision.
    far = max([abs(v) for v in found], default=mp.mpf(0))
    found = [v if abs(v) > far * mp.mpf(10) ** -18 and abs(v) > size * mp.mpf(10) ** -18 else mp.mpf(0) for v in found]
    return found + [mp.mpf(0)] * zeros, rest[0]


def respond(system, s, output=0):
    """C (s I - A)^-1 B + D with LAPACK's LU; SLICOT's TB05AD, which python-control would call, is coarser where the
    response is small."""
    return complex((system.C @ np.linalg.solve(s * np.eye(len(system.A)) - system.A, system.B) + system.D)[output, 0])


def low_frequency(poles, zeros, gain):
    """(N, lim s^N G(s))."""
    value = gain
    for z in zeros:
        value *= -z if z != 0 else 1
    for p in poles:
        value /= -p if p != 0 else 1
    return sum(p == 0 for p in poles) - sum(z == 0 for z in zeros), mp.re(value)


def nearest(ours, theirs):
    """The largest relative distance of roots to those that they match; exact zeros are left out."""
    left, worst = [complex(v) for v in theirs], 0.0
    if len(left) != len(ours):
        return math.inf
    for root in sorted(ours, key=lambda v: -abs(v)):
        value = complex(root)
        j = min(range(len(left)), key=lambda j: abs(left[j] - value))
        if value != 0:
            worst = max(worst, abs(left[j] - value) / abs(value))
        left.pop(j)
    return worst


def pair(value):
    return [float(mp.re(value)), float(mp.im(value))]


def solve(seed):
    rng = random.Random(seed)
    p = draw(rng)
    a, b, c, d = matrices(p, mp.mpf)
    a, b, c = mp.matrix(a), mp.matrix(b), mp.matrix(c)
    n = a.rows
    size = mp.sqrt(max(abs(v) for v in a))
    fa, fb, fc, fd = conditioned(p, a, b, c, d)
    system = control.ss(fa, fb, fc, fd)
    chi, _ = polynomials(a, b, c[0, :], d[0])
    poles, _ = roots(chi, size)
    theirs = {"poles": list(system.poles())}
    differs = {"poles": nearest(poles, theirs["poles"]), "zeros": 0.0, "response": 0.0, "sampled": 0.0}
    slow = min(abs(v) for v in poles if abs(v) > 1e-6 * size) if any(abs(v) > 0 for v in poles) else mp.mpf(1)
    swinging = [abs(v) for v in poles if abs(mp.im(v)) > 1e-6 * abs(v)]
    fast = max(swinging) if swinging else max(abs(v) for v in poles)
    omega = [float(slow) * 0.3 * max(10.0, float(fast / slow) * 10) ** (k / 6) for k in range(7)]
    sample_time = 1.0 / float(fast) * 10 ** rng.uniform(-1.5, 1.0)
    sampled = control.sample_system(system, sample_time, method="zoh")
    # e^{A T} and its integral, in many digits
    whole = mp.zeros(n + 1)
    for i in range(n):
        for j in range(n):
            whole[i, j] = a[i, j] * sample_time
        whole[i, n] = b[i] * sample_time
    whole = mp.expm(whole, method="taylor")
    phi, gamma = whole[:n, :n], whole[:n, n]
    angles = [0.03, 0.3, 1.0, 2.5]
    outputs = []
    for k in range(c.rows):
        _, numerator = polynomials(a, b, c[k, :], d[k])
        zeros, gain = roots(numerator, size)
        single = control.ss(fa, fb, fc[k : k + 1], fd[k : k + 1])
        control_zeros = list(single.zeros())
        differs["zeros"] = max(differs["zeros"], nearest(zeros, control_zeros))
        order, value = low_frequency(poles, zeros, gain)
        response = [respond(single, 1j * w) for w in omega]
        digital = [respond(sampled, np.exp(1j * t), k) for t in angles]

        def exact(matrix, column, s):
            return (c[k, :] * mp.lu_solve(s * mp.eye(n) - matrix, column))[0] + d[k]

        for w, got in zip(omega, response):
            want = exact(a, b, mp.mpc(0, w))
            differs["response"] = max(differs["response"], float(abs(want - got) / abs(want)))
        for t, got in zip(angles, digital):
            want = exact(phi, gamma, mp.expj(mp.mpf(t)))
            differs["sampled"] = max(differs["sampled"], float(abs(want - got) / abs(want)))
        outputs.append(
            {
                "name": OUTPUTS[k],
                "zeros": [pair(z) for z in zeros],
                "control_zeros": [pair(z) for z in control_zeros],
                "integrators": order,
                "low_frequency_gain": float(value),
                "response": [[v.real, v.imag] for v in response],
                "exact_response": [pair(exact(a, b, mp.mpc(0, w))) for w in omega],
                "sampled": [[v.real, v.imag] for v in digital],
                "exact_sampled": [pair(exact(phi, gamma, mp.expj(mp.mpf(t)))) for t in angles],
            }
        )
    return {
        "name": f"{seed:03d} {p['model']} {'current' if p['current'] else 'voltage'} {n}",
        "case": case(p),
        "speed": p["speed"],
        "poles": [pair(v) for v in poles],
        "control_poles": [pair(v) for v in theirs["poles"]],
        "frequencies": omega,
        "sample_time": sample_time,
        "angles": angles,
        "outputs": outputs,
        "control_differs_by": {k: v if math.isfinite(v) else None for k, v in differs.items()},
    }


def main():
    cases = [solve(seed) for seed in range(1, COUNT + 1)]
    path = os.path.join(HERE, "..", "tests", "authorities", "linear.json")
    with open(path, "w") as file:
        file.write('{"format": 1, "cases": [\n')
        file.write(",\n".join(json.dumps(c) for c in cases))
        file.write("\n]}\n")
    lines = [f"{COUNT} stages, python-control {control.__version__} with SLICOT against 60 digits; largest relative difference"]
    for key in ["poles", "zeros", "response", "sampled"]:
        values = sorted(math.inf if c["control_differs_by"][key] is None else c["control_differs_by"][key] for c in cases)
        over = sum(v > 1e-9 for v in values)
        lines.append(f"  {key:9} median {values[len(values) // 2]:.1e}, most {values[-1]:.1e}, above 1e-9 in {over}")
    with open(os.path.join(HERE, "output", "linear.txt"), "w") as file:
        file.write("\n".join(lines) + "\n")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
