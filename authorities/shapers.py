"""Input shapers, Welch's densities and the modes of stages, by other ways than taut's; writes
tests/authorities/shapers.json.

Vibration: each shaper's impulses, from its definition as an equation that is solved here, drive an oscillator that
SciPy's DOP853 integrates. Densities: scipy.signal.welch. Modes: scipy.linalg.eigh of stages written out here, and
beside them the eigenvalues of the damped system, which show what the rule for light damping leaves out.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import eig, eigh
from scipy.signal import welch

OUTPUT = Path(__file__).resolve().parent.parent / "tests/authorities/shapers.json"
TOLERANCE = 0.05
SPACING = {"zv": 0.5, "mzv": 0.375, "zvd": 0.5, "ei": 0.5, "2hump_ei": 0.5, "3hump_ei": 0.5}


def undamped(name):
    """Amplitudes by the property that defines the shaper, not by its published formula."""
    if name in ("zv", "zvd", "mzv"):
        # Σ A z^k with its zeros where the mode stands: z = e^{±iπ·2·spacing}, for zvd twice.
        angle = 2 * np.pi * SPACING[name]
        roots = {"zv": [-1], "zvd": [-1, -1], "mzv": [np.exp(1j * angle), np.exp(-1j * angle)]}[name]
        a = np.real(np.poly(roots))
        return a / a.sum()
    # Humps of equal height: the zeros of Chebyshev's polynomial T_n(β cos(πx/2)).
    n = {"ei": 2, "2hump_ei": 3, "3hump_ei": 4}[name]
    beta = np.cosh(np.arccosh(1 / TOLERANCE) / n)
    half = np.arccos(np.cos((2 * np.arange(n) + 1) * np.pi / (2 * n)) / beta)  # πx/2 of each zero
    a = np.real(np.poly(np.exp(2j * half)))
    return a / a.sum()


def impulses(name, f, zeta):
    a = undamped(name)
    t = np.arange(len(a)) * SPACING[name] / (f * np.sqrt(1 - zeta**2))
    a = a * np.exp(-2 * np.pi * f * zeta * t)
    return t, a / a.sum()


def vibration(times, amplitudes, f, zeta):
    """Amplitude left of an oscillator that is hit by the impulses, of that left by one hit at the last time."""
    w = 2 * np.pi * f
    state, now = np.zeros(2), 0.0
    for t, a in zip(times, amplitudes):
        if t > now:
            run = solve_ivp(
                lambda _, y: [y[1], -2 * zeta * w * y[1] - w * w * y[0]],
                (now, t), state, method="DOP853", rtol=1e-12, atol=1e-14, max_step=0.05 / f,
            )
            state = run.y[:, -1]
        state, now = state + [0.0, a], t
    wd = w * np.sqrt(1 - zeta**2)
    return float(np.hypot(state[0] * wd, state[1] + zeta * w * state[0]))


def stages(random):
    """Case files in SI, and their matrices."""
    for number in range(6):
        value = lambda low, high: float(np.exp(random.uniform(np.log(low), np.log(high))))
        r, n = value(5e-3, 30e-3), value(1, 6)
        j1, j3, jr, mass = value(1e-6, 1e-4), value(1e-6, 1e-4), value(1e-7, 1e-5), value(0.1, 3)
        kt, ke, res = value(0.02, 0.1), value(0.02, 0.1), value(0.5, 3)
        b1, b2, b3 = value(1e-5, 1e-3), value(0.1, 5), value(1e-5, 1e-3)
        c = [value(0.5, 5) for _ in range(3)]
        follows = number % 2 == 1
        modulus, section, spans = value(2e9, 2e10), value(3e-6, 2e-5), [value(0.3, 0.5), value(0.3, 0.5), value(0.5, 1.0)]
        ea = modulus * section
        places = np.linspace(-0.1, 0.1, 21) if follows else [0.0]
        toml = f"""title = "stage {number}"
[motor]
torque_constant = {kt}
back_emf_constant = {ke}
resistance = {res}
rotor_inertia = {jr}
gear_ratio = {n}
[drive_pulley]
radius = {r}
inertia = {j1}
friction = {{ viscous = {b1} }}
[idler_pulley]
inertia = {j3}
friction = {{ viscous = {b3} }}
[cart]
mass = {mass}
friction = {{ viscous = {b2} }}
[belt]
modulus = {modulus}
section = {section}
spans = {spans}
damping = {c}
"""
        if follows:
            toml += "follows_cart = true\n[travel]\nmin = -0.1\nmax = 0.1\n"
        toml += '[[experiment]]\nname = "run"\ninput = { step = 1 }\nuntil = 1\nevery = 0.01\n'
        for drive in ("held", "free"):
            modes = []
            for x in places:
                k = [ea / (spans[0] - x), ea / (spans[1] + x), ea / spans[2]]
                d = np.array([[r, -1, 0], [0, 1, -r], [-r, 0, r]])
                stiff, damp = d.T @ np.diag(k) @ d, d.T @ np.diag(c) @ d + np.diag([b1, b2, b3])
                inertia = np.diag([j1 + n * n * jr, mass, j3])
                if drive == "free":
                    damp[0, 0] += n * n * kt * ke / res
                else:
                    stiff, damp, inertia = stiff[1:, 1:], damp[1:, 1:], inertia[1:, 1:]
                squared, shapes = eigh(stiff, inertia)
                size = len(squared)
                a = np.block([[np.zeros((size, size)), np.eye(size)], [-np.linalg.solve(inertia, stiff), -np.linalg.solve(inertia, damp)]])
                exact = eig(a)[0]
                for w2, shape in zip(squared, shapes.T):
                    if w2 < 1e-9 * squared.max():
                        continue
                    w = np.sqrt(w2)
                    zeta = shape @ damp @ shape / (2 * w)
                    near = exact[np.argmin(abs(abs(exact) - w) + 1e9 * (exact.imag <= 0))]
                    print(f"  {number} {drive} x = {x:+.2f} m: {w / 2 / np.pi:9.3f} Hz, ζ {zeta:.5f};"
                          f" damped system {abs(near) / 2 / np.pi:9.3f} Hz, ζ {-near.real / abs(near):.5f}")
                    if zeta < 1 and x in (places[0], places[-1]):
                        modes.append({"frequency": w / 2 / np.pi, "damping": zeta})
            yield {"toml": toml, "drive": drive, "modes": modes}


def main():
    random = np.random.default_rng(5)
    found = []
    for name in SPACING:
        for _ in range(12):
            f, zeta = random.uniform(20, 120), random.uniform(0, 0.3)
            mode_f, mode_zeta = f * random.uniform(0.4, 1.8), random.uniform(0, 0.3)
            v = vibration(*impulses(name, f, zeta), mode_f, mode_zeta)
            found.append({"shaper": name, "frequency": f, "damping": zeta, "mode_frequency": mode_f,
                          "mode_damping": mode_zeta, "vibration": v})
        at = vibration(*impulses(name, 50, 0.1), 50, 0.1)
        print(f"{name:9} amplitudes {np.array2string(undamped(name), precision=12)}, at its own mode with ζ = 0.1: {at:.2e}")
    samples = np.round(random.normal(size=400) + 3 * np.sin(np.arange(400)), 6)
    rate = 800.0
    _, density = welch(samples, rate, window=np.kaiser(64, 6.0), noverlap=32, detrend="constant")
    print("modes by the rule for light damping, and of the damped system:")
    data = {
        "made_by": "authorities/shapers.py",
        "vibration": found,
        "rate": rate,
        "samples": samples.tolist(),
        "density": density.tolist(),
        "resonances": list(stages(random)),
    }
    OUTPUT.write_text(json.dumps(data, indent=1) + "\n")


if __name__ == "__main__":
    main()
