"""References of scenes whose Hamiltonian is a function of numbers: two methods that agree.

Nothing can be proven about a function without a known formula, so an answer has the digits to which
two independent methods agree: scipy's DOP853, and extrapolation of the explicit midpoint rule
(Gragg, Bulirsch, Stoer; Hairer, Nørsett, Wanner, II.9), both with tolerances near round-off. And H
has to stay to these digits at every step of both: a jump that both step over is in none of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from discmech.integrators.scene import remembered

from ..failures import MotionEnds, ReferenceFailure
from .result import Solution

TOLERANCE = 1e-13  # relative tolerance of the local error of either method
COLUMNS = 8  # columns of an extrapolation: order 16
SMALLEST = 2.0**-40  # share of the whole time: a shorter step means that the motion ends
MOST = 200_000  # largest number of steps
PARTS = 256  # the least number of steps of DOP853, which sees the field twelve times in each
Field = Callable[[float, np.ndarray], np.ndarray]


def solutions_in_numbers(scene: Any, times: Sequence[Fraction]) -> list[Solution]:
    """Return the states at the times, each with the digits to which both methods agree."""
    return [_solution(scene, t) for t in times]


@remembered(maxsize=256)
def _solution(scene: Any, t: Fraction) -> Solution:
    import mpmath

    n = scene.groupoid.dim_x
    start = np.array([float(e) for e in (*scene.x0, *scene.mu0)])
    f, end = field(scene), float(t)
    ways = [follow(f, start, end, scene.name) if end else start[None]
            for follow in (_dormand_prince, _extrapolated)]  # fmt: skip
    (*_, first), (*_, second) = ways
    certain = min(15, *(_digits_of_energy(scene, way) for way in ways))
    for part in (slice(0, n), slice(n, None)):
        size = np.abs(second[part]).max(initial=0.0)
        gap = np.abs(first - second)[part].max(initial=0.0)
        if gap > 0:
            certain = min(certain, math.floor(-math.log10(gap / size)) if size else 0)
    if certain < 2:
        raise ReferenceFailure(
            f"scene {scene.name}: two methods of tight tolerance agree in no digit at "
            f"t = {end:.4g}, or its Hamiltonian does not stay along them; it is too rough, or the "
            "motion chaotic: take a shorter duration"
        )
    x, mu = ([mpmath.mpf(float(e)) for e in part] for part in (second[:n], second[n:]))
    v = [mpmath.mpf(float(e)) for e in _slopes(scene, second)[n:]]
    evidence = f"DOP853, extrapolation and the energy along both agree to {certain} digits"
    return Solution(t, x, mu, v, None, certain, "extrapolation", evidence)


def _digits_of_energy(scene: Any, way: np.ndarray) -> int:
    """Return the digits of the state to which H stays along a way, (r, n+m).

    A relative error ε of a state changes H by Σ|z ∂H/∂z| ε, and its own rounding by |H| ε.
    """
    n = scene.groupoid.dim_x
    energies = [float(np.asarray(scene.numeric_hamiltonian(z[:n].copy(), z[n:].copy())).reshape(()))
                for z in way]  # fmt: skip
    drift = max(abs(value - energies[0]) for value in energies)
    size = max(float(np.abs(z) @ np.abs(_slopes(scene, z))) for z in way) + abs(energies[0])
    if not np.isfinite([*energies, size]).all():  # it has no value there, or too large a one
        return 0
    return math.floor(-math.log10(drift / size)) if drift else 15


def field(scene: Any) -> Field:
    """Return the vector field B dH in doubles, as a function of (t, z)."""
    tensor = _tensor(scene)

    def f(t: float, z: np.ndarray) -> np.ndarray:
        return np.asarray(tensor(z) @ _slopes(scene, z))

    return f


def field_anywhere(scene: Any) -> Field:
    """Return `field`, not a number outside the domain of the user's functions, where they raise."""
    inside = field(scene)

    def f(t: float, z: np.ndarray) -> np.ndarray:
        try:
            return inside(t, z)
        except Exception:  # whatever they raise, as at the end of a table
            return np.full(len(z), np.nan)

    return f


def _slopes(scene: Any, z: np.ndarray) -> np.ndarray:
    n = scene.groupoid.dim_x
    parts = scene.gradient(z[:n].copy(), z[n:].copy())
    return np.concatenate([np.ravel(np.asarray(e, dtype=float)) for e in parts])


def _tensor(scene: Any) -> Callable[[np.ndarray], np.ndarray]:
    """Return B(z), (n+m, n+m), derived from the groupoid's data."""
    import sympy

    from ..equations import algebroid_of

    n, m = scene.groupoid.dim_x, scene.groupoid.dim_u
    x = sympy.Matrix(sympy.symbols(f"x:{n}", real=True)) if n else sympy.zeros(0, 1)
    of = algebroid_of(scene, x)
    anchor = sympy.lambdify([list(x)], of.rho, "numpy")
    constants = {k: sympy.lambdify([list(x)], e, "numpy") for k, e in of.constants.items()}

    def tensor(z: np.ndarray) -> np.ndarray:
        q, p, matrix = list(z[:n]), z[n:], np.zeros((n + m, n + m))
        if n:
            rho = np.asarray(anchor(q), dtype=float).reshape(n, m)
            matrix[:n, n:], matrix[n:, :n] = rho, -rho.T
        for (g, i, j), value in constants.items():
            matrix[n + i, n + j] -= float(value(q)) * p[g]
        return matrix

    return tensor


def _dormand_prince(f: Field, z: np.ndarray, end: float, name: str) -> np.ndarray:
    """Return the states at all steps of a motion, (r, n+m)."""
    from scipy.integrate import solve_ivp

    scale = np.abs(z).max()
    run = solve_ivp(f, (0.0, end), z, method="DOP853", rtol=TOLERANCE, atol=TOLERANCE * scale,
                    max_step=abs(end) / PARTS)  # fmt: skip
    if not run.success or not np.isfinite(run.y[:, -1]).all():
        raise MotionEnds(f"scene {name}: DOP853 stops at t = {float(run.t[-1]):.4g}",
                         float(run.t[-1]))  # fmt: skip
    return np.asarray(run.y.T)


def _extrapolated(f: Field, z: np.ndarray, end: float, name: str) -> np.ndarray:
    """Return the states at all steps of a motion by extrapolation, (r, n+m).

    The last two columns differ by the tolerance. The increments are summed with
    compensation for round-off.
    """
    t, h, way = 0.0, end / 64, [z]
    left = np.zeros_like(z)
    while abs(t) < abs(end) * (1 - 2.0**-50):
        h = end - t if abs(end - t) < abs(h) else h
        grown, error = extrapolated_step(f, t, z, h)
        size = np.abs(z).max() + np.abs(grown).max()
        if len(way) > MOST or abs(h) < SMALLEST * abs(end):
            raise MotionEnds(f"scene {name}: extrapolation stops at t = {t:.4g}", t)
        if not np.isfinite(grown).all() or error > TOLERANCE * size:
            h /= 2
            continue
        total = grown + left
        new = z + total
        left = total - (new - z)
        t, z = t + h, new
        way.append(z)
        h *= 1.5 if error < TOLERANCE * size / 1e3 else 1.0
    return np.array(way)


def extrapolated_step(f: Field, t: float, z: np.ndarray, h: Any) -> tuple[np.ndarray, float]:
    """Return (z(t+h) − z, difference of the last two columns), by Aitken and Neville in h².

    The way is added up, not the state, whose last digit the extrapolation would enlarge.
    """
    row: list[np.ndarray] = []
    with np.errstate(all="ignore"):
        first = f(t, z)
        for j in range(1, COLUMNS + 1):
            n = 2 * j
            d = h / n
            before, at, twice = 0 * z, d * first, 2 * d
            for k in range(1, n):
                before, at = at, before + twice * f(t + k * d, z + at)
            new = [(before + at + d * f(t + h, z + at)) / 2]
            for k, earlier in enumerate(row):
                ratio = (j / (j - k - 1)) ** 2
                new.append(new[-1] + (new[-1] - earlier) / (ratio - 1))
            row = new
    return row[-1], float(np.abs(row[-1] - row[-2]).max())
