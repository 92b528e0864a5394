"""Authority B: Taylor series of 22nd order in 80-bit numbers, mode by mode.

Within a mode everything piecewise linear is a row of a matrix on the vector

    Z = (φ₁ w₁ x v φ₃ w₃ i φ_r w_r z₁ z₂ z₃ | 1 u u̇ S C | s₁ s₂ …)

with the input's line (u, u̇) or wave (S, C) as states of their own. Smooth nonlinear terms s_k are built as series of
products, quotients, exponentials (tanh by its differential equation), coefficient by coefficient. Each step is a
polynomial; every guard is looked at twelve times a step with value and slope, and its root is bisected on the
polynomial. The numbers are `numpy.longdouble` unless told otherwise: the same run in 64-bit numbers shows how sensitive
a case is to rounding.
"""

from __future__ import annotations

import math

import numpy as np

from elements_rules import BODIES, NAME, NEAR, STUCK, Automaton, Doubt, Run
from model import Line, pieces

ORDER = 22
LOOKS = 12
PHI1, W1, X, V, PHI3, W3, I, PHIR, WR, Z1, Z2, Z3, ONE, U, SLOPE, SINE, COSINE = range(17)
LINEAR = 17
MOST_TERMS = 8
SIZE = LINEAR + MOST_TERMS
SPEED = {1: W1, 2: V, 3: W3}
BRISTLE = {1: Z1, 2: Z2, 3: Z3}


# --- series -------------------------------------------------------------------------------------------------------


class Row:
    """A linear combination of Z."""

    def __init__(self, row):
        self.row = row
        self.used = np.flatnonzero(row)
        self.weights = row[self.used]

    def begin(self, number):
        self.c = np.zeros(ORDER + 1, dtype=number)

    def step(self, k, z):
        self.c[k] = (self.weights * z[k, self.used]).sum()


class Product(Row):
    def __init__(self, a, b):
        self.a, self.b = a, b

    def step(self, k, z):
        self.c[k] = (self.a.c[: k + 1] * self.b.c[k::-1]).sum()


class Quotient(Product):
    #   q b = a   ⇒   q_k = (a_k − Σ_{j<k} q_j b_{k−j}) / b₀
    def step(self, k, z):
        self.c[k] = (self.a.c[k] - (self.c[:k] * self.b.c[k:0:-1]).sum()) / self.b.c[0]


class Exponential(Row):
    #   E' = a' E   ⇒   k E_k = Σ_{j≥1} j a_j E_{k−j}
    def __init__(self, a):
        self.a = a

    def step(self, k, z):
        if k == 0:
            self.c[0] = np.exp(self.a.c[0])
        else:
            j = np.arange(1, k + 1)
            self.c[k] = (j * self.a.c[1 : k + 1] * self.c[k - 1 :: -1][:k]).sum() / k


class Tanh(Row):
    #   H' = a' (1 − H²)
    def __init__(self, a):
        self.a = a

    def begin(self, number):
        super().begin(number)
        self.rest = np.zeros(ORDER + 1, dtype=number)  # 1 − H²

    def step(self, k, z):
        if k == 0:
            self.c[0] = np.tanh(self.a.c[0])
        else:
            j = np.arange(1, k + 1)
            self.c[k] = (j * self.a.c[1 : k + 1] * self.rest[k - 1 :: -1][:k]).sum() / k
        self.rest[k] = (1 if k == 0 else 0) - (self.c[: k + 1] * self.c[k::-1]).sum()


class Combination(Row):
    """Σ weight · series + constant."""

    def __init__(self, constant, *parts):
        self.constant, self.parts = constant, parts

    def step(self, k, z):
        self.c[k] = sum(weight * series.c[k] for weight, series in self.parts) + (self.constant if k == 0 else 0)


# --- a mode --------------------------------------------------------------------------------------------------------


class Mode:
    """The matrix of a mode: rates = A Z, quantities = rows on Z, nonlinear terms of Z."""

    def __init__(self, case, modes, wave, number):
        self.case, self.modes, self.number = case, modes, number
        self.series, self.terms = [], []
        N = self.exact
        unit = np.eye(SIZE, dtype=number)
        self.unit = unit
        one = unit[ONE]
        r, n = N(case.r), N(case.n)
        k, c = [N(v) for v in case.k], [N(v) for v in case.c]
        if case.follows:
            EA = N(case.EA)
            k = [EA / N(length) for length in case.l]

        # positions and speeds of the bodies along the belt, by the model's own coordinates
        if case.model == "rigid":
            p1 = p3 = unit[X]
            s1 = s3 = unit[V]
        else:
            p1, s1 = r * unit[PHI1], r * unit[W1]
            p3, s3 = (p1, s1) if case.model == "two-mass" else (r * unit[PHI3], r * unit[W3])
        x, v = unit[X], unit[V]
        w1 = s1 / r
        self.w1, self.phi1, self.w3, self.phi3 = w1, p1 / r, s3 / r, p3 / r

        # amplifier
        u = wave.offset * one + wave.amplitude * unit[SINE] if wave else unit[U]
        command = N(case.gain) * u
        ws = unit[WR] if case.backlash else w1
        emf = N(case.ke) * n * ws
        R, L = N(case.R), N(case.L)
        flag_v, flag_i = modes.get("voltage", 0), modes.get("current", 0)
        V_limit = N(case.V) * flag_v * one if flag_v else None
        I_limit = N(case.I) * flag_i * one if flag_i else None
        quantities, di = {"position": x}, 0 * one
        if case.commands == "voltage":
            volts = V_limit if flag_v else command
            quantities["volts"] = command
            if L > 0:
                i = quantities["amps"] = unit[I]
                quantities["push"] = volts - R * i - emf
                di = 0 * one if flag_i else quantities["push"] / L
            else:
                quantities["amps"] = (volts - emf) / R
                i = I_limit if flag_i else quantities["amps"]
        else:
            target = I_limit if flag_i else command
            quantities["amps"] = command
            if case.wb is None:
                quantities["volts"] = R * target + emf
                i = (V_limit - emf) / R if flag_v else target
            else:
                i = unit[I]
                di = N(case.wb) * (target - i)
                quantities["volts"] = R * i + emf + L * di
                if flag_v:
                    di = (V_limit - R * i - emf) / L
        self.current, self.current_rate = i, di
        self.terminal = R * i + (L * di if case.current_is_state else 0) + emf

        # gear
        motor = n * N(case.kt) * i
        self.torque = 0 * one
        if case.backlash:
            for side in (1, -1):
                gap = side * (unit[PHIR] - self.phi1) - N(case.play) * one
                quantities["gap", side] = gap
                quantities["press", side] = N(case.kg) * gap + N(case.cg) * side * (unit[WR] - w1)
            if modes["gear"]:
                self.torque = modes["gear"] * quantities["press", modes["gear"]]
        at_pulley = self.torque if case.backlash else motor

        # cart
        along = N(case.load) * one
        self.stop = 0 * one
        if case.stops:
            for side, bound in ((1, case.high), (-1, case.low)):
                past = side * (x - N(bound) * one)
                quantities["past", side], quantities["bump", side] = past, N(case.ks) * past + side * N(case.cs) * v
            if modes["stop"]:
                self.stop = -modes["stop"] * quantities["bump", modes["stop"]]
            along = along + self.stop

        # belt
        stretch = [(p1 - x, s1 - v), (x - p3, v - s3), (p3 - p1, s3 - s1)]
        f = [kj * d + cj * rate for kj, cj, (d, rate) in zip(k, c, stretch)]
        if case.follows:
            #   f₁ = E A / (l₁ − x) d₁ + c₁ d₁',   f₂ = E A / (l₂ + x) d₂ + c₂ d₂'
            for j, sign in ((0, -1), (1, 1)):
                length = Row(N(case.l[j]) * one + sign * x)
                f[j] = self.term(Quotient(self.keep(Row(EA * stretch[j][0])), self.keep(length))) + c[j] * stretch[j][1]
        if case.model == "two-mass":
            k23 = k[1] * k[2] / (k[1] + k[2])
            c23 = (c[1] * k[2] ** 2 + c[2] * k[1] ** 2) / (k[1] + k[2]) ** 2
            f[1] = f[2] = k23 * (x - p1) + c23 * (v - s1)
        if case.T0 is not None:
            for j in range(3):
                quantities["tension", j + 1] = N(case.T0) * one + f[j]
                if modes[f"span_{j + 1}"]:
                    f[j] = -N(case.T0) * one

        if case.model == "rigid":
            loads = {2: at_pulley / r + along}
        elif case.model == "two-mass":
            loads = {1: at_pulley + r * (f[1] - f[0]), 2: f[0] - f[1] + along}
        else:
            loads = {1: at_pulley + r * (f[2] - f[0]), 2: f[0] - f[1] + along, 3: r * (f[1] - f[2])}

        # rates
        a = np.zeros((SIZE, SIZE), dtype=number)
        for body, load in loads.items():
            inertia, law = case.bodies[body]
            row, mode = SPEED[body], modes[NAME[body]]
            quantities["load", body] = load
            quantities["speed", body] = unit[row]
            if mode != STUCK:
                a[row - 1] = unit[row]
                force = self.friction(body, law, mode, a)
                a[row] = (load - force) / N(inertia)
        a[I] = di if case.current_is_state else 0
        if case.backlash:
            a[PHIR] = unit[WR]
            a[WR] = (motor - self.torque) / N(case.rotor)
        a[U] = unit[SLOPE]
        if wave:
            a[SINE], a[COSINE] = N(wave.rate) * unit[COSINE], -N(wave.rate) * unit[SINE]
        self.a, self.quantities = a, quantities
        self.nonlinear = bool(self.series)
        linear = a[:LINEAR, :LINEAR].astype(float)
        self.rate = max(1.0, float(np.abs(np.linalg.eigvals(linear)).max()))
        self.a_linear = a[:LINEAR, :LINEAR]
        self.guard_rows = {}

    def exact(self, value):
        return self.number(value)

    def keep(self, series):
        self.series.append(series)
        return series

    def term(self, series):
        """A nonlinear term as an element of Z: its row."""
        place = LINEAR + len(self.terms)
        self.terms.append((place, self.keep(series)))
        return self.unit[place]

    def friction(self, body, law, mode, a):
        """The row of a sliding body's friction."""
        N, unit, keep = self.exact, self.unit, self.keep
        one, v = unit[ONE], unit[SPEED[body]]
        side = -1 if mode == -1 else 1

        def gaussian(decay):
            #   exp(−decay v²)
            speed = keep(Row(v))
            return keep(Exponential(keep(Combination(0, (-decay, keep(Product(speed, speed)))))))

        if law.kind == "lugre":
            lean = self.modes[f"lean_{body}"]
            fc, fb, z = N(law.coulomb[lean]), N(law.static[lean]), unit[BRISTLE[body]]
            g = keep(Combination(fc, (fb - fc, gaussian(1 / N(law.velocity) ** 2))))
            worn = keep(Product(keep(Row(N(law.stiffness) * lean * v)), keep(Row(z))))
            rate = v - self.term(Quotient(worn, g))
            a[BRISTLE[body]] = rate
            return N(law.stiffness) * z + N(law.damping) * rate + N(law.viscous[lean]) * v
        if law.kind == "smooth":
            vs, vc = np.sqrt(N(2)) * N(law.velocity), N(law.velocity) / 10
            height = np.sqrt(2 * np.exp(N(1))) * (N(law.static[1]) - N(law.coulomb[1]))
            hump = self.term(Product(gaussian(1 / vs**2), keep(Row(height / vs * v))))
            flat = self.term(Tanh(keep(Row(v / vc))))
            return hump + N(law.coulomb[1]) * flat + N(law.viscous[1]) * v
        viscous = N(law.viscous[side]) * v
        if mode == 2:
            return viscous
        p, q = (N(value) for value in law.factor(self.modes.get("segment", 0))) if law.along else (N(1), N(0))
        factor = p * one + q * unit[X]
        dry = N(law.coulomb[side]) * factor
        if law.kind == "stribeck":
            if law.shape == "exponential":
                fall = keep(Exponential(keep(Row(-side / N(law.velocity) * v))))
            else:
                fall = gaussian(N(law.decay))
            dry = dry + self.term(Product(keep(Row(N(law.force) * factor)), fall))
        return viscous + side * dry

    def expand(self, z):
        """Coefficients of Z in powers of (t − t₀) · rate, z the state there: rows 0 … ORDER."""
        number, rate = self.number, self.number(self.scale_rate)
        table = np.zeros((ORDER + 1, SIZE), dtype=number)
        table[0, :LINEAR] = z[:LINEAR]
        if not self.nonlinear:
            for k in range(ORDER):
                table[k + 1, :LINEAR] = (self.a_linear @ table[k, :LINEAR]) / (rate * (k + 1))
            return table
        for series in self.series:
            series.begin(number)
        places = {id(series): place for place, series in self.terms}
        for k in range(ORDER + 1):
            for series in self.series:
                series.step(k, table)
                if id(series) in places:
                    table[k, places[id(series)]] = series.c[k]
            if k < ORDER:
                table[k + 1, :LINEAR] = (self.a[:LINEAR] @ table[k]) / (rate * (k + 1))
        return table

    scale_rate = 1.0


def horner(polynomial, s):
    value = polynomial[-1]
    for coefficient in polynomial[-2::-1]:
        value = value * s + coefficient
    return value


def bisect(polynomial, low, high):
    """The root of a polynomial of different signs at low and high."""
    rises = horner(polynomial, high) > 0
    for _ in range(75):
        middle = (low + high) / 2
        if (horner(polynomial, middle) > 0) == rises:
            high = middle
        else:
            low = middle
    return high


class Solver:
    def __init__(self, case, number):
        self.case, self.number = case, number
        self.automaton = Automaton(case)
        self.modes = self.automaton.modes
        self.chain = pieces(case.signal, case.until)
        self.wave = None if isinstance(self.chain[0], Line) else self.chain[0]
        self.cache = {}
        self.size = np.zeros(LINEAR)  # largest values so far, for the step and for what is close
        self.scales = {}
        self.looks = np.array([number(k) / LOOKS for k in range(LOOKS + 1)])
        self.powers = np.array([[s**k for k in range(ORDER + 1)] for s in self.looks])

    def mode(self):
        key = tuple(self.modes.values())
        if key not in self.cache:
            mode = self.cache[key] = Mode(self.case, dict(self.modes), self.wave, self.number)
            mode.scale_rate = self.number(mode.rate)
        return self.cache[key]

    def with_terms(self, z):
        """Z at an instant, nonlinear terms included."""
        return self.mode().expand(z)[0]

    def value(self, z):
        def answer(quantity):
            full = self.with_terms(z)
            return self.mode().quantities[quantity] @ full

        return answer

    def row(self, z):
        mode, full = self.mode(), self.with_terms(z)
        rows = [mode.phi1, mode.w1, mode.unit[X], mode.unit[V], mode.phi3, mode.w3, mode.current]
        rows += [mode.unit[PHIR], mode.unit[WR], mode.torque, mode.stop, mode.terminal]
        return [float(row @ full) for row in rows]

    def start_piece(self, z, piece):
        number = self.number
        z[ONE] = 1
        if self.wave:
            z[SINE], z[COSINE] = np.sin(number(piece.phase)), np.cos(number(piece.phase))
        else:
            z[U], z[SLOPE] = number(piece.value), number(piece.slope)

    def step_length(self, table, rate):
        """As long as the last terms vanish in 80-bit numbers, and at most 0.9 / rate."""
        top = np.abs(table[0, :LINEAR].astype(float))
        self.size = np.maximum(self.size, top)
        h = 0.9
        size = np.maximum(self.size, np.abs(table[:8, :LINEAR].astype(float)).max(axis=0))
        for k in (ORDER - 1, ORDER):
            term = np.abs(table[k, :LINEAR].astype(float))
            with np.errstate(divide="ignore", invalid="ignore"):
                ratio = np.where(term > 0, size * 1e-21 / term, np.inf)
            h = min(h, float(ratio.min()) ** (1 / k))
        return h

    def first_event(self, table, h):
        """(s, guard, of the step h) of the earliest guard to rise above zero in the step, or None."""
        mode, automaton, number = self.mode(), self.automaton, self.number
        guards = automaton.guards(table[0, X])
        scaled = table * np.array([number(h) ** k for k in range(ORDER + 1)])[:, None]
        best, unarmed = None, set()
        terms = [term for guard in guards for term in guard.terms]
        if not terms:
            return None
        rows = np.array([sign * mode.quantities[quantity] - number(offset) * mode.unit[ONE] for sign, quantity, offset in terms])
        polynomials = scaled @ rows.T  # (ORDER + 1, terms)
        values = self.powers @ polynomials  # (LOOKS + 1, terms)
        slopes = self.powers[:, :-1] @ (polynomials[1:] * np.arange(1, ORDER + 1)[:, None])
        place = 0
        for guard in guards:
            count = len(guard.terms)
            columns = range(place, place + count)
            place += count
            fresh = guard.part in automaton.fresh
            if count == 1:
                g, slope, p = values[:, place - 1], slopes[:, place - 1], polynomials[:, place - 1]
            else:
                g = values[:, list(columns)].min(axis=1)
            scale = self.scales.get((guard.part, guard.terms[0][1]), 0.0)
            scale = self.scales[guard.part, guard.terms[0][1]] = max(scale, float(np.abs(g).max()))
            found = None
            if count == 2:
                found = self.both(polynomials[:, list(columns)], values[:, list(columns)], fresh, guard)
                if fresh and not (g[1:] < 0).all():
                    unarmed.add(guard.part)
            else:
                begin = 0
                if fresh:
                    if g[1] < 0:
                        begin = 1
                    else:
                        # Below zero for less than one look, or pushed back at once.
                        for power in range(1, 40):
                            low = self.looks[1] / number(2) ** power
                            if horner(p, low) < 0:
                                found = bisect(p, low, self.looks[1])
                                break
                        else:
                            if not guard.part.startswith("lean_"):
                                raise Doubt(f"{guard.part} is pushed back as it leaves")
                            # Nothing jumps there: the other sign will do.
                            begin, found = 1, number(0) if g[1] > 0 else None
                elif g[0] > 0:
                    found = number(0)
                if found is None:
                    for k in range(begin, LOOKS):
                        if g[k + 1] > 0:
                            found = bisect(p, self.looks[k], self.looks[k + 1])
                            break
                        #   a top between two looks
                        if slope[k] > 0 > slope[k + 1]:
                            inner = np.arange(1, ORDER + 1) * p[1:]
                            top = bisect(inner, self.looks[k], self.looks[k + 1])
                            height = horner(p, top)
                            if abs(height) < NEAR * scale and not guard.part.startswith("lean_"):
                                automaton.doubts.append(f"{guard.part} grazed to {float(height) / scale:.0e}")
                            if height > 0:
                                found = bisect(p, self.looks[k], top)
                                break
            if found is not None and (best is None or found < best[0]):
                best = found, guard
        if best is None:
            automaton.fresh &= unarmed
        return best

    def both(self, polynomials, values, fresh, guard):
        """Where the lesser of two polynomials first rises above zero."""
        roots = []
        for j in (0, 1):
            for k in range(LOOKS):
                if values[k, j] <= 0 < values[k + 1, j]:
                    if fresh and k == 0 and abs(values[0, j]) < 1e-12 * np.abs(values[:, j]).max():
                        continue
                    root = bisect(polynomials[:, j], self.looks[k], self.looks[k + 1])
                    if horner(polynomials[:, 1 - j], root) > 0:
                        roots.append(root)
        if not roots and not fresh and values[0].min() > 0:
            return self.number(0)
        return min(roots) if roots else None

    def run(self):
        case, automaton, number = self.case, self.automaton, self.number
        starts = {piece.start: piece for piece in self.chain}
        stops = sorted(set(starts) | {case.until})
        z = np.zeros(SIZE, dtype=number)
        z[:6] = case.initial
        rows, waiting = [], [number(t) for t in case.times]
        for stop, end in zip(stops, stops[1:]):
            t, end = number(stop), number(end)
            self.start_piece(z, starts[stop])
            automaton.edge(float(t), float(z[X]), self.value(z))
            while waiting and waiting[0] <= t:
                rows.append(self.row(z))
                waiting.pop(0)
            while t < end:
                mode = self.mode()
                table = mode.expand(z)
                rate = mode.scale_rate
                h = min(number(self.step_length(table, rate)), (end - t) * rate)
                event = self.first_event(table, h)
                reach = h if event is None else event[0] * h
                after = t + reach / rate
                if event is None and end - after < 1e-15:
                    after = end
                while waiting and waiting[0] < after:
                    s = (waiting.pop(0) - t) * rate
                    rows.append(self.row(self.at(table, s)))
                z, t = self.at(table, reach), after
                if event is not None:
                    self.handle(event[1], z, t)
        for _ in waiting:
            rows.append(self.row(z))
        return Run(rows, automaton.events, automaton.doubts)

    def at(self, table, s):
        return horner(table, s)

    def handle(self, guard, z, t):
        if guard.part in BODIES and guard.to is None:
            z[SPEED[BODIES[guard.part]]] = self.number(0)
        if guard.part.startswith("lean_"):
            z[SPEED[int(guard.part[-1])]] = self.number(0)
        if guard.part == "current" and guard.to and self.case.current_is_state and self.case.commands == "voltage":
            z[I] = guard.to * self.number(self.case.I)
        self.automaton.fire(t, float(z[X]), guard, self.value(z))


def solve(case, number=np.longdouble):
    """From rest."""
    return Solver(case, number).run()
