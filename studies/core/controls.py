"""Methods that are not symplectic, and wrong structures, which the study has to catch.

A bench that never fails a method proves nothing, so these run beside the real schemes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from discmech.integrators import BadInput
from discmech.integrators.flows import Flow, arrow_from
from discmech.integrators.geometry import poisson_defect, pullback_defect
from discmech.integrators.rules import MAPS

from .case import Case, Choice, scheme_of
from .fingerprint import own_name

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


def chosen_controls(choice: Choice, every: Iterable[Case], by_rules: bool = False) -> list[Case]:
    """Return those of all cases of controls whose control and whose system are chosen, or any.

    by_rules: True if a chosen rule makes them; otherwise they are by a method of their own, and
    none runs beside chosen rules. Raises `BadInput` for chosen controls of which none runs.
    """
    asked = [case for case in every if case.control in (choice.controls or (case.control,))]
    names = [own_name(scene) for scene in choice.scenes]
    alone = by_rules or not choice.rules
    here = [case for case in asked if alone and case.scene.name in (names or (case.scene.name,))]
    if choice.controls and not here:
        where = ", ".join(dict.fromkeys(case.scene.name for case in asked))
        raise BadInput(
            f"the control {', '.join(choice.controls)} is run on {where}: name one "
            f"of these, or none{'' if by_rules else ', and no rule'}."
        )
    return here


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
