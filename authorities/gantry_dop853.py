"""Authority A for gantries: SciPy's DOP853, restarted at every edge, row and change of mode; equations written out in
plain numbers.

Forces are the derivatives of the energy V, span by span. Every guard is looked at eight times within each step, on the
step's own interpolant; an event found there is refined by integrating up to it again, with Newton's rule.
"""

from __future__ import annotations

import math
import warnings

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq

from elements_rules import Doubt
from gantry_case import BODIES, Run
from model import Line

warnings.filterwarnings("ignore", message="At least one element of `rtol`")
warnings.filterwarnings("ignore", message="invalid value encountered in scalar divide")  # 0/0 where all is at rest

#   φ₁ w₁ φ₂ w₂ x v y u i₁ i₂
SIZE, CURRENTS = 10, 8
ATOL = np.array([1e-15, 1e-12, 1e-15, 1e-12, 1e-17, 1e-14, 1e-17, 1e-14, 1e-13, 1e-13])
RTOL = 2e-14
LOOKS = np.linspace(0, 1, 9)[1:]
LONGEST = 0.35  # of a step, times the fastest rate
BARELY = 1e-9  # speed the wrong way, rad/s or m/s, that is rounding in a body that has just left
MOST_EVENTS = 400


def voltage(piece, t):
    if isinstance(piece, Line):
        return piece.value + piece.slope * (t - piece.start)
    sine = np.sin if isinstance(t, np.ndarray) else math.sin
    return piece.offset + piece.amplitude * sine(piece.phase + piece.rate * (t - piece.start))


def h_frame(case, y):
    """Belt's torques on left and right, forces along x and y: −∂V/∂q, and the same of the damping."""
    r, (kl, kr, kb), (cl, cr, cb) = case.r, case.k, case.c
    p1, w1, p2, w2, x, v, c, u = (y[j] for j in range(8))
    #   V = ½ k_l (r φ₁ + x + y)² + ½ k_r (−r φ₂ + x − y)² + ½ k_b (−r φ₁ + r φ₂ − 2 x)²
    left = kl * (r * p1 + x + c) + cl * (r * w1 + v + u)
    right = kr * (x - c - r * p2) + cr * (v - u - r * w2)
    back = kb * (r * (p2 - p1) - 2 * x) + cb * (r * (w2 - w1) - 2 * v)
    return r * (back - left), r * (right - back), 2 * back - left - right, right - left


def core_xy(case, y):
    """The same of two belts, each with a span on either side of its motor."""
    r, (ka, kaa, kb, kbb), (ca, caa, cb, cbb) = case.r, case.k, case.c
    p1, w1, p2, w2, x, v, c, u = (y[j] for j in range(8))
    #   V = ½ (k_a + k_a') (r φ_A − x − y)² + ½ (k_b + k_b') (r φ_B − x + y)²
    a = (ka + kaa) * (r * p1 - (x + c)) + (ca + caa) * (r * w1 - (v + u))
    b = (kb + kbb) * (r * p2 - (x - c)) + (cb + cbb) * (r * w2 - (v - u))
    return -r * a, -r * b, a + b, a - b


class Machine:
    def __init__(self, case):
        self.case = case
        self.belt = h_frame if case.kind == "h-frame" else core_xy
        self.modes = [0, 0, 0, 0]
        self.pieces = [None, None]
        left, right = case.drives
        self.inertias = [left.inertia, right.inertia, case.m_bridge + case.m_cart, case.m_cart]

    def loads(self, t, y):
        """Every force on each body but its own friction, and the rates of the currents."""
        loads, rates = list(self.belt(self.case, y)), [0.0, 0.0]
        for j, drive in enumerate(self.case.drives):
            rest = voltage(self.pieces[j], t) - drive.ke * drive.n * y[2 * j + 1]
            if drive.L:
                i = y[CURRENTS + j]
                rates[j] = (rest - drive.R * i) / drive.L
            else:
                i = rest / drive.R
            loads[j] = loads[j] + drive.n * drive.kt * i
        return loads, rates

    def rhs(self, t, y):
        y = y.tolist()
        loads, (di1, di2) = self.loads(t, y)
        out = [0.0] * 8 + [di1, di2]
        for b, mode in enumerate(self.modes):
            if mode:
                law, speed = self.case.laws[b], y[2 * b + 1]
                friction = law.viscous[mode] * speed + mode * law.coulomb[mode]
                out[2 * b], out[2 * b + 1] = speed, (loads[b] - friction) / self.inertias[b]
        return out

    def guards(self, t, y):
        """{(body, what it becomes, None: the load decides): value}, each positive past its event."""
        found, loads = {}, None
        for b, mode in enumerate(self.modes):
            if mode:
                found[b, None] = -mode * y[2 * b + 1]
            else:
                loads = loads or self.loads(t, y)[0]
                found[b, 1] = loads[b] - self.case.laws[b].static[1]
                found[b, -1] = -loads[b] - self.case.laws[b].static[-1]
        return found

    def decide(self, body, t, y):
        load, law = self.loads(t, y)[0][body], self.case.laws[body]
        if load > law.static[1]:
            return 1
        return -1 if load < -law.static[-1] else 0

    def fastest(self):
        """rad/s; nothing here moves faster by itself."""
        case, r2 = self.case, self.case.r**2
        rates = []
        for strength, root in ((case.k, True), (case.c, False)):
            #   traces of M⁻¹ K and M⁻¹ C
            if case.kind == "h-frame":
                left, right, back = strength
                on = [r2 * (left + back), r2 * (right + back), left + right + 4 * back, left + right]
            else:
                on = [r2 * sum(strength[:2]), r2 * sum(strength[2:]), sum(strength), sum(strength)]
            trace = sum(value / inertia for value, inertia in zip(on, self.inertias))
            rates.append(math.sqrt(trace) if root else trace)
        for drive in case.drives:
            slow = drive.kt * drive.ke * drive.n**2 / drive.R / drive.inertia
            rates += [drive.R / drive.L, math.sqrt(slow * drive.R / drive.L)] if drive.L else [slow]
        rates += [piece.rate for chain in case.chains for piece in chain if not isinstance(piece, Line)]
        return max(rates)


def solve(case, times, rtol=RTOL):
    """From rest; rows at the times."""
    machine = Machine(case)
    starts = [{piece.start: piece for piece in chain} for chain in case.chains]
    stops = sorted(set(case.edges) | set(times) | {case.until})
    fastest = machine.fastest()
    stride, blind = LONGEST / fastest, 1e-3 / fastest
    y, rows, events, fresh, since = np.zeros(SIZE), [], [], set(), 0.0

    def refine(key, t0, y0, t):
        """The event again, from the last accepted step (t0, y0)."""
        for _ in range(8):
            here = y0
            if t > t0:
                solver = DOP853(machine.rhs, t0, y0, t, rtol=rtol, atol=ATOL)
                while solver.status == "running":
                    solver.step()
                here = solver.y
            h = min(1e-2 * blind, 1e-7)
            g = machine.guards(t, here)[key]
            slope = (machine.guards(t + h, here + h * np.array(machine.rhs(t, here)))[key] - g) / h
            if not slope > 0:
                raise Doubt(f"{BODIES[key[0]]}: an event with no slope at {t:.9f} s")
            correction = -g / slope
            if abs(correction) < 1e-15 or t + correction <= t0:
                return t, here
            t += correction
        return t, here

    def change(t, body, to):
        events.append((t, BODIES[body], machine.modes[body], to))
        machine.modes[body] = to
        fresh.add(body)
        if len(events) > MOST_EVENTS:
            raise Doubt("too many events")

    for t, end in zip(stops, stops[1:] + [None]):
        if any(t in begin for begin in starts):
            machine.pieces = [begin.get(t, piece) for begin, piece in zip(starts, machine.pieces)]
            fresh.clear()
            since = t
            for b in range(4):
                if not machine.modes[b] and (to := machine.decide(b, t, y)):
                    change(t, b, to)
        if t in times:
            rows.append(y[:8].tolist())
        while end is not None and t < end:
            solver = DOP853(machine.rhs, t, y, end, rtol=rtol, atol=ATOL, max_step=stride)
            event = None
            while solver.status == "running" and event is None:
                t_old, y_old = solver.t, solver.y.copy()
                message = solver.step()
                if solver.status == "failed":
                    raise Doubt(f"DOP853: {message}")
                interpolant = solver.dense_output()
                looks = t_old + LOOKS * (solver.t - t_old)
                states = interpolant(looks)
                states[:, -1] = solver.y
                for key, g in machine.guards(looks, states).items():
                    armed = key[0] not in fresh or key[1] is not None
                    at = lambda s: float(machine.guards(s, interpolant(s))[key])
                    for k, value in enumerate(g):
                        low = t_old if k == 0 else looks[k - 1]
                        if not armed and value > BARELY and k == 0 and t_old == since:
                            #   off and back within one look
                            nearer = [t_old + (looks[0] - t_old) / 2**power for power in range(1, 25)]
                            low = next((s for s in nearer if at(s) < 0), low)
                            armed = low > t_old
                        if not armed:
                            armed = value < 0
                            if not armed and value > BARELY:
                                raise Doubt(f"{BODIES[key[0]]} is pushed back as it leaves at {since:.9f} s")
                        elif value > 0:
                            root = low if at(low) >= 0 else brentq(at, low, looks[k], xtol=1e-16)
                            if event is None or root < event[0]:
                                event = root, key
                            break
                    if armed:
                        fresh.discard(key[0])
            if event is None:
                t, y = end, solver.y
                continue
            root, (body, to) = event
            t, y = refine((body, to), t_old, y_old, root)
            y = y.copy()
            if to is None:
                y[2 * body + 1] = 0.0
                to = machine.decide(body, t, y)
                if to == machine.modes[body]:
                    raise Doubt(f"{BODIES[body]} reaches zero and is pushed on at {t:.9f} s")
            fresh.clear()
            change(t, body, to)
            since = t
    return Run(rows, events, [])
