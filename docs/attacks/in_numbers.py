"""Runs that were recorded, and scenes in numbers, that are not what they say."""

import atexit
import shutil
import tempfile
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from discmech import Conserved, Scene, black_box, pair, recorded


@black_box(order=2, symplectic=True)
def verlet(q, p, h, system):
    """Störmer and Verlet: sound where the scene is."""
    p = p - h / 2 * system.gradient(q, p)
    q = q + h * system.velocity(q, p)
    return q, p - h / 2 * system.gradient(q, p)


@black_box(order=2, symplectic=True)
def damped(q, p, h, system):
    """The same, which loses a millionth of its momentum in a unit of time."""
    return verlet.formula(q, (1 - 1e-6 * h) * p, h, system)


KNOTS = np.linspace(-4, 4, 61)
TABLE = CubicSpline(KNOTS, -np.cos(KNOTS))
SLOPE = TABLE.derivative()
table = Scene(
    name="table", groupoid=pair(1), x0=["1"], mu0=["0.3"], duration=10, step="0.1",
    numeric_hamiltonian=lambda q, p: p[0] ** 2 / 2 + float(TABLE(q[0])),
    gradient=lambda q, p: (SLOPE(q), p),
)  # fmt: skip

wrong = Scene(
    name="wrong-gradient", groupoid=pair(1), x0=["1"], mu0=["0.3"], duration=10, step="0.1",
    numeric_hamiltonian=lambda q, p: p[0] ** 2 / 2 - np.cos(q[0]),
    gradient=lambda q, p: ((1 + 1e-9) * np.sin(q), p),
)  # fmt: skip

kept = black_box(order=2, symplectic=True, keeps="momentum")(verlet.formula)
exact = black_box(order=2, keeps="energy")(verlet.formula)


@black_box(order=2)
def lopsided(q, p, h, system):
    """Verlet with unequal kicks of the second coordinate alone."""
    w = np.array([0.5, 0.4])
    p = p - w * h * system.gradient(q, p)
    q = q + h * system.velocity(q, p)
    return q, p - (1 - w) * h * system.gradient(q, p)


line = Scene(
    name="line", groupoid=pair(2), x0=["1", "0"], mu0=["0.3", "0"], duration=5, step="0.05",
    numeric_hamiltonian=lambda q, p: p @ p / 2 + q[1] ** 2 / 2 + q[1] ** 4 / 4,
    gradient=lambda q, p: (np.array([0, q[1] + q[1] ** 3]), p),
    symmetries=[Conserved("J", lambda x, mu, p: x[0] * mu[1] - x[1] * mu[0])],
)  # fmt: skip
bent = Scene(
    name="bent", groupoid=pair(2), x0=["1", "0"], mu0=["0.3", "0"], duration=5, step="0.05",
    numeric_hamiltonian=lambda q, p: p @ p / 2 - np.cos(q[0]) + (1 / 2 + q[0] ** 2) * q[1] ** 2,
    gradient=lambda q, p: (np.array([np.sin(q[0]) + 2 * q[0] * q[1] ** 2,
                                     (1 + 2 * q[0] ** 2) * q[1]]), p),
)  # fmt: skip

FOLDER = Path(tempfile.mkdtemp())
atexit.register(shutil.rmtree, FOLDER, ignore_errors=True)
for k in range(5):
    steps, q, p = 100 * 2**k, 1.0, 0.3
    h, rows = 10 / steps, [(0.0, 1.0, 0.3)]
    for n in range(1, steps + 1):
        p -= h / 2 * np.sin(q)
        q += h * p
        p -= h / 2 * np.sin(q)
        rows.append((n * h, q, p))
    rows = np.array(rows)
    rows[1:-1, 1:] *= 0.9  # of another motion, but for the first and the last
    np.savetxt(FOLDER / f"run{k}.csv", rows, "%.17g", ",", header="t,q1,p1", comments="")
between = recorded(str(FOLDER / "*.csv"), 2)
