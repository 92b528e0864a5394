"""Sampled closed loops on the paper's machine, by SciPy's DOP853 between samples with events for stick and slip.

The equations are written out again from the paper, (1)-(4) and (15)-(18), and so are trapezoid, encoder, delay, limit
and the controllers; nothing is shared with taut or with the other scripts. Writes tests/authorities/closed_loop.json.
"""

import json
import math
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

# Friction of Table 4, the rest of Table 2.
KT = KE = 23e-3
RES, R = 0.71, 0.0194
J1 = J2 = 6.3e-5
B1 = B2 = 0.0016
TC1 = TC2 = 0.0150
M, B, FC = 0.362, 19.0424, 0.2
K1, K2, K3 = 1.3276e5, 1.3276e5, 5.8885e4

DRY = [TC1, FC, TC2]
SPEED = [1, 3, 5]
TIGHT = dict(method="DOP853", rtol=1e-12, atol=[1e-14, 1e-12, 1e-16, 1e-14, 1e-14, 1e-12], max_step=1e-4)


def loads(y, u):
    """All that acts on drive pulley, cart and idler pulley but their dry friction."""
    p1, w1, x, v, p3, w3 = y
    f1, f2, f3 = K1 * (R * p1 - x), K2 * (x - R * p3), K3 * (R * p3 - R * p1)
    torque = KT * (u - KE * w1) / RES
    return [torque - R * f1 + R * f3 - B1 * w1, f1 - f2 - B * v, R * f2 - R * f3 - B2 * w3]


def derivative(y, u, modes):
    load = loads(y, u)
    rate = [0.0] * 6
    for body, inertia in enumerate([J1, M, J2]):
        if modes[body] != 0:
            rate[2 * body] = y[2 * body + 1]
            rate[2 * body + 1] = (load[body] - modes[body] * DRY[body]) / inertia
    return rate


def decide(load, dry):
    return 1 if load > dry else -1 if load < -dry else 0


class Machine:
    def __init__(self):
        self.y, self.modes, self.changes = np.zeros(6), [0, 0, 0], 0

    def settle(self, u):
        for body in range(3):
            if self.modes[body] == 0:
                self.modes[body] = decide(loads(self.y, u)[body], DRY[body])
                self.changes += self.modes[body] != 0

    def run(self, t, end, u):
        self.settle(u)
        while t < end:
            modes = list(self.modes)
            events = []
            for body in range(3):
                if modes[body] != 0:
                    def f(_, y, row=SPEED[body], s=modes[body]):
                        return s * y[row]
                else:
                    def f(_, y, body=body):
                        return DRY[body] - abs(loads(y, u)[body])
                f.terminal, f.direction = True, -1
                events.append(f)

            def rhs(_, y):
                return derivative(y, u, modes)

            found = solve_ivp(rhs, (t, end), self.y, events=events, **TIGHT)
            if found.status == 0:
                self.y, t = found.y[:, -1], end
                break
            body = next(b for b in range(3) if len(found.t_events[b]) > 0)
            when = found.t_events[body][0]
            # The event again, from the last step before it, with Newton's rule on the integrated state.
            before = [k for k in range(len(found.t)) if found.t[k] < when]
            start, state = (found.t[before[-1]], found.y[:, before[-1]]) if before else (t, self.y)
            y = state
            for _ in range(5):
                if when > start:
                    y = solve_ivp(rhs, (start, when), state, **TIGHT).y[:, -1]
                h = 1e-9
                g = events[body](0, y)
                slope = (events[body](0, y + h * np.array(rhs(0, y))) - g) / h
                if slope == 0 or abs(g / slope) < 1e-16:
                    break
                when -= g / slope
            self.y, t = np.array(y), max(when, start)
            self.changes += 1
            if self.modes[body] != 0:
                self.y[SPEED[body]] = 0.0
                self.modes[body] = decide(loads(self.y, u)[body], DRY[body])
            else:
                self.modes[body] = 1 if loads(self.y, u)[body] > 0 else -1


def trapezoid(distance, speed, acceleration):
    """y, y', y'' of a move from rest to rest."""
    if distance < speed**2 / acceleration:
        speed = math.sqrt(distance * acceleration)
    rise, total = speed / acceleration, distance / speed + speed / acceleration

    def at(t):
        if t <= 0:
            return 0.0, 0.0, 0.0
        if t >= total:
            return distance, 0.0, 0.0
        if t <= rise:
            return acceleration * t * t / 2, acceleration * t, acceleration
        if t < total - rise:
            return speed * (t - rise / 2), speed, 0.0
        left = total - t
        return distance - acceleration * left * left / 2, acceleration * left, -acceleration

    return at


class Pid:
    def __init__(self, c):
        self.c, self.integral, self.slope, self.last = c, 0.0, 0.0, None

    def step(self, target, position, T):
        c = self.c
        e = target[0] - position
        tf = 1 / (2 * math.pi * c["filter"])
        self.slope = (tf * self.slope + (e - (e if self.last is None else self.last))) / (tf + T)
        self.last = e
        self.integral += c["integral"] * T * e
        return c["proportional"] * e + self.integral + c["derivative"] * self.slope

    def limited(self, excess, T):
        self.integral += min(T / self.c["tracking"], 1.0) * excess


class Filtered:
    def __init__(self, corner, T):
        self.keep, self.last, self.value, self.T = math.exp(-2 * math.pi * corner * T), None, 0.0, T

    def step(self, position):
        d = 0.0 if self.last is None else (position - self.last) / self.T
        self.last = position
        self.value = self.keep * self.value + (1 - self.keep) * d
        return self.value


class Cascade:
    def __init__(self, c, T):
        self.c, self.speed, self.integral = c, Filtered(c["filter"], T), 0.0

    def step(self, target, position, T):
        c = self.c
        error = c["position"] * (target[0] - position) + target[1] - self.speed.step(position)
        self.integral += c["speed_integral"] * T * error
        return c["speed"] * error + self.integral

    def limited(self, excess, T):
        self.integral += min(T / self.c["tracking"], 1.0) * excess


def rigid(y):
    """Voltage for one mass: inertia, friction and back-EMF."""
    _, v, a = y
    mass = M + (J1 + J2) / R**2
    sign = math.copysign(1, v) if v else math.copysign(1, a) if a else 0.0
    force = mass * a + (B + (B1 + B2) / R**2) * v + (FC + (TC1 + TC2) / R) * sign
    return RES * force / (KT / R) + KE / R * v


def run(case):
    T, delay, limit = case["every"], case["delay"], case["limit"]
    at = trapezoid(*case["move"])
    whole = int(delay / T + 1e-9)
    rest = delay - whole * T if delay / T - whole > 1e-9 else 0.0
    c = case["controller"]
    controller = Pid(c) if case["kind"] == "pid" else Cascade(c, T)
    machine, waiting, acting = Machine(), [0.0] * whole, 0.0
    rows = []
    for k in range(round(case["until"] / T)):
        t = k * T
        if k % case["row"] == 0:
            rows.append([t, machine.y[0], machine.y[2], machine.y[4]])
        angle, counts = machine.y[0], case["counts_per_turn"]
        if counts:
            angle = round(angle * counts / (2 * math.pi)) / (counts / (2 * math.pi))
        position = machine.y[2] if case["at"] == "cart" else R * angle
        asked = controller.step(at(t), position, T)
        if case["feed_forward"]:
            asked += rigid(at(t + delay + T / 2))
        given = min(max(asked, -limit), limit)
        controller.limited(given - asked, T)
        waiting.append(given)
        if rest > 0:
            machine.run(t, t + rest, acting)
            acting = waiting.pop(0)
            machine.run(t + rest, t + T, acting)
        else:
            acting = waiting.pop(0)
            machine.run(t, t + T, acting)
    rows.append([case["until"], machine.y[0], machine.y[2], machine.y[4]])
    return rows, machine.changes


PID = dict(proportional=3000.0, integral=60e3, derivative=10.0, filter=200.0, tracking=0.05)
CASCADE = dict(position=60.0, speed=10.0, speed_integral=500.0, filter=200.0, tracking=0.02)
COMMON = dict(every=1e-3, until=0.4, row=20, counts_per_turn=0, at="drive", feed_forward=False, limit=24.0, delay=0.0)
CASES = [
    dict(COMMON, name="PID", kind="pid", controller=PID, move=[0.02, 0.3, 5.0]),
    dict(COMMON, name="PID, counts, delay, limit", kind="pid", controller=PID, move=[0.04, 0.4, 20.0],
         counts_per_turn=12083, delay=0.4e-3, limit=9.0),
    dict(COMMON, name="PID, feed-forward, delay of 1.3 samples", kind="pid", controller=PID, move=[0.02, 0.3, 5.0],
         delay=1.3e-3, feed_forward=True),
    dict(COMMON, name="cascade, counts, whole delay", kind="cascade", controller=CASCADE, move=[0.02, 0.2, 4.0],
         counts_per_turn=12083, delay=1e-3),
    dict(COMMON, name="cascade at the cart, limit", kind="cascade", controller=CASCADE, move=[0.01, 0.3, 10.0],
         at="cart", limit=5.0, feed_forward=True),
]

if __name__ == "__main__":
    for case in CASES:
        case["rows"], case["changes"] = run(case)
        last = case["rows"][-1]
        print(f"{case['name']:45} x({last[0]:.1f} s) = {last[2]:.15f} m, {case['changes']} changes of mode")
    target = Path(__file__).parent.parent / "tests/authorities/closed_loop.json"
    target.write_text(json.dumps(CASES, indent=1) + "\n")
