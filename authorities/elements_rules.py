"""What may change in an axis with limits, backlash, slack, stops and dry friction, and when: the rules, without
mechanics.

A *part* has a state, and the states of all parts make a mode. An authority supplies the values of the quantities named
here; the rules say which quantity ends which state. A guard is a list of terms (sign, quantity, offset): its part
leaves its state when the smallest of sign · quantity − offset rises above zero.

| part | states | quantity |
|---|---|---|
| drive, cart, idler | 1, −1 slides; 0 stuck; 2 no dry friction | ("speed", b), ("load", b) |
| span_j | 0 taut, 1 slack | ("tension", j): T₀ + k d + c d′ |
| voltage | ±1 at its limit | "volts": what the amplifier would apply without limit |
| current | ±1 at its limit | "amps": the current without limit; "push": v − R i − K_e n w where it is a state |
| gear | ±1 that flank carries | "gap+" = θ − α, "press+" = k_g (θ − α) + c_g θ′; likewise "−" for the other flank |
| stop | ±1 the cart presses | "gap+", "press+" of the stop: ("past", ±1), ("bump", ±1) |
| lean_b, segment | signs and stretches of smooth laws; not reported | ("speed", b), "position" |
"""

from __future__ import annotations

from dataclasses import dataclass

BODIES = {"drive": 1, "cart": 2, "idler": 3}
NAME = {number: name for name, number in BODIES.items()}
FORWARD, BACKWARD, STUCK, FREE = 1, -1, 0, 2
NEAR = 1e-9
MOST_EVENTS = 5000


class Doubt(Exception):
    """The authority does not know."""


@dataclass(frozen=True)
class Guard:
    part: str
    to: int | None  # None: the load decides
    terms: tuple


class Automaton:
    """The mode of a run and its history. `value(quantity)` answers for the present state and mode."""

    def __init__(self, case):
        self.case = case
        self.modes = {}
        for part, limit in (("voltage", case.V), ("current", case.I)):
            if limit is not None:
                self.modes[part] = 0
        if case.backlash:
            self.modes["gear"] = 0
        if case.stops:
            self.modes["stop"] = 0
        if case.T0 is not None:
            self.modes.update({f"span_{j}": 0 for j in (1, 2, 3)})
        for number, (_, law) in case.bodies.items():
            self.modes[NAME[number]] = STUCK if law.dry else FREE
            if law.kind == "lugre":
                self.modes[f"lean_{number}"] = 1
        if case.bodies[2][1].along:
            self.modes["segment"] = self.segment(0.0)
        self.events, self.doubts = [], []
        self.fresh = set()  # parts that have just changed: their guards stand at zero

    def segment(self, x):
        return sum(x >= point[0] for point in self.case.bodies[2][1].along)

    def guards(self, x):
        """The guards of the present mode, the cart at x."""
        case, found = self.case, []
        for part, state in self.modes.items():
            if part in BODIES and state in (FORWARD, BACKWARD):
                found.append(Guard(part, None, ((-state, ("speed", BODIES[part]), 0.0),)))
            elif part in BODIES and state == STUCK:
                law, load = case.bodies[BODIES[part]][1], ("load", BODIES[part])
                where = x if part == "cart" else 0.0
                for side in (1, -1):
                    found.append(Guard(part, side, ((side, load, law.breakaway(side, where)),)))
            elif part.startswith("span_"):
                j = int(part[-1])
                found.append(Guard(part, 1 - state, ((-1 if state == 0 else 1, ("tension", j), 0.0),)))
            elif part in ("voltage", "current"):
                limit = case.V if part == "voltage" else case.I
                quantity = "volts" if part == "voltage" else "amps"
                if state == 0:
                    found += [Guard(part, side, ((side, quantity, limit),)) for side in (1, -1)]
                elif part == "current" and case.commands == "voltage" and case.L > 0:
                    found.append(Guard(part, 0, ((-state, "push", 0.0),)))
                else:
                    found.append(Guard(part, 0, ((-state, quantity, -limit),)))
            elif part in ("gear", "stop"):
                gap, press = ("gap", "press") if part == "gear" else ("past", "bump")
                if state == 0:
                    for side in (1, -1):
                        found.append(Guard(part, side, ((1, (gap, side), 0.0), (1, (press, side), 0.0))))
                else:
                    found.append(Guard(part, 0, ((-1, (press, state), 0.0),)))
            elif part.startswith("lean_"):
                found.append(Guard(part, -state, ((-state, ("speed", int(part[-1])), 0.0),)))
            elif part == "segment":
                points = case.bodies[2][1].along
                if state > 0:
                    found.append(Guard(part, state - 1, ((-1, "position", -points[state - 1][0]),)))
                if state < len(points):
                    found.append(Guard(part, state + 1, ((1, "position", points[state][0]),)))
        return found

    def change(self, t, part, to):
        if part in BODIES or part.split("_")[0] in ("voltage", "current", "gear", "stop", "span"):
            before = self.events[-1] if self.events else None
            if before and before[1] != part and 0 < abs(before[0] - float(t)) < 1e-9:
                self.doubts.append(f"two events within {abs(before[0] - float(t)):.0e} s at {before[0]:.9f} s")
            self.events.append((float(t), part, self.modes[part], to))
            if len(self.events) > MOST_EVENTS:
                raise Doubt("too many events")
        self.modes[part] = to
        self.fresh.add(part)

    def at_rest(self, body, load, x, t):
        """What a body at zero speed does under its load."""
        law, where = self.case.bodies[body][1], x if body == 2 else 0.0
        beyond = {side: side * load - law.breakaway(side, where) for side in (1, -1)}
        scale = max(law.breakaway(1, where), law.breakaway(-1, where), 1e-30)
        if min(abs(float(b)) for b in beyond.values()) < NEAR * scale:
            self.doubts.append(f"{NAME[body]}: load at breakaway to {NEAR:.0e} at {float(t):.6f} s")
        return FORWARD if beyond[1] > 0 else BACKWARD if beyond[-1] > 0 else STUCK

    def edge(self, t, x, value):
        """The input has jumped, or time begins: limits first, then whom the new load frees."""
        self.fresh = set()
        parts = ("voltage", "current") if self.case.commands == "voltage" else ("current", "voltage")
        for part in parts:
            if part not in self.modes:
                continue
            state, limit = self.modes[part], self.case.V if part == "voltage" else self.case.I
            if part == "current" and self.case.commands == "voltage" and self.case.L > 0:
                new = 0 if state and state * value("push") <= 0 else state
            else:
                q = value("volts" if part == "voltage" else "amps")
                new = 1 if q > limit else -1 if q < -limit else 0
                if abs(abs(float(q)) - limit) < NEAR * limit:
                    self.doubts.append(f"{part} at its limit at the edge at {t:.6f} s")
            if new != state:
                self.change(t, part, new)
        self.release(t, x, value)

    def release(self, t, x, value):
        """Lets go what cannot hold."""
        for part in ("drive", "cart", "idler"):
            if self.modes.get(part) == STUCK:
                to = self.at_rest(BODIES[part], value(("load", BODIES[part])), x, t)
                if to != STUCK:
                    self.change(t, part, to)

    def fire(self, t, x, guard, value):
        """A guard has come to zero."""
        self.fresh = set()
        part = guard.part
        if guard.to is not None:
            self.change(t, part, guard.to)
        else:
            to = self.at_rest(BODIES[part], value(("load", BODIES[part])), x, t)
            if to == self.modes[part]:
                raise Doubt(f"{part} reaches zero and is pushed on at {float(t):.9f} s")
            self.change(t, part, to)
        if part in ("gear", "stop"):  # damping makes the force jump
            for other in ("drive", "cart", "idler"):
                if self.modes.get(other) == STUCK:
                    load, law = float(value(("load", BODIES[other]))), self.case.bodies[BODIES[other]][1]
                    where = x if other == "cart" else 0.0
                    for side in (1, -1):
                        if side * load > law.breakaway(side, where) * (1 + 1e-12):
                            self.change(t, other, side)


@dataclass
class Run:
    """Rows φ₁ w₁ x v φ₃ w₃ i φ_r w_r T F_stop u_motor at the times asked for, and the events."""

    rows: list
    events: list
    doubts: list


def grid_doubt(case, events, chain):
    """Why the rows' times do not suit: an event or an edge falls on one."""
    for what, times in (("an event", [e[0] for e in events]), ("an edge", [p.start for p in chain])):
        for t in times:
            if t > 0 and abs(t - case.every * round(t / case.every)) < 1e-7 and t < case.until * (1 - 1e-12):
                return f"{what} falls on a row, {t:.9f} s"
            if t > case.until - 1e-7:
                return f"{what} falls on the end"
    return None
