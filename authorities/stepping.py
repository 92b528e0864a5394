"""A third opinion on the random stages: plain time stepping that shares no code with the two authorities.

Semi-implicit Euler with tiny steps, the stage and its friction written out again from the equations, the gear decided
anew at every step. It has no events and no matrices, and is good only to its step: what it shows is that its distance
from the authorities falls in proportion to the step, that is, that they solve the same model.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

CASES = Path(__file__).resolve().parents[1] / "tests" / "authorities" / "random_stages.json"


def input_at(signal, t):
    kind = signal["kind"]
    if kind == "step":
        return signal["value"] if t >= signal["at"] else 0.0
    if kind == "pulse":
        return signal["value"] if signal["at"] <= t < signal["at"] + signal["duration"] else 0.0
    if kind == "ramp":
        return signal["value"] * min(max((t - signal["at"]) / signal["over"], 0.0), 1.0)
    if kind == "triangle":
        return signal["amplitude"] * 2 / math.pi * math.asin(math.sin(2 * math.pi * signal["frequency"] * t))
    if kind == "square":
        return signal["amplitude"] * (1 if (t * signal["frequency"]) % 1.0 < signal["duty"] else -1)
    if kind == "sine":
        return signal["offset"] + signal["amplitude"] * math.sin(
            2 * math.pi * signal["frequency"] * t + signal["phase"]
        )
    if kind == "chirp":
        if t >= signal["over"]:
            return 0.0
        f0, f1 = signal["from"], signal["to"]
        return signal["amplitude"] * math.sin(2 * math.pi * (f0 * t + (f1 - f0) * t * t / (2 * signal["over"])))
    points = signal["points"]
    if t < points[0][0]:
        return 0.0
    for (t0, u0), (t1, u1) in zip(points, points[1:]):
        if t < t1:
            return u0 + (u1 - u0) * (t - t0) / (t1 - t0)
    return points[-1][1]


class Body:
    """One inertia with its friction: where it is, how fast, and whether it is held."""

    def __init__(self, friction):
        self.f = friction
        self.position = self.speed = 0.0
        self.held = True

    def step(self, h, inertia, load, forward, backward):
        """`load` acts in motion; `forward` and `backward` would act on a move out of rest."""
        f = self.f
        if self.held:
            if -f["breakaway_backward"] <= backward and forward <= f["breakaway_forward"]:
                return
            self.held = False
            sense = 1 if forward > f["breakaway_forward"] else -1
        else:
            sense = 1 if self.speed > 0 else -1
        side = "forward" if sense > 0 else "backward"
        speed = self.speed + h / inertia * (load - f["viscous_" + side] * self.speed - sense * f["coulomb_" + side])
        if speed * sense <= 0 and self.speed != 0.0:
            if -f["breakaway_backward"] <= backward and forward <= f["breakaway_forward"]:
                speed, self.held = 0.0, True
        self.speed = speed
        self.position += h * speed


def march(case, h):
    """Positions (φ₁, x, φ₃) at the case's sample times."""
    p, signal = case["stage"], case["input"]
    r, n, eta, jr, j1 = (
        p["pulley_radius"],
        p["gear_ratio"],
        p["gear_efficiency"],
        p["rotor_inertia"],
        p["drive_inertia"],
    )
    k1, k2, k3, c1, c2, c3 = (p[name] for name in ("k1", "k2", "k3", "c1", "c2", "c3"))
    drive, cart, idler = Body(p["drive_friction"]), Body(p["cart_friction"]), Body(p["idler_friction"])
    i, step, out = 0.0, 0, []
    for until in case["times"]:
        for step in range(step, round(until / h)):
            u = p["amplifier_gain"] * input_at(signal, (step + 0.5) * h)
            if p["amplifier_mode"] == "current":
                i = u
            elif p["inductance"] > 0:
                i = (i + h / p["inductance"] * (u - p["back_emf_constant"] * n * drive.speed)) / (
                    1 + h * p["resistance"] / p["inductance"]
                )
            else:
                i = (u - p["back_emf_constant"] * n * drive.speed) / p["resistance"]
            f1 = k1 * (r * drive.position - cart.position) + c1 * (r * drive.speed - cart.speed)
            f2 = k2 * (cart.position - r * idler.position) + c2 * (cart.speed - r * idler.speed)
            f3 = k3 * r * (idler.position - drive.position) + c3 * r * (idler.speed - drive.speed)
            belt, motor = r * (f3 - f1), p["torque_constant"] * i
            # Which way the power goes: T = K_t i − J_r n φ̈₁ against w₁, with φ̈₁ as it would be without loss.
            sense = drive.speed or belt + n * motor
            side = "forward" if sense > 0 else "backward"
            friction = drive.f["viscous_" + side] * drive.speed + math.copysign(drive.f["coulomb_" + side], sense)
            torque = motor - jr * n * (belt + n * motor - friction) / (j1 + n * n * jr)
            e = eta if torque * sense > 0 else 1 / eta
            drive.step(
                h,
                j1 + e * n * n * jr,
                belt + n * e * motor,
                belt + n * min(eta * motor, motor / eta),
                belt + n * max(eta * motor, motor / eta),
            )
            cart.step(h, p["cart_mass"], f1 - f2, f1 - f2, f1 - f2)
            idler.step(h, p["idler_inertia"], r * (f2 - f3), r * (f2 - f3), r * (f2 - f3))
        step = round(until / h)
        out.append((drive.position, cart.position, idler.position))
    return out


def main():
    cases = json.loads(CASES.read_text())["cases"]
    lossy = [case for case in cases if case["stage"]["gear_efficiency"] < 1]
    chosen = lossy[::2] + [case for case in cases if case not in lossy][::8]
    print("Largest distance of a position, relative to the largest position of the case.")
    print(f"{'case':<28}{'η':>6}{'L/R ms':>8}{'mode':>9}{'events':>8}{'h = 4 µs':>11}{'h = 1 µs':>11}{'ratio':>7}")
    for case in chosen:
        p = case["stage"]
        exact = [(y[0], y[2], y[4]) for y in case["states"]]
        size = [max(max(abs(row[k]) for row in exact), 1e-12) for k in range(3)]
        far = [
            max(abs(a[k] - b[k]) / size[k] for a, b in zip(march(case, h), exact) for k in range(3))
            for h in (4e-6, 1e-6)
        ]
        ratio = far[0] / far[1] if far[1] else math.nan
        print(
            f"{case['name']:<28}{p['gear_efficiency']:>6.2f}{1e3 * p['inductance'] / p['resistance']:>8.2f}{p['amplifier_mode']:>9}"
            f"{len(case['events']):>8}{far[0]:>11.1e}{far[1]:>11.1e}{ratio:>7.1f}",
            flush=True,
        )


if __name__ == "__main__":
    sys.exit(main())
