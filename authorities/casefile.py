"""A case file's text as plain numbers, read without taut: one stage, one experiment, SI numbers only.

Only what the authorities write themselves is understood: no units, no geometry of pulleys, no composite belts.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass, field

GRAVITY = 9.80665


@dataclass
class Law:
    """Friction of one body. kind: plain, stribeck, smooth or lugre."""

    viscous: dict = field(default_factory=lambda: {1: 0.0, -1: 0.0})  # by direction
    coulomb: dict = field(default_factory=lambda: {1: 0.0, -1: 0.0})
    static: dict = field(default_factory=lambda: {1: 0.0, -1: 0.0})
    kind: str = "plain"
    force: float = 0.0  # Stribeck
    decay: float = 0.0  # of exp(−decay v²)
    velocity: float = 0.0
    shape: str = "gaussian"
    stiffness: float = 0.0  # LuGre
    damping: float = 0.0
    along: list = field(default_factory=list)

    @property
    def dry(self):
        """Whether the body sticks and slips."""
        if self.kind in ("smooth", "lugre"):
            return False
        return any(self.coulomb.values()) or any(self.static.values()) or self.viscous[1] != self.viscous[-1]

    def factor(self, segment):
        """(a, b) of the factor a + b x on Coulomb, static and Stribeck force; segment s ends at point s."""
        points = self.along
        if not points:
            return 1.0, 0.0
        if segment in (0, len(points)):
            return points[min(segment, len(points) - 1)][1], 0.0
        (x0, f0), (x1, f1) = points[segment - 1], points[segment]
        slope = (f1 - f0) / (x1 - x0)
        return f0 - slope * x0, slope

    def breakaway(self, side, x=0.0):
        a, b = self.factor(sum(float(x) >= point[0] for point in self.along))
        return (self.static[side] + self.force) * (a + b * float(x))


def law(table):
    """The friction of one body."""
    get = table.get
    viscous, coulomb = get("viscous", 0.0), get("coulomb", 0.0)
    coulomb_back = get("coulomb_backward", coulomb)
    found = Law(
        viscous={1: viscous, -1: get("viscous_backward", viscous)},
        coulomb={1: coulomb, -1: coulomb_back},
        static={1: get("static", coulomb), -1: get("static_backward", get("static", coulomb_back))},
        along=get("along", []),
    )
    if "stribeck" in table:
        curve = table["stribeck"]
        found.kind, found.force, found.shape = "stribeck", curve["force"], curve.get("shape", "gaussian")
        found.velocity = curve.get("velocity", 0.0)
        found.decay = curve["decay"] if "decay" in curve else 1 / found.velocity**2
    elif "smooth" in table:
        found.kind, found.velocity = "smooth", table["smooth"]["breakaway_velocity"]
    elif "lugre" in table:
        bristle = table["lugre"]
        found.kind = "lugre"
        found.stiffness, found.damping, found.velocity = bristle["stiffness"], bristle["damping"], bristle["velocity"]
    return found


def added(laws, scales):
    """The sum of plain laws, each reflected: force / scale at speed · scale."""
    total = Law()
    for one, scale in zip(laws, scales):
        assert one.kind == "plain" and not one.along
        for side in (1, -1):
            total.viscous[side] += one.viscous[side] / scale**2
            total.coulomb[side] += one.coulomb[side] / scale
            total.static[side] += one.static[side] / scale
    return total


class Case:
    """The parameters by name, as the equations use them."""

    def __init__(self, text):
        file = tomllib.loads(text)
        motor, amplifier, belt, cart = file["motor"], file.get("amplifier", {}), file["belt"], file["cart"]
        drive, idler, travel = file["drive_pulley"], file["idler_pulley"], file.get("travel", {})
        (experiment,) = file["experiment"]

        self.kt, self.ke, self.R = motor["torque_constant"], motor["back_emf_constant"], motor["resistance"]
        self.L, self.n = motor.get("inductance", 0.0), motor.get("gear_ratio", 1.0)
        rotor = motor.get("rotor_inertia", 0.0) * self.n**2
        self.backlash = "backlash" in motor
        self.play = motor.get("backlash", 0.0) / 2  # α
        self.kg, self.cg = motor.get("gear_stiffness", 0.0), motor.get("gear_damping", 0.0)
        self.rotor = rotor if self.backlash else 0.0

        self.commands = amplifier.get("mode", "voltage")
        self.gain = amplifier.get("gain", 1.0)
        self.V, self.I = amplifier.get("voltage_limit"), amplifier.get("current_limit")
        self.wb = 2 * math.pi * amplifier["bandwidth"] if "bandwidth" in amplifier else None
        self.current_is_state = self.wb is not None or (self.commands == "voltage" and self.L > 0)

        self.r = drive["radius"]
        self.model = belt.get("model", "elastic")
        self.c = belt.get("damping", [0.0, 0.0, 0.0])
        self.follows = belt.get("follows_cart", False)
        if "stiffness" in belt:
            self.k = belt["stiffness"]
        else:
            self.EA, self.l = belt["modulus"] * belt["section"], belt["spans"]
            self.k = [self.EA / length for length in self.l]
        self.T0 = belt.get("pretension")

        mass = cart["mass"]
        #   load along x:  F − M g sin(inclination)
        self.load = cart.get("load", 0.0) - mass * GRAVITY * math.sin(cart.get("inclination", 0.0))
        self.stops = "stop_stiffness" in travel
        if self.stops:
            self.low, self.high = travel["min"], travel["max"]
            self.ks, self.cs = travel["stop_stiffness"], travel.get("stop_damping", 0.0)

        j1, j2 = drive["inertia"] + (0.0 if self.backlash else rotor), idler["inertia"]
        laws = [law(body.get("friction", {})) for body in (drive, cart, idler)]
        # Bodies of the model: number → (inertia, friction)
        if self.model == "elastic":
            self.bodies = {1: (j1, laws[0]), 2: (mass, laws[1]), 3: (j2, laws[2])}
        elif self.model == "two-mass":
            self.bodies = {1: (j1 + j2, added([laws[0], laws[2]], [1, 1])), 2: (mass, laws[1])}
        else:
            r = self.r
            bare = not (drive.get("friction") or idler.get("friction"))
            self.bodies = {2: (mass + (j1 + j2) / r**2, laws[1] if bare else added(laws, [r, 1, r]))}

        self.until, self.every = experiment["until"], experiment["every"]
        self.signal = signal(experiment["input"])
        start = experiment.get("initial", {})
        names = ("drive_angle", "drive_speed", "cart_position", "cart_speed", "idler_angle", "idler_speed")
        self.initial = [start.get(name, 0.0) for name in names]
        self.times = [k * self.every for k in range(round(self.until / self.every) + 1)]

    def fastest(self):
        """rad/s; about as fast as anything here moves by itself (friction at small speeds apart)."""
        r, k1, k2, k3 = self.r, *self.k
        c1, c2, c3 = self.c
        j1 = self.bodies[1][0] if 1 in self.bodies else 1e9
        j2 = self.bodies[3][0] if 3 in self.bodies else 1e9
        m = self.bodies[2][0]
        pairs = [
            ((k1 + k3) * r * r + self.kg, (c1 + c3) * r * r + self.cg, j1),
            (k1 + k2 + (self.ks if self.stops else 0), c1 + c2 + (self.cs if self.stops else 0), m),
            ((k2 + k3) * r * r, (c2 + c3) * r * r, j2),
        ]
        if self.model == "rigid":
            pairs = [(self.ks if self.stops else self.kg / r**2, self.cg / r**2, m)]
        if self.backlash:
            pairs.append((self.kg, self.cg, self.rotor))
        rates = [math.sqrt(2 * k / m) for k, _, m in pairs] + [2 * c / m for _, c, m in pairs]
        if self.current_is_state and self.L > 0:
            rates.append(self.R / self.L)
        if self.wb:
            rates.append(self.wb)
        if not self.current_is_state and self.commands == "voltage":
            rates.append(self.kt * self.ke * self.n**2 / self.R / (self.rotor if self.backlash else j1))
        for inertia, friction in self.bodies.values():
            rates += [math.sqrt(friction.stiffness / inertia), friction.damping / inertia]
        return max(1.0, *rates)


def signal(table):
    """The input as `model.pieces` wants it."""
    if "pulse" in table:
        return {"kind": "pulse", "value": table["pulse"], "duration": table["for"], "at": table.get("at", 0.0)}
    if "step" in table:
        return {"kind": "step", "value": table["step"], "at": table.get("at", 0.0)}
    if "ramp" in table:
        return {"kind": "ramp", "value": table["ramp"], "over": table["over"], "at": table.get("at", 0.0)}
    if "triangle" in table:
        return {"kind": "triangle", "amplitude": table["triangle"], "frequency": table["frequency"]}
    if "square" in table:
        return {
            "kind": "square",
            "amplitude": table["square"],
            "frequency": table["frequency"],
            "duty": table.get("duty", 0.5),
        }
    if "sine" in table:
        return {
            "kind": "sine",
            "amplitude": table["sine"],
            "frequency": table["frequency"],
            "phase": table.get("phase", 0.0),
            "offset": table.get("offset", 0.0),
        }
    return {"kind": "table", "points": table["table"]}


# --- the other way ----------------------------------------------------------------------------------------------------


def toml(tables):
    """The text of a case: {section: {key: value}}; a section whose value is a list is an array of tables."""

    def value(item):
        if isinstance(item, bool):
            return "true" if item else "false"
        if isinstance(item, str):
            return f'"{item}"'
        if isinstance(item, dict):
            return "{ " + ", ".join(f"{k} = {value(v)}" for k, v in item.items()) + " }"
        if isinstance(item, (list, tuple)):
            return "[" + ", ".join(value(v) for v in item) + "]"
        return repr(item) if isinstance(item, int) else repr(float(item))

    lines = []
    for name, table in tables.items():
        if isinstance(table, str):
            lines.append(f"{name} = {value(table)}")
            continue
        lines.append(f"[[{name}]]" if isinstance(table, list) else f"[{name}]")
        lines += [f"{k} = {value(v)}" for k, v in (table[0] if isinstance(table, list) else table).items()]
    return "\n".join(lines) + "\n"
