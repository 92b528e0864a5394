"""Peaks of |S| and |T| of 200 random sampled loops on 400,000 frequencies each, whether they are stable, and their gain
margins.

The axis is written here from eq. (1)-(4) and (16)-(18); its input is held and late, by scipy's matrix exponential.
Controllers are written as their difference equations in z (PID, and a cascade of P and PI), with notch and low-pass by
Tustin's rule. Stability is that of the eigenvalues of the closed loop, put together by python-control (`feedback`),
whose responses are compared with the ones used here on 300 frequencies of each loop. About each of the tops the grid is
refined four times. Nothing of taut is used.

Writes ../tests/authorities/margins.json and output/margins.txt.
"""

import json
import math
import os
import random
import warnings

import control
import numpy as np
import scipy.linalg

HERE = os.path.dirname(os.path.abspath(__file__))
COUNT = 200
POINTS = 400_000


def draw(rng):
    def decades(low, high):
        return math.exp(rng.uniform(math.log(low), math.log(high)))

    kt = decades(0.01, 0.1)
    p = {
        "kt": kt, "resistance": decades(0.3, 3.0), "radius": decades(0.008, 0.03),
        "j1": decades(2e-5, 3e-4), "j2": decades(1e-5, 3e-4), "mass": decades(0.1, 3.0),
        "b1": decades(1e-4, 3e-3), "b2": decades(1e-4, 3e-3), "b": decades(0.5, 30.0),
        "k": [decades(1e4, 5e5) for _ in range(3)],
        "c": [decades(0.02, 30.0) if rng.random() < 0.5 else 0.0 for _ in range(3)],
        "cart": rng.random() < 0.25, "every": rng.choice([1e-3, 1e-3, 5e-4, 2e-3]),
    }
    p["delay"] = rng.choice([0.0, 0.5, 1.0, rng.uniform(0.0, 1.9)]) * p["every"]
    mass = p["mass"] + (p["j1"] + p["j2"]) / p["radius"] ** 2
    push = p["kt"] / (p["resistance"] * p["radius"])
    drag = p["b"] + (p["b1"] + p["b2"]) / p["radius"] ** 2 + p["kt"] * push / p["radius"]
    w = 2 * math.pi * decades(0.8, 16.0) * (1e-3 / p["every"]) ** 0.5
    zeta = rng.uniform(0.5, 1.2)
    filters = []
    if rng.random() < 0.4:
        filters.append(("notch", decades(30, 300), rng.uniform(0.02, 0.3), rng.uniform(0.3, 1.0)))
    if rng.random() < 0.3:
        filters.append(("low_pass", decades(40, 300), 0.0, rng.uniform(0.5, 1.0)))
    p["filters"] = filters
    corner = decades(50, 400)
    if rng.random() < 0.7:
        real = 0.0 if rng.random() < 0.2 else zeta * w
        p["pid"] = {
            "proportional": mass * (w * w + 2 * zeta * w * real) / push,
            "integral": mass * real * w * w / push,
            "derivative": max(mass * (2 * zeta * w + real) - drag, 0.05 * mass * w) / push,
            "filter": corner,
        }
    else:
        v = 4 * w
        p["cascade"] = {
            "position": w, "speed": max(mass * 2 * zeta * v - drag, 0.1 * mass * v) / push,
            "speed_integral": 0.0 if rng.random() < 0.2 else mass * v * v / push, "filter": corner,
        }
    return p


def text(p):
    lines = [
        "[motor]", f"torque_constant = {p['kt']!r}", f"back_emf_constant = {p['kt']!r}", f"resistance = {p['resistance']!r}",
        "[drive_pulley]", f"radius = {p['radius']!r}", f"inertia = {p['j1']!r}", f"friction = {{ viscous = {p['b1']!r} }}",
        "[idler_pulley]", f"inertia = {p['j2']!r}", f"friction = {{ viscous = {p['b2']!r} }}",
        "[cart]", f"mass = {p['mass']!r}", f"friction = {{ viscous = {p['b']!r} }}",
        "[belt]", f"stiffness = {p['k']!r}", f"damping = {p['c']!r}",
    ]
    if p["cart"]:
        lines += ["[encoder]", 'at = "cart"', "lines = 1e6"]
    lines += ["[controller]", f"every = {p['every']!r}", f"delay = {p['delay']!r}"]
    for name in ("pid", "cascade"):
        if name in p:
            inside = ", ".join(f"{key} = {value!r}" for key, value in p[name].items())
            lines.append(f"{name} = {{ {inside} }}")
    filters = []
    for kind, frequency, depth, damping in p["filters"]:
        more = f"depth = {depth!r}, " if kind == "notch" else ""
        filters.append(f"{{ {kind} = {frequency!r}, {more}damping = {damping!r} }}")
    lines.append(f"filters = [{', '.join(filters)}]")
    return "\n".join(lines) + "\n"


def plant(p):
    """x[k+1] = A x[k] + b u[k], y = c x: φ₁, ω₁, x, v, φ₃, ω₃, and inputs under way."""
    r, (k1, k2, k3), (c1, c2, c3) = p["radius"], p["k"], p["c"]
    # stretches d₁ = r φ₁ − x, d₂ = x − r φ₃, d₃ = r φ₃ − r φ₁
    arms = np.array([[r, -1, 0], [0, 1, -r], [-r, 0, r]])
    inertia = np.diag([p["j1"], p["mass"], p["j2"]])
    stiffness = arms.T @ np.diag([k1, k2, k3]) @ arms
    damping = arms.T @ np.diag([c1, c2, c3]) @ arms + np.diag(
        [p["b1"] + p["kt"] ** 2 / p["resistance"], p["b"], p["b2"]]
    )
    inverse = np.linalg.inv(inertia)
    a = np.block([[np.zeros((3, 3)), np.eye(3)], [-inverse @ stiffness, -inverse @ damping]])
    b = np.concatenate([np.zeros(3), inverse @ [p["kt"] / p["resistance"], 0, 0]])
    c = np.array([0, 1, 0, 0, 0, 0.0]) if p["cart"] else np.array([r, 0, 0, 0, 0, 0.0])

    def held(t):
        whole = np.zeros((7, 7))
        whole[:6, :6], whole[:6, 6] = a, b
        done = scipy.linalg.expm(whole * t)
        return done[:6, :6], done[:6, 6]

    t, delay = p["every"], p["delay"]
    whole = int(math.floor(delay / t + 1e-12))
    rest = max(delay - whole * t, 0.0)
    phi, _ = held(t)
    later, new = held(t - rest)
    _, early = held(rest)
    old = later @ early
    late = whole + (1 if rest > 1e-12 * t else 0)
    n = 6 + late
    big, inp, out = np.zeros((n, n)), np.zeros(n), np.zeros(n)
    big[:6, :6], out[:6] = phi, c

    def put(lag, column):
        if lag == 0:
            inp[:6] += column
        elif lag <= late:
            big[:6, 6 + lag - 1] += column

    put(whole, new)
    if late > whole:
        put(whole + 1, old)
    if late:
        inp[6] = 1.0
        for i in range(1, late):
            big[6 + i, 6 + i - 1] = 1.0
    return big, inp, out


def filters(p):
    """Each as (numerator, denominator) in z."""
    made = []
    for kind, frequency, depth, damping in p["filters"]:
        c = 1 / math.tan(min(math.pi * frequency * p["every"], 0.49 * math.pi))
        n2, n1, n0 = (1.0, 2 * depth, 1.0) if kind == "notch" else (0.0, 0.0, 1.0)
        bilinear = lambda n2, n1, n0: [n2 * c * c + n1 * c + n0, 2 * (n0 - n2 * c * c), n2 * c * c - n1 * c + n0]
        made.append((bilinear(n2, n1, n0), bilinear(1.0, 2 * damping, 1.0)))
    return made


def controller(p):
    """The parts of the controller: a sum of products of (numerator, denominator) in z."""
    t = p["every"]
    if "pid" in p:
        g = p["pid"]
        time = 1 / (2 * math.pi * g["filter"])
        parts = [[([g["proportional"]], [1.0])], [([g["derivative"], -g["derivative"]], [time + t, -time])]]
        if g["integral"]:
            parts.append([([g["integral"] * t, 0.0], [1.0, -1.0])])
        return parts
    g = p["cascade"]
    keep = math.exp(-2 * math.pi * g["filter"] * t)
    # (K_s + K_si T z/(z − 1)) (K_v + (1 − a)/T (z − 1)/(z − a))
    slope = (1 - keep) / t
    outer = ([g["position"] + slope, -g["position"] * keep - slope], [1.0, -keep])
    if not g["speed_integral"]:
        return [[([g["speed"]], [1.0]), outer]]
    return [[([g["speed"] + g["speed_integral"] * t, -g["speed"]], [1.0, -1.0]), outer]]


def evaluate(parts, z):
    total = 0
    for product in parts:
        value = 1
        for numerator, denominator in product:
            value = value * np.polyval(numerator, z) / np.polyval(denominator, z)
        total = total + value
    return total


class Loop:
    def __init__(self, p):
        self.p, self.t = p, p["every"]
        self.a, self.b, self.c = plant(p)
        self.parts = [product + filters(p) for product in controller(p)]
        # G(z) = Σ over the six modes of the axis, times what the delay makes of the input
        self.six = self.a[:6, :6]
        values, vectors = np.linalg.eig(self.six)
        self.values, self.left = values, np.linalg.inv(vectors)
        self.right = self.c[:6] @ vectors

    def open(self, omega):
        z = np.exp(1j * omega * self.t)
        late = len(self.b) - 6
        inputs = [self.b[:6]] + [self.a[:6, 6 + i] for i in range(late)]
        total = np.zeros_like(z)
        for lag, column in enumerate(inputs):
            if not np.any(column):
                continue
            weights = self.right * (self.left @ column)
            total += sum(w / (z - v) for w, v in zip(weights, self.values)) * z ** (-lag)
        return total * evaluate(self.parts, z)

    def control(self):
        """The loop by python-control."""
        system = control.ss(self.a, self.b.reshape(-1, 1), self.c.reshape(1, -1), 0, self.t)
        total = None
        for product in self.parts:
            value = None
            for numerator, denominator in product:
                one = control.ss(control.tf(numerator, denominator, self.t))
                value = one if value is None else value * one
            total = value if total is None else total + value
        return system * total


def refined(loop, value, omega, step):
    """The top about omega, on finer and finer grids."""
    best = (0.0, omega)
    for _ in range(5):
        grid = np.minimum(np.linspace(best[1] * (1 - step), best[1] * (1 + step), 4001), math.pi / loop.t)
        values = value(loop.open(grid))
        k = int(np.argmax(values))
        if values[k] > best[0]:
            best = (float(values[k]), float(grid[k]))
        step /= 500
    return best


def main():
    warnings.filterwarnings("ignore")
    rng = random.Random(15)
    cases, lines, worst = [], [], 0.0
    while len(cases) < COUNT:
        p = draw(rng)
        loop = Loop(p)
        top = math.pi / p["every"]
        omega = np.exp(np.linspace(math.log(1e-5 * top), math.log(top), POINTS))
        omega[-1] = top
        l = loop.open(omega)
        s, t = np.abs(1 / (1 + l)), np.abs(l / (1 + l))
        some = np.exp(np.linspace(math.log(1e-3 * top), math.log(0.99 * top), 300))
        by_control = loop.control()
        theirs = by_control(np.exp(1j * some * p["every"]))
        ours = loop.open(some)
        off = float(np.max(np.abs(theirs - ours) / np.abs(ours)))
        worst = max(worst, off)
        radius = float(np.max(np.abs(control.feedback(by_control, 1).poles())))
        if abs(radius - 1) < 1e-6:
            continue
        stable = bool(radius < 1)
        case = {"case": text(p), "stable": stable, "radius": radius}
        if stable:
            spacing = math.log(1e5) / POINTS
            ks, kt = int(np.argmax(s)), int(np.argmax(t))
            fine_s = refined(loop, lambda l: np.abs(1 / (1 + l)), omega[ks], 2 * spacing)
            fine_t = refined(loop, lambda l: np.abs(l / (1 + l)), omega[kt], 2 * spacing)
            at = np.nonzero((l.imag[:-1] * l.imag[1:] < 0) & (l.real[:-1] < 0) & (l.real[1:] < 0))[0]
            share = l.imag[at] / (l.imag[at] - l.imag[at + 1])
            sizes = -(l.real[at] + share * (l.real[at + 1] - l.real[at]))
            sizes = [float(v) for v in sizes if v < 1] + ([float(-l.real[-1])] if -1 < l.real[-1] < 0 else [])
            case |= {
                "sensitivity": float(s[ks]), "complementary": float(t[kt]), "refined": [fine_s[0], fine_t[0]],
                "at": fine_s[1], "gain": 1 / max(sizes) if sizes else None,
            }
        cases.append(case)
        lines.append(f"{len(cases):3d} radius {radius:.9f} " + (
            f"Ms {case['sensitivity']:.9f} refined {case['refined'][0]:.9f} Mt {case['complementary']:.9f} "
            f"refined {case['refined'][1]:.9f} gain margin {case['gain']}" if stable else "not stable"))
    stable = sum(case["stable"] for case in cases)
    lines.append(f"{stable} of {COUNT} stable; responses differ from those of python-control {control.__version__} by at most {worst:.1e}")
    with open(os.path.join(HERE, "output", "margins.txt"), "w") as file:
        file.write("\n".join(lines) + "\n")
    with open(os.path.join(HERE, "..", "tests", "authorities", "margins.json"), "w") as file:
        file.write('{"format": 1, "cases": [\n' + ",\n".join(json.dumps(case) for case in cases) + "\n]}\n")
    print(lines[-1])


if __name__ == "__main__":
    main()
