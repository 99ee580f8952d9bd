"""The defect of a run's rows in the scene's constraints."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from discmech.integrators import Scheme
from discmech.integrators.equations import (
    closed_velocity,
    constraint,
    vanishing_at_states,
    vanishing_in_a_step,
)
from discmech.integrators.flows import Flow, round_off_from
from discmech.integrators.geometry import in_round_offs
from discmech.integrators.numbers import (
    Number,
    Tracked,
    arithmetic,
    numeric_text,
    rounded,
    with_running_errors,
)


def constraint_defect(flow: Flow, run: Any, k: int) -> float:
    """Return the largest defect in the constraints, in round-offs, of the step from row k and its
    end.

    Terms are Σ ω_i (A(x_i) u − a(x_i)), φ(y) and A(y) ξ(y, μ′) − a(y) where ξ has a closed form,
    each over its round-off bound (`running_error`): of (y, μ′) that of the step's own operations
    (`round_off_from`), of velocities ε of the sum of all, of u and of ξ at the end, where Newton's
    method stops.
    So it is at most some ε. All is computed to twice the digits of the flow.
    """
    at = flow.context.exactly
    numbers = at.numbers
    with numbers.working():
        x, mu = at.vectors(run.base[k], run.mu[k])
        u = at.vector(run.u[k], len(mu))
        y, after = at.vectors(run.base[k + 1], run.mu[k + 1])
        *_, errors = round_off_from(at, x, mu, u)
        end, momentum = rounded(y, errors[: len(y)]), rounded(after, errors[len(y) :])
        q = at.geometry.q
        in_step, velocity, at_end = _functions(flow.scheme, numbers.digits)
        v = velocity(end, momentum, q) if velocity else rounded(0 * u)
        size = abs(u).sum() + abs(v.value).sum()
        terms = [in_step(rounded(x), _as_solved(rounded(u), size), q)]
        terms.append(at_end(end, _as_solved(v, size), q))
        values, errors = ([getattr(e, name).ravel() for e in terms] for name in ("value", "error"))
        return float(in_round_offs(np.concatenate(values), np.concatenate(errors)))


def _as_solved(velocity: Tracked, size: Number) -> Tracked:
    """Return the velocity with the errors of a solution whose corrections end at ε of that size."""
    return rounded(velocity.value.ravel(), velocity.error.ravel() + size)


@lru_cache(maxsize=64)
def _functions(scheme: Scheme, digits: int) -> tuple[Any, Any, Any]:
    """Return a step's constraints (x, u; q), ξ (x, μ; q) or None, and a state's (x, ξ; q)."""
    s, numbers = scheme.s, arithmetic(digits)
    x, q = {"x": s.x}, {"q": s.q}

    def function(letters: dict[str, Any], formulas: Any) -> Callable[..., Any]:
        return with_running_errors(numeric_text(x | letters | q, [list(formulas)]), numbers)

    # of several substeps it would be a sum over them
    in_step = [] if scheme.substeps else vanishing_in_a_step(scheme.discrete.of)
    velocity = closed_velocity(s)  # without a closed form, ξ is known to no bound
    at_states = constraint(s, s.x) if velocity is None else vanishing_at_states(s)
    return (
        function({"u": s.u}, in_step),
        None if velocity is None else function({"mu": s.mu}, velocity),
        function({"v": s.v}, at_states),
    )
