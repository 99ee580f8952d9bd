"""Methods that are not symplectic, and structure that is wrong: what the study has to catch.

A bench that never says no proves nothing, so these run beside the real schemes.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from discmech.integrators.flows import Flow
from discmech.integrators.geometry import poisson_defect, relative_defect
from discmech.integrators.rules import MAPS

from .case import scheme_of

#: methods that are not symplectic, by their names as controls
RUNGE_KUTTA = {
    "classical Runge-Kutta": MAPS["runge-kutta-4"],
    "Heun": MAPS["heun"],
    "explicit Euler": MAPS["explicit-euler"],
}
DAMPED, FLIPPED = "damped residual", "flipped bracket"
NAMES = (*RUNGE_KUTTA, DAMPED, FLIPPED)
#: the damped residual is F⁻(y, v) = (1 − DAMPING) F⁺(x, u)
DAMPING = "1e-6"


def runge_kutta_defects(flow: Flow, name: str, points: int) -> list[float]:
    """Poisson defects of a Runge–Kutta method along its own trajectory, at the flow's step."""
    own = scheme_of(flow.scheme.scene, RUNGE_KUTTA[name]).flow(flow.step, flow.digits)
    geometry: Any = own.geometry
    start, defects = flow.trajectory(0), list[float]()
    with own.numbers.working():
        x, mu = own.context.vectors(start.x[0], start.mu[0])
        near = own.context.vector(flow.scheme.scene.v0, len(mu))
        for _ in range(points):
            try:
                step = geometry.step(x, mu, geometry.start(x, mu, near))
                defect = float(poisson_defect(geometry, x, mu, step))
            except (ArithmeticError, ValueError):
                break
            if not defect < math.inf:
                break  # it blows up at this step: there is nothing left to compare
            defects.append(defect)
            x, mu, _ = step
    return defects


def damped_defect(flow: Flow, x: Any, u: Any) -> float:
    """Pullback defect of the evolution with F⁻(y, v) = (1 − δ) F⁺(x, u), through its own TΨ."""
    numbers, geometry = flow.numbers, flow.geometry
    with numbers.working():
        kept = 1 - numbers.number(DAMPING)
        x = np.array([numbers.number(e) for e in x], dtype=numbers.dtype)
        u = np.array([numbers.number(e) for e in u], dtype=numbers.dtype)
        here = geometry.at(x, u)
        here = {**here, **{part: kept * here[part] for part in ("plus", "plus_x", "plus_u")}}
        y = here["target"]
        v = flow.inverse_legendre(y, here["plus"] / numbers.number(flow.step))
        there = geometry.at(y, [numbers.number(e) for e in v])
        p = geometry.prolongation(here, there, geometry.tangent(here, there))
        before, after = geometry.omega(here), geometry.omega(there)
        return float(relative_defect(p.T @ after @ p, before, p))
