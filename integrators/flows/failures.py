"""Failures of runs: the cause, the singular matrix and its direction, and the fix."""

from __future__ import annotations

from ..bisections import EdgePolicy, StepContext, edge_policies
from ..compiler import NOT_CONVERGED, SINGULAR, Run
from ..equations import mass_matrix
from ..errors import SMALLER, StepFailure
from ..numbers import Vector, evaluate_matrix, exact, null_direction, shown, sympy, to_sympy
from ..numbers.types import SymbolicMatrix

#: driver's status ↦ cause of the failure
CAUSES = {
    **edge_policies.CAUSES,
    NOT_CONVERGED: "Newton did not converge",
    SINGULAR: "FL is singular or the numbers are no longer finite",
}


def failure_of_run(edge: EdgePolicy, run: Run, status: int, rows: object) -> StepFailure:
    """Return the failure that ended a run; `rows`: its trajectory so far."""
    context, machine = edge.context, edge.machine
    x, mu = machine.point(run.state)
    last = machine.last_solution(run.resume_point)
    cause, look = CAUSES[status], None
    if edge.stages is not None and status == NOT_CONVERGED:
        cause = f"the fixed point of the stages does not contract, and {cause}"
    if context.one_step:
        last = {}  # the slope of a map is no velocity of an arrow
        if status == SINGULAR:
            cause = "a step is singular or the numbers are no longer finite"
    elif status not in edge_policies.CAUSES:
        # if Newton's start is not printed, F⁻ is affine and FL does not depend on u
        u = last.get("u", context.vectors(context.scene.x0, context.scene.v0)[1])
        at, translate = (context.parts[0], x.copy(), u.copy()), run.translate

        def look() -> tuple[str, str]:
            with context.numbers.working():
                singular = singular_direction(*at, translate)
            if singular is None:
                return cause, SMALLER
            direction, fix = singular
            return (f"{cause}, for {direction}" if status == NOT_CONVERGED else direction), fix

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
    if not context.scene.has_lagrangian:
        return None
    at = dict(zip(s.parameter_list, map(to_sympy, context.scene.parameter_values), strict=True))
    try:
        at |= {v: to_sympy(exact(e, "x")) for v, e in zip([*s.x, *s.u], [*x, *u], strict=True)}
        return evaluate_matrix(mass_matrix(s).xreplace(at), context.numbers.digits)
    except (ArithmeticError, ValueError):
        return None
