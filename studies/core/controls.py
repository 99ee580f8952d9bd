"""Methods that are not symplectic, and wrong structures, which the study has to catch.

A bench that never fails a method proves nothing, so these run beside the real schemes.
"""

from __future__ import annotations

import math
from typing import Any

from discmech.integrators.flows import Flow, arrow_from
from discmech.integrators.geometry import poisson_defect, pullback_defect
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
    """Return Poisson defects of a Runge–Kutta method along its trajectory, at the flow's step."""
    own = scheme_of(flow.scheme.scene, RUNGE_KUTTA[name]).flow(flow.step, flow.digits)
    exactly, start, defects = own.context.exactly, flow.trajectory(0), list[float]()
    geometry: Any = exactly.geometry
    with exactly.numbers.working():
        x, mu = exactly.vectors(start.base[0], start.mu[0])
        near, root = exactly.vector(flow.scheme.scene.v0, len(mu)), exactly.numbers.eps**0.5
        for _ in range(points):
            try:
                step = geometry.step(x, mu, geometry.start(x, mu, near))
                defect = float(poisson_defect(geometry, x, mu, step, resolution=root))
            except (ArithmeticError, ValueError):
                break
            if not defect < math.inf:
                break  # it blows up at this step: no more rows to compare
            defects.append(defect)
            x, mu, _ = step
    return defects


def damped_defect(flow: Flow, x: Any, u: Any) -> float:
    """Return the pullback defect of an evolution with F⁻(y, v) = (1 − δ) F⁺(x, u), by its TΨ."""
    exactly, v = flow.context.exactly, flow.evolve(x, u)[1]
    geometry, numbers = exactly.geometry, exactly.numbers
    with numbers.working():
        kept = 1 - numbers.number(DAMPING)
        x, u = exactly.vectors(x, u)
        here = geometry.tracked(x, u)
        here |= {part: kept * here[part] for part in ("plus", "of_plus")}
        y, mu = here["target"].value, here["plus"].value / exactly.h
        there = geometry.tracked(y, arrow_from(exactly, y, mu, exactly.vector(v, len(u))))
        tangent = geometry.tangent(here, there)
        return float(pullback_defect(geometry, here, there, tangent, numbers.eps**0.5))
