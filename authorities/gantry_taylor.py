"""Authority B for gantries: Taylor series of 28th order in 80-bit numbers, mode by mode.

Within a mode everything is linear: ż = A z for

    z = (φ₁ φ₂ x y | their speeds | i₁ i₂ | 1 | U₁ U̇₁ S₁ C₁ | U₂ U̇₂ S₂ C₂)        u = U + S,   S' = ω C,   C' = −ω S

with the lever arms as a matrix: s = B q, M q̈ = −Bᵀ (k s + c ṡ) + motors − friction. A step is a polynomial; every
guard is looked at 24 times a step with value and slope, and its root is bisected on the polynomial. The same run in
64-bit numbers shows how sensitive a case is to rounding.
"""

from __future__ import annotations

import numpy as np

from elements_rules import NEAR, Doubt
from elements_taylor import bisect, horner
from gantry_case import BODIES, STUCK, Run, margins
from model import Line

ORDER = 28
LOOKS = 24
REACH = 2.0  # step times fastest rate: 2²⁹/29! = 6e-23
Q, V, I, ONE, U, SIZE = 0, 4, 8, 10, 11, 19
MOST_EVENTS = 400


def levers(kind, r):
    """One row a span: its stretch by φ₁, φ₂, x, y."""
    if kind == "h-frame":
        return [[r, 0, 1, 1], [0, -r, 1, -1], [-r, r, -2, 0]]
    return [[r, 0, -1, -1], [-r, 0, 1, 1], [0, r, -1, 1], [0, -r, 1, -1]]


class Mode:
    """Rates, loads and guards of one mode."""

    def __init__(self, case, modes, waves, number):
        N = lambda values: np.array(values, dtype=number)
        unit = np.eye(SIZE, dtype=number)
        B = N(levers(case.kind, case.r))
        s, ds = B @ unit[Q : Q + 4], B @ unit[V : V + 4]
        f = N(case.k)[:, None] * s + N(case.c)[:, None] * ds
        loads = -B.T @ f
        a = np.zeros((SIZE, SIZE), dtype=number)
        for k, drive in enumerate(case.drives):
            place = U + 4 * k
            n, ke, kt, R = number(drive.n), number(drive.ke), number(drive.kt), number(drive.R)
            volts = unit[place] + unit[place + 2] - ke * n * unit[V + k]
            if drive.L > 0:
                current = unit[I + k]
                a[I + k] = (volts - R * current) / number(drive.L)
            else:
                current = volts / R
            loads[k] += n * kt * current
            a[place] = unit[place + 1]
            a[place + 2], a[place + 3] = waves[k] * unit[place + 3], -waves[k] * unit[place + 2]
        inertias = [*(number(d.inertia) for d in case.drives), number(case.m_bridge) + number(case.m_cart), number(case.m_cart)]
        guards, self.who = [], []
        for b, (law, mode) in enumerate(zip(case.laws, modes)):
            if mode == STUCK:
                guards += [loads[b] - number(law.static[1]) * unit[ONE], -loads[b] - number(law.static[-1]) * unit[ONE]]
                self.who += [(b, 1), (b, -1)]
                continue
            speed = unit[V + b]
            a[Q + b] = speed
            a[V + b] = (loads[b] - number(law.viscous[mode]) * speed - mode * number(law.coulomb[mode]) * unit[ONE]) / inertias[b]
            guards.append(-mode * speed)
            self.who.append((b, None))
        self.loads, self.guards = loads, np.array(guards)
        self.rate = number(max(1.0, float(np.abs(np.linalg.eigvals(a.astype(float))).max())))
        #   Aᵏ / (k! rateᵏ), k = 0 … ORDER
        powers = [unit]
        for k in range(1, ORDER + 1):
            powers.append(powers[-1] @ a / (k * self.rate))
        self.powers = np.array(powers)
        self.watch = np.einsum("gi,kij->kgj", self.guards, self.powers)


class Solver:
    def __init__(self, case, times, number):
        self.case, self.times, self.number = case, times, number
        self.modes = [STUCK] * 4
        self.events, self.doubts, self.fresh, self.cache = [], [], set(), {}
        self.waves = [number(0) if isinstance(chain[0], Line) else number(chain[0].rate) for chain in case.chains]
        self.looks = np.array([number(k) / LOOKS for k in range(LOOKS + 1)])
        k = np.arange(ORDER + 1)
        self.values = self.looks[:, None] ** k
        self.slopes = np.zeros_like(self.values)
        self.slopes[:, 1:] = k[1:] * self.values[:, :-1]
        self.scale = {b: 1e-30 for b in range(4)}  # the largest speed of a body so far

    def mode(self):
        key = tuple(self.modes)
        if key not in self.cache:
            self.cache[key] = Mode(self.case, key, self.waves, self.number)
        return self.cache[key]

    def change(self, t, body, to):
        t = float(t)
        if self.events and 0 < abs(self.events[-1][0] - t) < 1e-9:
            self.doubts.append(f"two events within {abs(self.events[-1][0] - t):.0e} s at {t:.9f} s")
        if any(0 < abs(edge - t) < 1e-9 for edge in self.case.edges):
            self.doubts.append(f"an event beside an edge at {t:.9f} s")
        self.events.append((t, BODIES[body], self.modes[body], to))
        self.modes[body] = to
        self.fresh.add(body)
        if len(self.events) > MOST_EVENTS:
            raise Doubt("too many events")

    def at_rest(self, body, load, t):
        law = self.case.laws[body]
        forward, backward = margins(law, load)
        if min(abs(forward), abs(backward)) < NEAR * max(law.static.values()):
            self.doubts.append(f"{BODIES[body]}: load at breakaway to {NEAR:.0e} at {float(t):.6f} s")
        return 1 if forward > 0 else -1 if backward > 0 else STUCK

    def release(self, t, z):
        """At an edge whoever is at rest decides again."""
        self.fresh = set()
        loads = self.mode().loads @ z
        for body in range(4):
            if self.modes[body] == STUCK and (to := self.at_rest(body, loads[body], t)) != STUCK:
                self.change(t, body, to)

    def first_event(self, mode, z, h):
        """(share of the step h, guard) of the earliest event in it, or None."""
        table = mode.watch @ z * (h ** np.arange(ORDER + 1))[:, None]
        g, slope = self.values @ table, self.slopes @ table
        best, armed = None, set()
        for j, (body, side) in enumerate(mode.who):
            p, fresh, found = table[:, j], body in self.fresh and side is None, None
            if side is None:
                scale = self.scale[body] = max(self.scale[body], float(np.abs(g[:, j]).max()))
            else:
                scale = max(self.case.laws[body].static.values())
            begin = 0
            if fresh:
                begin = 1
                if g[1, j] < 0:
                    armed.add(body)
                else:
                    # Back at zero within one look?
                    for power in range(1, 40):
                        low = self.looks[1] / self.number(2) ** power
                        if horner(p, low) < 0:
                            found = bisect(p, low, self.looks[1])
                            break
                    else:
                        raise Doubt(f"{BODIES[body]} is pushed back as it leaves")
            elif g[0, j] > 0:
                found = self.number(0)
            if found is None:
                over = g[begin + 1 :, j] > 0
                #   a top between two looks lies below the tangent at the first of them
                ds = 1 / self.number(LOOKS)
                tops = (slope[begin:-1, j] > 0) & (slope[begin + 1 :, j] < 0)
                tops &= g[begin:-1, j] + slope[begin:-1, j] * ds > -NEAR * scale
                for k in np.flatnonzero(over | tops):
                    low, high = self.looks[begin + k], self.looks[begin + k + 1]
                    if not over[k]:
                        inner = np.arange(1, ORDER + 1) * p[1:]
                        high = bisect(inner, low, high)
                        height = horner(p, high)
                        if abs(height) < NEAR * scale:
                            self.doubts.append(f"{BODIES[body]} grazed to {float(abs(height)) / scale:.0e}")
                        if height <= 0:
                            continue
                    found = bisect(p, low, high)
                    break
            if found is not None and (best is None or found < best[0]):
                best = found, (body, side)
        self.fresh -= armed
        return best

    def run(self):
        case, number = self.case, self.number
        starts = [{piece.start: piece for piece in chain} for chain in case.chains]
        z = np.zeros(SIZE, dtype=number)
        z[ONE] = 1
        rows, waiting = [], [number(t) for t in self.times]
        for edge, end in zip(case.edges, case.edges[1:] + [case.until]):
            t, end = number(edge), number(end)
            for k, begin in enumerate(starts):
                piece, place = begin.get(edge), U + 4 * k
                if isinstance(piece, Line):
                    z[place : place + 2] = number(piece.value), number(piece.slope)
                elif piece:
                    z[place], phase, a = number(piece.offset), number(piece.phase), number(piece.amplitude)
                    z[place + 2 : place + 4] = a * np.sin(phase), a * np.cos(phase)
            self.release(t, z)
            while t < end:
                mode = self.mode()
                h = min(number(REACH), (end - t) * mode.rate)
                event = self.first_event(mode, z, h)
                reach = h if event is None else event[0] * h
                after = end if event is None and end - t - h / mode.rate < 1e-16 else t + reach / mode.rate
                table = mode.powers @ z
                while waiting and waiting[0] <= after:
                    state = horner(table, (waiting.pop(0) - t) * mode.rate)
                    rows.append([float(state[j]) for b in range(4) for j in (Q + b, V + b)])
                z, t = horner(table, reach), after
                if event is None:
                    continue
                body, side = event[1]
                if side is None:
                    z[V + body] = number(0)
                    side = self.at_rest(body, self.mode().loads[body] @ z, t)
                    if side == self.modes[body]:
                        raise Doubt(f"{BODIES[body]} reaches zero and is pushed on at {float(t):.9f} s")
                self.fresh = set()
                self.change(t, body, side)
        return Run(rows, self.events, self.doubts)


def solve(case, times, number=np.longdouble):
    """From rest; rows at the times."""
    return Solver(case, times, number).run()
