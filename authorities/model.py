"""The belt-driven axis on paper: its parameters, its inputs, its equations, its friction.

Three inertias, 1 drive pulley, 2 cart, 3 idler pulley. SI units, angles in radians. The state is

    y = (φ₁, w₁, x, v, φ₃, w₃, i)          w = φ̇, v = ẋ, i the armature current (used where L > 0)

and each inertia has a mode: +1 slides forward, −1 slides backward, 0 stuck, 2 has no dry friction and hence no modes.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import numpy as np

PHI1, W1, X, V, PHI3, W3, I = range(7)
SPEED = {1: W1, 2: V, 3: W3}
FORWARD, BACKWARD, STUCK, FREE = 1, -1, 0, 2


@dataclass(frozen=True)
class Friction:
    """Friction of one inertia: N m over rad/s for a pulley, N over m/s for the cart."""

    viscous_forward: float = 0.0
    viscous_backward: float = 0.0
    coulomb_forward: float = 0.0
    coulomb_backward: float = 0.0
    breakaway_forward: float = 0.0
    breakaway_backward: float = 0.0

    @staticmethod
    def symmetric(viscous, coulomb=0.0, breakaway=None):
        breakaway = coulomb if breakaway is None else breakaway
        return Friction(viscous, viscous, coulomb, coulomb, breakaway, breakaway)

    @property
    def dry(self):
        """Whether the inertia can be stuck, or feels its direction."""
        forces = (self.coulomb_forward, self.coulomb_backward, self.breakaway_forward, self.breakaway_backward)
        return any(forces) or self.viscous_forward != self.viscous_backward

    def sliding(self, mode):
        """(b, c) of the sliding force b v + c."""
        #   forward  b_f v + F_cf ;  backward  b_b v − F_cb
        if mode == BACKWARD:
            return self.viscous_backward, -self.coulomb_backward
        return self.viscous_forward, self.coulomb_forward


@dataclass(frozen=True)
class Stage:
    """Everything that stands in the equations of motion."""

    torque_constant: float
    back_emf_constant: float
    resistance: float
    pulley_radius: float
    drive_inertia: float
    cart_mass: float
    idler_inertia: float
    k1: float
    k2: float
    k3: float
    drive_friction: Friction
    cart_friction: Friction
    idler_friction: Friction
    inductance: float = 0.0
    rotor_inertia: float = 0.0
    gear_ratio: float = 1.0
    gear_efficiency: float = 1.0
    amplifier_mode: str = "voltage"
    amplifier_gain: float = 1.0
    c1: float = 0.0
    c2: float = 0.0
    c3: float = 0.0

    def friction(self, body):
        return (self.drive_friction, self.cart_friction, self.idler_friction)[body - 1]

    def has_modes(self, body):
        """An inertia has modes where friction is dry; a lossy gear is dry friction of the drive pulley."""
        return self.friction(body).dry or (body == 1 and self.gear_efficiency != 1.0)

    @property
    def current_is_state(self):
        return self.amplifier_mode == "voltage" and self.inductance > 0.0

    def fastest_rate(self):
        """An upper bound, rad/s, on how fast anything in the stage moves by itself."""
        r = self.pulley_radius
        eta = self.gear_efficiency
        j1 = self.drive_inertia + eta * self.gear_ratio**2 * self.rotor_inertia
        bodies = [
            (self.k1 + self.k3, self.c1 + self.c3, r * r / j1),
            (self.k1 + self.k2, self.c1 + self.c2, 1 / self.cart_mass),
            (self.k2 + self.k3, self.c2 + self.c3, r * r / self.idler_inertia),
        ]
        rates = [math.sqrt(2 * k * inverse) for k, _, inverse in bodies] + [2 * c * inverse for _, c, inverse in bodies]
        if self.current_is_state:
            rates.append(self.resistance / self.inductance)
        elif self.amplifier_mode == "voltage":
            rates.append(
                self.torque_constant * self.back_emf_constant * self.gear_ratio**2 / eta / self.resistance / j1
            )
        return max(rates)

    def flat(self):
        return asdict(self)


def unflatten(record):
    """The stage of a JSON record."""
    record = dict(record)
    for name in ("drive_friction", "cart_friction", "idler_friction"):
        record[name] = Friction(**record[name])
    return Stage(**record)


# --- inputs ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Line:
    """u = value + slope (t − start)."""

    start: float
    value: float
    slope: float = 0.0

    def __call__(self, t):
        return self.value + self.slope * (t - self.start)

    def taylor(self, t, number):
        """Coefficients, in powers of time from t, in the number type of t."""
        return [number(self.value) + number(self.slope) * (t - number(self.start)), number(self.slope)]

    longest = math.inf


@dataclass(frozen=True)
class Wave:
    """u = offset + amplitude sin(phase + rate s + sweep s²), with s = t − start."""

    start: float
    amplitude: float
    phase: float
    rate: float
    sweep: float
    offset: float
    longest: float  # piece on which 13 Taylor terms are exact to rounding

    DEGREE = 13

    def __call__(self, t):
        s = t - self.start
        return self.offset + self.amplitude * math.sin(self.phase + (self.rate + self.sweep * s) * s)

    def taylor(self, t, number):
        #   S' = θ' C,  C' = −θ' S,  θ' = b + 2 c τ   ⇒   (k+1) S_{k+1} = b C_k + 2 c C_{k−1}, likewise C
        s = t - number(self.start)
        theta = number(self.phase) + (number(self.rate) + number(self.sweep) * s) * s
        b, c = number(self.rate) + 2 * number(self.sweep) * s, number(self.sweep)
        sine, cosine = [np.sin(theta)], [np.cos(theta)]
        for k in range(self.DEGREE):
            sine_before, cosine_before = (sine[k - 1], cosine[k - 1]) if k else (number(0), number(0))
            sine.append((b * cosine[k] + 2 * c * cosine_before) / (k + 1))
            cosine.append(-(b * sine[k] + 2 * c * sine_before) / (k + 1))
        coefficients = [number(self.amplitude) * term for term in sine]
        coefficients[0] += number(self.offset)
        return coefficients


PERIOD = 2**20 - 1


def prbs_bits(seed, count):
    """The bits of b_k = b_{k-3} xor b_{k-20}, entered where the seed says (SplitMix64's finaliser, modulo the
    period)."""
    mask = 2**64 - 1
    z = (seed + 0x9E3779B97F4A7C15) & mask
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & mask
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & mask
    skip = (z ^ (z >> 31)) % PERIOD
    bits = [0] * 19 + [1]  # what came before the first bit, the latest last
    for _ in range(skip + count):
        bits.append(bits[-3] ^ bits[-20])
    return bits[20 + skip :]


def pieces(signal, until):
    """The input as a chain of pieces, each holding until the next begins; the first begins at time zero."""
    kind = signal["kind"]
    if kind == "step":
        chain = [Line(signal["at"], signal["value"])]
    elif kind == "pulse":
        chain = [Line(signal["at"], signal["value"]), Line(signal["at"] + signal["duration"], 0.0)]
    elif kind == "ramp":
        slope = signal["value"] / signal["over"]
        chain = [Line(signal["at"], 0.0, slope), Line(signal["at"] + signal["over"], signal["value"])]
    elif kind == "triangle":  # from zero, rising first
        a, f = signal["amplitude"], signal["frequency"]
        slope = 4 * a * f
        chain = [Line(0.0, 0.0, slope)]
        k = 0
        while (corner := (2 * k + 1) / (4 * f)) < until:
            chain.append(Line(corner, a if k % 2 == 0 else -a, -slope if k % 2 == 0 else slope))
            k += 1
    elif kind == "square":  # +amplitude for the share `duty` of each period, −amplitude for the rest
        a, f = signal["amplitude"], signal["frequency"]
        chain, k = [], 0
        while k / f < until:
            chain += [Line(k / f, a), Line((k + signal["duty"]) / f, -a)]
            k += 1
    elif kind == "sine":
        rate = 2 * math.pi * signal["frequency"]
        chain = [Wave(0.0, signal["amplitude"], signal["phase"], rate, 0.0, signal["offset"], 0.3 / rate)]
    elif kind == "chirp":  # frequency goes linearly from `from` to `to` in `over`; zero afterwards
        rate, last = 2 * math.pi * signal["from"], 2 * math.pi * signal["to"]
        sweep = (last - rate) / (2 * signal["over"])
        chain = [
            Wave(0.0, signal["amplitude"], 0.0, rate, sweep, 0.0, 0.3 / max(rate, last)),
            Line(signal["over"], 0.0),
        ]
    elif kind == "table":  # straight lines; zero before the first point, held after the last
        points = signal["points"]
        chain = [Line(t0, u0, (u1 - u0) / (t1 - t0)) for (t0, u0), (t1, u1) in zip(points, points[1:])]
        chain.append(Line(*points[-1]))
    elif kind == "prbs":
        bit = signal["bit"]
        high = prbs_bits(signal["seed"], math.ceil(until / bit))
        a = signal["amplitude"]
        chain = [Line(k * bit, a if up else -a) for k, up in enumerate(high)]
        chain = [piece for k, piece in enumerate(chain) if k == 0 or piece.value != chain[k - 1].value]
    else:
        raise ValueError(f"unknown input {kind!r}")
    if chain[0].start > 0.0:
        chain.insert(0, Line(0.0, 0.0))
    return [piece for piece in chain if piece.start < until]


# --- equations ------------------------------------------------------------------------------------------------------


def gear_factor(stage, driving):
    """e in τ_M = n e T: η where the motor drives (T w₁ > 0), 1/η where it is driven back."""
    return stage.gear_efficiency if driving else 1 / stage.gear_efficiency


def spans(stage, y):
    """Belt forces f₁, f₂, f₃ of the three spans; positive is tension in the span's own sense."""
    r = stage.pulley_radius
    phi1, w1, x, v, phi3, w3 = y[:6]
    #   f₁ = k₁ (r φ₁ − x) + c₁ (r w₁ − v)
    #   f₂ = k₂ (x − r φ₃) + c₂ (v − r w₃)
    #   f₃ = k₃ (r φ₃ − r φ₁) + c₃ (r w₃ − r w₁)
    f1 = stage.k1 * (r * phi1 - x) + stage.c1 * (r * w1 - v)
    f2 = stage.k2 * (x - r * phi3) + stage.c2 * (v - r * w3)
    f3 = stage.k3 * (r * phi3 - r * phi1) + stage.c3 * (r * w3 - r * w1)
    return f1, f2, f3


def current(stage, y, u):
    """Armature current: commanded, algebraic (L = 0), or a state."""
    if stage.amplifier_mode == "current":
        return stage.amplifier_gain * u
    if stage.inductance > 0.0:
        return y[I]
    #   i = (u_a − K_e n w₁) / R
    return (stage.amplifier_gain * u - stage.back_emf_constant * stage.gear_ratio * y[W1]) / stage.resistance


def gear_torque(stage, y, u, mode, driving):
    """T = K_t i − J_r n φ̈₁ at the motor's shaft, while the drive pulley slides."""
    n, j1, jr = stage.gear_ratio, stage.drive_inertia, stage.rotor_inertia
    f1, _, f3 = spans(stage, y)
    b, c = stage.drive_friction.sliding(mode)
    rest = stage.pulley_radius * (f3 - f1) - b * y[W1] - c
    #   (J₁ + e n² J_r) φ̈₁ = rest + n e K_t i   ⇒   T = (J₁ K_t i − n J_r rest) / (J₁ + e n² J_r)
    e = gear_factor(stage, driving)
    return (j1 * stage.torque_constant * current(stage, y, u) - n * jr * rest) / (j1 + e * n * n * jr)


def loads(stage, y, u):
    """For each inertia the pair of loads (on a forward move, on a backward move): every force but its own friction.

    They differ only for the drive pulley behind a lossy gear.
    """
    r, n, eta = stage.pulley_radius, stage.gear_ratio, stage.gear_efficiency
    f1, f2, f3 = spans(stage, y)
    motor = stage.torque_constant * current(stage, y, u)
    belt = -r * f1 + r * f3
    #   forward  n min(η K_t i, K_t i / η) ;  backward  n max(…)
    drive = belt + n * min(eta * motor, motor / eta), belt + n * max(eta * motor, motor / eta)
    cart, idler = f1 - f2, r * f2 - r * f3
    return {1: drive, 2: (cart, cart), 3: (idler, idler)}


def derivative(stage, y, u, modes, driving):
    """ẏ in given modes."""
    r, n = stage.pulley_radius, stage.gear_ratio
    f1, f2, f3 = spans(stage, y)
    i = current(stage, y, u)
    e = gear_factor(stage, driving)
    a1 = a2 = a3 = 0.0
    #   (J₁ + e n² J_r) φ̈₁ = −r f₁ + r f₃ − τ_f1 + n e K_t i
    if modes[1] != STUCK:
        b, c = stage.drive_friction.sliding(modes[1])
        inertia = stage.drive_inertia + e * n * n * stage.rotor_inertia
        a1 = (-r * f1 + r * f3 - b * y[W1] - c + n * e * stage.torque_constant * i) / inertia
    #   M ẍ = f₁ − f₂ − F_f
    if modes[2] != STUCK:
        b, c = stage.cart_friction.sliding(modes[2])
        a2 = (f1 - f2 - b * y[V] - c) / stage.cart_mass
    #   J₂ φ̈₃ = r f₂ − r f₃ − τ_f2
    if modes[3] != STUCK:
        b, c = stage.idler_friction.sliding(modes[3])
        a3 = (r * f2 - r * f3 - b * y[W3] - c) / stage.idler_inertia
    #   L di/dt = u_a − R i − K_e n w₁
    di = 0.0
    if stage.current_is_state:
        di = (stage.amplifier_gain * u - stage.resistance * i - stage.back_emf_constant * n * y[W1]) / stage.inductance
    return [y[W1], a1, y[V], a2, y[W3], a3, di]


def at_rest(friction, forward_load, backward_load):
    """What an inertia at zero speed does under its loads: (mode, load that decided or nearest to deciding, margin)."""
    beyond_forward = forward_load - friction.breakaway_forward
    beyond_backward = -backward_load - friction.breakaway_backward
    scale = max(friction.breakaway_forward, friction.breakaway_backward, 1e-30)
    margin = float(min(abs(beyond_forward), abs(beyond_backward)) / scale)
    if beyond_forward > 0:
        return FORWARD, forward_load, margin
    if beyond_backward > 0:
        return BACKWARD, backward_load, margin
    return STUCK, None, margin


@dataclass(frozen=True)
class Event:
    """A change of mode. `load` is every force but friction, on the side it leaves to or, if it sticks, came from."""

    time: float
    body: int
    before: int
    after: int
    load: float


@dataclass
class Run:
    """What a solver returns: states (rows φ₁ w₁ x v φ₃ w₃ i) and modes at the times asked for, and the events."""

    times: np.ndarray
    states: np.ndarray
    modes: np.ndarray
    events: list[Event]
    doubts: list[str]
