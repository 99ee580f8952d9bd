"""Failures of runs: the cause, the singular matrix and its direction, and the fix."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..bisections import EdgePolicy, edge_policies
from ..compiler import Run, Status
from ..equations import SceneSymbols, inverse_two_form, mass_matrix, orientation
from ..errors import SMALLER, StepFailure
from ..geometry import StepContext
from ..numbers import (
    NotComputed,
    Vector,
    arithmetic,
    evaluate_matrix,
    exact,
    null_direction,
    numeric,
    shown,
    sympy,
    to_sympy,
)
from ..numbers.types import Function, Numbers, SymbolicMatrix
from ..runs import Trajectory

#: factor of growth of (dϑ)⁻¹ since the start from which on the form counts as nearly singular
LARGER = 1000
BEFORE = "stop before, where the motion ends, or take a smaller step"
PARASITIC = "take a method for one-forms such as projected-gauss-1"
#: driver's status ↦ cause of the failure
CAUSES: dict[int, str] = {
    **edge_policies.CAUSES,
    Status.NOT_CONVERGED: "Newton did not converge",
    Status.SINGULAR: "FL is singular or the numbers are no longer finite",
}


def failure_of_run(edge: EdgePolicy, run: Run, status: int, rows: Trajectory | None) -> StepFailure:
    """Return the failure that ended a run; `rows`: its trajectory so far."""
    context, machine = edge.context, edge.machine
    x, mu = machine.point(run.state)
    last = machine.last_solution(run.resume_point)
    cause, look = CAUSES[status], None
    if edge.stages is not None and status == Status.NOT_CONVERGED:
        cause = f"the fixed point of the stages does not contract, and {cause}"
    if context.equations.arrows is None:
        last = {}  # the slope of a map is no velocity of an arrow
        if status == Status.SINGULAR:
            cause = "a step is singular or the numbers are no longer finite"
        if context.equations.s.degenerate:
            state = x.copy()

            def look() -> tuple[str, str]:
                near = _grown(context, state) > LARGER
                return (f"dϑ is nearly singular, and {cause}", BEFORE) if near else (cause, SMALLER)

    elif status not in edge_policies.CAUSES:
        # if Newton's start is not printed, F⁻ is affine and FL does not depend on u
        u = last.get("u", context.vectors(context.scene.x0, context.scene.v0)[1])
        at, translate = (context.parts[0], x.copy(), u.copy()), run.translate
        momentum = mu.copy()

        def look() -> tuple[str, str]:
            if context.equations.s.degenerate and _off(context, at[1], momentum):
                return f"{cause}: parasitic modes may have grown", PARASITIC
            with context.numbers.working():
                singular = singular_direction(*at, translate)
            if singular is None:
                return cause, SMALLER
            direction, fix = singular
            unsolved = status == Status.NOT_CONVERGED
            return f"{cause}, for {direction}" if unsolved else direction, fix

    return context.failure(cause, {"x": x, "mu": mu, **last}, run.index, rows, look=look)


def singular_direction(
    context: StepContext, x: Vector, u: Vector, translate: int = 0
) -> tuple[str, str] | None:
    """Return (the singular matrix, ∂²l/∂ξ² or FL at (x, u), with its direction; the fix), or None.

    The mass matrix comes first: if it is singular, no step size helps. FL alone is singular at
    certain steps, perhaps only at the solution, not at Newton's start u. None if both are regular
    to round-off.
    """
    for matrix, name, letter, fix in (
        (_mass(context, x, u), "∂²l/∂ξ²", "ξ", "no smaller step helps, begin elsewhere"),
        (_FL(context, x, u, translate), "FL", "u", "take another step, or begin elsewhere"),
    ):
        if matrix is None:
            continue
        # a thousand round-offs: the derivatives are themselves sums of at most so many terms
        direction = null_direction(matrix, 2**10 * float(context.numbers.eps))
        if direction is not None:
            return f"{name} is singular in the direction ({shown(direction)}) of {letter}", fix
    return None


def _off(context: StepContext, x: Vector, mu: Vector) -> bool:
    """True if μ is off ϑ(x) by more than a rounded start explains, √ε of the larger one."""
    s = context.equations.s
    at = s.exact_parameters(context.scene)
    try:
        at |= {z: to_sympy(exact(e, "x")) for z, e in zip(s.x, x, strict=True)}
        theta = [float(e) for e in evaluate_matrix(s.one_form, 30, at)]
    except (ArithmeticError, ValueError, TypeError, NotComputed):
        return True
    size = max(map(abs, [*theta, *map(float, mu)]))
    return max(abs(a - float(b)) for a, b in zip(theta, mu, strict=True)) > 2.0**-26 * size


def _grown(context: StepContext, x: Vector) -> float:
    """The largest entry of (dϑ)⁻¹ at x over that at the start of the scene; 0 without a value."""
    s, sizes = context.equations.s, []
    for state in (context.scene.x0, x):
        at = s.exact_parameters(context.scene)
        try:
            at |= {z: to_sympy(exact(e, "x")) for z, e in zip(s.x, state, strict=True)}
            sizes.append(max(abs(e) for e in evaluate_matrix(inverse_two_form(s), 30, at)))
        except (ArithmeticError, ValueError, TypeError, NotComputed):
            return 0.0
    return float(sizes[1] / sizes[0])


def check_two_form(context: StepContext, rows: Trajectory, first: int = 0) -> None:
    """Raise `StepFailure` where dϑ changes its orientation between two rows of a run.

    No motion goes through a singular dϑ, but a step may. first: the step at which the rows begin.
    """
    signs = _orientation(context.equations.s)(
        np.asarray(rows.x, dtype=float).T, [float(e) for e in context.scene.parameter_values]
    )
    turned = np.flatnonzero(np.sign(np.broadcast_to(signs, len(rows.x))) != np.sign(signs).flat[0])
    if len(turned):
        k = int(turned[0])
        with context.numbers.working():  # rows have the numbers that users see
            before = {"x": rows.x[k - 1], "mu": rows.mu[k - 1]}
            state: dict[str, Numbers] = {e: context.vector(z, len(z)) for e, z in before.items()}
        passed = "the step passes a state where dϑ is singular"
        index = first + round(float(rows.t[k] - rows.t[0]) / float(rows.step)) - 1
        raise context.failure(passed, state, index, rows, BEFORE)


@lru_cache(maxsize=64)
def _orientation(s: SceneSymbols) -> Function:
    return numeric(
        {"x": s.x, "p": s.parameter_list}, [orientation(s)], arithmetic(16), columns=True
    )


def _FL(context: StepContext, x: Vector, u: Vector, translate: int) -> SymbolicMatrix | None:
    """Return ∂F⁻/∂u, m×m, as sympy Floats, or None if it has no value."""
    try:
        slope, digits = context.geometry_in(translate).at(x, u)["minus_u"], context.numbers.digits
        return sympy.Matrix(slope.tolist()).applyfunc(lambda e: sympy.Float(str(e), digits + 5))
    except (ArithmeticError, ValueError):  # the maps have no finite value there
        return None


def _mass(context: StepContext, x: Vector, u: Vector) -> SymbolicMatrix | None:
    """Return ∂²l/∂ξ², m×m, or None if the scene has no Lagrangian or the matrix no value."""
    s = context.equations.s
    if not context.scene.has_lagrangian or s.degenerate:
        return None
    at = dict(zip(s.parameter_list, map(to_sympy, context.scene.parameter_values), strict=True))
    try:
        at |= {v: to_sympy(exact(e, "x")) for v, e in zip([*s.x, *s.u], [*x, *u], strict=True)}
        return evaluate_matrix(mass_matrix(s).xreplace(at), context.numbers.digits)
    except (ArithmeticError, ValueError):
        return None
