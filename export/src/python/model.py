"""@title@

Written by taut @version@. The machine as NumPy and SciPy have it: linear between its events, which `simulate` locates by
`scipy.integrate.solve_ivp`; and, where everything slides, as python-control has it: `linear()`.

    import @stem@ as axis
    result = axis.simulate([(0.0, 5.0), (0.25, 0.0)], until=1.0)     # 5 V for 0.25 s
    result["time"], result["cart_position"]
    axis.linear().poles()

Everything is in SI units.
"""

import numpy as np
from scipy.integrate import solve_ivp

@tables@

# The linear model: everything slides.
LINEAR = @linear@

STEP = @step@
# Nothing changes faster than this, 1/s: a condition that falls and rises again within a step goes unseen.
FASTEST = @fastest@
# The error of an integrator with event location where a sum is zero, as a share of its parts.
ROUNDING = 1e-11
# The code that follows where something left its travel.
LEAVE = @leave@
N = len(STATES)
SIZE = N + len(DRIVES) + 1
WEIGHTS = np.array(WEIGHTS)


def linear():
    """The linear model, everything sliding, as a state space of python-control."""
    import control

    matrices = (LINEAR[key] for key in "ABCD")
    return control.ss(*matrices, states=LINEAR["states"], inputs=LINEAR["inputs"], outputs=LINEAR["outputs"])


class Machine:
    """The machine under way, at rest at the origin to begin with."""

    def __init__(self):
        self.time = 0.0
        self.z = np.zeros(SIZE)
        self.z[-1] = 1.0
        self.does = [element[1] for element in ELEMENTS]
        self.events = []
        self._take_up()

    def _row(self, table, does=None):
        does, index = does or self.does, 0
        for element in DEPENDS[DEPENDS_FIRST[table] : DEPENDS_FIRST[table + 1]]:
            index = index * ELEMENTS[element][0] + does[element]
        return WEIGHTS[ENTRY[ENTRY_FIRST[table] + index]]

    def _take_up(self):
        """Takes the equations of the mode: z' = a z, and the conditions under which they hold."""
        self.a = np.zeros((SIZE, SIZE))
        for place in range(N):
            self.a[place] = self._row(place)
        holds = lambda guard: guard[1] < 0 or self.does[guard[1]] == guard[2]
        self.active = [number for number, guard in enumerate(GUARDS) if holds(guard)]
        self.rows = [self._row(GUARDS[number][0]) for number in self.active]

    def _falls(self, row):
        """Whether a condition falls below zero here: the first of its derivatives that is more than that decides."""
        value, size, absolute = self.z, np.abs(self.z), np.abs(self.a)
        for _ in range(24):
            now = row @ value
            if abs(now) > ROUNDING * (np.abs(row) @ size):
                return now < 0
            value, size = self.a @ value, absolute @ size
        return False

    def _decided(self, number):
        """What follows a condition: as its column says, or as the breakaway says that the load on a body at rest passes."""
        does = list(self.does)
        for element, table in RESTING:
            does[element] = 0 if self._row(table) @ self.z >= 0 else 1
        for breakaway in GUARDS[number][5:]:
            if breakaway >= 0:
                row = self._row(GUARDS[breakaway][0], does)
                if row @ self.z < -ROUNDING * (np.abs(row) @ np.abs(self.z)):
                    return GUARDS[breakaway][3]
        return GUARDS[number][3]

    def _change(self, number):
        """Does what follows where a condition falls."""
        for (condition, place), value in zip(RESETS, RESET_VALUES):
            if condition == number:
                self.z[place] = value
        element, then = GUARDS[number][1], self._decided(number)
        self.events.append((self.time, element, then))
        if then == LEAVE:
            raise ValueError(f"something left its travel at {self.time} s")
        self.does[element] = then
        self._take_up()

    def _settle(self):
        """Changes modes, without time passing, until every condition holds."""
        for _ in range(100):
            fallen = [number for number, row in zip(self.active, self.rows) if self._falls(row)]
            if not fallen:
                return
            self._change(min(fallen, key=lambda number: GUARDS[number][4]))
        raise ValueError(f"too many events at {self.time} s")

    def set_command(self, values):
        """The commands of the drives from now on."""
        self.z[N:-1] = values
        self._settle()

    def advance(self, until):
        """Goes on to `until`, s."""
        while until - self.time > 1e-15 * max(1.0, until):
            events = []
            for row in self.rows:
                # A guard that is zero here and rises is below zero only by the integrator's own error.
                slack = 1e-13 * (np.abs(row) @ np.abs(self.z) + 1.0)
                slack = slack if abs(row @ self.z) <= slack else 0.0
                event = lambda t, x, row=row, slack=slack: row[:N] @ x + row[N:] @ self.z[N:] + slack
                event.terminal, event.direction = True, -1
                events.append(event)
            a, b = self.a[:N, :N], self.a[:N, N:] @ self.z[N:]
            run = solve_ivp(
                lambda t, x: a @ x + b,
                (self.time, until),
                self.z[:N],
                method="DOP853",
                rtol=1e-11,
                atol=1e-14,
                max_step=1.0 / FASTEST if FASTEST > 0.0 else np.inf,
                events=events,
            )
            self.time, self.z[:N] = run.t[-1], run.y[:, -1]
            fallen = [number for number, times in zip(self.active, run.t_events) if len(times) > 0]
            if run.status == 1 and fallen:
                self._change(min(fallen, key=lambda number: GUARDS[number][4]))
                self._settle()

    def positions(self):
        """Ways of the bodies, rad or m."""
        ways = np.array([self.z[place] for place, _, _ in PLACES])
        for body in dict.fromkeys(int(length[0]) for length in LENGTHS):
            arms = [(int(other), arm) for own, other, arm in LENGTHS if own == body]
            length = ways[body] - sum(arm * ways[other] for other, arm in arms if other >= 0)
            ways[body] = length / next(arm for other, arm in arms if other < 0)
        return ways

    def speeds(self):
        """Their speeds, rad/s or m/s."""
        return np.array([self.z[place] for _, place, _ in PLACES])

    def currents(self):
        """Currents of the drives, A."""
        return np.array([self._row(OUTPUTS[0] + drive) @ self.z for drive in range(len(DRIVES))])


def simulate(commands, until, every=STEP):
    """A run from rest: `commands` are pairs of a time (s) and the command from then on, one number or one for each drive.

    Returns time, positions, speeds and currents by their names, a value every `every` s.
    """
    machine = Machine()
    edges = [(float(time), np.atleast_1d(value)) for time, value in commands]
    rows = []
    for k in range(round(until / every) + 1):
        time = k * every
        # A step that begins within rounding of a row begins there.
        while edges and edges[0][0] <= time + 1e-9 * every:
            machine.advance(min(edges[0][0], time))
            machine.set_command(edges.pop(0)[1])
        machine.advance(time)
        rows.append(np.concatenate(([time], machine.positions(), machine.speeds(), machine.currents())))
    names = ["time", *(f"{body}_position" for body in BODIES), *(f"{body}_speed" for body in BODIES)]
    names += [f"{drive}_current" for drive in DRIVES]
    return dict(zip(names, np.array(rows).T)) | {"events": machine.events}


if __name__ == "__main__":
    result = simulate([(0.0, [5.0] * len(DRIVES)), (0.25, [0.0] * len(DRIVES))], until=1.0)
    for body, lever in zip(BODIES, LEVERS):
        print(f"{body}: {1e3 * lever * result[body + '_position'][-1]:.6f} mm after 1 s")
