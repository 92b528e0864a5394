"""Authority B: matrix exponentials in extended precision, mode by mode, scanned densely for events.

Within a mode, on one piece of the input, everything is linear in the augmented state

    z = (φ₁, w₁, x, v, φ₃, w₃, i, 1, p₀ … p_d)        p_k = u⁽ᵏ⁾ ηᵏ / k!   the input's Taylor terms

so ż = A z and z(t) = exp(A t) z(0), exact to rounding. Every function that can end the mode is a row g z. All rows are
looked at 50 times per period of the fastest motion, together with their slopes g A z, so that a double crossing between
two looks is seen as well; a root is then bisected on the row's own Taylor polynomial. Numbers are 80-bit
(`numpy.longdouble` on x86-64: 64-bit mantissa) unless told otherwise: the same run in 64-bit numbers shows how
sensitive a case is to rounding.
"""

from __future__ import annotations

import math

import numpy as np

from model import BACKWARD, FORWARD, FREE, I, PHI1, PHI3, SPEED, STUCK, V, W1, W3, X, Event, Line, Run, at_rest, pieces

LOOKS_PER_RADIAN = 50 / (2 * math.pi)
LONGEST_STRIDE = 1e-3  # s
MOST_EVENTS = 5000
NEAR = 1e-9  # nearer than this, relative, to a decision is "unsure"
ONE, INPUT = 7, 8


class Doubt(Exception):
    """The authority does not know."""


class Mode:
    """Matrix and rows of one mode on one kind of input piece."""

    def __init__(self, stage, modes, driving, degree, unit, number):
        self.size = INPUT + degree + 1
        self.number = number
        unit_row = np.eye(self.size, dtype=number)
        p = {name: number(value) for name, value in stage.flat().items() if isinstance(value, float)}
        r, n, eta, jr = p["pulley_radius"], p["gear_ratio"], p["gear_efficiency"], p["rotor_inertia"]
        phi1, w1, x, v, phi3, w3 = (unit_row[k] for k in (PHI1, W1, X, V, PHI3, W3))
        one, u = unit_row[ONE], p["amplifier_gain"] * unit_row[INPUT]

        # Spans, as forces on what they pull.
        f1 = p["k1"] * (r * phi1 - x) + p["c1"] * (r * w1 - v)
        f2 = p["k2"] * (x - r * phi3) + p["c2"] * (v - r * w3)
        f3 = p["k3"] * r * (phi3 - phi1) + p["c3"] * r * (w3 - w1)

        # Current: i commanded;  L di/dt = u_a − R i − K_e n w₁;  or L = 0 there.
        back_emf = p["back_emf_constant"] * n * w1
        rate_of_i = 0 * one
        if stage.amplifier_mode == "current":
            i = u
        elif stage.inductance > 0.0:
            i = unit_row[I]
            rate_of_i = (u - p["resistance"] * i - back_emf) / p["inductance"]
        else:
            i = (u - back_emf) / p["resistance"]
        motor = p["torque_constant"] * i

        # Loads without friction; of the drive pulley also without the motor.
        belt = r * (f3 - f1)
        cart_load, idler_load = f1 - f2, r * (f2 - f3)
        self.belt, self.motor, self.cart_load, self.idler_load = belt, n * motor, cart_load, idler_load

        # J φ̈ = load − b w − c, where it slides.
        def slide(body, load, speed, inertia):
            if modes[body] == STUCK:
                return 0 * one
            b, c = stage.friction(body).sliding(modes[body])
            return (load - number(b) * speed - number(c) * one) / inertia

        e = eta if driving else 1 / eta
        a1 = slide(1, belt + n * e * motor, w1, p["drive_inertia"] + e * n * n * jr)
        a2 = slide(2, cart_load, v, p["cart_mass"])
        a3 = slide(3, idler_load, w3, p["idler_inertia"])

        self.a = np.zeros((self.size, self.size), dtype=number)
        self.a[[PHI1, W1, X, V, PHI3, W3, I]] = [w1, a1, v, a2, w3, a3, rate_of_i]
        for k in range(degree):
            self.a[INPUT + k] = (k + 1) / number(unit) * unit_row[INPUT + k + 1]

        # Rows that are positive inside the mode, by name; `scale` is what their zero is small against.
        self.names, rows, self.scale = [], [], []
        for body in (1, 2, 3):
            friction, mode = stage.friction(body), modes[body]
            if mode in (FORWARD, BACKWARD):
                self.names.append(("zero speed", body))
                rows.append(mode * unit_row[SPEED[body]])
                self.scale.append(None)  # the body's own top speed so far
            elif mode == STUCK:
                load = {1: belt, 2: cart_load, 3: idler_load}[body]
                forward, backward = number(friction.breakaway_forward) * one, number(friction.breakaway_backward) * one
                scale = max(friction.breakaway_forward, friction.breakaway_backward, 1e-30)
                # A lossy gear makes two half-planes of each side: K_t i η and K_t i / η, the lesser (forward) or
                # greater.
                motors = (
                    [(0 * one, None)]
                    if body != 1
                    else [(n * motor * eta, -1)]
                    if eta == 1
                    else [(n * motor * eta, 1), (n * motor / eta, -1)]
                )
                if len(motors) == 1:
                    self.names += [("forward", body), ("backward", body)]
                    rows += [forward - load - motors[0][0], load + motors[0][0] + backward]
                    self.scale += [scale, scale]
                else:
                    # The load on a forward move is the lesser of the two: it passes breakaway when both have.
                    self.names += [("forward by η", body), ("forward by 1/η", body)]
                    self.names += [("backward by η", body), ("backward by 1/η", body)]
                    rows += [forward - load - m for m, _ in motors] + [load + m + backward for m, _ in motors]
                    self.scale += [scale] * 4
        if eta != 1 and modes[1] in (FORWARD, BACKWARD):
            # T w₁, T = K_t i − J_r n φ̈₁: positive where the motor drives.
            self.names.append(("gear", 1))
            rows.append((1 if driving else -1) * modes[1] * (motor - jr * n * a1))
            self.scale.append(None)
        self.rows = np.array(rows, dtype=number).reshape(-1, self.size)

        # Scaled states, so that one norm suits them all: S⁻¹ A S.
        fast = number(stage.fastest_rate())
        s = np.ones(self.size, dtype=number)
        s[[W1, W3]], s[X], s[V], s[I] = fast, r, r * fast, fast / max(p["torque_constant"], number(1e-12))
        self.balanced, self.s = self.a * s[None, :] / s[:, None], s
        self.steps, self.scans = {}, {}

    def exponential_less_one(self, h):
        """exp(A h) − 1 by a Taylor sum at h / 2ᵏ and k doublings P → 2 P + P²."""
        a = self.balanced * h
        norm = float(np.abs(a).sum(axis=1).max())
        doublings = max(0, math.ceil(math.log2(norm / 0.25))) if norm > 0.25 else 0
        a = a / 2**doublings
        p, term = a.copy(), a.copy()
        for k in range(2, 24):
            term = term @ a / k
            p += term
        for _ in range(doublings):
            p = 2 * p + p @ p
        return p * self.s[:, None] / self.s[None, :]

    def scan(self, duration, looks):
        """(exp(A duration) − 1, stack of [rows; rows A] exp(A k duration/looks) for k = 0 … looks)."""
        key = (round(float(duration) * 1e15), looks)
        if key not in self.scans:
            step = np.eye(self.size, dtype=self.number) + self.exponential_less_one(duration / looks)
            watched = np.vstack([self.rows, self.rows @ self.a])
            stack = [watched]
            for _ in range(looks):
                stack.append(stack[-1] @ step)
            result = self.exponential_less_one(duration), np.array(stack), step
            if len(self.scans) > 200:
                self.scans.clear()
            self.scans[key] = result
        return self.scans[key]

    def taylor(self, z, h):
        """Columns z⁽ᵏ⁾ hᵏ / k!: z at s h is their sum with weights sᵏ."""
        terms = [z]
        for k in range(1, 40):
            terms.append(self.a @ terms[-1] * (h / k))
        return np.array(terms)


def at(polynomial, s):
    value = polynomial[-1]
    for coefficient in polynomial[-2::-1]:
        value = value * s + coefficient
    return value


def bisect(polynomial, lower, upper, number):
    """The root of a polynomial that is positive at `lower` and negative at `upper` (or the other way round)."""
    rises = at(polynomial, upper) > 0
    for _ in range(80):
        middle = (lower + upper) / number(2)
        if (at(polynomial, middle) > 0) == rises:
            upper = middle
        else:
            lower = middle
    return upper


def sloped(polynomial):
    return np.array([k * c for k, c in enumerate(polynomial)][1:])


class Solver:
    """One run from rest."""

    def __init__(self, stage, signal, times, number):
        self.stage, self.number = stage, number
        self.chain = pieces(signal, times[-1])
        self.times = times
        self.modes = {body: STUCK if stage.has_modes(body) else FREE for body in (1, 2, 3)}
        self.driving = True
        self.top_speed = {1: 0.0, 2: 0.0, 3: 0.0}
        self.top_torque = 0.0
        self.events, self.doubts, self.cache = [], [], {}
        self.left = set()  # rows that start at zero, having just been left
        self.gear_open = False  # whether who drives is still to be seen

    def mode(self):
        degree = max(1, getattr(self.piece, "DEGREE", 1))
        unit = 1.0 if isinstance(self.piece, Line) else self.piece.longest
        key = (tuple(self.modes.values()), self.driving, degree, unit)
        if key not in self.cache:
            self.cache[key] = Mode(self.stage, self.modes, self.driving, degree, unit, self.number)
        return self.cache[key]

    def with_input(self, y, t):
        """y with the input's Taylor terms at t."""
        number, piece = self.number, self.piece
        unit = number(1.0 if isinstance(piece, Line) else piece.longest)
        terms = [c * unit**k for k, c in enumerate(piece.taylor(t, number))]
        return np.concatenate([y[:7], [number(1)], np.array(terms, dtype=number)])

    def loads(self, body, z):
        """(on a forward move, on a backward move)."""
        mode, eta = self.mode(), self.number(self.stage.gear_efficiency)
        if body != 1:
            load = (mode.cart_load if body == 2 else mode.idler_load) @ z
            return load, load
        belt, motor = mode.belt @ z, mode.motor @ z
        return belt + min(eta * motor, motor / eta), belt + max(eta * motor, motor / eta)

    def change(self, t, body, after, load):
        self.events.append(Event(float(t), body, self.modes[body], after, float(load)))
        before = self.events[-2] if len(self.events) > 1 else None
        if before and before.body != body and abs(before.time - float(t)) < 1e-10:
            self.doubts.append(f"two events within {abs(before.time - float(t)):.0e} s at {before.time:.9f} s")
        self.modes[body] = after
        self.left = {("zero speed", body)} if after != STUCK else set()
        if body == 1:
            self.gear_open = True
        if len(self.events) > MOST_EVENTS:
            raise Doubt("too many events")

    def release(self, t, z):
        """Lets go what cannot hold any longer, at an edge."""
        self.left = set()
        for body in (1, 2, 3):
            if self.modes[body] == STUCK:
                after, load, margin = at_rest(self.stage.friction(body), *self.loads(body, z))
                if margin < NEAR:
                    self.doubts.append(f"load of body {body} at breakaway to {margin:.0e} at an edge, {float(t):.6f} s")
                if after != STUCK:
                    self.change(t, body, after, load)

    def near(self, name, value, scale, t):
        """Notes a function that nearly, or only just, reached zero."""
        what, body = name
        if scale is None:
            scale = self.top_torque if what == "gear" else self.top_speed[body]
        if what != "gear" and abs(float(value)) < NEAR * scale:
            self.doubts.append(f"body {body}: {what} grazed to {abs(float(value)) / scale:.0e} at {float(t):.6f} s")

    def first_event(self, mode, stack, step, z, t, h, looks):
        """(offset, names) of the earliest root of a row within the stretch that begins at t, or None."""
        values = stack @ z
        count = len(mode.names)
        g, slope = values[:, :count], values[:, count:]
        falls = g[1:] < 0
        for j, (what, body) in enumerate(mode.names):
            if what.endswith(" by η"):  # a pair: both have to be past breakaway
                falls[:, j] = falls[:, j + 1] = falls[:, j] & falls[:, j + 1]
        # Between two looks a convex row lies above its tangents: only a low tangent hides a double crossing.
        dips = (
            (slope[:-1] < 0)
            & (slope[1:] > 0)
            & (np.maximum(g[:-1] + slope[:-1] * h, g[1:] - slope[1:] * h) <= 0.01 * g[:-1])
        )
        for k in np.flatnonzero((falls | dips).any(axis=1)):
            found = []
            state = z.copy()
            for _ in range(k):
                state = step @ state
            terms = mode.taylor(state, h)
            for j in np.flatnonzero(falls[k] | dips[k]):
                name, fresh = mode.names[j], k == 0 and mode.names[j] in self.left
                polynomial = terms @ mode.rows[j]
                start, end = self.number(0), self.number(1)
                if fresh:
                    if not falls[k][j]:
                        continue  # it leaves zero and is well away
                    # Up from zero and down again within one stretch: the root lies past the top.
                    inner = sloped(polynomial)
                    if at(inner, end * self.number(1e-9)) <= 0:
                        raise Doubt(f"body {name[1]} is pushed back as it leaves at {float(t):.9f} s")
                    start = bisect(inner, start, end, self.number)
                elif not falls[k][j]:
                    inner = sloped(polynomial)
                    end = bisect(inner, start, end, self.number)
                    bottom = at(polynomial, end)
                    self.near(name, bottom, mode.scale[j], t)
                    if bottom >= 0:
                        continue
                elif g[k][j] < 0:
                    found.append((self.number(0), name))
                    continue
                found.append((bisect(polynomial, start, end, self.number), name))
            found = self.both_halves(mode, found, g[k], terms)
            if found:
                offset, name = min(found, key=lambda pair: pair[0])
                return k * h + offset * h, name, (terms.T * offset ** np.arange(len(terms))).sum(axis=1)
        return None

    def both_halves(self, mode, found, g, terms):
        """Behind a lossy gear a stuck pulley leaves only when the loads by η and by 1/η are both past breakaway."""
        kept = []
        for offset, name in found:
            if " by " in name[0]:
                side, factor = name[0].split(" by ")
                other = f"{side} by {'1/η' if factor == 'η' else 'η'}", name[1]
                value = at(terms @ mode.rows[mode.names.index(other)], offset)
                if value > 0:
                    continue
                name = (side, name[1])
            kept.append((offset, name))
        return kept

    def advance(self, z, t, end):
        """From t to `end` or to the first event: (z, t, name of the event or None)."""
        number, mode = self.number, self.mode()
        duration = end - t
        looks = max(4, math.ceil(float(duration) * self.stage.fastest_rate() * LOOKS_PER_RADIAN))
        power, stack, step = mode.scan(duration, looks)
        h = duration / number(looks)
        if self.gear_open and self.stage.gear_efficiency != 1.0:
            # Who drives: as seen one hundredth of a stride ahead, where T no longer vanishes.
            self.gear_open = False
            if ("gear", 1) in mode.names:
                terms = mode.taylor(z, h)
                polynomial = terms @ mode.rows[mode.names.index(("gear", 1))]
                sense = -1 if at(polynomial, number(0.01)) < 0 else 1
                if sense * polynomial[0] <= 0:
                    self.left.add(("gear", 1))
                if sense < 0:
                    self.driving = not self.driving
                    return z, t, None
        event = self.first_event(mode, stack, step, z, t, h, looks) if mode.names else None
        self.left = set()
        for body, row in SPEED.items():
            self.top_speed[body] = max(self.top_speed[body], abs(float(z[row])))
        if event is None:
            return z + power @ z, end, None
        offset, name, z = event
        return z, t + offset, name

    def run(self):
        number = self.number
        starts = {piece.start: piece for piece in self.chain}
        stops = sorted(set(starts) | set(map(float, self.times)))
        y, t = np.zeros(8, dtype=number), number(0)
        kept = {}
        for stop, following in zip(stops, stops[1:] + [None]):
            t = number(stop)
            if stop in starts:
                self.piece = starts[stop]
                self.gear_open = True
                self.release(t, self.with_input(y, t))
            kept[stop] = (y[:7].copy(), tuple(self.modes.values()))
            while following is not None and t < number(following):
                end = min(number(following), t + number(min(LONGEST_STRIDE, self.piece.longest)))
                if number(following) - end < 1e-9:
                    end = number(following)
                z, t, name = self.advance(self.with_input(y, t), t, end)
                if name is not None:
                    self.handle(name, z, t)
                y = z
        wanted = [kept[float(t)] for t in self.times]
        return Run(
            np.array(self.times),
            np.array([w[0] for w in wanted]),
            np.array([w[1] for w in wanted]),
            self.events,
            self.doubts,
        )

    def handle(self, name, z, t):
        what, body = name
        if what == "gear":
            self.driving = not self.driving
            self.left = {("gear", 1)}
            return
        if what == "zero speed":
            z[SPEED[body]] = self.number(0)
            pair = self.loads(body, z)
            after, load, margin = at_rest(self.stage.friction(body), *pair)
            if margin < NEAR:
                self.doubts.append(f"body {body} stops with its load at breakaway to {margin:.0e} at {float(t):.6f} s")
            if after == self.modes[body]:
                raise Doubt(f"body {body} reaches zero and is pushed on at {float(t):.9f} s")
            came_from = pair[0] if self.modes[body] == FORWARD else pair[1]
            self.change(t, body, after, came_from if after == STUCK else load)
        else:
            side = FORWARD if what == "forward" else BACKWARD
            self.change(t, body, side, self.loads(body, z)[0 if side == FORWARD else 1])


def solve(stage, signal, times, number=np.longdouble):
    """Propagates from rest; states and modes at `times` (just after an event or edge that falls on one)."""
    return Solver(stage, signal, times, number).run()
