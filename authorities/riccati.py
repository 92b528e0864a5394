"""Riccati equations by SciPy, discrete and continuous; some in units that differ by up to ten powers of ten.

Writes tests/authorities/riccati.json. SciPy solves each in its well-scaled form; the ill-scaled one follows by the
change of units.
"""

import json
from pathlib import Path

import numpy as np
from scipy.linalg import solve_continuous_are, solve_discrete_are

rng = np.random.default_rng(5)
cases = []
for number in range(60):
    n, m = int(rng.integers(1, 9)), int(rng.integers(1, 3))
    a = rng.normal(size=(n, n)) / np.sqrt(n)
    b = rng.normal(size=(n, m))
    c = rng.normal(size=(max(1, n // 2), n))
    q, r = c.T @ c + 1e-6 * np.eye(n), np.diag(rng.uniform(0.1, 10, m))
    discrete = number % 2 == 0
    x = solve_discrete_are(a, b, q, r) if discrete else solve_continuous_are(a, b, q, r)
    if discrete:
        rest = a.T @ x @ a - a.T @ x @ b @ np.linalg.solve(r + b.T @ x @ b, b.T @ x @ a) + q - x
    else:
        rest = a.T @ x + x @ a - x @ b @ np.linalg.solve(r, b.T) @ x + q
    worst = np.abs(rest).max() / np.abs(x).max()
    s = 10.0 ** rng.uniform(-5, 5, n) if number % 4 >= 2 else np.ones(n)
    d, e = np.diag(s), np.diag(1 / s)
    cases.append(dict(
        discrete=discrete, scale=s.tolist(), a=(e @ a @ d).tolist(), b=(e @ b).tolist(), q=(d @ q @ d).tolist(),
        r=r.tolist(), x=(d @ x @ d).tolist(), residual=worst,
    ))
print(f"{len(cases)} equations, residuals up to {max(c['residual'] for c in cases):.1e}")
(Path(__file__).parent.parent / "tests/authorities/riccati.json").write_text(json.dumps(cases) + "\n")
