"""How far a step is from the forms and the equations of its scheme, to twice the flow's digits."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..bisections import StepContext
from ..geometry import in_round_offs, poisson_defect, pullback_defect
from ..numbers import Number, Vector
from .newton_step import arrow_from, round_off_from, step_from


def of_pullback(context: StepContext, x: Any, u: Any, near: Vector) -> Number:
    """The pullback defect at (x, u); near: the velocity of the next arrow, nearly."""
    exactly, geometry = context.exactly, context.exactly.geometry
    with exactly.numbers.working():
        (x, u), (_, near) = exactly.vectors(x, u), exactly.vectors(x, near)
        at = exactly.maps_at(x, u)
        v = arrow_from(exactly, at["target"], at["plus"] / exactly.h, near)
        here, there = geometry.tracked(x, u), geometry.tracked(at["target"], v)
        tangent, root = geometry.tangent(here, there), exactly.numbers.eps**0.5
        found = pullback_defect(geometry, here, there, tangent, root)
    return _in(context, found)


def of_poisson(context: StepContext, x: Any, mu: Any, guess: Any, sign: int) -> Number:
    """The Poisson defect at (x, μ), the bracket with that sign; guess: where Newton starts."""
    exactly = context.exactly
    with exactly.numbers.working():
        x, mu = exactly.vectors(x, mu)
        step = step_from(exactly, x, mu, _start(exactly, guess))
        root = exactly.numbers.eps**0.5
        found = poisson_defect(exactly.geometry, x, mu, step, sign, root)
    return _in(context, found)


def of_step(context: StepContext, before: Any, after: Any, guess: Any) -> Number:
    """The largest gap of (x′, μ′) from the step from (x, μ), over what round-off may do to it."""
    exactly = context.exactly
    with exactly.numbers.working():
        (x, mu), taken = exactly.vectors(*before), exactly.vectors(*after)
        *wanted, bound = round_off_from(exactly, x, mu, _start(exactly, guess))
        found = in_round_offs(np.concatenate(wanted) - np.concatenate(taken), bound)
    return _in(context, found)


def _start(context: StepContext, guess: Any) -> Vector:
    """Where Newton starts: a guess, or the scene's v0."""
    return context.vector(context.scene.v0 if guess is None else guess, len(context.equations.u))


def _in(context: StepContext, value: Number) -> Number:
    """A number as the flow's user gets it."""
    with context.numbers.working():
        return context.number(context.numbers.number(value))
