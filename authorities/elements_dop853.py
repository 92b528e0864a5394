"""Authority A: SciPy's DOP853, restarted at every edge, row and change of mode; equations written out in plain numbers.

Every guard is looked at eight times within each step, on the step's own interpolant; an event found there is refined by
integrating up to it again, with Newton's rule.
"""

from __future__ import annotations

import math
import warnings

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq

from elements_rules import BODIES, NAME, STUCK, Automaton, Doubt, Run
from model import Line, pieces

warnings.filterwarnings("ignore", message="At least one element of `rtol`")

#   φ₁ w₁ x v φ₃ w₃ i φ_r w_r z₁ z₂ z₃
SIZE = 12
PHI1, W1, X, V, PHI3, W3, I, PHIR, WR = range(9)
SPEED = {1: W1, 2: V, 3: W3}
BRISTLE = {1: 9, 2: 10, 3: 11}
ATOL = np.array([1e-15, 1e-12, 1e-17, 1e-14, 1e-15, 1e-12, 1e-13, 1e-15, 1e-12, 1e-15, 1e-17, 1e-15])
RTOL = 2e-14
LOOKS = np.linspace(0, 1, 9)[1:]


class Axis:
    """Forces and rates of a case; y may be one state or an array of states in columns."""

    def __init__(self, case):
        self.case = case
        self.modes = {}
        self.piece = None

    def u(self, t):
        piece = self.piece
        if isinstance(piece, Line):
            return piece.value + piece.slope * (t - piece.start)
        s = t - piece.start
        sine = np.sin if isinstance(t, np.ndarray) else math.sin
        return piece.offset + piece.amplitude * sine(piece.phase + piece.rate * s)

    def amplifier(self, t, y):
        """(i, di/dt, what the amplifier would apply, the current it would let flow, push)."""
        case, modes = self.case, self.modes
        command = case.gain * self.u(t)
        emf = case.ke * case.n * (y[WR] if case.backlash else y[W1])
        voltage, limited = modes.get("voltage", 0), modes.get("current", 0)
        R, L = case.R, case.L
        if case.commands == "voltage":
            v = voltage * case.V if voltage else command
            if L == 0:
                #   i = clip((v − K_e n w) / R, ±I)
                free = (v - emf) / R
                return (limited * case.I + 0 * free if limited else free), 0.0, command, free, None
            #   L i' = v − R i − K_e n w
            push = v - R * y[I] - emf
            return y[I], (0.0 if limited else push / L), command, y[I], push
        wanted = limited * case.I if limited else command
        if case.wb is None:
            if case.V is None:
                return wanted + 0 * emf, 0.0, None, command, None
            #   i = clip(i_ref, (±V − K_e n w) / R)
            volts = R * wanted + emf
            return ((voltage * case.V - emf) / R if voltage else wanted + 0 * emf), 0.0, volts, command, None
        #   i' = ω (i_ref − i)   or, at the voltage limit,   L i' = ±V − R i − K_e n w
        rate = case.wb * (wanted - y[I])
        volts = R * y[I] + emf + L * rate
        if voltage:
            rate = (voltage * case.V - R * y[I] - emf) / L
        return y[I], rate, volts, command, None

    def belt(self, y):
        """Span forces and tensions: [f₁, f₂, f₃], [t₁, t₂, t₃]."""
        case, r = self.case, self.case.r
        if case.model == "rigid":
            return [0.0, 0.0, 0.0], [None] * 3
        p1, s1, x, v, p3, s3 = r * y[PHI1], r * y[W1], y[X], y[V], r * y[PHI3], r * y[W3]
        (k1, k2, k3), (c1, c2, c3) = case.k, case.c
        if case.follows:
            k1, k2 = case.EA / (case.l[0] - x), case.EA / (case.l[1] + x)
        if case.model == "two-mass":
            #   k = k₂ k₃ / (k₂ + k₃),  c = (c₂ k₃² + c₃ k₂²) / (k₂ + k₃)²
            k = k2 * k3 / (k2 + k3)
            c = (c2 * k3**2 + c3 * k2**2) / (k2 + k3) ** 2
            f2 = k * (x - p1) + c * (v - s1)
            return [k1 * (p1 - x) + c1 * (s1 - v), f2, f2], [None] * 3
        f = [
            k1 * (p1 - x) + c1 * (s1 - v),
            k2 * (x - p3) + c2 * (v - s3),
            k3 * (p3 - p1) + c3 * (s3 - s1),
        ]
        if case.T0 is None:
            return f, [None] * 3
        tension = [case.T0 + force for force in f]
        return [-case.T0 if self.modes[f"span_{j + 1}"] else f[j] for j in range(3)], tension

    def contact(self, y):
        """Gear torque and {1, −1: (gap, press)} of its flanks."""
        case = self.case
        theta, rate = y[PHIR] - y[PHI1], y[WR] - y[W1]
        #   k_g (θ ∓ α) + c_g θ'
        sides = {s: (s * theta - case.play, s * (case.kg * (theta - s * case.play) + case.cg * rate)) for s in (1, -1)}
        carries = self.modes["gear"]
        return (carries * sides[carries][1] if carries else 0.0), sides

    def stop(self, y):
        case = self.case
        sides = {
            1: (y[X] - case.high, case.ks * (y[X] - case.high) + case.cs * y[V]),
            -1: (case.low - y[X], case.ks * (case.low - y[X]) - case.cs * y[V]),
        }
        presses = self.modes["stop"]
        return (-presses * sides[presses][1] if presses else 0.0), sides

    def loads(self, t, y):
        """Every force on each body but its own friction."""
        case, r, n = self.case, self.case.r, self.case.n
        f1, f2, f3 = self.belt(y)[0]
        motor = n * case.kt * self.amplifier(t, y)[0]
        torque = self.contact(y)[0] if case.backlash else motor
        along = case.load + (self.stop(y)[0] if case.stops else 0.0)
        if case.model == "rigid":
            return {2: torque / r + along}
        if case.model == "two-mass":
            return {1: torque - r * f1 + r * f2, 2: f1 - f2 + along}
        return {1: torque - r * f1 + r * f3, 2: f1 - f2 + along, 3: r * f2 - r * f3}

    def friction(self, body, y, mode):
        """Friction of a sliding body, and the rate of its bristle."""
        law, v = self.case.bodies[body][1], y[SPEED[body]]
        if law.kind == "lugre":
            z, side = y[BRISTLE[body]], self.modes[f"lean_{body}"]
            #   g = F_c + (F_b − F_c) exp(−(v/v_s)²),  z' = v − σ₀ |v| z / g,  F = σ₀ z + σ₁ z' + b v
            g = law.coulomb[side] + (law.static[side] - law.coulomb[side]) * math.exp(-((v / law.velocity) ** 2))
            rate = v - law.stiffness * abs(v) * z / g
            return law.stiffness * z + law.damping * rate + law.viscous[side] * v, rate
        if law.kind == "smooth":
            #   √(2e) (F_b − F_c) exp(−(v/v_St)²) v/v_St + F_c tanh(v/v_Coul) + b v
            s, c = v / (math.sqrt(2) * law.velocity), v / (law.velocity / 10)
            hump = math.sqrt(2 * math.e) * (law.static[1] - law.coulomb[1]) * math.exp(-s * s) * s
            return hump + law.coulomb[1] * math.tanh(c) + law.viscous[1] * v, 0.0
        side = -1 if mode == -1 else 1
        dry = law.coulomb[side]
        if law.kind == "stribeck":
            fall = abs(v) / law.velocity if law.shape == "exponential" else law.decay * v * v
            dry += law.force * math.exp(-fall)
        if law.along:
            a, b = law.factor(self.modes["segment"])
            dry *= a + b * y[X]
        return law.viscous[side] * v + (0.0 if mode == 2 else side * dry), 0.0

    def rhs(self, t, y):
        case = self.case
        y = y.tolist()
        if case.model == "rigid":
            y[PHI1], y[W1] = y[X] / case.r, y[V] / case.r
        elif case.model == "two-mass":
            y[PHI3], y[W3] = y[PHI1], y[W1]
        rates = [0.0] * SIZE
        for body, load in self.loads(t, y).items():
            inertia, mode = case.bodies[body][0], self.modes[NAME[body]]
            row = SPEED[body]
            if mode != STUCK:
                force, rates[BRISTLE[body]] = self.friction(body, y, mode)
                rates[row - 1], rates[row] = y[row], (load - force) / inertia
        rates[I] = self.amplifier(t, y)[1]
        if case.backlash:
            #   n² J_r φ_r'' = n K_t i − T
            torque = case.n * case.kt * self.amplifier(t, y)[0] - self.contact(y)[0]
            rates[PHIR], rates[WR] = y[WR], torque / case.rotor
        return rates

    def filled(self, y):
        """The state with what a reduced model leaves out."""
        y, case = np.array(y, dtype=float), self.case
        if case.model == "rigid":
            y[PHI1], y[W1] = y[X] / case.r, y[V] / case.r
        if case.model in ("rigid", "two-mass"):
            y[PHI3], y[W3] = y[PHI1], y[W1]
        return y

    def value(self, quantity, t, y):
        """One of the quantities of the rules; y filled."""
        what = quantity[0] if isinstance(quantity, tuple) else quantity
        if what == "speed":
            return y[SPEED[quantity[1]]]
        if what == "load":
            return self.loads(t, y)[quantity[1]]
        if what == "tension":
            return self.belt(y)[1][quantity[1] - 1]
        if what == "position":
            return y[X]
        if what in ("gap", "press"):
            return self.contact(y)[1][quantity[1]][what == "press"]
        if what in ("past", "bump"):
            return self.stop(y)[1][quantity[1]][what == "bump"]
        return self.amplifier(t, y)[{"volts": 2, "amps": 3, "push": 4}[what]]

    def row(self, t, y):
        y = self.filled(y)
        i, rate, *_ = self.amplifier(t, y)
        case = self.case
        emf = case.ke * case.n * (y[WR] if case.backlash else y[W1])
        torque = self.contact(y)[0] if case.backlash else 0.0
        force = self.stop(y)[0] if case.stops else 0.0
        inductive = case.L * rate if case.current_is_state else 0.0
        return [*y[:6], i, y[PHIR], y[WR], torque, force, case.R * i + inductive + emf]


def solve(case, rtol=RTOL, longest=0.2):
    """From rest, or where the experiment begins (bodies without dry friction only)."""
    axis, automaton = Axis(case), Automaton(case)
    axis.modes = automaton.modes
    chain = pieces(case.signal, case.until)
    starts = {piece.start: piece for piece in chain}
    stops = sorted(set(starts) | set(case.times))
    stride = longest / case.fastest()
    blind = 1e-3 / case.fastest()
    y, rows = np.zeros(SIZE), {}
    y[:6] = case.initial

    def guard_value(guard, t, y):
        values = [sign * axis.value(quantity, t, y) - offset for sign, quantity, offset in guard.terms]
        return values[0] if len(values) == 1 else np.minimum(*values)

    def refine(guard, t0, y0, t):
        """The event again, from the last accepted step (t0, y0)."""
        for _ in range(1 if guard.part.startswith("lean_") else 8):
            here = y0
            if t > t0:
                solver = DOP853(axis.rhs, t0, y0, t, rtol=rtol, atol=ATOL, max_step=stride)
                while solver.status == "running":
                    solver.step()
                here = solver.y
            if guard.part.startswith("lean_"):
                return t, here
            h = min(1e-2 * blind, 1e-7)
            g = guard_value(guard, t, axis.filled(here))
            slope = (guard_value(guard, t + h, axis.filled(here + h * np.array(axis.rhs(t, here)))) - g) / h
            if not slope > 0:
                raise Doubt(f"{guard.part}: an event with no slope at {t:.9f} s")
            correction = -g / slope
            if abs(correction) < 1e-15 or t + correction <= t0:
                return t, here
            t += correction
        return t, here

    def after_event(guard, t, y):
        if guard.part in BODIES and guard.to is None:
            y[SPEED[BODIES[guard.part]]] = 0.0
        if guard.part == "current" and case.current_is_state and case.commands == "voltage":
            y[I] = guard.terms[0][0] * case.I if guard.to else y[I]
        filled = axis.filled(y)
        automaton.fire(t, filled[X], guard, lambda quantity: axis.value(quantity, t, filled))

    for t, end in zip(stops, stops[1:] + [None]):
        if t in starts:
            axis.piece = starts[t]
            filled = axis.filled(y)
            automaton.edge(t, filled[X], lambda quantity: axis.value(quantity, t, filled))
            since = t
        rows[t] = axis.row(t, y)
        while end is not None and t < end:
            still = all(automaton.modes[NAME[b]] == STUCK for b in case.bodies) and not case.current_is_state
            guards = automaton.guards(y[X])
            solver = DOP853(axis.rhs, t, y, end, rtol=rtol, atol=ATOL, max_step=np.inf if still else stride)
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
                if case.model != "elastic":
                    states = np.array([axis.filled(s) for s in states.T]).T
                unarmed = set()
                for guard in guards:
                    g = np.atleast_1d(guard_value(guard, looks, states)) + np.zeros(len(looks))
                    armed = guard.part not in automaton.fresh
                    for k, value in enumerate(g):
                        if not armed:
                            armed = value < 0
                            if not armed and looks[k] > since + blind:
                                if guard.part.startswith("lean_"):  # nothing jumps there: the other sign will do
                                    automaton.change(t, guard.part, guard.to)
                                    armed = True
                                    break
                                raise Doubt(f"{guard.part} is pushed back as it leaves at {since:.9f} s")
                        elif value > 0:
                            low = t_old if k == 0 else looks[k - 1]
                            at = lambda s: float(np.ravel(guard_value(guard, s, axis.filled(interpolant(s))))[0])
                            root = low if at(low) >= 0 else brentq(at, low, looks[k], xtol=1e-16)
                            if event is None or root < event[0]:
                                event = root, guard
                            break
                    if not armed:
                        unarmed.add(guard.part)
                automaton.fresh &= unarmed
            if event is None:
                t, y = end, solver.y
                continue
            root, guard = event
            t, y = refine(guard, t_old, y_old, root)
            y = y.copy()
            after_event(guard, t, y)
            since = t
    return Run([rows[t] for t in case.times], automaton.events, automaton.doubts)
