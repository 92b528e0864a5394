"""Model exchange of FMUs: CVODE, by way of FMPy, against ``taut simulate``, over random machines of every structure."""

from __future__ import annotations

import csv
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest

fmpy = pytest.importorskip("fmpy")
from fmpy import simulate_fmu  # noqa: E402
from test_fmu import NEAR, PROGRAM, export, taut  # noqa: E402

pytestmark = pytest.mark.skipif(PROGRAM is None, reason="TAUT_PROGRAM does not name the program")

#: How long each machine is pushed, s; steps of the output.
UNTIL, EVERY = 0.2, 1e-3

#: A kind of machine, and what works piece by piece in it, or along a curve.
MACHINES = [
    ("axis", {"stops"}),
    ("axis", {"stops", "stribeck"}),
    ("axis", {"current limit"}),
    ("axis", {"current limit", "inductance", "voltage limit"}),
    ("axis", {"gear"}),
    ("axis", {"gear", "backlash", "slack"}),
    ("axis", {"slack", "load"}),
    ("axis", {"lugre"}),
    ("axis", {"lugre", "stops", "follows"}),
    ("h-frame", {"current limit"}),
    ("h-frame", {"lugre", "slack"}),
    ("core-xy", {"voltage limit", "follows"}),
]


def friction(r: random.Random, level: float, law: str) -> str:
    """Friction of a body along the belt or around its axle; ``level`` in N or N m."""
    turning = level < 0.1
    coulomb = level * r.uniform(0.5, 1.5)
    lever = 0.02 if turning else 1.0
    # b v at 0.5 m/s is as large as the rest.
    words = f"viscous = {2 * coulomb / (0.5 / lever)}, coulomb = {coulomb}"
    rise = coulomb * r.uniform(0.1, 0.6)
    velocity = r.uniform(0.005, 0.05) / lever
    if law == "lugre":
        stiffness = coulomb / r.uniform(2e-6, 2e-5) * lever
        words += f", static = {coulomb + rise}, lugre = {{ stiffness = {stiffness}, "
        words += f"damping = {0.3 * stiffness**0.5}, velocity = {velocity} }}"
    elif law == "stribeck":
        words += f", stribeck = {{ force = {rise}, velocity = {velocity} }}"
    else:
        words += f", static = {coulomb + r.choice([0.0, rise])}"
    return f"{{ {words} }}"


def case(r: random.Random, kind: str, parts: set[str]) -> tuple[str, list[list[tuple[float, float]]]]:
    """A case, and the levels of each command with how long they are held."""
    size = r.uniform(3.0, 8.0)
    law = next((law for law in ("lugre", "stribeck") if law in parts), "coulomb")
    text = f'title = "drawn"\nkind = "{kind}"\n' if kind != "axis" else 'title = "drawn"\n'
    text += f"[motor]\ntorque_constant = {r.uniform(0.02, 0.06)}\nback_emf_constant = {r.uniform(0.02, 0.06)}\n"
    text += f"resistance = {r.uniform(0.5, 1.5)}\nrotor_inertia = {r.uniform(2e-6, 2e-5)}\n"
    if "inductance" in parts:
        text += f"inductance = {r.uniform(3e-4, 3e-3)}\n"
    if "gear" in parts:
        text += f"gear_ratio = {r.uniform(1, 3)}\ngear_stiffness = {r.uniform(20, 100)}\n"
        text += f"gear_damping = {r.uniform(0.002, 0.02)}\n"
    if "backlash" in parts:
        text += f"backlash = {r.uniform(0.002, 0.02)}\n"
    text += "[amplifier]\n"
    if "current limit" in parts:
        text += f"current_limit = {size * r.uniform(0.3, 0.9)}\n"
    if "voltage limit" in parts:
        text += f"voltage_limit = {size * r.uniform(0.4, 0.9)}\n"
    text += f"[drive_pulley]\nradius = {r.uniform(0.01, 0.025)}\ninertia = {r.uniform(2e-5, 1e-4)}\n"
    text += f"friction = {friction(r, 0.02, 'coulomb')}\n"
    if kind == "axis":
        text += f"[idler_pulley]\ninertia = {r.uniform(2e-5, 1e-4)}\nfriction = {friction(r, 0.01, law)}\n"
    else:
        text += f"[bridge]\nmass = {r.uniform(0.5, 1.5)}\nfriction = {friction(r, 0.5, law)}\n"
        text += "travel = { min = -0.5, max = 0.5 }\n"
    text += f"[cart]\nmass = {r.uniform(0.2, 1)}\nfriction = {friction(r, 0.4, law)}\n"
    text += "travel = { min = -0.5, max = 0.5 }\n" if kind != "axis" else ""
    text += f"load = {r.uniform(-1, 1)}\n" if "load" in parts else ""
    spans = {"axis": [0.3, 0.4, 0.6], "core-xy": [1.6, 1.4, 1.6, 1.4], "h-frame": [0.0] * 3}[kind]
    text += "[belt]\n"
    if "follows" in parts or kind == "core-xy":
        text += f"modulus = 8e9\nsection = 6e-6\nspans = {spans}\nfollows_cart = {str('follows' in parts).lower()}\n"
    else:
        text += f"stiffness = {[r.uniform(2e4, 1e5) for _ in spans]}\n"
    text += f"damping = {[r.uniform(10, 60) for _ in spans]}\n"
    text += f"pretension = {r.uniform(3, 15)}\n" if "slack" in parts else ""
    if "stops" in parts:
        text += f"[travel]\nmin = {-r.uniform(4e-3, 2e-2)}\nmax = {r.uniform(4e-3, 2e-2)}\n"
        text += f"stop_stiffness = {r.uniform(5e3, 1e5)}\nstop_damping = {r.choice([0.0, r.uniform(5, 50)])}\n"
    held = [round(r.uniform(0.02, 0.06), 4) for _ in range(3)]
    names = ["command"] if kind == "axis" else ["left_command", "right_command"]
    levels = [[(size * r.uniform(0.3, 1) * (-1) ** k, time) for k, time in enumerate(held)] for _ in names]
    inputs = [
        "{ sequence = [" + ", ".join(f"{{ pulse = {value}, for = {time} }}" for value, time in one) + "] }"
        for one in levels
    ]
    both = inputs[0] if kind == "axis" else f"{{ left = {inputs[0]}, right = {inputs[1]} }}"
    text += f'[[experiment]]\nname = "e"\ninput = {both}\nuntil = {UNTIL}\nevery = {EVERY}\n'
    return text, levels


def table(levels: list[list[tuple[float, float]]]) -> np.ndarray[Any, Any]:
    """The commands as an importer takes them: held, with jumps."""
    names = ["command"] if len(levels) == 1 else ["left_command", "right_command"]
    times = [0.0, *np.cumsum([time for _, time in levels[0]]), UNTIL + 1.0]
    points = []
    for k, (begin, end) in enumerate(zip(times, times[1:])):
        values = [one[k][0] if k < len(one) else 0.0 for one in levels]
        points += [(begin, *values), (end, *values)]
    return np.array(points, dtype=[("time", np.float64)] + [(name, np.float64) for name in names])


@pytest.mark.parametrize(("kind", "parts"), MACHINES, ids=lambda word: word if isinstance(word, str) else "-".join(sorted(word)))
def test_a_stranger_integrates_any_machine(tmp_path: Path, kind: str, parts: set[str]) -> None:
    """Ten of twelve axes with end stops or limits were off by up to 0.2 mm, and all machines with bristles by 27 mm."""
    moved = 0.0
    for seed in range(2):
        r = random.Random(f"{kind} {sorted(parts)} {seed}")
        text, levels = case(r, kind, parts)
        path = tmp_path / f"{seed}.toml"
        path.write_text(text)
        folder = tmp_path / str(seed)
        taut("simulate", str(path), "--out", str(folder), "--no-report")
        with (folder / "e.csv").open() as file:
            wanted = list(csv.DictReader(file))
        version = 2 + seed
        unit = export(path, tmp_path / f"{seed}.fmu", version)
        names = ["cart_position"] if kind == "axis" else ["cart_position", "bridge_position"]
        result = simulate_fmu(
            unit,
            fmi_type="ModelExchange",
            solver="CVode",
            stop_time=UNTIL,
            relative_tolerance=1e-9,
            # CVODE takes no more than 500 steps from one output to the next.
            output_interval=EVERY / 4,
            input=table(levels),
            output=names,
            record_events=False,
        )
        for name in names:
            ways = np.array([float(row[f"{name}_m"]) for row in wanted])
            off = np.max(np.abs(result[name][::4] - ways))
            assert off <= NEAR, f"{name}, FMI {version}, {off} m\n{text}"
            moved = max(moved, float(np.max(np.abs(ways))))
    assert moved > 1e-4, "nothing moves"
