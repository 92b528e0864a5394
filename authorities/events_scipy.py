"""Authority A: SciPy's `solve_ivp` (DOP853) with events, mode by mode, restarted at every input edge and mode change.

Each event that `solve_ivp` finds on its interpolant is then refined: the last accepted step is integrated again up to
the event, and the time corrected by Newton's rule until the function that vanishes there does.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from model import BACKWARD, FORWARD, FREE, SPEED, STUCK, Event, Run, at_rest, derivative, gear_torque, loads, pieces

#            φ₁     w₁     x      v      φ₃     w₃     i
ATOL = [1e-15, 1e-12, 1e-17, 1e-14, 1e-15, 1e-12, 1e-13]
MOST_EVENTS = 5000


class Doubt(Exception):
    """The authority does not know."""


class Mode:
    """What holds between two events: which inertias slide, who drives the gear, which body has just left zero."""

    def __init__(self, stage, piece, modes, driving, since, left):
        self.stage, self.piece, self.modes, self.driving = stage, piece, dict(modes), driving
        self.since, self.left = since, left
        self.blind = (
            1e-3 / stage.fastest_rate()
        )  # how long a body that has just left zero is not asked whether it is there
        self.watch_gear = False

    def rhs(self, t, y):
        return derivative(self.stage, y, self.piece(t), self.modes, self.driving)

    def torque_sign(self, t, y):
        """T w₁, positive where the motor drives (up to a positive factor)."""
        return gear_torque(self.stage, y, self.piece(t), self.modes[1], self.driving) * self.modes[1]

    def settle_gear(self, t, y):
        """Who drives just after t: one Runge-Kutta step ahead, where T no longer vanishes."""
        if self.stage.gear_efficiency == 1.0 or self.modes[1] in (STUCK, FREE):
            return
        h, y = self.blind, np.asarray(y)
        k1 = np.array(self.rhs(t, y))
        k2 = np.array(self.rhs(t + h / 2, y + h / 2 * k1))
        k3 = np.array(self.rhs(t + h / 2, y + h / 2 * k2))
        k4 = np.array(self.rhs(t + h, y + h * k3))
        ahead = self.torque_sign(t + h, y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
        self.driving = ahead >= 0
        self.watch_gear = ahead != 0

    def functions(self):
        """(what, function): each is positive inside the mode and falls through zero where the mode ends."""
        watched = []
        for body, mode in self.modes.items():
            if mode in (FORWARD, BACKWARD):
                watched.append((("zero speed", body), self.speed(body, mode)))
            elif mode == STUCK:
                watched.append((("forward", body), self.hold(body, FORWARD)))
                watched.append((("backward", body), self.hold(body, BACKWARD)))
        if self.watch_gear:
            sense = 1 if self.driving else -1
            watched.append(
                (("gear", 1), lambda t, y: 1.0 if t < self.since + self.blind else sense * self.torque_sign(t, y))
            )
        for _, function in watched:
            function.__dict__.update(terminal=True, direction=-1)
        return watched

    def speed(self, body, mode):
        row, left = SPEED[body], body == self.left
        return lambda t, y: 1.0 if left and t < self.since + self.blind else mode * y[row]

    def hold(self, body, side):
        friction, stage, piece = self.stage.friction(body), self.stage, self.piece
        if side == FORWARD:
            return lambda t, y: friction.breakaway_forward - loads(stage, y, piece(t))[body][0]
        return lambda t, y: loads(stage, y, piece(t))[body][1] + friction.breakaway_backward


def refine(mode, function, t0, y0, t, options):
    """The event again, by integrating from the last accepted step (t0, y0) to it and correcting with Newton's rule."""
    y = np.array(y0)
    for _ in range(6):
        if t > t0:
            y = solve_ivp(mode.rhs, (t0, t), y0, **options).y[:, -1]
        h = 1e-3 * mode.blind
        slope = (function(t + h, y + h * np.array(mode.rhs(t, y))) - function(t, y)) / h
        if slope == 0.0:
            raise Doubt("an event with no slope")
        correction = -function(t, y) / slope
        if abs(correction) < 1e-15 or t + correction <= t0:
            return t, y
        t += correction
    return t, y


def solve(stage, signal, times, rtol=1e-13, atol=ATOL, method="DOP853"):
    """Integrates from rest; states and modes at `times` (just after an event or edge that falls on one)."""
    until = times[-1]
    chain = pieces(signal, until)
    starts = {piece.start: piece for piece in chain}
    stops = sorted(set(starts) | set(map(float, times)))
    options = dict(method=method, rtol=rtol, atol=np.array(atol))
    # solve_ivp sees a sign only at the ends of a step: steps of 1/20 period, lest a pair of crossings hide within one.
    stride = 0.3 / stage.fastest_rate()

    y = np.zeros(7)
    if chain[0].start != 0.0:
        raise ValueError("the input has to begin at time zero")
    modes = {body: STUCK if stage.has_modes(body) else FREE for body in (1, 2, 3)}
    events, doubts = [], []
    mode = Mode(stage, chain[0], modes, True, 0.0, None)

    def change(t, body, after, load):
        events.append(Event(float(t), body, modes[body], after, float(load)))
        modes[body] = after
        if len(events) > MOST_EVENTS:
            raise Doubt("too many events")

    def release(t, y):
        """Lets go what cannot hold; returns who left."""
        who = None
        for body in (1, 2, 3):
            if modes[body] == STUCK:
                after, load, margin = at_rest(stage.friction(body), *loads(stage, y, mode.piece(t))[body])
                if margin < 1e-9:
                    doubts.append(f"load of body {body} at breakaway to {margin:.1e} at {t:.6f} s")
                if after != STUCK:
                    change(t, body, after, load)
                    who = body
        return who

    def restart(t, y, left=None):
        nonlocal mode
        mode = Mode(stage, mode.piece, modes, mode.driving, t, left)
        mode.settle_gear(t, y)

    kept = {}
    for t, end in zip(stops, stops[1:] + [None]):
        if t in starts:
            mode.piece = starts[t]
            restart(t, y, release(t, y))
        kept[t] = (y.copy(), tuple(modes.values()))
        while end is not None and t < end:
            watched = mode.functions()
            options["max_step"] = np.inf if set(modes.values()) == {STUCK} else stride
            found = solve_ivp(mode.rhs, (t, end), y, events=[function for _, function in watched], **options)
            if found.status == -1:
                raise Doubt(f"solve_ivp: {found.message}")
            if found.status == 0:
                t, y = end, found.y[:, -1]
                continue
            which = next(k for k, at in enumerate(found.t_events) if len(at))
            (what, body), function = watched[which]
            t, y = refine(mode, function, found.t[-2], found.y[:, -2], found.t_events[which][-1], options)
            left = None
            if what == "gear":
                mode.driving = not mode.driving
                mode = Mode(stage, mode.piece, modes, mode.driving, t, None)
                mode.watch_gear = True
                continue
            pair = loads(stage, y, mode.piece(t))[body]
            if what == "zero speed":
                y[SPEED[body]] = 0.0
                pair = loads(stage, y, mode.piece(t))[body]
                after, load, margin = at_rest(stage.friction(body), *pair)
                if margin < 1e-9:
                    doubts.append(f"body {body} stops with its load at breakaway to {margin:.1e} at {t:.6f} s")
                if after == modes[body]:
                    raise Doubt(f"body {body} reaches zero and is pushed back at {t:.9f} s")
                came_from = pair[0] if modes[body] == FORWARD else pair[1]
                change(t, body, after, came_from if after == STUCK else load)
                left = body if after != STUCK else None
            elif what == "forward":
                change(t, body, FORWARD, pair[0])
                left = body
            else:
                change(t, body, BACKWARD, pair[1])
                left = body
            restart(t, y, left)

    wanted = [kept[float(t)] for t in times]
    return Run(np.array(times), np.array([w[0] for w in wanted]), np.array([w[1] for w in wanted]), events, doubts)
