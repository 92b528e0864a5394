"""The case file of an H-frame or a CoreXY as plain numbers, read without taut: one experiment, SI numbers only.

Bodies are left, right, bridge, cart; drives are 0, left, and 1, right (of CoreXY A and B).
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass

from casefile import law, signal
from model import pieces

BODIES = ("left", "right", "bridge", "cart")
WORD = {1: "forward", -1: "backward", 0: "stuck"}
STUCK = 0


@dataclass
class Run:
    """Rows (angle and speed of left and right, position and speed of bridge and cart) and events (time, body, from,
    to)."""

    rows: list
    events: list
    doubts: list


@dataclass
class Drive:
    """Motor and pulley of one side, everything at the pulley's shaft but the armature."""

    inertia: float
    kt: float
    ke: float
    R: float
    L: float
    n: float


class Gantry:
    """The parameters by name, as the equations use them."""

    def __init__(self, text):
        file = tomllib.loads(text)
        self.kind = file["kind"]
        pulley, belt = file["drive_pulley"], file["belt"]
        self.r, self.k = pulley["radius"], belt["stiffness"]
        self.c = belt.get("damping", [0.0] * len(self.k))
        self.drives, self.drives_as_given = [], []
        for side in ("left_drive", "right_drive"):
            motor = file.get("motor", {}) | file.get(side, {}).get("motor", {})
            n = motor.get("gear_ratio", 1.0)
            self.drives_as_given.append((pulley["inertia"], motor.get("rotor_inertia", 0.0), n))
            self.drives.append(
                Drive(
                    pulley["inertia"] + n**2 * motor.get("rotor_inertia", 0.0),
                    motor["torque_constant"],
                    motor["back_emf_constant"],
                    motor["resistance"],
                    motor.get("inductance", 0.0),
                    n,
                )
            )
        self.m_bridge, self.m_cart = file["bridge"]["mass"], file["cart"]["mass"]
        friction = [part.get("friction", {}) for part in (pulley, pulley, file["bridge"], file["cart"])]
        self.laws = [law(table) for table in friction]
        (experiment,) = file["experiment"]
        self.until, self.every = experiment["until"], experiment["every"]
        self.chains = [pieces(signal(experiment["input"][side]), self.until) for side in ("left", "right")]
        self.edges = sorted({piece.start for chain in self.chains for piece in chain})


def margins(law, load):
    """By how much the load exceeds breakaway forward and backward."""
    return load - law.static[1], -load - law.static[-1]
