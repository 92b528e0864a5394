"""A third opinion on elements.json and curves.json: plain time stepping, every element written out again as in the book.

Semi-implicit Euler with tiny steps: clip, max and sign as they stand, no modes, no events, the case file read again. It is good
only to its step: what it shows is that its distance from the authorities falls in proportion to the step.
"""

from __future__ import annotations

import json
import math
import sys
import tomllib
from pathlib import Path

from stepping import input_at

FOLDER = Path(__file__).resolve().parents[1] / "tests" / "authorities"


def clip(value, limit):
    return value if limit is None else max(-limit, min(limit, value))


def read_input(t):
    t = dict(t)
    if "pulse" in t:
        return {"kind": "pulse", "value": t["pulse"], "duration": t["for"], "at": t.get("at", 0.0)}
    if "ramp" in t:
        return {"kind": "ramp", "value": t["ramp"], "over": t["over"], "at": t.get("at", 0.0)}
    if "table" in t:
        return {"kind": "table", "points": t["table"]}
    kind = next(k for k in ("triangle", "sine", "square") if k in t)
    return {"kind": kind, "amplitude": t[kind], "phase": 0.0, "offset": 0.0, "duty": 0.5, **t}


class Body:
    def __init__(self, inertia, parts, along=()):
        self.m, self.parts, self.along = inertia, parts, along  # parts: (friction entries, ratio of its speed to ours)
        self.q = self.v = 0.0
        self.z = [0.0] * len(parts)

    def dry(self, side, speed, x):
        """(what it holds at rest, what resists in motion)."""
        hold = slide = 0.0
        for f, ratio in self.parts:
            if "smooth" in f or "lugre" in f:
                continue
            back = side < 0
            c = f.get("coulomb", 0.0)
            b = f.get("static", c)
            if back:
                b = f.get("static_backward", f.get("static", f.get("coulomb_backward", c)))
                c = f.get("coulomb_backward", c)
            factor = 1.0
            if f.get("along"):
                points = f["along"]
                factor = points[0][1] if x <= points[0][0] else points[-1][1]
                for (x0, f0), (x1, f1) in zip(points, points[1:]):
                    if x0 <= x <= x1:
                        factor = f0 + (f1 - f0) * (x - x0) / (x1 - x0)
            fs = 0.0
            if "stribeck" in f:
                s = f["stribeck"]
                w = abs(speed * ratio)
                if s.get("shape") == "exponential":
                    fs = s["force"] * math.exp(-w / s["velocity"])
                else:
                    fs = s["force"] * math.exp(-w * w * (s["decay"] if "decay" in s else s["velocity"] ** -2))
                b = c + s["force"]
            hold += ratio * b * factor
            slide += ratio * (c + fs) * factor
        return hold, slide

    def step(self, h, load):
        viscous = 0.0
        for k, (f, ratio) in enumerate(self.parts):
            w = self.v * ratio
            b = f.get("viscous", 0.0) if w >= 0 else f.get("viscous_backward", f.get("viscous", 0.0))
            viscous += b * ratio**2
            if "smooth" in f:
                vb, fb, fc = f["smooth"]["breakaway_velocity"], f["static"], f["coulomb"]
                st, co = math.sqrt(2) * vb, vb / 10
                load -= ratio * (
                    math.sqrt(2 * math.e) * (fb - fc) * math.exp(-((w / st) ** 2)) * w / st + fc * math.tanh(w / co)
                )
            if "lugre" in f:
                s = f["lugre"]
                g = f["coulomb"] + (f["static"] - f["coulomb"]) * math.exp(-((w / s["velocity"]) ** 2))
                rate = w - s["stiffness"] * abs(w) / g * self.z[k]
                self.z[k] += h * rate
                load -= ratio * (s["stiffness"] * self.z[k] + s["damping"] * rate)
        side = 1 if self.v > 0 or (self.v == 0 and load > 0) else -1
        hold, slide = self.dry(side, self.v, self.q)
        before = self.v
        if before == 0.0 and abs(load) <= hold:
            return
        v = (before + h * (load - side * slide) / self.m) / (1 + h * viscous / self.m)
        if slide + hold > 0 and v * side < 0:
            v = 0.0  # friction never turns a body round
        self.v = v
        self.q += h * v


def run(text, h):
    """{row: (φ₁, x, φ₃)} at the case's grid."""
    file = tomllib.loads(text)
    motor, amp, belt, cart = file["motor"], file.get("amplifier", {}), file["belt"], file["cart"]
    drive, idler, travel, (experiment,) = file["drive_pulley"], file["idler_pulley"], file.get("travel", {}), file["experiment"]
    kt, ke, R, L, n = (
        motor["torque_constant"], motor["back_emf_constant"], motor["resistance"], motor.get("inductance", 0.0), motor.get("gear_ratio", 1.0)
    )  # fmt: skip
    gain, V, I, mode = amp.get("gain", 1.0), amp.get("voltage_limit"), amp.get("current_limit"), amp.get("mode", "voltage")
    wb = 2 * math.pi * amp["bandwidth"] if "bandwidth" in amp else None
    r, play = drive["radius"], "backlash" in motor
    alpha, kg, cg = motor.get("backlash", 0) / 2, motor.get("gear_stiffness", 0), motor.get("gear_damping", 0)
    rotor = n * n * motor.get("rotor_inertia", 0.0)
    j1, j2, M = drive["inertia"] + (0 if play else rotor), idler["inertia"], cart["mass"]
    f1, f2, f3 = drive.get("friction", {}), cart.get("friction", {}), idler.get("friction", {})
    model = belt.get("model", "elastic")
    if model == "rigid":
        bodies = [None, Body(M + (j1 + j2) / r**2, [(f2, 1.0), (f1, 1 / r), (f3, 1 / r)]), None]
    elif model == "two-mass":
        bodies = [Body(j1 + j2, [(f1, 1.0), (f3, 1.0)]), Body(M, [(f2, 1.0)]), None]
    else:
        bodies = [Body(j1, [(f1, 1.0)]), Body(M, [(f2, 1.0)]), Body(j2, [(f3, 1.0)])]
    k = belt.get("stiffness") or [belt["modulus"] * belt["section"] / l for l in belt["spans"]]
    c, T0 = belt.get("damping", [0.0] * 3), belt.get("pretension")
    constant = cart.get("load", 0.0) - M * 9.80665 * math.sin(cart.get("inclination", 0.0))
    signal = read_input(experiment["input"])
    i = pr = wr = 0.0
    A, B, C = bodies
    until, every = experiment["until"], experiment["every"]
    rows, steps, each = {}, round(until / h), every / h

    row = 0
    for step in range(steps + 1):
        t = step * h
        x, v = B.q, B.v
        p1, w1 = (x / r, v / r) if A is None else (A.q, A.v)
        p3, w3 = (p1, w1) if C is None else (C.q, C.v)
        if step >= row * each - 1e-6:
            rows[row] = (p1, x, p3)
            row += 1
        u = gain * input_at(signal, t)
        emf = ke * n * (wr if play else w1)
        if mode == "voltage":
            applied = clip(u, V)
            if L:
                i = clip((i + h / L * (applied - emf)) / (1 + h * R / L), I)
            else:
                i = clip((applied - emf) / R, I)
        else:
            wanted = clip(u, I)
            if wb is None:
                i = wanted if V is None else max((-V - emf) / R, min((V - emf) / R, wanted))
            elif V is None:
                i += h * wb * (wanted - i)
            else:
                i += h / L * (clip(R * i + emf + L * wb * (wanted - i), V) - R * i - emf)
        torque = n * kt * i
        if play:
            theta, rate = pr - p1, wr - w1
            T = 0.0
            if theta >= alpha:
                T = max(0.0, kg * (theta - alpha) + cg * rate)
            elif theta <= -alpha:
                T = min(0.0, kg * (theta + alpha) + cg * rate)
            wr += h / rotor * (torque - T)
            pr += h * wr
            torque = T
        load = constant
        if "stop_stiffness" in travel:
            ks, cs = travel["stop_stiffness"], travel.get("stop_damping", 0.0)
            if x >= travel["max"]:
                load -= max(0.0, ks * (x - travel["max"]) + cs * v)
            elif x <= travel["min"]:
                load -= min(0.0, ks * (x - travel["min"]) + cs * v)
        if model == "rigid":
            B.step(h, torque / r + load)
            continue
        k1, k2, k3 = k
        if belt.get("follows_cart"):
            EA, (l1, l2, _) = belt["modulus"] * belt["section"], belt["spans"]
            k1, k2 = EA / (l1 - x), EA / (l2 + x)
        s1 = k1 * (r * p1 - x) + c[0] * (r * w1 - v)
        if model == "two-mass":
            s2 = k2 * k3 / (k2 + k3) * (x - r * p1)
            s2 += (c[1] * k3**2 + c[2] * k2**2) / (k2 + k3) ** 2 * (v - r * w1)
            A.step(h, torque - r * s1 + r * s2)
            B.step(h, s1 - s2 + load)
            continue
        s2 = k2 * (x - r * p3) + c[1] * (v - r * w3)
        s3 = k3 * (r * p3 - r * p1) + c[2] * (r * w3 - r * w1)
        if T0 is not None:
            s1, s2, s3 = (max(0.0, T0 + s) - T0 for s in (s1, s2, s3))
        A.step(h, torque - r * s1 + r * s3)
        B.step(h, s1 - s2 + load)
        C.step(h, r * s2 - r * s3)
    return rows


def main():
    print("largest distance of the cart from the authorities, m, with steps of 8 µs, 4 µs and 2 µs (and its travel)")
    for name in sys.argv[1:] or ("elements", "curves"):
        cases = json.loads((FOLDER / f"{name}.json").read_text())["cases"]
        groups = {}
        for case in cases:
            groups.setdefault(case["group"], []).append(case)
        for group in groups.values():
            length = lambda case: case["rows"][-1][0]
            count = len(group) if group[0]["group"] in ("combined", "load") else 4
            for case in sorted(group, key=length)[:count]:
                place = case["columns"].index("cart_position")
                distances = []
                for h in (8e-6, 4e-6, 2e-6):
                    rows = run(case["case"], h)
                    distances.append(max(abs(rows[k][1] - case["rows"][k][place]) for k in rows))
                travel = max(abs(row[place]) for row in case["rows"])
                print(f"{case['name']:<72} {distances[0]:.1e} {distances[1]:.1e} {distances[2]:.1e}  of {travel:.1e}", flush=True)


if __name__ == "__main__":
    main()
