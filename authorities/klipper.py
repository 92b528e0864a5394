"""Klipper's calibration of input shapers, written out again with NumPy from the formulae; writes
tests/authorities/klipper.json.

Rule and constants are those of Klipper's `shaper_calibrate.py` and `shaper_defs.py` at commit 034cb673 (2026), whose
source was read; no line of it is here. Everything is evaluated as matrices over (frequency of the shaper, bin of the
spectrum). The spectra are drawn: one to four modes on a frame that is shaken the harder the higher the frequency, with
noise, rounded as Klipper rounds its files.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

OUTPUT = Path(__file__).resolve().parent.parent / "tests/authorities/klipper.json"
LOWEST = {"zv": 21.0, "mzv": 23.0, "ei": 29.0, "2hump_ei": 39.0, "3hump_ei": 48.0}
HIGHEST, STEP = 200.0, 0.2
TOLERANCE = 0.05
TESTED = (0.075, 0.1, 0.15)

# Polynomials in the damping ratio, constant first: times in undamped periods, amplitudes.
HUMPS = {
    "2hump_ei": (
        [[0], [0.49890, 0.16270, -0.54262, 6.16180], [0.99748, 0.18382, -1.58270, 8.17120],
         [1.49920, -0.09297, -0.28338, 1.85710]],
        [[0.16054, 0.76699, 2.26560, -1.22750], [0.33911, 0.45081, -2.58080, 1.73650],
         [0.34089, -0.61533, -0.68765, 0.42261], [0.15997, -0.60246, 1.00280, -0.93145]],
    ),
    "3hump_ei": (
        [[0], [0.49974, 0.23834, 0.44559, 12.4720], [0.99849, 0.29808, -2.36460, 23.3990],
         [1.49870, 0.10306, -2.01390, 17.0320], [1.99960, -0.28231, 0.61536, 5.40450]],
        [[0.11275, 0.76632, 3.29160, -1.44380], [0.23698, 0.61164, -2.57850, 4.85220],
         [0.30008, -0.19062, -2.14560, 0.13744], [0.23775, -0.73297, 0.46885, -2.08650],
         [0.11244, -0.45439, 0.96382, -1.46000]],
    ),
}


def impulses(name, zeta, v=TOLERANCE):
    """Times in undamped periods and amplitudes (sum 1) of a shaper."""
    root = np.sqrt(1 - zeta**2)
    if name in HUMPS:
        times, amplitudes = ([np.polynomial.polynomial.polyval(zeta, c) for c in part] for part in HUMPS[name])
    elif name == "ei":
        first = 0.24968 + 0.24961 * v + (0.80008 + 1.23328 * v) * zeta + (0.49599 + 3.17316 * v) * zeta**2
        last = 0.25149 + 0.21474 * v + (-0.83249 + 1.41498 * v) * zeta + (0.85181 - 4.90094 * v) * zeta**2
        middle = 0.4999 + (0.46159 * v + 8.57843 * v**2) * zeta
        middle += (4.26169 * v - 108.644 * v**2) * zeta**2 + (1.75601 * v + 336.989 * v**2) * zeta**3
        times, amplitudes = [0, middle / root, 1 / root], [first, 1 - first - last, last]
    else:
        # Zeros of Σ A z^k on the unit circle, then A_k e^{−ζωt_k}.
        spacing, zeros = {"zv": (0.5, [-1]), "mzv": (0.375, np.exp([0.75j * np.pi, -0.75j * np.pi]))}[name]
        times = np.arange(len(zeros) + 1) * spacing / root
        amplitudes = np.real(np.poly(zeros)) * np.exp(-2 * np.pi * zeta * times)
    amplitudes = np.array(amplitudes)
    return np.array(times), amplitudes / amplitudes.sum()


def divided(f, p):
    """A density by frequency, with what is below 10 Hz let down."""
    weight = np.where(f < 10, np.exp(1 - (10 / (f + 0.1)) ** 2), 1.0)
    return p / (f + 0.1) * weight


def smoothing(u, a, acceleration, corner):
    """Distances from the corner, mm, at 90 and 180 degrees; the greater of both. u are times from the middle, s."""
    later = np.where(u >= 0, a * (corner + acceleration / 2 * u) * u, 0.0).sum(axis=-1) * np.sqrt(2)
    return np.maximum(later, (a * acceleration / 2 * u**2).sum(axis=-1))


def acceleration(u, a, corner):
    """Greatest acceleration, mm/s², that smooths by 0.12 mm, by halving."""
    low, high = 0.0, 1e9
    if smoothing(u, a, low, corner) > 0.12:
        return 0.0
    for _ in range(100):
        middle = (low + high) / 2
        low, high = (middle, high) if smoothing(u, a, middle, corner) <= 0.12 else (low, middle)
    return low


def table(name, f, p, zeta, corner):
    """Every frequency of a shaper, ascending: frequency, vibration, smoothing, score."""
    grid = np.arange(LOWEST[name], HIGHEST, STEP)
    t, a = impulses(name, zeta)
    times = t[None, :] / grid[:, None]
    u = times - (a * times).sum(axis=1, keepdims=True)
    used = f <= HIGHEST
    f, p = f[used], p[used]
    floor = p.max() / 20
    worst = np.zeros(len(grid))
    for test in TESTED:
        omega = 2 * np.pi * f[None, :, None]
        phase = omega * (-test + 1j * np.sqrt(1 - test**2)) * (times[:, -1, None, None] - times[:, None, :])
        left = np.abs((a * np.exp(phase)).sum(axis=-1))
        worst = np.maximum(worst, np.maximum(left * p - floor, 0).sum(axis=1) / np.maximum(p - floor, 0).sum())
    smooth = smoothing(u, a, 5000.0, corner)
    score = smooth * (worst**1.5 + 0.2 * worst + 0.01)
    return [dict(name=name, frequency=grid[k], vibration=worst[k], smoothing=smooth[k], score=score[k],
                 acceleration=lambda k=k: acceleration(u[k], a, corner)) for k in range(len(grid))]


def fitted(rows, max_smoothing, max_vibrations):
    """The row that is taken, and the rows that were tried."""
    tried = []
    for row in reversed(rows):
        if max_smoothing and row["smoothing"] > max_smoothing and tried:
            return min(tried, key=lambda one: one["vibration"]), tried[::-1]
        tried.append(row)
    best = min(tried, key=lambda one: one["vibration"])
    is_loud = max_vibrations is not None and best["vibration"] > max_vibrations
    taken = best
    for row in rows:
        if row["vibration"] < 1.1 * best["vibration"] + 0.0005 and (is_loud or row["score"] < taken["score"]):
            taken = row
    return taken, rows


def calibrated(f, p, zeta=0.1, corner=5.0, max_smoothing=None, max_vibrations=None):
    """The shapers as they are reported, and the one that is recommended."""
    best, reported = None, []
    for name in LOWEST:
        taken, rows = fitted(table(name, f, p, zeta, corner), max_smoothing, max_vibrations)
        is_better = best is None or 1.2 * taken["score"] < best["score"]
        is_better = is_better or 1.05 * taken["score"] < best["score"] and 1.1 * taken["smoothing"] < best["smoothing"]
        is_quieter = max_vibrations is not None and best is not None
        is_quieter = is_quieter and best["vibration"] > max_vibrations and taken["vibration"] < best["vibration"]
        if is_better or is_quieter:
            best = taken
        for row in rows:
            if row["vibration"] < best["vibration"] and row["smoothing"] < best["smoothing"]:
                best = taken = row
        reported.append(taken)
    if best["name"] == "zv":
        others = [one for one in reported if one["name"] != "zv" and 1.1 * one["vibration"] < best["vibration"]]
        best = (others + [best])[0]
    return reported, best


def drawn(random):
    """A spectrum as its file has it: frequency to 0.1 Hz, density to four digits."""
    f = np.round(np.arange(0, 200, random.choice([0.78125, 1.5625, 1.6])), 1)
    p = random.uniform(0, 3) * f
    for _ in range(random.integers(1, 5)):
        f0, z, height = random.uniform(18, 160), random.uniform(0.015, 0.2), 10 ** random.uniform(2, 4)
        p = p + height * f * f**2 * 4 * z * z * f0**2 / ((f0**2 - f**2) ** 2 + (2 * z * f0 * f) ** 2) / f0
    p = p * np.exp(random.normal(scale=random.uniform(0, 0.4), size=len(f)))
    return f, np.array([float(f"{value:.3e}") for value in p])


def main():
    random = np.random.default_rng(34)
    sets = []
    for number in range(64):
        f, p = drawn(random)
        options = {}
        if number % 4 == 1:
            options["max_smoothing"] = round(random.uniform(0.06, 0.25), 3)
        if number % 4 == 2:
            options["max_vibrations"] = round(random.uniform(0.002, 0.1), 3)
        if number % 4 == 3:
            options["zeta"] = round(random.uniform(0.02, 0.19), 3)
            options["corner"] = round(random.uniform(1, 12), 1)
        reported, best = calibrated(f, divided(f, p), **options)
        printed = [[one["name"], f"{one['frequency']:.1f}", f"{100 * one['vibration']:.1f}",
                    f"{one['smoothing']:.3f}", f"{round(one['acceleration']() / 100) * 100:.0f}"] for one in reported]
        sets.append({"frequency": f.tolist(), "density": p.tolist(), **options, "shapers": printed,
                     "recommended": [best["name"], f"{best['frequency']:.1f}"]})
        print(f"{number:2} {options}: {best['name']} at {best['frequency']:.1f} Hz")
    counts = {name: sum(one["recommended"][0] == name for one in sets) for name in LOWEST}
    print(f"{len(sets)} spectra; recommended: {counts}")
    OUTPUT.write_text(json.dumps({"made_by": "authorities/klipper.py", "sets": sets}, separators=(",", ":")) + "\n")


if __name__ == "__main__":
    main()
