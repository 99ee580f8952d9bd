"""Steps by Newton with the Legendre maps' own derivatives, to compare the kernels with.

This is the evolution operator through the identity bisections (`bisections.evolution_operator`).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..bisections import EvolutionOperator, StepContext
from ..geometry import Maps, OneStepGeometry
from ..numbers import Matrix, Vector

#: (x′, μ′) and the derivative of (x, μ) ↦ (x′, μ′)
Step = tuple[Vector, Vector, Matrix]


def arrow_from(context: StepContext, x: Vector, mu: Vector, guess: Vector) -> Vector:
    """The u with F⁻(x, u) = hμ, by Newton from the guess; raises `StepFailure` if it diverges."""
    u = EvolutionOperator(context).following(x, context.h * mu, guess)
    if u is None:
        raise context.failure("the step was not found", {"x": x, "mu": mu})
    return u


def arrow_before(context: StepContext, y: Vector, v: Vector) -> tuple[Vector, Vector]:
    """The (x, u) with b(x, u) = y and F⁺(x, u) = F⁻(y, v); raises `StepFailure`."""
    n, there = len(y), context.maps_at(y, v)
    start = np.concatenate([y - there["rho"] @ v, v])
    point = EvolutionOperator(context).preceding(y, there["minus"], start)
    if point is None:
        raise context.failure("the inverse step was not found", {"y": y, "v": v})
    return point[:n], point[n:]


def step_along(context: StepContext, here: Maps) -> Step:
    """The step (b, F⁺/h) on the dual along an arrow, from the maps at it."""
    h = context.h
    return here["target"], here["plus"] / h, context.geometry.dual_step(here, h)


def _step_of_map(context: StepContext, x: Vector, mu: Vector, near: Vector) -> Step:
    """The step of a one-step map; raises `StepFailure` if Newton diverges."""
    geometry: Any = context.geometry
    try:
        step: Step = geometry.step(x, mu, geometry.start(x, mu, near))
        return step
    except (ArithmeticError, ValueError):
        raise context.failure("the step was not found", {"x": x, "mu": mu}) from None


def step_from(context: StepContext, x: Vector, mu: Vector, guess: Vector) -> Step:
    """The step on the dual from (x, μ): substeps one after another."""
    total = context.numbers.identity(len(x) + len(mu))
    for part in context.parts:
        if isinstance(part.geometry, OneStepGeometry):
            x, mu, derivative = _step_of_map(part, x, mu, guess)
        else:
            guess = arrow_from(part, x, mu, guess)
            x, mu, derivative = step_along(part, part.maps_at(x, guess))
        total = derivative @ total
    return x, mu, total
