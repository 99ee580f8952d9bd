"""Steps by Newton's method with the Legendre maps' own derivatives, a check of the kernels.

The steps are those of `geometry.StepMap`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial, reduce
from typing import Any, TypeAlias, TypeVar

import numpy as np

from ..bisections import EvolutionOperator
from ..errors import CannotMeasure
from ..geometry import (
    FormChange,
    Maps,
    Step,
    StepContext,
    StepMap,
    StepNotFound,
    form_change,
    in_round_offs,
    poisson_defect,
    pullback_defect,
    restricted_defect,
)
from ..numbers import Number, Numbers, Vector, tracked
from ..numbers.types import Array

State: TypeAlias = tuple[Numbers, Numbers]  # (x, μ)
Result = TypeVar("Result")


def _from(
    context: StepContext, ask: Callable[..., Result], x: Vector, mu: Vector, near: Vector
) -> Result:
    """Return what a method of `StepMap` gives for the step from (x, μ), by Newton from a velocity
    nearby.

    Raises `StepFailure` if it diverges, and `StepNotFound` where a run has taken the step of a map
    that is measured; `CannotMeasure` for impulses beside arrows.
    """
    if context.equations.arrows is not None:
        context.check_one_arrow()
    geometry = context.geometry
    try:
        return ask(geometry, x, mu, geometry.start(x, mu, near))
    except CannotMeasure:  # it is a ValueError, but about the request
        raise
    except (ArithmeticError, ValueError) as error:
        taken = context.equations.arrows is None and ask is not StepMap.step
        if taken and isinstance(error, StepNotFound):
            raise
        raise context.failure("the step was not found", {"x": x, "mu": mu}) from None


def arrow_from(context: StepContext, x: Vector, mu: Vector, guess: Vector) -> Vector:
    """Return u with F⁻(x, u) = hμ, by Newton from the guess; raises `StepFailure` if it diverges.

    The latest results are remembered, because several forms are measured on one step.
    """
    with context.numbers.working():
        return _from(context, StepMap.unknowns, x, mu, guess)[: len(mu)].copy()


def _substeps(
    context: StepContext, ask: Callable[..., Result], x: Vector, mu: Vector, guess: Vector
) -> Iterator[tuple[Result, Step]]:
    """Yield what a method of `StepMap` gives for each substep from (x, μ), and the substep."""
    for part in context.parts:
        asked = _from(part, ask, x, mu, guess)
        step: Any = asked if ask is StepMap.step else _from(part, StepMap.step, x, mu, guess)
        yield asked, step
        if part.equations.arrows is not None:
            guess = arrow_from(part, x, mu, guess)
        x, mu, _ = step


def arrow_before(context: StepContext, y: Vector, v: Vector) -> tuple[Vector, Vector]:
    """Return (x, u) with b(x, u) = y and F⁺(x, u) = F⁻(y, v); raises `StepFailure`."""
    n, there = len(y), context.maps_at(y, v)
    start = np.concatenate([y - there["rho"] @ v, v])
    point = EvolutionOperator(context).preceding(y, there["minus"], start)
    if point is None:
        raise context.failure("the inverse step was not found", {"y": y, "v": v})
    return point[:n], point[n:]


def step_along(context: StepContext, here: Maps) -> Step:
    """Return the step (b, F⁺/h) on the dual along an arrow, from the maps at it."""
    h = context.h
    return here["target"], here["plus"] / h, context.geometry.dual_step(here, h)


def step_from(context: StepContext, x: Vector, mu: Vector, guess: Vector) -> Step:
    """Return the step on the dual from (x, μ), by substeps, with its `Tracked` derivative."""
    total: Array = context.numbers.identity(len(x) + len(mu))
    for _, step in _substeps(context, StepMap.step, x, mu, guess):
        total = step[2] @ total
    return step[0], step[1], total


def round_off_from(
    context: StepContext, x: Vector, mu: Vector, guess: Vector, errors: Vector | None = None
) -> Step:
    """Return (x′, μ′) of `step_from`, and the effect of round-off on them, n+m units ε.

    errors: those of (x, μ), 0 by default. Every substep adds its own errors (`step_round_off`), and
    the exact derivative of the later steps propagates them: bounds of bounds would grow from
    substep to substep until no error could be seen.
    """
    still = 0 * abs(np.concatenate([x, mu]))
    handed: Array = context.numbers.identity(len(still)) * (still if errors is None else errors)
    for own, step in _substeps(context, StepMap.step_round_off, x, mu, guess):
        moved = tracked(step[2]).value @ handed
        handed = np.hstack([moved, context.numbers.identity(len(own)) * own])
    return step[0], step[1], abs(handed).sum(axis=1)


def growth_errors(
    context: StepContext, x: Numbers, mu: Numbers, near: Numbers
) -> Iterator[tuple[Vector, Vector]]:
    """Yield (the state after, the error of what a step adds to (x, μ)), n+m each, of each substep.

    The step's formulas are evaluated in the flow's own numbers and to twice the digits, at the same
    state and arrow. Raises `CannotMeasure` for impulses beside arrows.
    """
    exactly = context.exactly
    for part, whole in zip(context.parts, exactly.parts, strict=True):
        with context.numbers.working():
            at, momentum = context.vectors(x, mu)
            guess = context.vector(near, len(momentum))
            w = _from(part, StepMap.unknowns, at, momentum, guess)
            grown = part.geometry.growth(at, momentum, w)
            if part.equations.arrows is not None:
                near = w[: len(momentum)]
        with exactly.numbers.working():
            at, momentum = exactly.vectors(at, momentum)
            if part.equations.arrows is None:  # its unknowns are rounded, too
                w = _from(whole, StepMap.unknowns, at, momentum, exactly.vector(near, len(mu)))
            exact = whole.geometry.growth(at, momentum, exactly.vector(w, len(w)))
            after = np.concatenate([at, momentum]) + exact
            yield after, exactly.vector(grown, len(exact)) - exact
        x, mu = np.split(after, [len(at)])


# -- defects, to twice the flow's digits and in its own numbers ----------------------------------


def of_pullback(context: StepContext, x: Numbers, u: Numbers, near: Vector) -> Number:
    """Return the pullback defect at (x, u); near: approximately the velocity of the next arrow."""
    exactly, geometry = context.exactly, context.exactly.geometry
    with exactly.numbers.working():
        (x, u), (_, near) = exactly.vectors(x, u), exactly.vectors(x, near)
        at = exactly.maps_at(x, u)
        v = arrow_from(exactly, at["target"], at["plus"] / exactly.h, near)
        here, there = geometry.tracked(x, u), geometry.tracked(at["target"], v)
        tangent, root = geometry.tangent(here, there), exactly.numbers.eps**0.5
        defect = pullback_defect(geometry, here, there, tangent, root)
    return _public_number(context, defect)


def of_poisson(
    context: StepContext, x: Numbers, mu: Numbers, guess: Numbers | None, sign: int
) -> Number:
    """Return the Poisson defect at (x, μ), with the sign of the bracket; guess: Newton's start.

    Under constraints that leave a form it is that of their states (`restricted_form_defect`).
    """
    if context.scene.all_constraints:
        if reason := context.scene.no_form:
            raise CannotMeasure(f"{context.scene.name} has no form that a step keeps ({reason}).")
        return _of_restricted(context, x, mu, guess, sign)
    exactly = context.exactly
    with exactly.numbers.working():
        x, mu = exactly.vectors(x, mu)
        step = step_from(exactly, x, mu, _start(exactly, guess))
        root = exactly.numbers.eps**0.5
        defect = poisson_defect(exactly.geometry, x, mu, step, sign, root)
        if defect != defect:  # the step leads to where something has no value
            raise exactly.failure("the form has no value where the step ends", {"x": x, "mu": mu})
    return _public_number(context, defect)


def volume_defect(flow: Any, x: Numbers, mu: Numbers, u0: Numbers) -> Number:
    """Return how far |det M| is from 1, M the derivative of the step of a flow from (x, μ).

    It is evaluated to twice the digits; u0: Newton's start. Raises `StepFailure`.
    """
    exactly = flow.context.exactly
    with exactly.numbers.working():
        at = exactly.vectors(x, mu)
        *_, derivative = step_from(exactly, at[0], at[1], _start(exactly, u0))
        factor = abs(exactly.numbers.det(tracked(derivative).value))
    return _public_number(flow.context, abs(factor - 1))


def of_step(context: StepContext, before: State, after: State, guess: Numbers | None) -> Number:
    """Return the largest gap between (x′, μ′) and the step from (x, μ), in units of round-off."""
    exactly = context.exactly
    with exactly.numbers.working():
        (x, mu), taken = exactly.vectors(*before), exactly.vectors(*after)
        *wanted, bound = round_off_from(exactly, x, mu, _start(exactly, guess))
        gap = in_round_offs(np.concatenate(wanted) - np.concatenate(taken), bound)
    return _public_number(context, gap)


def return_defect(
    forth: Any, back: Any, x: Numbers, mu: Numbers, u0: Numbers, *returned: State
) -> Number:
    """Return how far Φ₋ₕ(Φₕ(x, μ)) is from (x, μ), like `Flow.step_defect`.

    It is 0 for a self-adjoint method: the largest gap of a component divided by the effect of
    round-off in both steps, times ε. forth, back: the flows of h and −h. The maps are evaluated to
    twice the digits; returned: each an (x, μ) in which a run of the flows ended, which is compared
    with the start as well. u0: Newton's start.
    """
    there, home = forth.context.exactly, back.context.exactly
    with there.numbers.working():
        at, momentum = there.vectors(x, mu)
        start = _start(there, u0)
        after_x, after_mu, errors = round_off_from(there, at, momentum, start)
        *again, bound = round_off_from(home, after_x, after_mu, start, errors)
        ends = [again, *(there.vectors(*run) for run in returned)]
        gaps = [np.concatenate(end) - np.concatenate([at, momentum]) for end in ends]
        gap = in_round_offs(np.concatenate(gaps), np.concatenate([bound] * len(gaps)))
    return _public_number(forth.context, gap)


def form_change_defects(
    flow: Any, x: Numbers, mu: Numbers, u0: Numbers
) -> tuple[Number, Number, Number]:
    """Return the effect of a force on ω in the step of a flow from (x, μ): two defects, and det P.

    The first defect compares the change of ω with −dθ_f, the differential of the force's one-form
    (`geometry.forced_form`), the second that of a volume of phase space with the value that dθ_f
    gives; det P is the factor of the volume. Both are relative to the absolute terms; u0: Newton's
    start. Raises `CannotMeasure` for one-step maps, and with constraints
    (`restricted_form_defect`).
    """
    context = flow.context.exactly
    if context.equations.arrows is None:
        context.check_one_arrow()
    with context.numbers.working():
        at, momentum = context.vectors(x, mu)
        begin = at, momentum, _start(context, u0)
        change = reduce(FormChange.then, (e for e, _ in _substeps(context, form_change, *begin)))
        grown, off = change.volume(context.numbers)
        triple = change.defect(context.numbers.eps**0.5), off, grown
    defect, off, grown = (_public_number(flow.context, e) for e in triple)
    return defect, off, grown


def restricted_form_defect(
    flow: Any, x: Numbers, mu: Numbers, u0: Numbers, bracket_sign: int = 1, forced: bool = False
) -> Number:
    """Return the defect of ω under a step of a flow from (x, μ), on the constrained states.

    See `restricted_defect`; u0: Newton's start. forced: True if the change should be that of
    the force's one-form. Raises `CannotMeasure` if there are no constraints, or several substeps.
    """
    return _of_restricted(flow.context, x, mu, u0, bracket_sign, forced)


def _of_restricted(
    of: StepContext, x: Numbers, mu: Numbers, u0: Numbers | None, sign: int, forced: bool = False
) -> Number:
    """Return the defect of ω on the constrained states; of: the context of the step."""
    context, scene = of.exactly, of.scene
    if not scene.all_constraints:
        raise CannotMeasure(f"{scene.name} has no constraints, so there is no restricted form.")
    if context.substeps:
        raise CannotMeasure(
            f"{scene.name} has constraints and the rule several substeps: ask for the form of a "
            "step of its base rule."
        )
    with context.numbers.working():
        at, near = context.vectors(x, mu), _start(context, u0)
        asked = partial(restricted_defect, sign=sign, forced=forced)
        defect = _from(context, asked, *at, near)
    return _public_number(of, defect)


def _start(context: StepContext, guess: Numbers | None) -> Vector:
    """Return Newton's start: a guess, or the scene's v0."""
    return context.vector(context.scene.v0 if guess is None else guess, len(context.equations.u))


def _public_number(context: StepContext, value: Number) -> Number:
    """Return a number in the form that the flow's user gets."""
    with context.numbers.working():
        return context.number(context.numbers.number(value))
