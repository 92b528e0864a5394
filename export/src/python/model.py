"""@title@

Written by taut @version@. The machine as NumPy and SciPy have it: linear between its events, which `simulate` locates by
`scipy.integrate.solve_ivp`; and, where everything slides, as python-control has it: `linear()`.

    import @stem@ as axis
    result = axis.simulate(@about@
    result["time"], result["cart_position"]
    axis.linear().poles()

Everything is in SI units.
"""

import math

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
WEIGHTS = np.array(WEIGHTS)
SIZE = WEIGHTS.shape[1]
INPUT = N + len(PRODUCTS)


def linear():
    """The linear model, everything sliding, as a state space of python-control."""
    import control

    matrices = (LINEAR[key] for key in "ABCD")
    return control.ss(*matrices, states=LINEAR["states"], inputs=LINEAR["inputs"], outputs=LINEAR["outputs"])


class Series:
    """z and its derivatives over time, as far as asked for, with the sums of the magnitudes of their parts."""

    def __init__(self, rates, z):
        self.rates, self.values, self.sizes = rates, [z], [np.abs(z)]

    def at(self, k):
        while len(self.values) <= k:
            self.values.append(self._next(self.rates, self.values))
            self.sizes.append(self._next(np.abs(self.rates), self.sizes))
        return self.values[k], self.sizes[k]

    @staticmethod
    def _next(rates, known):
        value, k = np.zeros(SIZE), len(known)
        value[:N] = rates @ known[-1]
        every = known + [value]
        for place, (one, other) in enumerate(PRODUCTS, N):
            value[place] = sum(math.comb(k, i) * every[i][one] * every[k - i][other] for i in range(k + 1))
        return value


class Machine:
    """The machine under way, at rest at the origin to begin with."""

    def __init__(self):
        self.time = 0.0
        self.z = np.zeros(SIZE)
        self.z[-1] = 1.0
        self.does = [element[1] for element in ELEMENTS]
        self.events = []
        self.told = np.zeros(len(STEPPERS))
        for _, sine, _, _, _, _, _, holding, most in STEPPERS:
            # Currents that hold the rotor on its full step.
            first = int(sine) - 2
            self.z[first + 2 : first + 4] = math.sin(0.25 * math.pi), math.cos(0.25 * math.pi)
            self.z[first : first + 2] = min(holding * math.cos(0.25 * math.pi), most)
        self._turn_fields()
        self.z = self._at(self.z[:N])
        self._take_up()

    def _turn_fields(self):
        """What the drivers of steppers command of their phases: each field stands at its command."""
        for drive, (_, _, electrical, _, _, _, field, _, _) in enumerate(STEPPERS):
            angle = self.told[drive] * electrical + 0.25 * math.pi
            self.z[INPUT + 2 * drive : INPUT + 2 * drive + 2] = field * math.cos(angle), field * math.sin(angle)

    def _at(self, x):
        """z with these states."""
        z = self.z.copy()
        z[:N] = x
        for place, (one, other) in enumerate(PRODUCTS, N):
            z[place] = z[one] * z[other]
        return z

    def _row(self, table, does=None):
        does, index = does or self.does, 0
        for element in DEPENDS[DEPENDS_FIRST[table] : DEPENDS_FIRST[table + 1]]:
            index = index * ELEMENTS[element][0] + does[element]
        return WEIGHTS[ENTRY[ENTRY_FIRST[table] + index]]

    def _take_up(self):
        """Takes the equations of the mode: x' = rates z, and the conditions under which they hold."""
        self.rates = np.array([self._row(place) for place in range(N)])
        holds = lambda guard: guard[1] < 0 or self.does[guard[1]] == guard[2]
        self.active = [number for number, guard in enumerate(GUARDS) if holds(guard)]
        self.rows = [self._row(GUARDS[number][0]) for number in self.active]

    @staticmethod
    def _falls(row, series):
        """Whether a condition falls below zero here: the first of its derivatives that is more than that decides."""
        for k in range(24):
            value, size = series.at(k)
            now = row @ value
            if abs(now) > ROUNDING * (np.abs(row) @ size):
                return now < 0
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
        self.z = self._at(self.z[:N])
        element, then = GUARDS[number][1], self._decided(number)
        self.events.append((self.time, element, then))
        if then == LEAVE:
            raise ValueError(f"something left its travel at {self.time} s")
        self.does[element] = then
        self._take_up()

    def _settle(self):
        """Changes modes, without time passing, until every condition holds."""
        for _ in range(100):
            series = Series(self.rates, self.z)
            fallen = [number for number, row in zip(self.active, self.rows) if self._falls(row, series)]
            if not fallen:
                return
            self._change(min(fallen, key=lambda number: GUARDS[number][4]))
        raise ValueError(f"too many events at {self.time} s")

    def set_command(self, values):
        """The commands of the drives from now on; of steppers positions in m, rounded to microsteps."""
        if STEPPERS:
            self._command_steppers(np.atleast_1d(values))
        else:
            self.z[INPUT:-1] = values
        self._settle()

    def _command_steppers(self, values):
        told = np.zeros(len(STEPPERS))
        for drive, (_, sine, _, _, microstep, farthest, _, _, _) in enumerate(STEPPERS):
            told[drive] = values[drive]
            if microstep > 0.0:
                told[drive] = math.copysign(math.floor(abs(values[drive]) / microstep + 0.5), values[drive]) * microstep
            if not abs(told[drive] - self.told[drive]) <= farthest:
                raise ValueError(f"the command jumps by more than {farthest} m, two full steps, at {self.time} s")
            # Rounding leads sine and cosine away from the circle.
            pair = slice(int(sine), int(sine) + 2)
            self.z[pair] /= np.hypot(*self.z[pair])
        self.told = told
        self._turn_fields()
        self.z = self._at(self.z[:N])

    def lost_steps(self):
        """Full steps by which the rotors of steppers are behind their fields."""
        ways = self.positions()
        lags = [told * per - ways[int(own[0])] for told, own in zip(self.told, STEPPERS) for per in [own[3]]]
        return np.array([4.0 * round(lag * own[2] / own[3] / (2.0 * math.pi)) for lag, own in zip(lags, STEPPERS)])

    def second_currents(self):
        """Currents in the second phases of steppers, A."""
        return np.array([self._row(OTHERS + drive) @ self.z for drive in range(len(STEPPERS))])

    def advance(self, until):
        """Goes on to `until`, s."""
        while until - self.time > 1e-15 * max(1.0, until):
            events = []
            for row in self.rows:
                # A guard that is zero here and rises is below zero only by the integrator's own error.
                slack = 1e-13 * (np.abs(row) @ np.abs(self.z) + 1.0)
                slack = slack if abs(row @ self.z) <= slack else 0.0
                event = lambda t, x, row=row, slack=slack: row @ self._at(x) + slack
                event.terminal, event.direction = True, -1
                events.append(event)
            run = solve_ivp(
                lambda t, x: self.rates @ self._at(x),
                (self.time, until),
                self.z[:N],
                method="DOP853",
                rtol=1e-11,
                atol=1e-14,
                max_step=1.0 / FASTEST if FASTEST > 0.0 else np.inf,
                events=events,
            )
            self.time, self.z = run.t[-1], self._at(run.y[:, -1])
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
    """A run from rest: `commands` are pairs of a time (s) and the command from then on, one number or one for each drive;
    or a function of time, which is held from each row to the next.

    Returns time, positions, speeds and currents by their names, a value every `every` s; of steppers also lost steps.
    """
    machine = Machine()
    if callable(commands):
        commands = [(k * every, commands(k * every)) for k in range(round(until / every) + 1)]
    edges = [(float(time), np.atleast_1d(value)) for time, value in commands]
    rows = []
    for k in range(round(until / every) + 1):
        time = k * every
        # A step that begins within rounding of a row begins there.
        while edges and edges[0][0] <= time + 1e-9 * every:
            machine.advance(min(edges[0][0], time))
            machine.set_command(edges.pop(0)[1])
        machine.advance(time)
        now = machine.positions(), machine.speeds(), machine.currents(), machine.second_currents(), machine.lost_steps()
        rows.append(np.concatenate(([time], *now)))
    names = ["time", *(f"{body}_position" for body in BODIES), *(f"{body}_speed" for body in BODIES)]
    names += [f"{drive}_current" for drive in DRIVES]
    names += [f"{drive}_{name}" for name in ("second_current", "lost_steps") for drive in DRIVES if STEPPERS]
    return dict(zip(names, np.array(rows).T)) | {"events": machine.events}


if __name__ == "__main__":
    result = simulate(@example@, until=1.0)
    for body, lever in zip(BODIES, LEVERS):
        print(f"{body}: {1e3 * lever * result[body + '_position'][-1]:.6f} mm after 1 s")
