"""The nonholonomic momentum equation, discretely: the change of J = ⟨μ, ξ(x)⟩ in a step.

ξ is a section whose values the constraints allow, A(x) ξ(x) = 0, also where they move: A is of
their reactions Aᵀλ. The multipliers do no work on it,
so ⟨μ, ξ(x)⟩ = ⟨F⁻, ξ(x)⟩/h and ⟨μ′, ξ(y)⟩ = ⟨F⁺, ξ(y)⟩/h, and

    J(y, μ′) − J(x, μ) = dL_d(−ξ(x)/h e→ + ξ(y)/h e←) + f⁺·ξ(y) − f⁻·ξ(x):

the derivative of L_d along the section at both of its base points, with the work of a force f
(Bloch, Krishnaprasad, Marsden, Murray 1996; on groupoids Iglesias, Marrero, Martín de Diego,
Martínez 2008). L_d is differentiated here as it is written in (x, u; h), without F±.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from discmech.integrators import BadInput, Scheme
from discmech.integrators.equations import discrete_force, reaction_matrix
from discmech.integrators.flows import Flow
from discmech.integrators.numbers import first_violation, jacobian, numeric
from discmech.integrators.scene import Conserved

KIND = "nonholonomic momentum"


def check(scheme: Scheme, q: Conserved, slope: Any) -> None:
    """Raise `BadInput` unless a quantity is ⟨μ, ξ(x)⟩ with A(x) ξ(x) = 0; slope: ∂J/∂μ."""
    s = scheme.s
    if not s.constraints:
        said = "the scene has no constraints"
    elif slope.free_symbols & {*s.mu}:
        said = "it is not linear in μ"
    elif first_violation(list(reaction_matrix(s, s.x) * slope.T), [*s.u]) is not None:
        said = "the constraints do not allow ξ(x) = ∂J/∂μ"
    else:
        return
    raise BadInput(
        f"{scheme.scene.name}: {q.name} is no nonholonomic momentum ⟨μ, ξ(x)⟩: {said}; declare it "
        'as kind="first integral", or leave it out.'
    )


def change(flow: Flow, run: Any, rows_of: Any, slope: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return (J(y, μ′) − J(x, μ) less the equation's, absolute terms) per step; slope: ∂J/∂μ."""
    s, discrete = flow.scheme.s, flow.scheme.discrete
    g, h = s.groupoid, s.h
    y = g.target(s.x, s.u, h)
    begin, end = slope.T, slope.xreplace(dict(zip(s.x, y, strict=True))).T
    by_x, by_u = (jacobian([discrete.discrete_lagrangian], part) for part in (s.x, s.u))
    parts = [by_x * g.rho(s.x, h) / h * begin, -by_u * g.R(s.x, s.u, h) / h * begin,
             by_u * g.L(s.x, s.u, h) / h * end]  # fmt: skip
    if s.forced:
        minus, plus, _ = discrete_force(discrete.of)
        parts += [plus.T * end, -minus.T * begin]
    said = numeric({"x": s.x, "u": s.u, "q": s.q}, [[list(part) for part in parts]], flow.numbers)
    at, q = flow.context, flow.geometry.q
    each = [np.array(said(*at.vectors(x, u), q))
            for x, u in zip(run.base[:-1], run.u[:-1], strict=True)]  # fmt: skip
    values, terms = rows_of(run)
    gap = np.diff(values, axis=0) - np.array([part.sum(axis=0) for part in each])
    size = np.array([abs(part).sum(axis=0) for part in each])
    return gap, np.maximum(terms[1:], terms[:-1]) + size
